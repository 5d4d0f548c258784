//! The plain layout: a folder a condition, and four files a frame.

use std::path::Path;

use crate::error::Result;
use crate::panorama_set::document::Document;
use crate::panorama_set::entry::{Entry, Frame, Names};
use crate::panorama_set::layout::{Found, Layout, Search};
use crate::panorama_set::source::{Source, file_names};
use crate::storage::read_within;

/// Ending of the pictures.
const IMAGE: &str = ".rgb.png";

/// See [`super::LayoutKind::Folder`].
pub(super) struct Folder;

impl Layout for Folder {
    fn about_files(&self) -> &'static str {
        "A frame is `CONDITION/N.rgb.png`, `.range.png`, `.instance.png` and `.json`; the same N is the same pose in every condition."
    }

    fn holds_worlds(&self) -> bool {
        true
    }

    fn names(&self, frame: &Frame, _set: &Document) -> Names {
        Names::side_by_side(&format!("{}/{:06}", frame.condition, frame.spot))
    }

    fn holds(&self, folder: &Path) -> Result<bool> {
        Ok(file_names(folder)?.iter().any(|name| name.ends_with(IMAGE)))
    }

    fn find(&self, search: &Search<'_>) -> Result<Found> {
        let mut entries = Vec::new();
        for name in file_names(search.folder)? {
            let Some(stem) = name.strip_suffix(IMAGE) else { continue };
            let beside = |ending: &str| search.file(search.folder.join(format!("{stem}.{ending}")));
            let image = Source::File(search.folder.join(&name));
            let mut entry = Entry::new(search.condition, stem, image);
            (entry.range, entry.instance) = (beside("range.png"), beside("instance.png"));
            if let Some(truth) = beside("json") {
                entry.tell(&read_within(search.root, truth.file())?, truth.file())?;
            }
            entries.push(entry);
        }
        Ok(Found::new(entries))
    }
}
