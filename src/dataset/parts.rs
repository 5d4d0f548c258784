//! Records of what a set's folder holds, and whose folder it is.
//!
//! Each part leaves a record with the size and SHA-256 of its files once all of them are in place. The record is written last
//! and whole, so that a part counts as done if and only if it is; a run that was killed leaves files without a record, which the
//! next run writes again. Shards of one set write different parts of the same folder, or of copies that are put together later.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::plan::Part;
use crate::error::{Error, Result};
use crate::panorama_set::{DOCUMENT, Document};
use crate::storage::{self, PARTIAL, io_error, read_within, sha256, write_atomically};

/// Folder of the records.
const RECORDS: &str = "parts";
/// Name of the record of the files that belong to no part.
const REST: &str = "parts/set.json";
/// Sums of all files, as `sha256sum --check` reads them.
pub const SUMS: &str = "SHA256SUMS";

/// A file of a set.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Path within the set's folder, with `/`.
    pub path: String,
    /// Length.
    pub bytes: u64,
    /// SHA-256, lower-case hexadecimal.
    pub sha256: String,
}

/// The files of a part, or of the set as a whole.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Record {
    /// The files, in the order in which they were written.
    pub files: Vec<FileRecord>,
}

/// A set's folder that this process may write.
#[derive(Debug)]
pub struct SetFolder {
    path: PathBuf,
    /// What the set is.
    pub document: Document,
    lock: PathBuf,
    /// Held until the folder is given up; the system lets go of it however the process ends.
    _held: fs::File,
}

/// Name of a part's record.
fn record_name(part: usize) -> String {
    format!("{RECORDS}/{part:06}.json")
}

/// Names of all records of a set.
pub(super) fn record_names(document: &Document) -> impl Iterator<Item = String> + use<> {
    (0..document.parts).map(record_name).chain([REST.to_owned()])
}

impl SetFolder {
    /// Checks that the folder is new, empty, or holds the same set; nothing is written.
    ///
    /// # Errors
    /// When it holds something else.
    pub fn check(path: &Path, document: &Document) -> Result<()> {
        let refused = |found: String| Err(Error::OutputTaken { path: path.to_owned(), found });
        if !path.exists() {
            return Ok(());
        }
        let foreign = storage::files(path)?.into_iter().find(|name| !name.ends_with(PARTIAL));
        match Document::load(path) {
            Ok(None) => foreign.map_or(Ok(()), |name| refused(format!("`{name}`"))),
            Ok(Some(other)) if other == *document => Ok(()),
            Ok(Some(other)) => refused(format!("another set ({})", difference(&other, document))),
            Err(_) => refused(format!("a `{DOCUMENT}` that is not of this program")),
        }
    }

    /// Takes the folder for a shard of the set.
    ///
    /// # Errors
    /// When it holds something else, another process writes the same shard, or it cannot be written.
    pub fn claim(path: &Path, document: Document, shard: (usize, usize)) -> Result<Self> {
        Self::check(path, &document)?;
        let records = path.join(RECORDS);
        fs::create_dir_all(&records).map_err(io_error("create folder", &records))?;
        let lock = records.join(format!(".lock-{}-of-{}", shard.0, shard.1));
        let held = fs::File::create(&lock).map_err(io_error("write", &lock))?;
        if matches!(held.try_lock(), Err(fs::TryLockError::WouldBlock)) {
            return Err(Error::OutputTaken { path: path.to_owned(), found: "a set that another process is writing".into() });
        }
        if Document::load(path)?.is_none() {
            write_atomically(&path.join(DOCUMENT), storage::json(&document).as_bytes())?;
        }
        Ok(Self { path: path.to_owned(), document, lock, _held: held })
    }

    /// Whether a part is done: its record is there, and so are the files that it names, in full length.
    pub fn is_done(&self, part: Part) -> bool {
        is_whole(&self.path, part)
    }

