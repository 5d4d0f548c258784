//! The pairs of a set: a table of all, one of what they come to, and a page.

use crate::draw::markdown::table_of_numbers;
use crate::error::Result;
use crate::storage::OutputFolder;
use crate::storage::csv::{Columns, csv, number};
use crate::study::field::{self, FieldSummary, HomeField};
use crate::study::pairs::{PairRow, PairSummary, summaries};

const ROWS: &Columns<PairRow> = &[
    ("method", |r| r.method.name().to_owned()),
    ("home", |r| r.home.clone()),
    ("now", |r| r.now.clone()),
    ("home_room", |r| r.home_room.clone()),
    ("now_room", |r| r.now_room.clone()),
    ("lie", |r| r.lie.words().to_owned()),
    ("distance_m", |r| number(r.distance_m)),
    ("landmarks", |r| r.landmarks.to_string()),
    ("right", |r| r.right.to_string()),
    ("wrong", |r| r.is_wrong().to_string()),
    ("alternatives", |r| r.alternatives.to_string()),
    ("turn_error_deg", |r| number(r.turn_error_deg)),
    ("turn_sd_deg", |r| number(r.turn_sd_deg)),
    ("home_error_deg", |r| number(r.home_error_deg)),
    ("home_sd_deg", |r| number(r.home_sd_deg)),
    ("from_home_x_m", |r| number(r.from_home_m[0])),
    ("from_home_y_m", |r| number(r.from_home_m[1])),
    ("toward_deg", |r| number(r.toward_deg)),
];

const HOMES: &Columns<HomeField> = &[
    ("method", |f| f.method.name().to_owned()),
    ("home", |f| f.home.clone()),
    ("places", |f| f.places.to_string()),
    ("answered", |f| f.answered.to_string()),
    ("aae_deg", |f| number(f.aae_deg)),
    ("compass_deg", |f| number(f.compass_deg)),
    ("return_ratio", |f| number(f.return_ratio)),
    ("catchment_m2", |f| number(f.catchment_m2)),
];

/// What the fields of home vectors come to, as a Markdown table.
#[must_use]
pub fn field_summary(all: &[FieldSummary]) -> String {
    let degrees = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:.1}"));
    let row = |s: &FieldSummary| {
        let directed = s.aae_deg.is_some();
        let of_vectors = |text: String| if directed { text } else { String::new() };
        [
            s.method.name().to_owned(),
            s.homes.to_string(),
            of_vectors(format!("{:.1} %", 100.0 * s.answered)),
            degrees(s.aae_deg),
            of_vectors(format!("{:.3}", s.return_ratio)),
            of_vectors(format!("{:.1}", s.catchment_m2)),
            degrees(s.compass_deg),
        ]
    };
    let columns =
        "method | homes | places with a vector | AAE (deg) | return ratio | catchment (m^2) | compass, mean error (deg)";
    table_of_numbers(columns, 1, all.iter().map(row))
}

/// Names of the summary's columns.
const SUMMARY: &str = "method | how they lie | pairs | with an answer | wrong answers | right landmarks | turn, median error (deg) | home, \
                       median error (deg) | AAE (deg)";

/// What the pairs come to, as a Markdown table.
#[must_use]
pub fn summary(all: &[PairSummary]) -> String {
    let share = |part: usize, whole: usize| {
        if whole == 0 { String::new() } else { format!("{part} of {whole} ({:.1} %)", 100.0 * part as f64 / whole as f64) }
    };
    let degrees = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:.1}"));
    let row = |s: &PairSummary| {
        [
            s.method.name().to_owned(),
            s.lie.words().to_owned(),
            s.pairs.to_string(),
            share(s.answered, s.pairs),
            share(s.wrong, s.answered),
            share(s.right, s.landmarks),
            degrees(s.turn_error_deg),
            degrees(s.home_error_deg),
            degrees(s.aae_deg),
        ]
    };
    table_of_numbers(SUMMARY, 2, all.iter().map(row))
}

/// Writes `pairs.csv`, `homes.csv` where there are fields of home vectors, and `README.md`, which says by which command.
///
/// # Errors
/// When a file cannot be written.
pub fn write(
    mut folder: OutputFolder,
    rows: &[PairRow],
    fields: &[HomeField],
    tolerance_deg: f64,
    command: &str,
) -> Result<()> {
    folder.write("pairs.csv", csv(ROWS, rows).as_bytes())?;
    let mut grid = String::new();
    if !fields.is_empty() {
        folder.write("homes.csv", csv(HOMES, fields).as_bytes())?;
        grid = format!(include_str!("fields.md"), table = field_summary(&field::summaries(fields)));
    }
    let page = format!(
        include_str!("pairs.md"),
        command = command,
        tolerance = tolerance_deg,
        table = summary(&summaries(rows)),
        grid = grid,
        version = crate::VERSION
    );
    folder.write("README.md", page.as_bytes())?;
    folder.finish()
}
