//! The parts of an episode, built as a setup names them or brought by a caller.

use std::sync::Arc;

use super::setup::{PlantKind, SensorKind, Setup};
use crate::error::Result;
use crate::geometry::Pose;
use crate::physics::{Plant, UnicyclePlant};
use crate::random::Seed;
use crate::render::{self, Scene};
use crate::sensor::{
    CompassSensor, DatasetField, DatasetSensor, DegradedSensor, IdealSensor, NoisySensor, RenderedSensor, Sensor, Sight,
};
use crate::world::World;

/// Puts a plant at a pose in the room, for the run of a seed.
pub type PlantMaker<'a> = Box<dyn FnMut(Pose, Seed) -> Box<dyn Plant + 'a> + Send + 'a>;

/// What moves and what senses. Any of the two may be a caller's own.
pub struct Parts<'a> {
    /// Makes the plant of each run.
    pub plant: PlantMaker<'a>,
    /// What senses; it sees the truth, as the world does.
    pub sensor: Box<dyn Sensor + 'a>,
}

impl<'a> Parts<'a> {
    /// Those that `setup` names, in `world`.
    ///
    /// # Errors
    /// When [`Setup::check`] finds a fault, the world cannot be packed, the plant or the renderer cannot be had, or the set cannot be opened.
    pub fn new(world: &'a World, setup: &Setup) -> Result<Self> {
        setup.check()?;
        Self::shared(world, setup, &Shared::new(world, setup)?)
    }

    /// A plant by name and a sensor of a caller's own.
    ///
    /// # Errors
    /// [`FeatureOff`](crate::Error::FeatureOff) where this build has no such plant.
    pub fn with_sensor(world: &'a World, kind: PlantKind, sensor: Box<dyn Sensor + 'a>) -> Result<Self> {
        Ok(Self { plant: plant(world, kind)?, sensor })
    }

    /// The same, with what is costly taken from `shared`.
    pub(super) fn shared(world: &'a World, setup: &Setup, shared: &Shared) -> Result<Self> {
        Ok(Self { plant: plant(world, setup.plant)?, sensor: sensor(world, setup, shared)? })
    }
}

/// The plant by name.
fn plant(world: &World, kind: PlantKind) -> Result<PlantMaker<'_>> {
    match kind {
        #[cfg(feature = "rapier")]
        PlantKind::Rapier => Ok(Box::new(|start, seed| Box::new(crate::physics::RapierPlant::new(world, start, seed)))),
        #[cfg(not(feature = "rapier"))]
        PlantKind::Rapier => Err(crate::Error::FeatureOff { what: "the plant `rapier`", feature: "rapier" }),
        PlantKind::Unicycle => Ok(Box::new(|start, seed| Box::new(UnicyclePlant::new(world, start, seed)))),
    }
}

/// What takes long to make, and what simulations of equal worlds and setups therefore share.
#[derive(Clone, Default)]
pub(super) struct Shared {
    /// The scene as it was at home and as it is on the way, for a sensor that renders.
    pub(super) scenes: Option<[Arc<Scene>; 2]>,
    /// The set, for a sensor that reads one.
    dataset: Option<Arc<DatasetField>>,
}

impl Shared {
    /// Packs the world, or opens the set.
    pub(super) fn new(world: &World, setup: &Setup) -> Result<Self> {
        if setup.sensor != SensorKind::Rendered {
            return Self::with_scenes(world, setup, None);
        }
        let scene = Scene::new(world)?;
        Self::with_scenes(world, setup, Some(setup.looks().map(|look| Arc::new(look.scene(&scene, world)))))
    }

    /// The same with scenes that are packed already.
    pub(super) fn with_scenes(world: &World, setup: &Setup, scenes: Option<[Arc<Scene>; 2]>) -> Result<Self> {
        let choice = setup.dataset.as_ref().filter(|_| setup.sensor == SensorKind::Dataset);
        let dataset = choice.map(|choice| DatasetField::new(world, choice).map(Arc::new)).transpose()?;
        Ok(Self { scenes: scenes.filter(|_| setup.sensor == SensorKind::Rendered), dataset })
    }
}

/// The setup's sensor with its faults and its compass.
fn sensor<'a>(world: &'a World, setup: &Setup, shared: &Shared) -> Result<Box<dyn Sensor + 'a>> {
    let mut sensor: Box<dyn Sensor + 'a> = match (&shared.scenes, &shared.dataset) {
        (Some([home, now]), _) => {
            let sight = |scene: &Arc<Scene>, look: super::Look| Sight { scene: Arc::clone(scene), optics: look.optics(world) };
            let [home_look, look] = setup.looks();
            let (sights, renderer) = ([sight(home, home_look), sight(now, look)], render::create(setup.renderer)?);
            Box::new(RenderedSensor::new(world, sights, renderer, setup.projection(world), setup.extractor.clone()))
        }
        (None, Some(field)) => Box::new(DatasetSensor::new(world, Arc::clone(field), setup.extractor.clone())),
        (None, None) if setup.sensor == SensorKind::Noisy => {
            Box::new(NoisySensor::new(IdealSensor::new(world), world.landmark_count, setup.noise.unwrap_or_default(), Seed(0)))
        }
        (None, None) => Box::new(IdealSensor::new(world)),
    };
    if !setup.degradation.is_none() {
        sensor = Box::new(DegradedSensor::new(sensor, setup.degradation));
    }
    if let Some(sd_rad) = setup.compass_sd_rad {
        sensor = Box::new(CompassSensor::new(sensor, world.home, sd_rad));
    }
    Ok(sensor)
}
