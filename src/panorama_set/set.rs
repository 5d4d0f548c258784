//! Opening a set, whatever its layout, and loading its panoramas.

use std::path::{Path, PathBuf};

use super::decode::{even_rows, mirror, numbers, picture};
use super::document::{Document, GridDocument};
use super::entry::Entry;
use super::grid::{Grid, Place};
use super::layout::{Layout, equal_angle};
use super::{folder, image_database, moeller, vardy, webdataset};
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::panorama::{Panorama, Projection};
use crate::storage::io_error;

/// Folders of a set that hold no condition.
const RESERVED: [&str; 6] = ["truth", "examples", "parts", "home", "shards", "DATA2"];
/// Vertical steps of a real set may differ by this share from the horizontal ones before rows are resampled.
const EVEN: f64 = 1e-3;

/// What a layout's reader found.
pub(super) struct Found {
    pub entries: Vec<Entry>,
    pub warnings: Vec<String>,
    /// Angle between rows (rad) and row of the horizon, where the layout tells.
    pub vertical: Option<(f64, f64)>,
}

impl Found {
    pub fn new(entries: Vec<Entry>) -> Self {
        Self { entries, warnings: Vec::new(), vertical: None }
    }
}

/// A set of panoramas on disk.
#[derive(Debug, Clone)]
pub struct PanoramaSet {
    folder: PathBuf,
    layout: Layout,
    entries: Vec<Entry>,
    document: Option<Document>,
    vertical: Option<(f64, f64)>,
    warnings: Vec<String>,
}

impl PanoramaSet {
    /// Opens a set and finds out its layout: by its `dataset.json`, else by what its files are called. The folder may be the
    /// whole set or that of one condition.
    ///
    /// # Errors
    /// When the folder cannot be read, is of no layout that is known, or does not keep to it.
    pub fn open(folder: &Path) -> Result<Self> {
        let layout = match Document::load(folder)? {
            Some(document) => document.layout,
            None => detect(folder)?.ok_or_else(|| Error::Parse {
                path: folder.to_owned(),
                message:
                    "found no set of panoramas, neither in it nor in its folders; expected one of the layouts vardy, moeller, \
                          image-database, webdataset, folder or paper"
                        .to_owned(),
            })?,
        };
        Self::open_as(folder, layout)
    }

    /// Opens a set of the given layout. Other files are passed over.
    ///
    /// # Errors
    /// As [`PanoramaSet::open`].
    pub fn open_as(folder: &Path, layout: Layout) -> Result<Self> {
        let document = Document::load(folder)?;
        let grid = document.as_ref().and_then(|d| d.grid.as_ref());
        let in_each = |holds: &dyn Fn(&Path) -> Result<bool>, find: &dyn Fn(&Path, &str) -> Result<Found>| -> Result<Found> {
            if document.is_none() && holds(folder)? {
                return find(folder, "");
            }
            let mut all = Found::new(Vec::new());
            for condition in conditions(folder, document.as_ref())? {
                let path = folder.join(&condition);
                if holds(&path)? {
                    let found = find(&path, &condition)?;
                    all.entries.extend(found.entries);
                    all.warnings.extend(found.warnings);
                }
            }
            // In a folder without any panorama the layout's reader says what it expects.
            if all.entries.is_empty() { find(folder, "") } else { Ok(all) }
        };
        let found = match layout {
            Layout::Vardy | Layout::Paper => in_each(&|path| vardy::holds(path, layout), &|path, condition| {
                vardy::find(folder, path, condition, layout, grid)
            }),
            Layout::Moeller => moeller::find(folder),
            Layout::ImageDatabase => in_each(&|path| Ok(path.join(image_database::ENTRIES).is_file()), &|path, condition| {
                image_database::find(folder, path, condition, grid)
            }),
            Layout::Webdataset => webdataset::find(folder),
            Layout::Folder => in_each(&|path| folder::holds(path), &|path, condition| folder::find(path, condition)),
        }?;
        if found.entries.is_empty() {
            let message = format!("found no panorama of layout {}", layout.name());
            return Err(Error::Parse { path: folder.to_owned(), message });
        }
        let mut entries = found.entries;
        if let Some(document) = &document {
            let rank = |entry: &Entry| document.conditions.iter().position(|c| c.name == entry.condition);
            entries.sort_by_key(rank);
            if let (Some(grid), Some(heading)) = (&document.grid, document.heading_rad) {
                let place = |place: Place| {
                    let s = grid.spacing_m;
                    Pose::new(grid.first_m[0] + place.j as f64 * s, grid.first_m[1] - place.i as f64 * s, heading)
                };
                for entry in entries.iter_mut().filter(|e| e.pose.is_none()) {
                    entry.pose = entry.place.map(place);
                }
            }
        }
        for warning in &found.warnings {
            log::warn!("{warning}");
        }
        let (folder, warnings, vertical) = (folder.to_owned(), found.warnings, found.vertical);
        Ok(Self { folder, layout, entries, document, vertical, warnings })
    }

