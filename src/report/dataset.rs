//! What goes with a data set: its card, and what a check of it found.

use std::fmt::Write;

use crate::dataset::check::{FaultKind, Inspection};
use crate::draw::sheet::Sheet;
use crate::error::Result;
use crate::panorama::{Panorama, ProjectionKind};
use crate::panorama_set::{ConditionDocument, Document, GridDocument, Layout, SeriesDocument};

/// The card of a set and its example pictures, by name.
///
/// # Errors
/// When a picture cannot be encoded.
pub fn card(layout: &dyn Layout, document: &Document, home: &Panorama) -> Result<Vec<(String, Vec<u8>)>> {
    let mut sheet = Sheet::new();
    sheet.add(home);
    Ok(vec![
        ("README.md".into(), card_text(layout, document).into_bytes()),
        ("examples/home.png".into(), sheet.png("examples/home.png")?),
    ])
}

fn card_text(layout: &dyn Layout, d: &Document) -> String {
    let p = d.projection;
    let truth = ["frames", "landmarks", "matches"].map(|table| (table, format!("truth/{table}-*.parquet")));
    let samples = layout.samples(d).into_iter().map(|files| ("samples", files));
    let config = |(name, files)| format!("- config_name: {name}\n  data_files: {files}\n");
    let condition = |c: &ConditionDocument| {
        let ConditionDocument { name, description, frames, left_out, .. } = c;
        let first = if d.series.is_some() { "/000000" } else { "" };
        format!("| `{name}` | {description} | {frames} | {left_out} | ![{name}](home/{name}{first}.rgb.png) |\n")
    };
    let series = |SeriesDocument { count, .. }: &SeriesDocument| {
        format!(
            "\nThere are {count} worlds, each with as many poses, give or take one; what is said here of one world is said of \
             the first. Each row names its world and its kind. `worlds/N.json` tells of world N, from 0, what opens it, its home, the height \
             of its camera, its spots and its instances; `home/CONDITION/N.rgb.png` is its home panorama.\n"
        )
    };
    let grid = |g: &GridDocument| {
        let (GridDocument { rows, columns, spacing_m, first_m: [x, y], home }, s) = (g, g.spacing_m);
        let home = home.map_or_else(String::new, |[i, j]| format!("; home is place ({i}, {j})"));
        format!(
            "\nThe grid has {rows} rows and {columns} columns, {spacing_m} m apart: place (i, j) lies at ({x} + j {s}, {y} - i {s}) m in the \
             room{home}.\n"
        )
    };
    let mirrored = format!(
        "Columns of the tables and pictures in `home/` are counted anti-clockwise: column c there is column ({} - c) mod {} of the \
         files.\n",
        p.width, p.width
    );
    format!(
        include_str!("dataset.md"),
        licence_key = d.licence.to_lowercase(),
        configs = truth.into_iter().chain(samples).map(config).collect::<String>(),
        world = d.world,
        frames = d.frames,
        width = p.width,
        height = p.height,
        version = d.version,
        licence = d.licence,
        command = d.command,
        sha = d.world_sha256,
        seed = d.seed,
        renderer = d.renderer,
        conditions = d.conditions.iter().map(condition).collect::<String>(),
        series = d.series.as_ref().map_or_else(String::new, series),
        grid = d.grid.as_ref().map_or_else(String::new, grid),
        layout = d.layout,
        files = layout.about_files(),
        mount = p.mount_rad.to_degrees(),
        turn = if layout.is_clockwise() { "falls" } else { "grows" },
        rows = match p.kind {
            ProjectionKind::Cylindrical => "the tangent of elevation",
            ProjectionKind::EqualAngle => "elevation",
        },
        horizon = p.horizon_row,
        camera = d.camera_height_m,
        unit = d.range_unit,
        mirrored = if layout.is_clockwise() { mirrored } else { String::new() },
    )
}

/// What a check found, for a terminal.
pub fn inspection(found: &Inspection, folder: &std::path::Path) -> String {
    let mut text = String::new();
    for fault in &found.faults {
        let kind = match fault.kind {
            FaultKind::Missing => "missing",
            FaultKind::Cut => "cut off",
            FaultKind::Altered => "altered",
            FaultKind::Extra => "extra",
            FaultKind::Unfinished => "unfinished",
        };
        let _ = writeln!(text, "{kind:10} {}", fault.path);
    }
    let good = if found.faults.is_empty() { "OK".to_owned() } else { format!("{} faults", found.faults.len()) };
    let _ = writeln!(text, "{}: {good}, {} files, {:.1} MB", folder.display(), found.files, found.bytes as f64 / 1e6);
    text
}
