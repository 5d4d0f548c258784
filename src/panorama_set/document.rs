//! `dataset.json`: what a set is and how it was made.
//!
//! It is the first file of a set and never changes while the set grows. Two commands make the same set if and only if their
//! documents are equal, so that it also tells whether a folder may be gone on with.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::entry::FramePose;
use super::layout::Layout;
use crate::error::{Error, Result};
use crate::panorama::Projection;
use crate::storage::io_error;

/// Name of the file.
pub const DOCUMENT: &str = "dataset.json";

/// What a set is and how it was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// Name and version of this format.
    pub format: String,
    /// How files are named.
    pub layout: Layout,
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

impl Document {
    /// The document of the set in `folder`; `None` where there is none.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn load(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(DOCUMENT);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(io_error("read", &path)(e)),
        };
        serde_json::from_str(&text).map(Some).map_err(|e| Error::Parse { path, message: e.to_string() })
    }

    /// The document as a file.
    ///
    /// # Errors
    /// When it cannot be put into JSON.
    pub fn to_json(&self) -> Result<Vec<u8>> {
        let mut text =
            serde_json::to_vec_pretty(self).map_err(|e| Error::Parse { path: DOCUMENT.into(), message: e.to_string() })?;
        text.push(b'\n');
        Ok(text)
    }
}
