//! Tables of Markdown pages.

/// A table with all columns flush left. Each row has a cell for every column.
///
/// ```
/// use wayhome::draw::markdown::table;
///
/// let text = table(&["world", "runs"], [["lab".to_owned(), 300.to_string()]]);
/// assert_eq!(text, "| world | runs |\n|---|---|\n| lab | 300 |\n");
/// ```
#[must_use]
pub fn table(columns: &[impl AsRef<str>], rows: impl IntoIterator<Item = impl AsRef<[String]>>) -> String {
    table_of_numbers(columns, columns.len(), rows)
}

/// A table whose first `texts` columns are flush left and all others, which hold numbers, flush right.
#[must_use]
pub fn table_of_numbers(
    columns: &[impl AsRef<str>],
    texts: usize,
    rows: impl IntoIterator<Item = impl AsRef<[String]>>,
) -> String {
    let mut text = String::from("|");
    for column in columns {
        push_cell(&mut text, column.as_ref());
    }
    text.push_str("\n|");
    for k in 0..columns.len() {
        text.push_str(if k < texts { "---|" } else { "---:|" });
    }
    text.push('\n');
    for row in rows {
        text.push('|');
        for cell in row.as_ref() {
            push_cell(&mut text, cell);
        }
        text.push('\n');
    }
    text
}

/// A bar inside a cell would end it, also in code.
fn push_cell(text: &mut String, cell: &str) {
    if !cell.is_empty() {
        text.push(' ');
        text.push_str(&cell.replace('|', "\\|"));
    }
    text.push_str(" |");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_stay_cells() {
        let rows = [["a|b".to_owned(), String::new(), "2.5".to_owned()]];
        assert_eq!(table_of_numbers(&["what", "", "m"], 2, rows), "| what | | m |\n|---|---|---:|\n| a\\|b | | 2.5 |\n");
    }
}
