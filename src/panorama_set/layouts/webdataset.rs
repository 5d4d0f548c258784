//! WebDataset: tar archives whose members with one key are one sample.
//!
//! The archives are plain ustar without times or owners, so that the same frames are the same bytes. A key is what comes before
//! the first point of a member's name, which is why names of conditions have none.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};
use crate::panorama_set::document::Document;
use crate::panorama_set::entry::{Entry, Frame, Names};
use crate::panorama_set::layout::{Found, Layout, Search};
use crate::panorama_set::source::{Source, with_ending};
use crate::storage::{io_error, open_within};

/// Folder of the archives.
const SHARDS: &str = "shards";
/// Longest JSON of a sample, bytes.
const MOST_JSON: u64 = 1 << 24;

/// See [`super::LayoutKind::Webdataset`].
pub(super) struct Webdataset;

impl Layout for Webdataset {
    fn about_files(&self) -> &'static str {
        "Samples are `KEY.rgb.png`, `KEY.range.png`, `KEY.instance.png` and `KEY.json` in `shards/*.tar`."
    }

    fn samples(&self, _set: &Document) -> Vec<String> {
        vec![format!("{SHARDS}/*.tar")]
    }

    fn is_one_folder(&self) -> bool {
        true
    }

    fn holds_worlds(&self) -> bool {
        true
    }

    fn names(&self, frame: &Frame, _set: &Document) -> Names {
        Names::side_by_side(&format!("{}-{:06}", frame.condition, frame.spot))
    }

    fn archive(&self, condition: &str, part: usize) -> Option<String> {
        Some(format!("{SHARDS}/{condition}-{part:06}.tar"))
    }

    fn holds(&self, folder: &Path) -> Result<bool> {
        Ok(!with_ending(folder, SHARDS, ".tar")?.is_empty())
    }

    fn find(&self, search: &Search<'_>) -> Result<Found> {
        let shards = with_ending(search.root, SHARDS, ".tar")?;
        if shards.is_empty() {
            let message = format!("found no archive; expected *.tar in it or in {SHARDS}");
            return Err(Error::Parse { path: search.root.to_owned(), message });
        }
        let entries = shards.iter().map(|path| samples(search.root, path)).collect::<Result<Vec<_>>>()?;
        Ok(Found::new(entries.into_iter().flatten().collect()))
    }
}

/// Members of a sample by what follows the key.
#[derive(Default)]
struct Sample {
    members: BTreeMap<String, Source>,
    json: Option<Vec<u8>>,
}

fn samples(root: &Path, path: &Path) -> Result<Vec<Entry>> {
    let broken = io_error("read archive", path);
    let (file, length) = open_within(root, path)?;
    let mut archive = tar::Archive::new(file);
    let mut samples: Vec<(String, Sample)> = Vec::new();
    for member in archive.entries_with_seek().map_err(&broken)? {
        let mut member = member.map_err(&broken)?;
        let name = member.path().map_err(&broken)?.to_string_lossy().into_owned();
        let (folder, base) = name.rsplit_once('/').map_or(("", name.as_str()), |(folder, base)| (folder, base));
        let Some((stem, ending)) = base.split_once('.') else { continue };
        let key = if folder.is_empty() { stem.to_owned() } else { format!("{folder}/{stem}") };
        let (offset, bytes) = (member.raw_file_position(), member.size());
        if offset.checked_add(bytes).is_none_or(|end| end > length) {
            let message = format!("`{name}` reaches beyond the end of the archive, which is cut off at {length} bytes");
            return Err(Error::Parse { path: path.to_owned(), message });
        }
        if samples.last().is_none_or(|(last, _)| *last != key) {
            samples.push((key, Sample::default()));
        }
        let Some((_, sample)) = samples.last_mut() else { continue };
        if ending == "json" {
            let mut text = Vec::new();
            member.by_ref().take(MOST_JSON).read_to_end(&mut text).map_err(&broken)?;
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
