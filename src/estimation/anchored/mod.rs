//! The anchored filter: finds home from bearings and odometry when nothing is known at the start.
//!
//! It runs in two stages, both on the same kind of [`map`]: the robot's pose and bearing-only landmarks, anchored at one frame.
//!
//! 1. **Search.** The anchor is where the robot stands at first, so its pose is known exactly there and nothing else is. As it
//!    moves, odometry gives the landmarks their ranges. In every step [`super::resection`] asks which home poses explain the
//!    snapshot; the best one says where to drive from the first second on.
//! 2. **Homing.** Once that answer is sharp and without rival, the map is built anew with home as the anchor: the landmarks'
//!    directions from there stand in the snapshot, and the robot's pose in the home frame is all that control needs. The
//!    [`smoother`] does it from everything stored so far, and does it again ever more seldom, so that no
//!    linearisation from the time when ranges were unknown survives.
//!
//! All of it is about the camera; [`lever`] tells what that means for a robot that carries it beside its axle.
//!
//! A step that the wheels do not explain is given more noise until the bearings fit ([`motion`]). Where no noise of the wheels'
//! does it (a kick, a kidnap, a wrong hypothesis) the filter is lost: it looks for the robot on its map, by resection again, and
//! where that fails it gives its belief up and searches anew from where it stands.

pub mod lever;
pub mod map;
pub mod motion;
pub mod smoother;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::resection::{self, Hypothesis, position_sd_m, resect};
use crate::geometry::{Matrix3, Pose, Vector2, angle_of, direction, wrap};
use crate::observation::{Bearing, Estimate, HomeSnapshot, LandmarkId, Odometry};
use lever::Lever;
use map::{Map, Prior, Update};
use motion::{LOOSENINGS, Motion, SlipWatch};
use smoother::{Frame, Iterate, Sighting, Solution, Stretch};

/// Knobs of the filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilterSettings {
    /// Mean of the prior on inverse range, 1/m.
    pub inverse_range_mean: f64,
    /// Standard deviation of that prior, 1/m.
    pub inverse_range_sd: f64,
    /// Noise of measured speed as a share of it, in each step anew.
    pub speed_noise_share: f64,
    /// Noise of measured speed at any speed while moving, m/s.
    pub speed_noise_m_s: f64,
    /// Noise of measured yaw rate as a share of it.
    pub turn_noise_share: f64,
    /// Noise of yaw rate per speed (wheels that differ), rad/m.
    pub turn_noise_rad_m: f64,
    /// Sideways motion of the axle as a share of speed (scrub).
    pub sideways_noise_share: f64,
    /// Distance between the wheels, m.
    pub track_m: f64,
    /// Position of the camera from the middle of the axle, forward and left, m.
    pub camera_offset_m: [f64; 2],
    /// Slip of a wheel as a share of the change of its speed over a step.
    pub slip_share: f64,
    /// Share of a step's slip that is still expected in the next one.
    pub slip_persistence: f64,
    /// Sideways slip of the axle as a share of the wheels' slip.
    pub sideways_slip_share: f64,
    /// A bearing whose normalised innovation squared exceeds this is refused (chi-square, one degree of freedom; 10.8 is 0.1 %).
    pub gate: f64,
    /// A step's bearings are refused, the worst first, until their joint normalised innovation squared is at most `gate` and this
    /// much for each bearing after the first. Wrong matches may each fit a wide belief; together they do not.
    pub joint_gate: f64,
    /// Landmarks in the state at most.
    pub max_landmarks: usize,
    /// Home is adopted once its position is known to this share of its distance, or to `adopt_sd_m`.
    pub adopt_sd_share: f64,
    /// Home is adopted once its position is known to this, m, or to `adopt_sd_share`.
    pub adopt_sd_m: f64,
    /// Rivals of the adopted hypothesis must be worse by this much (log likelihood).
    pub adopt_margin: f64,
    /// Steps in a row with more bearings refused than used, after which the filter gives its belief up.
    pub patience_steps: u32,
    /// Steps that the smoother looks back on at most; later on the filter runs alone.
    pub history_steps: usize,
}

