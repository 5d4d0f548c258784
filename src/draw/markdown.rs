//! Tables of Markdown pages.

/// A table with all columns flush left; `columns` are their names, with a bar between. Each row has a cell for every column.
///
/// ```
/// use wayhome::draw::markdown::table;
///
/// let text = table("world | runs", [["lab".to_owned(), 300.to_string()]]);
/// assert_eq!(text, "| world | runs |\n|---|---|\n| lab | 300 |\n");
/// ```
pub fn table(columns: &str, rows: impl IntoIterator<Item = impl AsRef<[String]>>) -> String {
    table_of_numbers(columns, usize::MAX, rows)
}

/// A table whose first `texts` columns are flush left and all others, which hold numbers, flush right.
pub fn table_of_numbers(columns: &str, texts: usize, rows: impl IntoIterator<Item = impl AsRef<[String]>>) -> String {
    let mut text = String::from("|");
    let mut rule = String::from("|");
    for (k, column) in columns.split('|').enumerate() {
        push_cell(&mut text, column.trim());
        rule += if k < texts { "---|" } else { "---:|" };
    }
    text = text + "\n" + &rule + "\n";
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
        assert_eq!(table_of_numbers("what | | m", 2, rows), "| what | | m |\n|---|---|---:|\n| a\\|b | | 2.5 |\n");
    }
}