    /// The set's folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its layout.
    #[must_use]
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Its document, if this program wrote it.
    #[must_use]
    pub fn document(&self) -> Option<&Document> {
        self.document.as_ref()
    }

    /// Its panoramas, condition by condition.
    #[must_use]
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// What its files say in contradiction to one another, and who is believed.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Names of its conditions, in order.
    #[must_use]
    pub fn conditions(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for entry in &self.entries {
            if !names.contains(&entry.condition.as_str()) {
                names.push(&entry.condition);
            }
        }
        names
    }

    /// The set with the panoramas of one condition alone.
    ///
    /// # Errors
    /// When it has no such condition.
    pub fn only(mut self, condition: &str) -> Result<Self> {
        if !self.conditions().contains(&condition) {
            return Err(Error::Invalid {
                what: format!("condition of the set in {}", self.folder.display()),
                found: condition.to_owned(),
                allowed: self.conditions().join(", "),
            });
        }
        self.entries.retain(|e| e.condition == condition);
        Ok(self)
    }

    /// Rows and columns of the grid, those of places without a panorama included; (0, 0) for a set without places.
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        if let Some(GridDocument { rows, columns, .. }) = self.document.as_ref().and_then(|d| d.grid.as_ref()) {
            return (*rows, *columns);
        }
        let most = |of: fn(Place) -> usize| self.entries.iter().filter_map(|e| e.place).map(of).max().map_or(0, |k| k + 1);
        (most(|p| p.i), most(|p| p.j))
    }

    /// The set, if it has a panorama at every place of its grid.
    ///
    /// # Errors
    /// Which place has none.
    pub fn whole(self) -> Result<Self> {
        let (rows, columns) = self.shape();
        let held: std::collections::BTreeSet<Place> = self.entries.iter().filter_map(|e| e.place).collect();
        let missing = (0..rows).flat_map(|i| (0..columns).map(move |j| Place { i, j })).find(|p| !held.contains(p));
        match missing {
            None => Ok(self),
            Some(Place { i, j }) => Err(Error::Parse {
                path: self.folder,
                message: format!(
                    "found {} panoramas and none of place ({i}, {j}); expected all {rows} x {columns} from (0, 0)",
                    held.len()
                ),
            }),
        }
    }

    /// The grid about home, for a set on a grid; `spacing_m` and `home` are for sets that do not tell. Without a home the middle
    /// is taken.
    #[must_use]
    pub fn grid(&self, spacing_m: Option<f64>, home: Option<Place>) -> Option<Grid> {
        let (rows, columns) = self.shape();
        let told = self.document.as_ref().and_then(|d| d.grid.as_ref());
        let spacing_m = spacing_m.or(told.map(|g| g.spacing_m))?;
        let told_home = told.and_then(|g| g.home).map(|[i, j]| Place { i, j });
        let middle = Place { i: rows.saturating_sub(1) / 2, j: columns.saturating_sub(1) / 2 };
        let home = home.or(told_home).unwrap_or(middle);
        (rows > 0 && columns > 0).then_some(Grid { rows, columns, spacing_m, home })
    }

    /// The panorama of a place, of the first condition that has it.
    ///
    /// # Errors
    /// As [`PanoramaSet::load`], and when the place is not of the set.
    pub fn at(&self, place: Place) -> Result<Panorama> {
        let k = self.entries.iter().position(|e| e.place == Some(place)).ok_or_else(|| Error::Invalid {
            what: "place of the grid".into(),
            found: format!("({}, {})", place.i, place.j),
            allowed: format!(
                "a place with a panorama; there are {} rows and {} columns from (0, 0)",
                self.shape().0,
                self.shape().1
            ),
        })?;
        self.load(k)
    }

    /// Panorama `k` of [`entries`](Self::entries), columns anti-clockwise, with range and instances where the set has them.
    ///
    /// # Errors
    /// When a file cannot be read or decoded, or is larger than 16384 pixels along an edge.
    ///
    /// # Panics
    /// When there are not so many.
    pub fn load(&self, k: usize) -> Result<Panorama> {
        let entry = &self.entries[k];
        let mut panorama = picture(&entry.image, |width, height| self.projection(width, height))?;
        if let (Some(range), Some(instance)) = (&entry.range, &entry.instance) {
            let millimetres = numbers(range, panorama.projection)?;
            panorama.range_m = millimetres.into_iter().map(|mm| f32::from(mm) / 1000.0).collect();
            panorama.instance = numbers(instance, panorama.projection)?;
        }
        if self.layout.is_clockwise() {
            mirror(&mut panorama);
        }
        let pixel = panorama.projection.pixel_rad();
        match self.vertical {
            Some((step_rad, horizon)) if (step_rad / pixel - 1.0).abs() > EVEN && panorama.range_m.is_empty() => {
                Ok(even_rows(&panorama, step_rad, horizon))
            }
            _ => Ok(panorama),
        }
    }

    fn projection(&self, width: u32, height: u32) -> Projection {
        let told = self.document.as_ref().map(|d| d.projection).filter(|p| (p.width, p.height) == (width, height));
        told.unwrap_or_else(|| match self.layout {
            Layout::Vardy => equal_angle(width, height),
            Layout::Moeller => {
                let even = equal_angle(width, height);
                let horizon = self.vertical.map_or(even.horizon_row, |(_, horizon)| horizon + 0.5);
                Projection { horizon_row: horizon, ..even }
            }
            _ => Projection::new(width, height),
        })
    }
}

