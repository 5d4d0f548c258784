//! Flat tables of typed columns, and their Parquet files.
//!
//! A table is kept by column, as Parquet keeps it: every cell of a column has the column's type or is empty. The files are
//! plain (no compression, one row group, no time stamp), so that the same table is the same bytes everywhere and any reader
//! opens it.

mod rows;

use std::sync::Arc;

use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::record::Field;
use parquet::schema::types::Type;

pub(crate) use rows::{Row, Rows};

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

    /// The table as a Parquet file. `notes` are kept in the file's key-value metadata.
    ///
    /// # Errors
    /// Where columns differ in length, or two have one name: what is wrong.
    pub fn to_parquet(&self, notes: &[(&str, String)]) -> Result<Vec<u8>, String> {
        for (k, column) in self.columns.iter().enumerate() {
            if column.cells.len() != self.rows() {
                return Err(format!("column {} has {} cells, the first has {}", column.name, column.cells.len(), self.rows()));
            }
            if self.columns[..k].iter().any(|other| other.name == column.name) {
                return Err(format!("two columns are called {}", column.name));
            }
        }
        self.encode(notes).map_err(|e| e.to_string())
    }

    fn encode(&self, notes: &[(&str, String)]) -> Result<Vec<u8>, ParquetError> {
        let fields = self.columns.iter().map(field).collect::<Result<_, _>>()?;
        let schema = Arc::new(Type::group_type_builder("rows").with_fields(fields).build()?);
        let notes = notes.iter().map(|(key, value)| KeyValue::new((*key).to_owned(), value.clone())).collect();
        let properties = WriterProperties::builder()
            .set_created_by(format!("wayhome {}", crate::VERSION))
            .set_key_value_metadata(Some(notes))
            .build();
        let mut bytes = Vec::new();
        let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties))?;
        let mut group = writer.next_row_group()?;
        for column in &self.columns {
            let Some(mut out) = group.next_column()? else { break };
            match &column.cells {
                Cells::Bool(cells) => write::<BoolType, _>(&mut out, cells, |&x| x)?,
                Cells::Int(cells) => write::<Int64Type, _>(&mut out, cells, |&x| x)?,
                Cells::Real(cells) => write::<DoubleType, _>(&mut out, cells, |&x| x)?,
                Cells::Text(cells) => write::<ByteArrayType, _>(&mut out, cells, |x| ByteArray::from(x.as_str()))?,
            }
            out.close()?;
        }
        group.close()?;
        writer.close()?;
        Ok(bytes)
    }

    /// Reads a flat Parquet file of booleans, whole numbers, real numbers and text.
    ///
    /// # Errors
    /// What does not fit: no Parquet, a damaged file, nested or other columns.
    pub fn from_parquet(bytes: Vec<u8>) -> Result<Self, String> {
        Self::decode(bytes).map_err(|e| e.to_string())
    }

    /// The notes in the key-value metadata of a Parquet file.
    ///
    /// # Errors
    /// When it is none, or damaged.
    pub fn notes_of_parquet(bytes: &[u8]) -> Result<Vec<(String, String)>, String> {
        let reader = SerializedFileReader::new(bytes::Bytes::copy_from_slice(bytes)).map_err(|e| e.to_string())?;
        let notes = reader.metadata().file_metadata().key_value_metadata().cloned().unwrap_or_default();
        Ok(notes.into_iter().filter_map(|note| Some((note.key, note.value?))).collect())
    }

    fn decode(bytes: Vec<u8>) -> Result<Self, ParquetError> {
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes))?;
        let schema = reader.metadata().file_metadata().schema().clone();
        let mut columns = Vec::new();
        for field in schema.get_fields() {
            let unfit = || ParquetError::General(format!("column {}: neither boolean, number nor text", field.name()));
            if !field.is_primitive() {
                return Err(unfit());
            }
            let cells = match field.get_physical_type() {
                Physical::BOOLEAN => Cells::Bool(Vec::new()),
                Physical::INT32 | Physical::INT64 => Cells::Int(Vec::new()),
                Physical::FLOAT | Physical::DOUBLE => Cells::Real(Vec::new()),
                Physical::BYTE_ARRAY => Cells::Text(Vec::new()),
                _ => return Err(unfit()),
            };
            columns.push(Column { name: field.name().to_owned(), cells });
        }
        for row in reader.get_row_iter(None)? {
            for (column, (name, field)) in columns.iter_mut().zip(row?.get_column_iter()) {
                let pushed = match (&mut column.cells, field) {
                    (Cells::Bool(cells), Field::Null) => push(cells, None),
                    (Cells::Int(cells), Field::Null) => push(cells, None),
                    (Cells::Real(cells), Field::Null) => push(cells, None),
                    (Cells::Text(cells), Field::Null) => push(cells, None),
                    (Cells::Bool(cells), Field::Bool(x)) => push(cells, Some(*x)),
                    (Cells::Int(cells), Field::Int(x)) => push(cells, Some(i64::from(*x))),
                    (Cells::Int(cells), Field::Long(x)) => push(cells, Some(*x)),
                    (Cells::Real(cells), Field::Float(x)) => push(cells, Some(f64::from(*x))),
                    (Cells::Real(cells), Field::Double(x)) => push(cells, Some(*x)),
                    (Cells::Text(cells), Field::Str(x)) => push(cells, Some(x.clone())),
                    _ => false,
                };
                if !pushed {
                    return Err(ParquetError::General(format!("column {name}: neither boolean, number nor text")));
                }
            }
        }
        Ok(Self { columns })
    }
}

