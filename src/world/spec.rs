//! The world file as a person writes it: TOML or JSON, SI units, a unit in each field's name.
//!
//! These types only describe the file. [`super::World`] is the checked form that the rest of the program works with.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::robot::RobotSpec;

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
    /// Friction of the floor.
    #[serde(default)]
    pub floor: FloorSpec,
    /// Lamps and ambient light.
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

/// Pattern families; each is drawn from a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TextureFamily {
    /// One colour.
    Plain,
    /// Smooth noise over several octaves.
    Noise,
    /// Brickwork with mortar joints.
    Brick,
    /// Boards with grain.
    Planks,
    /// Square tiles with joints, each of its own shade.
    Tiles,
    /// A poster wall: panels with bars, discs and glyph-like strokes.
    Posters,
    /// Shelves of books: upright blocks of many widths, heights and colours.
    Shelves,
    /// Horizontal bands, the same from all sides: no azimuth can be read off inside them.
    Bands,
}

/// How a surface looks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TextureSpec {
    /// Pattern family.
    pub family: TextureFamily,
    /// Base colour: red, green, blue, 0 to 255.
    #[serde(default = "TextureSpec::default_colour")]
    pub colour: [u8; 3],
    /// Edge length of the square of surface that the pattern covers before it repeats, m.
    #[serde(default = "TextureSpec::default_period")]
    pub period_m: f64,
    /// Strength of the pattern, 0 (plain) to 1.
    #[serde(default = "TextureSpec::default_contrast")]
    pub contrast: f64,
    /// Seed of the pattern; by default each surface of a world gets its own.
    #[serde(default)]
    pub seed: Option<u64>,
}

impl TextureSpec {
    /// A texture of the given family and colour with default period and contrast.
    #[must_use]
    pub fn new(family: TextureFamily, colour: [u8; 3]) -> Self {
        Self { family, colour, period_m: Self::default_period(), contrast: Self::default_contrast(), seed: None }
    }
    fn default_colour() -> [u8; 3] {
        [170, 165, 155]
    }
    fn default_period() -> f64 {
        4.0
    }
    fn default_contrast() -> f64 {
        0.6
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

/// Light. Intensities are relative: ambient plus lamps of about 1 in all show a texture's own colour.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LightSpec {
    /// Share of light that comes from everywhere.
    pub ambient: f64,
    /// Lamps.
    pub lamps: Vec<LampSpec>,
}

impl Default for LightSpec {
    fn default() -> Self {
        Self { ambient: 0.9, lamps: Vec::new() }
    }
}

/// A point lamp with Lambert shading and inverse-square falloff; it casts no shadows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LampSpec {
    /// Position x, y, z, m.
    pub position_m: [f64; 3],
    /// Irradiance that a facing surface gets at 1 m.
    pub intensity: f64,
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

/// The panoramic camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSpec {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Height of the camera's centre above the floor, m. It sits above the middle of the axle.
    pub height_m: f64,
    /// Direction of column 0 from the robot's heading, degrees.
    pub mount_deg: f64,
    /// Share of the rows above the horizon.
    pub horizon: f64,
}

impl Default for CameraSpec {
    fn default() -> Self {
        Self { width_px: 1440, height_px: 180, height_m: 0.4, mount_deg: 0.0, horizon: 0.6 }
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
