//! How good is the extractor? Repeatability, matching precision and bearing errors against the renderer's range and instance.
//!
//! Panoramas are taken around home, and the renderer's range says where each home feature must appear in them. One condition at
//! a time is changed: distance, turn, light, noise, camera, what stands in between. The truth scores; the extractor sees colours only.

pub mod condition;
mod opencv;
pub mod page;
pub mod score;

use std::f64::consts::TAU;
use std::ops::ControlFlow;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use crate::error::{Result, go_on};
use crate::geometry::{Pose, Twist, direction};
use crate::observation::HomeSnapshot;
use crate::panorama::{Panorama, Shot};
use crate::physics::{Plant, RapierPlant};
use crate::random::Seed;
use crate::render::{Camera, CpuRenderer, Scene, View};
use crate::verify::speed::pool_of;
use crate::vision::{Extractor, ExtractorSettings, Landmarks};
use crate::world::{CameraPreset, World};
use condition::{Condition, Factor};
use score::{Score, Spread};

/// Directions from home in which panoramas are taken, where the robot can stand there.
const DIRECTIONS: usize = 16;
/// Distance from home for all factors but distance, m.
const USUAL_DISTANCE_M: f64 = 1.0;
/// Time for which bodies walk on between two panoramas, s.
const PAUSE_S: f64 = 2.0;

/// A panorama that is going to be scored, beside that of home.
#[derive(Debug)]
pub struct Pair<'a> {
    /// The world.
    pub world: &'a World,
    /// Number of the place, from 0 on; `None` for the home panorama.
    pub place: Option<usize>,
    /// Distance from home, m.
    pub distance_m: f64,
    /// The panorama and its pose.
    pub shot: &'a Shot,
}

/// What was measured at one level of one factor in one world.
#[derive(Debug, Clone, Serialize)]
pub struct LevelScore {
    /// Name of the world.
    pub world: String,
    /// What is changed.
    #[serde(rename = "axis")]
    pub factor: Factor,
    /// How far.
    pub level: f64,
    /// What the level is called.
    pub label: String,
    /// Panoramas.
    pub panoramas: usize,
    /// Share of the visible home features that are found as features.
    pub repeatability: f64,
    /// Mean number of matches after the geometric check.
    pub matches: f64,
    /// Mean number of those that are right.
    pub right: f64,
    /// Least number of right matches in a panorama.
    pub least_right: usize,
    /// Right matches over all.
    pub precision: f64,
    /// Wrong matches of all panoramas.
    pub wrong: usize,
    /// Those of them on the right instance.
    pub wrong_same_instance: usize,
    /// Those of them within ten times the distance that counts as right.
    pub wrong_near: usize,
    /// Those of them that are neither.
    pub wrong_wild: usize,
    /// Bearing errors of right matches, degrees.
    pub error_deg: Option<Spread>,
    /// The same, pixels.
    pub error_px: Option<Spread>,
    /// The same in stated standard deviations.
    pub error_sd: Option<Spread>,
    /// Mean number of landmark objects found.
    pub objects: f64,
    /// Their bearing errors, degrees.
    pub object_error_deg: Option<Spread>,
    /// The same in stated standard deviations.
    pub object_error_sd: Option<Spread>,
}

/// All that was measured.
#[derive(Debug, Clone, Serialize)]
pub struct VisionStudy {
    /// By world, factor and level.
    #[serde(rename = "cells")]
    pub levels: Vec<LevelScore>,
    /// Bearing errors of all right matches by distance from home, ascending, rad: (distance in metres, errors).
    #[serde(skip)]
    pub errors_rad: Vec<(f64, Vec<f64>)>,
    /// Names and SHA-256 of the worlds.
    pub worlds: Vec<(String, String)>,
    /// Most features kept of a panorama.
    pub keypoints: usize,
    /// Columns and rows of the panoramas of the first world.
    pub size_px: [u32; 2],
    /// Seed of walkers, noise and what hides.
    pub seed: u64,
    /// Median time of one observation on one thread of this machine, ms: features, matches and check. Differs from run to run.
    pub observe_ms: f64,
    /// Version of this program.
    pub version: &'static str,
}

/// What to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct VisionSettings {
    /// The extractor.
    pub extractor: ExtractorSettings,
    /// What is changed, in this order.
    pub factors: Vec<Factor>,
    /// Seed of walkers, noise and what hides.
    pub seed: u64,
}

impl VisionSettings {
    /// Number of levels that are measured in each world.
    pub fn levels(&self) -> usize {
        self.factors.iter().map(|factor| factor.levels().len()).sum()
    }
}

