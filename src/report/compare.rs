//! The files of a comparison: a table for people, one for programs, a bar chart, and a map for each contender.

use std::fmt::Write;

use serde::Serialize;
use svg::node::element::{Group, Line, Rectangle, Text};

use crate::control::Law;
use crate::draw::map::MapDrawing;
use crate::episode::Outcome;
use crate::error::Result;
use crate::geometry::Vector2;
use crate::method::MethodKind;
use crate::storage::OutputFolder;
use crate::study::compare::{Comparison, Contender, Standing};
use crate::study::tally::Spread;
use crate::world::World;

/// Names of all files of a comparison.
pub const FILES: &[&str] = &[
    "README.md",
    "compare.csv",
    "compare.svg",
    "map-anchored-ekf.svg",
    "map-anchored-ekf-lyapunov.svg",
    "map-paper-ekf-told.svg",
    "map-paper-ekf-told-lyapunov.svg",
    "map-paper-ekf.svg",
    "map-paper-ekf-lyapunov.svg",
    "map-alv.svg",
    "map-alv-compass.svg",
    "map-tron-daniilidis.svg",
    "map-tron-daniilidis-compass.svg",
    "map-weber.svg",
    "map-weber-compass.svg",
    "map-ibvs.svg",
    "map-ibvs-compass.svg",
    "map-exec-#.svg",
];

/// Columns of `compare.csv`.
const COLUMNS: &str = "contender,told,law,runs,home,home_share_low_95,home_share_high_95,wrong_claims,time_ratio_median,\
time_ratio_p90,path_ratio_median,final_distance_median_m,final_distance_p90_m,aae_deg,catchment_share\n";

/// Writes all files of a comparison that `command` has made.
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, world: &World, comparison: &Comparison, command: &str) -> Result<()> {
    folder.write("compare.csv", csv(comparison).as_bytes())?;
    folder.write("compare.svg", chart(comparison).as_bytes())?;
    let mut maps = Vec::new();
    if comparison.grid_spacing_m.is_some() {
        for standing in &comparison.standings {
            let name = format!("map-{}.svg", standing.contender.key);
            folder.write(&name, map(world, comparison, standing).as_bytes())?;
            maps.push(name);
        }
    }
    folder.write("README.md", readme(comparison, command, &maps).as_bytes())?;
    folder.finish()
}

fn told(contender: &Contender) -> &'static str {
    match (contender.told_start, contender.compass) {
        (true, _) => "the true start",
        (_, true) => "a compass",
        _ => "nothing",
    }
}

fn law(contender: &Contender) -> &'static str {
    match contender.law {
        Law::Proportional => "proportional",
        Law::Lyapunov => "lyapunov",
    }
}

/// One row a contender, empty cells where there is no number.
#[must_use]
pub fn csv(comparison: &Comparison) -> String {
    let mut text = COLUMNS.to_owned();
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    for s in &comparison.standings {
        let [low, high] = s.tally.home_share_95;
        let _ = writeln!(
            text,
            "{},{},{},{},{},{low},{high},{},{},{},{},{},{},{},{}",
            s.contender.key,
            told(&s.contender),
            law(&s.contender),
            s.tally.runs,
            s.tally.home,
            s.tally.wrong_claims,
            number(s.tally.time_ratio.median),
            number(s.tally.time_ratio.p90),
            number(s.path_ratio.median),
            number(s.tally.final_distance_m.median),
            number(s.tally.final_distance_m.p90),
            number(s.aae_rad.map(f64::to_degrees)),
            number(s.catchment_share),
        );
    }
    text
}

/// The cells of a contender's row in the order of [`HEAD`].
fn cells(s: &Standing) -> [String; 11] {
    let [low, high] = s.tally.home_share_95;
    let value = |value: Option<f64>, scale: f64, decimals: usize| {
        value.map_or_else(|| "-".to_owned(), |v| format!("{:.decimals$}", scale * v))
    };
    let median = |spread: &Spread, scale: f64| value(spread.median, scale, 2);
    [
        s.contender.key.to_string(),
        told(&s.contender).to_owned(),
        format!("{}/{}", s.tally.home, s.tally.runs),
        format!("{:.0}-{:.0} %", 100.0 * low, 100.0 * high),
        s.tally.wrong_claims.to_string(),
        median(&s.tally.time_ratio, 1.0),
        value(s.tally.time_ratio.p90, 1.0, 2),
        median(&s.path_ratio, 1.0),
        value(s.tally.final_distance_m.median, 100.0, 1),
        value(s.aae_rad.map(f64::to_degrees), 1.0, 1),
        value(s.catchment_share, 100.0, 0),
    ]
}

