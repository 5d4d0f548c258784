//! The arguments, and how a person writes their values.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Parser, Subcommand};
use wayhome::control::Law;
use wayhome::episode::{Look, PlantKind, SensorKind, Start};
use wayhome::geometry::Pose;
use wayhome::method::MethodKind;
use wayhome::render::RendererChoice;
use wayhome::report::paper::Target;
use wayhome::study::robustness::Axis;
use wayhome::verify::vision::conditions::Axis as VisionAxis;
use wayhome::vision::Landmarks;
use wayhome::world::{CameraPreset, LightPreset};

use super::method_args::{MethodParser, PatienceArgs};
use super::record_args::RecordArgs;

/// Shown under every `--help`.
const EXIT_CODES: &str = "Exit codes:
  0    done; for a single run of `home`: home was reached
  1    failed: a file, a folder or a device
  2    usage: an argument or one of its values is not allowed
  3    a single run of `home` ended without reaching home
  130  interrupted by Ctrl-C; nothing half written is left behind";

/// Heading of the flags that all subcommands have.
const GENERAL: &str = "General options";
/// Shown under `drive --help`.
const DRIVE_HELP: &str = "Commands are CSV with a header, times from 0 on:
  t_s,v_m_s,omega_rad_s
  0,0.3,0
  2,0.2,0.8
  5,0,0
Each row holds until the time of the next; the last row is the end.

Exit codes:
  0    done
  1    failed: a file or a folder
  2    usage: an argument or one of its values is not allowed
  130  interrupted by Ctrl-C; nothing half written is left behind";

/// Headless, physics-simulated robot testbed for bearing-only visual homing
#[derive(Debug, Parser)]
#[command(version = wayhome::VERSION, after_help = EXIT_CODES)]
pub struct Args {
    #[command(flatten)]
    pub common: CommonArgs,
    #[command(subcommand)]
    pub command: Command,
}

/// Flags of all subcommands.
#[derive(Debug, clap::Args)]
pub struct CommonArgs {
    /// Print one JSON object on stdout
    #[arg(long, global = true, help_heading = GENERAL)]
    pub json: bool,
    /// No progress and no diagnostics on stderr, errors excepted
    #[arg(long, short, global = true, help_heading = GENERAL)]
    pub quiet: bool,
    /// Worker threads [default: one a processor]; no result depends on their number
    #[arg(long, global = true, help_heading = GENERAL, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Drive home: one closed-loop run, or one a seed
    #[command(after_help = EXIT_CODES)]
    Home(Box<HomeArgs>),
    /// Drive a table of commands open loop and record truth, odometry, wheels, slip and forces
    #[command(after_help = DRIVE_HELP)]
    Drive(DriveArgs),
    /// Hold the physics against its closed forms: a page of charts, and the slip map
    PhysicsReport(PhysicsReportArgs),
    /// Every method from the same starts: success, time, path, final error, AAE, catchment area
    #[command(after_help = EXIT_CODES)]
    Compare(Box<super::compare::CompareArgs>),
    /// Rebuild the paper's tables and figures beside the printed numbers, and audit its claims
    Reproduce(super::reproduce::ReproduceArgs),
    /// Where the paper's state can be told from bearings and motion: rank and condition over a room
    Observability(super::observability::ObservabilityArgs),
    /// Success against conditions that worsen one at a time, as a table and a picture
    #[command(after_help = EXIT_CODES)]
    Robustness(Box<RobustnessArgs>),
    /// Stress studies: Monte-Carlo sweeps over any settings, on one machine or many, and their report
    #[command(after_help = super::sweep::HELP)]
    Sweep(Box<super::sweep::SweepArgs>),
    /// Cramer-Rao bound of range, bearing and heading along a path, and the filter's errors beside it
    #[command(after_help = EXIT_CODES)]
    Bound(BoundArgs),
    /// Hold the extractor against ground truth: a page of tables and charts
    #[command(after_help = EXIT_CODES)]
    VisionReport(VisionReportArgs),
    /// Render panoramas with range and instance ids: of a pose, along a trajectory, or several on a sheet
    #[command(after_help = EXIT_CODES)]
    Render(Box<RenderArgs>),
    /// How fast the renderer is and what it shows: a page with the speeds, and sheets of all worlds and presets
    RenderReport(RenderReportArgs),
    /// Panorama sets with ground truth in the field's layouts; their check; how fast they are made
    Dataset(Box<super::dataset::DatasetArgs>),
    /// Check, draw and describe world files
    World(WorldArgs),
}

