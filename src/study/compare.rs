//! Every method from the same starts: who comes home, how fast, and from where.
//!
//! Contenders share plant, sensor, speed and starts; what each is told beside bearings and odometry differs and is stated. Beside
//! random starts there are those on an even grid, all with one heading: the share from which a method arrives is its catchment area, and
//! for methods that have a homing vector at standstill the mean angle between it and the direction of home is its AAE.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use serde::Serialize;

use super::pool::Pool;
use super::row::RunRow;
use super::seeds::{Job, run_jobs};
use super::tally::{Spread, Tally};
use crate::control::Law;
use crate::control::vectors::{VectorLaw, align};
use crate::episode::{Outcome, PlantKind, SensorKind, Setup, SetupRecord, Simulation, Summary};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2, angle_of, wrap};
use crate::method::MethodKind;
use crate::method::exec::ExecCommand;
use crate::random::Seed;
use crate::world::World;
use crate::world::polygon::{anticlockwise, bounds, contains};

/// A method with what it is told.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contender {
    /// Its name in files and on the command line.
    pub key: Cow<'static, str>,
    /// The method.
    pub method: MethodKind,
    /// What steers it.
    pub law: Law,
    /// Whether it has a compass.
    pub compass: bool,
    /// Whether it is told the true start.
    pub told_start: bool,
}

const fn contender(key: &'static str, method: MethodKind, law: Law) -> Contender {
    Contender { key: Cow::Borrowed(key), method, law, compass: false, told_start: false }
}

const fn with_compass(key: &'static str, method: MethodKind) -> Contender {
    Contender { key: Cow::Borrowed(key), method, law: Law::Proportional, compass: true, told_start: false }
}

const fn told(key: &'static str, law: Law) -> Contender {
    Contender { key: Cow::Borrowed(key), method: MethodKind::PaperEkf, law, compass: false, told_start: true }
}

/// All contenders that the project brings, in the order of tables.
pub const CONTENDERS: [Contender; 14] = [
    contender("anchored-ekf", MethodKind::AnchoredEkf, Law::Proportional),
    contender("anchored-ekf-lyapunov", MethodKind::AnchoredEkf, Law::Lyapunov),
    told("paper-ekf-told", Law::Proportional),
    told("paper-ekf-told-lyapunov", Law::Lyapunov),
    contender("paper-ekf", MethodKind::PaperEkf, Law::Proportional),
    contender("paper-ekf-lyapunov", MethodKind::PaperEkf, Law::Lyapunov),
    contender("alv", MethodKind::Alv, Law::Proportional),
    with_compass("alv-compass", MethodKind::Alv),
    contender("tron-daniilidis", MethodKind::TronDaniilidis, Law::Proportional),
    with_compass("tron-daniilidis-compass", MethodKind::TronDaniilidis),
    contender("weber", MethodKind::Weber, Law::Proportional),
    with_compass("weber-compass", MethodKind::Weber),
    contender("ibvs", MethodKind::Ibvs, Law::Proportional),
    with_compass("ibvs-compass", MethodKind::Ibvs),
];

impl Contender {
    /// A program of the user's own, the `number`th of a comparison. It has a compass where one is asked for.
    pub fn program(number: usize, command: ExecCommand, compass: bool) -> Self {
        let key = Cow::Owned(format!("exec-{number}"));
        Self { key, method: MethodKind::Exec(command), law: Law::Proportional, compass, told_start: false }
    }

    /// The law of its homing vector; `None` for filters, which have none at standstill.
    pub fn vector_law(&self) -> Option<VectorLaw> {
        match self.method {
            MethodKind::AnchoredEkf | MethodKind::PaperEkf | MethodKind::Exec(_) => None,
            MethodKind::Alv => Some(VectorLaw::Alv),
            MethodKind::TronDaniilidis => Some(VectorLaw::TronDaniilidis),
            MethodKind::Weber => Some(VectorLaw::Weber),
            MethodKind::Ibvs => Some(VectorLaw::Ibvs),
        }
    }

    /// `setup` with this contender's method.
    fn setup(&self, setup: &Setup) -> Setup {
        Setup {
            method: self.method.clone(),
            law: self.law,
            compass_sd_rad: if self.compass { Some(setup.compass_sd_rad.unwrap_or(0.0)) } else { None },
            told_start: self.told_start,
            ..setup.clone()
        }
    }
}

/// A start of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GridStart {
    /// x in the room, m.
    pub x_m: f64,
    /// y in the room, m.
    pub y_m: f64,
    /// How the run from here ended.
    pub outcome: Outcome,
    /// Direction of the homing vector in the room, rad; `None` for a filter, or where too few landmarks are in view.
    pub vector_rad: Option<f64>,
    /// Angle between it and the direction of home, rad.
    pub vector_error_rad: Option<f64>,
}

