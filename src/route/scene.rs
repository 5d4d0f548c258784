//! Where routes are taught and repeated: a world, packed once, and the camera's size.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::episode::{Look, Parts, PlantKind, Setup, Simulation};
use crate::error::Result;
use crate::panorama::Projection;
use crate::render::{self, RendererChoice, Scene};
use crate::sensor::{CameraSensor, Sight};
use crate::world::World;

/// Columns and rows of a route's panoramas where nobody says otherwise.
pub const SIZE_PX: (u32, u32) = (720, 90);
/// Control steps from one picture to the next where nobody says otherwise.
pub const EVERY: u64 = 2;

/// A world with what is costly to make of it, for any number of simulations.
pub struct Stage<'a> {
    world: &'a World,
    scene: Scene,
    lit: Mutex<BTreeMap<String, Arc<Scene>>>,
    size_px: (u32, u32),
    every: u64,
    renderer: RendererChoice,
}

impl<'a> Stage<'a> {
    /// Packs a world, its textures above all.
    ///
    /// # Errors
    /// When it cannot be packed.
    pub fn new(world: &'a World, size_px: (u32, u32), every: u64, renderer: RendererChoice) -> Result<Self> {
        Ok(Self { world, scene: Scene::new(world)?, lit: Mutex::default(), size_px, every, renderer })
    }

    /// The world.
    #[must_use]
    pub fn world(&self) -> &'a World {
        self.world
    }

    /// Size and projection of panoramas.
    #[must_use]
    pub fn projection(&self) -> Projection {
        self.world.projection_of_size(self.size_px.0, self.size_px.1)
    }

    /// A simulation whose observations come with panoramas under a look, in this stage's world or in one that differs from it in
    /// what no camera sees: friction, disturbances, the task.
    ///
    /// # Errors
    /// When the renderer cannot be had, or this build has no plant with slip.
    pub fn simulation<'b>(&self, world: &'b World, look: Look) -> Result<Simulation<'b>> {
        let sight = Sight { scene: self.lit(look), optics: look.optics(self.world) };
        let camera = CameraSensor::new(world, sight, render::create(self.renderer)?, self.projection(), self.every);
        let setup = Setup { look, time_limit_s: Some(f64::INFINITY), ..Setup::default() };
        let parts = Parts::with_sensor(world, PlantKind::Rapier, Box::new(camera))?;
        Ok(Simulation::from_parts(world, &setup, parts))
    }

    fn lit(&self, look: Look) -> Arc<Scene> {
        let mut lit = self.lit.lock().unwrap_or_else(PoisonError::into_inner);
        let scene = lit.entry(format!("{look:?}")).or_insert_with(|| Arc::new(look.scene(&self.scene, self.world)));
        Arc::clone(scene)
    }
}
