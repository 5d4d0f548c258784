//! What a layout of sets is: how files are named and coded, and how they are found again.

use std::path::{Path, PathBuf};

use super::document::{Document, GridDocument};
use super::entry::{Entry, Frame, Names};
use super::source::Source;
use crate::error::{Error, Result};
use crate::panorama::{Projection, ProjectionKind};
use crate::storage::read_within;

/// A layout of panorama sets: both directions, so that what is written in it is read back equal.
///
/// A layout is a file of its own in `layouts/` and a line of [`LayoutKind`](super::LayoutKind).
pub trait Layout: Sync {
    /// What the card of a set says about its files, in sentences.
    fn about_files(&self) -> &'static str;

    /// Which files Hugging Face's `datasets` loads as samples: patterns.
    fn samples(&self, _set: &Document) -> Vec<String> {
        Vec::new()
    }

    /// Whether sets are written in it, not only read.
    fn is_written(&self) -> bool {
        true
    }

    /// Whether its pictures are grey.
    fn is_grey(&self) -> bool {
        false
    }

    /// Whether azimuth falls as the column grows.
    fn is_clockwise(&self) -> bool {
        false
    }

    /// The projection of its pictures: a camera's own, or the layout's where that leaves no choice.
    fn projection(&self, camera: Projection) -> Projection {
        camera
    }

    /// Whether a set of several worlds can be written in it: those layouts cannot that tell of one room for all frames.
    fn holds_worlds(&self) -> bool {
        false
    }

    /// What keeps a set out of this layout, if anything does: what was found and what is allowed. `grid` is that of the set;
    /// `one_heading` says whether the robot looks one way at each place.
    fn refuses(&self, _grid: Option<&GridDocument>, _one_heading: bool) -> Option<(String, &'static str)> {
        None
    }

    /// What a frame's files are called.
    fn names(&self, frame: &Frame, set: &Document) -> Names;

    /// The archive that holds the frames of a condition's part; `None` where each file stands for itself.
    fn archive(&self, _condition: &str, _part: usize) -> Option<String> {
        None
    }

    /// Names and contents of what lies beside the pictures once all are there. `frames` gives those of each condition of the
    /// document.
    fn lists(&self, _set: &Document, _frames: &dyn Fn(usize) -> Vec<Frame>) -> Vec<(String, String)> {
        Vec::new()
    }

    /// Whether a set's folder is searched as a whole; else each condition has a folder, and one of these alone is a set, too.
    fn is_one_folder(&self) -> bool {
        false
    }

    /// Whether a folder holds panoramas of this layout.
    fn holds(&self, folder: &Path) -> Result<bool>;

    /// The panoramas of a folder.
    fn find(&self, search: &Search<'_>) -> Result<Found>;
}

/// Where a layout looks for panoramas.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// The set's folder: nothing outside is opened.
    pub root: &'a Path,
    /// The folder with the panoramas of a condition, or that of the set.
    pub folder: &'a Path,
    /// The condition; empty where it has no name.
    pub condition: &'a str,
    /// The grid, where the set's document tells it.
    pub grid: Option<&'a GridDocument>,
}

impl Search<'_> {
    /// The text of a file of the set.
    pub fn text(&self, path: &Path) -> Result<String> {
        let text = String::from_utf8(read_within(self.root, path)?);
        text.map_err(|e| Error::Parse { path: path.to_owned(), message: format!("found {e}, expected UTF-8") })
    }

    /// A file of the set, if it is there.
    pub(super) fn file(&self, path: PathBuf) -> Option<Source> {
        path.is_file().then_some(Source::File(path))
    }

    /// The panorama whose picture is `file`, with range and instances where they lie in `truth/CONDITION/`.
    pub fn entry_with_truth_aside(&self, file: PathBuf) -> Entry {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| stem);
        let beside =
            |channel: &str| self.file(self.root.join("truth").join(self.condition).join(format!("{stem}.{channel}.png")));
        let (range, instance) = (beside("range"), beside("instance"));
        Entry { range, instance, ..Entry::new(self.condition, stem, Source::File(file)) }
    }
}

/// What a layout found.
pub struct Found {
    /// Panoramas, in order.
    pub entries: Vec<Entry>,
    /// What files say in contradiction to one another.
    pub warnings: Vec<String>,
    /// Angle between rows (rad) and row of the horizon, where the layout tells.
    pub vertical: Option<(f64, f64)>,
}

impl Found {
    /// Panoramas, and nothing else to say.
    pub fn new(entries: Vec<Entry>) -> Self {
        Self { entries, warnings: Vec::new(), vertical: None }
    }
}

/// The refusal of a layout with one picture for each place of a grid.
pub(super) fn grid_only(grid: Option<&GridDocument>, one_heading: bool) -> Option<(String, &'static str)> {
    let found = if grid.is_none() { "no --grid" } else { "several headings at a place" };
    (grid.is_none() || !one_heading).then(|| (found.into(), "a grid with one heading for all: it holds one picture a place"))
}

/// Column 0 ahead, horizon in the middle, rows even in elevation.
pub(super) fn equal_angle(width: u32, height: u32) -> Projection {
    Projection { kind: ProjectionKind::EqualAngle, ..Projection::new(width, height) }
}
