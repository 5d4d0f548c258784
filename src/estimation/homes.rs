//! Several homes at once, for rooms in which things look alike.
//!
//! A view that several motions from home explain leaves several answers to where home is. Each is held by an [`AnchoredFilter`] of its
//! own, which gets the reading of the view that agrees with what it believes; a reading that agrees with none begins another. The
//! answer that explains most of the views leads, and the robot drives to it. Arrived, the [whole view](View) is held against the
//! snapshot: at a home that only looks like it, part of the view is home's and the rest is not. What was seen there is the
//! [verdict](Homes::judge) on that answer, and the next one leads.

use std::collections::{BTreeSet, VecDeque};
use std::f64::consts::TAU;

use super::anchored::{AnchoredFilter, FilterSettings, StepReport};
use crate::geometry::{Pose, Vector2, wrap};
use crate::observation::{Bearing, HomeSnapshot, LandmarkId, Odometry};

/// Answers held at once.
const MOST: usize = 4;
/// Steps over which the support of an answer is averaged.
const SUPPORT_STEPS: f64 = 8.0;
/// Another answer leads when its support is this many times the leader's.
const TAKES_LEAD: f64 = 1.25;
/// An answer that no reading agreed with for so many steps is no rival, ...
const SILENT_STEPS: u32 = 8;
/// ... and for so many is dropped.
const FORGOTTEN_STEPS: u32 = 40;
/// Steps after which an answer counts as a rival: what one view brings forth is often gone in the next.
const RIPE_STEPS: u32 = 10;
/// Landmarks of a reading that a map must hold to say anything of it.
const ENOUGH: usize = 6;
/// Two answers nearer to one another than this, m and rad, are one; and so are two homes, in spite of the drift of odometry.
const SAME: f64 = 0.4;
/// Home landmarks for each sector of the snapshot, and sectors at most.
const SECTORS: (usize, usize) = (10, 12);
/// Steps on the way to a home whose sightings count together: what someone hid in one of them shows in another.
const LATELY: usize = 20;

/// Share of home's landmarks from which on the view is home's, whatever else may look like it. Seen in 274 runs in generated rooms that
/// nothing was claimed for: 0.52 to 0.89 at home, in nine of ten 0.6 and more; 0.13 to 0.54 at 23 other places.
const WHOLE: f64 = 0.64;
/// The same where no other answer is seen.
const MOSTLY: f64 = 0.53;
/// Unevenness up to which what is missing is missing by chance.
const EVEN: f64 = 4.0;
/// ... if at least this share of them is seen; a third of it below.
const LEAST: f64 = 0.2;
/// Unevenness up to which people who stand around explain it: of 25 runs in a crowd one showed more, 15.9.
const CROWDED: f64 = 14.0;
/// Share of home's landmarks from which on people may hide the rest, ...
const HIDDEN: f64 = 0.37;
/// ... if this share of them was seen lately. In the crowd it is 0.73 to 0.82, on the way to other places 0.40 to 0.70 but for two.
const MET: f64 = 0.73;
/// The same, however uneven the view is.
const SURELY_MET: f64 = 0.8;
/// A rival counts if its reading has this share of the landmarks of the leader's.
const STRONG: f64 = 0.25;
/// Two homes whose views agree with home's as well as this, one over the other, cannot be told apart.
const ALIKE: f64 = 0.85;

/// How much of what was seen at home is seen now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Share of the snapshot's landmarks.
    pub share: f64,
    /// Scatter of that share over the sectors of the snapshot: chi-square per degree of freedom. About 1 where landmarks are missing
    /// by chance, far above where one part of the view is home's and another is not.
    pub unevenness: f64,
    /// Share of the snapshot's landmarks that was seen in one of the last steps.
    pub lately: f64,
}

impl View {
    /// Whether this can be home seen through what has come since.
    fn may_be_home(&self) -> bool {
        let crowded = self.lately >= MET && self.unevenness < CROWDED || self.lately >= SURELY_MET;
        let hidden_by_people = self.share >= HIDDEN && crowded;
        let by_chance = self.unevenness < if self.share >= LEAST { EVEN } else { EVEN / 3.0 };
        self.share >= MOSTLY && self.unevenness < CROWDED || by_chance || hidden_by_people
    }
}

