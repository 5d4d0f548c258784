//! Bearings through the camera: render, then extract.

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
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    /// The room under its light, exposure included.
    pub scene: &'a Scene,
    /// The camera's optics.
    pub optics: OpticsSpec,
}

/// A panoramic camera, and an extractor that finds the home panorama's features again.
///
/// Each frame has noise of its own, drawn from the run's seed and the frame's number. The robot's motion while the shutter is
/// open is that since the last observation. From inside a body, which only a robot that nothing stops comes into, the picture is
/// black.
pub struct RenderedSensor<'a> {
    renderer: &'a mut dyn Renderer,
    sight: Sight<'a>,
    camera: Camera,
    projection: Projection,
    extractor: Extractor,
    home: HomeSnapshot,
    home_panorama: Panorama,
    panorama: Panorama,
    seed: Seed,
    /// Frames taken since home.
    frame: u64,
    last: Option<Pose>,
    period_s: f64,
    /// Speeds above which the robot was carried.
    carried: Twist,
    timing: SensorTiming,
}

impl<'a> RenderedSensor<'a> {
    /// Takes the home panorama of `world` as `[home, now]` says first, and readies the extractor for it; all later panoramas are
    /// as it says second. `seed` is that of the run.
    ///
    /// # Errors
    /// When the renderer fails.
    pub fn new(
        world: &World,
        [home, now]: [Sight<'a>; 2],
        renderer: &'a mut dyn Renderer,
        projection: Projection,
        settings: ExtractorSettings,
        seed: Seed,
    ) -> Result<Self> {
        let seed = seed.derive("camera");
        let mut home_panorama = Panorama::black(projection);
        let view = View { projection, robot: world.home, bodies: &world.body_poses() };
        let noise = seed.derive("home");
        Camera::new(home.optics).take(renderer, home.scene, &view, Twist::default(), noise, &mut home_panorama)?;
        let extractor = Extractor::new(settings, &home_panorama);
        let robot = &world.spec.robot;
        Ok(Self {
            renderer,
            sight: now,
            camera: Camera::new(now.optics),
            projection,
            home: extractor.home_snapshot(),
            extractor,
            home_panorama,
            panorama: Panorama::black(projection),
            seed,
            frame: 0,
            last: None,
            period_s: world.spec.task.control_period_s,
            carried: Twist { v: CARRIED * robot.max_speed_m_s, omega: CARRIED * robot.max_turn_rate_rad_s },
            timing: SensorTiming::default(),
        })
    }

    /// How the robot has moved since the last observation.
    fn twist(&self, truth: &Pose) -> Twist {
        let Some(last) = self.last else { return Twist::default() };
        let turned = wrap(truth.heading - last.heading);
        let along = direction(last.heading + 0.5 * turned).dot(&(truth.position() - last.position()));
        let twist = Twist { v: along / self.period_s, omega: turned / self.period_s };
        if twist.v.abs() > self.carried.v || twist.omega.abs() > self.carried.omega { Twist::default() } else { twist }
    }

    fn take(&mut self, truth: Pose, bodies: &[Pose]) -> Result<()> {
        let twist = self.twist(&truth);
        let noise = self.seed.derive(&format!("frame {}", self.frame));
        self.frame += 1;
        self.last = Some(truth);
        let view = View { projection: self.projection, robot: truth, bodies };
        let taken = self.camera.take(self.renderer, self.sight.scene, &view, twist, noise, &mut self.panorama);
        match taken {
            Err(Error::CameraInside { .. }) => {
                self.panorama = Panorama::black(self.projection);
                Ok(())
            }
            result => result,
        }
    }
}

impl Sensor for RenderedSensor<'_> {
    fn home(&self) -> &HomeSnapshot {
        &self.home
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>> {
        let rendering = Instant::now();
        self.take(truth, bodies)?;
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