/// Arguments of `home`.
#[derive(Debug, clap::Args)]
pub struct HomeArgs {
    /// World file, or the name of a built-in world
    #[arg(default_value = "worlds/lab.toml")]
    pub world: String,
    /// What moves when the wheels are commanded
    #[arg(long, default_value = "rapier", value_parser = choice(PLANTS))]
    pub plant: PlantKind,
    /// Where bearings come from
    #[arg(long, default_value = "rendered", value_parser = choice(BEARINGS))]
    pub bearings: SensorKind,
    /// Homing method
    #[arg(long, default_value = "anchored-ekf", value_parser = MethodParser)]
    pub method: MethodKind,
    /// Steering law of the methods that estimate where home is
    #[arg(long, default_value = "proportional", value_parser = choice(LAWS))]
    pub controller: Law,
    #[command(flatten)]
    pub patience: PatienceArgs,
    /// What a landmark of rendered bearings is [default: features]
    #[arg(long, value_parser = choice(LANDMARKS))]
    pub landmarks: Option<Landmarks>,
    /// What renders
    #[arg(long, default_value = "auto", value_parser = choice(RENDERERS))]
    pub renderer: RendererChoice,
    /// Columns and rows of the panorama, 16x8 to 16384x4096 [default: the world's]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    #[command(flatten)]
    pub look: LookArgs,
    #[command(flatten)]
    pub set: super::dataset::SetArgs,
    /// Light at home, if another than on the way
    #[arg(long, value_parser = choice(LIGHTS))]
    pub home_light: Option<LightPreset>,
    /// Camera at home, if another than on the way
    #[arg(long, value_parser = choice(CAMERAS))]
    pub home_camera: Option<CameraPreset>,
    /// Start: `random`, the name of one of the world's starts, or a pose x,y,heading_deg
    #[arg(long, default_value = "random", allow_hyphen_values = true, value_parser = start)]
    pub start: Start,
    /// Seed of the run
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Run all seeds from A to B, both included, in parallel and report on all of them together
    #[arg(long, value_name = "A..B", conflicts_with = "seed", value_parser = seeds)]
    pub seeds: Option<RangeInclusive<u64>>,
    /// Run an episode of a study again, exactly: the study's folder and the episode's number in its rows
    #[arg(long, value_name = "DIR:ROW", conflicts_with_all = ["world", "plant", "bearings", "method", "controller", "landmarks",
        "renderer", "size", "light", "camera", "home_light", "home_camera", "start", "seed", "seeds", "initial_estimate",
        "compass_deg", "time_limit_s", "noise_deg", "noise_dropout", "noise_false"], value_parser = super::sweep::row)]
    pub replay: Option<(PathBuf, u64)>,
    /// Pose in the home frame at which a filter starts that has to be given one (paper-ekf): x,y,heading_deg
    #[arg(long, value_name = "x,y,heading_deg", allow_hyphen_values = true, value_parser = pose)]
    pub initial_estimate: Option<Pose>,
    /// Give the robot a compass with readings of this standard deviation, degrees; programs and methods without an estimate use it
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = not_negative)]
    pub compass_deg: Option<f64>,
    /// Time limit, s [default: the world's]
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive)]
    pub time_limit_s: Option<f64>,
    /// Standard deviation of noisy bearings, degrees [default: 0.3]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = not_negative)]
    pub noise_deg: Option<f64>,
    /// Share of noisy bearings that are missed [default: 0.05]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = share)]
    pub noise_dropout: Option<f64>,
    /// Share of noisy bearings that are false [default: 0.02]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = share)]
    pub noise_false: Option<f64>,
    #[command(flatten)]
    pub recordings: RecordArgs,
    /// Folder for the results [default: results/runs/home-WORLD-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Light and camera of rendered panoramas.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct LookArgs {
    /// Light [default: the world's]
    #[arg(long, value_parser = choice(LIGHTS))]
    pub light: Option<LightPreset>,
    /// What the camera does to a picture [default: as the world says]
    #[arg(long, value_parser = choice(CAMERAS))]
    pub camera: Option<CameraPreset>,
}

impl LookArgs {
    /// What they stand for.
    pub fn look(&self) -> Look {
        Look { light: self.light, camera: self.camera }
    }
}

