//! Choosing the parts of an episode and putting them together.

use std::ops::ControlFlow;
use std::sync::Arc;

use serde::Serialize;
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use super::record::Record;
use super::recorder::Recorder;
use super::run::{Parts, Progress, run_recorded};
use crate::error::{Error, Result};
use crate::estimation::anchored::FilterSettings;
use crate::geometry::Pose;
use crate::method::{self, LawKind, MethodKind};
use crate::observation::{Briefing, CameraSheet, RobotSheet, TaskSheet};
use crate::panorama::{Panorama, Projection};
use crate::physics::{Plant, RapierPlant, UnicyclePlant};
use crate::random::Seed;
use crate::render::{self, Renderer, RendererChoice, Scene};
use crate::sensor::{
    CompassSensor, DatasetChoice, DatasetField, DatasetSensor, Degradation, DegradedSensor, IdealSensor, Noise, NoisySensor,
    RenderedSensor, Sensor, Sight,
};
use crate::vision::ExtractorSettings;
use crate::world::{CameraPreset, LightPreset, OpticsSpec, TaskSpec, World};

/// What moves when the wheels are commanded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum PlantKind {
    /// Wheels that slip, motors, encoders, collisions.
    Rapier,
    /// The unicycle's kinematics with perfect odometry; nothing stops it.
    Unicycle,
}

/// Where bearings come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Bearings {
    /// Features of rendered panoramas, found again from the home panorama.
    Rendered,
    /// True bearings of the landmark bodies' centres, where nothing hides them.
    Ideal,
    /// Ideal bearings with noise, drop-outs and false matches.
    Noisy,
    /// Features of the panoramas of a set on disk.
    Dataset,
}

impl Bearings {
    /// Whether they are found in panoramas, which takes most of a run's time.
    #[must_use]
    pub fn are_seen(self) -> bool {
        matches!(self, Self::Rendered | Self::Dataset)
    }
}

/// Light and camera of [`Bearings::Rendered`]. What is `None` is as the world has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Look {
    /// Light.
    pub light: Option<LightPreset>,
    /// Camera.
    pub camera: Option<CameraPreset>,
}

impl Look {
    /// What this look leaves open, taken from `other`.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self { light: self.light.or(other.light), camera: self.camera.or(other.camera) }
    }

    /// The light that it stands for in `world`.
    #[must_use]
    pub fn light(&self, world: &World) -> LightPreset {
        self.light.unwrap_or(world.spec.light.preset)
    }

    /// The preset of the camera that it stands for in `world`.
    #[must_use]
    pub fn camera(&self, world: &World) -> CameraPreset {
        self.camera.unwrap_or(world.spec.camera.preset)
    }

    /// The optics that it stands for in `world`.
    #[must_use]
    pub fn optics(&self, world: &World) -> OpticsSpec {
        self.camera.map_or(world.spec.camera.optics, CameraPreset::optics)
    }

    /// `scene`, packed from `world`, under this light as this camera is exposed.
    #[must_use]
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
    pub bearings: Bearings,
    /// What decides.
    pub method: MethodKind,
    /// How it steers.
    pub law: LawKind,
    /// Knobs of the anchored filter; the track is the robot's, whatever they say.
    pub filter: FilterSettings,
    /// What renders, for [`Bearings::Rendered`].
    pub renderer: RendererChoice,
    /// Columns and rows of the panorama where they differ from the world's.
    pub size_px: Option<(u32, u32)>,
    /// What makes bearings of panoramas, for [`Bearings::Rendered`].
    pub extractor: ExtractorSettings,
    /// Light and camera, for [`Bearings::Rendered`].
    pub look: Look,
    /// Light and camera of the home panorama; what is `None` is as in `look`.
    pub home_look: Look,
    /// The set of [`Bearings::Dataset`].
    pub dataset: Option<DatasetChoice>,
    /// Faults of [`Bearings::Noisy`].
    pub noise: Noise,
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
            bearings: Bearings::Rendered,
            method: MethodKind::AnchoredEkf,
            law: LawKind::Proportional,
            filter: FilterSettings::default(),
            renderer: RendererChoice::Auto,
            size_px: None,
            extractor: ExtractorSettings::default(),
            look: Look::default(),
            home_look: Look::default(),
            dataset: None,
            noise: Noise::default(),
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
    #[must_use]
    pub fn task(&self, world: &World) -> TaskSpec {
        let task = world.spec.task;
        TaskSpec { time_limit_s: self.time_limit_s.unwrap_or(task.time_limit_s), ..task }
    }

    /// The camera's projection in this setup.
    #[must_use]
    pub fn projection(&self, world: &World) -> Projection {
        self.size_px.map_or_else(|| world.projection(), |(width, height)| world.projection_of_size(width, height))
    }

    /// Light and camera at home, and on the way.
    #[must_use]
    pub fn looks(&self) -> [Look; 2] {
        [self.home_look.or(self.look), self.look]
    }

    /// What a method is told before a run.
    #[must_use]
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

