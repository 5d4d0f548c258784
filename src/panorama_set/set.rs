//! Opening a set, whatever its layout, and loading its panoramas.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use strum::VariantArray;

use super::document::{DOCUMENT, Document, MOST_PLACES};
use super::entry::Entry;
use super::grid::{Grid, Place};
use super::layout::{Found, Search};
use super::layouts::{LayoutKind, pictures};
use super::lens::Lens;
use super::source::{even_rows, file_names, mirror, numbers, picture};
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::panorama::{Panorama, Projection};

/// Folders of a set that hold no condition.
const RESERVED: [&str; 6] = ["truth", "examples", "parts", "home", "shards", "DATA2"];
/// Vertical steps of a real set may differ by this share from the horizontal ones before rows are resampled.
const EVEN: f64 = 1e-3;

/// A set of panoramas on disk.
#[derive(Debug, Clone)]
pub struct PanoramaSet {
    folder: PathBuf,
    layout: LayoutKind,
    entries: Vec<Entry>,
    document: Option<Document>,
    vertical: Option<(f64, f64)>,
    warnings: Vec<String>,
    /// What the pixels of a camera's own pictures look at.
    lens: Option<Lens>,
}

impl PanoramaSet {
    /// Opens a set and finds out its layout: by its `dataset.json`, else by what its files are called. The folder may be the
    /// whole set or that of one condition.
    ///
    /// # Errors
    /// When the folder cannot be read, is of no layout that is known, or does not keep to it.
    pub fn open(folder: &Path) -> Result<Self> {
        let layout = match Document::load(folder)? {
            Some(Document { layout, .. }) => layout.parse().map_err(|_| Error::Parse {
                path: folder.join(DOCUMENT),
                message: format!("layout: found `{layout}`, allowed is one of {}", LayoutKind::names()),
            })?,
            None => detect(folder)?.ok_or_else(|| Error::Parse {
                path: folder.to_owned(),
                message: format!(
                    "found no set of panoramas, neither in it nor in its folders; expected one of the layouts {}",
                    LayoutKind::names()
                ),
            })?,
        };
        Self::open_as(folder, layout)
    }

    /// Opens a set of the given layout. Other files are passed over.
    ///
    /// # Errors
    /// As [`PanoramaSet::open`].
    pub fn open_as(folder: &Path, layout: LayoutKind) -> Result<Self> {
        let document = Document::load(folder)?;
        let mut found = find(folder, layout, document.as_ref())?;
        if let Some(document) = &document {
            found.entries.sort_by_key(|entry| document.conditions.iter().position(|c| c.name == entry.condition));
            if let (Some(grid), Some(heading)) = (&document.grid, document.heading_rad) {
                for entry in found.entries.iter_mut().filter(|e| e.pose.is_none()) {
                    entry.pose = entry.place.map(|place| grid.pose(place, heading));
                }
            }
        }
        for warning in &found.warnings {
            log::warn!("{warning}");
        }
        let Found { entries, warnings, vertical } = found;
        let lens = (layout == LayoutKind::Pictures).then(Lens::default);
        let set = Self { folder: folder.to_owned(), layout, entries, document, vertical, warnings, lens };
        let (rows, columns) = set.shape();
        let outside = |entry: &&Entry| entry.place.is_some_and(|p| p.i >= rows || p.j >= columns);
        match set.entries.iter().find(outside) {
            _ if rows.saturating_mul(columns) > MOST_PLACES => Err(Error::Parse {
                path: set.folder,
                message: format!("found a grid of {rows} x {columns} places, expected at most {MOST_PLACES}"),
            }),
            Some(Entry { place: Some(Place { i, j }), image, .. }) => Err(Error::Parse {
                path: image.file().to_owned(),
                message: format!("found place ({i}, {j}), expected one of the {rows} x {columns} from (0, 0)"),
            }),
            _ => Ok(set),
        }
    }

    /// A camera's own pictures as a set: those of `folder` that a table of poses lists, by default its `poses.csv`. The table has the
    /// columns `file`, `x_m`, `y_m`, `heading_deg` and, where pictures of one room are not to be held for those of another, `room`.
    ///
    /// # Errors
    /// When the table cannot be read, lacks a column or a number, or lists a picture that is not there.
    pub fn of_pictures(folder: &Path, poses: Option<&Path>, lens: Lens) -> Result<Self> {
        let table = poses.map_or_else(|| folder.join(pictures::POSES), Path::to_owned);
        Ok(Self {
            entries: pictures::read_poses(folder, &table)?,
            folder: folder.to_owned(),
            layout: LayoutKind::Pictures,
            document: None,
            vertical: None,
            warnings: Vec::new(),
            lens: Some(lens),
        })
    }

    /// The set's folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its layout.
    #[must_use]
    pub fn layout(&self) -> LayoutKind {
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
        let mut seen = BTreeSet::new();
        self.entries.iter().map(|entry| entry.condition.as_str()).filter(|name| seen.insert(*name)).collect()
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

    /// The set with poses of the panoramas on a grid of this spacing that have none of their own: all look along x.
    #[must_use]
    pub fn posed(mut self, spacing_m: Option<f64>) -> Self {
        if let Some(grid) = self.grid(spacing_m, Some(Place { i: 0, j: 0 })) {
            for entry in self.entries.iter_mut().filter(|e| e.pose.is_none()) {
                entry.pose = entry.place.map(|place| grid.position(place)).map(|at| Pose::new(at.x, at.y, 0.0));
            }
        }
        self
    }

    /// Rows and columns of the grid, those of places without a panorama included; (0, 0) for a set without places.
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        if let Some(grid) = self.document.as_ref().and_then(|d| d.grid.as_ref()) {
            return (grid.rows, grid.columns);
        }
        let most = |of: fn(Place) -> usize| {
            self.entries.iter().filter_map(|e| e.place).map(of).max().map_or(0, |k| k.saturating_add(1))
        };
        (most(|p| p.i), most(|p| p.j))
    }

