//! Worlds: rooms with landmarks, obstacles, floor, robot, camera and home, loaded from a file and checked as a whole.
//!
//! [`WorldSpec`] is the file as written, [`World`] the checked form: absolute corners, radians, instance ids. Loading reports
//! every fault of a file at once; see [`Fault`](crate::fault::Fault). It goes through three gates: the text becomes a tree that knows its
//! lines ([`document`](crate::document)), the tree is compared with the schema (`structure`), and the spec's values and places are checked
//! (`validate`); the images that it shows are read on the way (`picture`). A [`World`] also tells where a robot may stand and start (`free`)
//! and whether it can drive home from there (`reach`). Worlds are drawn by seed ([`generate`]), made of maps and written as such
//! ([`map`]), and written for Gazebo (`sdf`).
//!
//! Knows of: geometry, panoramas' projections and located documents. Must not know of rapier, wgpu or anything that moves.

mod boundary;
mod camera;
pub mod convex;
mod draft;
mod free;
pub mod generate;
pub(crate) mod grid;
mod light;
mod load;
pub mod map;
mod picture;
pub mod polygon;
mod reach;
mod repeats;
pub mod robot;
mod sdf;
mod source;
pub mod spec;
mod structure;
mod texture;
mod validate;
mod wall;
mod write;

use std::path::PathBuf;

use crate::fault::Warning;
use crate::geometry::{Pose, Vector2};
use crate::panorama::{INSTANCE_CEILING, INSTANCE_FIRST_WALL, INSTANCE_FLOOR, Projection};
pub use boundary::Boundary;
pub use camera::{CameraPreset, OpticsSpec};
pub use draft::Draft;
use grid::{Bounds, Grid, bounds_of};
pub use light::LightPreset;
pub use picture::Picture;
pub use robot::RobotSpec;
pub use source::{WorldName, WorldSource};
pub use spec::{MotionSpec, TaskSpec, TextureFamily, TextureSpec, WorldSpec};
pub use structure::{Field, fields};
pub use texture::{Pattern, Texture};
pub use wall::{Partition, Piece, PlanStretch};

/// A checked world.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// The file as written, defaults filled in.
    pub spec: WorldSpec,
    /// Where it was loaded from; `builtin:NAME` for a built-in world.
    pub source: PathBuf,
    /// SHA-256 of the file's bytes, followed by those of the images that it shows in the order of first use, lower-case
    /// hexadecimal.
    pub sha256: String,
    /// Corners of the room, anti-clockwise, m. Wall k runs from corner k to corner k + 1.
    pub outline: Vec<Vector2<f64>>,
    /// Texture of each wall.
    pub wall_textures: Vec<Texture>,
    /// Texture of the floor.
    pub floor_texture: Texture,
    /// Texture of the ceiling.
    pub ceiling_texture: Texture,
    /// Landmarks first, then obstacles, each in the file's order.
    pub bodies: Vec<Body>,
    /// How many of `bodies` are landmarks.
    pub landmark_count: usize,
    /// Windows, in the file's order.
    pub windows: Vec<Window>,
    /// Walls inside the room, in the file's order.
    pub partitions: Vec<Partition>,
    /// Floor zones.
    pub zones: Vec<Zone>,
    /// Home pose.
    pub home: Pose,
    /// What is allowed in the file and may still not be meant.
    pub warnings: Vec<Warning>,
    /// The outline, to be asked.
    boundary: Boundary,
    /// Partitions by place.
    partition_grid: Grid,
}

/// Footprint of a body around its own origin.
#[derive(Debug, Clone, PartialEq)]
pub enum Footprint {
    /// A disc of this radius, m.
    Disc(f64),
    /// A convex polygon, corners anti-clockwise, m.
    Polygon(Vec<Vector2<f64>>),
}

impl Footprint {
    /// Distance from `point`, given in the footprint's frame, to the footprint, m; zero inside.
    #[must_use]
    pub fn distance_to(&self, point: Vector2<f64>) -> f64 {
        match self {
            Self::Disc(radius) => (point.norm() - radius).max(0.0),
            Self::Polygon(corners) => polygon::distance_to_polygon(corners, point),
        }
    }

    /// Length of its outline, m.
    #[must_use]
    pub fn girth_m(&self) -> f64 {
        match self {
            Self::Disc(radius) => std::f64::consts::TAU * radius,
            Self::Polygon(corners) => polygon::edges(corners).map(|(a, b)| (b - a).norm()).sum(),
        }
    }

    /// Radius of the circle around the footprint's origin that holds all of it, m.
    #[must_use]
    pub fn bounding_radius(&self) -> f64 {
        match self {
            Self::Disc(radius) => *radius,
            Self::Polygon(corners) => corners.iter().map(Vector2::norm).fold(0.0, f64::max),
        }
    }
}