impl Default for FilterSettings {
    fn default() -> Self {
        Self {
            inverse_range_mean: 0.4,
            inverse_range_sd: 0.4,
            speed_noise_share: 0.04,
            speed_noise_m_s: 0.003,
            turn_noise_share: 0.04,
            turn_noise_rad_m: 0.03,
            sideways_noise_share: 0.01,
            track_m: 0.25,
            camera_offset_m: [0.0; 2],
            slip_share: 0.3,
            slip_persistence: 0.6,
            sideways_slip_share: 0.3,
            gate: 10.8,
            joint_gate: 4.0,
            max_landmarks: 60,
            adopt_sd_share: 0.06,
            adopt_sd_m: 0.04,
            adopt_margin: 5.0,
            patience_steps: 8,
            history_steps: 200,
        }
    }
}

impl FilterSettings {
    /// Prior of a landmark whose direction from the anchor is measured and whose inverse range is supposed.
    fn prior(&self, from_anchor: &Bearing, inverse_range: f64) -> Prior {
        Prior {
            mean: [from_anchor.azimuth_rad, inverse_range],
            variance: [from_anchor.sd_rad * from_anchor.sd_rad, self.inverse_range_sd * self.inverse_range_sd],
        }
    }
}

/// What a step did with its bearings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepReport {
    /// Bearings that updated the belief.
    pub matched: usize,
    /// Bearings refused.
    pub rejected: usize,
    /// Normalised innovation squared of the used bearings, all together.
    pub nis: f64,
}

/// A bearing this near to where it is expected, rad, agrees with the map: a reading of another place lies elsewhere by far.
const ABOUT_RAD: f64 = 0.1;
/// Farthest from the first anchor at which landmarks are still added to it, m: farther off a first bearing says little about
/// the direction from the anchor.
const FIRST_ANCHOR_REACH_M: f64 = 0.5;
/// Standard deviation of the supposed direction of a landmark added to the first anchor, rad.
const FIRST_ANCHOR_DIRECTION_SD: f64 = 0.7;
/// Share of a landmark's stored bearings that may miss the gate before the smoother drops the landmark.
const MISFIT_SHARE: f64 = 0.3;
/// Steps between two runs of the smoother, as this part of those stored. Over seeds 1 to 1000 on the paths of seeds 0, 1, 5 and 8
/// in `lab` (`wayhome bound`), the greatest mean NEES of a step in which all runs have an estimate is 3.27 with a run in every step
/// and with 24, 4.21 with 12 and 6.68 with 6.
const REBUILD_SHARE: usize = 24;
/// Times that the smoother is run at most, each time without what did not fit the time before.
const SMOOTHER_ROUNDS: usize = 4;
/// Greatest mean squared normalised residual of a solution that is believed; above the lesser one, its covariance grows with it.
const GREATEST_MEAN_SQUARE: f64 = 5.0;
const USUAL_MEAN_SQUARE: f64 = 1.2;

/// How well a robot that was carried off must be found on the map, m; else the search begins anew.
const RELOCATION_SD_M: f64 = 0.15;
/// A step whose squared Mahalanobis distance from odometry exceeds this slipped (chi-square, three degrees of freedom; 0.1 %).
const SLIP_GATE: f64 = 16.3;

/// How the robot came here from the step before.
#[derive(Debug, Clone, Copy)]
struct Moved {
    /// Where it was believed to be then.
    before: Pose,
    motion: Motion,
    /// Whether the bearings asked for more noise than the motion had.
    loosened: bool,
}

/// One stored step: motion since the step before, bearings that were used, pose in the anchor frame.
#[derive(Debug, Clone)]
struct Stored {
    motion: Motion,
    bearings: Vec<Bearing>,
    pose: Pose,
}

#[derive(Debug, Clone, Copy)]
enum Stage {
    /// `guess`: home in the first anchor's frame, by the best hypothesis.
    Search { guess: Option<Pose> },
    /// Steps stored when the smoother runs next.
    Homing { next_rebuild: usize },
}

