//! The Cramer-Rao bound beside the filter, for a terminal.

use std::fmt::Write;

use crate::study::bound::{Bound, BoundRow, nees_band};

/// Bounds above these say only that nothing is known yet: R (m), theta and alpha (rad).
const NOTHING_KNOWN: [f64; 3] = [10.0, 1.0, 1.0];

/// A row every `every_s` seconds, and the last one.
#[must_use]
pub fn table(bound: &Bound, every_s: f64) -> String {
    let [first, last] = bound.seeds;
    let mut text = format!(
        "{}, path of seed {}, bearings {:.2} deg, odometry {:.1} %, filter with seeds {first}..{last}\n\n\
         {:>6} {:>7}  {:>24}  {:>5} {:>24}  {:>17}  {:>5} {:>5}\n{:>6} {:>7}  {:>8}{:>8}{:>8}  {:>5} {:>8}{:>8}{:>8}  {:>5} {:>5} {:>5}  {:>5} {:>5}\n",
        bound.world,
        bound.path_seed,
        bound.bearing_sd_rad.to_degrees(),
        100.0 * bound.odometry_share,
        "",
        "home",
        "least sd possible",
        "",
        "RMSE of the filter",
        "RMSE / least sd",
        "",
        "",
        "t s",
        "m",
        "R cm",
        "th deg",
        "al deg",
        "runs",
        "R cm",
        "th deg",
        "al deg",
        "R",
        "th",
        "al",
        "NEES",
        "NIS"
    );
    let mut next_s = 0.0;
    for (k, row) in bound.rows.iter().enumerate() {
        if row.time_s + 1e-9 >= next_s || k + 1 == bound.rows.len() {
            text.push_str(&line(row));
            next_s = row.time_s + every_s;
        }
    }
    text += &consistency(bound);
    text
}

/// Means of NEES and NIS once all runs have an estimate, and how often they lie where a consistent filter's would.
fn consistency(bound: &Bound) -> String {
    let [first, last] = bound.seeds;
    let all = (last - first + 1) as usize;
    let settled: Vec<&BoundRow> = bound.rows.iter().filter(|row| row.runs == all).collect();
    let c = &bound.consistency;
    let mut text = String::from("\n");
    if !settled.is_empty() {
        let mean = |value: fn(&BoundRow) -> Option<f64>, digits: usize| {
            let values: Vec<f64> = settled.iter().filter_map(|row| value(row).filter(|v| v.is_finite())).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            if values.is_empty() { "-".to_owned() } else { format!("{mean:.digits$}") }
        };
        let (nees, nis) = (mean(|row| row.nees, 2), mean(|row| row.nis, 3));
        let _ = writeln!(
            text,
            "Over the {} steps after all runs have an estimate, the mean NEES is {nees} (3 is consistent), NIS {nis} (1 is).",
            settled.len()
        );
    }
    if c.steps == 0 {
        text.push_str("There is no step in which all runs of a group have an estimate.\n");
    } else {
        let [low, high] = nees_band(c.group);
        let share = |steps: usize| 100.0 * steps as f64 / c.steps as f64;
        let (nees, nis, groups) = (share(c.nees_in_band), share(c.nis_in_band), if c.groups == 1 { "group" } else { "groups" });
        let _ = write!(
            text,
            "{} {groups} of {} runs: of {} means over a group at one step, NEES is in its 95 % band ({low:.2} to {high:.2}) in {} ({nees:.1} %),\n\
             NIS in its own in {} ({nis:.1} %).\n",
            c.groups, c.group, c.steps, c.nees_in_band, c.nis_in_band
        );
    }
    text
}

fn line(row: &BoundRow) -> String {
    let bound = row.bound.map(|b| [b.range_m, b.bearing_rad, b.heading_rad]);
    let rmse = row.rmse.map(|e| [e.range_m, e.bearing_rad, e.heading_rad]);
    let shown = |k: usize| bound.map(|b| b[k]).filter(|b| *b <= NOTHING_KNOWN[k]);
    let units = [100.0, 1f64.to_degrees(), 1f64.to_degrees()];
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.2}"));
    let mut text = format!("{:>6.1} {:>7.2}  ", row.time_s, row.distance_m);
    for (k, unit) in units.iter().enumerate() {
        let _ = write!(text, "{:>8}", number(shown(k).map(|b| unit * b)));
    }
    let _ = write!(text, "  {:>5} ", row.runs);
    for (k, unit) in units.iter().enumerate() {
        let _ = write!(text, "{:>8}", number(rmse.map(|e| unit * e[k])));
    }
    let ratio = |k: usize| number(rmse.and_then(|e| Some(e[k] / shown(k)?)));
    let _ = writeln!(text, "  {:>5} {:>5} {:>5}  {:>5} {:>5}", ratio(0), ratio(1), ratio(2), number(row.nees), number(row.nis));
    text
}
