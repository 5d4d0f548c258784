//! The page on the renderer: how fast it is, and sheets of what it shows.

use std::fmt::Write;

use crate::draw::sheet::Sheet;
use crate::error::Result;
use crate::storage::{OutputFolder, json};
use crate::verify::render::{Findings, Speed};
use crate::world::{CameraPreset, LightPreset, World};

/// Names of all files of the page.
pub const FILES: &[&str] = &[
    "README.md",
    "speed.json",
    "lab.png",
    "slippery.png",
    "crowd.png",
    "paper-ideal.png",
    "paper-grid.png",
    "proving-ground.png",
    "vardy-hall.png",
    "gallery.png",
    "light.png",
    "camera.png",
];

/// Sheet of the light presets, one below the other.
pub const LIGHT: &str = "light.png";
/// Sheet of the camera presets.
pub const CAMERA: &str = "camera.png";

/// Writes the page: what was measured, a sheet for each world with its file's name, and those of the presets.
///
/// # Errors
/// When a file cannot be written.
///
/// # Panics
/// When a sheet is none of [`FILES`], which is a fault in this program.
pub fn write(mut folder: OutputFolder, findings: &Findings, sheets: &[(String, Sheet)]) -> Result<()> {
    for (name, sheet) in sheets {
        folder.write(name, &sheet.png(name)?)?;
    }
    folder.write("speed.json", json(findings).as_bytes())?;
    folder.write("README.md", page(findings).as_bytes())?;
    folder.finish()
}

/// One line a figure, for a terminal.
#[must_use]
pub fn text(findings: &Findings) -> String {
    let mut text = header() + "\n";
    for speed in &findings.speeds {
        let _ = writeln!(text, "{}", line(speed));
    }
    for ((width, height), times) in findings.speedups() {
        let _ = writeln!(text, "{width} x {height}: two threads are {times:.2} times as fast as one");
    }
    for cost in &findings.bodies {
        let _ = writeln!(text, "{:5} bodies: {:.0} us a panorama", cost.bodies, 1e6 * cost.panorama_s);
    }
    text
}

/// Heading of [`line()`].
#[must_use]
pub fn header() -> String {
    format!("{:20} {:>10} {:>7} {:>12} {:>12} {:>15}", "", "size", "threads", "panoramas/s", "colours MB/s", "share of memset")
}

/// A figure as a line.
#[must_use]
pub fn line(speed: &Speed) -> String {
    format!(
        "{:20} {:>10} {:>7} {:>12.0} {:>12.0} {:>13.1} %",
        speed.what,
        format!("{}x{}", speed.width, speed.height),
        speed.threads,
        speed.panoramas_per_s,
        1e-6 * speed.colour_bytes_per_s,
        100.0 * speed.share
    )
}

fn page(findings: &Findings) -> String {
    let mut text = format!(
        "# The renderer\n\n\
        Made by `wayhome render-report --out results/rendering` with wayhome {}.\n\n\
        ## Speed\n\n\
        A round hall of 40 textured walls with 20 discs, floor and ceiling; colours, range and instance of every pixel; prefiltered\n\
        textures, no noise. Four bytes of colour a pixel are counted, six of range and instance come on top. The limit is to fill\n\
        256 MiB with one thread by the system's memset; it is timed again between any two of the runs whose median is shown. On\n\
        processors with large caches that is not all they can do: stores past the caches may be twice as fast.\n\
        `wayhome render --bench` prints the table of the machine at hand.\n\n",
        crate::VERSION
    );
    let _ = writeln!(text, "Processor: {}.", findings.processor);
    if let Some(gpu) = &findings.gpu {
        let _ = writeln!(text, "Graphics adapter: {}, {}.", gpu.adapter, gpu.driver);
    }
    text += "\n| | size | threads | panoramas a second | colours, MB/s | share of the limit |\n|---|---|---|---|---|---|\n";
    for s in &findings.speeds {
        let _ = writeln!(
            text,
            "| {} | {} x {} | {} | {:.0} | {:.0} | {:.1} % |",
            s.what,
            s.width,
            s.height,
            s.threads,
            s.panoramas_per_s,
            1e-6 * s.colour_bytes_per_s,
            100.0 * s.share
        );
    }
    text += "\nTwo threads, each with its own pictures, against one: ";
    let times: Vec<String> =
        findings.speedups().iter().map(|((width, height), times)| format!("{times:.2} times at {width} x {height}")).collect();
    let (width, height) = findings.bodies_size;
    let _ = writeln!(text, "{}.\n\nThe cost of bodies at {width} x {height}, one thread:\n", times.join(", "));
    text += "| bodies | a panorama, \u{b5}s |\n|---|---|\n";
    for cost in &findings.bodies {
        let _ = writeln!(text, "| {} | {:.0} |", cost.bodies, 1e6 * cost.panorama_s);
    }
    text += "\n## Light\n\nThe built-in world `gallery` by ";
    text += &names(&LightPreset::ALL);
    text += ".\n\n![Light](light.png)\n\n## Cameras\n\nThe same in motion, 0.2 m/s and 1.5 rad/s, by ";
    text += &names(&CameraPreset::ALL);
    text += ".\n\n![Cameras](camera.png)\n\n## Worlds\n\nFrom home and two places where a run may start: colours, range from near (light) to far \
             (dark), instances.\n";
    for name in World::builtin_names() {
        let _ = write!(text, "\n### {name}\n\n![{name}]({name}.png)\n");
    }
    text
}

/// What files call some presets, in a row.
fn names(presets: &[impl serde::Serialize]) -> String {
    let name = |preset| serde_json::to_string(preset).unwrap_or_default().replace('"', "`");
    presets.iter().map(name).collect::<Vec<_>>().join(", ")
}
