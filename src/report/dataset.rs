//! What goes with a data set: its card, and what a check of it found.

use std::fmt::Write;

use crate::dataset::check::{FaultKind, Inspection};
use crate::draw::sheet::Sheet;
use crate::error::Result;
use crate::panorama::Panorama;
use crate::panorama_set::{Document, Layout};

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
    let mut text = format!(
        "---\nlicense: {}\npretty_name: Panoramas of {}\ntags:\n- robotics\n- visual-homing\n- panorama\n- synthetic\nconfigs:\n",
        d.licence.to_lowercase(),
        d.world
    );
    for table in ["frames", "landmarks", "matches"] {
        let _ = write!(text, "- config_name: {table}\n  data_files: truth/{table}-*.parquet\n");
    }
    for files in layout.samples(d) {
        let _ = write!(text, "- config_name: samples\n  data_files: {files}\n");
    }
    let p = d.projection;
    let _ = write!(
        text,
        "---\n\n# Panoramas of `{}`\n\n{} panoramas of {} x {} pixels, rendered in a simulated room by wayhome {}. Licence: {}.\n\n\
         ![Colours, range and instances at home](examples/home.png)\n\n*Home: colours, range from near (light) to far (dark), \
         instances.*\n\n```sh\n{}\n```\n\nmakes the set again, byte by byte. SHA-256 of the world: `{}`. Seed: {}. Renderer: {}.\n\n\
         ## Conditions\n\n| condition | what it is | frames | left out | home |\n|---|---|---|---|---|\n",
        d.world, d.frames, p.width, p.height, d.version, d.licence, d.command, d.world_sha256, d.seed, d.renderer
    );
    for c in &d.conditions {
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | {} | ![{}](home/{}.rgb.png) |",
            c.name, c.description, c.frames, c.left_out, c.name, c.name
        );
    }
    text += "\nPoses at which the robot cannot stand are left out; `left-out.csv` names them and what is in the way.\n";
    if let Some(g) = &d.grid {
        let [x, y] = g.first_m;
        let _ = write!(
            text,
            "\nThe grid has {} rows and {} columns, {} m apart: place (i, j) lies at ({x} + j {}, {y} - i {}) m in the room{}.\n",
            g.rows,
            g.columns,
            g.spacing_m,
            g.spacing_m,
            g.spacing_m,
            g.home.map_or_else(String::new, |[i, j]| format!("; home is place ({i}, {j})"))
        );
    }
    let _ = write!(text, "\n## Files\n\nLayout: `{}`. {}\n", d.layout, layout.about_files());
    text += &projection(layout, d);
    text += TRUTH;
    text
}

fn projection(layout: &dyn Layout, d: &Document) -> String {
    let (p, clockwise) = (d.projection, layout.is_clockwise());
    let column = if clockwise { "falls" } else { "grows" };
    let rows = match p.kind {
        crate::panorama::ProjectionKind::Cylindrical => "the tangent of elevation",
        crate::panorama::ProjectionKind::EqualAngle => "elevation",
    };
    let mut text = format!(
        "\nA panorama is a full turn. Column 0 looks {:.3} degrees to the left of the robot's heading, and azimuth, anti-clockwise, \
         {column} by 2 pi / {} a column. Rows are even in {rows} by the same step; the horizon is {:.2} rows below the top edge. The \
         camera is {} m above the floor. Range is in {}. Instance ids are those of `dataset.json`.\n",
        p.mount_rad.to_degrees(),
        p.width,
        p.horizon_row,
        d.camera_height_m,
        d.range_unit
    );
    if clockwise {
        let _ = writeln!(
            text,
            "Columns of the tables and pictures in `home/` are counted anti-clockwise: column c there is column ({} - c) mod {} of the \
             files.",
            p.width, p.width
        );
    }
    text
}

const TRUTH: &str = "\n## Truth\n\n\
| file | holds |\n|---|---|\n\
| `truth/frames-*.parquet`, `.jsonl` | pose of robot and camera of each frame, place of the grid, time on a trajectory; in the JSON lines its \
landmarks too |\n\
| `truth/landmarks-*.parquet` | for each frame and landmark: bearing from the heading, horizontal range, whether it is visible, pixels that \
show it, pixels that would if nothing else were in the room, share of them that is hidden |\n\
| `truth/matches-*.parquet` | for each frame: features of the condition's home panorama, and where the same point of the surface is in the \
frame; those that are hidden there are left out |\n\
| `home/*.png` | the home panorama of each condition |\n\
| `dataset.json` | all of the above about the set as a whole, for programs |\n\
| `parts/*.json` | the parts in which the set was made, with length and SHA-256 of their files |\n\
| `SHA256SUMS` | sums of all files: `sha256sum --check SHA256SUMS`, or `wayhome dataset check DIR` |\n\n\
Lengths are metres, angles radians anti-clockwise. `frame` numbers frames through the whole set, `spot` within a condition: the same spot is \
the same pose in every condition.\n";

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