/// The filter.
#[derive(Debug, Clone)]
pub struct AnchoredFilter {
    settings: FilterSettings,
    lever: Lever,
    home: BTreeMap<LandmarkId, Bearing>,
    stage: Stage,
    map: Map,
    history: Vec<Stored>,
    slip: SlipWatch,
    /// Where home may be, in the first anchor's frame, likeliest first; empty once home is found.
    hypotheses: Vec<Hypothesis>,
    bad_steps: u32,
    steady_steps: u32,
    greatest_slip_m: f64,
    restarts: u32,
}

impl AnchoredFilter {
    /// A filter that knows the snapshot and nothing else.
    #[must_use]
    pub fn new(settings: FilterSettings, home: &HomeSnapshot) -> Self {
        Self {
            settings,
            lever: Lever::new(settings.camera_offset_m),
            home: home.bearings.iter().map(|b| (b.id, *b)).collect(),
            stage: Stage::Search { guess: None },
            map: Map::at_anchor(),
            history: Vec::new(),
            slip: SlipWatch::default(),
            hypotheses: Vec::new(),
            bad_steps: 0,
            steady_steps: 0,
            greatest_slip_m: 0.0,
            restarts: 0,
        }
    }

    /// Forgets all but the snapshot: the search begins anew here.
    pub fn restart(&mut self) {
        self.stage = Stage::Search { guess: None };
        self.map = Map::at_anchor();
        self.history.clear();
        self.hypotheses.clear();
        self.bad_steps = 0;
        self.steady_steps = 0;
        self.restarts += 1;
    }

    /// Where the camera at home may be, in the frame of the first camera, likeliest first; empty once home is found. One of them
    /// is adopted when it is sharp and the others explain the snapshot worse by a margin.
    #[must_use]
    pub fn hypotheses(&self) -> &[Hypothesis] {
        &self.hypotheses
    }

    /// How often the filter gave its belief up.
    #[must_use]
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// The robot's pose in the home frame with its covariance, once home is found. There is none while what is seen contradicts
    /// the belief for more than a step: the filter is lost then, until it finds itself on its map or home anew.
    #[must_use]
    pub fn estimate(&self) -> Option<Estimate> {
        (matches!(self.stage, Stage::Homing { .. }) && self.bad_steps <= 1)
            .then(|| self.lever.axle_estimate(&self.map.estimate()))
    }

    /// Steps in a row that the bearings have borne out the estimate.
    #[must_use]
    pub fn steady_steps(&self) -> u32 {
        self.steady_steps
    }

    /// How far a step of the run lay from what the wheels told of it beyond what is usual of wheels, at most, m, by the last run of the
    /// smoother.
    #[must_use]
    pub fn greatest_slip_m(&self) -> f64 {
        self.greatest_slip_m
    }

    /// The robot's pose in the home frame by the best hypothesis; no covariance is claimed.
    #[must_use]
    pub fn best_pose(&self) -> Option<Pose> {
        match self.stage {
            Stage::Search { guess } => guess.map(|home| self.lever.axle_pose(&home.to_local(&self.map.pose()))),
            Stage::Homing { .. } => Some(self.lever.axle_pose(&self.map.pose())),
        }
    }

    /// The robot's pose on the map, whatever that is anchored at: the first pose while home is searched for, then home.
    #[must_use]
    pub fn map_pose(&self) -> Pose {
        self.lever.axle_pose(&self.map.pose())
    }

    /// How many of `bearings` are of landmarks that the map holds, and how many of these lie about where the map expects them after
    /// this odometry.
    #[must_use]
    pub fn agreement(&self, odometry: &Odometry, bearings: &[Bearing]) -> (usize, usize) {
        let axle = Motion::from_odometry(odometry, 0.0, &self.settings);
        let pose = self.map.pose().compose(&self.lever.camera_motion(&axle).delta);
        self.map.agreement(&pose, bearings, ABOUT_RAD)
    }

    /// Time update and measurement update.
    pub fn step(&mut self, odometry: &Odometry, bearings: &[Bearing]) -> StepReport {
        let slip_m_s = self.slip.expect(odometry, &self.settings);
        let axle = Motion::from_odometry(odometry, slip_m_s, &self.settings);
        let before = self.map.pose();
        let mut moved = Moved { before, motion: self.lever.camera_motion(&axle), loosened: false };
        if odometry.dt_s > 0.0 {
            self.map.predict(&moved.motion);
            if let Some(more) = self.contradiction(&before, &axle, odometry.dt_s, bearings) {
                self.map.loosen(&before, &more);
                moved.motion.covariance += more;
                moved.loosened = true;
            }
        }
        match self.stage {
            Stage::Search { .. } => self.search(moved, bearings),
            Stage::Homing { .. } => self.track(moved, bearings),
        }
    }

