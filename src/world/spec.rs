//! The world file as a person writes it: TOML or JSON, SI units, a unit in each field's name.
//!
//! These types only describe the file. [`super::World`] is the checked form that the rest of the program works with.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::robot::RobotSpec;

pub use super::camera::{CameraPreset, CameraSpec, DirtSpec, NoiseSpec, OpticsSpec};
pub use super::light::{LampSpec, LightFactors, LightPreset, LightSpec, WindowSpec};
pub use super::texture::{TextureFamily, TextureSpec};
pub use super::wall::{OpeningKind, OpeningSpec, WallSpec};

/// A whole world file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WorldSpec {
    /// Short name, used in output folders.
    pub name: String,
    /// What the world is for.
    #[serde(default)]
    pub description: String,
    /// Seed of what belongs to the world itself (textures); a run's seed comes from the command line.
    #[serde(default)]
    pub seed: u64,
    /// Outline, height and surfaces of the room.
    pub room: RoomSpec,
    /// Walls inside the room, with doors and windows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub walls: Vec<WallSpec>,
    /// Friction of the floor.
    #[serde(default)]
    pub floor: FloorSpec,
    /// Ambient light, lamps and windows.
    #[serde(default)]
    pub light: LightSpec,
    /// Bodies that serve as landmarks: their centres are what the `ideal` sensor sees.
    #[serde(default)]
    pub landmarks: Vec<BodySpec>,
    /// Other bodies; they may move.
    #[serde(default)]
    pub obstacles: Vec<BodySpec>,
    /// The robot.
    #[serde(default)]
    pub robot: RobotSpec,
    /// The camera on it.
    #[serde(default)]
    pub camera: CameraSpec,
    /// Home pose.
    pub home: PoseSpec,
    /// Where runs start.
    #[serde(default)]
    pub start: StartSpec,
    /// Speed, period, arrival radius, time limit.
    #[serde(default)]
    pub task: TaskSpec,
    /// What happens to the robot at given times.
    #[serde(default)]
    pub disturbances: Vec<DisturbanceSpec>,
}

/// A pose as a person writes it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseSpec {
    /// x, m.
    pub x_m: f64,
    /// y, m.
    pub y_m: f64,
    /// Heading, degrees anti-clockwise from x.
    #[serde(default)]
    pub heading_deg: f64,
}

/// The room.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomSpec {
    /// Corners of the room in order, m; a simple polygon, in either sense, not necessarily convex. Wall k runs from corner k
    /// to corner k + 1.
    pub outline_m: Vec<[f64; 2]>,
    /// Height of the ceiling, m.
    #[serde(default = "RoomSpec::default_height")]
    pub height_m: f64,
    /// Textures of the walls: one for all, or one a wall.
    #[serde(default = "RoomSpec::default_walls")]
    pub walls: Vec<TextureSpec>,
    /// Texture of the floor.
    #[serde(default = "RoomSpec::default_floor")]
    pub floor: TextureSpec,
    /// Texture of the ceiling.
    #[serde(default = "RoomSpec::default_ceiling")]
    pub ceiling: TextureSpec,
}

impl RoomSpec {
    fn default_height() -> f64 {
        2.5
    }
    fn default_walls() -> Vec<TextureSpec> {
        vec![TextureSpec::new(TextureFamily::Noise, [200, 190, 170])]
    }
    fn default_floor() -> TextureSpec {
        TextureSpec::new(TextureFamily::Planks, [150, 115, 80])
    }
    fn default_ceiling() -> TextureSpec {
        TextureSpec::new(TextureFamily::Plain, [225, 225, 220])
    }
}

/// Floor friction: a base value and zones that replace it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FloorSpec {
    /// Coulomb friction of a drive wheel on the floor (0.7 to 0.8 for rubber on a dry floor, 0.15 on ice).
    pub friction: f64,
    /// Zones with a friction of their own; where zones overlap the later one holds.
    pub zones: Vec<ZoneSpec>,
}

impl Default for FloorSpec {
    fn default() -> Self {
        Self { friction: 0.75, zones: Vec::new() }
    }
}

/// A patch of floor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZoneSpec {
    /// Name, for messages and plots.
    #[serde(default)]
    pub name: String,
    /// Corners, m; a simple polygon.
    pub polygon_m: Vec<[f64; 2]>,
    /// Coulomb friction inside.
    pub friction: f64,
}

/// Shape of a body's footprint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ShapeSpec {
    /// A disc: a pillar, a bin, a person.
    Disc {
        /// Radius, m.
        radius_m: f64,
    },
    /// A box, its size along its own x and y.
    Box {
        /// Full lengths along x and y, m.
        size_m: [f64; 2],
    },
    /// A convex polygon around the body's position.
    Polygon {
        /// Corners relative to the body's position, m.
        corners_m: Vec<[f64; 2]>,
    },
}

