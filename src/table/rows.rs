//! Tables that people and other programs write as CSV: cells by the names of their columns, faults by line and column.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// A table with a header and at least one row.
pub(crate) struct Rows {
    path: PathBuf,
    header: csv::StringRecord,
    records: Vec<csv::StringRecord>,
}

/// A row of it.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a> {
    table: &'a Rows,
    record: &'a csv::StringRecord,
}

impl Rows {
    /// Parses the text of the file at `path`. Cells lose the space about them; rows may be shorter than the header.
    ///
    /// # Errors
    /// When it is no CSV, or has no row for each `what`.
    pub fn parse(text: &[u8], path: &Path, what: &str) -> Result<Self> {
        let fault = |message: String| Error::Parse { path: path.to_owned(), message };
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text);
        let header = reader.headers().map_err(|e| fault(e.to_string()))?.clone();
        let records = reader.records().collect::<std::result::Result<_, _>>().map_err(|e| fault(e.to_string()))?;
        let table = Self { path: path.to_owned(), header, records };
        if table.records.is_empty() && !table.header.is_empty() {
            return Err(fault(format!("found no row, expected one for each {what}")));
        }
        Ok(table)
    }

    /// The rows, in order.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.records.iter().map(|record| Row { table: self, record })
    }

    /// The first of some columns that the table has.
    pub fn column(&self, names: &[&str]) -> Option<usize> {
        names.iter().find_map(|name| self.header.iter().position(|h| h == *name))
    }

    /// The same.
    ///
    /// # Errors
    /// When it has none of them.
    pub fn needed(&self, names: &[&str]) -> Result<usize> {
        self.column(names).ok_or_else(|| {
            let found = self.header.iter().collect::<Vec<_>>().join(",");
            self.fault(&format!("line 1: found `{found}`, expected a column `{}`", names.join("` or `")))
        })
    }

    /// The columns of a table that has these in any order and no others, in all rows.
    ///
    /// # Errors
    /// When it has others, or a row is shorter or longer.
    pub fn exactly<const N: usize>(&self, names: [&str; N]) -> Result<[usize; N]> {
        let mut columns = [0; N];
        for (column, name) in columns.iter_mut().zip(names) {
            *column = self.needed(&[name])?;
        }
        let header = Row { table: self, record: &self.header };
        match [header].into_iter().chain(self.rows()).find(|row| row.record.len() != N) {
            Some(row) => {
                let found = row.record.iter().collect::<Vec<_>>().join(",");
                Err(self.fault(&format!("line {}: found `{found}`, expected {N} cells: {}", row.line(), names.join(","))))
            }
            None => Ok(columns),
        }
    }

    /// An error about this table.
    pub fn fault(&self, message: &str) -> Error {
        Error::Parse { path: self.path.clone(), message: message.to_owned() }
    }
}

impl<'a> Row<'a> {
    /// Its line, from 1.
    pub fn line(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }

    /// What stands in a column; nothing where the row is too short.
    pub fn cell(&self, column: usize) -> &'a str {
        self.record.get(column).unwrap_or_default()
    }

    /// The value of a column.
    ///
    /// # Errors
    /// When it is not what is `expected`: line, column and what was found.
    pub fn value<T>(&self, column: usize, expected: &str, read: impl Fn(&str) -> Option<T>) -> Result<T> {
        let cell = self.cell(column);
        read(cell).ok_or_else(|| {
            let name = self.table.header.get(column).unwrap_or_default();
            self.table.fault(&format!("line {}, {name}: found `{cell}`, expected {expected}", self.line()))
        })
    }

    /// A finite number.
    ///
    /// # Errors
    /// As [`Row::value`].
    pub fn number(&self, column: usize) -> Result<f64> {
        self.value(column, "a finite number", |cell| cell.parse().ok().filter(|x: &f64| x.is_finite()))
    }
}
