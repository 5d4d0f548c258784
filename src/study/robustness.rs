//! How success falls as one thing after another gets worse.
//!
//! The study has four axes: landmarks that are never seen, a slippery floor, false matches and noisy bearings. Along each of
//! them one condition gets worse level by level while the others stay as they are, and every level runs the same seeds: the
//! same starts, and with them the same draws wherever the condition leaves them alone.

use std::ops::RangeInclusive;

use serde::Serialize;
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use super::pool::Pool;
use super::row::RunRow;
use super::seeds::run_seeds;
use super::tally::Tally;
use crate::episode::{Setup, SetupRecord};
use crate::error::{Error, Result};
use crate::sensor::Degradation;
use crate::world::World;

/// What gets worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Axis {
    /// Share of the home landmarks that are never seen on the way, 0 to 70 %.
    Hidden,
    /// Coulomb friction of the drive wheels on the whole floor, 0.8 to 0.1.
    Friction,
    /// Share of bearings that are false matches, 0 to 40 %, on top of those that the sensor makes itself.
    FalseMatches,
    /// Standard deviation of the noise that is added to bearings, 0.05 to 2 degrees.
    Noise,
}

impl Axis {
    /// All axes in the order of the report.
    pub const ALL: [Self; 4] = [Self::Hidden, Self::Friction, Self::FalseMatches, Self::Noise];

    /// Name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Levels from good to bad, in the axis' own unit.
    #[must_use]
    pub fn levels(self) -> &'static [f64] {
        match self {
            Self::Hidden => &[0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0],
            Self::Friction => &[0.8, 0.6, 0.4, 0.3, 0.2, 0.15, 0.1],
            Self::FalseMatches => &[0.0, 10.0, 20.0, 30.0, 40.0],
            Self::Noise => &[0.05, 0.1, 0.3, 0.5, 1.0, 2.0],
        }
    }

    fn condition(self, level: f64) -> Condition {
        let mut condition = Condition::default();
        match self {
            Self::Hidden => condition.degradation.hidden = level / 100.0,
            Self::Friction => condition.friction = Some(level),
            Self::FalseMatches => condition.degradation.false_match = level / 100.0,
            Self::Noise => condition.degradation.noise_sd_rad = level.to_radians(),
        }
        condition
    }
}

/// What a level changes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Condition {
    /// Friction of the whole floor; `None` for the world's own.
    friction: Option<f64>,
    degradation: Degradation,
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

/// How many batches of seeds a study of `axes` runs. Levels of two axes that are the same condition are run once.
#[must_use]
pub fn batches(axes: &[Axis]) -> usize {
    let mut known: Vec<Condition> = Vec::new();
    for (axis, level) in cells(axes) {
        let condition = axis.condition(level);
        if !known.contains(&condition) {
            known.push(condition);
        }
    }
    known.len()
}

fn cells(axes: &[Axis]) -> impl Iterator<Item = (Axis, f64)> + '_ {
    axes.iter().flat_map(|&axis| axis.levels().iter().map(move |&level| (axis, level)))
}

/// Runs all levels of `axes` on all seeds. `watch` is told of each run's end. The result depends on the world, the setup, the axes and
/// the seeds alone.
///
/// # Errors
/// When no axis or no seed is given, the setup has a degradation of its own, a run fails, or the pool is stopped.
pub fn run(
    world: &World,
    setup: &Setup,
    axes: &[Axis],
    seeds: &RangeInclusive<u64>,
    pool: &Pool<'_>,
    watch: &(dyn Fn(Axis, f64) + Sync),
) -> Result<Robustness> {
    let invalid = |what: &str, found: &str, allowed: &str| {
        Err(Error::Invalid { what: what.into(), found: found.into(), allowed: allowed.into() })
    };
    if axes.is_empty() {
        return invalid("axes", "none", "at least one");
    }
    if seeds.is_empty() {
        return invalid("seeds", "none", "at least one");
    }
    if !setup.degradation.is_none() {
        return invalid("degradation of the setup", "some", "none: the study sets it level by level");
    }
    let mut done: Vec<(Condition, Vec<RunRow>)> = Vec::new();
    let mut table = Vec::new();
    for (axis, level) in cells(axes) {
        let condition = axis.condition(level);
        let known = done.iter().position(|(c, _)| *c == condition);
        let place = match known {
            Some(place) => place,
            None => {
                let rows = run_condition(world, setup, &condition, seeds, pool, &|| watch(axis, level))?;
                done.push((condition, rows));
                done.len() - 1
            }
        };
        table.push(Cell { axis, level, tally: Tally::of(&done[place].1) });
    }
    let renderer = done.iter().flat_map(|(_, runs)| runs).find_map(|r| r.renderer.clone());
    Ok(Robustness {
        seeds: [*seeds.start(), *seeds.end()],
        cells: table,
        setup: SetupRecord::new(setup, world),
        renderer,
        world: world.spec.name.clone(),
        world_sha256: world.sha256.clone(),
        version: crate::VERSION,
    })
}