/// A world made ready to run episodes of one setup on it, one after the other.
pub struct Bench<'a> {
    world: &'a World,
    setup: &'a Setup,
    camera: Option<Camera>,
    dataset: Option<Arc<DatasetField>>,
}

/// What rendered bearings need, kept from run to run.
struct Camera {
    /// The scene as it was at home, and as it is on the way.
    scenes: [Arc<Scene>; 2],
    renderer: Box<dyn Renderer>,
}

impl<'a> Bench<'a> {
    /// Packs the world and opens the renderer where the setup needs them.
    ///
    /// # Errors
    /// When the method's program is not there, the world cannot be packed, the renderer cannot be had, or the set cannot be opened.
    pub fn new(world: &'a World, setup: &'a Setup) -> Result<Self> {
        setup.method.check()?;
        let camera = match setup.bearings {
            Bearings::Rendered => {
                let scene = Scene::new(world)?;
                let scenes = setup.looks().map(|look| Arc::new(look.scene(&scene, world)));
                Some(Camera { scenes, renderer: render::create(setup.renderer)? })
            }
            Bearings::Ideal | Bearings::Noisy | Bearings::Dataset => None,
        };
        let dataset = field(world, setup)?;
        Ok(Self { world, setup, camera, dataset })
    }

    /// The packed world as it was at home and as it is on the way; `None` for a sensor without a camera.
    #[must_use]
    pub fn scenes(&self) -> Option<[Arc<Scene>; 2]> {
        self.camera.as_ref().map(|camera| camera.scenes.clone())
    }

    /// As [`Bench::new`], with the scenes of another bench on an equal world with the same [`Setup::looks`]: packing a world, its
    /// textures above all, takes longer than a short run.
    ///
    /// # Errors
    /// When the renderer cannot be had, or the set cannot be opened.
    pub fn with_scenes(world: &'a World, setup: &'a Setup, scenes: [Arc<Scene>; 2]) -> Result<Self> {
        let camera = match setup.bearings {
            Bearings::Rendered => Some(Camera { scenes, renderer: render::create(setup.renderer)? }),
            Bearings::Ideal | Bearings::Noisy | Bearings::Dataset => None,
        };
        let dataset = field(world, setup)?;
        Ok(Self { world, setup, camera, dataset })
    }

    /// A second bench for another thread; it shares the packed world and has a renderer of its own.
    ///
    /// # Errors
    /// When a second renderer cannot be had.
    pub fn another(&self) -> Result<Self> {
        let camera = match &self.camera {
            Some(camera) => Some(Camera { scenes: camera.scenes.clone(), renderer: render::create(self.setup.renderer)? }),
            None => None,
        };
        Ok(Self { camera, dataset: self.dataset.clone(), ..*self })
    }

    /// Runs the episode of one seed. `watch` is called once a control step and stops the run with `Break`.
    ///
    /// # Errors
    /// When there is no such start, the method cannot be built from what the setup gives it, the renderer fails, or `watch`
    /// breaks.
    pub fn run(&mut self, seed: u64, watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>) -> Result<Record> {
        self.run_recorded(seed, watch, &mut ())
    }