/// Measures. `take` gets every panorama of the factor distance and the home panoramas as they are rendered; `watch` is called when
/// a level is done. The result, but for its time, does not depend on the number of threads.
///
/// # Errors
/// When a world cannot be packed or rendered, `take` fails, or `watch` breaks.
pub fn measure(
    worlds: &[World],
    settings: &VisionSettings,
    take: &mut dyn FnMut(&Pair<'_>) -> Result<()>,
    watch: &dyn Fn(&LevelScore) -> ControlFlow<()>,
) -> Result<VisionStudy> {
    let mut study = VisionStudy {
        levels: Vec::new(),
        errors_rad: Factor::Distance.levels().iter().map(|d| (*d, Vec::new())).collect(),
        worlds: worlds.iter().map(|w| (w.spec.name.clone(), w.sha256.clone())).collect(),
        keypoints: settings.extractor.features,
        size_px: worlds.first().map_or([0, 0], |w| [w.projection().width, w.projection().height]),
        seed: settings.seed,
        observe_ms: 0.0,
        version: crate::VERSION,
    };
    let mut times_ms = Vec::new();
    for world in worlds {
        let site = Site::new(world, settings)?;
        take(&Pair { world, place: None, distance_m: 0.0, shot: &site.home })?;
        for &factor in &settings.factors {
            for (k, &level) in factor.levels().iter().enumerate() {
                let shots = site.take(factor, level)?;
                if factor == Factor::Distance {
                    for (place, shot) in &shots {
                        take(&Pair { world, place: Some(*place), distance_m: level, shot })?;
                    }
                }
                let score = site.score(factor, level, shots, &mut times_ms)?;
                if factor == Factor::Distance {
                    study.errors_rad[k].1.extend_from_slice(&score.errors_rad);
                }
                let score = level_score(world, factor, level, &score);
                go_on(watch(&score))?;
                study.levels.push(score);
            }
        }
    }
    study.observe_ms = Spread::of(&times_ms).map_or(0.0, |spread| spread.median);
    Ok(study)
}

fn level_score(world: &World, factor: Factor, level: f64, score: &Score) -> LevelScore {
    let per_panorama = |count: usize| count as f64 / score.panoramas.max(1) as f64;
    let degrees = |errors: &[f64]| Spread::of(errors).map(|s| s.times(1f64.to_degrees()));
    LevelScore {
        world: world.spec.name.clone(),
        factor,
        level,
        label: factor.label(level),
        panoramas: score.panoramas,
        repeatability: score.repeatability(),
        matches: per_panorama(score.matches),
        right: per_panorama(score.right),
        least_right: score.least_right,
        precision: score.precision(),
        wrong: score.matches - score.right,
        wrong_same_instance: score.wrong_same_instance,
        wrong_near: score.wrong_near,
        wrong_wild: score.wrong_wild,
        error_deg: degrees(&score.errors_rad),
        error_px: Spread::of(&score.errors_rad).map(|s| s.times(1.0 / world.projection().pixel_rad())),
        error_sd: Spread::of(&score.normalised),
        objects: per_panorama(score.object_errors_rad.len()),
        object_error_deg: degrees(&score.object_errors_rad),
        object_error_sd: Spread::of(&score.object_normalised),
    }
}

/// A world with its home panorama.
struct Site<'a> {
    world: &'a World,
    settings: &'a VisionSettings,
    scene: Scene,
    home: Shot,
}

/// The extractors of features and of objects, and what the latter knows of home.
struct Extractors {
    features: Extractor,
    objects: Extractor,
    snapshot: HomeSnapshot,
}

impl Extractors {
    fn new(settings: &ExtractorSettings, home: &Panorama) -> Self {
        let with = |landmarks| Extractor::new(ExtractorSettings { landmarks, ..settings.clone() }, home);
        let objects = with(Landmarks::Objects);
        Self { features: with(Landmarks::Features), snapshot: objects.home_snapshot(), objects }
    }
}

impl<'a> Site<'a> {
    fn new(world: &'a World, settings: &'a VisionSettings) -> Result<Self> {
        let scene = Scene::new(world)?;
        let seed = Seed(settings.seed).derive("vision/home");
        let home = shoot(world, &scene, CameraPreset::Ideal, world.home, &world.body_poses(), seed)?;
        Ok(Self { world, settings, scene, home })
    }