/// What a contender came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standing {
    /// Who.
    pub contender: Contender,
    /// Its runs from random starts.
    #[serde(flatten)]
    pub tally: Tally,
    /// Path length over straight distance, of the runs that came home.
    pub path_ratio: Spread,
    /// Mean angle between homing vector and direction of home over the grid, rad; `None` for filters.
    pub aae_rad: Option<f64>,
    /// Share of the grid's starts from which it came home; `None` without a grid.
    pub catchment_share: Option<f64>,
    /// The grid's starts.
    pub grid: Vec<GridStart>,
}

/// A comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file.
    pub world_sha256: String,
    /// Version of this program.
    pub version: &'static str,
    /// First and last seed of the random starts.
    pub seeds: [u64; 2],
    /// Distance between the grid's starts, m; `None` without a grid.
    pub grid_spacing_m: Option<f64>,
    /// Heading of all starts of the grid, rad in the room.
    pub grid_heading_rad: f64,
    /// What all share; method, law, compass and start are the contenders' own.
    pub plant: PlantKind,
    /// Where bearings come from.
    pub bearings: SensorKind,
    /// Cruising speed, m/s.
    pub speed_m_s: f64,
    /// Arrival radius, m.
    pub arrival_radius_m: f64,
    /// Time limit, s.
    pub time_limit_s: f64,
    /// All contenders.
    pub standings: Vec<Standing>,
}

/// Heading of the grid's starts relative to home, rad: a little over a quarter turn, so that no alignment comes for free.
const GRID_HEADING_RAD: f64 = 2.0;

/// Runs all `contenders` on the same starts: one random one a seed, and about `places` on an even grid over the start region. `watch` is
/// told of each run's end.
///
/// # Errors
/// What a run fails with, or that the pool was stopped.
pub fn compare(
    world: &World,
    setup: &Setup,
    contenders: &[Contender],
    seeds: &RangeInclusive<u64>,
    places: usize,
    pool: &Pool<'_>,
    watch: &(dyn Fn(&Contender) + Sync),
) -> Result<Comparison> {
    let heading = wrap(world.home.heading + GRID_HEADING_RAD);
    let (grid_spacing_m, grid) = grid_starts(world, places, heading);
    let mut starts: Vec<(u64, Option<Pose>)> = seeds.clone().map(|seed| (seed, None)).collect();
    let random = starts.len();
    starts.extend((1..).zip(grid.iter().copied().map(Some)));
    let setups: Vec<Setup> = contenders.iter().map(|contender| contender.setup(setup)).collect();
    let cases: Vec<(&World, &Setup)> = setups.iter().map(|setup| (world, setup)).collect();
    let jobs = (0..cases.len()).flat_map(|case| starts.iter().map(move |&(seed, start)| Job { case, seed, start }));
    let runs = run_jobs(&cases, &jobs.collect::<Vec<_>>(), pool, &|job, _| watch(&contenders[job.case]))?;
    let mut standings = Vec::new();
    for ((contender, own), runs) in contenders.iter().zip(&setups).zip(runs.chunks(starts.len())) {
        let rows: Vec<RunRow> = runs.iter().map(RunRow::from).collect();
        let vectors = vectors(world, own, contender, &grid)?;
        standings.push(Standing::new(contender, &rows[..random], &runs[random..], &vectors));
    }
    let shared = SetupRecord::new(setup, world);
    Ok(Comparison {
        world: world.spec.name.clone(),
        world_sha256: world.sha256.clone(),
        version: crate::VERSION,
        seeds: [*seeds.start(), *seeds.end()],
        grid_spacing_m,
        grid_heading_rad: heading,
        plant: shared.plant,
        bearings: shared.bearings,
        speed_m_s: shared.speed_m_s,
        arrival_radius_m: shared.arrival_radius_m,
        time_limit_s: shared.time_limit_s,
        standings,
    })
}

/// How many runs a comparison takes.
pub fn runs(world: &World, contenders: usize, seeds: &RangeInclusive<u64>, places: usize) -> u64 {
    let grid = grid_starts(world, places, 0.0).1.len() as u64;
    contenders as u64 * (seeds.end() - seeds.start() + 1 + grid)
}

/// The free places of an even grid over the start region with about `places` places, and its spacing.
fn grid_starts(world: &World, places: usize, heading: f64) -> (Option<f64>, Vec<Pose>) {
    let start = &world.spec.start;
    let region = start.region_m.as_deref().map_or_else(|| world.outline.clone(), anticlockwise);
    let (low, high) = bounds(&region);
    let size = high - low;
    if places == 0 || size.x <= 0.0 || size.y <= 0.0 {
        return (None, Vec::new());
    }
    let spacing = (size.x * size.y / places as f64).sqrt();
    let count = |length: f64| (length / spacing).round().max(1.0);
    let (columns, rows) = (count(size.x), count(size.y));
    let bodies = world.body_poses();
    let centre = 0.5 * (low + high);
    let at = |k: usize, count: f64, centre: f64| centre + (k as f64 - 0.5 * (count - 1.0)) * spacing;
    let starts = (0..rows as usize)
        .flat_map(|row| (0..columns as usize).map(move |column| (row, column)))
        .map(|(row, column)| Pose::new(at(column, columns, centre.x), at(row, rows, centre.y), heading))
        .filter(|pose| {
            contains(&region, pose.position())
                && (pose.position() - world.home.position()).norm() > 2.0 * world.spec.task.arrival_radius_m
                && world.is_free(pose, start.clearance_m, &bodies).is_ok()
        });
    (Some(spacing), starts.collect())
}