/// Arguments of `drive`.
#[derive(Debug, clap::Args)]
pub struct DriveArgs {
    /// World file, or the name of a built-in world
    pub world: String,
    /// Table of commands: t_s, v_m_s, omega_rad_s
    #[arg(long, value_name = "FILE.csv")]
    pub commands: PathBuf,
    /// Start: `random`, the name of one of the world's starts, or a pose x,y,heading_deg [default: the world's home]
    #[arg(long, allow_hyphen_values = true, value_parser = start)]
    pub start: Option<Start>,
    /// Seed of the run
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Folder for the results [default: results/runs/drive-WORLD-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Arguments of `robustness`.
#[derive(Debug, clap::Args)]
pub struct RobustnessArgs {
    /// World file, or the name of a built-in world
    #[arg(default_value = "lab")]
    pub world: String,
    /// Run all seeds from A to B, both included, at every level
    #[arg(long, value_name = "A..B", default_value = "1..40", value_parser = seeds)]
    pub seeds: RangeInclusive<u64>,
    /// What gets worse; several are separated by commas [default: all]
    #[arg(long, value_name = "AXIS", value_delimiter = ',', value_parser = choice(AXES))]
    pub axis: Vec<Axis>,
    /// Where bearings come from, before they are made worse
    #[arg(long, default_value = "rendered", value_parser = choice(BEARINGS))]
    pub bearings: SensorKind,
    /// Homing method
    #[arg(long, default_value = "anchored-ekf", value_parser = MethodParser)]
    pub method: MethodKind,
    /// Steering law of the methods that estimate where home is
    #[arg(long, default_value = "proportional", value_parser = choice(LAWS))]
    pub controller: Law,
    #[command(flatten)]
    pub patience: PatienceArgs,
    /// What renders
    #[arg(long, default_value = "auto", value_parser = choice(RENDERERS))]
    pub renderer: RendererChoice,
    /// Columns and rows of the panorama, 16x8 to 16384x4096 [default: the world's]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Time limit, s [default: the world's]
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive)]
    pub time_limit_s: Option<f64>,
    /// Folder for the results [default: results/runs/robustness-WORLD-SEEDS]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Arguments of `physics-report`.
#[derive(Debug, clap::Args)]
pub struct PhysicsReportArgs {
    /// Folder for the page; trajectories of another engine that lie there are shown too
    #[arg(long, value_name = "DIR", default_value = "results/physics")]
    pub out: PathBuf,
}

/// Arguments of `bound`.
#[derive(Debug, clap::Args)]
pub struct BoundArgs {
    /// World file, or the name of a built-in world
    #[arg(default_value = "lab")]
    pub world: String,
    /// Runs of the filter along the path: one a seed from A to B, both included
    #[arg(long, value_name = "A..B", default_value = "1..200", value_parser = seeds)]
    pub seeds: RangeInclusive<u64>,
    /// Seed of the run whose path is taken
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub path_seed: u64,
    /// Start of the path: `random`, the name of one of the world's starts, or a pose x,y,heading_deg
    #[arg(long, default_value = "random", allow_hyphen_values = true, value_parser = start)]
    pub start: Start,
    /// Standard deviation of bearings, degrees [default: 0.3]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = positive)]
    pub noise_deg: Option<f64>,
    /// Noise of odometry as a share of speed and yaw rate, in each step anew [default: 0.04]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = share)]
    pub noise_odometry: Option<f64>,
    /// Runs whose mean NEES and NIS are held against their 95 % bands, group by group [default: all together]
    #[arg(long, value_name = "N")]
    pub group: Option<usize>,
    /// Time between rows of the table, s; `--json` has all steps
    #[arg(long, value_name = "S", default_value = "0.5", allow_negative_numbers = true, value_parser = positive)]
    pub every_s: f64,
}

/// Arguments of `vision-report`.
#[derive(Debug, clap::Args)]
pub struct VisionReportArgs {
    /// World files, or names of built-in worlds
    #[arg(default_values_t = ["lab".to_owned(), "slippery".to_owned(), "crowd".to_owned()], value_name = "WORLD")]
    pub worlds: Vec<String>,
    /// What is changed; several are separated by commas [default: all]
    #[arg(long, value_name = "AXIS", value_delimiter = ',', value_parser = choice(VISION_AXES))]
    pub axis: Vec<VisionAxis>,
    /// Most features kept of a panorama, 16 to 10000 [default: the extractor's]
    #[arg(long, value_name = "N", value_parser = keypoints)]
    pub keypoints: Option<usize>,
    /// Seed of walkers, noise and what hides
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Folder, new or empty, for the panoramas of the distance axis, which tests/outside/opencv_features.py reads
    #[arg(long, value_name = "DIR")]
    pub pairs: Option<PathBuf>,
    /// Folder for the page; what other detectors made of the same pairs is shown if it lies there
    #[arg(long, value_name = "DIR", default_value = "results/vision")]
    pub out: PathBuf,
}

/// Arguments of `render`.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("what").args(["pose", "trajectory", "sheet", "bench"]).multiple(true).required(true))]
pub struct RenderArgs {
    /// World file, or the name of a built-in world
    #[arg(required_unless_present = "bench")]
    pub world: Option<String>,
    /// Pose of the robot that carries the camera
    #[arg(long, value_name = "x,y,heading_deg", allow_hyphen_values = true, value_parser = pose)]
    pub pose: Option<Pose>,
    /// A panorama for each row of a table that begins with t_s,x_m,y_m,heading_rad, such as the trajectory.csv of `home`; the
    /// robot stands still in each, and bodies stand where the world has them
    #[arg(long, value_name = "FILE.csv", conflicts_with = "pose")]
    pub trajectory: Option<PathBuf>,
    /// One picture of several poses, each with range and instances in false colours: of the pose or some along the trajectory,
    /// without those of home and places where a run may start
    #[arg(long)]
    pub sheet: bool,
    /// Time the renderers of this machine: panoramas a second by size, instruction set and threads, beside the filling of memory
    #[arg(long, conflicts_with_all = ["world", "pose", "trajectory", "sheet", "light", "camera", "seed", "size", "renderer", "out"])]
    pub bench: bool,
    #[command(flatten)]
    pub look: LookArgs,
    /// Seed of the camera's noise, and of the places on a sheet
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Columns and rows of the panorama, 16x8 to 16384x4096 [default: the world's; on a sheet 720x90]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// What renders
    #[arg(long, default_value = "auto", value_parser = choice(RENDERERS))]
    pub renderer: RendererChoice,
    /// Folder for the results [default: results/runs/render-WORLD, with -trajectory or -sheet]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Arguments of `render-report`.
#[derive(Debug, clap::Args)]
pub struct RenderReportArgs {
    /// Seconds that go into each figure
    #[arg(long, value_name = "S", default_value = "2", allow_negative_numbers = true, value_parser = positive)]
    pub seconds: f64,
    /// Folder for the page
    #[arg(long, value_name = "DIR", default_value = "results/rendering")]
    pub out: PathBuf,
}

/// Arguments of `world`.
#[derive(Debug, clap::Args)]
pub struct WorldArgs {
    #[command(subcommand)]
    pub command: WorldCommand,
}

/// The subcommands of `world`.
#[derive(Debug, Subcommand)]
pub enum WorldCommand {
    /// Check a world file and list all its faults
    Check {
        /// World file, or the name of a built-in world
        world: String,
    },
    /// Draw a world from above as SVG
    Plot {
        /// World file, or the name of a built-in world
        world: String,
        /// File for the drawing [default: stdout]
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Print the JSON Schema of world files
    Schema,
}

/// A value of the library, what it is called here, and what `--help` says of it.
pub type Choice<T> = (T, &'static str, &'static str);

pub const PLANTS: &[Choice<PlantKind>] = &[
    (PlantKind::Rapier, "rapier", "Wheels that slip, motors, encoders, collisions"),
    (PlantKind::Unicycle, "unicycle", "The unicycle's kinematics with perfect odometry; nothing stops it"),
];

pub const BEARINGS: &[Choice<SensorKind>] = &[
    (SensorKind::Rendered, "rendered", "Features of rendered panoramas, found again from the home panorama"),
    (SensorKind::Ideal, "ideal", "True bearings of the landmark bodies' centres, where nothing hides them"),
    (SensorKind::Noisy, "noisy", "Ideal bearings with noise, drop-outs and false matches"),
    (SensorKind::Dataset, "dataset", "Features of the panoramas of a set on disk, see --dataset"),
];

const LAWS: &[Choice<Law>] = &[
    (Law::Proportional, "proportional", "Turn rate proportional to the heading error"),
    (Law::Lyapunov, "lyapunov", "The paper's switching law"),
];

pub const RENDERERS: &[Choice<RendererChoice>] = &[
    (RendererChoice::Auto, "auto", "A hardware GPU where there is one, else the CPU"),
    (RendererChoice::Gpu, "gpu", "Any graphics adapter, a software one included"),
    (RendererChoice::Cpu, "cpu", "The CPU"),
];

const LANDMARKS: &[Choice<Landmarks>] = &[
    (Landmarks::Features, "features", "Each feature of the panorama by itself"),
    (Landmarks::Objects, "objects", "Neighbouring features clustered, the centre of the cluster the bearing"),
];

const VISION_AXES: &[Choice<VisionAxis>] = &[
    (VisionAxis::Distance, "distance", "Distance from home, 0.25 to 3 m"),
    (VisionAxis::Rotation, "rotation", "Turn since home, 0 to 180 degrees"),
    (VisionAxis::Gain, "gain", "Factor on the grey levels, 0.25 to 2"),
    (VisionAxis::Gamma, "gamma", "Exponent on the grey levels, 0.5 to 2"),
    (VisionAxis::Noise, "noise", "Image noise, 0 to 20 grey levels"),
    (VisionAxis::Occlusion, "occlusion", "Share of the turn that is hidden, 0 to 70 %"),
    (VisionAxis::Light, "light", "The world's light presets"),
    (VisionAxis::Camera, "camera", "The camera presets"),
];

const LIGHTS: &[Choice<LightPreset>] = &[
    (LightPreset::Day, "day", "As the world has it"),
    (LightPreset::Overcast, "overcast", "Rain outside, lamps off"),
    (LightPreset::Glare, "glare", "Low sun in the windows"),
    (LightPreset::Evening, "evening", "Lamps on, dusk outside"),
    (LightPreset::Night, "night", "A few lamps left on"),
];

const CAMERAS: &[Choice<CameraPreset>] = &[
    (CameraPreset::Ideal, "ideal", "Colours as they are"),
    (CameraPreset::Decent, "decent", "A good industrial camera: little noise, a short shutter"),
    (CameraPreset::Cheap, "cheap", "Noise, soft focus, dark rims, a warm cast"),
    (CameraPreset::Dirty, "dirty", "A decent one behind dust and splashes"),
    (CameraPreset::Night, "night", "Four times the exposure: a long shutter, amplified noise"),
];

const AXES: &[Choice<Axis>] = &[
    (Axis::Hidden, "hidden", "Share of the home landmarks that are never seen on the way, 0 to 70 %"),
    (Axis::Friction, "friction", "Friction of the floor, 0.8 to 0.1"),
    (Axis::FalseMatches, "false-matches", "Share of bearings that are false matches, 0 to 40 %"),
    (Axis::Noise, "noise", "Noise added to bearings, 0.05 to 2 degrees"),
];

/// What `reproduce` calls what it can; `None` is all of it.
pub const TARGETS: &[Choice<Option<Target>>] = &[
    (Some(Target::Table1), "table1", "Table I: errors with accurate bearings"),
    (Some(Target::Fig3), "fig3", "Fig. 3: paths with accurate bearings"),
    (Some(Target::Table2), "table2", "Table II: errors with bearings from images, the paper's own set"),
    (Some(Target::Fig5), "fig5", "Fig. 5: paths on that set"),
    (Some(Target::Fig7), "fig7", "Fig. 7: paths on Vardy's set"),
    (Some(Target::Fig8), "fig8", "Fig. 8: time home beside other methods"),
    (Some(Target::Observability), "observability", "Rank and condition of the matrix O"),
    (Some(Target::Audit), "audit", "A row for each claim: what holds, from which start, under which noise"),
    (None, "all", "All of these"),
];

/// Reads one of `choices` by its name.
pub fn choice<T: Copy + Send + Sync + 'static>(choices: &'static [Choice<T>]) -> impl TypedValueParser<Value = T> {
    let names = choices.iter().map(|(_, name, help)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(names)
        .try_map(|given| choices.iter().find(|(_, name, _)| *name == given).map(|(value, ..)| *value).ok_or("unknown name"))
}

/// What the command line calls one of `choices`.
pub fn name_of<T: PartialEq>(choices: &[Choice<T>], wanted: &T) -> &'static str {
    choices.iter().find(|(value, ..)| value == wanted).map_or("", |(_, name, _)| name)
}

/// What `--bearings` calls a sensor.
pub fn bearings_name(bearings: SensorKind) -> &'static str {
    name_of(BEARINGS, &bearings)
}

/// What `--controller` calls a law.
pub fn law_name(law: Law) -> &'static str {
    name_of(LAWS, &law)
}

/// What `--renderer` calls a renderer.
pub fn renderer_name(renderer: RendererChoice) -> &'static str {
    name_of(RENDERERS, &renderer)
}

