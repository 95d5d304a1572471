//! Tables as Apache Parquet: columns with names and types, for polars, pandas, R and DuckDB to load in one line.
//!
//! Of the format only what every reader knows: one page a column and group of rows, plain values, gzip, no nesting. Numbers that are not
//! finite, and entries that are not known, are null. A group goes to the disk when it is full. The crate `parquet` was not taken: it would
//! be a third of the whole build.

use super::super::csv::{Cell, RowError};
use super::super::output::{Partial, WriteError};
use super::thrift::{Struct, varint};
use crate::model::keep::{Damage, Keep, KeptBytes};
use flate2::{Compression, write::GzEncoder};
use std::io::Write;
use std::path::Path;

/// Rows of a group.
const GROUP: usize = 1 << 17;
const MAGIC: &[u8] = b"PAR1";
const GZIP: i32 = 2;
const PLAIN: i32 = 0;
const RLE: i32 = 3;

/// Type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A real number (double).
    Number,
    /// A whole number (64 bits).
    Integer,
    /// Text (UTF-8).
    Text,
    /// True or false.
    Flag,
}

impl Kind {
    /// The physical type in the format.
    fn physical(self) -> i32 {
        match self {
            Self::Flag => 0,
            Self::Integer => 2,
            Self::Number => 5,
            Self::Text => 6,
        }
    }
}

/// The values of a column in the present group.
struct Column {
    name: String,
    kind: Kind,
    present: Vec<bool>,
    values: Vec<u8>,
    flags: Vec<bool>,
}

/// A table that grows row by row.
pub struct ParquetTable {
    file: Partial,
    columns: Vec<Column>,
    written: u64,
    rows: usize,
    in_group: usize,
    groups: Vec<Struct>,
}

impl ParquetTable {
    /// Begins a table at `path` from its columns, each a name and a type.
    ///
    /// # Errors
    /// The path and the system's reason.
    pub fn create(path: &Path, columns: &[(String, Kind)]) -> Result<Self, WriteError> {
        let mut file = Partial::create(path)?;
        file.write(MAGIC)?;
        let column = |(name, kind): &(String, Kind)| Column {
            name: name.clone(),
            kind: *kind,
            present: Vec::new(),
            values: Vec::new(),
            flags: Vec::new(),
        };
        let columns = columns.iter().map(column).collect();
        Ok(Self { file, columns, written: MAGIC.len() as u64, rows: 0, in_group: 0, groups: Vec::new() })
    }

    /// Appends a row; an entry that is not of its column's type becomes null.
    ///
    /// # Errors
    /// A row with more or fewer entries than the table has columns; the system's reason, where a full group could not be written.
    pub fn push(&mut self, row: &[Cell]) -> Result<(), super::OutputError> {
        if row.len() != self.columns.len() {
            return Err(RowError { row: self.rows, found: row.len(), columns: self.columns.len() }.into());
        }
        self.columns.iter_mut().zip(row).for_each(|(column, cell)| column.push(cell));
        self.rows += 1;
        self.in_group += 1;
        if self.in_group == GROUP {
            self.end_group()?;
        }
        Ok(())
    }

    /// Writes down what it has, the part on the disk included.
    ///
    /// # Errors
    /// The file cannot be read back.
    pub fn keep(&self, into: &mut Vec<u8>) -> Result<(), WriteError> {
        self.file.contents()?.keep(into);
        (self.rows, self.in_group).keep(into);
        self.groups.keep(into);
        for Column { present, values, flags, .. } in &self.columns {
            present.keep(into);
            values.keep(into);
            flags.keep(into);
        }
        Ok(())
    }

    /// Brings a table that has just begun to what was written down.
    ///
    /// # Errors
    /// Bytes that are of no such table; what could not be written.
    pub fn restore(&mut self, from: &mut KeptBytes) -> Result<(), super::OutputError> {
        let contents: Vec<u8> = from.read()?;
        self.file.write(contents.strip_prefix(MAGIC).unwrap_or_default())?;
        self.written = contents.len() as u64;
        (self.rows, self.in_group) = from.read()?;
        self.groups = from.read()?;
        for column in &mut self.columns {
            (column.present, column.values, column.flags) = (from.read()?, from.read()?, from.read()?);
        }
        let whole = self.groups.len().checked_mul(GROUP).and_then(|rows| rows.checked_add(self.in_group));
        let filled = self.columns.iter().all(|column| column.present.len() == self.in_group);
        if self.in_group < GROUP && whole == Some(self.rows) && filled && contents.starts_with(MAGIC) {
            return Ok(());
        }
        Err(Damage("a table for other tools has other rows".into()).into())
    }