    /// Noise that the step needs on top of its own for the bearings to fit: the first of [`LOOSENINGS`] that does about as well
    /// as the best of them. `None` where most bearings fit anyway, or none of them makes most fit.
    fn contradiction(&self, before: &Pose, axle: &Motion, dt_s: f64, bearings: &[Bearing]) -> Option<Matrix3<f64>> {
        let loosened = |by| self.lever.camera_covariance(axle.delta.heading, &axle.loosened(by, dt_s, &self.settings));
        let [a, b, c] = LOOSENINGS.map(loosened);
        let tried = [Matrix3::zeros(), a, b, c];
        let (held, fits) = self.map.count_fits(bearings, before, &tried, self.settings.gate);
        let best = fits.into_iter().max()?;
        let mostly = |fits: usize| 4 * fits >= 3 * held;
        if 2 * fits[0] >= held || !mostly(best) || best < fits[0] + 3.max(held / 5) {
            return None;
        }
        let rung = fits.iter().position(|&fits| 10 * fits >= 9 * best)?;
        Some(tried[rung])
    }

    fn search(&mut self, moved: Moved, bearings: &[Bearing]) -> StepReport {
        let mut report = self.search_update(moved, bearings);
        if self.map.seen_now() < 3 && bearings.len() >= 6 {
            // The landmarks that the anchor held on to are gone; begin again with those in view.
            self.restart();
            report = self.search_update(moved, bearings);
        }
        self.seek_home();
        report
    }

    fn search_update(&mut self, moved: Moved, bearings: &[Bearing]) -> StepReport {
        let mut update = self.map.update(bearings, &self.settings, 3, moved.loosened, false);
        let pose = self.map.pose();
        if pose.position().norm() <= FIRST_ANCHOR_REACH_M {
            let room = self.map.make_room(update.strangers.len(), self.settings.max_landmarks);
            for bearing in spread_over_azimuth(&update.strangers, room) {
                if !self.home.contains_key(&bearing.id) {
                    continue;
                }
                let supposed = Bearing {
                    azimuth_rad: wrap(pose.heading + bearing.azimuth_rad),
                    sd_rad: FIRST_ANCHOR_DIRECTION_SD,
                    ..bearing
                };
                let prior = self.settings.prior(&supposed, self.settings.inverse_range_mean);
                self.add(&prior, &bearing, &mut update);
            }
        }
        self.store(moved.motion, &update);
        StepReport { matched: update.used.len(), rejected: update.rejected, nis: update.nis }
    }

    fn add(&mut self, prior: &Prior, bearing: &Bearing, update: &mut Update) {
        if self.map.add(prior, bearing, &self.settings) {
            update.used.push(*bearing);
        } else {
            update.rejected += 1;
        }
    }

    fn store(&mut self, motion: Motion, update: &Update) {
        if self.history.len() < self.settings.history_steps {
            self.history.push(Stored { motion, bearings: update.used.clone(), pose: self.map.pose() });
        }
    }

