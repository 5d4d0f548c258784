//! `dataset.json`: what a set is and how it was made.
//!
//! It is the first file of a set and never changes while the set grows. Two commands make the same set if and only if their
//! documents are equal, so that it also tells whether a folder may be gone on with.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::entry::{FramePose, WorldRef};
use super::grid::Place;
use super::source;
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::panorama::Projection;
use crate::storage;

/// Name of the file.
pub const DOCUMENT: &str = "dataset.json";
/// Most places of a grid, and most poses of a set.
pub const MOST_PLACES: usize = 10_000_000;
/// Largest length in a document that is believed, m.
const MOST_M: f64 = 1e6;

/// What a set is and how it was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// Name and version of this format.
    pub format: String,
    /// Name of the [`LayoutKind`](super::LayoutKind).
    pub layout: String,
    /// The command that makes the set, as far as its bytes depend on it.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Seed of random poses, moved furniture, swapped textures and the camera's noise.
    pub seed: u64,
    /// Licence of the set, as an SPDX identifier.
    pub licence: String,
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file and its images.
    pub world_sha256: String,
    /// What rendered: "cpu", whose bytes are the same everywhere, or "gpu" with adapter and driver.
    pub renderer: String,
    /// Size and projection of the panoramas once their columns run anti-clockwise.
    pub projection: Projection,
    /// Which way azimuth runs over the columns of the files: "anticlockwise" or "clockwise".
    pub columns: String,
    /// Height of the camera above the floor, m.
    pub camera_height_m: f64,
    /// What a number in a range picture means.
    pub range_unit: String,
    /// Home of the world in the room.
    pub home: FramePose,
    /// SHA-256 of all poses: two routes of one name are two sets.
    pub poses_sha256: String,
    /// Heading of all frames, rad, where it is the same.
    pub heading_rad: Option<f64>,
    /// The grid, for a set on one.
    pub grid: Option<GridDocument>,
    /// What instance ids stand for.
    pub instances: Vec<Instance>,
    /// Conditions, in order.
    pub conditions: Vec<ConditionDocument>,
    /// Frames of all conditions.
    pub frames: usize,
    /// Parts: units of work, each whole or not there.
    pub parts: usize,
    /// Most frames of a part.
    pub frames_per_part: usize,
    /// What a set of several worlds adds. Its `world` is the list of them as the command line has it, with the SHA-256 of their names
    /// and files; home, height of the camera and instances are those of the first one, and `worlds/N.json` tells them of each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub series: Option<SeriesDocument>,
}

/// The worlds of a set of several.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SeriesDocument {
    /// How many.
    pub count: usize,
    /// Poses in all of them together, in each condition; as many in every world, give or take one.
    pub poses: usize,
}

/// A world of a set of several: `worlds/N.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorldDocument {
    /// What rows name it.
    #[serde(flatten)]
    pub named: WorldRef,
    /// SHA-256 of its file and its images.
    pub sha256: String,
    /// First of its spots, which have the same numbers in every condition.
    pub first_spot: usize,
    /// How many it has.
    pub spots: usize,
    /// Height of the camera above the floor, m.
    pub camera_height_m: f64,
    /// Home of the world in the room.
    pub home: FramePose,
    /// What instance ids stand for.
    pub instances: Vec<Instance>,
}

/// A grid in the room: place (i, j) lies at `first_m` + ((j) s, -(i) s).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GridDocument {
    /// Rows, against y.
    pub rows: usize,
    /// Columns, along x.
    pub columns: usize,
    /// Distance s between neighbours, m.
    pub spacing_m: f64,
    /// Where place (0, 0) is, m.
    pub first_m: [f64; 2],
    /// The place on which the world's home lies, if it lies on one.
    pub home: Option<[usize; 2]>,
}

/// A condition of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConditionDocument {
    /// Short name, as folders and keys have it.
    pub name: String,
    /// As the command line has it.
    pub given: String,
    /// In words.
    pub description: String,
    /// SHA-256 of the world as this condition changes it.
    pub world_sha256: String,
    /// Frames taken.
    pub frames: usize,
    /// Poses that were left out because the robot cannot stand there; `left-out.csv` lists them.
    pub left_out: usize,
}

