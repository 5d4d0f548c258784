//! Open loop: a table of commands drives the robot, and nobody looks where it goes.
//!
//! [`Commands`] is the table, checked as a whole before anything moves. [`drive`] runs it on a [`RapierPlant`](crate::physics::RapierPlant) and hands on truth,
//! odometry, wheels and floor contacts side by side, a [`DriveStep`] at a time; [`DriveSummary`] is that in numbers.

use std::ops::{ControlFlow, RangeInclusive};
use std::path::Path;

use serde::Serialize;

use super::parts::Parts;
use super::setup::{PlantKind, Setup, Start};
use super::simulation::Simulation;
use super::summary::CollisionRecord;
use crate::error::{Error, Result};
use crate::geometry::{Pose, Twist, wrap};
use crate::physics::{Collision, Plant, WheelState};
use crate::random::Seed;
use crate::sensor::Blind;
use crate::storage::{io_error, sha256};
use crate::table::Rows;
use crate::world::World;

/// Columns of a command table, in any order.
const COLUMNS: [&str; 3] = ["t_s", "v_m_s", "omega_rad_s"];
/// Least time between two rows, s: a substep of the physics.
const LEAST_INTERVAL_S: f64 = 1e-3;
/// Most control steps of a table: a row of 0.5 kB each.
const MOST_STEPS: f64 = 1e8;
/// Most collisions that a summary lists.
const MOST_LISTED: usize = 1000;
/// Greatest speed and turn rate that a table may ask for; what the robot's limits make of it is the robot's business.
const GREATEST_COMMAND: f64 = 1e3;

/// A checked table of commands. Each row holds from its time until that of the next; the last row is the end, and its command
/// is never driven.
#[derive(Debug, Clone, PartialEq)]
pub struct Commands {
    rows: Vec<(f64, Twist)>,
    sha256: String,
}

impl Commands {
    /// Reads a table from a CSV file.
    ///
    /// # Errors
    /// When the file cannot be read, and as [`Commands::parse`].
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(io_error("read", path))?;
        Self::parse(&text, path)
    }

    /// Reads a table from CSV text with the columns `t_s,v_m_s,omega_rad_s`, in any order. `source` names it in messages.
    ///
    /// # Errors
    /// When a column is missing or unknown, a cell is empty or no finite number, a line is blank in between, the times do not begin at 0 or
    /// do not grow by at least a millisecond, or there are fewer than two rows. The message names line and field.
    pub fn parse(text: &str, source: &Path) -> Result<Self> {
        if let Some(k) = text.trim_end().lines().skip(1).position(|line| line.trim().is_empty()) {
            let message = format!("line {}: found a blank line, expected a row in every line up to the last", k + 2);
            return Err(Error::Parse { path: source.to_owned(), message });
        }
        let table = Rows::parse(text.as_bytes(), source, "command")?;
        let [time, v, omega] = table.exactly(COLUMNS)?;
        let mut rows: Vec<(f64, Twist)> = Vec::new();
        for row in table.rows() {
            let within = |column, expected: &str, range: RangeInclusive<f64>| {
                row.value(column, expected, |cell| cell.parse().ok().filter(|number| range.contains(number)))
            };
            let time_s = match rows.last() {
                None => within(time, "0 in the first row", 0.0..=0.0)?,
                Some((before, _)) => {
                    let least = before + LEAST_INTERVAL_S * (1.0 - 1e-9);
                    let expected = format!("at least {LEAST_INTERVAL_S} more than {before}, the time of the row before");
                    within(time, &expected, least..=f64::MAX)?
                }
            };
            let expected = format!("-{GREATEST_COMMAND} to {GREATEST_COMMAND}");
            let speed = |column| within(column, &expected, -GREATEST_COMMAND..=GREATEST_COMMAND);
            rows.push((time_s, Twist { v: speed(v)?, omega: speed(omega)? }));
        }
        if rows.len() < 2 {
            return Err(table.fault("found 1 row, expected at least 2: the last one only says when the drive ends"));
        }
        Ok(Self { rows, sha256: sha256(text.as_bytes()) })
    }

    /// Time of the last row, s.
    pub fn duration_s(&self) -> f64 {
        self.rows.last().map_or(0.0, |(time_s, _)| *time_s)
    }

    /// The intervals of at most `longest_s` that the table is driven in: their ends, their lengths, and the command held.
    fn intervals(&self, longest_s: f64) -> impl Iterator<Item = (f64, f64, Twist)> + '_ {
        self.rows.windows(2).flat_map(move |pair| {
            let ((from, twist), (to, _)) = (pair[0], pair[1]);
            let count = libm::ceil((to - from) / longest_s - 1e-9).max(1.0);
            let length = (to - from) / count;
            (1..=count as u64).map(move |k| (from + k as f64 * length, length, twist))
        })
    }
}

