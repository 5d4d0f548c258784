//! Writing results without leaving half a file or taking someone else's.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::storage::{self, PARTIAL, io_error, write_atomically};

/// File that marks a folder as ours: the verb that writes it, and below that, a line each, the names of what it has written, this file's
/// among them. A `#` in a name stands for any number: `rgb-#.png`.
pub(crate) const MARKER: &str = ".wayhome";

/// A folder of results that one verb of the program writes.
///
/// A folder that the same verb wrote before may be written again; one that holds anything else is refused. Every file appears
/// whole or not at all: it is written under another name and then renamed. It is known as ours before it is there.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    verb: String,
    /// Names of what is ours, as [`numberless`] makes them.
    ours: BTreeSet<String>,
    written: BTreeSet<String>,
}

impl OutputFolder {
    /// Opens or creates the folder for `verb`.
    ///
    /// # Errors
    /// When the folder cannot be created or read, or holds what `verb` has not written.
    pub fn open(path: &Path, verb: &str) -> Result<Self> {
        Self::open_shared(path, verb, verb, &[])
    }

    /// As [`Self::open`] for a verb that was called `former` once, whose folder may be written again too, and that reads files of the
    /// names `guests`, which others put there.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_shared(path: &Path, verb: &str, former: &str, guests: &[&str]) -> Result<Self> {
        fs::create_dir_all(path).map_err(io_error("create folder", path))?;
        let held = files(path)?;
        let marker = path.join(MARKER);
        let refused = |found: String| Error::OutputTaken { path: path.to_owned(), found };
        let own = BTreeSet::from([MARKER.to_owned()]);
        let mut ours = own.clone();
        if !held.is_empty() {
            match fs::read_to_string(&marker) {
                Ok(text) => {
                    let mut lines = text.lines();
                    let owner = lines.next().unwrap_or_default();
                    if ![verb, former].contains(&owner) {
                        return Err(refused(format!("the results of `wayhome {owner}`")));
                    }
                    ours = lines.map(str::to_owned).collect();
                }
                Err(e) if e.kind() == io::ErrorKind::NotFound => return Err(refused(format!("`{}`", held[0]))),
                Err(source) => return Err(Error::Io { action: "read", path: marker, source }),
            }
        }
        // The marker of an older version lists nothing: what it has written is not told from the rest, which stays until it is written.
        let lists = ours.contains(MARKER);
        ours.extend(own.iter().cloned().chain(guests.iter().map(|&name| name.to_owned())));
        let folder = Self { path: path.to_owned(), verb: verb.to_owned(), ours, written: own };
        if let Some(foreign) = held.iter().find(|h| lists && !h.ends_with(PARTIAL) && !folder.is_ours(h)) {
            return Err(refused(format!("`{foreign}`")));
        }
        for partial in held.iter().filter(|h| h.ends_with(PARTIAL)) {
            remove(&path.join(partial))?;
        }
        folder.mark()?;
        Ok(folder)
    }

    /// Writes down whose the folder is.
    fn mark(&self) -> Result<()> {
        let lines: String = std::iter::once(&self.verb).chain(&self.ours).map(|line| format!("{line}\n")).collect();
        write_atomically(&self.path.join(MARKER), lines.as_bytes())
    }

    fn is_ours(&self, name: &str) -> bool {
        self.ours.contains(&numberless(name))
    }

    /// Makes sure that a file of this name is known as ours before it is there.
    fn own(&mut self, name: &str) -> Result<()> {
        if self.ours.insert(numberless(name)) { self.mark() } else { Ok(()) }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes one of the folder's files.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        self.own(name)?;
        write_atomically(&self.path.join(name), bytes)?;
        self.written.insert(name.to_owned());
        Ok(())
    }

    /// Begins one of the folder's files that is written piece by piece. It appears under its name with [`Self::complete`]; one that
    /// is dropped before leaves nothing.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn begin(&mut self, name: &'static str) -> Result<FolderFile> {
        self.own(name)?;
        Ok(FolderFile { name, path: self.path.join(name), file: storage::GrowingFile::create(&self.path.join(name))? })
    }

    /// Puts a file that was written piece by piece in its place.
    ///
    /// # Errors
    /// When what is left of it cannot be written.
    pub fn complete(&mut self, file: FolderFile) -> Result<()> {
        file.file.complete()?;
        self.written.insert(file.name.to_owned());
        Ok(())
    }

    /// Removes what an earlier run has left and this one has not written.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn finish(mut self) -> Result<()> {
        let stale = |name: &String| self.is_ours(name) && !self.written.contains(name);
        files(&self.path)?.iter().filter(|name| stale(name)).try_for_each(|name| remove(&self.path.join(name)))?;
        let ours = self.written.iter().map(|name| numberless(name)).collect();
        if std::mem::replace(&mut self.ours, ours) == self.ours { Ok(()) } else { self.mark() }
    }
}

