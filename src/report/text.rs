//! Results for a person to read in a terminal.

use std::fmt::Write;
use std::path::Path;

use crate::episode::open_loop::DriveSummary;
use crate::episode::{Outcome, Summary};
use crate::geometry::Pose;
use crate::study::row::RunRow;
use crate::study::seeds::SeedsSummary;
use crate::study::tally::{Spread, Tally};

/// One run.
pub fn run(summary: &Summary, folder: &Path) -> String {
    let s = summary;
    let distance = centimetres(s.final_distance_m);
    let headline = match s.outcome {
        Outcome::Home => format!("home: {distance} from it after {:.1} s", s.time_s),
        Outcome::Timeout => format!("not home: out of time after {:.1} s, {distance} from it", s.time_s),
        Outcome::Lost if s.claimed_home => format!("not home: claimed to be after {:.1} s, {distance} from it", s.time_s),
        Outcome::Lost => format!("not home: lost after {:.1} s, {distance} from it", s.time_s),
        Outcome::Stuck => format!("not home: stuck after {:.1} s, {distance} from it", s.time_s),
        Outcome::Failed => format!("not home: the method broke after {:.1} s, {distance} from it", s.time_s),
    };
    let mut rows: Vec<(&str, String)> = Vec::new();
    if let Some(failure) = &s.failure {
        rows.push(("method", failure.clone()));
    }
    if let (Some(ratio), Some(straight)) = (s.time_ratio, s.straight_line_time_s) {
        rows.push(("time ratio", format!("{ratio:.2} (straight line {straight:.1} s)")));
    }
    rows.push((
        "start",
        format!(
            "{:.2} m from home: ({:.3}, {:.3}) m, {:.1} deg",
            s.start_distance_m,
            s.start.x,
            s.start.y,
            s.start.heading.to_degrees()
        ),
    ));
    rows.push(("path", format!("{:.2} m, {} collisions", s.path_length_m, s.collisions)));
    rows.push(("odometry drift", centimetres(s.odometry_drift_m)));
    if let Some(e) = &s.estimate {
        let angles = |bearing: f64, heading: f64| {
            format!("bearing {:.2} deg, heading {:.2} deg", bearing.to_degrees(), heading.to_degrees())
        };
        rows.push((
            "estimate, end",
            format!("range {}, {}", centimetres(e.range_error_m), angles(e.bearing_error_rad, e.heading_error_rad)),
        ));
        rows.push((
            "estimate, RMSE",
            format!("range {}, {}", centimetres(e.range_rmse_m), angles(e.bearing_rmse_rad, e.heading_rmse_rad)),
        ));
        if let Some(nees) = e.nees {
            rows.push(("NEES", format!("{nees:.2} (3 is consistent)")));
        }
    }
    let l = &s.landmarks;
    rows.push((
        "bearings a step",
        format!("{:.1} seen, {:.1} used, {:.1} refused; {} at home", l.seen_mean, l.matched_mean, l.rejected_mean, l.home),
    ));
    if let Some(renderer) = &s.renderer {
        rows.push(("renderer", [&renderer.kind, &renderer.adapter, &renderer.driver].map(String::as_str).join(" ")));
    }
    let t = &s.timing;
    rows.push((
        "wall time",
        format!(
            "{:.2} s ({:.1} x real time): render {:.2}, vision {:.2}, estimation {:.2}, physics {:.2}",
            t.wall_s, t.real_time_factor, t.render_s, t.vision_s, t.estimation_s, t.physics_s
        ),
    ));
    rows.push(("files", folder.display().to_string()));
    table(&headline, &rows)
}

/// Collisions that a text lists at most.
const MOST_COLLISIONS: usize = 20;

