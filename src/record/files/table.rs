//! A table in the forms that a scene asks for.

use super::super::csv::{Cell, CsvTable, IN_MEMORY};
use super::super::output::WriteError;
use super::OutputError;
use super::parquet::{Kind, ParquetTable};
use crate::model::keep::{Damage, Keep, KeptBytes};
use crate::scenario::scene::Tables;
use std::path::{Path, PathBuf};

/// Name, unit (empty: none) and type of a column.
pub type Heading<'a> = (&'a str, &'a str, Kind);

/// A table that grows row by row, as text and as columns.
pub struct Table {
    csv: Option<(PathBuf, CsvTable)>,
    parquet: Option<ParquetTable>,
}

impl Table {
    /// Begins the table `name` in a folder.
    ///
    /// # Errors
    /// What could not be written.
    pub fn create(folder: &Path, name: &str, forms: Tables, columns: &[Heading]) -> Result<Self, OutputError> {
        let path = |ending: &str| folder.join(format!("{name}.{ending}"));
        let heads: Vec<(&str, &str)> = columns.iter().map(|(name, unit, _)| (*name, *unit)).collect();
        let csv = forms.are_csv().then(|| {
            let mut table = CsvTable::new(&heads);
            table.stream_into(&path("csv"), IN_MEMORY);
            (path("csv"), table)
        });
        let head = |(name, unit, kind): &Heading| match *unit {
            "" => ((*name).to_owned(), *kind),
            unit => (format!("{name} [{unit}]"), *kind),
        };
        let columns: Vec<(String, Kind)> = columns.iter().map(head).collect();
        let parquet = forms.are_parquet().then(|| ParquetTable::create(&path("parquet"), &columns)).transpose()?;
        Ok(Self { csv, parquet })
    }

    /// Appends a row.
    ///
    /// # Errors
    /// A row that does not fit; what could not be written.
    pub fn push(&mut self, row: &[Cell]) -> Result<(), OutputError> {
        if let Some((_, csv)) = &mut self.csv {
            csv.push(row)?;
        }
        self.parquet.as_mut().map_or(Ok(()), |parquet| parquet.push(row))
    }

    /// Writes down what it has.
    ///
    /// # Errors
    /// A file that cannot be read back.
    pub fn keep(&self, into: &mut Vec<u8>) -> Result<(), WriteError> {
        if let Some((_, csv)) = &self.csv {
            csv.keep(into);
            csv.keep_streamed(into)?;
        }
        self.parquet.as_ref().map_or(Ok(()), |parquet| parquet.keep(into))
    }

    /// Brings a table that has just begun to what was written down.
    ///
    /// # Errors
    /// Bytes that are of no such table; what could not be written.
    pub fn restore(&mut self, from: &mut KeptBytes) -> Result<(), OutputError> {
        if let Some((_, csv)) = &mut self.csv {
            let mut read: CsvTable = from.read()?;
            read.restore_streamed(from, csv)?;
            if !read.continues(csv) {
                return Err(Damage("a table for other tools has other columns".into()).into());
            }
            *csv = read;
        }
        self.parquet.as_mut().map_or(Ok(()), |parquet| parquet.restore(from))
    }

    /// Ends the files.
    ///
    /// # Errors
    /// What could not be written.
    pub fn finish(self) -> Result<(), OutputError> {
        if let Some((path, mut csv)) = self.csv {
            csv.write(&path)?;
        }
        Ok(self.parquet.map_or(Ok(()), ParquetTable::finish)?)
    }
}
