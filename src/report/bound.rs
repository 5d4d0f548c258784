//! The Cramer-Rao bound beside the filter, for a terminal.

use std::fmt::Write;

use crate::statistics::mean;
use crate::study::bound::{Bound, BoundRow, Consistency, nees_band};

/// Bounds above these say only that nothing is known yet: R (m), theta and alpha (rad).
const NOTHING_KNOWN: [f64; 3] = [10.0, 1.0, 1.0];

/// Names of the columns.
const HEAD: [&str; 2] = [
    "          home         least sd possible              RMSE of the filter    RMSE / least sd             ",
    "   t s       m      R cm  th deg  al deg   runs     R cm  th deg  al deg      R    th    al   NEES   NIS",
];

/// A row every `every_s` seconds, and the last one.
pub fn table(bound: &Bound, every_s: f64) -> String {
    let [first, last] = bound.seeds;
    let mut text = format!(
        "{}, path of seed {}, bearings {:.2} deg, odometry {:.1} %, filter with seeds {first}..{last}\n\n{}\n",
        bound.world,
        bound.path_seed,
        bound.bearing_sd_rad.to_degrees(),
        100.0 * bound.odometry_share,
        HEAD.join("\n"),
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
    let settled: Vec<&BoundRow> = bound.rows.iter().filter(|row| row.runs as u64 == last - first + 1).collect();
    let mut text = String::from("\n");
    if !settled.is_empty() {
        let average = |value: fn(&BoundRow) -> Option<f64>, digits: usize| {
            let values = settled.iter().filter_map(|row| value(row).filter(|v| v.is_finite()));
            mean(values).map_or("-".to_owned(), |mean| format!("{mean:.digits$}"))
        };
        let _ = writeln!(
            text,
            "Over the {} steps after all runs have an estimate, the mean NEES is {} (3 is consistent), NIS {} (1 is).",
            settled.len(),
            average(|row| row.nees, 2),
            average(|row| row.nis, 3)
        );
    }
    let Consistency { group, groups, steps, nees_in_band, nis_in_band } = bound.consistency;
    if steps == 0 {
        return text + "There is no step in which all runs of a group have an estimate.\n";
    }
    let [low, high] = nees_band(group);
    let [nees, nis] = [nees_in_band, nis_in_band].map(|inside| 100.0 * inside as f64 / steps as f64);
    let words = if groups == 1 { "group" } else { "groups" };
    text + &format!(
        "{groups} {words} of {group} runs: of {steps} means over a group at one step, NEES is in its 95 % band ({low:.2} to {high:.2}) in \
         {nees_in_band} ({nees:.1} %),\nNIS in its own in {nis_in_band} ({nis:.1} %).\n"
    )
}

fn line(row: &BoundRow) -> String {
    let units = [100.0, 1f64.to_degrees(), 1f64.to_degrees()];
    let bound = row.bound.map(|b| b.values());
    let known: [Option<f64>; 3] = std::array::from_fn(|k| bound.map(|b| b[k]).filter(|b| *b <= NOTHING_KNOWN[k]));
    let rmse: [Option<f64>; 3] = std::array::from_fn(|k| row.rmse.map(|e| e.values()[k]));
    let ratio: [Option<f64>; 3] = std::array::from_fn(|k| Some(rmse[k]? / known[k]?));
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.2}"));
    let scaled = |values: [Option<f64>; 3]| -> String {
        values.iter().zip(units).map(|(value, unit)| format!("{:>8}", number(value.map(|v| unit * v)))).collect()
    };
    let [r, theta, alpha] = ratio.map(number);
    format!(
        "{:>6.1} {:>7.2}  {}  {:>5} {}  {r:>5} {theta:>5} {alpha:>5}  {:>5} {:>5}\n",
        row.time_s,
        row.distance_m,
        scaled(known),
        row.runs,
        scaled(rmse),
        number(row.nees),
        number(row.nis)
    )
}
