//! Putting the rows of many chunks together.

use serde::{Deserialize, Serialize};

use super::rows::Row;
use super::spec::Study;

/// What a file of rows says about the study that it belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Name of the study.
    pub study: String,
    /// [`Study::sha256`].
    #[serde(rename = "study_sha256")]
    pub sha256: String,
    /// Version of the program that made the rows.
    pub version: String,
}

/// Names of the notes.
const NOTES: [&str; 3] = ["study", "study_sha256", "version"];

impl Identity {
    /// That of rows which this program makes.
    pub fn of(study: &Study) -> Self {
        Self { study: study.name.clone(), sha256: study.sha256(), version: crate::VERSION.to_owned() }
    }

    /// As notes of a file.
    pub fn notes(&self) -> [(&'static str, String); 3] {
        let [study, sha256, version] = NOTES;
        [(study, self.study.clone()), (sha256, self.sha256.clone()), (version, self.version.clone())]
    }

    /// From the notes of a file; `None` where it has none.
    pub fn from_notes(notes: &[(String, String)]) -> Option<Self> {
        let [study, sha256, version] =
            NOTES.map(|name| notes.iter().find(|(key, _)| key == name).map(|(_, value)| value.clone()));
        Some(Self { study: study?, sha256: sha256?, version: version? })
    }

    /// Where the two differ, in words; `None` where they are the same.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let told = |what: &str, a: &str, b: &str| Some(format!("{what} {a}, not {b}"));
        if self.study != other.study {
            return told("study", &self.study, &other.study);
        }
        if self.version != other.version {
            return told("version", &self.version, &other.version);
        }
        let short = |text: &str| text.chars().take(12).collect::<String>();
        (self.sha256 != other.sha256)
            .then(|| told("another edition of the study (SHA-256", &short(&self.sha256), &format!("{})", short(&other.sha256))))
            .flatten()
    }
}

/// The rows of all episodes in order. Rows that came twice must be equal.
///
/// # Errors
/// What is missing, or differs.
pub fn merge(study: &Study, mut rows: Vec<Row>) -> Result<Vec<Row>, String> {
    rows.sort_by_key(|row| row.episode);
    if let Some(pair) = rows.windows(2).find(|pair| pair[0].episode == pair[1].episode && pair[0] != pair[1]) {
        return Err(format!("episode {} came twice with different results", pair[0].episode));
    }
    rows.dedup_by_key(|row| row.episode);
    let missing = study.episodes() - rows.len() as u64;
    if missing > 0 {
        let first = (0..).zip(&rows).find(|(k, row)| *k != row.episode).map_or(rows.len() as u64, |(k, _)| k);
        return Err(format!("{missing} of {} episodes are missing, the first of them is {first}", study.episodes()));
    }
    Ok(rows)
}