    /// Ends the table and gives the file its name.
    ///
    /// # Errors
    /// The path and the system's reason.
    pub fn finish(mut self) -> Result<(), WriteError> {
        if self.in_group > 0 {
            self.end_group()?;
        }
        let root = Struct::default().text(4, "table").i32(5, self.columns.len() as i32);
        let schema: Vec<Struct> = std::iter::once(root).chain(self.columns.iter().map(Column::schema)).collect();
        let footer = Struct::default()
            .i32(1, 2)
            .structs(2, schema.into_iter())
            .i64(3, self.rows as i64)
            .structs(4, self.groups.into_iter())
            .text(6, concat!("tropism version ", env!("CARGO_PKG_VERSION")))
            .finish();
        self.file.write(&footer)?;
        self.file.write(&(footer.len() as u32).to_le_bytes())?;
        self.file.write(MAGIC)?;
        self.file.commit()
    }

    fn end_group(&mut self) -> Result<(), WriteError> {
        let (mut chunks, mut total) = (Vec::new(), 0);
        for column in &mut self.columns {
            let (page, plain_size) = column.take_page(self.in_group);
            let start = self.written;
            self.file.write(&page)?;
            self.written += page.len() as u64;
            total += plain_size;
            let sizes = (plain_size as i64, page.len() as i64);
            chunks.push(column.chunk(start as i64, self.in_group as i64, sizes));
        }
        let group = Struct::default().structs(1, chunks.into_iter()).i64(2, total as i64);
        self.groups.push(group.i64(3, self.in_group as i64));
        self.in_group = 0;
        Ok(())
    }
}

impl Column {
    fn push(&mut self, cell: &Cell) {
        let before = self.values.len() + self.flags.len();
        match (self.kind, cell) {
            (Kind::Number, Cell::Number(value)) if value.is_finite() => self.values.extend(value.to_le_bytes()),
            (Kind::Number, Cell::Integer(value)) => self.values.extend((*value as f64).to_le_bytes()),
            (Kind::Integer, Cell::Integer(value)) => self.values.extend(value.to_le_bytes()),
            (Kind::Text, Cell::Text(text)) => {
                self.values.extend((text.len() as u32).to_le_bytes());
                self.values.extend(text.as_bytes());
            }
            (Kind::Flag, Cell::Flag(flag)) => self.flags.push(*flag),
            _ => {}
        }
        self.present.push(self.values.len() + self.flags.len() > before);
    }

    /// `SchemaElement`: type, optional, name, and for text what it is.
    fn schema(&self) -> Struct {
        let element = Struct::default().i32(1, self.kind.physical()).i32(3, 1).text(4, &self.name);
        match self.kind {
            Kind::Text => element.i32(6, 0).inner(10, Struct::default().inner(1, Struct::default())),
            _ => element,
        }
    }

    /// `ColumnChunk`: where the page is and how it was written.
    fn chunk(&self, start: i64, rows: i64, (plain, packed): (i64, i64)) -> Struct {
        let data = Struct::default()
            .i32(1, self.kind.physical())
            .numbers(2, &[PLAIN, RLE])
            .one_text(3, &self.name)
            .i32(4, GZIP)
            .i64(5, rows)
            .i64(6, plain)
            .i64(7, packed)
            .i64(9, start);
        Struct::default().i64(2, start).inner(3, data)
    }