/// A body that stands in the room: an upright prism over its footprint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// Name, for messages and plots.
    pub name: String,
    /// Footprint.
    pub shape: ShapeSpec,
    /// Position of the footprint's origin (centre of a disc or box), m.
    pub position_m: [f64; 2],
    /// Rotation of the footprint, degrees.
    #[serde(default)]
    pub heading_deg: f64,
    /// Height of the body itself, m.
    pub height_m: f64,
    /// Height of its underside above the floor, m: a poster or a lintel hangs.
    #[serde(default)]
    pub elevation_m: f64,
    /// Texture of its sides and top.
    pub texture: TextureSpec,
    /// Light that it gives off itself: it looks as if lit by that much more.
    #[serde(default)]
    pub glow: f64,
    /// How it moves; obstacles only.
    #[serde(default)]
    pub motion: Option<MotionSpec>,
}

/// How a moving body moves. Those that go by themselves are driven, not pushed: the robot bounces off them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum MotionSpec {
    /// Walks the given corners back and forth, or round and round.
    Path {
        /// Corners after the body's own position, m.
        corners_m: Vec<[f64; 2]>,
        /// Speed, m/s.
        speed_m_s: f64,
        /// Close the path and go round instead of back and forth.
        #[serde(default)]
        closed: bool,
    },
    /// Walks to seeded random points of a polygon, one after the other.
    Walk {
        /// Polygon it stays in, m.
        region_m: Vec<[f64; 2]>,
        /// Speed, m/s.
        speed_m_s: f64,
    },
    /// Stands until something pushes it, and slides to rest on the floor's friction: a carton, a chair.
    Pushed {
        /// Mass, kg; spread evenly over the footprint.
        mass_kg: f64,
        /// Coulomb friction of the body on the floor, which zones do not change.
        #[serde(default = "MotionSpec::default_friction")]
        friction: f64,
    },
}

impl MotionSpec {
    fn default_friction() -> f64 {
        0.4
    }
}

/// Where runs start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StartSpec {
    /// `--start random` draws from this polygon; without one, from the whole room.
    pub region_m: Option<Vec<[f64; 2]>>,
    /// Least distance from home of a random start, m.
    pub min_distance_m: f64,
    /// Greatest distance from home of a random start, m.
    pub max_distance_m: f64,
    /// Free space that a random start keeps around the robot's body, m.
    pub clearance_m: f64,
    /// Named starts: `--start P1`.
    pub named: Vec<NamedStartSpec>,
}

impl Default for StartSpec {
    fn default() -> Self {
        Self { region_m: None, min_distance_m: 0.5, max_distance_m: 3.0, clearance_m: 0.05, named: Vec::new() }
    }
}

/// A named start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NamedStartSpec {
    /// Name.
    pub name: String,
    /// x, m.
    pub x_m: f64,
    /// y, m.
    pub y_m: f64,
    /// Heading, degrees.
    #[serde(default)]
    pub heading_deg: f64,
}

/// The homing task.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TaskSpec {
    /// Cruising speed, m/s.
    pub speed_m_s: f64,
    /// Time between observations, s.
    pub control_period_s: f64,
    /// Radius around home within which the robot has arrived (the paper's Rc), m.
    pub arrival_radius_m: f64,
    /// A run that takes longer has failed, s.
    pub time_limit_s: f64,
}

impl Default for TaskSpec {
    fn default() -> Self {
        Self { speed_m_s: 0.3, control_period_s: 0.1, arrival_radius_m: 0.05, time_limit_s: 120.0 }
    }
}

/// Something that happens to the robot at a given time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DisturbanceSpec {
    /// When, s from the start of the run.
    pub at_s: f64,
    /// What.
    pub what: DisturbanceKind,
}

/// What can happen to the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum DisturbanceKind {
    /// A blow that changes the robot's motion at once; the `unicycle` plant, which has no mass, does not feel it.
    Kick {
        /// Impulse on the centre of gravity along the room's x and y, N s.
        impulse_n_s: [f64; 2],
        /// Impulse that turns, anti-clockwise, N m s.
        #[serde(default)]
        turn_n_m_s: f64,
    },
    /// The robot is lifted and set down at rest somewhere else. Neither encoders nor gyro notice.
    Kidnap(PoseSpec),
}

impl WorldSpec {
    /// All textures and their places in the file.
    pub(super) fn textures(&self) -> impl Iterator<Item = (String, &TextureSpec)> {
        let room = &self.room;
        let walls = room.walls.iter().enumerate().map(|(k, t)| (format!("room.walls[{k}]"), t));
        let planes = [("room.floor".to_owned(), &room.floor), ("room.ceiling".to_owned(), &room.ceiling)];
        let windows = self.light.windows.iter().enumerate().map(|(k, w)| (format!("light.windows[{k}].texture"), &w.texture));
        let landmarks = self.landmarks.iter().enumerate().map(|(k, b)| (format!("landmarks[{k}].texture"), &b.texture));
        let obstacles = self.obstacles.iter().enumerate().map(|(k, b)| (format!("obstacles[{k}].texture"), &b.texture));
        let inner = self.walls.iter().enumerate();
        let inner = inner.filter_map(|(k, w)| Some((format!("walls[{k}].texture"), w.texture.as_ref()?)));
        walls.chain(planes).chain(landmarks).chain(obstacles).chain(windows).chain(inner)
    }
}