/// Homing vectors at standstill: direction in the room, and angle to the direction of home.
fn vectors(world: &World, setup: &Setup, contender: &Contender, grid: &[Pose]) -> Result<Vec<Option<(f64, f64)>>> {
    let Some(law) = contender.vector_law() else { return Ok(vec![None; grid.len()]) };
    let mut simulation = Simulation::new(world, setup)?;
    let sensor = simulation.sensor();
    sensor.reset(Seed(0))?;
    let home = sensor.home().clone();
    let bodies = world.body_poses();
    let look = |pose: &Pose| -> Result<Option<(f64, f64)>> {
        let seen = sensor.observe(*pose, &bodies)?;
        let pairs: Vec<(f64, f64)> = seen
            .iter()
            .filter_map(|now| Some((home.bearings.iter().find(|h| h.id == now.id)?.azimuth_rad, now.azimuth_rad)))
            .collect();
        if pairs.len() < 2 {
            return Ok(None);
        }
        let turn = sensor.compass_rad(*pose).unwrap_or_else(|| align(&pairs));
        let turned: Vec<(f64, f64)> = pairs.into_iter().map(|(home, now)| (home, now + turn)).collect();
        let from_heading = angle_of(law.vector(&turned)) - turn;
        let in_room = wrap(from_heading + pose.heading);
        let homeward = angle_of(Vector2::new(world.home.x - pose.x, world.home.y - pose.y));
        Ok(Some((in_room, wrap(in_room - homeward).abs())))
    };
    grid.iter().map(look).collect()
}

impl Standing {
    fn new(contender: &Contender, random: &[RunRow], grid: &[Summary], vectors: &[Option<(f64, f64)>]) -> Self {
        let errors: Vec<f64> = vectors.iter().flatten().map(|v| v.1).collect();
        let came = random.iter().filter(|row| row.is_home());
        let grid: Vec<GridStart> = grid
            .iter()
            .zip(vectors)
            .map(|(run, vector)| GridStart {
                x_m: run.start.x,
                y_m: run.start.y,
                outcome: run.outcome,
                vector_rad: vector.map(|v| v.0),
                vector_error_rad: vector.map(|v| v.1),
            })
            .collect();
        let arrived = grid.iter().filter(|start| start.outcome == Outcome::Home).count();
        Self {
            contender: contender.clone(),
            tally: Tally::of(random),
            path_ratio: Spread::of(came.filter_map(|row| Some(row.path_length_m? / row.initial_distance_m?))),
            aae_rad: (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64),
            catchment_share: (!grid.is_empty()).then(|| arrived as f64 / grid.len() as f64),
            grid,
        }
    }
}

/// Picks contenders by key, in the order of [`CONTENDERS`]; all where none is named.
///
/// # Errors
/// When a name is none of theirs.
pub fn pick(names: &[String]) -> Result<Vec<Contender>> {
    let keys = || CONTENDERS.map(|c| c.key).join(", ");
    if let Some(unknown) = names.iter().find(|name| CONTENDERS.iter().all(|c| c.key != name.as_str())) {
        return Err(Error::Invalid { what: "contender".into(), found: unknown.clone(), allowed: keys() });
    }
    Ok(CONTENDERS.into_iter().filter(|c| names.is_empty() || names.iter().any(|n| n.as_str() == c.key)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_run_from_the_same_starts() {
        let world = World::open("paper-ideal").unwrap();
        let setup = Setup { plant: PlantKind::Unicycle, sensor: SensorKind::Ideal, ..Setup::default() };
        let names = ["paper-ekf-told", "alv-compass", "ibvs"].map(str::to_owned);
        let contenders = pick(&names).unwrap();
        let result = compare(&world, &setup, &contenders, &(1..=3), 9, &Pool::new(2), &|_| ()).unwrap();
        let starts = |s: &Standing| s.grid.iter().map(|g| [g.x_m, g.y_m]).collect::<Vec<_>>();
        assert_eq!(result.standings.len(), 3);
        assert!(
            result
                .standings
                .iter()
                .all(|s| s.tally.runs == 3 && starts(s) == starts(&result.standings[0]) && !s.grid.is_empty())
        );
        let told = &result.standings[0];
        assert_eq!((told.tally.home, told.aae_rad), (3, None), "told the truth it arrives");
        // With a compass and exact bearings an average landmark vector is never more than a right angle off.
        let compass = &result.standings[1];
        assert!(compass.grid.iter().all(|g| g.vector_error_rad.unwrap() < 1.6) && compass.aae_rad.unwrap() < 0.8);
        assert!(pick(&["nobody".to_owned()]).is_err());
    }
}