    /// The page of the present group with its head, and how large it would be unpacked; the column is empty afterwards.
    fn take_page(&mut self, rows: usize) -> (Vec<u8>, usize) {
        let levels = run_lengths(&self.present);
        let mut plain = [&(levels.len() as u32).to_le_bytes(), levels.as_slice()].concat();
        plain.append(&mut self.values);
        plain
            .extend(self.flags.chunks(8).map(|bits| bits.iter().rev().fold(0, |byte, &bit| byte << 1 | u8::from(bit))));
        self.flags.clear();
        self.present.clear();
        let packed = gzip(&plain);
        let data = Struct::default().i32(1, rows as i32).i32(2, PLAIN).i32(3, RLE).i32(4, RLE);
        let head = Struct::default().i32(1, 0).i32(2, plain.len() as i32).i32(3, packed.len() as i32).inner(5, data);
        let head = head.finish();
        let size = head.len() + plain.len();
        ([head, packed].concat(), size)
    }
}

/// Levels of definition, one bit each: runs of equal ones, length and level.
fn run_lengths(present: &[bool]) -> Vec<u8> {
    let runs = present.chunk_by(|a, b| a == b);
    runs.flat_map(|run| [varint((run.len() as u64) << 1), vec![u8::from(run[0])]].concat()).collect()
}

fn gzip(plain: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    // Writing to memory cannot fail.
    let _ = encoder.write_all(plain);
    encoder.finish().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    fn unpacked(bytes: &[u8]) -> Vec<u8> {
        let mut plain = Vec::new();
        flate2::read::GzDecoder::new(bytes).read_to_end(&mut plain).unwrap();
        plain
    }

    #[test]
    fn a_page_has_its_levels_and_its_plain_values() {
        let mut column =
            Column { name: "x".into(), kind: Kind::Number, present: vec![], values: vec![], flags: vec![] };
        for cell in [Cell::Number(0.5), Cell::Number(-2.0), Cell::Number(f64::NAN), Cell::Empty, Cell::Integer(3)] {
            column.push(&cell);
        }
        let (page, size) = column.take_page(5);
        let start = page.windows(2).position(|pair| pair == [0x1f, 0x8b]).unwrap();
        let plain = unpacked(&page[start..]);
        // Two known, two not, one known: six bytes of levels.
        assert_eq!(plain[..10], [6, 0, 0, 0, 4, 1, 4, 0, 2, 1]);
        let values: Vec<f64> =
            plain[10..].chunks(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap())).collect();
        assert_eq!((values, size), (vec![0.5, -2.0, 3.0], start + plain.len()));
    }

    #[test]
    fn flags_are_bits_the_first_one_lowest_and_texts_have_their_length() {
        let column = |kind| Column { name: "x".into(), kind, present: vec![], values: vec![], flags: vec![] };
        let (mut flags, mut texts) = (column(Kind::Flag), column(Kind::Text));
        (0..9).for_each(|i| flags.push(&Cell::Flag(i == 0 || i == 3 || i == 8)));
        texts.push(&Cell::from("µm"));
        let plain = |column: &mut Column, rows| {
            let (page, _) = column.take_page(rows);
            unpacked(&page[page.windows(2).position(|pair| pair == [0x1f, 0x8b]).unwrap()..])
        };
        assert_eq!(plain(&mut flags, 9)[6..], [0b1001, 1]);
        assert_eq!(plain(&mut texts, 1)[6..], [3, 0, 0, 0, 0xc2, 0xb5, b'm']);
    }

    #[test]
    fn a_row_of_the_wrong_length_is_refused_and_an_abandoned_table_leaves_no_file() {
        let folder = std::env::temp_dir().join(format!("tropism-parquet-{}", std::process::id()));
        let path = folder.join("table.parquet");
        let mut table = ParquetTable::create(&path, &[("x".into(), Kind::Number)]).unwrap();
        assert!(table.push(&[]).unwrap_err().to_string().contains("0 entries"));
        drop(table);
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
        let mut table = ParquetTable::create(&path, &[("x".into(), Kind::Number)]).unwrap();
        (0..3).for_each(|i| table.push(&[Cell::Integer(i)]).unwrap());
        table.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let length = u32::from_le_bytes(bytes[bytes.len() - 8..][..4].try_into().unwrap()) as usize;
        assert!(bytes.starts_with(MAGIC) && bytes.ends_with(MAGIC) && length + 12 < bytes.len());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
