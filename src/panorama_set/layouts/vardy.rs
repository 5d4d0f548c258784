//! Vardy's panoramic image database, the variant of it with x mirrored, and the paper's own set: `<i>_<j>` in a folder.
//!
//! Azimuth is 2 pi - delta column and elevation delta ((h - 1) / 2 - row), with delta = 2 pi / width. Pictures are grey. Where
//! the first index counts backwards, `cv_<rows-1-i>_<j>_bw<bw>.pgm`, it is turned round. Indices may begin at 0 or 1.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::document::GridDocument;
use super::entry::{Entry, Frame, Names, Source};
use super::grid::Place;
use super::layout::Layout;
use super::set::{Found, file_names};
use crate::error::{Error, Result};

pub(super) fn names(frame: &Frame) -> Names {
    let (condition, Place { i, j }) = (&frame.condition, frame.place.unwrap_or(Place { i: 0, j: frame.spot }));
    Names::with_truth_aside(format!("{condition}/{i}_{j}.pgm"), condition, &format!("{i}_{j}"))
}

impl Names {
    /// Names of a frame whose layout has no room for range and instances.
    pub(super) fn with_truth_aside(image: String, condition: &str, stem: &str) -> Self {
        let beside = |channel: &str| format!("truth/{condition}/{stem}.{channel}.png");
        Self { image, range: beside("range"), instance: beside("instance"), truth: None }
    }
}

impl Entry {
    /// Adds range and instances where they lie in `truth/CONDITION/`.
    pub(super) fn find_truth_aside(&mut self, root: &Path, stem: &str) {
        let beside = |channel: &str| {
            let path = root.join("truth").join(&self.condition).join(format!("{stem}.{channel}.png"));
            path.is_file().then_some(Source::File(path))
        };
        (self.range, self.instance) = (beside("range"), beside("instance"));
    }
}

/// Whether the folder holds panoramas of this layout.
pub(super) fn holds(folder: &Path, layout: Layout) -> Result<bool> {
    Ok(file_names(folder)?.iter().any(|name| indices(name, layout).is_some()))
}

/// The panoramas of one condition. `grid` is that of the set where it is known.
pub(super) fn find(root: &Path, folder: &Path, condition: &str, layout: Layout, grid: Option<&GridDocument>) -> Result<Found> {
    let fault = |message: String| Error::Parse { path: folder.to_owned(), message };
    let mut found: BTreeMap<(usize, usize), (String, PathBuf)> = BTreeMap::new();
    let mut mirrored = false;
    for name in file_names(folder)? {
        let Some((indices, is_mirrored)) = indices(&name, layout) else { continue };
        mirrored = is_mirrored;
        if let Some((other, _)) = found.insert(indices, (name.clone(), folder.join(&name))) {
            return Err(fault(format!("`{other}` and `{name}` are of one place; expected one panorama each")));
        }
    }
    let ends = |of: fn(&(usize, usize)) -> usize| Some((found.keys().map(of).min()?, found.keys().map(of).max()?));
    let (Some((i0, i1)), Some((j0, _))) = (ends(|k| k.0), ends(|k| k.1)) else {
        return Err(fault(format!("found no panorama; expected files named {}", names_of(layout))));
    };
    let ((i0, i1), j0) = grid.map_or(((i0, i1), j0), |g| ((0, g.rows - 1), 0));
    let entries = found.into_iter().map(|((i, j), (name, path))| {
        let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| stem).to_owned();
        let mut entry = Entry::new(condition, stem.clone(), Source::File(path));
        entry.place = Some(Place { i: if mirrored { i1 - i } else { i - i0 }, j: j - j0 });
        entry.find_truth_aside(root, &stem);
        entry
    });
    let mut entries: Vec<Entry> = entries.collect();
    entries.sort_by_key(|e| e.place);
    Ok(Found::new(entries))
}

/// What a person calls the files of a layout.
fn names_of(layout: Layout) -> &'static str {
    match layout {
        Layout::Paper => "<i>_<j>.png or <i>_<j>.pgm",
        _ => "<i>_<j>.pgm or cv_<i>_<j>_bw<w>.pgm",
    }
}

/// The two indices in a file's name, and whether the first of them counts backwards.
pub(super) fn indices(name: &str, layout: Layout) -> Option<((usize, usize), bool)> {
    let (stem, ending) = name.rsplit_once('.')?;
    // `cv_3_4_bw0.19.pgm` has a point in its stem.
    let pair = |text: &str| -> Option<(usize, usize)> {
        let (i, j) = text.split_once('_')?;
        Some((i.parse().ok()?, j.parse().ok()?))
    };
    match (layout, ending) {
        (Layout::Paper, "png" | "pgm") => Some((pair(stem)?, false)),
        (Layout::Moeller, "pgm") => Some((pair(stem.strip_prefix("cv_")?.split_once("_bw")?.0)?, true)),
        (Layout::Vardy, "pgm") => match stem.strip_prefix("cv_") {
            Some(rest) => Some((pair(rest.split_once("_bw")?.0)?, true)),
            None => Some((pair(stem)?, false)),
        },
        _ => None,
    }
}