/// An open-loop drive.
pub fn drive(summary: &DriveSummary, folder: &Path) -> String {
    let s = summary;
    let pose = |p: &Pose| format!("({:.3}, {:.3}) m, {:.1} deg", p.x, p.y, p.heading.to_degrees());
    let mut rows = vec![
        ("start", pose(&s.start)),
        ("end", pose(&s.end)),
        ("end by odometry", pose(&s.odometry_end)),
        (
            "odometry drift",
            format!("{}, {:.2} deg", centimetres(s.odometry_drift_m), s.odometry_heading_drift_rad.to_degrees()),
        ),
        ("greatest speed", format!("{:.3} m/s", s.greatest_speed_m_s)),
        ("greatest slip", format!("{:.4} m/s, mean of a control step", s.greatest_slip_m_s)),
    ];
    for hit in s.collision_list.iter().take(MOST_COLLISIONS) {
        rows.push(("collision", format!("{:.3} s, {}, {:.3} N s", hit.time_s, hit.with, hit.impulse_n_s)));
    }
    if s.collisions > MOST_COLLISIONS {
        rows.push(("collisions", format!("{} in all, in collisions.csv", s.collisions)));
    }
    rows.push(("files", folder.display().to_string()));
    table(&format!("drove {:.2} m in {:.1} s", s.path_length_m, s.time_s), &rows)
}

/// A batch.
pub fn seeds(batch: &SeedsSummary, rows: &[RunRow], folder: &Path) -> String {
    let t = &batch.tally;
    let mut table = vec![["seed", "outcome", "start m", "final cm", "time s", "ratio", "nees"].map(str::to_owned)];
    table.extend(rows.iter().map(|row| {
        [
            row.seed.to_string(),
            row.outcome.to_string(),
            number(row.initial_distance_m, 1.0, ""),
            number(row.final_distance_m, 100.0, ""),
            number(row.time_s, 1.0, ""),
            number(row.time_ratio, 1.0, ""),
            number(row.nees, 1.0, ""),
        ]
    }));
    let headline = format!(
        "\nhome within {}: {}/{} (95 % Wilson {})",
        centimetres(batch.setup.arrival_radius_m),
        t.home,
        t.runs,
        percent_95(t)
    );
    let spread = |s: &Spread, scale: f64, unit: &str| {
        let of = |value| number(value, scale, unit);
        if s.count == 0 { of(None) } else { format!("median {}, 90 % {}, most {}", of(s.median), of(s.p90), of(s.max)) }
    };
    let mut told = vec![
        ("time ratio", spread(&t.time_ratio, 1.0, "")),
        ("final distance", spread(&t.final_distance_m, 100.0, " cm")),
        ("where it claimed home", spread(&t.claimed_distance_m, 100.0, " cm")),
        ("range error at end", spread(&t.range_error_m, 100.0, " cm")),
        ("odometry drift", spread(&t.odometry_drift_m, 100.0, " cm")),
        ("NEES (3 is consistent)", spread(&t.nees, 1.0, "")),
        ("wrong claims", t.wrong_claims.to_string()),
        ("timeout, lost, stuck", format!("{}, {}, {}", t.outcomes.timeout, t.outcomes.lost, t.outcomes.stuck)),
    ];
    if t.outcomes.failed > 0 {
        told.push(("method broke", t.outcomes.failed.to_string()));
    }
    told.push(("runs with collisions", t.runs_with_collisions.to_string()));
    told.push(("files", folder.display().to_string()));
    columns(0, &table) + &self::table(&headline, &told)
}

/// A number of a table with two decimals, `scale` times the value; a dash where there is none.
pub(super) fn number(value: Option<f64>, scale: f64, unit: &str) -> String {
    value.map_or_else(|| "-".to_owned(), |v| format!("{:.2}{unit}", scale * v))
}

/// The 95 % interval of the share that came home.
pub(super) fn percent_95(tally: &Tally) -> String {
    let [low, high] = tally.home_share_95.map(|share| 100.0 * share);
    format!("{low:.0}-{high:.0} %")
}

/// Rows of which the first `texts` cells are flush left and all others, which hold numbers, flush right.
pub(super) fn columns<const N: usize>(texts: usize, rows: &[[String; N]]) -> String {
    let widths: [usize; N] = std::array::from_fn(|k| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0));
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().zip(widths).enumerate();
        let padded =
            cells.map(|(k, (cell, width))| if k < texts { format!("{cell:width$}") } else { format!("{cell:>width$}") });
        text += padded.collect::<Vec<_>>().join("  ").trim_end();
        text.push('\n');
    }
    text
}

fn centimetres(metres: f64) -> String {
    format!("{:.1} cm", 100.0 * metres)
}

/// A headline and aligned rows under it.
fn table(headline: &str, rows: &[(&str, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let mut text = format!("{headline}\n");
    for (name, value) in rows {
        let _ = writeln!(text, "  {name:width$}  {value}");
    }
    text
}
