//! The files of a robustness study: a table for people, one for programs, and a picture.

use strum::VariantArray;
use svg::node::element::Group;

use super::curves::{Curve, Unit, WIDTH_PX, curves, document};
use super::text::{columns, number, percent_95};
use crate::draw::chart::{INK, text as label};
use crate::draw::markdown::table_of_numbers;
use crate::error::Result;
use crate::storage::OutputFolder;
use crate::storage::csv::{Columns, csv, number as cell};
use crate::study::robustness::{Axis, Cell, Robustness};

/// Writes all files of a study that `command` has made.
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, study: &Robustness, command: &str) -> Result<()> {
    folder.write("robustness.csv", csv(COLUMNS, &study.cells).as_bytes())?;
    folder.write("robustness.svg", picture(study).as_bytes())?;
    folder.write("README.md", readme(study, command).as_bytes())?;
    folder.finish()
}

/// Columns of `robustness.csv`.
const COLUMNS: &Columns<Cell> = &[
    ("axis", |c| c.axis.to_string()),
    ("level", |c| cell(c.level)),
    ("runs", |c| c.tally.runs.to_string()),
    ("home", |c| c.tally.home.to_string()),
    ("home_share", |c| cell(c.tally.home_share)),
    ("home_share_low_95", |c| cell(c.tally.home_share_95[0])),
    ("home_share_high_95", |c| cell(c.tally.home_share_95[1])),
    ("wrong_claims", |c| c.tally.wrong_claims.to_string()),
    ("timeout", |c| c.tally.outcomes.timeout.to_string()),
    ("lost", |c| c.tally.outcomes.lost.to_string()),
    ("stuck", |c| c.tally.outcomes.stuck.to_string()),
    ("time_ratio_median", |c| cell(c.tally.time_ratio.median)),
    ("time_ratio_p90", |c| cell(c.tally.time_ratio.p90)),
    ("final_distance_median_m", |c| cell(c.tally.final_distance_m.median)),
    ("final_distance_p90_m", |c| cell(c.tally.final_distance_m.p90)),
];

/// What gets worse, with its unit, and what exactly is done.
fn explained(axis: Axis) -> (&'static str, &'static str) {
    match axis {
        Axis::Hidden => (
            "Landmarks hidden (%)",
            "This share of the home snapshot's landmarks, drawn once a run, is never seen on the way. They are taken from the \
             sensor's bearings: what an extractor does with the features before that still has all of them.",
        ),
        Axis::Friction => (
            "Floor friction (mu)",
            "Coulomb friction of the drive wheels on the whole floor; the world's own floor zones are taken away.",
        ),
        Axis::FalseMatches => (
            "False matches added (%)",
            "In each step this share of the bearings gets a wrong azimuth: half of them that of another landmark in view, half \
             of them any. It comes after an extractor's own checks and on top of its own wrong matches.",
        ),
        Axis::Noise => (
            "Bearing noise added (degrees)",
            "Standard deviation of normal noise on every bearing, at home too, on top of the sensor's own; the sensor states it.",
        ),
    }
}

/// The axes that the study has, each with its levels.
fn by_axis(study: &Robustness) -> Vec<(Axis, Vec<&Cell>)> {
    let cells = |axis: Axis| study.cells.iter().filter(|cell| cell.axis == axis).collect::<Vec<_>>();
    Axis::VARIANTS.iter().map(|axis| (*axis, cells(*axis))).filter(|(_, cells)| !cells.is_empty()).collect()
}

/// The study as Markdown.
pub fn readme(study: &Robustness, command: &str) -> String {
    let setup = &study.setup;
    let section = |(axis, cells): (Axis, Vec<&Cell>)| {
        let (title, explanation) = explained(axis);
        let head = format!(
            "{title} | home | 95 % | wrong claims | timeout, lost, stuck | time ratio, median | 90 % | final distance, median"
        );
        format!("\n## {title}\n\n{explanation}\n\n{}", table_of_numbers(&head, 0, cells.into_iter().map(markdown_row)))
    };
    format!(
        include_str!("robustness.md"),
        command = command,
        first = study.seeds[0],
        last = study.seeds[1],
        world = study.world,
        version = study.version,
        sha = study.world_sha256,
        plant = setup.plant,
        bearings = setup.bearings,
        method = setup.method,
        law = setup.controller,
        renderer = study.renderer.as_ref().map_or_else(String::new, |kind| format!(", rendered by the {kind} renderer")),
        radius = 100.0 * setup.arrival_radius_m,
        axes = by_axis(study).into_iter().map(section).collect::<String>(),
    )
}

