//! Frames: as they are written, with their truth, and as they are found on disk.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::grid::Place;
use super::source::Source;
use crate::error::{Error, Result};
use crate::geometry::Pose;

/// A frame to be written: one panorama of a set.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Number in the whole set: condition by condition, with those counted that were left out.
    pub number: usize,
    /// Number within the condition. The same pose has the same one in every condition.
    pub spot: usize,
    /// Short name of the condition, as folders and keys have it.
    pub condition: String,
    /// Place of the grid.
    pub place: Option<Place>,
    /// Pose of the robot in the room.
    pub robot: Pose,
    /// Time on a trajectory, s.
    pub time_s: Option<f64>,
    /// The world, in a set of several.
    pub world: Option<WorldRef>,
}

/// A world of a set of several, as rows name it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorldRef {
    /// What opens it: `office:17`, a path, or the name of a built-in world.
    pub world: String,
    /// By this, results are grouped: the kind of a generated world, the folder of a file in one, or the world's own name.
    pub kind: String,
}

/// Names of a frame's files, relative to the set's folder; within the archive where there is one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Names {
    /// The picture.
    pub image: String,
    /// Range.
    pub range: String,
    /// Instances.
    pub instance: String,
    /// The frame's truth, where the layout has it frame by frame.
    pub truth: Option<String>,
}

impl Names {
    /// Four files side by side: `STEM.rgb.png`, `.range.png`, `.instance.png` and `.json`.
    pub(super) fn side_by_side(stem: &str) -> Self {
        let file = |ending: &str| format!("{stem}.{ending}");
        Self { image: file("rgb.png"), range: file("range.png"), instance: file("instance.png"), truth: Some(file("json")) }
    }

    /// A picture whose layout has no room for range and instances: they lie in `truth/CONDITION/`, where no reader of it looks.
    pub(super) fn with_truth_aside(image: String, condition: &str, stem: &str) -> Self {
        let beside = |channel: &str| format!("truth/{condition}/{stem}.{channel}.png");
        Self { image, range: beside("range"), instance: beside("instance"), truth: None }
    }
}

/// A pose as files have it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FramePose {
    /// x in the room, m.
    pub x_m: f64,
    /// y, m.
    pub y_m: f64,
    /// Heading, rad, anti-clockwise from x.
    pub heading_rad: f64,
}

impl From<Pose> for FramePose {
    fn from(pose: Pose) -> Self {
        Self { x_m: pose.x, y_m: pose.y, heading_rad: pose.heading }
    }
}

impl From<FramePose> for Pose {
    fn from(pose: FramePose) -> Self {
        Self::new(pose.x_m, pose.y_m, pose.heading_rad)
    }
}

/// What is true of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameTruth {
    /// Number in the whole set.
    pub frame: usize,
    /// Condition.
    pub condition: String,
    /// Number within the condition; the same pose has the same one in every condition.
    pub spot: usize,
    /// Row and column of the grid.
    pub place: Option<[usize; 2]>,
    /// Time on a trajectory, s.
    pub t_s: Option<f64>,
    /// Pose of the robot in the room.
    pub pose: FramePose,
    /// Where the camera is: x, y and height above the floor, m.
    pub camera_m: [f64; 3],
    /// The landmark bodies, in the world's order.
    pub landmarks: Vec<LandmarkTruth>,
    /// The world, in a set of several.
    #[serde(flatten, default, skip_serializing_if = "Option::is_none")]
    pub world: Option<WorldRef>,
}

/// What is true of a landmark in a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LandmarkTruth {
    /// Instance id.
    pub instance: u16,
    /// Name in the world.
    pub name: String,
    /// Azimuth of its centre from the robot's heading, rad, in (-pi, pi].
    pub bearing_rad: f64,
    /// Horizontal distance from the camera to its centre, m.
    pub range_m: f64,
    /// Whether any pixel shows it.
    pub visible: bool,
    /// Pixels that show it.
    pub seen_px: u32,
    /// Pixels that would show it if nothing else were in the room.
    pub alone_px: u32,
    /// Share of those that something hides, 0 to 1; none where it lies outside the picture.
    pub occluded: Option<f64>,
}

/// A panorama of a set on disk, with what is known of where it was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Condition: the name of its folder or shard; empty where the set has one condition without a name.
    pub condition: String,
    /// Name within the condition.
    pub key: String,
    /// Place of the grid.
    pub place: Option<Place>,
    /// Pose of the robot in the set's own frame (the room's, for a set that this program wrote), as far as the set tells.
    pub pose: Option<Pose>,
    /// The world, in a set of several that this program wrote.
    pub world: Option<WorldRef>,
    /// Picture, range and instances.
    pub(super) image: Source,
    pub(super) range: Option<Source>,
    pub(super) instance: Option<Source>,
}

impl Entry {
    /// An entry of which no more is known than its files.
    pub(super) fn new(condition: &str, key: impl Into<String>, image: Source) -> Self {
        let (condition, key) = (condition.to_owned(), key.into());
        Self { condition, key, place: None, pose: None, world: None, image, range: None, instance: None }
    }

    /// Takes place, pose and condition from a frame's truth as JSON; `path` is what errors name.
    pub(super) fn tell(&mut self, json: &[u8], path: &Path) -> Result<()> {
        let truth: FrameTruth =
            serde_json::from_slice(json).map_err(|e| Error::Parse { path: path.to_owned(), message: e.to_string() })?;
        self.place = truth.place.map(|[i, j]| Place { i, j });
        self.pose = Some(truth.pose.into());
        self.condition = truth.condition;
        self.world = truth.world;
        Ok(())
    }

    /// Whether it has range and instances beside the picture.
    #[must_use]
    pub fn has_truth(&self) -> bool {
        self.range.is_some() && self.instance.is_some()
    }

    /// The picture's file, or the archive that holds it.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.image.file()
    }
}