    /// [`Bench::run`], with a recorder that is told of every control step.
    ///
    /// # Errors
    /// As [`Bench::run`], and what the recorder fails with.
    pub fn run_recorded(
        &mut self,
        seed: u64,
        watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
        recorder: &mut dyn Recorder,
    ) -> Result<Record> {
        let start = self.setup.start_pose(self.world, Seed(seed))?;
        self.run_parts(seed, start, watch, recorder)
    }

    /// Runs the episode of one seed from a pose in the room, whatever start the setup names.
    ///
    /// # Errors
    /// As [`Bench::run`].
    pub fn run_from(&mut self, seed: u64, start: Pose, watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>) -> Result<Record> {
        self.run_parts(seed, start, watch, &mut ())
    }

    fn run_parts(
        &mut self,
        seed: u64,
        start: Pose,
        watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
        recorder: &mut dyn Recorder,
    ) -> Result<Record> {
        let (world, setup, seed) = (self.world, self.setup, Seed(seed));
        let mut plant: Box<dyn Plant> = match setup.plant {
            PlantKind::Rapier => Box::new(RapierPlant::new(world, start, seed)),
            PlantKind::Unicycle => Box::new(UnicyclePlant::new(world, start, seed)),
        };
        let mut sensor = self.sensor(seed)?;
        let task = setup.task(world);
        let briefing = setup.briefing(world, sensor.as_ref());
        let initial = if setup.told_start { Some(world.home.to_local(&start)) } else { setup.initial_estimate };
        let mut method = method::build(setup.method.clone(), setup.law, setup.filter, briefing, initial)?;
        let parts = Parts { plant: plant.as_mut(), sensor: sensor.as_mut(), method: method.as_mut() };
        run_recorded(parts, world.home, &task, watch, recorder)
    }

    /// The setup's sensor for the run of one seed.
    ///
    /// # Errors
    /// When the renderer fails or the setup asks for faults that cannot be.
    pub fn sensor(&mut self, seed: Seed) -> Result<Box<dyn Sensor + '_>> {
        let (world, setup) = (self.world, self.setup);
        let ideal = || IdealSensor::new(world);
        let mut sensor: Box<dyn Sensor + '_> = match (&mut self.camera, &self.dataset) {
            (Some(Camera { scenes: [home, now], renderer }), _) => {
                let [home_look, look] = setup.looks();
                let sights =
                    [Sight { scene: home, optics: home_look.optics(world) }, Sight { scene: now, optics: look.optics(world) }];
                let (projection, settings) = (setup.projection(world), setup.extractor.clone());
                Box::new(RenderedSensor::new(world, sights, renderer.as_mut(), projection, settings, seed)?)
            }
            (None, Some(field)) => Box::new(DatasetSensor::new(world, Arc::clone(field), setup.extractor.clone())),
            (None, None) if setup.bearings == Bearings::Noisy => {
                Box::new(NoisySensor::new(ideal(), world.landmark_count, setup.noise, seed))
            }
            (None, None) => Box::new(ideal()),
        };
        if !setup.degradation.is_none() {
            sensor = Box::new(DegradedSensor::new(sensor, setup.degradation, seed)?);
        }
        if let Some(sd_rad) = setup.compass_sd_rad {
            sensor = Box::new(CompassSensor::new(sensor, world.home, sd_rad, seed)?);
        }
        Ok(sensor)
    }
}

/// The set that bearings come from, where they come from one.
fn field(world: &World, setup: &Setup) -> Result<Option<Arc<DatasetField>>> {
    match (setup.bearings, &setup.dataset) {
        (Bearings::Dataset, Some(choice)) => Ok(Some(Arc::new(DatasetField::new(world, choice)?))),
        (Bearings::Dataset, None) => Err(Error::Invalid {
            what: "set for --bearings dataset".into(),
            found: "none".into(),
            allowed: "the folder of one, with `home --dataset DIR`".into(),
        }),
        _ => Ok(None),
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