/// What the view from a supposed home says of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// This is home.
    Home,
    /// It is not, or another place has to be looked at first.
    Doubtful,
    /// Another place looks as much like home.
    Ambiguous,
}

/// What was found at a supposed home.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Found {
    /// Share of home's landmarks.
    share: f64,
    /// Whether it may be home all the same.
    possible: bool,
}

impl Found {
    /// Sorts places by how likely they are home.
    fn worth(&self) -> f64 {
        self.share + f64::from(u8::from(self.possible))
    }
}

/// An answer to where home is.
#[derive(Debug, Clone)]
struct Answer {
    filter: AnchoredFilter,
    /// Mean number of bearings that agreed with it, over the last steps.
    support: f64,
    /// Steps since a reading agreed with it.
    silent_steps: u32,
    /// Steps since it was made.
    steps: u32,
    /// Landmarks of the last readings that did, the latest last.
    seen: VecDeque<BTreeSet<LandmarkId>>,
    /// What was found at its home; `None` where that was not looked at yet.
    visited: Option<Found>,
}

impl Answer {
    fn new(settings: FilterSettings, home: &HomeSnapshot) -> Self {
        let filter = AnchoredFilter::new(settings, home);
        Self { filter, support: 0.0, silent_steps: 0, steps: 0, seen: VecDeque::new(), visited: None }
    }

    fn step(&mut self, odometry: &Odometry, reading: &[Bearing]) -> StepReport {
        let first = self.support == 0.0;
        let weight = if first { 1.0 } else { 1.0 / SUPPORT_STEPS };
        self.support += weight * (reading.len() as f64 - self.support);
        self.silent_steps = if reading.is_empty() { self.silent_steps + 1 } else { 0 };
        self.steps += 1;
        if self.seen.len() == LATELY {
            self.seen.pop_front();
        }
        self.seen.push_back(reading.iter().map(|b| b.id).collect());
        self.filter.step(odometry, reading)
    }

    /// Whether it is seen now, and its home was not looked at yet.
    fn is_open(&self) -> bool {
        self.visited.is_none() && self.silent_steps <= SILENT_STEPS
    }

    /// Whether it says the same as `other`.
    fn is_as(&self, other: &Self) -> bool {
        match (self.filter.estimate(), other.filter.estimate()) {
            (Some(a), Some(b)) => {
                (a.pose.position() - b.pose.position()).norm() < SAME && wrap(a.pose.heading - b.pose.heading).abs() < SAME
            }
            _ => false,
        }
    }
}

/// The answers.
#[derive(Debug, Clone)]
pub struct Homes {
    settings: FilterSettings,
    home: HomeSnapshot,
    /// The leader first.
    answers: Vec<Answer>,
    /// Where the robot has come by odometry alone.
    odometry: Pose,
    /// Homes that were looked at, in the frame of odometry.
    places: Vec<(Vector2<f64>, Found)>,
}

impl Homes {
    /// One answer, which knows the snapshot and nothing else.
    #[must_use]
    pub fn new(settings: FilterSettings, home: &HomeSnapshot) -> Self {
        Self {
            settings,
            home: home.clone(),
            answers: vec![Answer::new(settings, home)],
            odometry: Pose::IDENTITY,
            places: Vec::new(),
        }
    }

    /// The filter of the answer that leads.
    #[must_use]
    pub fn leader(&self) -> &AnchoredFilter {
        &self.answers[0].filter
    }

    /// The same, to change it.
    pub fn leader_mut(&mut self) -> &mut AnchoredFilter {
        &mut self.answers[0].filter
    }

    /// Whether all answers that are seen now were looked at, and none can be home.
    #[must_use]
    pub fn are_exhausted(&self) -> bool {
        self.answers[0].visited.is_some_and(|found| !found.possible) && !self.answers.iter().any(Answer::is_open)
    }

