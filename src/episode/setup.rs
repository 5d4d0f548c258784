//! Choosing the parts of an episode.

use serde::Serialize;
use strum::{Display, EnumMessage, IntoStaticStr, VariantArray};

use crate::control::{Law, Pace};
use crate::error::{Error, Result};
use crate::estimation::anchored::FilterSettings;
use crate::estimation::paper::PaperSettings;
use crate::geometry::Pose;
use crate::method::{MethodKind, MethodOptions};
use crate::observation::{Briefing, CameraSheet, RobotSheet, TaskSheet};
use crate::panorama::{Panorama, Projection};
use crate::random::Seed;
use crate::render::{RendererChoice, Scene};
use crate::sensor::{DatasetChoice, Degradation, Noise, Sensor, check_deviation, check_share};
use crate::vision::ExtractorSettings;
use crate::world::{CameraPreset, LightPreset, OpticsSpec, TaskSpec, World};

/// What moves when the wheels are commanded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Display, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum PlantKind {
    /// Wheels that slip, motors, encoders, collisions.
    Rapier,
    /// The unicycle's kinematics with perfect odometry; nothing stops it.
    Unicycle,
}

/// Where bearings come from, by the names that the command line has for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Display, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum SensorKind {
    /// Features of rendered panoramas, found again from the home panorama.
    Rendered,
    /// True bearings of the landmark bodies' centres, where nothing hides them.
    Ideal,
    /// Ideal bearings with noise, drop-outs and false matches.
    Noisy,
    /// Features of the panoramas of a set on disk.
    Dataset,
}

impl SensorKind {
    /// Whether bearings are found in panoramas, which takes most of a run's time.
    pub fn is_seeing(self) -> bool {
        matches!(self, Self::Rendered | Self::Dataset)
    }
}

/// When a run has come home.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StopRule {
    /// When the method claims it and the robot comes to rest within the arrival radius.
    #[default]
    Claim,
    /// When the robot truly is within the arrival radius, whatever the method believes: the rule of the paper's simulations.
    Reached,
}

/// Light and camera of [`SensorKind::Rendered`]. What is `None` is as the world has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Look {
    /// Light.
    pub light: Option<LightPreset>,
    /// Camera.
    pub camera: Option<CameraPreset>,
}

impl Look {
    /// What this look leaves open, taken from `other`.
    pub fn or(self, other: Self) -> Self {
        Self { light: self.light.or(other.light), camera: self.camera.or(other.camera) }
    }

    /// The light that it stands for in `world`.
    pub fn light(&self, world: &World) -> LightPreset {
        self.light.unwrap_or(world.spec.light.preset)
    }

    /// The preset of the camera that it stands for in `world`.
    pub fn camera(&self, world: &World) -> CameraPreset {
        self.camera.unwrap_or(world.spec.camera.preset)
    }

    /// The optics that it stands for in `world`.
    pub fn optics(&self, world: &World) -> OpticsSpec {
        self.camera.map_or(world.spec.camera.optics, CameraPreset::optics)
    }

    /// `scene`, packed from `world`, under this light as this camera is exposed.
    pub fn scene(&self, scene: &Scene, world: &World) -> Scene {
        scene.under(self.light(world), self.optics(world).exposure)
    }
}

/// Where a run starts.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// Drawn from the world's start region with the run's seed.
    Random,
    /// A start that the world names.
    Named(String),
    /// A pose in the room.
    At(Pose),
}

/// The parts and settings of an episode, all but the world and the seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// What moves.
    pub plant: PlantKind,
    /// What senses.
    pub sensor: SensorKind,
    /// What decides.
    pub method: MethodKind,
    /// How it steers.
    pub law: Law,
    /// How fast it drives; see [`MethodOptions::pace`].
    pub pace: Pace,
    /// Knobs of the anchored filter; the track is the robot's, whatever they say.
    pub filter: FilterSettings,
    /// Knobs of the paper's filter.
    pub paper: PaperSettings,
    /// When a run has come home.
    pub stop: StopRule,
    /// What renders, for [`SensorKind::Rendered`].
    pub renderer: RendererChoice,
    /// Columns and rows of the panorama where they differ from the world's.
    pub size_px: Option<(u32, u32)>,
    /// What makes bearings of panoramas, for [`SensorKind::Rendered`].
    pub extractor: ExtractorSettings,
    /// Light and camera, for [`SensorKind::Rendered`].
    pub look: Look,
    /// Light and camera of the home panorama; what is `None` is as in `look`.
    pub home_look: Look,
    /// The set of [`SensorKind::Dataset`].
    pub dataset: Option<DatasetChoice>,
    /// Faults of [`SensorKind::Noisy`]; `None` for the usual ones.
    pub noise: Option<Noise>,
    /// What is done to the bearings of any sensor on top of that.
    pub degradation: Degradation,
    /// Standard deviation of the readings of the robot's compass, rad; `None` for a robot without one. Methods that
    /// estimate where home is leave it alone.
    pub compass_sd_rad: Option<f64>,
    /// Where runs start.
    pub start: Start,
    /// Pose in the home frame that a method starts from which wants one.
    pub initial_estimate: Option<Pose>,
    /// Whether such a method is told the true start instead: a condition of a comparison, not something a robot has.
    pub told_start: bool,
    /// Time limit where it differs from the world's, s.
    pub time_limit_s: Option<f64>,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            plant: PlantKind::Rapier,
            sensor: SensorKind::Rendered,
            method: MethodKind::AnchoredEkf,
            law: Law::Proportional,
            pace: Pace::Governed,
            filter: FilterSettings::default(),
            paper: PaperSettings::default(),
            stop: StopRule::Claim,
            renderer: RendererChoice::Auto,
            size_px: None,
            extractor: ExtractorSettings::default(),
            look: Look::default(),
            home_look: Look::default(),
            dataset: None,
            noise: None,
            degradation: Degradation::default(),
            compass_sd_rad: None,
            start: Start::Random,
            initial_estimate: None,
            told_start: false,
            time_limit_s: None,
        }
    }
}

