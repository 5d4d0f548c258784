//! Files of routes: what a lesson and what repeats leave in their folders.

use std::path::Path;

use serde::Serialize;

use crate::draw::chart::{Axis, Chart};
use crate::draw::map::{MapDrawing, Stroke};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2, sin_cos};
use crate::route::chart::{Line, Route};
use crate::route::measure::{Measures, RepeatRow, RouteFigures};
use crate::route::repeat::Repeat;
use crate::route::store::{Form, to_bytes};
use crate::route::teach::Lesson;
use crate::storage::{OutputFolder, json};
use crate::table::Rows;
use crate::world::World;

/// The route's file in the folder of a lesson.
pub const ROUTE_FILE: &str = "route.bin";
/// The true path of a lesson: for measures, never for the robot.
pub const TRUTH_FILE: &str = "taught.csv";
/// Most repeats that a map shows.
const SHOWN: usize = 12;

/// A trajectory in the TUM format.
fn tum(poses: impl IntoIterator<Item = (f64, Pose)>) -> String {
    use std::fmt::Write;
    let mut text = String::new();
    for (time_s, pose) in poses {
        let (z, w) = sin_cos(0.5 * pose.heading);
        let _ = writeln!(text, "{time_s} {} {} 0 0 0 {z} {w}", pose.x, pose.y);
    }
    text
}

/// Writes what a lesson came to, and tells its figures.
///
/// # Errors
/// When a file cannot be written.
pub fn write_lesson(mut folder: OutputFolder, lesson: &Lesson, form: Form, world: &World) -> Result<RouteFigures> {
    let bytes = to_bytes(&lesson.route, form);
    let figures = RouteFigures::new(&lesson.route, &lesson.truth, bytes.len(), lesson.time_s, lesson.collisions);
    folder.write(ROUTE_FILE, &bytes)?;
    let rows: String = lesson.truth.iter().map(|p| format!("{},{},{}\n", p.x, p.y, p.heading)).collect();
    folder.write(
        TRUTH_FILE,
        format!("# true path of the teach, {} s; for measures only\nx_m,y_m,heading_rad\n{rows}", lesson.time_s).as_bytes(),
    )?;
    folder.write("map.svg", map(world, &lesson.route, &lesson.truth, &[]).as_bytes())?;
    folder.write("summary.json", json(&figures).as_bytes())?;
    folder.finish()?;
    Ok(figures)
}

/// Reads the true path of a lesson and the time that it took, s.
///
/// # Errors
/// When it cannot be read or is none.
pub fn read_truth(path: &Path) -> Result<(Vec<Pose>, f64)> {
    let text = std::fs::read_to_string(path).map_err(crate::storage::io_error("read", path))?;
    let fault = |message: &str| Error::Parse { path: path.to_owned(), message: message.to_owned() };
    let (head, table) = text.split_once('\n').ok_or_else(|| fault("found one line, expected a table below it"))?;
    let time_s = head.split(", ").nth(1).and_then(|rest| rest.split(' ').next()).and_then(|number| number.parse().ok());
    let time_s = time_s.ok_or_else(|| fault("line 1: expected the time that the teach took, in s"))?;
    let table = Rows::parse(table.as_bytes(), path, "pose")?;
    let [x, y, heading] = table.exactly(["x_m", "y_m", "heading_rad"])?;
    let mut poses = Vec::new();
    for row in table.rows() {
        let number = |column| row.value(column, "a finite number", |cell| cell.parse::<f64>().ok().filter(|n| n.is_finite()));
        poses.push(Pose::new(number(x)?, number(y)?, number(heading)?));
    }
    if poses.len() < 2 {
        return Err(fault("found fewer than 2 poses, expected one a node of the route"));
    }
    Ok((poses, time_s))
}

/// Points of a table: CSV with the columns `x_m,y_m`.
///
/// # Errors
/// When it cannot be read, or a cell is no finite number; the message names line and column.
pub fn read_points(path: &Path) -> Result<Vec<Vector2<f64>>> {
    let text = std::fs::read_to_string(path).map_err(crate::storage::io_error("read", path))?;
    let table = Rows::parse(text.as_bytes(), path, "way-point")?;
    let [x, y] = table.exactly(["x_m", "y_m"])?;
    let mut points = Vec::new();
    for row in table.rows() {
        let number = |column| row.value(column, "a finite number", |cell| cell.parse::<f64>().ok().filter(|n| n.is_finite()));
        points.push(Vector2::new(number(x)?, number(y)?));
    }
    Ok(points)
}

