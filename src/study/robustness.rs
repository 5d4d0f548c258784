//! How success falls as one thing after another gets worse: the built-in study `robustness`, on any world and with any setup.
//!
//! Along each of four axes one condition gets worse level by level while the others stay as they are, and every level runs the same
//! seeds: the same starts, and with them the same draws wherever the condition leaves them alone.

use std::ops::RangeInclusive;
use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use strum::{Display, EnumMessage, IntoStaticStr, VariantArray};

use super::pool::Pool;
use super::row::Ending;
use super::sweep::{Row, Study, Value, run as run_chunks};
use super::tally::Tally;
use crate::episode::{Setup, SetupRecord};
use crate::error::{Error, Result};
use crate::world::World;

/// What gets worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Display, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Axis {
    /// Share of the home landmarks that are never seen on the way, 0 to 70 %.
    Hidden,
    /// Friction of the whole floor, 0.8 to 0.1.
    Friction,
    /// Share of bearings that are false matches, on top of those that the sensor makes itself, 0 to 40 %.
    FalseMatches,
    /// Standard deviation of the noise that is added to bearings, 0.05 to 2 degrees.
    Noise,
}

impl Axis {
    /// The setting that the study varies.
    fn setting(self) -> &'static str {
        match self {
            Self::Hidden => "hidden_share",
            Self::Friction => "floor_friction",
            Self::FalseMatches => "false_match_share",
            Self::Noise => "added_noise_deg",
        }
    }

    /// A value of the setting in the axis' own unit.
    fn level(self, value: &Value) -> Option<f64> {
        let percent = matches!(self, Self::Hidden | Self::FalseMatches);
        Some(value.number()? * if percent { 100.0 } else { 1.0 })
    }
}

/// One level of one axis in numbers.
#[derive(Debug, Clone, Serialize)]
pub struct Cell {
    /// Axis.
    pub axis: Axis,
    /// Level in the axis' unit.
    pub level: f64,
    /// Its runs.
    #[serde(flatten)]
    pub tally: Tally,
}

/// The study in numbers.
#[derive(Debug, Clone, Serialize)]
pub struct Robustness {
    /// First and last seed.
    pub seeds: [u64; 2],
    /// Axis by axis, level by level.
    pub cells: Vec<Cell>,
    /// The parts and settings that all runs share.
    pub setup: SetupRecord,
    /// What rendered: "cpu" or "gpu"; `None` for a sensor without a camera.
    pub renderer: Option<String>,
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file.
    pub world_sha256: String,
    /// Version of this program.
    pub version: &'static str,
}

/// The study on the world that a person named, with these of its axes, all where none is named, and these seeds.
///
/// # Errors
/// When no seed is given, the setup has a degradation of its own, or the world or the setup has faults.
pub fn study(world: &str, setup: &Setup, axes: &[Axis], seeds: &RangeInclusive<u64>) -> Result<Study> {
    let invalid = |what: &str, found: &str, allowed: &str| {
        Err(Error::Invalid { what: what.into(), found: found.into(), allowed: allowed.into() })
    };
    if seeds.is_empty() {
        return invalid("seeds", "none", "at least one");
    }
    if !setup.degradation.is_none() {
        return invalid("degradation of the setup", "some", "none: the study sets it level by level");
    }
    let study = Study::open("robustness", Some(seeds.clone()))?;
    let wanted = |setting: &str| axes.is_empty() || axes.iter().any(|axis| axis.setting() == setting);
    study.based_on(world, setup, wanted)
}