fn push<T>(cells: &mut Vec<Option<T>>, cell: Option<T>) -> bool {
    cells.push(cell);
    true
}

fn field(column: &Column) -> Result<Arc<Type>, ParquetError> {
    let (physical, converted) = match column.cells {
        Cells::Bool(_) => (Physical::BOOLEAN, ConvertedType::NONE),
        Cells::Int(_) => (Physical::INT64, ConvertedType::NONE),
        Cells::Real(_) => (Physical::DOUBLE, ConvertedType::NONE),
        Cells::Text(_) => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
    };
    let builder = Type::primitive_type_builder(&column.name, physical).with_repetition(Repetition::OPTIONAL);
    Ok(Arc::new(builder.with_converted_type(converted).build()?))
}

fn write<T: DataType, C>(
    out: &mut SerializedColumnWriter<'_>,
    cells: &[Option<C>],
    value: impl Fn(&C) -> T::T,
) -> Result<(), ParquetError> {
    let levels: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    let values: Vec<T::T> = cells.iter().flatten().map(value).collect();
    out.typed::<T>().write_batch(&values, Some(&levels), None)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_comes_back_from_its_file() {
        let table = Table::default()
            .bools("home", [Some(true), None, Some(false)])
            .ints("seed", [1, 2, i64::MIN])
            .reals("range_m", [Some(0.1), None, Some(f64::INFINITY)])
            .texts("outcome", [Some("home".to_owned()), Some(String::new()), None]);
        let bytes = table.to_parquet(&[("study", "slip".to_owned())]).unwrap();
        assert_eq!(table.to_parquet(&[("study", "slip".to_owned())]).unwrap(), bytes);
        assert_eq!(Table::from_parquet(bytes.clone()).unwrap(), table);
        assert_eq!(Table::notes_of_parquet(&bytes).unwrap(), [("study".to_owned(), "slip".to_owned())]);
        for cut in [0, 7, bytes.len() / 2, bytes.len() - 1] {
            assert!(Table::from_parquet(bytes[..cut].to_vec()).is_err(), "cut at {cut}");
        }
        let empty = Table::default().ints("seed", Vec::<i64>::new());
        assert_eq!(Table::from_parquet(empty.to_parquet(&[]).unwrap()).unwrap(), empty);
        assert!(table.clone().ints("home", [1, 2, 3]).to_parquet(&[]).unwrap_err().contains("home"));
        assert!(table.ints("more", [1]).to_parquet(&[]).unwrap_err().contains("more"));
    }
}
