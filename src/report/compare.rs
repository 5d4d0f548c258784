//! The files of a comparison: a table for people, one for programs, a bar chart, and a map for each contender.

use svg::node::element::Group;

use super::curves::document;
use super::text::{columns, number, percent_95};
use crate::draw::chart::{INK, SERIES, Stroke, line, rectangle, stroked, text};
use crate::draw::map::MapDrawing;
use crate::draw::markdown::table_of_numbers;
use crate::episode::Outcome;
use crate::error::Result;
use crate::geometry::Vector2;
use crate::method::MethodKind;
use crate::storage::OutputFolder;
use crate::storage::csv::{Columns, csv, number as cell};
use crate::study::compare::{Comparison, Contender, Standing};
use crate::world::World;

/// Writes all files of a comparison that `command` has made.
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, world: &World, comparison: &Comparison, command: &str) -> Result<()> {
    folder.write("compare.csv", csv(COLUMNS, &comparison.standings).as_bytes())?;
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

/// Columns of `compare.csv`.
const COLUMNS: &Columns<Standing> = &[
    ("contender", |s| s.contender.key.to_string()),
    ("told", |s| told(&s.contender).to_owned()),
    ("law", |s| s.contender.law.to_string()),
    ("runs", |s| s.tally.runs.to_string()),
    ("home", |s| s.tally.home.to_string()),
    ("home_share_low_95", |s| cell(s.tally.home_share_95[0])),
    ("home_share_high_95", |s| cell(s.tally.home_share_95[1])),
    ("wrong_claims", |s| s.tally.wrong_claims.to_string()),
    ("time_ratio_median", |s| cell(s.tally.time_ratio.median)),
    ("time_ratio_p90", |s| cell(s.tally.time_ratio.p90)),
    ("path_ratio_median", |s| cell(s.path_ratio.median)),
    ("final_distance_median_m", |s| cell(s.tally.final_distance_m.median)),
    ("final_distance_p90_m", |s| cell(s.tally.final_distance_m.p90)),
    ("aae_deg", |s| cell(s.aae_rad.map(f64::to_degrees))),
    ("catchment_share", |s| cell(s.catchment_share)),
];

/// Names of a table's columns, and the cells of a contender's row.
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

fn cells(s: &Standing) -> [String; 11] {
    let t = &s.tally;
    let rounded = |value: Option<f64>, decimals: usize| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.decimals$}"));
    [
        s.contender.key.to_string(),
        told(&s.contender).to_owned(),
        format!("{}/{}", t.home, t.runs),
        percent_95(t),
        t.wrong_claims.to_string(),
        number(t.time_ratio.median, 1.0, ""),
        number(t.time_ratio.p90, 1.0, ""),
        number(s.path_ratio.median, 1.0, ""),
        rounded(t.final_distance_m.median.map(|m| 100.0 * m), 1),
        rounded(s.aae_rad.map(f64::to_degrees), 1),
        rounded(s.catchment_share.map(|share| 100.0 * share), 0),
    ]
}

/// The comparison for a terminal.
pub fn table(comparison: &Comparison) -> String {
    let rows = std::iter::once(HEAD.map(str::to_owned)).chain(comparison.standings.iter().map(cells));
    columns(2, &rows.collect::<Vec<_>>())
}

/// The comparison as Markdown.
pub fn readme(comparison: &Comparison, command: &str, maps: &[String]) -> String {
    let c = comparison;
    let grid = |spacing: f64| {
        format!(
            "*AAE* is the mean angle between homing vector and direction of home over a grid of {} starts {spacing:.2} m apart, and *catchment* \
             the share of them from which it comes home, all with a heading of {:.0} degrees.",
            c.standings.first().map_or(0, |s| s.grid.len()),
            c.grid_heading_rad.to_degrees()
        )
    };
    let program = |contender: &Contender| match &contender.method {
        MethodKind::Exec(program) => format!("\n`{}` is the program `{program}`.\n", contender.key),
        _ => String::new(),
    };
    let from = "\n## Where from\n\nGreen: came home from there. Red: did not. Arrows: the homing vector at standstill.\n";
    let from = if maps.is_empty() { "" } else { from };
    format!(
        include_str!("compare.md"),
        command = command,
        world = c.world,
        version = c.version,
        sha = c.world_sha256,
        first = c.seeds[0],
        last = c.seeds[1],
        plant = c.plant,
        bearings = c.bearings,
        speed = c.speed_m_s,
        limit = c.time_limit_s,
        radius = 100.0 * c.arrival_radius_m,
        grid = c.grid_spacing_m.map_or_else(String::new, grid),
        table = table_of_numbers(&HEAD.join(" | "), 2, c.standings.iter().map(cells)),
        programs = c.standings.iter().map(|s| program(&s.contender)).collect::<String>(),
        maps = [from.to_owned()].into_iter().chain(maps.iter().map(|map| format!("\n![{map}]({map})\n"))).collect::<String>(),
    )
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
const RATIO_PX: f64 = 690.0;
const TOLD_PX: f64 = 770.0;
const WIDTH_PX: f64 = 900.0;

/// Shares that come home with their Wilson intervals, and the time ratio beside each.
fn chart(comparison: &Comparison) -> String {
    let bottom = TOP_PX + comparison.standings.len() as f64 * ROW_PX;
    let write = |content: &str, x: f64, y: f64, size: f64| text(content, x, y, size).set("fill", INK);
    let stroke = Stroke { colour: INK, width_px: 1.4, dashes: "" };
    let at = |share: f64| BAR_PX[0] + share * (BAR_PX[1] - BAR_PX[0]);
    let mut body = Group::new()
        .add(write("came home", BAR_PX[0], TOP_PX - 10.0, 12.0))
        .add(write("time ratio", RATIO_PX, TOP_PX - 10.0, 12.0))
        .add(write("told", TOLD_PX, TOP_PX - 10.0, 12.0));
    for percent in [0, 25, 50, 75, 100] {
        let x = at(f64::from(percent) / 100.0);
        body = body
            .add(line([x, TOP_PX - 4.0], [x, bottom]).set("stroke", "#e8e7e3"))
            .add(write(&format!("{percent} %"), x, bottom + 18.0, 11.0).set("text-anchor", "middle"));
    }
    for (k, s) in comparison.standings.iter().enumerate() {
        let middle = TOP_PX + (k as f64 + 0.5) * ROW_PX;
        let [low, high] = s.tally.home_share_95.map(at);
        let bar = rectangle([at(0.0), middle - 8.0, at(s.tally.home_share), middle + 8.0]);
        body = body
            .add(write(&s.contender.key, BAR_PX[0] - 8.0, middle + 4.0, 12.0).set("text-anchor", "end"))
            .add(bar.set("fill", SERIES[0]))
            .add(stroked(line([low, middle], [high, middle]), &stroke))
            .add(write(&number(s.tally.time_ratio.median, 1.0, ""), RATIO_PX, middle + 4.0, 12.0))
            .add(write(told(&s.contender), TOLD_PX, middle + 4.0, 12.0));
        for end in [low, high] {
            body = body.add(stroked(line([end, middle - 4.0], [end, middle + 4.0]), &stroke));
        }
    }
    let title = format!("Methods compared in {}, seeds {} to {}", comparison.world, comparison.seeds[0], comparison.seeds[1]);
    let page = document([WIDTH_PX, bottom + 32.0]).add(write(&title, 24.0, 28.0, 15.0).set("font-weight", "bold"));
    page.add(body).to_string() + "\n"
}
