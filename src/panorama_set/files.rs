//! Sets of panoramas on disk.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageReader};

use super::grid::Place;
use crate::error::{Error, Result};
use crate::panorama::{Panorama, Projection};

/// How a set's files are named and what their pixels mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Vardy's panoramic image database: `<i>_<j>.pgm`, or `cv_<rows-1-i>_<j>_bw<..>.pgm`. Azimuth falls as the column grows; rows are
    /// evenly spaced in elevation, with the horizon in the middle.
    Vardy,
    /// The paper's own set: `<i>_<j>.png` or `.pgm`, bearing = 2 pi column / width; rows are taken as this project's.
    Paper,
}

/// A complete set in one folder.
#[derive(Debug, Clone)]
pub struct PanoramaSet {
    layout: Layout,
    files: BTreeMap<Place, PathBuf>,
    rows: usize,
    columns: usize,
}

/// Largest edge of a picture that is read, pixels.
const MOST_PX: u32 = 16384;

impl PanoramaSet {
    /// Finds the panoramas of a folder. Indices may count from 0 or from 1; other files are passed over.
    ///
    /// # Errors
    /// When the folder cannot be read, holds no panorama, two of one place, or lacks one of a full grid.
    pub fn open(folder: &Path, layout: Layout) -> Result<Self> {
        let io = |source| Error::Io { action: "read folder", path: folder.to_owned(), source };
        let fault = |message: String| Error::Parse { path: folder.to_owned(), message };
        let mut found: BTreeMap<(usize, usize), PathBuf> = BTreeMap::new();
        let mut mirrored = false;
        for entry in fs::read_dir(folder).map_err(io)? {
            let path = entry.map_err(io)?.path();
            let Some(name) = path.file_name().and_then(|n| n.to_str()) else { continue };
            let Some((indices, is_mirrored)) = indices(name, layout) else { continue };
            mirrored = is_mirrored;
            if let Some(other) = found.insert(indices, path.clone()) {
                let names = [&other, &path].map(|p| p.file_name().unwrap_or_default().to_string_lossy().into_owned());
                return Err(fault(format!("`{}` and `{}` are of one place; expected one panorama each", names[0], names[1])));
            }
        }
        let least = |of: fn(&(usize, usize)) -> usize| found.keys().map(of).min();
        let most = |of: fn(&(usize, usize)) -> usize| found.keys().map(of).max();
        let [Some(i0), Some(j0), Some(i1), Some(j1)] = [least(|k| k.0), least(|k| k.1), most(|k| k.0), most(|k| k.1)] else {
            return Err(fault(format!("found no panorama; expected files named {}", names_of(layout))));
        };
        let (rows, columns) = (i1 - i0 + 1, j1 - j0 + 1);
        if rows * columns != found.len() {
            let missing = (i0..=i1).flat_map(|i| (j0..=j1).map(move |j| (i, j))).find(|k| !found.contains_key(k));
            let (i, j) = missing.unwrap_or_default();
            return Err(fault(format!(
                "found {} panoramas and none of place ({i}, {j}); expected all {rows} x {columns} from ({i0}, {j0}) to ({i1}, {j1})",
                found.len()
            )));
        }
        let row = |i: usize| if mirrored { i1 - i } else { i - i0 };
        let files = found.into_iter().map(|((i, j), path)| (Place { i: row(i), j: j - j0 }, path)).collect();
        Ok(Self { layout, files, rows, columns })
    }

    /// Rows and columns of the grid.
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        (self.rows, self.columns)
    }

    /// The panorama of a place, with this project's projection: column 0 along the heading, azimuth growing anti-clockwise with the
    /// column, rows even in the tangent of elevation. Range and instances are unknown.
    ///
    /// # Errors
    /// When the file cannot be read or decoded, is larger than 16384 pixels along an edge, or the place is not of the grid.
    pub fn load(&self, place: Place) -> Result<Panorama> {
        let path = self.files.get(&place).ok_or_else(|| Error::Invalid {
            what: "place of the grid".into(),
            found: format!("({}, {})", place.i, place.j),
            allowed: format!("{} rows and {} columns from (0, 0)", self.rows, self.columns),
        })?;
        let broken = |source| Error::Image { path: path.clone(), source };
        let mut reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format).map_err(|source| Error::Io {
            action: "read",
            path: path.clone(),
            source,
        })?;
        let mut limits = image::Limits::default();
        limits.max_image_width = Some(MOST_PX);
        limits.max_image_height = Some(MOST_PX);
        reader.limits(limits);
        Ok(match self.layout {
            Layout::Paper => as_it_is(&reader.decode().map_err(broken)?),
            Layout::Vardy => from_vardy(&as_it_is(&reader.decode().map_err(broken)?)),
        })
    }
}

/// What a person calls the files of a layout.
fn names_of(layout: Layout) -> &'static str {
    match layout {
        Layout::Vardy => "<i>_<j>.pgm or cv_<i>_<j>_bw<w>.pgm",
        Layout::Paper => "<i>_<j>.png or <i>_<j>.pgm",
    }
}