    /// Time update and measurement update of all answers. Returns what the leader's did.
    pub fn step(&mut self, odometry: &Odometry, bearings: &[Bearing], alternatives: &[Vec<Bearing>]) -> StepReport {
        let readings: Vec<&[Bearing]> = std::iter::once(bearings).chain(alternatives.iter().map(Vec::as_slice)).collect();
        let given = self.distribute(odometry, &readings);
        let mut report = StepReport::default();
        for (k, (answer, reading)) in self.answers.iter_mut().zip(&given).enumerate() {
            let did = answer.step(odometry, reading.map_or(&[], |r| readings[r]));
            if k == 0 {
                report = did;
            }
        }
        for (r, reading) in readings.iter().enumerate() {
            if reading.is_empty() || given.contains(&Some(r)) || !self.make_room() {
                continue;
            }
            let mut answer = Answer::new(self.settings, &self.home);
            answer.step(odometry, reading);
            self.answers.push(answer);
        }
        self.odometry = self.odometry.advanced(odometry.twist, odometry.dt_s);
        self.recognise();
        self.tidy();
        self.elect();
        report
    }

    /// Whether there is room for another answer, after one that no reading agreed with made way.
    fn make_room(&mut self) -> bool {
        if self.answers.len() < MOST {
            return true;
        }
        let silent = |k: &usize| self.answers[*k].visited.is_none() && self.answers[*k].silent_steps > 1;
        let gone = (1..MOST).filter(silent).max_by_key(|&k| self.answers[k].silent_steps);
        gone.map(|k| self.answers.remove(k)).is_some()
    }

    /// The number of the reading that each answer gets, by how many of its bearings lie where the answer expects them.
    fn distribute(&self, odometry: &Odometry, readings: &[&[Bearing]]) -> Vec<Option<usize>> {
        let mut given = vec![None; self.answers.len()];
        let alone = self.answers.len() == 1 && self.answers[0].visited.is_none();
        if alone && readings.len() == 1 {
            return vec![Some(0)];
        }
        // (fits, answer, reading)
        let mut pairs: Vec<(usize, usize, usize)> = Vec::new();
        for (a, answer) in self.answers.iter().enumerate() {
            for (r, reading) in readings.iter().enumerate() {
                let (held, fits) = answer.filter.agreement(odometry, reading);
                if fits >= 3 && 2 * fits >= held {
                    pairs.push((fits, a, r));
                } else if a == 0 && r == 0 && held < ENOUGH && answer.visited.is_none() {
                    // Hardly a landmark of it is on the map: nothing speaks against it either.
                    pairs.push((0, a, r));
                }
            }
        }
        pairs.sort_by_key(|&(fits, a, r)| (std::cmp::Reverse(fits), a, r));
        for (_, a, r) in pairs {
            if given[a].is_none() && !given.contains(&Some(r)) {
                given[a] = Some(r);
            }
        }
        if alone && given[0].is_none() {
            // It has nothing to go by yet, or was carried off: its filter deals with both.
            given[0] = Some(0);
        }
        given
    }

    /// Where an answer has home, in the frame of odometry.
    fn place(&self, answer: &Answer) -> Option<Vector2<f64>> {
        let robot = answer.filter.estimate()?.pose;
        Some(self.odometry.compose(&robot.to_local(&Pose::IDENTITY)).position())
    }

    /// An answer that leads to a place that was looked at is no new one.
    fn recognise(&mut self) {
        for k in 0..self.answers.len() {
            let Some(at) = self.place(&self.answers[k]) else { continue };
            if let Some((_, found)) = self.places.iter().find(|(place, _)| (place - at).norm() < SAME) {
                self.answers[k].visited = Some(*found);
            }
        }
    }

    /// Drops what is forgotten, and of two answers that have become one the weaker.
    fn tidy(&mut self) {
        let mut k = 1;
        while k < self.answers.len() {
            let forgotten = self.answers[k].silent_steps > FORGOTTEN_STEPS && self.answers[k].visited.is_none();
            let twin = (0..k).any(|j| self.answers[j].is_as(&self.answers[k]));
            if forgotten || twin {
                self.answers.remove(k);
            } else {
                k += 1;
            }
        }
    }

