//! `wayhome render-report`: how fast the renderer is and what it shows, as a page.

use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;
use wayhome::dataset::film;
use wayhome::draw::sheet::Sheet;
use wayhome::geometry::Twist;
use wayhome::panorama::Panorama;
use wayhome::random::Seed;
use wayhome::render::{Camera, CpuRenderer, Scene, View};
use wayhome::storage::OutputFolder;
use wayhome::verify::render::page as render_report;
use wayhome::verify::render::{Effort, Findings};
use wayhome::world::{CameraPreset, LightPreset, World};

use super::context::{Context, Verdict};
use super::render::bench::measured;
use super::values::positive;

/// Arguments of `render-report`.
#[derive(Debug, clap::Args)]
pub struct RenderReportArgs {
    /// Seconds that go into each figure
    #[arg(long, value_name = "S", default_value = "2", allow_negative_numbers = true, value_parser = positive)]
    pub seconds: f64,
    /// Folder for the page
    #[arg(long, value_name = "DIR", default_value = "results/rendering")]
    pub out: PathBuf,
}

/// Size of the pictures on the sheets.
const SIZE: (u32, u32) = (560, 70);
/// Poses on the sheet of a world.
const POSES: usize = 3;
/// World that shows the presets.
const SHOWROOM: &str = "gallery";

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    findings: &'a Findings,
    out: String,
}

pub fn run(args: &RenderReportArgs, context: &Context) -> Result<Verdict> {
    let folder = OutputFolder::open(&args.out, "render-report", render_report::FILES)?;
    let mut sheets = Vec::new();
    for name in World::builtin_names() {
        sheets.push((format!("{name}.png"), world_sheet(&World::open(name)?)?));
    }
    let showroom = World::open(SHOWROOM)?;
    let scene = Scene::new(&showroom)?;
    let still = Twist::default();
    let light = LightPreset::ALL.map(|light| (light, CameraPreset::Ideal, still));
    let moving = Twist { v: 0.2, omega: 1.5 };
    let camera = CameraPreset::ALL.map(|camera| (LightPreset::Day, camera, moving));
    sheets.push((render_report::LIGHT.to_owned(), presets_sheet(&showroom, &scene, &light)?));
    sheets.push((render_report::CAMERA.to_owned(), presets_sheet(&showroom, &scene, &camera)?));
    let findings = measured(context, Effort { seconds: args.seconds })?;
    render_report::write(folder, &findings, &sheets)?;
    let output = Output { findings: &findings, out: args.out.display().to_string() };
    context.print(&output, || format!("{}files in {}\n", render_report::text(&findings), output.out))?;
    Ok(Verdict::Done)
}

/// Home and some places of a world, under its own light, as its own camera sees them.
fn world_sheet(world: &World) -> Result<Sheet> {
    let scene = Scene::new(world)?;
    let (mut camera, mut renderer) = (Camera::new(world.spec.camera.optics), CpuRenderer::new());
    let (mut sheet, mut panorama, bodies) = (Sheet::new(), Panorama::empty(), world.body_poses());
    for robot in film::poses(world, POSES, Seed(0))? {
        let view = View { projection: world.projection_of_size(SIZE.0, SIZE.1), robot, bodies: &bodies };
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
        let view = View { projection: world.projection_of_size(SIZE.0, SIZE.1), robot: world.home, bodies: &bodies };
        Camera::new(optics).take(&mut CpuRenderer::new(), &lit, &view, twist, Seed(0), &mut panorama)?;
        sheet.add_colours(&panorama);
    }
    Ok(sheet)
}
