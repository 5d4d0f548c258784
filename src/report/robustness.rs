//! The files of a robustness study: a table for people, one for programs, and a picture.

mod panels;

use std::fmt::Write;

use serde::Serialize;

use crate::error::Result;
use crate::storage::OutputFolder;
use crate::study::robustness::{Axis, Cell, Robustness};

/// Names of all files of a study.
pub const FILES: &[&str] = &["README.md", "robustness.csv", "robustness.svg"];

/// Columns of `robustness.csv`.
const COLUMNS: [&str; 15] = [
    "axis",
    "level",
    "runs",
    "home",
    "home_share",
    "home_share_low_95",
    "home_share_high_95",
    "wrong_claims",
    "timeout",
    "lost",
    "stuck",
    "time_ratio_median",
    "time_ratio_p90",
    "final_distance_median_m",
    "final_distance_p90_m",
];

/// Writes all files of a study that `command` has made.
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, study: &Robustness, command: &str) -> Result<()> {
    folder.write("robustness.csv", csv(study).as_bytes())?;
    folder.write("robustness.svg", panels::svg(study).as_bytes())?;
    folder.write("README.md", readme(study, command).as_bytes())?;
    folder.finish()
}

/// One row a level, empty cells where there is no number.
#[must_use]
pub fn csv(study: &Robustness) -> String {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    for cell in &study.cells {
        let number = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
        let row: [String; 15] = [
            cell.axis.name().to_owned(),
            cell.level.to_string(),
            cell.tally.runs.to_string(),
            cell.tally.home.to_string(),
            share(cell).to_string(),
            cell.tally.home_share_95[0].to_string(),
            cell.tally.home_share_95[1].to_string(),
            cell.tally.wrong_claims.to_string(),
            cell.tally.outcomes.timeout.to_string(),
            cell.tally.outcomes.lost.to_string(),
            cell.tally.outcomes.stuck.to_string(),
            number(cell.tally.time_ratio.median),
            number(cell.tally.time_ratio.p90),
            number(cell.tally.final_distance_m.median),
            number(cell.tally.final_distance_m.p90),
        ];
        text.push_str(&row.join(","));
        text.push('\n');
    }
    text
}

fn share(cell: &Cell) -> f64 {
    cell.tally.home as f64 / cell.tally.runs.max(1) as f64
}

/// What gets worse, with its unit.
fn title(axis: Axis) -> &'static str {
    match axis {
        Axis::Hidden => "Landmarks hidden (%)",
        Axis::Friction => "Floor friction (mu)",
        Axis::FalseMatches => "False matches added (%)",
        Axis::Noise => "Bearing noise added (degrees)",
    }
}

/// What exactly is done.
fn explanation(axis: Axis) -> &'static str {
    match axis {
        Axis::Hidden => {
            "This share of the home snapshot's landmarks, drawn once a run, is never seen on the way. They are taken from the \
             sensor's bearings: what an extractor does with the features before that still has all of them."
        }
        Axis::Friction => {
            "Coulomb friction of the drive wheels on the whole floor; the world's own floor zones are taken away."
        }
        Axis::FalseMatches => {
            "In each step this share of the bearings gets a wrong azimuth: half of them that of another landmark in view, half \
             of them any. It comes after an extractor's own checks and on top of its own wrong matches."
        }
        Axis::Noise => {
            "Standard deviation of normal noise on every bearing, at home too, on top of the sensor's own; the sensor states it."
        }
    }
}

/// The study as Markdown.
#[must_use]
pub fn readme(study: &Robustness, command: &str) -> String {
    let [first, last] = study.seeds;
    let setup = &study.setup;
    let mut text = format!(
        "# Robustness in `{world}`\n\nMade by\n\n```sh\n{command}\n```\n\nwith wayhome {version} (world file SHA-256 `{sha}`).\n\n\
         ![Share of runs that come home](robustness.svg)\n\n\
         Each row is seeds {first} to {last} of `{plant}` x `{bearings}` x `{method}` with the `{law}` law{renderer}: random \
         starts, nothing known, one condition changed and all others left as the world has them. *Home* is the share of runs that \
         claimed to be home and came to rest within {radius:.0} cm of it, with its 95 % Wilson interval. *Wrong claims* claimed it \
         and came to rest farther off. *Time ratio* is time over straight-line time, of the runs that came home.\n",
        world = study.world,
        version = study.version,
        sha = study.world_sha256,
        plant = name(&setup.plant),
        bearings = name(&setup.bearings),
        method = name(&setup.method),
        law = name(&setup.controller),
        renderer = study.renderer.as_ref().map_or_else(String::new, |kind| format!(", rendered by the {kind} renderer")),
        radius = 100.0 * setup.arrival_radius_m,
    );
    for axis in Axis::ALL {
        let cells: Vec<&Cell> = study.cells.iter().filter(|c| c.axis == axis).collect();
        if cells.is_empty() {
            continue;
        }
        let _ = write!(
            text,
            "\n## {title}\n\n{}\n\n| {title} | home | 95 % | wrong claims | timeout, lost, stuck | time ratio, median | 90 % | \
             final distance, median |\n|---:|---:|---:|---:|---:|---:|---:|---:|\n",
            explanation(axis),
            title = title(axis)
        );
        for cell in cells {
            text.push_str(&markdown_row(cell));
        }
    }
    text
}

