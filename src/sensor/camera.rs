//! The camera alone: pictures without bearings, for who finds features himself.

use std::time::Instant;

use super::rendered::{Sight, twist_between};
use super::{Sensor, SensorTiming};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Twist};
use crate::observation::{Bearing, HomeSnapshot};
use crate::panorama::{Panorama, Projection};
use crate::random::Seed;
use crate::render::{Camera, Renderer, RendererInfo, View};
use crate::world::World;

/// A panoramic camera that takes a picture every few control steps and finds nothing in it: observations come with a panorama
/// when there is a new one, and never with bearings.
pub struct CameraSensor<'a> {
    world: &'a World,
    renderer: Box<dyn Renderer>,
    sight: Sight,
    camera: Camera,
    projection: Projection,
    /// Steps from one picture to the next.
    every: u64,
    step: u64,
    home: HomeSnapshot,
    panorama: Panorama,
    is_new: bool,
    seed: Seed,
    last: Option<Pose>,
    timing: SensorTiming,
}

impl<'a> CameraSensor<'a> {
    /// One in `world` as `sight` shows it, with panoramas of `projection` in every `every`-th control step, the first included.
    pub fn new(world: &'a World, sight: Sight, renderer: Box<dyn Renderer>, projection: Projection, every: u64) -> Self {
        Self {
            world,
            renderer,
            camera: Camera::new(sight.optics),
            sight,
            projection,
            every: every.max(1),
            step: 0,
            home: HomeSnapshot::default(),
            panorama: Panorama::black(projection),
            is_new: false,
            seed: Seed(0),
            last: None,
            timing: SensorTiming::default(),
        }
    }
}

impl Sensor for CameraSensor<'_> {
    fn reset(&mut self, seed: Seed) -> Result<()> {
        self.seed = seed.derive("camera");
        self.camera = Camera::new(self.sight.optics);
        (self.step, self.last, self.is_new, self.timing) = (0, None, false, SensorTiming::default());
        Ok(())
    }

    fn home(&self) -> &HomeSnapshot {
        &self.home
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>> {
        let rendering = Instant::now();
        let twist = self.last.map_or_else(Twist::default, |last| twist_between(self.world, &last, &truth));
        self.last = Some(truth);
        self.is_new = self.step.is_multiple_of(self.every);
        if self.is_new {
            let noise = self.seed.derive(&format!("frame {}", self.step));
            let view = View { projection: self.projection, robot: truth, bodies };
            match self.camera.take(self.renderer.as_mut(), &self.sight.scene, &view, twist, noise, &mut self.panorama) {
                Err(Error::CameraInside { .. }) => self.panorama = Panorama::black(self.projection),
                result => result?,
            }
        }
        self.step += 1;
        self.timing.render_s += rendering.elapsed().as_secs_f64();
        Ok(Vec::new())
    }

    fn panorama(&self) -> Option<&Panorama> {
        self.is_new.then_some(&self.panorama)
    }

    fn renderer(&self) -> Option<&RendererInfo> {
        Some(self.renderer.info())
    }

    fn timing(&self) -> SensorTiming {
        self.timing
    }
}