fn run_condition(
    world: &World,
    setup: &Setup,
    condition: &Condition,
    seeds: &RangeInclusive<u64>,
    pool: &Pool<'_>,
    watch: &(dyn Fn() + Sync),
) -> Result<Vec<RunRow>> {
    let setup = Setup { degradation: condition.degradation, ..setup.clone() };
    let floored = condition.friction.map(|friction| with_friction(world, friction)).transpose()?;
    let runs = run_seeds(floored.as_ref().unwrap_or(world), &setup, seeds.clone(), pool, &|_| watch())?;
    Ok(runs.iter().map(RunRow::from).collect())
}

/// The same world with one friction everywhere.
fn with_friction(world: &World, friction: f64) -> Result<World> {
    let mut spec = world.spec.clone();
    spec.floor.friction = friction;
    spec.floor.zones.clear();
    World::from_spec(&spec, &world.source)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::SensorKind;
    use crate::method::MethodKind;

    #[test]
    fn a_friction_holds_everywhere_and_changes_nothing_else() {
        let world = World::open("slippery").unwrap();
        assert!(!world.zones.is_empty());
        let icy = with_friction(&world, 0.1).unwrap();
        assert_eq!(icy.friction_at(world.home.position()), 0.1);
        assert!(icy.zones.is_empty() && icy.bodies == world.bodies && icy.wall_textures == world.wall_textures);
    }

    #[test]
    fn wrong_claims_are_those_outside_the_arrival_radius() {
        let world = World::open("lab").unwrap();
        let setup = Setup { sensor: SensorKind::Ideal, method: MethodKind::Alv, ..Setup::default() };
        let study = run(&world, &setup, &[Axis::Noise], &(1..=8), &Pool::new(1), &|_, _| ()).unwrap();
        let worst = study.cells.last().unwrap();
        let noisy =
            Setup { degradation: Degradation { noise_sd_rad: 2.0_f64.to_radians(), ..Degradation::default() }, ..setup };
        let runs = run_seeds(&world, &noisy, 1..=8, &Pool::new(1), &|_| ()).unwrap();
        let wrong = runs.iter().filter(|r| r.claimed_home && r.final_distance_m > world.spec.task.arrival_radius_m);
        let off_cm: Vec<f64> = wrong.map(|r| 100.0 * r.final_distance_m).collect();
        assert!(off_cm.iter().any(|cm| (5.0..15.0).contains(cm)), "a claim off by little counts, too: {off_cm:?}");
        assert_eq!(worst.tally.wrong_claims, off_cm.len());
    }

    #[test]
    fn levels_worsen_and_are_run_once() {
        assert_eq!(batches(&Axis::ALL), 8 + 7 + 5 + 6 - 1, "nothing hidden and no false match are one condition");
        let world = World::open("lab").unwrap();
        let setup = Setup { sensor: SensorKind::Ideal, ..Setup::default() };
        let axes = [Axis::Hidden, Axis::FalseMatches];
        let count = std::sync::atomic::AtomicUsize::new(0);
        let study = |threads| {
            run(&world, &setup, &axes, &(1..=3), &Pool::new(threads), &|_, _| {
                count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            })
            .unwrap()
        };
        let one = study(1);
        assert_eq!(count.into_inner(), 3 * batches(&axes));
        assert_eq!(one.cells.len(), 13);
        let (best, worst) = (&one.cells[0].tally, &one.cells[12].tally);
        assert_eq!((best.home, best.runs, best.wrong_claims), (3, 3, 0));
        assert!(worst.home <= best.home, "40 % false matches among a dozen landmarks do not help");
        // With no fault added, both axes begin with the same batch.
        assert_eq!(
            (best.final_distance_m, best.time_ratio),
            (one.cells[8].tally.final_distance_m, one.cells[8].tally.time_ratio)
        );
    }
}
