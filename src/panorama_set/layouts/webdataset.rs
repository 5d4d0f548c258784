//! WebDataset: tar archives whose members with one key are one sample.
//!
//! The archives are plain ustar without times or owners, so that the same frames are the same bytes. A key is what comes before
//! the first point of a member's name, which is why names of conditions have none.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use super::entry::{Entry, Frame, Names, Source};
use super::set::{Found, file_names};
use crate::error::{Error, Result};
use crate::storage::io_error;

/// Folder of the archives.
const SHARDS: &str = "shards";

pub(super) fn names(frame: &Frame) -> Names {
    let key = format!("{}-{:06}", frame.condition, frame.spot);
    let file = |ending: &str| format!("{key}.{ending}");
    Names { image: file("rgb.png"), range: file("range.png"), instance: file("instance.png"), truth: Some(file("json")) }
}

/// Name of the archive with the frames of a condition's part.
#[must_use]
pub fn shard_name(condition: &str, part: usize) -> String {
    format!("{SHARDS}/{condition}-{part:06}.tar")
}

/// An archive that is being written.
pub struct Shard<W: Write>(tar::Builder<W>);

impl<W: Write> Shard<W> {
    /// Begins an archive.
    pub fn new(out: W) -> Self {
        Self(tar::Builder::new(out))
    }

    /// Appends a member.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn append(&mut self, name: &str, bytes: &[u8]) -> std::io::Result<()> {
        let mut header = tar::Header::new_ustar();
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        header.set_mtime(0);
        header.set_path(name)?;
        header.set_cksum();
        self.0.append(&header, bytes)
    }

    /// Ends the archive.
    ///
    /// # Errors
    /// When its end cannot be written.
    pub fn into_inner(self) -> std::io::Result<W> {
        self.0.into_inner()
    }
}

/// The archives of a set.
pub(super) fn shards(root: &Path) -> Result<Vec<PathBuf>> {
    for folder in [root.join(SHARDS), root.to_owned()] {
        if folder.is_dir() {
            let names: Vec<_> = file_names(&folder)?.into_iter().filter(|n| n.ends_with(".tar")).collect();
            if !names.is_empty() {
                return Ok(names.into_iter().map(|n| folder.join(n)).collect());
            }
        }
    }
    Ok(Vec::new())
}

/// All samples of a set's archives, in their order.
pub(super) fn find(root: &Path) -> Result<Found> {
    let shards = shards(root)?;
    if shards.is_empty() {
        let message = format!("found no archive; expected *.tar in it or in {SHARDS}");
        return Err(Error::Parse { path: root.to_owned(), message });
    }
    let mut entries = Vec::new();
    for path in shards {
        entries.extend(samples(&path)?);
    }
    Ok(Found::new(entries))
}

/// Members of a sample by what follows the key.
#[derive(Default)]
struct Sample {
    members: BTreeMap<String, Source>,
    json: Option<Vec<u8>>,
}

fn samples(path: &Path) -> Result<Vec<Entry>> {
    let broken = io_error("read archive", path);
    let file = fs::File::open(path).map_err(&broken)?;
    let length = file.metadata().map_err(&broken)?.len();
    let mut archive = tar::Archive::new(file);
    let mut samples: Vec<(String, Sample)> = Vec::new();
    for member in archive.entries_with_seek().map_err(&broken)? {
        let mut member = member.map_err(&broken)?;
        let name = member.path().map_err(&broken)?.to_string_lossy().into_owned();
        let (folder, base) = name.rsplit_once('/').map_or(("", name.as_str()), |(folder, base)| (folder, base));
        let Some((stem, ending)) = base.split_once('.') else { continue };
        let key = if folder.is_empty() { stem.to_owned() } else { format!("{folder}/{stem}") };
        let (offset, bytes) = (member.raw_file_position(), member.size());
        if offset + bytes > length {
            let message = format!("`{name}` reaches beyond the end of the archive, which is cut off at {length} bytes");
            return Err(Error::Parse { path: path.to_owned(), message });
        }
        if samples.last().is_none_or(|(last, _)| *last != key) {
            samples.push((key, Sample::default()));
        }
        let Some((_, sample)) = samples.last_mut() else { continue };
        if ending == "json" {
            let mut text = Vec::new();
            member.read_to_end(&mut text).map_err(&broken)?;
            sample.json = Some(text);
        }
        sample.members.insert(ending.to_owned(), Source::Member { archive: path.to_owned(), name, offset, bytes });
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let condition = stem.rsplit_once('-').map_or(stem.as_str(), |(condition, _)| condition);
    let entry = |(key, mut sample): (String, Sample)| -> Option<Result<Entry>> {
        let image = ["rgb.png", "png", "jpg", "jpeg"].iter().find_map(|ending| sample.members.remove(*ending))?;
        let mut entry = Entry::new(condition, key, image);
        (entry.range, entry.instance) = (sample.members.remove("range.png"), sample.members.remove("instance.png"));
        // Sets of others have JSON of their own; only ours tells poses.
        let told = entry.has_truth().then_some(sample.json).flatten().map(|json| entry.tell(&json, path));
        Some(told.transpose().map(|_| entry))
    };
    samples.into_iter().filter_map(entry).collect()
}