const HEAD: [&str; 11] = [
    "contender",
    "told",
    "home",
    "95 %",
    "wrong claims",
    "time ratio",
    "90 %",
    "path ratio",
    "final (cm)",
    "AAE (deg)",
    "catchment (%)",
];

/// The comparison for a terminal.
#[must_use]
pub fn table(comparison: &Comparison) -> String {
    let mut rows = vec![HEAD.map(str::to_owned)];
    rows.extend(comparison.standings.iter().map(cells));
    let widths: [usize; 11] = std::array::from_fn(|k| rows.iter().map(|row| row[k].len()).max().unwrap_or(0));
    let mut text = String::new();
    for row in rows {
        let padded = row.iter().zip(widths).enumerate();
        let padded = padded.map(|(k, (cell, width))| if k < 2 { format!("{cell:width$}") } else { format!("{cell:>width$}") });
        text += padded.collect::<Vec<_>>().join("  ").trim_end();
        text.push('\n');
    }
    text
}

/// The comparison as Markdown.
#[must_use]
pub fn readme(comparison: &Comparison, command: &str, maps: &[String]) -> String {
    let c = comparison;
    let [first, last] = c.seeds;
    let mut text = format!(
        "# Methods compared in `{}`\n\nMade by\n\n```sh\n{command}\n```\n\nwith wayhome {} (world file SHA-256 `{}`).\n\n![Share of runs that come \
         home](compare.svg)\n\nAll contenders run on `{}` with `{}` bearings from the same random starts (seeds {first} to {last}), at {} m/s, for \
         {} s at most. *Home* claimed to be home and came to rest within {:.0} cm of it; *wrong claims* claimed it and came to rest farther off. *Time ratio* is time \
         over straight-line time and *path ratio* path over straight distance, medians of the runs that came home; *final* is the median \
         distance from home at the end of all runs. A homing vector says nothing of the distance: methods that steer by one slow down as it \
         shortens, hence their time ratio. ",
        c.world,
        c.version,
        c.world_sha256,
        name(&c.plant),
        name(&c.bearings),
        c.speed_m_s,
        c.time_limit_s,
        100.0 * c.arrival_radius_m,
    );
    if let Some(spacing) = c.grid_spacing_m {
        let _ = write!(
            text,
            "*AAE* is the mean angle between homing vector and direction of home over a grid of {} starts {spacing:.2} m apart, and *catchment* \
             the share of them from which it comes home, all with a heading of {:.0} degrees.",
            c.standings.first().map_or(0, |s| s.grid.len()),
            c.grid_heading_rad.to_degrees()
        );
    }
    let _ = write!(text, "\n\n| {} |\n|---|---|{}\n", HEAD.join(" | "), "---:|".repeat(HEAD.len() - 2));
    for standing in &c.standings {
        let _ = writeln!(text, "| {} |", cells(standing).join(" | "));
    }
    for contender in c.standings.iter().map(|s| &s.contender) {
        if let MethodKind::Exec(program) = &contender.method {
            let _ = write!(text, "\n`{}` is the program `{program}`.\n", contender.key);
        }
    }
    if !maps.is_empty() {
        text += "\n## Where from\n\nGreen: came home from there. Red: did not. Arrows: the homing vector at standstill.\n";
    }
    for map in maps {
        let _ = write!(text, "\n![{map}]({map})\n");
    }
    text
}

/// A part's name as files and the command line have it.
fn name(part: &impl Serialize) -> String {
    serde_json::to_value(part).ok().and_then(|v| Some(v.as_str()?.to_owned())).unwrap_or_default()
}

/// Colour of starts from which a contender came home, and of others.
const HOME: &str = "#009e73";
const NOT_HOME: &str = "#c0143c";

/// The catchment of a contender, with its homing vectors where it has them.
fn map(world: &World, comparison: &Comparison, standing: &Standing) -> String {
    let at = |came: bool| {
        let of = move |g: &&crate::study::compare::GridStart| (g.outcome == Outcome::Home) == came;
        standing.grid.iter().filter(of).map(|g| Vector2::new(g.x_m, g.y_m))
    };
    let mut drawing = MapDrawing::new(world)
        .title(format!(
            "{}: home from {:.0} % of the grid",
            standing.contender.key,
            100.0 * standing.catchment_share.unwrap_or(0.0)
        ))
        .spots(at(true), HOME, "came home from here")
        .spots(at(false), NOT_HOME, "did not come home from here");
    let arrows: Vec<(Vector2<f64>, f64)> =
        standing.grid.iter().filter_map(|g| Some((Vector2::new(g.x_m, g.y_m), g.vector_rad?))).collect();
    if let (false, Some(spacing)) = (arrows.is_empty(), comparison.grid_spacing_m) {
        drawing = drawing.arrows(arrows, 0.6 * spacing, "homing vector");
    }
    drawing.to_svg()
}