/// A word as a shell takes it.
pub fn quoted(word: &str) -> String {
    if word.chars().all(|c| c.is_ascii_alphanumeric() || "-_./,:=".contains(c)) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// A finite number.
pub fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| format!("`{text}` is not a finite number"))
}

pub fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err("must be greater than 0".into()) })
}

pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|v| if v >= 0.0 { Ok(v) } else { Err("must not be negative".into()) })
}

fn share(text: &str) -> Result<f64, String> {
    number(text).and_then(|v| if (0.0..=1.0).contains(&v) { Ok(v) } else { Err("must be between 0 and 1".into()) })
}

/// `x,y,heading_deg`.
fn pose(text: &str) -> Result<Pose, String> {
    let numbers = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    let [x, y, heading_deg] = numbers[..] else {
        return Err(format!("found {} numbers, a pose is three: x,y,heading_deg", numbers.len()));
    };
    Ok(Pose::new(x, y, heading_deg.to_radians()))
}

fn start(text: &str) -> Result<Start, String> {
    match text {
        "random" => Ok(Start::Random),
        _ if text.contains(',') => pose(text).map(Start::At),
        _ => Ok(Start::Named(text.to_owned())),
    }
}

fn keypoints(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|n| (16..=10_000).contains(n));
    count.ok_or_else(|| "allowed are 16 to 10000 features".into())
}

