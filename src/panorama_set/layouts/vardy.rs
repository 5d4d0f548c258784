//! Vardy's panoramic image database, the variant of it with x mirrored, and the paper's own set: `<i>_<j>` in a folder.
//!
//! In Vardy's pictures azimuth is 2 pi - delta column and elevation delta ((h - 1) / 2 - row), with delta = 2 pi / width; they are
//! grey. Where the first index counts backwards, `cv_<rows-1-i>_<j>_bw<bw>.pgm`, it is turned round. Indices may begin at 0 or 1.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::panorama::Projection;
use crate::panorama_set::document::{Document, GridDocument};
use crate::panorama_set::entry::{Entry, Frame, Names};
use crate::panorama_set::grid::Place;
use crate::panorama_set::layout::{Found, Layout, Search, equal_angle, grid_only};
use crate::panorama_set::source::file_names;

/// See [`super::LayoutKind::Vardy`].
pub(super) const VARDY: Indexed = Indexed { is_vardy: true };
/// See [`super::LayoutKind::Paper`].
pub(super) const PAPER: Indexed = Indexed { is_vardy: false };

/// Pictures that are called by the indices of their places.
pub(super) struct Indexed {
    is_vardy: bool,
}

impl Indexed {
    /// The two indices in a file's name, and whether the first of them counts backwards.
    fn indices(&self, name: &str) -> Option<((usize, usize), bool)> {
        let (stem, ending) = name.rsplit_once('.')?;
        match ending {
            "pgm" if self.is_vardy && stem.starts_with("cv_") => Some((mirrored_indices(name)?, true)),
            "pgm" => Some((pair(stem)?, false)),
            "png" if !self.is_vardy => Some((pair(stem)?, false)),
            _ => None,
        }
    }
}

/// The indices in `cv_<x>_<y>_bw<bw>.pgm`.
pub(super) fn mirrored_indices(name: &str) -> Option<(usize, usize)> {
    // `cv_3_4_bw0.19.pgm` has a point in its stem.
    pair(name.strip_suffix(".pgm")?.strip_prefix("cv_")?.split_once("_bw")?.0)
}

fn pair(text: &str) -> Option<(usize, usize)> {
    let (i, j) = text.split_once('_')?;
    Some((i.parse().ok()?, j.parse().ok()?))
}

impl Layout for Indexed {
    fn about_files(&self) -> &'static str {
        "Pictures are `CONDITION/I_J.pgm`, 8-bit grey; range and instances of each are `truth/CONDITION/I_J.range.png` and \
         `.instance.png`."
    }

    fn is_written(&self) -> bool {
        self.is_vardy
    }

    fn is_grey(&self) -> bool {
        self.is_vardy
    }

    fn is_clockwise(&self) -> bool {
        self.is_vardy
    }

    fn projection(&self, camera: Projection) -> Projection {
        if self.is_vardy { equal_angle(camera.width, camera.height) } else { camera }
    }

    fn refuses(&self, grid: Option<&GridDocument>, one_heading: bool) -> Option<(String, &'static str)> {
        grid_only(grid, one_heading)
    }

    fn names(&self, frame: &Frame, _set: &Document) -> Names {
        let (condition, Place { i, j }) = (&frame.condition, frame.place.unwrap_or(Place { i: 0, j: frame.spot }));
        Names::with_truth_aside(format!("{condition}/{i}_{j}.pgm"), condition, &format!("{i}_{j}"))
    }

    fn holds(&self, folder: &Path) -> Result<bool> {
        Ok(file_names(folder)?.iter().any(|name| self.indices(name).is_some()))
    }

    fn find(&self, search: &Search<'_>) -> Result<Found> {
        let fault = |message: String| Error::Parse { path: search.folder.to_owned(), message };
        let mut found: BTreeMap<(usize, usize), PathBuf> = BTreeMap::new();
        let mut mirrored = false;
        for name in file_names(search.folder)? {
            let Some((indices, is_mirrored)) = self.indices(&name) else { continue };
            mirrored = is_mirrored;
            if let Some(other) = found.insert(indices, search.folder.join(&name)) {
                let other = other.file_name().unwrap_or_default().display();
                return Err(fault(format!("`{other}` and `{name}` are of one place; expected one panorama each")));
            }
        }
        let ends = |of: fn(&(usize, usize)) -> usize| Some((found.keys().map(of).min()?, found.keys().map(of).max()?));
        let (Some((i0, i1)), Some((j0, _))) = (ends(|k| k.0), ends(|k| k.1)) else {
            let names = if self.is_vardy { "<i>_<j>.pgm or cv_<i>_<j>_bw<w>.pgm" } else { "<i>_<j>.png or <i>_<j>.pgm" };
            return Err(fault(format!("found no panorama; expected files named {names}")));
        };
        let ((i0, i1), j0) = search.grid.map_or(((i0, i1), j0), |g| ((0, i1.max(g.rows - 1)), 0));
        let entries = found.into_iter().map(|((i, j), path)| {
            let place = Place { i: if mirrored { i1 - i } else { i - i0 }, j: j - j0 };
            Entry { place: Some(place), ..search.entry_with_truth_aside(path) }
        });
        let mut entries: Vec<Entry> = entries.collect();
        entries.sort_by_key(|e| e.place);
        Ok(Found::new(entries))
    }
}