    fn track(&mut self, mut moved: Moved, bearings: &[Bearing]) -> StepReport {
        let mut update = self.map.update(bearings, &self.settings, 2, moved.loosened, true);
        if update.contradicted && self.bad_steps > 0 {
            let stood = self.map.clone();
            if self.relocate(bearings) {
                let found = self.map.pose();
                let relocated = self.map.update(bearings, &self.settings, 3, true, true);
                if relocated.contradicted {
                    self.map = stood;
                } else {
                    update = relocated;
                    moved.motion = Motion { delta: moved.before.to_local(&found), covariance: Matrix3::identity() };
                    self.steady_steps = 0;
                }
            }
        }
        self.bad_steps = if update.contradicted { self.bad_steps + 1 } else { 0 };
        self.steady_steps = if update.contradicted { 0 } else { self.steady_steps + 1 };
        if self.bad_steps > self.settings.patience_steps {
            self.restart();
            return self.search(moved, bearings);
        }
        let updated = update.used.len();
        if !update.contradicted {
            self.adopt_strangers(&mut update);
        }
        self.store(moved.motion, &update);
        if let Stage::Homing { next_rebuild } = self.stage
            && self.history.len() >= next_rebuild
            && next_rebuild <= self.settings.history_steps
        {
            self.rebuild();
            // The older the run, the less one more step changes where its bearings are linearised.
            self.stage = Stage::Homing { next_rebuild: self.history.len() + self.history.len().div_ceil(REBUILD_SHARE) };
        }
        StepReport { matched: updated, rejected: update.rejected, nis: update.nis }
    }

    /// Adds landmarks of the snapshot that are seen and not yet in the map.
    fn adopt_strangers(&mut self, update: &mut Update) {
        let room = self.map.make_room(update.strangers.len(), self.settings.max_landmarks);
        for bearing in spread_over_azimuth(&update.strangers, room) {
            let Some(home) = self.home.get(&bearing.id) else { continue };
            match self.map.triangulated_prior(home, &bearing, &self.settings) {
                Some(prior) => self.add(&prior, &bearing, update),
                None => {
                    update.rejected += 1;
                    self.map.ban(bearing.id, 3);
                }
            }
        }
    }

    /// Looks for the robot on the map by what it sees now, wherever it was believed to be. The map is not to be used where the bearings
    /// contradict it even then.
    fn relocate(&mut self, bearings: &[Bearing]) -> bool {
        let sightings = self.map.sightings(bearings);
        let pose = self.map.pose();
        let found = resect(&sightings, pose.position(), Some(pose));
        let Some(best) = found.first() else { return false };
        let unrivalled = found.get(1).is_none_or(|second| second.cost - best.cost > self.settings.adopt_margin);
        let inliers: Vec<_> =
            sightings.iter().filter(|s| s.normalised_squared(&best.pose) <= self.settings.gate).copied().collect();
        let enough = inliers.len() >= 5 && 10 * inliers.len() >= 6 * sightings.len();
        if !unrivalled || !enough || position_sd_m(&inliers, &best.pose) > RELOCATION_SD_M {
            return false;
        }
        self.map.relocate(&best.pose, 1.0, 1.0);
        true
    }

    /// Looks for home; moves on to the second stage once the answer is sharp and without rival.
    fn seek_home(&mut self) {
        let members: Vec<(LandmarkId, resection::Sighting)> = self
            .map
            .ids()
            .enumerate()
            .filter_map(|(k, id)| {
                let home = self.home.get(&id)?;
                let (mean, covariance) = self.map.landmark(k);
                let sighting = resection::Sighting {
                    direction_rad: mean[0],
                    inverse_range: mean[1],
                    covariance,
                    bearing_rad: home.azimuth_rad,
                    variance: home.sd_rad * home.sd_rad,
                };
                Some((id, sighting))
            })
            .collect();
        let sightings: Vec<_> = members.iter().map(|m| m.1).collect();
        let Stage::Search { guess } = self.stage else { return };
        let robot = self.map.pose().position();
        self.hypotheses = resect(&sightings, robot, guess);
        let Some(best) = self.hypotheses.first().copied() else { return };
        self.stage = Stage::Search { guess: Some(best.pose) };
        let unrivalled = self.hypotheses.get(1).is_none_or(|second| second.cost - best.cost > self.settings.adopt_margin);
        let inliers: Vec<_> =
            members.iter().filter(|m| m.1.normalised_squared(&best.pose) <= self.settings.gate).copied().collect();
        if !unrivalled || inliers.len() < 3 || 3 * inliers.len() < 2 * members.len() {
            return;
        }
        let sharp_sd = self.sharp_sd((best.pose.position() - robot).norm());
        let inlier_sightings: Vec<_> = inliers.iter().map(|m| m.1).collect();
        if position_sd_m(&inlier_sightings, &best.pose) > sharp_sd {
            return;
        }
        let ids: Vec<_> = inliers.iter().map(|m| m.0).collect();
        let start = Iterate {
            poses: self.history.iter().map(|s| best.pose.to_local(&s.pose)).collect(),
            landmarks: inliers.iter().map(|m| from_home(&m.1, &best.pose)).collect(),
        };
        let supposed = best.pose.to_local(&self.map.pose()).position();
        let Some((ids, solution, motions)) = self.smooth(ids, start) else { return };
        let sharp = |e: &Estimate| e.position_sd_m() <= self.sharp_sd(e.range_m());
        let Some((mean, covariance)) = solution.last() else { return };
        let candidate = Map::from_solution(&ids, mean, covariance);
        let estimate = candidate.estimate();
        if ids.len() < 3 || !sharp(&estimate) || (estimate.pose.position() - supposed).norm() > 4.0 * sharp_sd {
            return;
        }
        self.map = candidate;
        self.keep(&solution, motions);
        self.bad_steps = 0;
        self.steady_steps = 0;
        self.hypotheses.clear();
        self.stage = Stage::Homing { next_rebuild: self.history.len() + 1 };
    }

