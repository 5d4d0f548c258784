//! Tables as CSV: one list says each column's name and where its cells come from.

/// Columns of a table whose rows are made of `R`.
pub(super) type Columns<R> = [(&'static str, fn(&R) -> String)];

/// The first line.
pub(super) fn header<R>(columns: &Columns<R>) -> String {
    line(columns.iter().map(|(name, _)| (*name).to_owned()))
}

/// A row.
pub(super) fn row<R>(columns: &Columns<R>, of: &R) -> String {
    line(columns.iter().map(|(_, cell)| cell(of)))
}

/// A number with as many digits as it takes to read it back without loss; an empty cell where there is none.
pub(super) fn number(value: impl Into<Option<f64>>) -> String {
    value.into().filter(|v| v.is_finite()).map_or_else(String::new, |v| v.to_string())
}

fn line(cells: impl Iterator<Item = String>) -> String {
    cells.collect::<Vec<_>>().join(",") + "\n"
}