/// State at the end of an interval of a drive.
#[derive(Debug, Clone, Copy)]
pub struct DriveStep {
    /// Time since the start, s.
    pub time_s: f64,
    /// Command held during the interval that ends here.
    pub command: Twist,
    /// True pose in the room.
    pub truth: Pose,
    /// Pose that the odometry alone leads to, in the room, from the true start.
    pub dead_reckoned: Pose,
    /// Odometry of the interval.
    pub odometry: Twist,
    /// Velocity, wheel speeds, slip, forces and loads; the latter three are means over the interval.
    pub wheels: WheelState,
    /// Collisions that began during the interval.
    pub collisions: u32,
}

/// Is shown each state of a drive with the collisions that led to it, and says whether to go on.
pub type Watch<'a> = dyn FnMut(&DriveStep, &[Collision]) -> Result<ControlFlow<()>> + 'a;

/// Drives `commands` from `start` in `world`, with a state at least every control period of the world's task. `watch` is called
/// with each state, the one at the start included, and the collisions that led to it; it stops the drive with `Break`. Nothing is
/// kept but what the summary needs, so that a drive may last as long as it likes.
///
/// # Errors
/// [`Error::Unfit`] when the table is too long for any disk, [`Error::Interrupted`] when `watch` breaks, and what it fails with.
pub fn drive(world: &World, start: Pose, seed: Seed, commands: &Commands, watch: &mut Watch<'_>) -> Result<DriveSummary> {
    let period_s = world.spec.task.control_period_s;
    if commands.duration_s() / period_s + commands.rows.len() as f64 > MOST_STEPS {
        return Err(Error::Unfit {
            what: "duration of the commands".into(),
            found: format!("{} s", commands.duration_s()),
            needed: format!("{MOST_STEPS} control steps of {period_s} s at most"),
        });
    }
    let mut setup = Setup { start: Start::At(start), ..Setup::default() };
    setup.time_limit_s = Some(f64::INFINITY);
    let parts = Parts::with_sensor(world, PlantKind::Rapier, Box::new(Blind::default()))?;
    let mut simulation = Simulation::from_parts(world, &setup, parts);
    simulation.reset_at(seed.0, start)?;
    let mut last = state(&simulation, 0.0, Twist::default());
    let mut summary = DriveSummary::new(&last, world, commands, seed);
    let mut watch = |step: &DriveStep, collisions: &[Collision]| match watch(step, collisions)? {
        ControlFlow::Break(()) => Err(Error::Interrupted),
        ControlFlow::Continue(()) => Ok(()),
    };
    watch(&last, &[])?;
    for (time_s, length_s, command) in commands.intervals(period_s) {
        simulation.forget();
        let odometry = simulation.step_for(command, Some(length_s))?.0.odometry;
        let step = DriveStep {
            dead_reckoned: last.dead_reckoned.advanced(odometry.twist, odometry.dt_s),
            odometry: odometry.twist,
            ..state(&simulation, time_s, command)
        };
        summary.add(&last, &step, simulation.collisions(), world);
        watch(&step, simulation.collisions())?;
        last = step;
    }
    Ok(summary)
}

/// What is true now; the odometry is none, and what it alone leads to is the truth.
fn state(simulation: &Simulation<'_>, time_s: f64, command: Twist) -> DriveStep {
    DriveStep {
        time_s,
        command,
        truth: simulation.truth(),
        dead_reckoned: simulation.truth(),
        odometry: Twist::default(),
        wheels: simulation.plant().and_then(Plant::wheels).unwrap_or_default(),
        collisions: simulation.collisions().len() as u32,
    }
}

/// A drive in numbers. Depends on the world, the commands, the start and the seed alone.
#[derive(Debug, Clone, Default, Serialize)]
pub struct DriveSummary {
    /// How long it took, s.
    pub time_s: f64,
    /// True pose at the start, in the room.
    pub start: Pose,
    /// True pose at the end.
    pub end: Pose,
    /// Pose at the end by odometry alone.
    pub odometry_end: Pose,
    /// Distance at the end between odometry and truth, m.
    pub odometry_drift_m: f64,
    /// Difference of heading at the end, odometry less truth, rad.
    pub odometry_heading_drift_rad: f64,
    /// Length of the true path, m.
    pub path_length_m: f64,
    /// Greatest true speed of the axle, m/s.
    pub greatest_speed_m_s: f64,
    /// Greatest mean slip speed of a wheel over an interval, m/s.
    pub greatest_slip_m_s: f64,
    /// Contacts with walls and bodies.
    pub collisions: usize,
    /// The first thousand of them.
    pub collision_list: Vec<CollisionRecord>,
    /// Seed of the run.
    pub seed: u64,
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file.
    pub world_sha256: String,
    /// SHA-256 of the command table.
    pub commands_sha256: String,
    /// Version of this program.
    pub version: &'static str,
}