    /// How well the robot's place must be known at this distance from home, m.
    fn sharp_sd(&self, range_m: f64) -> f64 {
        (self.settings.adopt_sd_share * range_m).max(self.settings.adopt_sd_m)
    }

    fn keep(&mut self, solution: &Solution, motions: Vec<Motion>) {
        for ((stored, pose), motion) in self.history.iter_mut().zip(&solution.at.poses).zip(motions) {
            stored.pose = *pose;
            stored.motion = motion;
        }
        // Beyond what is usual for wheels that turn, and change their speed, as much.
        let (settings, axle) = (&self.settings, |camera: Pose| self.lever.axle_pose(&camera));
        let slip = |steps: &[Stored]| {
            let (past, told) = (axle(steps[1].motion.delta), axle(steps[2].motion.delta));
            let went = axle(steps[1].pose.to_local(&steps[2].pose)).position();
            let length = told.position().norm();
            let turned = 0.5 * settings.track_m * wrap(told.heading - past.heading).abs();
            let changed = (length - past.position().norm()).abs() + turned;
            (went - told.position()).norm() - 3.0 * (settings.speed_noise_share * length + settings.slip_share * changed)
        };
        self.greatest_slip_m = self.history.windows(3).map(slip).fold(0.0, f64::max);
    }

    /// Builds the map of the second stage anew from all that is stored.
    fn rebuild(&mut self) {
        let ids: Vec<_> = self.map.ids().collect();
        let held = ids.len();
        let start = Iterate {
            poses: self.history.iter().map(|s| s.pose).collect(),
            landmarks: (0..ids.len()).map(|k| self.map.landmark(k).0).collect(),
        };
        if let Some((kept, solution, motions)) = self.smooth(ids, start)
            && kept.len() >= 3
            && 2 * kept.len() > held
            && let Some((mean, covariance)) = solution.last()
        {
            self.map.replace(&kept, mean, covariance);
            self.keep(&solution, motions);
        }
    }

