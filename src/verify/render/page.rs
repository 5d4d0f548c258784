//! The page on the renderer: how fast it is, and sheets of what it shows.

use std::fmt::Write;

use super::{RenderSpeeds, Throughput};
use crate::dataset::film;
use crate::draw::markdown::table;
use crate::draw::sheet::Sheet;
use crate::error::Result;
use crate::geometry::Twist;
use crate::panorama::Panorama;
use crate::random::Seed;
use crate::render::{Camera, CpuRenderer, RendererInfo, Scene, View};
use crate::storage::{OutputFolder, json};
use crate::world::{CameraPreset, LightPreset, World};

/// Size of the pictures on the sheets.
const SIZE_PX: (u32, u32) = (560, 70);
/// Poses on the sheet of a world.
const POSES: usize = 3;
/// World that shows the presets.
const SHOWROOM: &str = "gallery";

/// The sheets of the page with their files' names: one for each world, one for the presets of light and one for those of cameras.
///
/// # Errors
/// When a world cannot be rendered.
pub fn sheets() -> Result<Vec<(String, Sheet)>> {
    let mut sheets = Vec::new();
    for name in World::builtin_names() {
        sheets.push((format!("{name}.png"), world_sheet(&World::open(name)?)?));
    }
    let showroom = World::open(SHOWROOM)?;
    let scene = Scene::new(&showroom)?;
    let light = LightPreset::ALL.map(|light| (light, CameraPreset::Ideal, Twist::default()));
    let camera = CameraPreset::ALL.map(|camera| (LightPreset::Day, camera, Twist { v: 0.2, omega: 1.5 }));
    sheets.push(("light.png".into(), presets_sheet(&showroom, &scene, &light)?));
    sheets.push(("camera.png".into(), presets_sheet(&showroom, &scene, &camera)?));
    Ok(sheets)
}

/// Home and some places of a world, under its own light, as its own camera sees them.
fn world_sheet(world: &World) -> Result<Sheet> {
    let scene = Scene::new(world)?;
    let (mut camera, mut renderer) = (Camera::new(world.spec.camera.optics), CpuRenderer::new());
    let (mut sheet, mut panorama, bodies) = (Sheet::new(), Panorama::empty(), world.body_poses());
    for robot in film::poses(world, POSES, Seed(0))? {
        let view = View { projection: world.projection_of_size(SIZE_PX.0, SIZE_PX.1), robot, bodies: &bodies };
        camera.take(&mut renderer, &scene, &view, Twist::default(), Seed(0), &mut panorama)?;
        sheet.add(&panorama);
    }
    Ok(sheet)
}

/// The home of a world in other light, by other cameras.
fn presets_sheet(world: &World, scene: &Scene, takes: &[(LightPreset, CameraPreset, Twist)]) -> Result<Sheet> {
    let (mut sheet, mut panorama, bodies) = (Sheet::new(), Panorama::empty(), world.body_poses());
    for &(light, camera, twist) in takes {
        let optics = camera.optics();
        let lit = scene.under(light, optics.exposure);
        let view = View { projection: world.projection_of_size(SIZE_PX.0, SIZE_PX.1), robot: world.home, bodies: &bodies };
        Camera::new(optics).take(&mut CpuRenderer::new(), &lit, &view, twist, Seed(0), &mut panorama)?;
        sheet.add_colours(&panorama);
    }
    Ok(sheet)
}

/// Writes the page: what was measured, and the [`sheets()`].
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, found: &RenderSpeeds, sheets: &[(String, Sheet)]) -> Result<()> {
    for (name, sheet) in sheets {
        folder.write(name, &sheet.png(name)?)?;
    }
    folder.write("speed.json", json(found).as_bytes())?;
    folder.write("README.md", page(found).as_bytes())?;
    folder.finish()
}

/// One line a figure, for a terminal.
pub fn text(found: &RenderSpeeds) -> String {
    let mut text = header() + "\n";
    for speed in &found.speeds {
        let _ = writeln!(text, "{}", line(speed));
    }
    for ((width, height), times) in found.speedups() {
        let _ = writeln!(text, "{width} x {height}: two threads are {times:.2} times as fast as one");
    }
    for cost in &found.bodies {
        let _ = writeln!(text, "{:5} bodies: {:.0} us a panorama", cost.bodies, 1e6 * cost.panorama_s);
    }
    text
}

/// Heading of [`line()`].
fn header() -> String {
    format!("{:20} {:>10} {:>7} {:>12} {:>12} {:>15}", "", "size", "threads", "panoramas/s", "colours MB/s", "share of memset")
}

/// A figure as a line.
pub fn line(speed: &Throughput) -> String {
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

fn page(found: &RenderSpeeds) -> String {
    let speeds = found.speeds.iter().map(|s| {
        [
            s.what.clone(),
            format!("{} x {}", s.width, s.height),
            s.threads.to_string(),
            format!("{:.0}", s.panoramas_per_s),
            format!("{:.0}", 1e-6 * s.colour_bytes_per_s),
            format!("{:.1} %", 100.0 * s.share),
        ]
    });
    let times = found.speedups().into_iter().map(|((width, height), times)| format!("{times:.2} times at {width} x {height}"));
    let costs = found.bodies.iter().map(|cost| [cost.bodies.to_string(), format!("{:.0}", 1e6 * cost.panorama_s)]);
    let adapter = |gpu: &RendererInfo| format!("Graphics adapter: {}, {}.\n", gpu.adapter, gpu.driver);
    let world = |name: &str| format!("\n### {name}\n\n![{name}]({name}.png)\n");
    format!(
        include_str!("page.md"),
        version = crate::VERSION,
        processor = found.processor,
        adapter = found.gpu.as_ref().map_or_else(String::new, adapter),
        speeds = table("| size | threads | panoramas a second | colours, MB/s | share of the limit", speeds),
        times = times.collect::<Vec<_>>().join(", "),
        width = found.bodies_size.0,
        height = found.bodies_size.1,
        costs = table("bodies | a panorama, \u{b5}s", costs),
        lights = names(&LightPreset::ALL),
        cameras = names(&CameraPreset::ALL),
        worlds = World::builtin_names().into_iter().map(world).collect::<String>(),
    )
}

/// What files call some presets, in a row.
fn names<T: Copy + Into<&'static str>>(presets: &[T]) -> String {
    presets.iter().map(|&preset| format!("`{}`", preset.into())).collect::<Vec<_>>().join(", ")
}
