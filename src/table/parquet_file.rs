//! Tables as Parquet files.

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

use super::{Cells, Column, Table};

pub(super) fn encode(table: &Table, notes: &[(&str, String)]) -> Result<Vec<u8>, ParquetError> {
    let fields = table.columns.iter().map(field).collect::<Result<_, _>>()?;
    let schema = Arc::new(Type::group_type_builder("rows").with_fields(fields).build()?);
    let notes = notes.iter().map(|(key, value)| KeyValue::new((*key).to_owned(), value.clone())).collect();
    let properties = WriterProperties::builder()
        .set_created_by(format!("wayhome {}", crate::VERSION))
        .set_key_value_metadata(Some(notes))
        .build();
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for column in &table.columns {
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

pub(super) fn notes(bytes: &[u8]) -> Result<Vec<(String, String)>, ParquetError> {
    let reader = SerializedFileReader::new(bytes::Bytes::copy_from_slice(bytes))?;
    let notes = reader.metadata().file_metadata().key_value_metadata().cloned().unwrap_or_default();
    Ok(notes.into_iter().filter_map(|note| Some((note.key, note.value?))).collect())
}

pub(super) fn decode(bytes: Vec<u8>) -> Result<Table, ParquetError> {
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
    Ok(Table { columns })
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
