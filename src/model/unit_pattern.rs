//! Texts with a unit as a regular expression (ECMA 262, as JSON Schema wants it), for editors that cannot compare dimensions.
//!
//! A text of a dimension names a unit of each base dimension that the dimension has; one that it has not is named twice, to
//! cancel, or not at all. So the expression refuses `"20 um"` for a speed and accepts every text that [`Kind::read`] reads.

use super::quantity::Kind;
use super::unit::{DIMENSIONS, Unit, UnitError, symbols_with};

/// Characters that a symbol is made of.
const LETTERS: &str = "A-Za-z%°µμ";

/// The expression that every text of a kind fits.
///
/// # Errors
/// A unit of the kind that cannot be read.
pub fn pattern_of(kind: Kind<'_>) -> Result<String, UnitError> {
    let unit = Unit::parse(kind.unit)?;
    let mut pattern = "^".to_owned();
    for base in 0..DIMENSIONS {
        let symbols: Vec<String> =
            symbols_with(base).map(|(symbol, prefixes)| with_prefixes(symbol, prefixes)).collect();
        let named = format!(".*[^{LETTERS}](?:{})(?![{LETTERS}])", symbols.join("|"));
        pattern += &match unit.power_of(base) {
            0 => format!("(?:(?!{named})|(?={named}{named}))"),
            _ => format!("(?={named})"),
        };
    }
    Ok(pattern + r"\s*[+-]?\.?[0-9]")
}

fn with_prefixes(symbol: &str, prefixes: &str) -> String {
    match prefixes.contains('u') {
        _ if prefixes.is_empty() => symbol.to_owned(),
        true => format!("[{prefixes}µμ]?{symbol}"),
        false => format!("[{prefixes}]?{symbol}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dimension_that_a_kind_has_is_asked_for_and_another_one_may_only_cancel() {
        let pattern = pattern_of(Kind { name: "angular speed", unit: "deg/h" }).unwrap();
        let time = "(?=.*[^A-Za-z%°µμ](?:[numµμ]?s|sec|min|minute|minutes|h|hour|hours|d|day|days)(?![A-Za-z%°µμ]))";
        let voltage = ".*[^A-Za-z%°µμ](?:[numkµμ]?V)(?![A-Za-z%°µμ])";
        assert!(pattern.contains(time), "{pattern}");
        assert!(pattern.contains(&format!("(?:(?!{voltage})|(?={voltage}{voltage}))")), "{pattern}");
        assert!(pattern.contains("(?=.*[^A-Za-z%°µμ](?:deg|°|[m]?rad)(?![A-Za-z%°µμ]))"), "{pattern}");
        assert!(pattern_of(Kind { name: "nothing", unit: "furlong" }).is_err());
    }
}
