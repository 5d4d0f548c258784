//! Moeller's layout: `DATA2/<base>_<suffix>.db` holds `w xmin xmax ymin ymax vertRes horizon`, and the pictures of a condition are
//! `DATA2/<base><condition><suffix>/cv_<x>_<y>_bw<bw>.pgm`.
//!
//! x counts the rows of the grid backwards and y its columns. `vertRes` is the angle between rows, rad, and `horizon` the row of
//! elevation 0. Azimuth falls as the column grows, as in Vardy's pictures, which these are.

use std::f64::consts::PI;
use std::path::Path;

use super::vardy::mirrored_indices;
use crate::error::{Error, Result};
use crate::panorama::Projection;
use crate::panorama_set::document::{Document, GridDocument};
use crate::panorama_set::entry::{Entry, Frame, Names};
use crate::panorama_set::grid::Place;
use crate::panorama_set::layout::{Found, Layout, Search, equal_angle, grid_only};
use crate::panorama_set::source::{file_names, with_ending};

/// The bandwidth in the files' names: half a cycle a pixel, which is no filter.
const BANDWIDTH: &str = "0.50";
const FOLDER: &str = "DATA2";
/// Smallest angle between rows that is believed, rad.
const LEAST_RAD: f64 = 1e-6;
/// Largest index of a place, and row of the horizon, that is believed.
const MOST: f64 = 1e6;

/// See [`super::LayoutKind::Moeller`].
pub(super) struct Moeller;

/// A world's name as this layout takes it: letters and digits, whatever else left out.
fn plain(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).collect()
}

fn suffix(set: &Document) -> String {
    format!("w{}", set.projection.width)
}

impl Layout for Moeller {
    fn about_files(&self) -> &'static str {
        "`DATA2/*.db` holds `w xmin xmax ymin ymax vertRes horizon`; pictures are `cv_X_Y_bwBW.pgm`, 8-bit grey, X = rows - 1 - i \
         and Y = j; range and instances of each lie in `truth/CONDITION/`."
    }

    fn is_grey(&self) -> bool {
        true
    }

    fn is_clockwise(&self) -> bool {
        true
    }

    fn is_one_folder(&self) -> bool {
        true
    }

    fn projection(&self, camera: Projection) -> Projection {
        equal_angle(camera.width, camera.height)
    }

    fn refuses(&self, grid: Option<&GridDocument>, one_heading: bool) -> Option<(String, &'static str)> {
        grid_only(grid, one_heading)
    }

    fn names(&self, frame: &Frame, set: &Document) -> Names {
        let Place { i, j } = frame.place.unwrap_or(Place { i: 0, j: 0 });
        let rows = set.grid.as_ref().map_or(i + 1, |g| g.rows);
        let stem = format!("cv_{}_{j}_bw{BANDWIDTH}", rows - 1 - i);
        let image = format!("{FOLDER}/{}{}{}/{stem}.pgm", plain(&set.world), frame.condition, suffix(set));
        Names::with_truth_aside(image, &frame.condition, &stem)
    }

    fn lists(&self, set: &Document, _frames: &dyn Fn(usize) -> Vec<Frame>) -> Vec<(String, String)> {
        let (rows, columns) = set.grid.as_ref().map_or((1, 1), |g| (g.rows, g.columns));
        let p = set.projection;
        let line = format!("{} 0 {} 0 {} {} {}\n", p.width, rows - 1, columns - 1, p.pixel_rad(), p.horizon_row - 0.5);
        vec![(format!("{FOLDER}/{}_{}.db", plain(&set.world), suffix(set)), line)]
    }

    fn holds(&self, folder: &Path) -> Result<bool> {
        Ok(!with_ending(folder, FOLDER, ".db")?.is_empty())
    }

    fn find(&self, search: &Search<'_>) -> Result<Found> {
        let databases = with_ending(search.root, FOLDER, ".db")?;
        let [path] = &databases[..] else {
            let message = format!("found {} files *.db in it or in {FOLDER}, expected one", databases.len());
            return Err(Error::Parse { path: search.root.to_owned(), message });
        };
        let line = search.text(path)?;
        let numbers: Vec<f64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
        let fault = |message: String| Error::Parse { path: path.clone(), message };
        let [_, xmin, xmax, ymin, ymax, vertical_rad, horizon] = numbers[..] else {
            return Err(fault(format!("line 1: found `{}`, expected w xmin xmax ymin ymax vertRes horizon", line.trim())));
        };
        let is_range = |low: f64, high: f64| 0.0 <= low && low <= high && high <= MOST;
        let is_horizon = horizon.abs() <= MOST;
        if !(is_range(xmin, xmax) && is_range(ymin, ymax) && (LEAST_RAD..=PI).contains(&vertical_rad) && is_horizon) {
            return Err(fault(format!(
                "line 1: found `{}`, expected 0 <= xmin <= xmax <= {MOST}, 0 <= ymin <= ymax <= {MOST}, vertRes from {LEAST_RAD} \
                 to pi, horizon from -{MOST} to {MOST}",
                line.trim()
            )));
        }
        let (xmin, xmax, ymin, ymax) = (xmin as usize, xmax as usize, ymin as usize, ymax as usize);
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let (base, suffix) = stem.split_once('_').ok_or_else(|| fault("expected a name <base>_<suffix>.db".to_owned()))?;
        let folder = path.parent().unwrap_or(search.root);
        let mut found = Found { vertical: Some((vertical_rad, horizon)), ..Found::new(Vec::new()) };
        for name in file_names(folder)? {
            let Some(condition) = name.strip_prefix(base).and_then(|rest| rest.strip_suffix(suffix)) else { continue };
            let below = folder.join(&name);
            if !below.is_dir() {
                continue;
            }
            let mut entries = Vec::new();
            for file in file_names(&below)? {
                let Some((x, y)) = mirrored_indices(&file) else { continue };
                let picture = below.join(&file);
                if !(xmin..=xmax).contains(&x) || !(ymin..=ymax).contains(&y) {
                    let message = format!("found place ({x}, {y}), expected x {xmin} to {xmax} and y {ymin} to {ymax}");
                    return Err(Error::Parse { path: picture, message });
                }
                let place = Some(Place { i: xmax - x, j: y - ymin });
                entries.push(Entry { place, ..Search { condition, ..*search }.entry_with_truth_aside(picture) });
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
}