/// What layout a folder's files are of.
fn detect(folder: &Path) -> Result<Option<Layout>> {
    if folder.join(image_database::ENTRIES).is_file() {
        return Ok(Some(Layout::ImageDatabase));
    }
    if !moeller::databases(folder)?.is_empty() {
        return Ok(Some(Layout::Moeller));
    }
    if !webdataset::shards(folder)?.is_empty() {
        return Ok(Some(Layout::Webdataset));
    }
    let below: Vec<PathBuf> = conditions(folder, None)?.into_iter().map(|name| folder.join(name)).collect();
    for place in std::iter::once(folder.to_owned()).chain(below) {
        if place.join(image_database::ENTRIES).is_file() {
            return Ok(Some(Layout::ImageDatabase));
        }
        for layout in [Layout::Vardy, Layout::Paper] {
            if vardy::holds(&place, layout)? {
                return Ok(Some(layout));
            }
        }
        if folder::holds(&place)? {
            return Ok(Some(Layout::Folder));
        }
    }
    Ok(None)
}

/// Names of the folders that may hold a condition, in the document's order where there is one.
fn conditions(folder: &Path, document: Option<&Document>) -> Result<Vec<String>> {
    if let Some(document) = document {
        return Ok(document.conditions.iter().map(|c| c.name.clone()).filter(|name| folder.join(name).is_dir()).collect());
    }
    let names = file_names(folder)?.into_iter().filter(|name| !name.starts_with('.') && !RESERVED.contains(&name.as_str()));
    Ok(names.filter(|name| folder.join(name).is_dir()).collect())
}

/// Names of what is in a folder, sorted; those that are no text are passed over.
pub(super) fn file_names(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io_error("read folder", folder))? {
        let name = entry.map_err(io_error("read folder", folder))?.file_name();
        names.extend(name.to_str().map(str::to_owned));
    }
    names.sort();
    Ok(names)
}