/// What `route repeat` came to.
#[derive(Debug, Clone, Serialize)]
pub struct RepeatSummary {
    /// The route.
    pub route: RouteFigures,
    /// All repeats together.
    #[serde(flatten)]
    pub measures: Measures,
    /// How they were driven.
    pub conditions: String,
    /// Version of this program.
    pub version: &'static str,
}

/// Writes what repeats came to.
///
/// # Errors
/// When a file cannot be written.
pub fn write_repeats(
    mut folder: OutputFolder,
    summary: &RepeatSummary,
    rows: &[RepeatRow],
    repeats: &[Repeat],
    lesson: (&World, &Route, &[Pose]),
) -> Result<()> {
    let (world, route, truth) = lesson;
    folder.write("summary.json", json(summary).as_bytes())?;
    folder.write("repeats.csv", csv(rows).as_bytes())?;
    folder.write("map.svg", map(world, route, truth, repeats).as_bytes())?;
    folder.write("cross_track.svg", cross_track(repeats).as_bytes())?;
    folder.write("taught.tum", tum(truth.iter().enumerate().map(|(k, pose)| (k as f64, *pose))).as_bytes())?;
    for repeat in repeats.iter().take(SHOWN) {
        let of = |pose: &dyn Fn(&crate::route::repeat::Row) -> Pose| tum(repeat.rows.iter().map(|row| (row.time_s, pose(row))));
        folder.write(&format!("truth-{}.tum", repeat.seed), of(&|row| row.truth).as_bytes())?;
        folder.write(&format!("believed-{}.tum", repeat.seed), of(&|row| row.believed).as_bytes())?;
    }
    folder.write("README.md", page(summary, rows).as_bytes())?;
    folder.finish()
}

/// One row a repeat.
#[must_use]
pub fn csv(rows: &[RepeatRow]) -> String {
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    let mut text = String::from(
        "seed,outcome,completed,final_error_m,cross_track_mean_m,cross_track_p95_m,cross_track_max_m,heading_error_mean_rad,\
         wall_hits,walker_hits,legs,wrong_legs,length_m,time_s\n",
    );
    for row in rows {
        let cells = [
            row.seed.to_string(),
            row.outcome.to_owned(),
            row.completed.to_string(),
            row.final_error_m.to_string(),
            number(row.cross_track_mean_m),
            number(row.cross_track_p95_m),
            number(row.cross_track_max_m),
            number(row.heading_error_mean_rad),
            row.wall_hits.to_string(),
            row.walker_hits.to_string(),
            row.legs.to_string(),
            row.wrong_legs.to_string(),
            row.length_m.to_string(),
            row.time_s.to_string(),
        ];
        text += &format!("{}\n", cells.join(","));
    }
    text
}

/// The taught path with its snapshots, the paths of some repeats, and where repeats that failed came to rest.
#[must_use]
pub fn map(world: &World, route: &Route, truth: &[Pose], repeats: &[Repeat]) -> String {
    let at = |node: usize| truth.get(node).map(Pose::position);
    let told = truth.first().map_or(Pose::IDENTITY, |first| *first);
    let odometry = route.path.iter().map(|pose| told.compose(pose).position());
    let mut drawing = MapDrawing::new(world);
    if repeats.is_empty() {
        drawing = drawing.path(odometry, &Stroke::ODOMETRY, "the same by odometry alone");
    }
    drawing = drawing.path(truth.iter().map(Pose::position), &Stroke::series(0), "taught path");
    for repeat in repeats.iter().take(SHOWN) {
        let stroke = Stroke { width_px: 0.9, ..Stroke::series(1) };
        drawing = drawing.path(repeat.rows.iter().map(|row| row.truth.position()), &stroke, "repeats");
    }
    drawing = drawing.spots(route.snapshots.iter().filter_map(|snapshot| at(snapshot.node)), "#0072b2", "snapshots");
    let failed = |repeat: &&Repeat| !repeat.is_completed();
    let ends: Vec<Vector2<f64>> =
        repeats.iter().filter(failed).filter_map(|repeat| repeat.rows.last()).map(|row| row.truth.position()).collect();
    if !ends.is_empty() {
        drawing = drawing.spots(ends, "#d00000", "where repeats failed");
    }
    let title = format!("{}: {:.0} m, {} snapshots", world.spec.name, route.length_m(), route.snapshots.len());
    drawing.title(title).to_svg()
}