/// Runs all levels of a [`study()`]. `watch` is told of each run's end, from all threads. The result depends on the study alone.
///
/// # Errors
/// What a run fails with, or that the pool was stopped.
pub fn run(study: &Study, pool: &Pool<'_>, watch: &(dyn Fn(&Row) + Sync)) -> Result<Robustness> {
    let kept: Mutex<Vec<Row>> = Mutex::default();
    run_chunks(study, &(0..study.chunks()).collect::<Vec<_>>(), pool, &kept, watch)?;
    let mut rows = kept.into_inner().unwrap_or_else(PoisonError::into_inner);
    rows.sort_by_key(|row| row.episode);
    if let Some(row) = rows.iter().find(|row| matches!(row.run.outcome, Ending::Error | Ending::Panic)) {
        let (what, found) = (format!("run of seed {}", row.run.seed), row.run.reason.clone());
        return Err(Error::Unfit { what, found, needed: "a world and a setup in which every run can be run".into() });
    }
    let mut cells = Vec::new();
    for &axis in Axis::VARIANTS {
        let Some(k) = study.axes.iter().position(|varied| varied.setting == axis.setting()) else { continue };
        for value in study.axes[k].levels.listed() {
            let Some(level) = axis.level(value) else { continue };
            let runs = rows.iter().filter(|row| row.values[k] == *value).map(|row| &row.run);
            cells.push(Cell { axis, level, tally: Tally::of(runs) });
        }
    }
    let world = World::open(&study.world)?;
    Ok(Robustness {
        seeds: [*study.seeds.start(), *study.seeds.end()],
        cells,
        setup: SetupRecord::new(study.base(), &world),
        renderer: rows.iter().find_map(|row| row.run.renderer.clone()),
        world: world.spec.name.clone(),
        world_sha256: world.sha256,
        version: crate::VERSION,
    })
}

#[cfg(all(test, feature = "rapier"))]
mod tests {
    use super::*;
    use crate::episode::SensorKind;
    use crate::method::MethodKind;
    use crate::sensor::Degradation;
    use crate::study::seeds::run_seeds;

    #[test]
    fn wrong_claims_are_those_outside_the_arrival_radius() {
        let world = World::open("lab").unwrap();
        let setup = Setup { sensor: SensorKind::Ideal, method: MethodKind::Alv, ..Setup::default() };
        let study = study("lab", &setup, &[Axis::Noise], &(1..=8)).unwrap();
        let result = run(&study, &Pool::new(1), &|_| ()).unwrap();
        let worst = result.cells.last().unwrap();
        let degradation = Degradation { noise_sd_rad: 2.0_f64.to_radians(), ..Degradation::default() };
        let runs = run_seeds(&world, &Setup { degradation, ..setup }, 1..=8, &Pool::new(1), &|_| ()).unwrap();
        let wrong = runs.iter().filter(|r| r.claimed_home && r.final_distance_m > world.spec.task.arrival_radius_m);
        let off_cm: Vec<f64> = wrong.map(|r| 100.0 * r.final_distance_m).collect();
        assert!(off_cm.iter().any(|cm| (5.0..15.0).contains(cm)), "a claim off by little counts, too: {off_cm:?}");
        assert_eq!(worst.tally.wrong_claims, off_cm.len());
    }

    #[test]
    fn one_condition_changes_and_all_others_stay() {
        let setup = Setup { sensor: SensorKind::Ideal, ..Setup::default() };
        let all = study("slippery", &setup, &[], &(1..=1)).unwrap();
        assert_eq!((all.cells(), all.chunks()), (8 + 7 + 5 + 6, 26));
        let world = World::open("slippery").unwrap();
        let (icy, usual) = all.case(&all.values(8 + 6), 1).unwrap();
        assert!(icy.zones.is_empty() && icy.bodies == world.bodies && icy.wall_textures == world.wall_textures);
        assert_eq!((icy.friction_at(world.home.position()), &usual), (0.1, &setup), "ice, and nothing else");
        let (dry, hidden) = all.case(&all.values(7), 1).unwrap();
        assert_eq!((dry, hidden.degradation.hidden), (world, 0.7));
        let named = study("lab", &setup, &[Axis::FalseMatches, Axis::Hidden], &(1..=3)).unwrap();
        let result = run(&named, &Pool::new(2), &|_| ()).unwrap();
        assert_eq!(result.cells.iter().map(|cell| cell.axis).collect::<Vec<_>>()[7..9], [Axis::Hidden, Axis::FalseMatches]);
        let (best, worst) = (&result.cells[0].tally, &result.cells[12].tally);
        assert_eq!((best.home, best.runs, best.wrong_claims), (3, 3, 0));
        assert!(worst.home <= best.home, "40 % false matches among a dozen landmarks do not help");
        assert_eq!(best, &result.cells[8].tally, "with no fault added both axes begin with the same runs");
        let spoilt = Setup { degradation: Degradation { hidden: 0.1, ..Degradation::default() }, ..setup };
        assert!(study("lab", &spoilt, &[], &(1..=3)).is_err());
    }
}
