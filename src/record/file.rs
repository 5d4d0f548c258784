//! The file of a recording: it takes the place of older recordings and of nothing else.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use crate::error::{Error, Result};
use crate::storage::{PartialFile, io_error};

/// What every recording holds near its beginning, so that a later one knows that it may take its place.
pub(super) const MAKER: &str = "wayhome";
/// How near, bytes.
const NEAR: u64 = 2048;

/// The folder that a file lies in.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Checks that a recording can be written: its folder is there, and the file is not there or an older recording, which begins with
/// `magic`.
///
/// # Errors
/// When that is not so.
pub(super) fn check(path: &Path, magic: &[u8]) -> Result<()> {
    let folder = folder_of(path);
    if !fs::metadata(folder).map_err(io_error("write to folder", folder))?.is_dir() {
        let source = io::Error::from(io::ErrorKind::NotADirectory);
        return Err(Error::Io { action: "write to folder", path: folder.to_owned(), source });
    }
    let taken = || Error::FileTaken { path: path.to_owned() };
    let mut start = Vec::new();
    match fs::metadata(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(()),
        Ok(found) if found.is_file() => {}
        Ok(_) => return Err(taken()),
        Err(source) => return Err(Error::Io { action: "read", path: path.to_owned(), source }),
    }
    File::open(path).and_then(|file| file.take(NEAR).read_to_end(&mut start)).map_err(io_error("read", path))?;
    let ours = start.starts_with(magic) && start.windows(MAKER.len()).any(|bytes| bytes == MAKER.as_bytes());
    if ours { Ok(()) } else { Err(taken()) }
}

/// Begins a recording under another name.
///
/// # Errors
/// As [`check`], and when the file cannot be created.
pub(super) fn create(path: &Path, magic: &[u8]) -> Result<PartialFile> {
    check(path, magic)?;
    PartialFile::create(path)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const MAGIC: &[u8] = b"GIF89a";

    #[test]
    fn only_older_recordings_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.gif");
        let mut file = create(&path, MAGIC).unwrap();
        file.write_all(b"GIF89a by wayhome").unwrap();
        assert!(!path.exists(), "not before it is whole");
        file.complete().unwrap();
        let mut second = create(&path, MAGIC).unwrap();
        second.write_all(b"half").unwrap();
        drop(second);
        assert_eq!(fs::read(&path).unwrap(), b"GIF89a by wayhome");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing half written stays");
        for foreign in [&b"GIF89a by somebody"[..], b"by wayhome", b""] {
            fs::write(&path, foreign).unwrap();
            assert!(matches!(create(&path, MAGIC), Err(Error::FileTaken { .. })));
        }
        assert!(matches!(check(folder.path(), MAGIC), Err(Error::FileTaken { .. })));
        let nowhere = check(&folder.path().join("no/run.gif"), MAGIC).unwrap_err().to_string();
        assert!(nowhere.ends_with("no"), "{nowhere}");
        assert!(check(&path.join("run.gif"), MAGIC).is_err(), "below a file");
    }
}