    /// Smooths the history with the given landmarks, drops bearings and landmarks that do not fit, loosens steps in which the
    /// wheels must have slipped, and smooths again. `None` where no believable solution comes out.
    fn smooth(&self, mut ids: Vec<LandmarkId>, mut start: Iterate) -> Option<(Vec<LandmarkId>, Solution, Vec<Motion>)> {
        let gate = self.settings.gate;
        let mut motions: Vec<Motion> = self.history.iter().map(|stored| stored.motion).collect();
        let mut refused: Vec<(usize, LandmarkId)> = Vec::new();
        for round in 1..=SMOOTHER_ROUNDS {
            let index: BTreeMap<LandmarkId, usize> = ids.iter().enumerate().map(|(k, id)| (*id, k)).collect();
            // The ranges of one room are alike: together their priors may say no more about the scale than one of them does.
            // Scale is for odometry to tell.
            let priors: Vec<Prior> = ids
                .iter()
                .map(|id| {
                    let mut prior = self.settings.prior(&self.home[id], self.settings.inverse_range_mean);
                    prior.variance[1] *= ids.len() as f64;
                    prior
                })
                .collect();
            let frames: Vec<Frame> = self
                .history
                .iter()
                .enumerate()
                .map(|(f, stored)| Frame {
                    motion: motions[f],
                    sightings: stored
                        .bearings
                        .iter()
                        .filter(|b| !refused.contains(&(f, b.id)))
                        .filter_map(|b| {
                            let landmark = *index.get(&b.id)?;
                            Some(Sighting { landmark, azimuth_rad: b.azimuth_rad, variance: b.sd_rad * b.sd_rad })
                        })
                        .collect(),
                })
                .collect();
            // Wrong matches are told apart first, then what is left is taken at its word.
            let heavy_tails = round == 1;
            let stretch = Stretch { frames: &frames, priors: &priors, heavy_tails };
            let mut solution = stretch.solve(start)?;
            let mut seen = vec![(0_usize, 0_usize); ids.len()];
            let mut clean = true;
            for (motion, &squared) in motions.iter_mut().zip(&solution.motions_squared) {
                if !heavy_tails && squared > SLIP_GATE {
                    motion.covariance *= squared / 3.0;
                    clean = false;
                }
            }
            let sightings = frames.iter().enumerate().flat_map(|(f, frame)| frame.sightings.iter().map(move |s| (f, s)));
            for ((f, s), &squared) in sightings.zip(&solution.residuals_squared) {
                seen[s.landmark].0 += 1;
                if squared > gate {
                    seen[s.landmark].1 += 1;
                    refused.push((f, ids[s.landmark]));
                    clean = false;
                }
            }
            let keeps = |k: usize| {
                let (total, misses) = seen[k];
                let off = wrap(solution.at.landmarks[k][0] - priors[k].mean[0]);
                misses as f64 <= MISFIT_SHARE * total as f64 && off * off <= gate * priors[k].variance[0]
            };
            let kept: Vec<usize> = (0..ids.len()).filter(|&k| keeps(k)).collect();
            if !heavy_tails && (clean || round == SMOOTHER_ROUNDS) && kept.len() == ids.len() {
                let squares = &solution.residuals_squared;
                let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
                // The variance factor of an adjustment: the room tells how exact its bearings are.
                if mean > USUAL_MEAN_SQUARE {
                    solution.scatter = mean;
                }
                return (mean <= GREATEST_MEAN_SQUARE).then_some((ids, solution, motions));
            }
            start = Iterate {
                poses: solution.at.poses.clone(),
                landmarks: kept.iter().map(|&k| solution.at.landmarks[k]).collect(),
            };
            ids = kept.iter().map(|&k| ids[k]).collect();
            if ids.len() < 3 {
                return None;
            }
        }
        None
    }
}

/// (direction, inverse range) from home of a landmark known from the first anchor.
fn from_home(sighting: &resection::Sighting, home: &Pose) -> [f64; 2] {
    let g: Vector2<f64> = direction(sighting.direction_rad) - home.position() * sighting.inverse_range;
    let inverse_range = (sighting.inverse_range / g.norm().max(1e-6)).clamp(0.02, 5.0);
    [wrap(angle_of(g) - home.heading), inverse_range]
}

/// At most `count` of the bearings, chosen so that they cover the azimuths evenly; of one sector the surest first.
fn spread_over_azimuth(bearings: &[Bearing], count: usize) -> Vec<Bearing> {
    const SECTORS: usize = 24;
    if bearings.len() <= count {
        return bearings.to_vec();
    }
    let mut sectors: Vec<Vec<Bearing>> = vec![Vec::new(); SECTORS];
    for b in bearings {
        let turn = b.azimuth_rad / std::f64::consts::TAU + 0.5;
        sectors[((turn * SECTORS as f64) as usize).min(SECTORS - 1)].push(*b);
    }
    for sector in &mut sectors {
        sector.sort_by(|a, b| a.sd_rad.total_cmp(&b.sd_rad).then(a.id.cmp(&b.id)));
    }
    let deepest = sectors.iter().map(Vec::len).max().unwrap_or(0);
    (0..deepest).flat_map(|depth| sectors.iter().filter_map(move |s| s.get(depth).copied())).take(count).collect()
}
