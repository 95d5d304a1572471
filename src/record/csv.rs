//! Tables as CSV (RFC 4180): one header line that carries the units, numbers in the shortest form that reads back to
//! the same bits.

use super::output::{WriteError, write_atomically};
use crate::kept;
use rayon::prelude::*;
use std::borrow::Cow;
use std::fmt::Write;
use std::path::Path;

/// Rows formatted as one task.
const PIECE: usize = 128;

/// One entry of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A real number; one that is not finite is written as an empty entry.
    Number(f64),
    /// A whole number.
    Integer(i64),
    /// Text, quoted where needed.
    Text(String),
    /// `true` or `false`.
    Flag(bool),
    /// Nothing known: an empty entry.
    Empty,
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<Option<f64>> for Cell {
    fn from(value: Option<f64>) -> Self {
        value.map_or(Self::Empty, Self::Number)
    }
}

impl From<usize> for Cell {
    fn from(value: usize) -> Self {
        i64::try_from(value).map_or(Self::Text(value.to_string()), Self::Integer)
    }
}

impl From<&str> for Cell {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl From<bool> for Cell {
    fn from(value: bool) -> Self {
        Self::Flag(value)
    }
}

/// A row does not fit its table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("row {row} has {found} entries, the table has {columns} columns")]
pub struct RowError {
    /// The row, counted from 0 below the header.
    pub row: usize,
    /// Entries given.
    pub found: usize,
    /// Columns of the table.
    pub columns: usize,
}

/// A table under construction.
#[derive(Debug, Clone, PartialEq)]
pub struct CsvTable {
    text: String,
    columns: usize,
    rows: usize,
}

kept! { struct CsvTable { text, columns, rows } }

impl CsvTable {
    /// Starts a table from its columns, each a name and a unit (`("x", "um")` heads the column `x [um]`; an empty unit
    /// leaves the name alone).
    pub fn new(columns: &[(&str, &str)]) -> Self {
        let head = |(name, unit): &(&str, &str)| match *unit {
            "" => (*name).to_owned(),
            unit => format!("{name} [{unit}]"),
        };
        let mut text = String::new();
        append_line(&mut text, &columns.iter().map(|column| Cell::Text(head(column))).collect::<Vec<_>>());
        Self { text, columns: columns.len(), rows: 0 }
    }

    /// Appends a row.
    ///
    /// # Errors
    /// A row with more or fewer entries than the table has columns; the table is left as it was.
    pub fn push(&mut self, row: &[Cell]) -> Result<(), RowError> {
        if row.len() != self.columns {
            return Err(RowError { row: self.rows, found: row.len(), columns: self.columns });
        }
        append_line(&mut self.text, row);
        self.rows += 1;
        Ok(())
    }

    /// Appends `count` rows that `row` gives by their number; they are formatted in parallel and stand in order.
    ///
    /// # Errors
    /// As [`Self::push`], if a row has not one entry a column.
    pub fn push_all<const N: usize>(
        &mut self,
        count: usize,
        row: impl Fn(usize) -> [Cell; N] + Sync,
    ) -> Result<(), RowError> {
        if N != self.columns {
            return Err(RowError { row: self.rows, found: N, columns: self.columns });
        }
        let piece = |first: usize| {
            let mut text = String::new();
            (first..count.min(first + PIECE)).for_each(|i| append_line(&mut text, &row(i)));
            text
        };
        let pieces: Vec<String> = (0..count.div_ceil(PIECE)).into_par_iter().map(|i| piece(i * PIECE)).collect();
        pieces.iter().for_each(|piece| self.text.push_str(piece));
        self.rows += count;
        Ok(())
    }

    /// Whether it may be another table with rows appended. (An entry may break a line: rows are at most as many as lines.)
    pub fn continues(&self, other: &Self) -> bool {
        let lines = self.text.strip_prefix(&other.text).map(|rows| rows.bytes().filter(|byte| *byte == b'\n').count());
        let rows = self.rows.checked_sub(other.rows);
        self.columns == other.columns && lines.zip(rows).is_some_and(|(lines, rows)| rows <= lines)
    }

    /// The number of rows below the header.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The table as text, lines ended by a line feed.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Writes the table to a file, whole or not at all.
    ///
    /// # Errors
    /// The path and the system's reason.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomically(path, self.text.as_bytes())
    }
}

fn append_line(text: &mut String, row: &[Cell]) {
    for (index, cell) in row.iter().enumerate() {
        if index > 0 {
            text.push(',');
        }
        append(text, cell);
    }
    text.push('\n');
}

/// A number in the shortest form that reads back to the same bits, by exponent where plain digits would be long; an empty
/// string for one that is not finite.
pub fn format_number(value: f64) -> String {
    let mut text = String::new();
    append(&mut text, &Cell::Number(value));
    text
}

fn append(text: &mut String, cell: &Cell) {
    // Writing to a string cannot fail.
    let _ = match cell {
        Cell::Number(value) if !value.is_finite() => Ok(()),
        Cell::Number(value) if *value == 0.0 || (1e-4..1e15).contains(&value.abs()) => write!(text, "{value}"),
        Cell::Number(value) => write!(text, "{value:e}"),
        Cell::Integer(value) => write!(text, "{value}"),
        Cell::Text(entry) => write!(text, "{}", quoted(entry)),
        Cell::Flag(flag) => write!(text, "{flag}"),
        Cell::Empty => Ok(()),
    };
}

fn quoted(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\"")).into()
    } else {
        text.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_reads_as_written() {
        let mut table = CsvTable::new(&[("axon", ""), ("x", "um"), ("status", ""), ("hit", "")]);
        table.push(&[3_usize.into(), 0.1.into(), "left, then \"back\"".into(), true.into()]).unwrap();
        table.push(&[4_usize.into(), None.into(), Cell::Empty, Cell::Number(f64::NAN)]).unwrap();
        assert_eq!(table.as_str(), "axon,x [um],status,hit\n3,0.1,\"left, then \"\"back\"\"\",true\n4,,,\n");
        assert_eq!(table.rows(), 2);
    }

    #[test]
    fn every_number_reads_back_to_the_same_bits() {
        for value in [0.1, 1.0 / 3.0, -0.0, 6.02e23, 5e-324, f64::MAX, 1e-4, 123_456.789, 2.0_f64.powi(60)] {
            let read: f64 = format_number(value).parse().unwrap();
            assert_eq!(read.to_bits(), value.to_bits(), "{value}");
            assert!(format_number(value).len() < 25);
        }
    }

    #[test]
    fn a_row_of_the_wrong_length_is_refused_and_changes_nothing() {
        let mut table = CsvTable::new(&[("t", "h"), ("hits", "")]);
        let before = table.clone();
        assert_eq!(table.push(&[1.0.into()]), Err(RowError { row: 0, found: 1, columns: 2 }));
        assert_eq!(table, before);
    }
}
