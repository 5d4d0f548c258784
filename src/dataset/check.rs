//! Is a set on disk what was written?

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use super::parts::{SUMS, card_record_name, read_record, record_name};
use crate::error::{Error, Result};
use crate::panorama_set::{DOCUMENT, Document};
use crate::storage::{io_error, sha256_of_file};

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

/// Reads all of a set and holds it against its sums. `watch` is told the files looked at and all of them, from any thread.
///
/// # Errors
/// When the folder holds no set, cannot be read, or `watch` breaks.
pub fn check(folder: &Path, watch: &(dyn Fn(u64, u64) -> ControlFlow<()> + Sync)) -> Result<Inspection> {
    let Some(document) = Document::load(folder)? else {
        let message = format!("found no `{DOCUMENT}`, expected the folder of a set that `wayhome dataset` wrote");
        return Err(Error::Parse { path: folder.to_owned(), message });
    };
    let mut faults = BTreeSet::new();
    let mut fault = |path: &str, kind| faults.insert(SetFault { path: path.to_owned(), kind });
    let mut expected: BTreeMap<String, (Option<String>, Option<u64>)> = BTreeMap::new();
    let sums = read_sums(folder)?;
    let complete = sums.is_some();
    for (path, sha256) in sums.unwrap_or_default() {
        expected.insert(path, (Some(sha256), None));
    }
    for name in (0..document.parts).map(record_name).chain([card_record_name()]) {
        match read_record(folder, &name) {
            Ok(Some(record)) => {
                for file in record.files {
                    let entry = expected.entry(file.path).or_insert((Some(file.sha256), None));
                    entry.1 = Some(file.bytes);
                }
                expected.entry(name).or_insert((None, None));
            }
            Ok(None) if complete => {}
            Ok(None) => {
                fault(&name, FaultKind::Unfinished);
            }
            Err(_) => {
                fault(&name, FaultKind::Altered);
                expected.entry(name).or_insert((None, None));
            }
        }
    }
    expected.entry(DOCUMENT.to_owned()).or_insert((None, None));
    if !complete && faults.is_empty() {
        faults.insert(SetFault { path: SUMS.to_owned(), kind: FaultKind::Missing });
    }
    // In a set that is not finished, files of parts that are under way are no fault.
    for path in if complete { walk(folder)? } else { Vec::new() } {
        if !expected.contains_key(&path) && path != SUMS {
            faults.insert(SetFault { path, kind: FaultKind::Extra });
        }
    }
    let (looked, read, total) = (AtomicU64::new(0), AtomicU64::new(0), expected.len() as u64);
    let inspect = |(path, (sha256, bytes)): (&String, &(Option<String>, Option<u64>))| -> Result<Option<SetFault>> {
        if watch(looked.fetch_add(1, Ordering::Relaxed), total).is_break() {
            return Err(Error::Interrupted);
        }
        let kind = match sha256_of_file(&folder.join(path)) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Some(FaultKind::Missing),
            Err(e) => return Err(io_error("read", &folder.join(path))(e)),
            Ok((found, length)) => {
                read.fetch_add(length, Ordering::Relaxed);
                match sha256 {
                    Some(wanted) if *wanted != found && bytes.is_some_and(|b| length < b) => Some(FaultKind::Cut),
                    Some(wanted) if *wanted != found => Some(FaultKind::Altered),
                    _ => None,
                }
            }
        };
        Ok(kind.map(|kind| SetFault { path: path.clone(), kind }))
    };
    let found: Vec<_> = expected.par_iter().map(inspect).collect::<Result<_>>()?;
    faults.extend(found.into_iter().flatten());
    Ok(Inspection { files: expected.len() + 1, bytes: read.into_inner(), faults: faults.into_iter().collect() })
}

/// Paths and sums of `SHA256SUMS`; `None` where there is none.
fn read_sums(folder: &Path) -> Result<Option<Vec<(String, String)>>> {
    let path = folder.join(SUMS);
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(io_error("read", &path)(e)),
    };
    let line = |(k, line): (usize, &str)| {
        let (sha256, name) = line.split_once("  ").filter(|(sum, _)| sum.len() == 64).ok_or_else(|| Error::Parse {
            path: path.clone(),
            message: format!("line {}: found `{line}`, expected a SHA-256 and a path", k + 1),
        })?;
        Ok((name.to_owned(), sha256.to_owned()))
    };
    text.lines().enumerate().map(line).collect::<Result<_>>().map(Some)
}

/// Paths of all files of a folder and those below, with `/`, sorted.
pub(super) fn walk(folder: &Path) -> Result<Vec<String>> {
    let mut found = Vec::new();
    let mut open = vec![(folder.to_owned(), String::new())];
    while let Some((path, prefix)) = open.pop() {
        for entry in fs::read_dir(&path).map_err(io_error("read folder", &path))? {
            let entry = entry.map_err(io_error("read folder", &path))?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if entry.file_type().map_err(io_error("read", &entry.path()))?.is_dir() {
                open.push((entry.path(), format!("{name}/")));
            } else {
                found.push(name);
            }
        }
    }
    found.sort();
    Ok(found)
}
