//! The Cramer-Rao bound beside the filter, for a terminal.

use std::fmt::Write;

use crate::study::bound::{Bound, BoundRow};

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

/// How often NEES and NIS lie where a consistent filter's would, once all runs have an estimate, and their means. Steps share the
/// noise of the home snapshot, so that with one draw of seeds many steps may lie outside together.
fn consistency(bound: &Bound) -> String {
    let [first, last] = bound.seeds;
    let all = (last - first + 1) as usize;
    let settled: Vec<&BoundRow> = bound.rows.iter().filter(|row| row.runs == all).collect();
    let Some(row) = settled.last() else { return String::new() };
    let within = |value: Option<f64>, [low, high]: [f64; 2]| value.is_some_and(|v| (low..=high).contains(&v));
    let nees = settled.iter().filter(|row| within(row.nees, row.nees_band())).count();
    let nis = settled.iter().filter(|row| within(row.nis, row.nis_band())).count();
    let ([a, b], [c, d]) = (row.nees_band(), row.nis_band());
    let mean = |value: fn(&BoundRow) -> Option<f64>, digits: usize| {
        let values: Vec<f64> = settled.iter().filter_map(|row| value(row).filter(|v| v.is_finite())).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        if values.is_empty() { "-".to_owned() } else { format!("{mean:.digits$}") }
    };
    let (mean_nees, mean_nis) = (mean(|row| row.nees, 2), mean(|row| row.nis, 3));
    format!(
        "\n95 % bands of a consistent filter over {all} runs: NEES {a:.2} to {b:.2}, NIS a bearing {c:.3} to {d:.3} at the end.\n\
         Of {} steps after all runs have an estimate, NEES is in its band in {nees}, NIS in {nis}; their means over these\n\
         steps are {mean_nees} (3 is consistent) and {mean_nis} (1 is).\n",
        settled.len()
    )
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