/// Size of the chart's rows and columns, px.
const ROW_PX: f64 = 26.0;
const TOP_PX: f64 = 58.0;
const BAR_PX: [f64; 2] = [210.0, 640.0];
const WIDTH_PX: f64 = 900.0;

/// Shares that come home with their Wilson intervals, and the time ratio beside each.
fn chart(comparison: &Comparison) -> String {
    let rows = comparison.standings.len() as f64;
    let bottom = TOP_PX + rows * ROW_PX;
    let text = |content: &str, x: f64, y: f64, size: f64| {
        Text::new(content).set("x", px(x)).set("y", px(y)).set("font-size", px(size)).set("fill", "#1a1a1a")
    };
    let line = |a: [f64; 2], b: [f64; 2], colour: &str| {
        Line::new().set("x1", px(a[0])).set("y1", px(a[1])).set("x2", px(b[0])).set("y2", px(b[1])).set("stroke", colour)
    };
    let at = |share: f64| BAR_PX[0] + share * (BAR_PX[1] - BAR_PX[0]);
    let mut body = Group::new();
    for percent in [0, 25, 50, 75, 100] {
        let x = at(f64::from(percent) / 100.0);
        body = body
            .add(line([x, TOP_PX - 4.0], [x, bottom], "#e8e7e3"))
            .add(text(&format!("{percent} %"), x, bottom + 18.0, 11.0).set("text-anchor", "middle"));
    }
    body = body
        .add(text("came home", BAR_PX[0], TOP_PX - 10.0, 12.0))
        .add(text("time ratio", 690.0, TOP_PX - 10.0, 12.0))
        .add(text("told", 770.0, TOP_PX - 10.0, 12.0));
    for (k, s) in comparison.standings.iter().enumerate() {
        let middle = TOP_PX + (k as f64 + 0.5) * ROW_PX;
        let share = s.tally.home as f64 / s.tally.runs.max(1) as f64;
        let [low, high] = s.tally.home_share_95;
        let ratio = s.tally.time_ratio.median.map_or("-".to_owned(), |r| format!("{r:.2}"));
        body = body
            .add(text(&s.contender.key, BAR_PX[0] - 8.0, middle + 4.0, 12.0).set("text-anchor", "end"))
            .add(
                Rectangle::new()
                    .set("x", px(at(0.0)))
                    .set("y", px(middle - 8.0))
                    .set("width", px(at(share) - at(0.0)))
                    .set("height", 16)
                    .set("fill", "#0072b2"),
            )
            .add(line([at(low), middle], [at(high), middle], "#1a1a1a").set("stroke-width", 1.4))
            .add(line([at(low), middle - 4.0], [at(low), middle + 4.0], "#1a1a1a").set("stroke-width", 1.4))
            .add(line([at(high), middle - 4.0], [at(high), middle + 4.0], "#1a1a1a").set("stroke-width", 1.4))
            .add(text(&ratio, 690.0, middle + 4.0, 12.0))
            .add(text(told(&s.contender), 770.0, middle + 4.0, 12.0));
    }
    let height = bottom + 32.0;
    let title = format!("Methods compared in {}, seeds {} to {}", comparison.world, comparison.seeds[0], comparison.seeds[1]);
    svg::Document::new()
        .set("viewBox", (0, 0, WIDTH_PX, height))
        .set("width", px(WIDTH_PX))
        .set("height", px(height))
        .set("font-family", "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif")
        .add(Rectangle::new().set("width", px(WIDTH_PX)).set("height", px(height)).set("fill", "#ffffff"))
        .add(text(&title, 24.0, 26.0, 15.0).set("font-weight", "bold"))
        .add(body)
        .to_string()
        + "\n"
}

/// A length with one decimal at most.
fn px(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::compare::CONTENDERS;

    #[test]
    fn every_contender_has_a_map() {
        for contender in CONTENDERS {
            assert!(FILES.contains(&format!("map-{}.svg", contender.key).as_str()), "{}", contender.key);
        }
        assert_eq!(COLUMNS.trim_end().split(',').count(), 15);
    }
}