    /// The set, if it has a panorama at every place of its grid.
    ///
    /// # Errors
    /// Which place has none.
    pub fn whole(self) -> Result<Self> {
        let (rows, columns) = self.shape();
        let held: BTreeSet<Place> = self.entries.iter().filter_map(|e| e.place).collect();
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

    /// The grid about home, for a set on a grid; `spacing_m` and `home` are for sets that do not tell.
    #[must_use]
    pub fn grid(&self, spacing_m: Option<f64>, home: Option<Place>) -> Option<Grid> {
        let (rows, columns) = self.shape();
        let told = self.document.as_ref().and_then(|d| d.grid.as_ref());
        Some(Grid { rows, columns, spacing_m: spacing_m.or(told.map(|g| g.spacing_m))?, home: self.home_place(home)? })
    }

    /// The place of home: `asked`, else what the set tells, else the middle of its grid; `None` for a set without places.
    #[must_use]
    pub fn home_place(&self, asked: Option<Place>) -> Option<Place> {
        let (rows, columns) = self.shape();
        let told = || self.document.as_ref()?.grid.as_ref()?.home.map(|[i, j]| Place { i, j });
        let middle = || Place { i: (rows - 1) / 2, j: (columns - 1) / 2 };
        (rows > 0 && columns > 0).then(|| asked.or_else(told).unwrap_or_else(middle))
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
        if let Some(lens) = &self.lens {
            return lens.read_within(&self.folder, &entry.image);
        }
        let mut panorama = picture(&self.folder, &entry.image, |width, height| self.projection(width, height))?;
        if let (Some(range), Some(instance)) = (&entry.range, &entry.instance) {
            let millimetres = numbers(&self.folder, range, panorama.projection)?;
            panorama.range_m = millimetres.into_iter().map(|mm| f32::from(mm) / 1000.0).collect();
            panorama.instance = numbers(&self.folder, instance, panorama.projection)?;
        }
        if self.layout.layout().is_clockwise() {
            mirror(&mut panorama);
        }
        let pixel = panorama.projection.pixel_rad();
        match self.vertical {
            Some((step_rad, horizon)) if (step_rad / pixel - 1.0).abs() > EVEN && panorama.range_m.is_empty() => {
                even_rows(&panorama, step_rad, horizon, entry.path())
            }
            _ => Ok(panorama),
        }
    }

    fn projection(&self, width: u32, height: u32) -> Projection {
        let told = self.document.as_ref().map(|d| d.projection).filter(|p| (p.width, p.height) == (width, height));
        told.unwrap_or_else(|| {
            let own = self.layout.layout().projection(Projection::new(width, height));
            Projection { horizon_row: self.vertical.map_or(own.horizon_row, |(_, horizon)| horizon + 0.5), ..own }
        })
    }
}

/// All panoramas of a set.
fn find(folder: &Path, kind: LayoutKind, document: Option<&Document>) -> Result<Found> {
    let layout = kind.layout();
    let grid = document.and_then(|d| d.grid.as_ref());
    let whole = Search { root: folder, folder, condition: "", grid };
    let mut found = Found::new(Vec::new());
    if !layout.is_one_folder() && (document.is_some() || !layout.holds(folder)?) {
        for condition in
            document.map_or_else(|| conditions(folder), |d| Ok(d.conditions.iter().map(|c| c.name.clone()).collect()))?
        {
            let below = folder.join(&condition);
            if below.is_dir() && layout.holds(&below)? {
                let one = layout.find(&Search { folder: &below, condition: &condition, ..whole })?;
                found.entries.extend(one.entries);
                found.warnings.extend(one.warnings);
            }
        }
    }
    // In a folder without any panorama the layout says what it expects.
    if found.entries.is_empty() {
        found = layout.find(&whole)?;
    }
    if found.entries.is_empty() {
        let message = format!("found no panorama of layout {}", kind.name());
        return Err(Error::Parse { path: folder.to_owned(), message });
    }
    Ok(found)
}

/// The layout of a folder's files, or of those in the folders of its conditions.
fn detect(folder: &Path) -> Result<Option<LayoutKind>> {
    let below = conditions(folder)?.into_iter().map(|name| folder.join(name));
    for (k, place) in std::iter::once(folder.to_owned()).chain(below).enumerate() {
        for kind in LayoutKind::VARIANTS {
            if (k == 0 || !kind.layout().is_one_folder()) && kind.layout().holds(&place)? {
                return Ok(Some(*kind));
            }
        }
    }
    Ok(None)
}

/// Names of the folders that may hold a condition.
fn conditions(folder: &Path) -> Result<Vec<String>> {
    let names = file_names(folder)?.into_iter().filter(|name| !name.starts_with('.') && !RESERVED.contains(&name.as_str()));
    Ok(names.filter(|name| folder.join(name).is_dir()).collect())
}
