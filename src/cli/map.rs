//! `wayhome world import` and `wayhome world export`: maps of robots as worlds, and worlds as maps.

use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;
use wayhome::Error;
use wayhome::geometry::Pose;
use wayhome::world::World;
use wayhome::world::map::{self, COARSEST_M, FINEST_M, HEAD, ImportSettings, Map, Report, is_description};

use super::context::{Context, Verdict, open_folder, print, write_own};
use super::values::{not_negative, pose, positive};

/// Arguments of `world import`.
#[derive(Debug, clap::Args)]
pub struct ImportArgs {
    /// Map of ROS or Nav2 (map.yaml), or an image of a floor plan: dark is wall, light is free
    pub map: PathBuf,
    /// Edge of a pixel of a floor plan, m
    #[arg(long, value_name = "M", value_parser = positive)]
    pub resolution_m: Option<f64>,
    /// How far borders may move when they are simplified, m [default: one cell, at least 0.02]
    #[arg(long, value_name = "M", value_parser = not_negative)]
    pub tolerance_m: Option<f64>,
    /// Home in the map's frame [default: the place of the largest free region that is farthest from everything]
    #[arg(long, value_name = "X,Y,HEADING_DEG", value_parser = pose, allow_hyphen_values = true)]
    pub home: Option<Pose>,
    /// Seed of the textures
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Height of walls and of all that stands in the room, m: a map does not tell
    #[arg(long, value_name = "M", default_value_t = 2.5, value_parser = positive)]
    pub height_m: f64,
    /// Name of the world [default: that of the file]
    #[arg(long)]
    pub name: Option<String>,
    /// File for the world [default: stdout]
    #[arg(long, value_name = "FILE.toml")]
    pub out: Option<PathBuf>,
}

/// Arguments of `world export`.
#[derive(Debug, clap::Args)]
pub struct ExportArgs {
    /// World file, or the name of a built-in or generated world
    pub world: String,
    /// Edge of a cell, m
    #[arg(long, value_name = "M", default_value_t = 0.05, value_parser = positive)]
    pub resolution_m: f64,
    /// Folder for map.yaml, map.pgm and world.sdf [default: results/runs/map-WORLD]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// What `world import --json` prints.
#[derive(Serialize)]
struct ImportOutput<'a> {
    name: &'a str,
    #[serde(flatten)]
    report: &'a Report,
    out: Option<String>,
}

/// What `world export --json` prints.
#[derive(Serialize)]
struct ExportOutput {
    columns: usize,
    rows: usize,
    resolution_m: f64,
    origin_m: [f64; 2],
}

pub fn import(args: &ImportArgs, context: &Context) -> Result<Verdict> {
    let map = match args.resolution_m {
        None if is_description(&args.map) => Map::load(&args.map)?,
        None => {
            let allowed = "the edge of a pixel in m, as a floor plan has no description that tells it; or a map.yaml";
            return Err(invalid("--resolution-m", "nothing", allowed));
        }
        Some(resolution_m) if is_description(&args.map) => {
            return Err(invalid(
                "--resolution-m",
                &format!("{resolution_m} beside a map.yaml"),
                "the one that the map.yaml has",
            ));
        }
        Some(resolution_m) if !(FINEST_M..=COARSEST_M).contains(&resolution_m) => {
            return Err(invalid("--resolution-m", &resolution_m.to_string(), &format!("{FINEST_M} to {COARSEST_M} m")));
        }
        Some(resolution_m) => Map::load_plan(&args.map, resolution_m)?,
    };
    let stem = args.map.file_stem().unwrap_or_default().to_string_lossy();
    let settings = ImportSettings {
        name: args.name.clone().unwrap_or_else(|| named(&stem)),
        source: args.map.display().to_string(),
        command: context.command_line(&["out"]),
        tolerance_m: args.tolerance_m,
        home: args.home,
        seed: args.seed,
        height_m: args.height_m,
    };
    let imported = map::import(&map, &settings)?;
    match &args.out {
        Some(out) => write_own(out, &imported.toml, HEAD)?,
        None if !context.wants_json() => {
            print(&imported.toml)?;
            return Ok(Verdict::Done);
        }
        None => {}
    }
    let out = args.out.as_ref().map(|out| out.display().to_string());
    let output = ImportOutput { name: &settings.name, report: &imported.report, out };
    context.print(&output, || text(&imported.report, output.out.as_deref().unwrap_or_default()))?;
    Ok(Verdict::Done)
}

/// A name for a world, of the letters that one may have.
fn named(stem: &str) -> String {
    let letters: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    let name: String = letters.trim_start_matches(['-', '_', '.']).chars().take(64).collect();
    if name.is_empty() { "map".to_owned() } else { name }
}

fn text(report: &Report, out: &str) -> String {
    let Report { columns, rows, resolution_m, free_m2, left_out_m2, left_out_regions, specks, .. } = report;
    let Report { outline, walls, bodies, tolerance_m, deviation_m, home: [x, y, heading], .. } = report;
    let mut text = format!("{out}: {columns} x {rows} cells of {resolution_m} m, {free_m2:.1} m^2 free\n");
    if *left_out_regions > 0 {
        text += &format!("  left out: {left_out_m2:.1} m^2 in {left_out_regions} other free regions\n");
    }
    if *specks > 0 {
        text += &format!("  taken for free: {specks} specks of the unknown in free space\n");
    }
    text += &format!("  {outline} walls of the room, {walls} inner walls, {bodies} bodies\n");
    text += &format!("  borders move by at most {deviation_m:.3} m; {tolerance_m} m are allowed\n");
    text += &format!("  home at {x},{y},{heading}\n");
    report.warnings.iter().fold(text, |text, warning| text + &format!("warning: {warning}\n"))
}

pub fn export(args: &ExportArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(&args.world)?;
    let map = map::export(&world, args.resolution_m)?;
    let (path, mut folder) = open_folder(args.out.as_deref(), &["map", &world.spec.name], "world export")?;
    let home = &world.spec.home;
    let comments = [
        format!("World `{}`, drawn by `wayhome world export`; its frame is the map's.", world.spec.name),
        format!("Home, for an initial pose: x {} m, y {} m, yaw {} rad.", home.x_m, home.y_m, world.home.heading),
    ];
    folder.write("map.pgm", &map.pgm())?;
    folder.write("map.yaml", map.description("map.pgm", &comments).as_bytes())?;
    folder.write("world.sdf", world.to_sdf().as_bytes())?;
    folder.finish()?;
    let output = ExportOutput {
        columns: map.columns,
        rows: map.rows,
        resolution_m: map.resolution_m,
        origin_m: [map.origin.x, map.origin.y],
    };
    context.print_made(&output, &path, || {
        format!("{}: {} x {} cells of {} m\n", path.join("map.yaml").display(), map.columns, map.rows, map.resolution_m)
    })?;
    Ok(Verdict::Done)
}

fn invalid(what: &str, found: &str, allowed: &str) -> anyhow::Error {
    Error::Invalid { what: what.to_owned(), found: found.to_owned(), allowed: allowed.to_owned() }.into()
}
