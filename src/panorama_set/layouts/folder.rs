//! The plain layout: a folder a condition, and four files a frame.

use std::path::Path;

use super::entry::{Entry, Frame, FrameTruth, Names, Source};
use super::grid::Place;
use super::set::{Found, file_names};
use crate::error::{Error, Result};
use crate::storage::io_error;

/// Ending of the pictures.
pub(super) const IMAGE: &str = ".rgb.png";

pub(super) fn names(frame: &Frame) -> Names {
    let stem = format!("{}/{:06}", frame.condition, frame.spot);
    let file = |ending: &str| format!("{stem}.{ending}");
    Names { image: file("rgb.png"), range: file("range.png"), instance: file("instance.png"), truth: Some(file("json")) }
}

/// Whether the folder holds panoramas of this layout.
pub(super) fn holds(folder: &Path) -> Result<bool> {
    Ok(file_names(folder)?.iter().any(|name| name.ends_with(IMAGE)))
}

/// The panoramas of one condition.
pub(super) fn find(folder: &Path, condition: &str) -> Result<Found> {
    let mut entries = Vec::new();
    for name in file_names(folder)? {
        let Some(stem) = name.strip_suffix(IMAGE) else { continue };
        let mut entry = Entry::new(condition, stem, Source::File(folder.join(&name)));
        let beside = |ending: &str| Some(folder.join(format!("{stem}.{ending}"))).filter(|p| p.is_file());
        (entry.range, entry.instance) = (beside("range.png").map(Source::File), beside("instance.png").map(Source::File));
        if let Some(path) = beside("json") {
            let text = std::fs::read(&path).map_err(io_error("read", &path))?;
            entry.tell(&text, &path)?;
        }
        entries.push(entry);
    }
    Ok(Found::new(entries))
}

impl Entry {
    /// Takes place, pose and condition from a frame's truth as JSON.
    pub(super) fn tell(&mut self, json: &[u8], path: &Path) -> Result<()> {
        let truth: FrameTruth =
            serde_json::from_slice(json).map_err(|e| Error::Parse { path: path.to_owned(), message: e.to_string() })?;
        self.place = truth.place.map(|[i, j]| Place { i, j });
        self.pose = Some(truth.pose.into());
        self.condition = truth.condition;
        Ok(())
    }
}