/// A body of a checked world.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Name from the file.
    pub name: String,
    /// Footprint in the body's own frame.
    pub footprint: Footprint,
    /// Pose at time 0.
    pub pose: Pose,
    /// Height of the underside, m.
    pub bottom_m: f64,
    /// Height of the top, m.
    pub top_m: f64,
    /// Texture.
    pub texture: Texture,
    /// Light that it gives off.
    pub glow: f64,
    /// How it moves.
    pub motion: Option<MotionSpec>,
    /// Instance id in panoramas.
    pub instance: u16,
}

impl Body {
    /// Whether it stands where it is unless something pushes it.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.motion.is_none() || self.can_be_pushed()
    }

    /// Whether it gives way when something pushes it.
    #[must_use]
    pub fn can_be_pushed(&self) -> bool {
        matches!(self.motion, Some(MotionSpec::Pushed { .. }))
    }
}

/// A window of a checked world: a thin pane on a wall, of which only renderers know.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Name from the file, or its wall.
    pub name: String,
    /// Corners of the pane in the room, anti-clockwise, m. The first two are on the side of the room.
    pub footprint: Vec<Vector2<f64>>,
    /// Height of the lower edge, m.
    pub bottom_m: f64,
    /// Height of the upper edge, m.
    pub top_m: f64,
    /// What is seen in it.
    pub texture: Texture,
    /// Irradiance that a square metre of it makes on a facing surface 1 m away.
    pub brightness: f64,
    /// Instance id in panoramas.
    pub instance: u16,
}

/// A floor zone of a checked world.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Corners, anti-clockwise, m.
    pub polygon: Vec<Vector2<f64>>,
    /// Friction inside.
    pub friction: f64,
}

impl World {
    /// The landmark bodies.
    #[must_use]
    pub fn landmarks(&self) -> &[Body] {
        &self.bodies[..self.landmark_count]
    }

    /// The outline, to be asked what is inside and which walls are near.
    #[must_use]
    pub fn boundary(&self) -> &Boundary {
        &self.boundary
    }

    /// Numbers of walls inside the room that may meet the box from `low` to `high`, rising: all that do, and others.
    #[must_use]
    pub fn partitions_near(&self, low: Vector2<f64>, high: Vector2<f64>) -> Vec<usize> {
        self.partition_grid.near((low, high))
    }

    /// Puts boundary and partitions where they are looked up.
    fn index(&mut self) {
        self.boundary = Boundary::new(&self.outline);
        let boxes: Vec<Bounds> = self.partitions.iter().map(|p| bounds_of(&p.footprint([0.0, p.length_m]), 0.0)).collect();
        self.partition_grid = Grid::new(&boxes);
    }

    /// Instance id of wall `k`.
    #[must_use]
    pub fn wall_instance(&self, k: usize) -> u16 {
        INSTANCE_FIRST_WALL + k as u16
    }

    /// The camera's projection as the file has it.
    #[must_use]
    pub fn projection(&self) -> Projection {
        let c = &self.spec.camera;
        self.projection_of_size(c.width_px, c.height_px)
    }

    /// The camera's projection at another size: mounting and share of rows above the horizon stay.
    #[must_use]
    pub fn projection_of_size(&self, width: u32, height: u32) -> Projection {
        let c = &self.spec.camera;
        Projection {
            width,
            height,
            horizon_row: f64::from(height) * c.horizon,
            mount_rad: c.mount_deg.to_radians(),
            kind: c.projection,
        }
    }

    /// Where the camera is when the robot is at `robot`, in the room; its heading is the robot's.
    #[must_use]
    pub fn camera_pose(&self, robot: &Pose) -> Pose {
        let [forward, left] = self.spec.camera.offset_m;
        let at = robot.transform(Vector2::new(forward, left));
        Pose { x: at.x, y: at.y, ..*robot }
    }

    /// What the instance ids of panoramas stand for, in order.
    #[must_use]
    pub fn instances(&self) -> Vec<(u16, String)> {
        let planes = [(INSTANCE_FLOOR, "floor".to_owned()), (INSTANCE_CEILING, "ceiling".to_owned())];
        let walls = (0..self.outline.len()).map(|k| (self.wall_instance(k), format!("wall {k}")));
        let bodies = self.bodies.iter().map(|b| (b.instance, b.name.clone()));
        let windows = self.windows.iter().map(|w| (w.instance, w.name.clone()));
        let partitions = self.partitions.iter().map(|p| (p.instance, p.name.clone()));
        planes.into_iter().chain(walls).chain(bodies).chain(windows).chain(partitions).collect()
    }

    /// Poses of all bodies at time 0, in the order of [`World::bodies`].
    #[must_use]
    pub fn body_poses(&self) -> Vec<Pose> {
        self.bodies.iter().map(|b| b.pose).collect()
    }
}
