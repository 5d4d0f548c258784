//! Flat tables of typed columns, and their Parquet files.
//!
//! A table is kept by column, as Parquet keeps it: every cell of a column has the column's type or is empty. The files are
//! plain (no compression, one row group, no time stamp), so that the same table is the same bytes everywhere and any reader
//! opens it.

#[cfg(feature = "parquet")]
mod parquet_file;
mod rows;

use crate::error::Error;
pub(crate) use rows::{Row, Rows};

/// What a build without Parquet files cannot do.
const PARQUET: &str = "the reading and writing of Parquet files";

/// The cells of one column, top to bottom; `None` is an empty cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// Truth values.
    Bool(Vec<Option<bool>>),
    /// Whole numbers.
    Int(Vec<Option<i64>>),
    /// Real numbers.
    Real(Vec<Option<f64>>),
    /// UTF-8 text.
    Text(Vec<Option<String>>),
}

impl Cells {
    /// Number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Bool(cells) => cells.len(),
            Self::Int(cells) => cells.len(),
            Self::Real(cells) => cells.len(),
            Self::Text(cells) => cells.len(),
        }
    }

    /// Whether there are no cells.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A column: its name and its cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name; SI units are part of it (`range_m`).
    pub name: String,
    /// Its cells.
    pub cells: Cells,
}

/// Columns of one length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// The columns, left to right.
    pub columns: Vec<Column>,
}

impl Table {
    /// Appends a column of truth values.
    #[must_use]
    pub fn bools(self, name: &str, cells: impl IntoIterator<Item = impl Into<Option<bool>>>) -> Self {
        self.with(name, Cells::Bool(cells.into_iter().map(Into::into).collect()))
    }

    /// Appends a column of whole numbers.
    #[must_use]
    pub fn ints(self, name: &str, cells: impl IntoIterator<Item = impl Into<Option<i64>>>) -> Self {
        self.with(name, Cells::Int(cells.into_iter().map(Into::into).collect()))
    }

    /// Appends a column of real numbers.
    #[must_use]
    pub fn reals(self, name: &str, cells: impl IntoIterator<Item = impl Into<Option<f64>>>) -> Self {
        self.with(name, Cells::Real(cells.into_iter().map(Into::into).collect()))
    }

    /// Appends a column of text.
    #[must_use]
    pub fn texts(self, name: &str, cells: impl IntoIterator<Item = impl Into<Option<String>>>) -> Self {
        self.with(name, Cells::Text(cells.into_iter().map(Into::into).collect()))
    }

    fn with(mut self, name: &str, cells: Cells) -> Self {
        self.columns.push(Column { name: name.to_owned(), cells });
        self
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.cells.len())
    }

    /// The cells of the column of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Cells> {
        self.columns.iter().find(|column| column.name == name).map(|column| &column.cells)
    }

    /// Whether this build reads and writes Parquet files: for those who would otherwise learn of it after long work.
    ///
    /// # Errors
    /// [`Error::FeatureOff`] where it does not.
    pub fn check_parquet() -> crate::Result<()> {
        if cfg!(feature = "parquet") { Ok(()) } else { Err(Error::FeatureOff { what: PARQUET, feature: "parquet" }) }
    }

    /// The table as a Parquet file. `notes` are kept in the file's key-value metadata.
    ///
    /// # Errors
    /// Where columns differ in length, or two have one name: what is wrong. Where this build knows no Parquet files: that.
    pub fn to_parquet(&self, notes: &[(&str, String)]) -> Result<Vec<u8>, String> {
        for (k, column) in self.columns.iter().enumerate() {
            if column.cells.len() != self.rows() {
                return Err(format!("column {} has {} cells, the first has {}", column.name, column.cells.len(), self.rows()));
            }
            if self.columns[..k].iter().any(|other| other.name == column.name) {
                return Err(format!("two columns are called {}", column.name));
            }
        }
        parquet_file::encode(self, notes).map_err(|e| e.to_string())
    }

    /// Reads a flat Parquet file of booleans, whole numbers, real numbers and text.
    ///
    /// # Errors
    /// What does not fit: no Parquet, a damaged file, nested or other columns. Where this build knows no Parquet files: that.
    pub fn from_parquet(bytes: Vec<u8>) -> Result<Self, String> {
        parquet_file::decode(bytes).map_err(|e| e.to_string())
    }

    /// The notes in the key-value metadata of a Parquet file.
    ///
    /// # Errors
    /// When it is none, or damaged. Where this build knows no Parquet files: that.
    pub fn notes_of_parquet(bytes: &[u8]) -> Result<Vec<(String, String)>, String> {
        parquet_file::notes(bytes).map_err(|e| e.to_string())
    }
}

/// What stands in for the files of a build without them.
#[cfg(not(feature = "parquet"))]
mod parquet_file {
    use super::{PARQUET, Table};
    use crate::error::{Error, Result};

    fn off<T>() -> Result<T> {
        Err(Error::FeatureOff { what: PARQUET, feature: "parquet" })
    }

    pub(super) fn encode(_table: &Table, _notes: &[(&str, String)]) -> Result<Vec<u8>> {
        off()
    }

    pub(super) fn decode(_bytes: Vec<u8>) -> Result<Table> {
        off()
    }

    pub(super) fn notes(_bytes: &[u8]) -> Result<Vec<(String, String)>> {
        off()
    }
}
