//! Moeller's layout: `DATA2/<base>_<suffix>.db` holds `w xmin xmax ymin ymax vertRes horizon`, and the pictures of a condition are
//! `DATA2/<base><condition><suffix>/cv_<x>_<y>_bw<bw>.pgm`.
//!
//! x counts the rows of the grid backwards and y its columns. `vertRes` is the angle between rows, rad, and `horizon` the row of
//! elevation 0. Azimuth falls as the column grows, as in Vardy's pictures, which these are.

use std::path::{Path, PathBuf};

use super::document::Document;
use super::entry::{Entry, Frame, Names, Source};
use super::grid::Place;
use super::layout::Layout;
use super::set::{Found, file_names};
use super::vardy::indices;
use crate::error::{Error, Result};
use crate::storage::io_error;

/// The bandwidth in the files' names: half a cycle a pixel, which is no filter.
pub const BANDWIDTH: &str = "0.50";
const FOLDER: &str = "DATA2";

/// A world's name as this layout and keys take it: letters and digits, whatever else left out.
fn plain(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).collect()
}

fn suffix(set: &Document) -> String {
    format!("w{}", set.projection.width)
}

pub(super) fn names(frame: &Frame, set: &Document) -> Names {
    let Place { i, j } = frame.place.unwrap_or(Place { i: 0, j: 0 });
    let rows = set.grid.as_ref().map_or(i + 1, |g| g.rows);
    let stem = format!("cv_{}_{j}_bw{BANDWIDTH}", rows - 1 - i);
    let image = format!("{FOLDER}/{}{}{}/{stem}.pgm", plain(&set.world), frame.condition, suffix(set));
    Names::with_truth_aside(image, &frame.condition, &stem)
}

/// Name of the line about the grid.
#[must_use]
pub fn database_name(set: &Document) -> String {
    format!("{FOLDER}/{}_{}.db", plain(&set.world), suffix(set))
}

/// The line about the grid.
#[must_use]
pub fn database_line(set: &Document) -> String {
    let (rows, columns) = set.grid.as_ref().map_or((1, 1), |g| (g.rows, g.columns));
    let p = set.projection;
    format!("{} 0 {} 0 {} {} {}\n", p.width, rows - 1, columns - 1, p.pixel_rad(), p.horizon_row - 0.5)
}

/// The `.db` files of a set.
pub(super) fn databases(root: &Path) -> Result<Vec<PathBuf>> {
    for folder in [root.join(FOLDER), root.to_owned()] {
        if folder.is_dir() {
            let names: Vec<_> = file_names(&folder)?.into_iter().filter(|n| n.ends_with(".db")).collect();
            if !names.is_empty() {
                return Ok(names.into_iter().map(|n| folder.join(n)).collect());
            }
        }
    }
    Ok(Vec::new())
}

/// All conditions of a set.
pub(super) fn find(root: &Path) -> Result<Found> {
    let databases = databases(root)?;
    let [path] = &databases[..] else {
        let message = format!("found {} files *.db in it or in {FOLDER}, expected one", databases.len());
        return Err(Error::Parse { path: root.to_owned(), message });
    };
    let line = std::fs::read_to_string(path).map_err(io_error("read", path))?;
    let numbers: Vec<f64> =
        line.split_whitespace().map_while(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect();
    let fault = |message: String| Error::Parse { path: path.clone(), message };
    let [_, xmin, xmax, ymin, ymax, vertical_rad, horizon] = numbers[..] else {
        return Err(fault(format!("line 1: found `{}`, expected w xmin xmax ymin ymax vertRes horizon", line.trim())));
    };
    if !(0.0 <= xmin && xmin <= xmax && 0.0 <= ymin && ymin <= ymax && vertical_rad > 0.0) {
        return Err(fault(format!(
            "line 1: found `{}`, expected 0 <= xmin <= xmax, 0 <= ymin <= ymax, vertRes > 0",
            line.trim()
        )));
    }
    let (xmin, xmax, ymin, ymax) = (xmin as usize, xmax as usize, ymin as usize, ymax as usize);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (base, suffix) = stem.split_once('_').ok_or_else(|| fault("expected a name <base>_<suffix>.db".to_owned()))?;
    let folder = path.parent().unwrap_or(root);
    let mut found = Found { vertical: Some((vertical_rad, horizon)), ..Found::new(Vec::new()) };
    for name in file_names(folder)? {
        let Some(condition) = name.strip_prefix(base).and_then(|rest| rest.strip_suffix(suffix)) else { continue };
        if !folder.join(&name).is_dir() {
            continue;
        }
        let mut entries = Vec::new();
        for file in file_names(&folder.join(&name))? {
            let Some(((x, y), _)) = indices(&file, Layout::Moeller) else { continue };
            let picture = folder.join(&name).join(&file);
            if !(xmin..=xmax).contains(&x) || !(ymin..=ymax).contains(&y) {
                let message = format!("found place ({x}, {y}), expected x {xmin} to {xmax} and y {ymin} to {ymax}");
                return Err(Error::Parse { path: picture, message });
            }
            let stem = file.trim_end_matches(".pgm").to_owned();
            let mut entry = Entry::new(condition, stem.clone(), Source::File(picture));
            entry.place = Some(Place { i: xmax - x, j: y - ymin });
            entry.find_truth_aside(root, &stem);
            entries.push(entry);
        }
        entries.sort_by_key(|e| e.place);
        found.entries.extend(entries);
    }
    if found.entries.is_empty() {
        let message = format!("found no panorama, expected {base}<condition>{suffix}/cv_<x>_<y>_bw<bw>.pgm beside it");
        return Err(fault(message));
    }
    Ok(found)
}