fn markdown_row(cell: &Cell) -> String {
    let [low, high] = cell.tally.home_share_95;
    let optional = |value: Option<f64>, scale: f64, unit: &str| {
        value.map_or_else(|| "-".to_owned(), |v| format!("{:.2}{unit}", scale * v))
    };
    let o = cell.tally.outcomes;
    format!(
        "| {} | {}/{} | {:.0}-{:.0} % | {} | {}, {}, {} | {} | {} | {} |\n",
        cell.level,
        cell.tally.home,
        cell.tally.runs,
        100.0 * low,
        100.0 * high,
        cell.tally.wrong_claims,
        o.timeout,
        o.lost,
        o.stuck,
        optional(cell.tally.time_ratio.median, 1.0, ""),
        optional(cell.tally.time_ratio.p90, 1.0, ""),
        optional(cell.tally.final_distance_m.median, 100.0, " cm"),
    )
}

/// The study for a terminal.
#[must_use]
pub fn table(study: &Robustness) -> String {
    let mut text = format!(
        "{:<26} {:>5}  {:>9}  {:>9}  {:>5}  {:>12}  {:>8}\n",
        "axis", "level", "home", "95 %", "wrong", "ratio, 90 %", "final cm"
    );
    for cell in &study.cells {
        let [low, high] = cell.tally.home_share_95;
        let optional = |value: Option<f64>, scale: f64| value.map_or_else(|| "-".to_owned(), |v| format!("{:.2}", scale * v));
        let _ = writeln!(
            text,
            "{:<26} {:>5}  {:>9}  {:>9}  {:>5}  {:>12}  {:>8}",
            title(cell.axis),
            cell.level,
            format!("{}/{}", cell.tally.home, cell.tally.runs),
            format!("{low:.2}-{high:.2}"),
            cell.tally.wrong_claims,
            format!("{}, {}", optional(cell.tally.time_ratio.median, 1.0), optional(cell.tally.time_ratio.p90, 1.0)),
            optional(cell.tally.final_distance_m.median, 100.0),
        );
    }
    text
}

/// A part's name as files and the command line have it.
fn name(part: &impl Serialize) -> String {
    serde_json::to_value(part).ok().and_then(|v| Some(v.as_str()?.to_owned())).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::{SensorKind, Setup};
    use crate::study::pool::Pool;
    use crate::study::robustness::run;
    use crate::world::World;

    #[test]
    fn files_tell_the_same_story() {
        let world = World::open("lab").unwrap();
        let setup = Setup { sensor: SensorKind::Ideal, time_limit_s: Some(0.5), ..Setup::default() };
        let study = run(&world, &setup, &Axis::ALL, &(1..=2), &Pool::new(1), &|_, _| ()).unwrap();
        let command = "wayhome robustness lab --seeds 1..2";
        let (table, text, picture) = (csv(&study), readme(&study, command), panels::svg(&study));
        assert_eq!(table.lines().count(), 1 + study.cells.len());
        assert!(table.lines().all(|l| l.split(',').count() == COLUMNS.len()), "{table}");
        assert!(text.contains(command) && text.contains("`anchored-ekf`") && text.contains(&world.sha256));
        assert!(text.contains("| 0.15 | 0/2 | 0-66 % | 0 | 2, 0, 0 | - | - |"), "out of time at once: {text}");
        // A point a level and one in the legend; a curve an axis.
        assert_eq!(picture.matches("<circle").count(), study.cells.len() + 1);
        assert_eq!(picture.matches("<polyline").count(), Axis::ALL.len());
        assert!(!picture.contains("NaN") && !picture.contains("inf"));
    }
}