    /// Writes a file, with the folders above it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<FileRecord> {
        self.write_hashed(name.to_owned(), bytes, sha256(bytes))
    }

    /// The same for bytes whose SHA-256 is known.
    ///
    /// # Errors
    /// As [`SetFolder::write`].
    pub fn write_hashed(&self, path: String, bytes: &[u8], sha256: String) -> Result<FileRecord> {
        write_atomically(&self.ready(&path)?, bytes)?;
        Ok(FileRecord { path, bytes: bytes.len() as u64, sha256 })
    }

    /// The path of a file of the set; the folders above it are there.
    ///
    /// # Errors
    /// When they cannot be made.
    pub fn ready(&self, name: &str) -> Result<PathBuf> {
        let path = self.path.join(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(io_error("create folder", folder))?;
        }
        Ok(path)
    }

    /// Puts down that a part is done.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn commit(&self, part: Part, record: &Record) -> Result<()> {
        self.write(&record_name(part.number), storage::json(record).as_bytes()).map(|_| ())
    }

    /// Puts down the files that belong to no part, writes the sums of all files and clears what interrupted runs left. All parts
    /// must be done.
    ///
    /// # Errors
    /// When a record cannot be read, or the sums cannot be written.
    pub fn finish(&self, rest: &Record) -> Result<()> {
        self.write(REST, storage::json(rest).as_bytes())?;
        let mut sums = String::new();
        let mut line = |sha256: &str, path: &str| sums.extend([sha256, "  ", path, "\n"]);
        for name in record_names(&self.document) {
            let path = self.path.join(&name);
            let bytes = read_within(&self.path, &path)?;
            for file in parse_record(&bytes, &path)?.files {
                line(&file.sha256, &file.path);
            }
            line(&sha256(&bytes), &name);
        }
        line(&sha256(&read_within(&self.path, &self.path.join(DOCUMENT))?), DOCUMENT);
        write_atomically(&self.path.join(SUMS), sums.as_bytes())?;
        for left in walk(&self.path)? {
            let name = left.rsplit('/').next().unwrap_or_default();
            if name.ends_with(PARTIAL) || (left.starts_with(RECORDS) && name.starts_with(".lock-")) {
                // Best effort: the set is whole either way.
                let _ = fs::remove_file(self.path.join(&left));
            }
        }
        Ok(())
    }
}

impl Drop for SetFolder {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.lock);
    }
}

/// Whether a part's record is there, and so are the files that it names, in full length.
pub(super) fn is_whole(folder: &Path, part: Part) -> bool {
    let there = |file: &FileRecord| fs::metadata(folder.join(&file.path)).is_ok_and(|m| m.is_file() && m.len() == file.bytes);
    read_record(folder, &record_name(part.number)).is_ok_and(|r| r.is_some_and(|r| r.files.iter().all(there)))
}

/// A record; `None` where there is none.
pub(super) fn read_record(folder: &Path, name: &str) -> Result<Option<Record>> {
    let path = folder.join(name);
    let bytes = if_there(read_within(folder, &path))?;
    bytes.map(|bytes| parse_record(&bytes, &path)).transpose()
}

/// `None` where a file is not there.
pub(super) fn if_there<T>(read: Result<T>) -> Result<Option<T>> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(e),
    }
}

fn parse_record(bytes: &[u8], path: &Path) -> Result<Record> {
    serde_json::from_slice(bytes).map_err(|e| Error::Parse { path: path.to_owned(), message: e.to_string() })
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

/// The first field in which two documents differ.
fn difference(held: &Document, wanted: &Document) -> String {
    let value = |document| serde_json::to_value(document).unwrap_or_default();
    let (held, wanted) = (value(held), value(wanted));
    // The command says most; it differs whenever an argument does.
    let keys = ["version", "world_sha256", "renderer", "command"];
    let all = held.as_object().into_iter().flatten().map(|(key, _)| key.as_str());
    let key = keys.into_iter().chain(all).find(|key| held[*key] != wanted[*key]).unwrap_or("dataset.json");
    format!("its `{key}` is {}, here it is {}", held[key], wanted[key])
}