    /// Panoramas around home, with the numbers of their places: as far off and turned as the level says, else 1 m off and turned
    /// somehow. Bodies that walk go on meanwhile.
    fn take(&self, factor: Factor, level: f64) -> Result<Vec<(usize, Shot)>> {
        let (world, home) = (self.world, self.world.home);
        let distance_m = if factor == Factor::Distance { level } else { USUAL_DISTANCE_M };
        // Walkers meet a robot that waits at home.
        let mut plant = RapierPlant::new(world, home, Seed(self.settings.seed));
        let moving = world.bodies.iter().any(|b| b.motion.is_some());
        let mut views = Vec::new();
        for k in 0..DIRECTIONS {
            if moving {
                let steps = (PAUSE_S / world.spec.task.control_period_s) as usize;
                for _ in 0..steps {
                    plant.step(Twist { v: 0.0, omega: 0.0 }, world.spec.task.control_period_s);
                }
            }
            let azimuth = TAU * (k as f64 + 0.5) / DIRECTIONS as f64;
            let point = home.position() + direction(home.heading + azimuth) * distance_m;
            // The golden angle: turns that neither repeat nor follow the direction.
            let turn = if factor == Factor::Rotation { level.to_radians() } else { 2.399_963 * k as f64 + 1.0 };
            let pose = Pose::new(point.x, point.y, home.heading + turn);
            let bodies = plant.body_poses();
            if world.is_free(&pose, 0.0, bodies).is_ok() {
                views.push((k, pose, bodies.to_vec()));
            }
        }
        let condition = Condition::at(factor, level);
        let scene = self.scene.under(condition.light, condition.camera.optics().exposure);
        let noise = Seed(self.settings.seed).derive(&format!("vision/{}/{level}", factor.name()));
        let take = |(k, pose, bodies): (usize, Pose, Vec<Pose>)| {
            Ok((k, shoot(world, &scene, condition.camera, pose, &bodies, noise.derive(&k.to_string()))?))
        };
        views.into_par_iter().map(take).collect()
    }

    fn score(&self, factor: Factor, level: f64, shots: Vec<(usize, Shot)>, times_ms: &mut Vec<f64>) -> Result<Score> {
        let condition = Condition::at(factor, level);
        let seed = Seed(self.settings.seed);
        let stream = |place: &str| seed.stream(&format!("vision/{}/{level}/{place}", factor.name()));
        let mut home = self.home.panorama.clone();
        if factor == Factor::Noise {
            condition.apply(&mut home, &mut stream("home"));
        }
        let look = |mut shots: Vec<(usize, Shot)>| -> Vec<(Score, f64)> {
            let mut extractors = Extractors::new(&self.settings.extractor, &home);
            let score = |(place, shot): &mut (usize, Shot)| {
                condition.apply(&mut shot.panorama, &mut stream(&place.to_string()));
                let mut score = Score::default();
                score.add_objects(&mut extractors.objects, &extractors.snapshot, &self.home, shot);
                let start = Instant::now();
                extractors.features.observe(&shot.panorama);
                let time_ms = 1e3 * start.elapsed().as_secs_f64();
                score.add(&extractors.features, &self.home, shot);
                (score, time_ms)
            };
            shots.iter_mut().map(score).collect()
        };
        // A pool of one for each part, so that a panorama is timed on one thread, which does nothing else meanwhile.
        let size = shots.len().div_ceil(rayon::current_num_threads()).max(1);
        let mut parts: Vec<Vec<_>> = Vec::new();
        for shot in shots {
            match parts.last_mut() {
                Some(part) if part.len() < size => part.push(shot),
                _ => parts.push(vec![shot]),
            }
        }
        let scores = std::thread::scope(|scope| {
            let look = &look;
            let worker = |part| scope.spawn(move || pool_of(1).map(|pool| pool.install(|| look(part))));
            let workers: Vec<_> = parts.into_iter().map(worker).collect();
            let scores = workers.into_iter().map(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
            scores.collect::<Result<Vec<_>>>()
        })?;
        let mut sum = Score::default();
        for (score, time_ms) in scores.into_iter().flatten() {
            sum.join(score);
            times_ms.push(time_ms);
        }
        Ok(sum)
    }
}

/// Takes a panorama from where the robot stands still.
fn shoot(world: &World, scene: &Scene, camera: CameraPreset, robot: Pose, bodies: &[Pose], noise: Seed) -> Result<Shot> {
    let projection = world.projection();
    let mut panorama = Panorama::black(projection);
    let view = View { projection, robot, bodies };
    Camera::new(camera.optics()).take(&mut CpuRenderer::new(), scene, &view, Twist::default(), noise, &mut panorama)?;
    Ok(Shot { panorama, pose: world.camera_pose(&robot) })
}
