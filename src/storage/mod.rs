//! Files on disk that appear whole or not at all, their fingerprints, and how much room is left for more.
//!
//! Knows of: files and errors.

pub mod csv;
mod folder;

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::error::{Error, Result};

pub use folder::{FolderFile, OutputFolder};
pub(crate) use folder::{MARKER, files, remove};

/// Ending of files that are still being written.
pub const PARTIAL: &str = ".wayhome-partial";

/// Longest file of a stranger that is read whole, bytes.
const MOST_BYTES: u64 = 1 << 29;

/// A name that no other process takes at the same time, on this machine or on another one that sees the folder.
pub(crate) fn partial_name(path: &Path) -> PathBuf {
    let since = std::time::UNIX_EPOCH.elapsed().unwrap_or_default();
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{:x}-{:x}{PARTIAL}", std::process::id(), since.as_nanos()));
    path.with_file_name(name)
}

/// Writes a file under another name and renames it, so that it is never seen half written.
///
/// # Errors
/// When the file cannot be written.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let partial = partial_name(path);
    fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, path)).map_err(|source| {
        // Best effort: the write itself is what failed and what the caller hears about.
        let _ = fs::remove_file(&partial);
        Error::Io { action: "write", path: path.to_owned(), source }
    })
}

/// Indented JSON with a line end.
pub fn json(value: &impl serde::Serialize) -> String {
    // Plain structs with text keys always serialise; NaN becomes null.
    let mut text = serde_json::to_string_pretty(value).unwrap_or_default();
    text.push('\n');
    text
}

/// An [`Error::Io`] for this action on this path.
pub fn io_error(action: &'static str, path: &Path) -> impl Fn(io::Error) -> Error {
    move |source| Error::Io { action, path: path.to_owned(), source }
}

/// SHA-256 of some bytes, lower-case hexadecimal.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Opens a file that belongs to a folder, whoever made the folder, and gives its length: a plain file in it once all links are
/// resolved, so that neither a path nor a link leads out of it, and no pipe or device is waited for.
///
/// # Errors
/// When the file cannot be read, lies elsewhere or is not plain.
pub fn open_within(folder: &Path, path: &Path) -> Result<(fs::File, u64)> {
    // An empty path is the current folder.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let within = folder.canonicalize().map_err(io_error("read folder", folder))?;
    let file = path.canonicalize().map_err(io_error("read", path))?;
    let about = file.metadata().map_err(io_error("read", path))?;
    let fault = |found: String| Error::Parse {
        path: path.to_owned(),
        message: format!("found {found}, expected a plain file in {}", folder.display()),
    };
    if !file.starts_with(&within) {
        return Err(fault(format!("the way to {}", file.display())));
    }
    if !about.is_file() {
        return Err(fault(if about.is_dir() { "a folder" } else { "a pipe or a device" }.into()));
    }
    Ok((fs::File::open(&file).map_err(io_error("read", path))?, about.len()))
}

/// All of such a file, as [`open_within`] opens it.
///
/// # Errors
/// As there, and when the file is longer than 512 MiB.
pub fn read_within(folder: &Path, path: &Path) -> Result<Vec<u8>> {
    let (file, bytes) = open_within(folder, path)?;
    read_piece(file, bytes, path)
}

/// So many bytes from where a file stands; `path` is what errors call them.
///
/// # Errors
/// When they are more than 512 MiB, or the file ends before.
pub fn read_piece(file: fs::File, bytes: u64, path: &Path) -> Result<Vec<u8>> {
    let fault = |message: String| Error::Parse { path: path.to_owned(), message };
    if bytes > MOST_BYTES {
        return Err(fault(format!("found {bytes} bytes, expected at most {MOST_BYTES}")));
    }
    let mut held = Vec::new();
    file.take(bytes).read_to_end(&mut held).map_err(io_error("read", path))?;
    if (held.len() as u64) < bytes {
        return Err(fault(format!("found {} of {bytes} bytes, it is cut off", held.len())));
    }
    Ok(held)
}

/// SHA-256 and length of a file, which is read piece by piece.
///
/// # Errors
/// When the file cannot be read.
pub fn sha256_of_file(mut file: fs::File) -> io::Result<(String, u64)> {
    let (mut hash, mut bytes) = (Sha256::new(), 0);
    let mut buffer = vec![0; 1 << 17];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok((hex(&hash.finalize()), bytes)),
            n => {
                hash.update(&buffer[..n]);
                bytes += n as u64;
            }
        }
    }
}