impl Setup {
    /// The world's task with this setup's time limit.
    pub fn task(&self, world: &World) -> TaskSpec {
        let task = world.spec.task;
        TaskSpec { time_limit_s: self.time_limit_s.unwrap_or(task.time_limit_s), ..task }
    }

    /// The camera's projection in this setup.
    pub fn projection(&self, world: &World) -> Projection {
        self.size_px.map_or_else(|| world.projection(), |(width, height)| world.projection_of_size(width, height))
    }

    /// Light and camera at home, and on the way.
    pub fn looks(&self) -> [Look; 2] {
        [self.home_look.or(self.look), self.look]
    }

    /// Refuses what would do nothing, and numbers out of their range.
    ///
    /// # Errors
    /// [`Error::Invalid`] that names a setting, what it goes with, and what was chosen.
    pub fn check(&self) -> Result<()> {
        use SensorKind::{Dataset, Noisy, Rendered};
        let goes_with = |given: bool, what: &str, kinds: &[SensorKind]| {
            if !given || kinds.contains(&self.sensor) {
                return Ok(());
            }
            let name = |kind: &SensorKind| format!("--bearings {kind}");
            let allowed = kinds.iter().map(name).collect::<Vec<_>>().join(" or ");
            Err(Error::Invalid { what: format!("sensor for {what}"), found: name(&self.sensor), allowed })
        };
        goes_with(self.noise.is_some(), "--noise-*", &[Noisy])?;
        goes_with(self.size_px.is_some(), "--size", &[Rendered])?;
        goes_with(self.look.or(self.home_look) != Look::default(), "--light and --camera", &[Rendered])?;
        goes_with(
            self.extractor != ExtractorSettings::default(),
            "--landmarks and other settings of the extractor",
            &[Rendered, Dataset],
        )?;
        goes_with(self.dataset.is_some(), "--dataset*", &[Dataset])?;
        let invalid = |what: &str, found: String, allowed: &str| {
            Err(Error::Invalid { what: what.into(), found, allowed: allowed.into() })
        };
        if self.sensor == Dataset && self.dataset.is_none() {
            return invalid("set for --bearings dataset", "none".into(), "the folder of one, with `--dataset DIR`");
        }
        if self.method != MethodKind::PaperEkf && (self.initial_estimate.is_some() || self.told_start) {
            return invalid("initial estimate", "one".into(), "none: only paper-ekf is started from a supposed pose");
        }
        let noise = self.noise.unwrap_or_default();
        check_deviation("noise of bearings", noise.sd_rad)?;
        check_share("share of bearings that drop out", noise.dropout)?;
        check_share("share of bearings that are false", noise.false_match)?;
        check_deviation("noise of the compass", self.compass_sd_rad.unwrap_or(0.0))?;
        self.degradation.check()?;
        if self.time_limit_s.is_some_and(|limit| !(limit > 0.0 && limit.is_finite())) {
            return invalid("time limit", format!("{} s", self.time_limit_s.unwrap_or_default()), "more than 0");
        }
        self.method.check()
    }

    /// What the method is set to in a run from `start` (in the room).
    pub fn method_options(&self, world: &World, start: &Pose) -> MethodOptions {
        MethodOptions {
            law: self.law,
            pace: self.pace,
            filter: self.filter,
            paper: self.paper,
            initial: if self.told_start { Some(world.home.to_local(start)) } else { self.initial_estimate },
            stops: self.stop == StopRule::Claim,
        }
    }

    /// What a method is told before a run.
    pub fn briefing(&self, world: &World, sensor: &dyn Sensor) -> Briefing {
        let camera = |home: &Panorama| CameraSheet { projection: home.projection, home_rgba: home.rgba.clone() };
        Briefing {
            home: sensor.home().clone(),
            robot: robot_sheet(world),
            task: task_sheet(&self.task(world)),
            compass: self.compass_sd_rad.is_some(),
            camera: sensor.home_panorama().map(camera),
        }
    }

    /// The start pose in the room of the run with `seed`, checked to be free.
    ///
    /// # Errors
    /// When the world has no such start, or the robot cannot stand there.
    pub fn start_pose(&self, world: &World, seed: Seed) -> Result<Pose> {
        let pose = match &self.start {
            Start::Random => return world.random_start(&mut seed.stream("start")),
            Start::Named(name) => world.named_start(name)?,
            Start::At(pose) => *pose,
        };
        world.is_free(&pose, 0.0, &world.body_poses()).map_err(|reason| Error::Invalid {
            what: "start".into(),
            found: format!("({}, {}) m, where {reason} is in the way", pose.x, pose.y),
            allowed: format!("a place in world `{}` where the robot can stand", world.spec.name),
        })?;
        Ok(pose)
    }
}

/// What a method is told about the robot.
fn robot_sheet(world: &World) -> RobotSheet {
    let robot = &world.spec.robot;
    RobotSheet {
        track_m: robot.track_m,
        camera_offset_m: world.spec.camera.offset_m,
        max_speed_m_s: robot.max_speed_m_s,
        max_turn_rate_rad_s: robot.max_turn_rate_rad_s,
        max_acceleration_m_s2: robot.max_acceleration_m_s2,
    }
}

/// What a method is told about the task.
fn task_sheet(task: &TaskSpec) -> TaskSheet {
    TaskSheet { speed_m_s: task.speed_m_s, control_period_s: task.control_period_s, arrival_radius_m: task.arrival_radius_m }
}