/// `WxH` in pixels.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = text
        .split_once('x')
        .and_then(|(w, h)| Some((w.parse::<u32>().ok()?, h.parse::<u32>().ok()?)))
        .ok_or("a size is WxH, such as 1440x180")?;
    if !(16..=16384).contains(&width) || !(8..=4096).contains(&height) {
        return Err("allowed are widths of 16 to 16384 and heights of 8 to 4096".into());
    }
    Ok((width, height))
}

/// Most seeds of one batch.
const MOST_SEEDS: u64 = 100_000;

/// `A..B`, both ends included.
pub fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let (first, last) = text
        .split_once("..")
        .and_then(|(a, b)| Some((a.parse::<u64>().ok()?, b.strip_prefix('=').unwrap_or(b).parse::<u64>().ok()?)))
        .ok_or("seeds are A..B, such as 1..40, both ends included")?;
    if first > last || last - first >= MOST_SEEDS {
        return Err(format!("allowed are 1 to {MOST_SEEDS} seeds, the first one not above the last"));
    }
    Ok(first..=last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn choices_are_called_what_files_call_them() {
        fn check<T: serde::Serialize>(choices: &[Choice<T>]) {
            for (value, name, _) in choices {
                assert_eq!(serde_json::to_value(value).unwrap(), *name);
            }
        }
        check(PLANTS);
        check(BEARINGS);
        check(LAWS);
        check(AXES);
        check(LANDMARKS);
        check(VISION_AXES);
        check(LIGHTS);
        check(CAMERAS);
        assert!(LightPreset::ALL.iter().all(|one| LIGHTS.iter().any(|(light, ..)| light == one)));
        assert!(CameraPreset::ALL.iter().all(|one| CAMERAS.iter().any(|(camera, ..)| camera == one)));
        assert!(AXES.iter().all(|(axis, name, _)| axis.name() == *name));
    }

    #[test]
    fn values_are_read_and_checked() {
        assert_eq!(size("1440x180"), Ok((1440, 180)));
        for bad in ["0x0", "15x180", "1440x4097", "1440", "1440x", "-1x5", "99999999999x8", "1440X180"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(pose("1, -2,180"), Ok(Pose::new(1.0, -2.0, std::f64::consts::PI)));
        for bad in ["", "1,2", "1,2,3,4", "1,2,x", "NaN,0,0", "inf,0,0", "1e999,0,0"] {
            assert!(pose(bad).is_err(), "{bad}");
        }
        assert_eq!(seeds("1..40"), Ok(1..=40));
        assert_eq!(seeds("7..=7"), Ok(7..=7));
        for bad in ["", "1", "2..1", "..", "0..100000", "-1..3", "0..18446744073709551615"] {
            assert!(seeds(bad).is_err(), "{bad}");
        }
        assert_eq!(start("P1"), Ok(Start::Named("P1".into())));
        assert!(start("1,2").is_err());
        assert!(positive("0").is_err() && not_negative("-1").is_err() && share("1.1").is_err());
    }
}