fn hex(digest: &[u8]) -> String {
    digest.iter().map(|b| format!("{b:02x}")).collect()
}

/// A file that is written piece by piece and appears under its name when it is whole. One that is dropped before leaves nothing.
#[derive(Debug)]
pub struct PartialFile {
    path: PathBuf,
    partial: PathBuf,
    writer: io::BufWriter<fs::File>,
    /// Bytes written so far.
    written: u64,
}

impl PartialFile {
    /// Begins a file under another name.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn create(path: &Path) -> Result<Self> {
        let partial = partial_name(path);
        let file = fs::File::create(&partial).map_err(io_error("write", path))?;
        Ok(Self { path: path.to_owned(), partial, writer: io::BufWriter::with_capacity(1 << 18, file), written: 0 })
    }

    /// Bytes written so far.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Gives it its name.
    ///
    /// # Errors
    /// When what is left of it cannot be written.
    pub fn complete(mut self) -> Result<()> {
        self.writer.flush().and_then(|()| fs::rename(&self.partial, &self.path)).map_err(io_error("write", &self.path))
    }
}

impl Write for PartialFile {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let count = self.writer.write(buffer)?;
        self.written += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl io::Seek for PartialFile {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.writer.seek(to)
    }
}

impl Drop for PartialFile {
    fn drop(&mut self) {
        // Best effort, and nothing to do once it is complete: whoever writes the file again replaces this.
        let _ = fs::remove_file(&self.partial);
    }
}

/// A [`PartialFile`] that tells its SHA-256 when it is whole.
#[derive(Debug)]
pub struct GrowingFile {
    file: PartialFile,
    hash: Sha256,
}

impl GrowingFile {
    /// Begins a file.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn create(path: &Path) -> Result<Self> {
        Ok(Self { file: PartialFile::create(path)?, hash: Sha256::new() })
    }

    /// Puts it in its place; gives its SHA-256 and length.
    ///
    /// # Errors
    /// When what is left of it cannot be written.
    pub fn complete(self) -> Result<(String, u64)> {
        let told = (hex(&self.hash.finalize()), self.file.written);
        self.file.complete().map(|()| told)
    }
}

impl Write for GrowingFile {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let count = self.file.write(buffer)?;
        self.hash.update(&buffer[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Bytes that this process may still write to the file system of an existing folder; `None` where the system does not tell.
#[must_use]
pub fn free_bytes(folder: &Path) -> Option<u64> {
    #[cfg(unix)]
    {
        let about = rustix::fs::statvfs(folder).ok()?;
        Some(about.f_bavail.saturating_mul(about.f_frsize))
    }
    #[cfg(not(unix))]
    {
        let _ = folder;
        None
    }
}

/// Refuses to begin what an existing folder's disk has no room for; `what` says whose room it is.
///
/// # Errors
/// [`Error::Lacking`] when the system tells that fewer than `needed` bytes are free.
pub fn check_room(folder: &Path, needed: u64, what: &str) -> Result<()> {
    match free_bytes(folder) {
        Some(free) if needed > free => Err(Error::Lacking {
            what: format!("room on the disk of {what}"),
            found: format!("{} MB free", free / 1_000_000),
            needed: format!("{} MB", needed / 1_000_000),
        }),
        _ => Ok(()),
    }
}

/// Bytes of memory that are free; `None` where the system does not tell.
#[must_use]
pub fn free_memory() -> Option<u64> {
    let known = fs::read_to_string("/proc/meminfo").ok()?;
    let kilobytes = known.lines().find_map(|l| l.strip_prefix("MemAvailable:")?.trim().strip_suffix("kB"))?;
    Some(1024 * kilobytes.trim().parse::<u64>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_growing_file_is_there_when_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let held = || fs::read_dir(folder.path()).unwrap().count();
        let mut file = GrowingFile::create(&path).unwrap();
        file.write_all(b"ab").unwrap();
        assert!(!path.exists() && held() == 1);
        drop(file);
        assert_eq!(held(), 0);
        let mut file = GrowingFile::create(&path).unwrap();
        file.write_all(b"abc").unwrap();
        // The example of FIPS 180-2.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(file.complete().unwrap(), (abc.to_owned(), 3));
        assert_eq!(
            (sha256_of_file(fs::File::open(&path).unwrap()).unwrap(), sha256(b"abc")),
            ((abc.to_owned(), 3), abc.to_owned())
        );
        assert!(free_bytes(folder.path()).is_none_or(|b| b > 0));
    }
}
