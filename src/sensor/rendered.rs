//! Bearings through the camera: render, then extract.

use std::sync::Arc;
use std::time::Instant;

use super::{Sensor, SensorTiming};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Twist, direction, wrap};
use crate::observation::{Bearing, HomeSnapshot};
use crate::panorama::{Panorama, Projection};
use crate::random::Seed;
use crate::render::{Camera, Renderer, RendererInfo, Scene, View};
use crate::vision::{Extractor, ExtractorSettings};
use crate::world::{OpticsSpec, World};

/// Faster than this many times its top speed, a robot has not driven but was carried: no blur tells of it.
const CARRIED: f64 = 2.0;

/// How the room looks, and through which camera.
#[derive(Debug, Clone)]
pub struct Sight {
    /// The room under its light, exposure included.
    pub scene: Arc<Scene>,
    /// The camera's optics.
    pub optics: OpticsSpec,
}

/// A panoramic camera, and an extractor that finds the home panorama's features again.
///
/// Each frame has noise of its own, drawn from the run's seed and the frame's number. The robot's motion while the shutter is
/// open is that since the last observation. From inside a body, which only a robot that nothing stops comes into, the picture is
/// black.
pub struct RenderedSensor<'a> {
    world: &'a World,
    renderer: Box<dyn Renderer>,
    /// At home, and on the way.
    sights: [Sight; 2],
    camera: Camera,
    projection: Projection,
    settings: ExtractorSettings,
    /// Finds the features of the home panorama again; `None` before the first reset.
    extractor: Option<Extractor>,
    home: HomeSnapshot,
    home_panorama: Panorama,
    panorama: Panorama,
    seed: Seed,
    /// Frames taken since home.
    frame: u64,
    last: Option<Pose>,
    timing: SensorTiming,
}

impl<'a> RenderedSensor<'a> {
    /// A sensor in `world` that sees it as `[home, now]` say, in panoramas of `projection`. The home panorama is taken when it is
    /// reset.
    pub fn new(
        world: &'a World,
        sights: [Sight; 2],
        renderer: Box<dyn Renderer>,
        projection: Projection,
        settings: ExtractorSettings,
    ) -> Self {
        Self {
            world,
            renderer,
            camera: Camera::new(sights[1].optics),
            sights,
            projection,
            settings,
            extractor: None,
            home: HomeSnapshot::default(),
            home_panorama: Panorama::black(projection),
            panorama: Panorama::black(projection),
            seed: Seed(0),
            frame: 0,
            last: None,
            timing: SensorTiming::default(),
        }
    }

    fn take(&mut self, truth: Pose, bodies: &[Pose]) -> Result<()> {
        let twist = self.last.map_or_else(Twist::default, |last| twist_between(self.world, &last, &truth));
        let noise = self.seed.derive(&format!("frame {}", self.frame));
        self.frame += 1;
        self.last = Some(truth);
        let view = View { projection: self.projection, robot: truth, bodies };
        let taken = self.camera.take(self.renderer.as_mut(), &self.sights[1].scene, &view, twist, noise, &mut self.panorama);
        match taken {
            Err(Error::CameraInside { .. }) => {
                self.panorama = Panorama::black(self.projection);
                Ok(())
            }
            result => result,
        }
    }
}

/// How a robot moved that was at `last` a control period ago and is at `truth` now; not at all if it was carried.
pub(super) fn twist_between(world: &World, last: &Pose, truth: &Pose) -> Twist {
    let (robot, period_s) = (&world.spec.robot, world.spec.task.control_period_s);
    let turned = wrap(truth.heading - last.heading);
    let along = direction(last.heading + 0.5 * turned).dot(&(truth.position() - last.position()));
    let twist = Twist { v: along / period_s, omega: turned / period_s };
    let carried = twist.v.abs() > CARRIED * robot.max_speed_m_s || twist.omega.abs() > CARRIED * robot.max_turn_rate_rad_s;
    if carried { Twist::default() } else { twist }
}

impl Sensor for RenderedSensor<'_> {
    fn reset(&mut self, seed: Seed) -> Result<()> {
        self.seed = seed.derive("camera");
        let (home, bodies) = (&self.sights[0], self.world.body_poses());
        let view = View { projection: self.projection, robot: self.world.home, bodies: &bodies };
        let (still, noise) = (Twist::default(), self.seed.derive("home"));
        let mut camera = Camera::new(home.optics);
        camera.take(self.renderer.as_mut(), &home.scene, &view, still, noise, &mut self.home_panorama)?;
        let extractor = self.extractor.insert(Extractor::new(self.settings.clone(), &self.home_panorama));
        self.home = extractor.home_snapshot();
        self.camera = Camera::new(self.sights[1].optics);
        (self.frame, self.last, self.timing) = (0, None, SensorTiming::default());
        Ok(())
    }

    fn home(&self) -> &HomeSnapshot {
        &self.home
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>> {
        let rendering = Instant::now();
        self.take(truth, bodies)?;
        let extracting = Instant::now();
        let bearings = self.extractor.as_mut().map_or_else(Vec::new, |extractor| extractor.observe(&self.panorama));
        self.timing.render_s += (extracting - rendering).as_secs_f64();
        self.timing.vision_s += extracting.elapsed().as_secs_f64();
        Ok(bearings)
    }

    fn alternatives(&self) -> &[Vec<Bearing>] {
        self.extractor.as_ref().map_or(&[], Extractor::alternatives)
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
