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
use crate::storage::{PARTIAL, io_error, sha256, write_atomically};

/// Folder of the records.
const RECORDS: &str = "parts";
/// Record of the files that belong to no part.
pub(super) const CARD: &str = "set.json";
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
    lock: PathBuf,
    /// Held until the folder is given up; the system lets go of it however the process ends.
    _held: fs::File,
}

/// Name of a part's record.
pub(super) fn record_name(part: usize) -> String {
    format!("{RECORDS}/{part:06}.json")
}

/// Name of the record of all other files.
pub(super) fn card_record_name() -> String {
    format!("{RECORDS}/{CARD}")
}

impl SetFolder {
    /// Checks that the folder is new, empty, or holds the same set; nothing is written.
    ///
    /// # Errors
    /// When it holds something else.
    pub fn check(path: &Path, document: &Document) -> Result<()> {
        let refused = |found: String| Error::OutputTaken { path: path.to_owned(), found };
        let held = match fs::read_dir(path) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
            Err(e) => return Err(io_error("read folder", path)(e)),
        };
        let mut names = Vec::new();
        for entry in held {
            names.push(entry.map_err(io_error("read folder", path))?.file_name().to_string_lossy().into_owned());
        }
        names.sort();
        let foreign = names.iter().find(|n| !n.ends_with(PARTIAL));
        match Document::load(path) {
            Ok(None) => foreign.map_or(Ok(()), |name| Err(refused(format!("`{name}`")))),
            Ok(Some(other)) if other == *document => Ok(()),
            Ok(Some(other)) => Err(refused(format!("another set ({})", difference(&other, document)))),
            Err(_) => Err(refused(format!("a `{DOCUMENT}` that is not of this program"))),
        }
    }

    /// Takes the folder for a shard of the set.
    ///
    /// # Errors
    /// When it holds something else, another process writes the same shard, or it cannot be written.
    pub fn claim(path: &Path, document: &Document, shard: (usize, usize)) -> Result<Self> {
        Self::check(path, document)?;
        let records = path.join(RECORDS);
        fs::create_dir_all(&records).map_err(io_error("create folder", &records))?;
        let lock = records.join(format!(".lock-{}-of-{}", shard.0, shard.1));
        let held = fs::File::create(&lock).map_err(io_error("write", &lock))?;
        if matches!(held.try_lock(), Err(fs::TryLockError::WouldBlock)) {
            return Err(Error::OutputTaken { path: path.to_owned(), found: "a set that another process is writing".into() });
        }
        if Document::load(path)?.is_none() {
            write_atomically(&path.join(DOCUMENT), &document.to_json()?)?;
        }
        Ok(Self { path: path.to_owned(), lock, _held: held })
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether a part is done: its record is there, and so are the files that it names, in full length.
    #[must_use]
    pub fn is_done(&self, part: Part) -> bool {
        is_whole(&self.path, &record_name(part.number))
    }

    /// Writes a file, with the folders above it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<FileRecord> {
        let path = self.ready(name)?;
        write_atomically(&path, bytes)?;
        Ok(FileRecord { path: name.to_owned(), bytes: bytes.len() as u64, sha256: sha256(bytes) })
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
    pub fn commit(&self, name: &str, record: &Record) -> Result<()> {
        self.write(name, &record_json(record)?).map(|_| ())
    }

    /// Writes the sums of all files and clears what interrupted runs left. All parts must be done.
    ///
    /// # Errors
    /// When a record cannot be read, or the sums cannot be written.
    pub fn finish(&self, parts: usize) -> Result<()> {
        let mut sums = String::new();
        let mut line = |sha256: &str, path: &str| {
            use std::fmt::Write;
            let _ = writeln!(sums, "{sha256}  {path}");
        };
        let names = (0..parts).map(record_name).chain([card_record_name()]);
        for name in names {
            let path = self.path.join(&name);
            let bytes = fs::read(&path).map_err(io_error("read", &path))?;
            for file in parse_record(&bytes, &path)?.files {
                line(&file.sha256, &file.path);
            }
            line(&sha256(&bytes), &name);
        }
        let document = self.path.join(DOCUMENT);
        line(&sha256(&fs::read(&document).map_err(io_error("read", &document))?), DOCUMENT);
        write_atomically(&self.path.join(SUMS), sums.as_bytes())?;
        for left in super::check::walk(&self.path)? {
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

/// Whether a record is there, and so are the files that it names, in full length.
pub(super) fn is_whole(folder: &Path, record: &str) -> bool {
    let there = |file: &FileRecord| fs::metadata(folder.join(&file.path)).is_ok_and(|m| m.is_file() && m.len() == file.bytes);
    read_record(folder, record).is_ok_and(|r| r.is_some_and(|r| r.files.iter().all(there)))
}

/// A record; `None` where there is none.
pub(super) fn read_record(folder: &Path, name: &str) -> Result<Option<Record>> {
    let path = folder.join(name);
    match fs::read(&path) {
        Ok(bytes) => parse_record(&bytes, &path).map(Some),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(io_error("read", &path)(e)),
    }
}

fn parse_record(bytes: &[u8], path: &Path) -> Result<Record> {
    serde_json::from_slice(bytes).map_err(|e| Error::Parse { path: path.to_owned(), message: e.to_string() })
}

fn record_json(record: &Record) -> Result<Vec<u8>> {
    let mut bytes =
        serde_json::to_vec_pretty(record).map_err(|e| Error::Parse { path: RECORDS.into(), message: e.to_string() })?;
    bytes.push(b'\n');
    Ok(bytes)
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
