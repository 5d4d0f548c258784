//! CSV tables (RFC 4180): one list says each column's name and where its cells come from.

/// Columns of a table whose rows are made of `R`.
pub type Columns<R> = [(&'static str, fn(&R) -> String)];

/// The whole table, names first.
#[must_use]
pub fn csv<'r, R: 'r>(columns: &Columns<R>, rows: impl IntoIterator<Item = &'r R>) -> String {
    header(columns) + &rows.into_iter().map(|of| row(columns, of)).collect::<String>()
}

/// [`csv()`] with columns before the others whose names are known at run time only.
#[must_use]
pub fn csv_with<R>(names: &[&str], columns: &Columns<R>, rows: &[(Vec<String>, R)]) -> String {
    let names = names.iter().map(|name| (*name).to_owned()).chain(columns.iter().map(|(name, _)| (*name).to_owned()));
    let rows = rows.iter().map(|(head, of)| line(head.iter().cloned().chain(columns.iter().map(|(_, cell)| cell(of)))));
    line(names) + &rows.collect::<String>()
}

/// The first line.
#[must_use]
pub fn header<R>(columns: &Columns<R>) -> String {
    line(columns.iter().map(|(name, _)| (*name).to_owned()))
}

/// A row.
#[must_use]
pub fn row<R>(columns: &Columns<R>, of: &R) -> String {
    line(columns.iter().map(|(_, cell)| cell(of)))
}

/// A number with as many digits as it takes to read it back without loss; an empty cell where there is none.
#[must_use]
pub fn number(value: impl Into<Option<f64>>) -> String {
    value.into().filter(|v| v.is_finite()).map_or_else(String::new, |v| v.to_string())
}

fn line(cells: impl Iterator<Item = String>) -> String {
    // A text that grows takes all that is written.
    let mut table = csv::Writer::from_writer(Vec::new());
    let _ = table.write_record(cells.map(String::into_bytes));
    table.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_in_full_and_cells_stay_cells() {
        let columns: &Columns<(u64, Option<f64>)> = &[("seed", |r| r.0.to_string()), ("range_m", |r| number(r.1))];
        let rows = [(1, Some(-0.000_08)), (2, None), (3, Some(f64::NAN))];
        assert_eq!(csv(columns, &rows), "seed,range_m\n1,-0.00008\n2,\n3,\n");
        let led = rows.map(|row| (vec!["a \"b\", c".to_owned()], row));
        assert!(csv_with(&["who"], columns, &led).starts_with("who,seed,range_m\n\"a \"\"b\"\", c\",1,-0.00008\n"));
    }
}