/// Distance from the taught path along it, for some repeats.
#[must_use]
pub fn cross_track(repeats: &[Repeat]) -> String {
    let x = Axis::linear("along the route, m").from(0.0);
    let mut chart = Chart::new("Distance from the taught path", x, Axis::linear("to its left, cm"));
    for (k, repeat) in repeats.iter().take(SHOWN).enumerate() {
        let points = repeat.rows.iter().filter(|row| row.counts).map(|row| [row.along_m, 100.0 * row.cross_track_m]);
        chart = chart.line(points, &Stroke { width_px: 0.8, ..Stroke::series(k) }, "");
    }
    chart.to_svg()
}

/// Length of the true path by its nodes, m.
#[must_use]
pub fn true_length_m(truth: &[Pose]) -> f64 {
    Line::new(truth.iter().map(Pose::position)).length_m()
}

/// The figures of repeats as lines of text.
#[must_use]
pub fn text(summary: &RepeatSummary) -> String {
    let m = &summary.measures;
    let cm = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{:.1} cm", 100.0 * v));
    let [low, high] = m.completed_95.map(|share| 100.0 * share);
    let interval =
        m.cross_track_mean_95_m.map_or_else(String::new, |[a, b]| format!(" ({:.2} to {:.2} cm)", 100.0 * a, 100.0 * b));
    format!(
        "completed    {} of {} ({low:.1} to {high:.1} %); {} said that they were lost, {} claimed a false end\n\
         cross-track  mean {}{interval}, 95 % {}, most {}\n\
         final error  mean {}, most {}\n\
         contacts     {} with walls and what stands, {} with people\n\
         legs         {}, {} of them claimed elsewhere\n\
         time         {:.2} of the teach's; {:.0} times as fast as real time\n",
        m.completed,
        m.repeats,
        m.said_lost,
        m.false_ends,
        cm(m.cross_track_mean_m),
        cm(m.cross_track_p95_m),
        cm(m.cross_track_max_m),
        cm(m.final_error_mean_m),
        cm(m.final_error_max_m),
        m.wall_hits,
        m.walker_hits,
        m.legs,
        m.wrong_legs,
        m.over_taught_time,
        m.real_time_factor,
    )
}

/// The figures of a lesson as lines of text.
#[must_use]
pub fn lesson_text(figures: &RouteFigures) -> String {
    format!(
        "taught       {:.1} m of {} in {:.0} s, {} contacts; odometry strayed by {:.2} m\n\
         snapshots    {} by rule {} ({:.0} per 100 m), {} features\n\
         file         {:.1} kB ({:.1} kB per 100 m)\n",
        figures.length_m,
        figures.world,
        figures.time_s,
        figures.collisions,
        figures.odometry_drift_m,
        figures.snapshots,
        figures.rule,
        figures.snapshots_per_100_m,
        figures.features,
        figures.bytes as f64 / 1e3,
        figures.bytes_per_100_m / 1e3,
    )
}

fn page(summary: &RepeatSummary, rows: &[RepeatRow]) -> String {
    let failed: Vec<String> = rows
        .iter()
        .filter(|row| !row.completed)
        .map(|row| {
            format!("- seed {}: {} {:.2} m from the end after {:.0} s\n", row.seed, row.outcome, row.final_error_m, row.time_s)
        })
        .collect();
    let failures = if failed.is_empty() { "None.\n".to_owned() } else { failed.concat() };
    format!(
        "# Repeats of a route in {}\n\n{}\n```text\n{}{}```\n\n![Map](map.svg)\n\n![Cross-track error](cross_track.svg)\n\n\
         ## Failures\n\n{failures}\n## Files\n\n`repeats.csv` has one row a repeat; `truth-SEED.tum` and `believed-SEED.tum` are \
         trajectories in the room, which `evo` reads.\n",
        summary.route.world,
        summary.conditions,
        lesson_text(&summary.route),
        text(summary),
    )
}
