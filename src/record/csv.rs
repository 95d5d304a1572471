//! Tables as CSV (RFC 4180): one header line that carries the units, numbers in the shortest form that reads back to
//! the same bits.

use super::output::{Partial, WriteError, write_atomically};
use crate::model::keep::{Damage, Keep, KeptBytes};
use rayon::prelude::*;
use std::borrow::Cow;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Rows formatted as one task.
const PIECE: usize = 128;
/// Text (bytes) that a table keeps in memory at most between two rounds of rows, once it may stream. Ours.
pub const IN_MEMORY: usize = 16 << 20;

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
#[derive(Debug)]
pub struct CsvTable {
    /// What has not gone to the disk.
    text: String,
    columns: usize,
    rows: usize,
    stream: Option<Stream>,
}

/// Where the text of a table goes as it grows.
#[derive(Debug)]
struct Stream {
    path: PathBuf,
    /// Text (bytes) that is kept in memory.
    in_memory: usize,
    /// The file, once something has gone there.
    file: Option<Partial>,
    /// Whether the disk took no more: the rest is kept in memory, and tried again at the end.
    is_refused: bool,
}

// The text in memory; what has gone to the disk is kept by `keep_streamed`, since it may not read back.
impl Keep for CsvTable {
    fn keep(&self, into: &mut Vec<u8>) {
        self.text.keep(into);
        (self.columns, self.rows).keep(into);
    }

    fn restore(from: &mut KeptBytes) -> Result<Self, Damage> {
        let text = from.read()?;
        let (columns, rows) = from.read()?;
        Ok(Self { text, columns, rows, stream: None })
    }
}

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
        Self { text, columns: columns.len(), rows: 0, stream: None }
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
        self.relieve();
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
        self.relieve();
        Ok(())
    }

    /// Lets text beyond `in_memory` bytes go to the disk on the way, under a temporary name beside `path`, the file that the table will
    /// be written to.
    pub fn stream_into(&mut self, path: &Path, in_memory: usize) {
        self.stream = Some(Stream { path: path.to_owned(), in_memory, file: None, is_refused: false });
    }

    /// Lets what has grown too large go to the disk. What cannot be written there stays.
    fn relieve(&mut self) {
        let Some(stream) = self.stream.as_mut().filter(|stream| !stream.is_refused) else { return };
        if self.text.len() > stream.in_memory {
            let file = stream.file.take().map_or_else(|| Partial::create(&stream.path), Ok);
            let written = file.and_then(|file| stream.file.insert(file).write(self.text.as_bytes()));
            stream.is_refused = written.is_err();
            if written.is_ok() {
                self.text.clear();
            }
        }
    }

    /// Writes down the text that has gone to the disk.
    ///
    /// # Errors
    /// A file that does not read back.
    pub fn keep_streamed(&self, into: &mut Vec<u8>) -> Result<(), WriteError> {
        let file = self.stream.as_ref().and_then(|stream| stream.file.as_ref());
        let bytes = file.map_or(Ok(Vec::new()), Partial::contents)?;
        bytes.len().keep(into);
        into.extend(bytes);
        Ok(())
    }

    /// Puts the text that was written down as gone to the disk before that in memory, and streams to where `fresh` does.
    ///
    /// # Errors
    /// Bytes that are no text.
    pub fn restore_streamed(&mut self, from: &mut KeptBytes, fresh: &mut Self) -> Result<(), Damage> {
        let before: String = from.read()?;
        self.text.insert_str(0, &before);
        self.stream = fresh.stream.take();
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

    /// The table as text, lines ended by a line feed, of one that does not stream.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Writes the table to a file, whole or not at all: that into which it streams, if it does.
    ///
    /// # Errors
    /// The path and the system's reason.
    pub fn write(&mut self, path: &Path) -> Result<(), WriteError> {
        match self.stream.take().and_then(|stream| stream.file) {
            Some(mut file) => file.write(self.text.as_bytes()).and_then(|()| file.commit()),
            None => write_atomically(path, self.text.as_bytes()),
        }
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
        let before = table.as_str().to_owned();
        assert_eq!(table.push(&[1.0.into()]), Err(RowError { row: 0, found: 1, columns: 2 }));
        assert_eq!((table.as_str(), table.rows()), (before.as_str(), 0));
    }

    fn heads() -> CsvTable {
        CsvTable::new(&[("time", "h"), ("axon", "")])
    }

    fn grow(table: &mut CsvTable, rounds: std::ops::Range<u32>) {
        rounds.for_each(|round| table.push_all(300, |i| [f64::from(round).into(), i.into()]).unwrap());
    }

    #[test]
    fn a_table_that_streams_has_little_in_memory_and_the_same_bytes_in_the_end_and_when_it_goes_on() {
        let folder = std::env::temp_dir().join(format!("tropism-stream-{}", std::process::id()));
        let (path, begun) = (folder.join("table.csv"), folder.join(".table.csv.partial"));
        let mut whole = heads();
        grow(&mut whole, 0..10);
        let mut table = heads();
        table.stream_into(&path, 1000);
        grow(&mut table, 0..6);
        assert!(table.text.len() <= 1000 && begun.exists() && !path.exists());
        let mut kept = Vec::new();
        table.keep(&mut kept);
        table.keep_streamed(&mut kept).unwrap();
        grow(&mut table, 6..10);
        table.write(&path).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap() == whole.as_str() && !begun.exists());
        // Another one goes on from what was written down.
        let (mut from, mut fresh) = (KeptBytes::new(&kept), heads());
        fresh.stream_into(&path, 1000);
        let mut again: CsvTable = from.read().unwrap();
        again.restore_streamed(&mut from, &mut fresh).unwrap();
        assert!(again.continues(&fresh) && again.rows() == 1800 && from.left() == 0);
        grow(&mut again, 6..10);
        assert!(again.text.len() <= 1000);
        again.write(&path).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap() == whole.as_str());
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_the_disk_does_not_take_stays_in_memory_and_is_tried_again_at_the_end() {
        let folder = std::env::temp_dir().join(format!("tropism-refused-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("file");
        std::fs::write(&file, "in the way").unwrap();
        let path = file.join("table.csv");
        let (mut table, mut whole) = (heads(), heads());
        table.stream_into(&path, 1000);
        for table in [&mut table, &mut whole] {
            grow(table, 0..10);
        }
        assert_eq!(table.as_str(), whole.as_str());
        assert_eq!(table.write(&path).unwrap_err().path, path);
        std::fs::remove_file(&file).unwrap();
        table.write(&path).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap() == whole.as_str());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