/// The two indices in a file's name, and whether the first of them counts backwards.
fn indices(name: &str, layout: Layout) -> Option<((usize, usize), bool)> {
    let (stem, ending) = name.rsplit_once('.')?;
    // `cv_3_4_bw0.19.pgm` has a point in its stem.
    let pair = |text: &str| -> Option<(usize, usize)> {
        let (i, j) = text.split_once('_')?;
        Some((i.parse().ok()?, j.parse().ok()?))
    };
    match (layout, ending) {
        (Layout::Vardy, "pgm") => match stem.strip_prefix("cv_") {
            Some(rest) => Some((pair(rest.split_once("_bw")?.0)?, true)),
            None => Some((pair(stem)?, false)),
        },
        (Layout::Paper, "png" | "pgm") => Some((pair(stem)?, false)),
        _ => None,
    }
}

fn as_it_is(picture: &DynamicImage) -> Panorama {
    let rgba = picture.to_rgba8();
    let projection = Projection::new(rgba.width(), rgba.height());
    Panorama { projection, rgba: rgba.into_raw(), range_m: Vec::new(), instance: Vec::new() }
}

/// Vardy's azimuth is 2 pi - delta column and his elevation delta ((h - 1) / 2 - row), with delta = 2 pi / width.
fn from_vardy(taken: &Panorama) -> Panorama {
    let projection = taken.projection;
    let (width, height) = (projection.width as usize, projection.height as usize);
    let mut rgba = Vec::with_capacity(taken.rgba.len());
    for row in 0..height {
        let elevation = libm::atan(projection.tan_elevation(row as f64));
        let from = ((height as f64 - 1.0) / 2.0 - elevation / projection.pixel_rad()).clamp(0.0, height as f64 - 1.0);
        let above = (from as usize).min(height.saturating_sub(2));
        let share = from - above as f64;
        let below = (above + 1).min(height - 1);
        for column in 0..width {
            let mirrored = (width - column) % width;
            for channel in 0..4 {
                let at = |row: usize| f64::from(taken.rgba[4 * (row * width + mirrored) + channel]);
                rgba.push((at(above) + share * (at(below) - at(above))).round() as u8);
            }
        }
    }
    Panorama { projection, rgba, range_m: Vec::new(), instance: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grey picture whose pixel (column, row) is 10 column + row.
    fn write(folder: &Path, name: &str) {
        let mut bytes = b"P5\n8 4\n255\n".to_vec();
        bytes.extend((0..4_u8).flat_map(|row| (0..8_u8).map(move |column| 10 * column + row)));
        fs::write(folder.join(name), bytes).unwrap();
    }

    #[test]
    fn vardys_columns_are_turned_round() {
        let folder = tempfile::tempdir().unwrap();
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            write(folder.path(), &format!("{i}_{j}.pgm"));
        }
        fs::write(folder.path().join("readme.txt"), "passed over").unwrap();
        let set = PanoramaSet::open(folder.path(), Layout::Vardy).unwrap();
        assert_eq!(set.shape(), (2, 2));
        let panorama = set.load(Place { i: 1, j: 0 }).unwrap();
        let red = |column: usize, row: usize| panorama.rgba[4 * (8 * row + column)];
        // Azimuth of his column c is -c delta: ours has it in column 8 - c.
        assert_eq!(red(0, 1) / 10, 0);
        assert_eq!(red(3, 1) / 10, 5);
        assert!(set.load(Place { i: 2, j: 0 }).unwrap_err().to_string().contains("2 rows"));
        let paper = PanoramaSet::open(folder.path(), Layout::Paper).unwrap().load(Place { i: 0, j: 0 }).unwrap();
        assert_eq!(paper.rgba[4 * 3], 30);
    }

    #[test]
    fn a_set_must_be_whole() {
        let folder = tempfile::tempdir().unwrap();
        let open = || PanoramaSet::open(folder.path(), Layout::Vardy).map(|s| s.shape()).map_err(|e| e.to_string());
        assert!(open().unwrap_err().contains("<i>_<j>.pgm"));
        for (i, j) in [(1, 1), (1, 2), (2, 2)] {
            write(folder.path(), &format!("{i}_{j}.pgm"));
        }
        assert!(open().unwrap_err().contains("none of place (2, 1)"));
        write(folder.path(), "2_1.pgm");
        assert_eq!(open(), Ok((2, 2)));
        let mirrored = tempfile::tempdir().unwrap();
        for i in 0..3 {
            write(mirrored.path(), &format!("cv_{i}_0_bw0.19.pgm"));
        }
        let set = PanoramaSet::open(mirrored.path(), Layout::Vardy).unwrap();
        assert!(set.files[&Place { i: 0, j: 0 }].ends_with("cv_2_0_bw0.19.pgm"));
    }
}
