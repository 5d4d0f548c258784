//! Tables that other programs have made: another engine, another library, a benchmark.

use serde::de::DeserializeOwned;

use crate::error::{Error, Result};
use crate::storage::OutputFolder;

/// The rows of a CSV table that `script` may have left in a page's folder as `file`, which stays there as it is; `None` where
/// there is no such table.
///
/// # Errors
/// When the table is not what the script writes, or cannot be written again.
pub(super) fn keep<T: DeserializeOwned>(folder: &mut OutputFolder, file: &str, script: &str) -> Result<Option<Vec<T>>> {
    let Ok(text) = std::fs::read_to_string(folder.path().join(file)) else { return Ok(None) };
    let rows = parse(&text, file, script)?;
    folder.write(file, text.as_bytes())?;
    Ok(Some(rows))
}

/// The rows of a table, whose columns are called as the fields of `T`.
fn parse<T: DeserializeOwned>(text: &str, file: &str, script: &str) -> Result<Vec<T>> {
    let rows = csv::Reader::from_reader(text.as_bytes()).deserialize().collect::<std::result::Result<Vec<T>, _>>();
    let endless = text.split([',', '\n', '\r']).find(|cell| cell.parse::<f64>().is_ok_and(|value| !value.is_finite()));
    let found = match rows {
        _ if endless.is_some() => format!("`{}`", endless.unwrap_or_default()),
        Ok(rows) if !rows.is_empty() => return Ok(rows),
        Ok(_) => "no rows".to_owned(),
        Err(error) => error.to_string(),
    };
    Err(Error::Parse { path: file.into(), message: format!("{found}; expected is what {script} writes") })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_read_and_a_bad_one_refused() {
        let read = |text: &str| parse::<(String, [f64; 2])>(text, "drives.csv", "drives.py");
        assert_eq!(read("drive,x_m,y_m\nice,1,2.5\n").unwrap(), [("ice".to_owned(), [1.0, 2.5])]);
        for bad in ["", "drive,x_m,y_m\n", "drive,x_m,y_m\nice,1\n", "drive,x_m,y_m\nice,1,NaN\n"] {
            assert!(read(bad).is_err(), "{bad}");
        }
        let error = read("drive,x_m,y_m\nice,1,2\nice,1,x\n").unwrap_err().to_string();
        assert!(error.contains("drives.csv") && error.contains("line: 3") && error.contains("drives.py"), "{error}");
    }
}
