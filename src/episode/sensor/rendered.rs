//! Bearings through the camera: render, then extract.

use std::time::Instant;

use super::{Sensor, SensorTiming};
use crate::error::Result;
use crate::geometry::Pose;
use crate::observation::{Bearing, HomeSnapshot};
use crate::panorama::{Panorama, Projection};
use crate::render::{Renderer, RendererInfo, Scene, View};
use crate::vision::{Extractor, ExtractorSettings};
use crate::world::World;

/// A panoramic camera, and an extractor that finds the home panorama's features again.
pub struct RenderedSensor<'a> {
    renderer: &'a mut dyn Renderer,
    scene: &'a Scene,
    projection: Projection,
    extractor: Extractor,
    home: HomeSnapshot,
    home_panorama: Panorama,
    panorama: Panorama,
    timing: SensorTiming,
}

impl<'a> RenderedSensor<'a> {
    /// Takes the home panorama of `world`, whose packed form is `scene`, and readies the extractor for it.
    ///
    /// # Errors
    /// When the renderer fails.
    pub fn new(
        world: &World,
        scene: &'a Scene,
        renderer: &'a mut dyn Renderer,
        projection: Projection,
        settings: ExtractorSettings,
    ) -> Result<Self> {
        let mut home_panorama = Panorama::black(projection);
        let view = View { projection, robot: world.home, bodies: &world.body_poses() };
        renderer.render(scene, &view, &mut home_panorama)?;
        let extractor = Extractor::new(settings, &home_panorama);
        Ok(Self {
            renderer,
            scene,
            projection,
            home: extractor.home_snapshot(),
            extractor,
            home_panorama,
            panorama: Panorama::black(projection),
            timing: SensorTiming::default(),
        })
    }
}

impl Sensor for RenderedSensor<'_> {
    fn home(&self) -> &HomeSnapshot {
        &self.home
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>> {
        let rendering = Instant::now();
        let view = View { projection: self.projection, robot: truth, bodies };
        self.renderer.render(self.scene, &view, &mut self.panorama)?;
        let extracting = Instant::now();
        let bearings = self.extractor.observe(&self.panorama);
        self.timing.render_s += (extracting - rendering).as_secs_f64();
        self.timing.vision_s += extracting.elapsed().as_secs_f64();
        Ok(bearings)
    }

    fn home_panorama(&self) -> Option<&Panorama> {
        Some(&self.home_panorama)
    }

    fn panorama(&self) -> Option<&Panorama> {
        Some(&self.panorama)
    }

    fn renderer(&self) -> Option<&RendererInfo> {
        Some(self.renderer.info())
    }

    fn timing(&self) -> SensorTiming {
        self.timing
    }
}