    /// Puts the answer first that is to be driven to: of those not looked at yet the one with most support, else the one whose home
    /// looked most like home.
    fn elect(&mut self) {
        let better = |a: &usize, b: &usize| self.answers[*a].support.total_cmp(&self.answers[*b].support).then(b.cmp(a));
        let heard = |k: &usize| self.answers[*k].silent_steps <= SILENT_STEPS;
        let best = (0..self.answers.len()).filter(|&k| self.answers[k].is_open()).max_by(better);
        let next = match best {
            Some(k) if k > 0 => {
                let (rival, leader) = (&self.answers[k], &self.answers[0]);
                (leader.visited.is_some() || rival.support > TAKES_LEAD * leader.support).then_some(k)
            }
            Some(_) => None,
            None => {
                let looked = |k: &usize| self.answers[*k].visited.map_or(0.0, |found| found.worth());
                let best = (0..self.answers.len()).filter(heard).max_by(|a, b| looked(a).total_cmp(&looked(b)).then(b.cmp(a)));
                best.filter(|&k| k > 0)
            }
        };
        if let Some(k) = next {
            self.answers.swap(0, k);
        }
    }

    /// What of home's view the leader's last readings have.
    #[must_use]
    pub fn view(&self) -> View {
        let leader = &self.answers[0];
        let count = self.home.bearings.len();
        let sectors = (count / SECTORS.0).clamp(2, SECTORS.1);
        let mut parts = vec![(0.0, 0.0); sectors];
        for bearing in &self.home.bearings {
            let part = &mut parts[((bearing.azimuth_rad / TAU + 1.0) * sectors as f64) as usize % sectors];
            part.0 += 1.0;
            part.1 += f64::from(u8::from(leader.seen.back().is_some_and(|seen| seen.contains(&bearing.id))));
        }
        let of_all = |seen: f64| seen / (count as f64).max(1.0);
        let share = of_all(parts.iter().map(|p| p.1).sum::<f64>());
        let scatter = |&(n, seen): &(f64, f64)| {
            let off: f64 = seen - n * share;
            off * off / (n * share * (1.0 - share)).max(1e-9)
        };
        let held: Vec<f64> = parts.iter().filter(|p| p.0 > 0.0).map(scatter).collect();
        let lately: BTreeSet<_> = leader.seen.iter().flatten().collect();
        View {
            share,
            unevenness: held.iter().sum::<f64>() / held.len().saturating_sub(1).max(1) as f64,
            lately: of_all(lately.len() as f64),
        }
    }

    /// Asks, where the leader says to be home, whether the whole view agrees. A home that is doubtful counts as looked at, and another
    /// answer leads if there is one.
    pub fn judge(&mut self) -> Verdict {
        if self.answers[0].silent_steps > 0 {
            return Verdict::Doubtful; // this view says nothing
        }
        let view = self.view();
        let here = self.place(&self.answers[0]);
        let elsewhere = |place: &Vector2<f64>| here.is_none_or(|here| (place - here).norm() >= SAME);
        let others = self.places.iter().filter(|(place, found)| found.possible && elsewhere(place));
        let others = others.map(|(_, found)| found.share).fold(0.0, f64::max);
        let possible = view.may_be_home();
        let rivalled = self.rival_support() >= STRONG * view.share * self.home.bearings.len() as f64;
        if view.share >= WHOLE || possible && !rivalled && others < ALIKE * view.share {
            return Verdict::Home;
        }
        if possible && !rivalled && others * ALIKE <= view.share {
            return Verdict::Ambiguous;
        }
        self.close(Found { share: view.share, possible });
        Verdict::Doubtful
    }

    /// Gives the leader up as a place that cannot be reached, if there is another one.
    pub fn pass_over(&mut self) {
        if self.rival_support() > 0.0 {
            self.close(Found { share: 0.0, possible: false });
        }
    }

    /// Writes down what was found at the leader's home; another answer leads if there is one.
    fn close(&mut self, found: Found) {
        if let Some(at) = self.place(&self.answers[0]) {
            self.places.retain(|(place, _)| (place - at).norm() >= SAME);
            self.places.push((at, found));
        }
        self.answers[0].visited = Some(found);
        self.elect();
    }