/// Names of what is in a folder, sorted.
pub(crate) fn files(path: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(path).map_err(io_error("read folder", path))? {
        names.push(entry.map_err(io_error("read folder", path))?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}

/// The name of a file with a `#` for the number after its last dash, so that a series has one name.
fn numberless(name: &str) -> String {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    match name.rsplit_once('-').and_then(|(series, rest)| Some((series, rest.split_once('.')?))) {
        Some((series, (number, ending))) if is_number(number) => format!("{series}-#.{ending}"),
        _ => name.to_owned(),
    }
}

/// A file that is being written piece by piece, so that nobody has to hold all of it; see [`OutputFolder::begin`].
#[derive(Debug)]
pub struct FolderFile {
    name: &'static str,
    path: PathBuf,
    file: storage::GrowingFile,
}

impl FolderFile {
    /// Appends to it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn append(&mut self, text: &str) -> Result<()> {
        self.file.write_all(text.as_bytes()).map_err(io_error("write", &self.path))
    }
}

pub(crate) fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(Error::Io { action: "remove", path: path.to_owned(), source })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verb_may_write_its_folder_again() {
        let base = tempfile::tempdir().unwrap();
        let path = base.path().join("new/folder");
        let mut first = OutputFolder::open(&path, "home").unwrap();
        first.write("a.txt", b"1").unwrap();
        first.write("b.txt", b"1").unwrap();
        first.finish().unwrap();
        fs::write(path.join("a.txt.wayhome-partial"), "cut off").unwrap();
        let mut second = OutputFolder::open(&path, "home").unwrap();
        second.write("a.txt", b"2").unwrap();
        second.finish().unwrap();
        assert_eq!(fs::read(path.join("a.txt")).unwrap(), b"2");
        assert_eq!(files(&path).unwrap(), [MARKER, "a.txt"], "what is stale is gone");
        assert_eq!(fs::read_to_string(path.join(MARKER)).unwrap(), "home\n.wayhome\na.txt\n");
        fs::write(path.join("b.txt"), "mine").unwrap();
        assert!(OutputFolder::open(&path, "home").unwrap_err().to_string().contains("b.txt"), "it is no longer ours");
    }

    /// What an older version wrote may be written again, but what of it is stale is not known.
    #[test]
    fn a_marker_without_a_list_lets_all_stay() {
        let base = tempfile::tempdir().unwrap();
        for (name, text) in [(MARKER, "home-run\n"), ("a.txt", "1"), ("b.txt", "1"), ("guest.csv", "1")] {
            fs::write(base.path().join(name), text).unwrap();
        }
        let open = || OutputFolder::open_shared(base.path(), "home", "home-run", &["guest.csv"]);
        let mut folder = open().unwrap();
        folder.write("a.txt", b"2").unwrap();
        folder.write("guest.csv", b"1").unwrap();
        folder.finish().unwrap();
        assert_eq!(files(base.path()).unwrap(), [MARKER, "a.txt", "b.txt", "guest.csv"]);
        assert!(open().unwrap_err().to_string().contains("b.txt"));
        fs::remove_file(base.path().join("b.txt")).unwrap();
        open().unwrap();
    }

    #[test]
    fn a_growing_file_appears_whole_or_not_at_all() {
        let base = tempfile::tempdir().unwrap();
        let mut folder = OutputFolder::open(base.path(), "home").unwrap();
        let held = || fs::read_dir(base.path()).unwrap().count();
        let mut file = folder.begin("a.txt").unwrap();
        file.append("1").unwrap();
        assert!(!base.path().join("a.txt").exists() && held() == 2);
        drop(file);
        assert_eq!(held(), 1, "the marker alone");
        let mut file = folder.begin("a.txt").unwrap();
        file.append("1").unwrap();
        file.append("2").unwrap();
        folder.complete(file).unwrap();
        folder.finish().unwrap();
        assert_eq!((fs::read(base.path().join("a.txt")).unwrap(), held()), (b"12".to_vec(), 2));
    }

    #[test]
    fn what_others_wrote_stays() {
        let base = tempfile::tempdir().unwrap();
        fs::write(base.path().join("a.txt"), "mine").unwrap();
        let error = OutputFolder::open(base.path(), "home").unwrap_err().to_string();
        assert!(error.contains("`a.txt`"), "{error}");
        assert_eq!(fs::read(base.path().join("a.txt")).unwrap(), b"mine");

        let numbered = base.path().join("numbered");
        let mut first = OutputFolder::open(&numbered, "home").unwrap();
        first.write("frame-000001.png", b"1").unwrap();
        first.write("frame-000002.png", b"2").unwrap();
        first.finish().unwrap();
        let mut second = OutputFolder::open(&numbered, "home").unwrap();
        second.write("frame-000001.png", b"1").unwrap();
        second.finish().unwrap();
        assert!(!numbered.join("frame-000002.png").exists());
        fs::write(numbered.join("frame-x.png"), "mine").unwrap();
        assert!(OutputFolder::open(&numbered, "home").is_err());

        let ours = base.path().join("ours");
        OutputFolder::open(&ours, "home").unwrap().finish().unwrap();
        assert!(OutputFolder::open(&ours, "render").unwrap_err().to_string().contains("wayhome home"));
        fs::write(ours.join("notes.md"), "mine").unwrap();
        assert!(OutputFolder::open(&ours, "home").unwrap_err().to_string().contains("notes.md"));
    }
}
