//! CSV tables (RFC 4180) of records whose field names are the columns.

use serde::{Serialize, Serializer};

/// The records as a table, names first. Without records there is no first line either.
#[must_use]
pub fn csv<T: Serialize>(records: impl IntoIterator<Item = T>) -> String {
    // Flat structs always serialise, and a growing text takes all that is written.
    let mut table = csv::Writer::from_writer(Vec::new());
    for record in records {
        let _ = table.serialize(record);
    }
    text(table)
}

/// [`csv()`] with columns before those of the records, whose names are known at run time only.
#[must_use]
pub fn csv_with<T: Serialize>(names: &[&str], records: &[(Vec<String>, T)]) -> String {
    let tails = csv(records.iter().map(|(_, record)| record));
    let mut tails = csv::ReaderBuilder::new().has_headers(false).from_reader(tails.as_bytes());
    let heads =
        std::iter::once(names.to_vec()).chain(records.iter().map(|(head, _)| head.iter().map(String::as_str).collect()));
    let mut table = csv::Writer::from_writer(Vec::new());
    for (head, tail) in heads.zip(tails.records().flatten()) {
        let _ = table.write_record(head.into_iter().chain(tail.iter()));
    }
    text(table)
}

fn text(table: csv::Writer<Vec<u8>>) -> String {
    table.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}

/// Writes a number as all tables have it: in full, without an exponent; nothing where there is none, or it is not finite.
///
/// # Errors
/// What the writer fails with.
pub fn decimal<S: Serializer>(value: &(impl Copy + Into<Option<f64>>), to: S) -> Result<S::Ok, S::Error> {
    match (*value).into().filter(|v| v.is_finite()) {
        Some(value) => to.collect_str(&value),
        None => to.serialize_none(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    struct Record {
        seed: u64,
        #[serde(serialize_with = "decimal")]
        range_m: Option<f64>,
        #[serde(serialize_with = "decimal")]
        time_s: f64,
    }

    #[test]
    fn numbers_are_in_full_and_cells_stay_cells() {
        let record = |seed, range_m, time_s| Record { seed, range_m, time_s };
        let records = [record(1, Some(-0.000_08), 2.0), record(2, None, f64::NAN)];
        assert_eq!(csv(&records), "seed,range_m,time_s\n1,-0.00008,2\n2,,\n");
        let led = records.map(|record| (vec!["a \"b\", c".to_owned()], record));
        assert_eq!(
            csv_with(&["who"], &led),
            "who,seed,range_m,time_s\n\"a \"\"b\"\", c\",1,-0.00008,2\n\"a \"\"b\"\", c\",2,,\n"
        );
    }
}