    /// Greatest support of a ripe answer beside the leader that is seen now and whose home was not looked at.
    fn rival_support(&self) -> f64 {
        let ripe = |a: &&Answer| a.is_open() && a.steps >= RIPE_STEPS;
        self.answers[1..].iter().filter(ripe).map(|a| a.support).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::angle_of;
    use crate::observation::Bearing;

    /// Landmarks on a ring of radius 3 m, every three degrees, and the bearings of those that `sees` lets through from `pose`.
    fn see(pose: &Pose, sees: impl Fn(u32) -> bool) -> Vec<Bearing> {
        let bearing = |k: u32| {
            let at = crate::geometry::direction(TAU * f64::from(k) / 120.0) * 3.0;
            Bearing { id: LandmarkId(k), azimuth_rad: angle_of(pose.inverse_transform(at)), sd_rad: 0.002 }
        };
        (0..120).filter(|&k| sees(k)).map(bearing).collect()
    }

    /// Drives from 2 m off to home, seeing what `sees` lets through.
    fn driven_home(sees: impl Fn(u32) -> bool) -> Homes {
        let mut homes = Homes::new(FilterSettings::default(), &HomeSnapshot { bearings: see(&Pose::IDENTITY, |_| true) });
        let twist = crate::geometry::Twist { v: 0.25, omega: 0.0 };
        let mut pose = Pose::new(-2.0, 0.3, -0.15);
        homes.step(&Odometry::default(), &see(&pose, &sees), &[]);
        for _ in 0..80 {
            pose = pose.advanced(twist, 0.1);
            homes.step(&Odometry { twist, dt_s: 0.1 }, &see(&pose, &sees), &[]);
        }
        assert!(homes.leader().estimate().is_some());
        homes
    }

    fn verdict(sees: impl Fn(u32) -> bool) -> (Verdict, View) {
        let mut homes = driven_home(sees);
        (homes.judge(), homes.view())
    }

    /// As much as is seen here was seen at another place that may be home: nothing tells the two apart. Where less was seen there, this
    /// is home.
    #[test]
    fn two_places_that_look_alike_are_ambiguous() {
        let judged = |share: f64| {
            let mut homes = driven_home(|k| (k * 7919) % 10 < 4);
            homes.places.push((Vector2::new(0.0, 3.0), Found { share, possible: true }));
            homes.judge()
        };
        assert_eq!([0.4, 0.3].map(judged), [Verdict::Ambiguous, Verdict::Home]);
    }

    #[test]
    fn home_is_claimed_where_the_whole_view_or_an_even_part_of_it_is_seen() {
        assert_eq!(verdict(|_| true).0, Verdict::Home);
        let (verdict, view) = verdict(|k| (k * 7919) % 10 < 4);
        assert_eq!(verdict, Verdict::Home, "what is missing is missing by chance: {view:?}");
        assert!((view.share - 0.4).abs() < 0.02 && view.unevenness < 1.5, "{view:?}");
    }

    /// A wall that repeats itself makes a place look like home on one side only.
    #[test]
    fn a_place_that_looks_like_home_on_one_side_is_denied() {
        let (verdict, view) = verdict(|k| k < 50);
        assert_eq!(verdict, Verdict::Doubtful, "{view:?}");
        assert!(view.unevenness > EVEN && (view.share - 50.0 / 120.0).abs() < 1e-12, "{view:?}");
    }

    /// Two readings of all views, by landmarks of the one and of the other half of the room: home here, and home 1 m to the left.
    /// Each has an answer of its own, which leads where it explains more.
    #[test]
    fn two_readings_of_a_view_are_two_answers() {
        let mut homes = Homes::new(FilterSettings::default(), &HomeSnapshot { bearings: see(&Pose::IDENTITY, |_| true) });
        let twist = crate::geometry::Twist { v: 0.2, omega: 0.1 };
        let beside = Pose::new(0.0, 1.0, 0.0);
        let mut pose = Pose::new(-1.5, -0.4, 0.3);
        for step in 0..60 {
            let odometry = if step == 0 { Odometry::default() } else { Odometry { twist, dt_s: 0.1 } };
            let (one, other) = (see(&pose, |k| k < 70), see(&beside.to_local(&pose), |k| k >= 70));
            homes.step(&odometry, &one, &[other]);
            pose = pose.advanced(twist, 0.1);
        }
        let found: Vec<Pose> = homes.answers.iter().filter_map(|a| a.filter.estimate()).map(|e| e.pose).collect();
        assert_eq!(found.len(), 2, "{found:?}");
        let apart = (found[0].position() - found[1].position()).norm();
        assert!((apart - 1.0).abs() < 0.1, "{found:?}");
        assert!((homes.answers[0].support, homes.answers[1].support) == (70.0, 50.0));
    }
}