fn markdown_row(cell: &Cell) -> [String; 8] {
    let t = &cell.tally;
    [
        cell.level.to_string(),
        format!("{}/{}", t.home, t.runs),
        percent_95(t),
        t.wrong_claims.to_string(),
        format!("{}, {}, {}", t.outcomes.timeout, t.outcomes.lost, t.outcomes.stuck),
        number(t.time_ratio.median, 1.0, ""),
        number(t.time_ratio.p90, 1.0, ""),
        number(t.final_distance_m.median, 100.0, " cm"),
    ]
}

/// The study for a terminal.
pub fn table(study: &Robustness) -> String {
    let mut rows = vec![["axis", "level", "home", "95 %", "wrong", "ratio, 90 %", "final cm"].map(str::to_owned)];
    rows.extend(study.cells.iter().map(|cell| {
        let t = &cell.tally;
        [
            explained(cell.axis).0.to_owned(),
            cell.level.to_string(),
            format!("{}/{}", t.home, t.runs),
            percent_95(t),
            t.wrong_claims.to_string(),
            format!("{}, {}", number(t.time_ratio.median, 1.0, ""), number(t.time_ratio.p90, 1.0, "")),
            number(t.final_distance_m.median, 100.0, ""),
        ]
    }));
    columns(1, &rows)
}

/// Height of the heading above the panels, px.
const TOP_PX: f64 = 44.0;
/// Space between two panels, px.
const GAP_PX: f64 = 16.0;

/// Success and wrong claims against each condition, one panel an axis.
fn picture(study: &Robustness) -> String {
    let [first, last] = study.seeds;
    let heading = format!("Runs that come home in {}, seeds {first} to {last}", study.world);
    let mut all = Group::new().add(label(&heading, GAP_PX, 28.0, 16.0).set("font-weight", "bold").set("fill", INK));
    let mut bottom = TOP_PX;
    for (k, (axis, cells)) in by_axis(study).into_iter().enumerate() {
        let levels: Vec<String> = cells.iter().map(|cell| cell.level.to_string()).collect();
        let home = cells.iter().map(|cell| {
            let [low, high] = cell.tally.home_share_95;
            Some([low, cell.tally.home_share, high])
        });
        let wrong = cells.iter().map(|cell| Some([cell.tally.wrong_claims as f64 / cell.tally.runs.max(1) as f64; 3]));
        let lines = [
            Curve { label: "came home, 95 % Wilson".into(), points: home.collect() },
            Curve { label: "wrong claims".into(), points: wrong.collect() },
        ];
        let (panel, height) = curves("", (explained(axis).0, &levels), Unit::Percent, &lines);
        let [column, row] = [k % 2, k / 2].map(|place| place as f64);
        let (x, y) = (GAP_PX + column * (WIDTH_PX + GAP_PX), TOP_PX + row * (height + GAP_PX));
        all = all.add(panel.set("transform", format!("translate({x} {y})")));
        bottom = y + height;
    }
    document([2.0 * WIDTH_PX + 3.0 * GAP_PX, bottom + GAP_PX]).add(all).to_string() + "\n"
}

#[cfg(all(test, feature = "rapier"))]
mod tests {
    use super::*;
    use crate::episode::{SensorKind, Setup};
    use crate::study::pool::Pool;
    use crate::study::robustness::{run, study};

    #[test]
    fn files_tell_the_same_story() {
        let setup = Setup { sensor: SensorKind::Ideal, time_limit_s: Some(0.5), ..Setup::default() };
        let study = study("lab", &setup, &[], &(1..=2)).unwrap();
        let study = run(&study, &Pool::new(1), &|_| ()).unwrap();
        let command = "wayhome robustness lab --seeds 1..2";
        let (table, text, picture) = (csv(COLUMNS, &study.cells), readme(&study, command), picture(&study));
        assert!(table.starts_with("axis,level,runs,home,") && table.contains("\nfalse-matches,40,2,0,0,"), "{table}");
        assert_eq!(table.lines().count(), 1 + study.cells.len());
        assert!(text.contains(command) && text.contains("`anchored-ekf`") && text.contains(&study.world_sha256));
        assert!(text.contains("| 0.15 | 0/2 | 0-66 % | 0 | 2, 0, 0 | - | - |"), "out of time at once: {text}");
        // Two points a level, two curves an axis.
        assert_eq!(picture.matches("<circle").count(), 2 * study.cells.len());
        assert_eq!(picture.matches("<polyline").count(), 2 * Axis::VARIANTS.len());
        assert!(!picture.contains("NaN") && !picture.contains("inf"));
    }
}
