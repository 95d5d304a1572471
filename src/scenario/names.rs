//! What may be a name: it stands in messages, tables, figures and names of files.

/// Signs of a name at most.
pub const LONGEST: usize = 100;

/// Whether a text may be a name.
pub fn is_name(text: &str) -> bool {
    text.chars().take(LONGEST + 1).count() <= LONGEST && !text.contains(char::is_control)
}

/// Why a text is none.
pub fn no_name(text: &str) -> String {
    let begin: String = text.chars().take(20).flat_map(char::escape_debug).collect();
    format!("\"{begin}…\" is no name: at most {LONGEST} signs, none of them a control sign such as a line's end")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_short_and_can_be_printed() {
        assert!(is_name("Netrin-1 (β)") && is_name("") && is_name(&"ü".repeat(LONGEST)));
        for text in ["a\u{7}", "a\nb", "\u{1b}[31m", &"a".repeat(LONGEST + 1)] {
            assert!(!is_name(text) && !no_name(text).contains(char::is_control), "{text:?}");
        }
    }
}
