//! Is a set on disk what was written?

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use super::parts::{SUMS, if_there, read_record, record_names, walk};
use crate::error::{Error, Result, go_on};
use crate::panorama_set::{DOCUMENT, Document};
use crate::storage::{io_error, open_within, read_within, sha256_of_file};

/// What can be wrong with a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// It should be there.
    Missing,
    /// It is shorter than it was.
    Cut,
    /// It is not what it was.
    Altered,
    /// It should not be there.
    Extra,
    /// A part of the set that was not made yet.
    Unfinished,
}

/// A fault of a set.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct SetFault {
    /// The file, within the set's folder.
    pub path: String,
    /// What is wrong.
    pub kind: FaultKind,
}

/// What a check came to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Inspection {
    /// Files that should be there.
    pub files: usize,
    /// Bytes that were read.
    pub bytes: u64,
    /// Faults, by path.
    pub faults: Vec<SetFault>,
}

/// What is known of a file that should be there.
#[derive(Default)]
struct Expected {
    sha256: Option<String>,
    bytes: Option<u64>,
}

/// Reads all of a set and holds it against its sums. `watch` is told the files looked at and all of them, from any thread.
///
/// # Errors
/// When the folder holds no set, cannot be read, tells of files that are not plain ones in it, or `watch` breaks.
pub fn check(folder: &Path, watch: &(dyn Fn(u64, u64) -> ControlFlow<()> + Sync)) -> Result<Inspection> {
    let Some(document) = Document::load(folder)? else {
        let message = format!("found no `{DOCUMENT}`, expected the folder of a set that `wayhome dataset` wrote");
        return Err(Error::Parse { path: folder.to_owned(), message });
    };
    let mut faults = BTreeSet::new();
    let mut fault = |path: &str, kind| faults.insert(SetFault { path: path.to_owned(), kind });
    let mut expected = BTreeMap::from([(DOCUMENT.to_owned(), Expected::default())]);
    let sums = read_sums(folder)?;
    let complete = sums.is_some();
    expected.extend(sums.unwrap_or_default());
    for name in record_names(&document) {
        match read_record(folder, &name) {
            Ok(Some(record)) => {
                for file in record.files {
                    let entry = expected.entry(file.path).or_insert(Expected { sha256: Some(file.sha256), bytes: None });
                    entry.bytes = Some(file.bytes);
                }
                expected.entry(name).or_default();
            }
            Ok(None) if complete => {}
            Ok(None) => {
                fault(&name, FaultKind::Unfinished);
            }
            Err(_) => {
                fault(&name, FaultKind::Altered);
                expected.entry(name).or_default();
            }
        }
    }
    if complete {
        // In a set that is not finished, files of parts that are under way are no fault.
        for path in walk(folder)?.iter().filter(|path| !expected.contains_key(*path) && *path != SUMS) {
            fault(path, FaultKind::Extra);
        }
    } else if faults.is_empty() {
        faults.insert(SetFault { path: SUMS.to_owned(), kind: FaultKind::Missing });
    }
    let (looked, read, total) = (AtomicU64::new(0), AtomicU64::new(0), expected.len() as u64);
    let inspect = |(path, expected): (&String, &Expected)| -> Result<Option<SetFault>> {
        go_on(watch(looked.fetch_add(1, Ordering::Relaxed), total))?;
        let full = folder.join(path);
        let kind = match if_there(open_within(folder, &full))? {
            None => Some(FaultKind::Missing),
            Some((file, length)) => {
                let found = sha256_of_file(file).map_err(io_error("read", &full))?.0;
                read.fetch_add(length, Ordering::Relaxed);
                let altered = expected.sha256.as_ref().is_some_and(|wanted| *wanted != found);
                let cut = expected.bytes.is_some_and(|bytes| length < bytes);
                altered.then_some(if cut { FaultKind::Cut } else { FaultKind::Altered })
            }
        };
        Ok(kind.map(|kind| SetFault { path: path.clone(), kind }))
    };
    let found: Vec<_> = expected.par_iter().map(inspect).collect::<Result<_>>()?;
    faults.extend(found.into_iter().flatten());
    Ok(Inspection { files: expected.len() + 1, bytes: read.into_inner(), faults: faults.into_iter().collect() })
}

/// Paths and sums of `SHA256SUMS`; `None` where there is none.
fn read_sums(folder: &Path) -> Result<Option<Vec<(String, Expected)>>> {
    let path = folder.join(SUMS);
    let Some(bytes) = if_there(read_within(folder, &path))? else { return Ok(None) };
    let line = |(k, line): (usize, &str)| {
        let (sha256, name) = line.split_once("  ").filter(|(sum, _)| sum.len() == 64).ok_or_else(|| Error::Parse {
            path: path.clone(),
            message: format!("line {}: found `{line}`, expected a SHA-256 and a path", k + 1),
        })?;
        Ok((name.to_owned(), Expected { sha256: Some(sha256.to_owned()), bytes: None }))
    };
    String::from_utf8_lossy(&bytes).lines().enumerate().map(line).collect::<Result<_>>().map(Some)
}