/// What an instance id stands for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Instance {
    /// The id.
    pub id: u16,
    /// The body, wall or plane.
    pub name: String,
    /// Whether it is a landmark.
    pub landmark: bool,
}

impl GridDocument {
    /// Pose of the robot at a place.
    pub(crate) fn pose(&self, place: Place, heading: f64) -> Pose {
        let [x, y] = self.first_m;
        Pose::new(x + place.j as f64 * self.spacing_m, y - place.i as f64 * self.spacing_m, heading)
    }
}

impl Document {
    /// The document of the set in `folder`; `None` where there is none.
    ///
    /// # Errors
    /// When it cannot be read, or says what no set is.
    pub fn load(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(DOCUMENT);
        let bytes = match storage::read_within(folder, &path) {
            Ok(bytes) => bytes,
            Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(e),
        };
        let fault = |message: String| Error::Parse { path: path.clone(), message };
        let document: Self = serde_json::from_slice(&bytes).map_err(|e| fault(e.to_string()))?;
        match document.fault() {
            Some((place, found, allowed)) => Err(fault(format!("{place}: found {found}, allowed is {allowed}"))),
            None => Ok(Some(document)),
        }
    }

    /// The first value that no set has: its place, itself, and what is allowed.
    fn fault(&self) -> Option<(String, String, String)> {
        let count = |place: &str, found: usize, most: usize| {
            (!(1..=most).contains(&found)).then(|| (place.to_owned(), found.to_string(), format!("1 to {most}")))
        };
        let number = |place: &str, found: f64, low: f64, high: f64| {
            (!(low..=high).contains(&found)).then(|| (place.to_owned(), found.to_string(), format!("{low} to {high}")))
        };
        let length = |place: &str, found: f64| number(place, found, -MOST_M, MOST_M);
        let angle = |place: &str, found: f64| number(place, found, -1000.0, 1000.0);
        let (p, rows) = (&self.projection, f64::from(self.projection.height));
        let grid = || {
            let g = self.grid.as_ref()?;
            let home = |place: &str, found: usize, count: usize| {
                (found >= count).then(|| (place.to_owned(), found.to_string(), format!("0 to {}", count - 1)))
            };
            let [x, y] = g.first_m;
            count("grid.rows", g.rows, MOST_PLACES)
                .or_else(|| count("grid.columns", g.columns, MOST_PLACES / g.rows))
                .or_else(|| number("grid.spacing_m", g.spacing_m, 1e-6, MOST_M))
                .or_else(|| length("grid.first_m[0]", x))
                .or_else(|| length("grid.first_m[1]", y))
                .or_else(|| home("grid.home[0]", g.home?[0], g.rows))
                .or_else(|| home("grid.home[1]", g.home?[1], g.columns))
        };
        let conditions = self.conditions.iter().enumerate().find_map(|(k, condition)| {
            let plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
            let found = &condition.name;
            (found.is_empty() || !found.chars().all(plain))
                .then(|| (format!("conditions[{k}].name"), format!("{found:?}"), "letters, digits, `-` and `_`".to_owned()))
        });
        let most_frames = MOST_PLACES.saturating_mul(self.conditions.len());
        count("projection.width", p.width as usize, source::MOST_PX as usize)
            .or_else(|| count("projection.height", p.height as usize, source::MOST_PX as usize))
            .or_else(|| number("projection.horizon_row", p.horizon_row, -100.0 * rows, 100.0 * rows))
            .or_else(|| angle("projection.mount_rad", p.mount_rad))
            .or_else(|| number("camera_height_m", self.camera_height_m, 0.0, MOST_M))
            .or_else(|| length("home.x_m", self.home.x_m))
            .or_else(|| length("home.y_m", self.home.y_m))
            .or_else(|| angle("home.heading_rad", self.home.heading_rad))
            .or_else(|| angle("heading_rad", self.heading_rad?))
            .or_else(grid)
            .or(conditions)
            .or_else(|| count("frames", self.frames, most_frames))
            .or_else(|| count("parts", self.parts, self.frames))
    }
}
