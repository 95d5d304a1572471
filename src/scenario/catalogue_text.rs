//! The catalogue as text: aligned columns, no line longer than a terminal of 120 columns.

use std::fmt;

use super::catalogue::{Block, Catalogue, Key};

/// Columns of the terminal.
const WIDTH: usize = 120;

/// Columns before a description.
const INDENT: usize = 6;

impl fmt::Display for Catalogue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, block) in self.mechanisms.iter().chain(&self.scene).enumerate() {
            if index > 0 {
                writeln!(formatter)?;
            }
            write!(formatter, "{block}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Block {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "{}", self.name)?;
        write_wrapped(formatter, &self.summary, 2, 2)?;
        if let Some(equation) = &self.equation {
            write_wrapped(formatter, equation, 4, 6)?;
        }
        if self.keys.is_empty() {
            return writeln!(formatter, "  no keys");
        }
        writeln!(formatter)?;
        let head = ["key", "unit or type", "possible", "usual", "default"].map(str::to_owned);
        let rows: Vec<_> = std::iter::once(head).chain(self.keys.iter().map(cells)).collect();
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..5).map(width).collect();
        for (index, row) in rows.iter().enumerate() {
            let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
            writeln!(formatter, "  {}", cells.collect::<Vec<_>>().join("  ").trim_end())?;
            if let Some(key) = index.checked_sub(1).map(|index| &self.keys[index]) {
                write_explanation(formatter, key)?;
            }
        }
        Ok(())
    }
}

fn cells(key: &Key) -> [String; 5] {
    let or_empty = |cell: &Option<String>| cell.clone().unwrap_or_default();
    [key.key.clone(), key.kind.clone(), or_empty(&key.possible), or_empty(&key.usual), or_empty(&key.default)]
}

fn write_explanation(formatter: &mut fmt::Formatter<'_>, key: &Key) -> fmt::Result {
    write_wrapped(formatter, &key.description, INDENT, INDENT)?;
    let width = key.words.iter().map(|word| word.word.chars().count()).max().unwrap_or(0);
    for word in &key.words {
        let text = format!("{:width$}  {}", word.word, word.description);
        write_wrapped(formatter, text.trim_end(), INDENT + 2, INDENT + 4 + width)?;
    }
    Ok(())
}

/// Writes words in lines of at most [`WIDTH`] columns, the first indented by `first`, the others by `next`.
fn write_wrapped(formatter: &mut fmt::Formatter<'_>, text: &str, first: usize, next: usize) -> fmt::Result {
    let mut line = " ".repeat(first);
    let mut is_empty = true;
    for word in text.split(' ') {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
            writeln!(formatter, "{}", line.trim_end())?;
            (line, is_empty) = (" ".repeat(next), true);
        }
        if !is_empty {
            line.push(' ');
        }
        line.push_str(word);
        is_empty = false;
    }
    if text.is_empty() { Ok(()) } else { writeln!(formatter, "{}", line.trim_end()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Wrapped<'a>(&'a str);

    impl fmt::Display for Wrapped<'_> {
        fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            write_wrapped(formatter, self.0, 2, 4)
        }
    }

    #[test]
    fn lines_end_before_the_terminal_does_and_no_word_is_lost() {
        let text = "λ of the pull ".repeat(40);
        let wrapped = Wrapped(text.trim()).to_string();
        assert!(wrapped.lines().all(|line| line.chars().count() <= WIDTH && line.starts_with("  ")));
        assert_eq!(wrapped.split_whitespace().collect::<Vec<_>>(), text.split_whitespace().collect::<Vec<_>>());
        assert_eq!(Wrapped("").to_string(), "");
    }
}