impl DriveSummary {
    /// A drive that has not begun.
    fn new(start: &DriveStep, world: &World, commands: &Commands, seed: Seed) -> Self {
        Self {
            start: start.truth,
            end: start.truth,
            odometry_end: start.dead_reckoned,
            seed: seed.0,
            world: world.spec.name.clone(),
            world_sha256: world.sha256.clone(),
            commands_sha256: commands.sha256.clone(),
            version: crate::VERSION,
            ..Self::default()
        }
    }

    /// The drive has gone on to `step`.
    fn add(&mut self, before: &DriveStep, step: &DriveStep, collisions: &[Collision], world: &World) {
        let [left, right] = step.wheels.floor.slip_m_s;
        self.time_s = step.time_s;
        self.end = step.truth;
        self.odometry_end = step.dead_reckoned;
        self.odometry_drift_m = (step.dead_reckoned.position() - step.truth.position()).norm();
        self.odometry_heading_drift_rad = wrap(step.dead_reckoned.heading - step.truth.heading);
        self.path_length_m += (step.truth.position() - before.truth.position()).norm();
        self.greatest_speed_m_s = self.greatest_speed_m_s.max(step.wheels.velocity_m_s.norm());
        self.greatest_slip_m_s = self.greatest_slip_m_s.max(left.norm()).max(right.norm());
        self.collisions += collisions.len();
        let listed = collisions.len().min(MOST_LISTED - self.collision_list.len());
        self.collision_list.extend(CollisionRecord::list(&collisions[..listed], world));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> std::result::Result<Commands, String> {
        Commands::parse(text, Path::new("c.csv")).map_err(|e| e.to_string())
    }

    #[test]
    fn a_table_is_cut_into_intervals_that_end_at_its_rows() {
        let commands = parse("omega_rad_s, t_s, v_m_s\r\n0,0,0.3\r\n1,0.25,0\r\n0,0.4,0\r\n\r\n").unwrap();
        let intervals: Vec<_> = commands.intervals(0.1).collect();
        assert_eq!(intervals.len(), 5);
        assert!((intervals.iter().map(|(_, length, _)| length).sum::<f64>() - 0.4).abs() < 1e-15);
        assert_eq!((intervals[2].0, intervals[2].2), (0.25, Twist { v: 0.3, omega: 0.0 }));
        assert_eq!((intervals[4].0, intervals[4].2), (0.4, Twist { v: 0.0, omega: 1.0 }));
    }

    #[test]
    fn bad_tables_are_refused_by_line_and_field() {
        let header = "t_s,v_m_s,omega_rad_s\n";
        for (rows, words) in [
            ("0,0,0\n1,NaN,0\n", ["line 3", "v_m_s", "NaN"]),
            ("0,0,0\n1,0,inf\n", ["line 3", "omega_rad_s", "inf"]),
            ("0,0,0\n1,,0\n", ["line 3", "v_m_s", "found ``"]),
            ("0,0,0\n\n1,0,0\n", ["line 3", "row", "blank line"]),
            ("0,0,0\n1,0\n", ["line 3", "found `1,0`", "3 cells"]),
            ("0,0,0\n2,0,0\n1,0,0\n", ["line 4", "t_s", "found `1`"]),
            ("0,0,0\n0,0,0\n", ["line 3", "t_s", "found `0`"]),
            ("0.5,0,0\n1,0,0\n", ["line 2", "t_s", "0 in the first row"]),
            ("0,fast,0\n1,0,0\n", ["line 2", "v_m_s", "`fast`"]),
            ("0,1e9,0\n1,0,0\n", ["line 2", "v_m_s", "1000"]),
            ("0,0,0\n", ["found 1 row", "at least 2", "c.csv"]),
        ] {
            let message = parse(&format!("{header}{rows}")).unwrap_err();
            assert!(words.iter().all(|word| message.contains(word)), "{words:?} in: {message}");
        }
        for (header, word) in [
            ("t_s,v_m_s", "omega_rad_s"),
            ("", "t_s"),
            ("t_s,v_m_s,omega_rad_s,note", "note"),
            ("t_s,v_m_s,v_m_s", "omega_rad_s"),
        ] {
            let message = parse(&format!("{header}\n0,0,0\n1,0,0\n")).unwrap_err();
            assert!(message.contains("line 1") && message.contains(word), "{message}");
        }
    }
}
