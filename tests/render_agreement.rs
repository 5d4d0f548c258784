//! The GPU renderer against its CPU twin: all built-in worlds and five more, under all lights and through all cameras but for
//! their noise, from random poses.
//!
//! Where there is no adapter this says loudly that it did not run, and fails if `WAYHOME_REQUIRE_GPU` is 1. A comparison that
//! fails leaves both pictures and their difference in the folder for temporary files, and says where.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, OnceLock};

use rand_pcg::rand_core::Rng;
use wayhome::Error;
use wayhome::geometry::{Pose, Twist, Vector2};
use wayhome::panorama::{Panorama, Projection, ProjectionKind};
use wayhome::random::{Seed, Stream};
use wayhome::render::{Camera, CpuRenderer, GpuRenderer, Renderer, Scene, View};
use wayhome::verify::render::building;
use wayhome::world::{CameraPreset, LightPreset, OpticsSpec, World};

/// Most pixels whose instance or range may differ, as a share: outlines, where the last bit decides.
const OUTLINES: f64 = 1e-3;
/// Greatest relative difference in range elsewhere.
const RANGE: f32 = 1e-4;
/// Greatest difference in a colour elsewhere, in levels.
const LEVELS: u8 = 2;
/// Most pixels elsewhere whose colours may differ more.
const COLOURS: f64 = 1e-3;

/// A room with a re-entrant corner, far from the origin, with bodies that stand, hang, and stand on one another.
const CELLAR: &str = r#"
name = "cellar"
seed = 7
home = { x_m = 11, y_m = 21 }
camera = { height_m = 0.55 }
robot = { height_m = 0.5 }

[room]
outline_m = [[10, 20], [16, 20], [16, 22.5], [13.5, 22.5], [13.5, 25], [10, 25]]
height_m = 2.2
walls = [
  { family = "brick" }, { family = "noise", period_m = 1.5 }, { family = "tiles" },
  { family = "brick" }, { family = "noise", period_m = 1.5 }, { family = "tiles" },
]
floor = { family = "tiles", colour = [120, 120, 130] }
ceiling = { family = "planks" }

[[landmarks]]
name = "barrel"
shape = { disc = { radius_m = 0.35 } }
position_m = [12, 23.5]
height_m = 0.4
texture = { family = "bands" }

[[landmarks]]
name = "bust"
shape = { disc = { radius_m = 0.15 } }
position_m = [12.05, 23.5]
height_m = 0.5
elevation_m = 0.4
heading_deg = 40
texture = { family = "posters", contrast = 1 }

[[landmarks]]
name = "duct"
shape = { box = { size_m = [2.5, 0.4] } }
position_m = [14, 21.2]
heading_deg = 10
height_m = 0.5
elevation_m = 1.2
texture = { family = "planks" }

[[obstacles]]
name = "wedge"
shape = { polygon = { corners_m = [[-0.3, -0.3], [0.4, -0.2], [0.2, 0.3], [-0.2, 0.2]] } }
position_m = [11, 22]
height_m = 0.25
texture = { family = "noise" }
"#;

/// Many bodies behind one another.
fn forest() -> String {
    let mut text = "name = \"forest\"\nhome = { x_m = 0, y_m = 0 }\n[room]\n\
        outline_m = [[-8, -6], [8, -6], [8, 6], [-8, 6]]\nheight_m = 3\nwalls = [{ family = \"posters\" }]\n[light]\n\
        ambient = 0.3\nlamps = [{ position_m = [0, 0, 2.8], intensity = 3 }, { position_m = [6, -3, 1], intensity = 1 }]\n"
        .to_owned();
    for k in 0..60 {
        let (x, y) = (-7.0 + 1.5 * f64::from(k % 10), -5.0 + 1.9 * f64::from(k / 10));
        let shape = match k % 3 {
            0 => "disc = { radius_m = 0.2 }",
            1 => "box = { size_m = [0.3, 0.5] }",
            _ => "polygon = { corners_m = [[-0.2, -0.2], [0.3, 0], [-0.2, 0.2]] }",
        };
        let family = ["posters", "shelves", "brick", "noise", "plain"][k as usize % 5];
        let height = 0.2 + 0.05 * f64::from(k % 17);
        text += &format!(
            "[[landmarks]]\nname = \"b{k}\"\nshape = {{ {shape} }}\nposition_m = [{x}, {y}]\nheading_deg = {}\n\
             height_m = {height}\ntexture = {{ family = \"{family}\", period_m = 2 }}\n",
            k * 37
        );
    }
    text
}

/// More bodies behind one another than a column keeps, each higher than the one before, listed from far to near and mixed.
fn queue() -> String {
    let mut text = "name = \"queue\"\nhome = { x_m = 0, y_m = 0 }\n[room]\n\
        outline_m = [[-1, -1], [9, -1], [9, 1], [-1, 1]]\nheight_m = 4\n"
        .to_owned();
    for k in 0..30 {
        let place = (k * 17) % 30;
        text += &format!(
            "[[landmarks]]\nname = \"b{k}\"\nshape = {{ box = {{ size_m = [0.1, 1.5] }} }}\n\
             texture = {{ family = \"brick\" }}\nposition_m = [{}, 0]\nheight_m = {}\n",
            1.0 + 0.25 * f64::from(place),
            0.35 + 0.09 * f64::from(place)
        );
    }
    text
}

/// The one device of this process: making several at once has crashed drivers.
fn device() -> Option<MutexGuard<'static, GpuRenderer>> {
    static DEVICE: OnceLock<Option<Mutex<GpuRenderer>>> = OnceLock::new();
    let device = DEVICE.get_or_init(|| match GpuRenderer::new() {
        Ok(renderer) => Some(Mutex::new(renderer)),
        Err(Error::NoAdapter(why)) => {
            eprintln!("\n*** NOT RUN: the GPU renderer was not compared, for there is no adapter ({why}) ***\n");
            assert!(std::env::var("WAYHOME_REQUIRE_GPU").as_deref() != Ok("1"), "WAYHOME_REQUIRE_GPU is 1");
            None
        }
        Err(error) => panic!("{error}"),
    });
    device.as_ref().map(|d| d.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
}

fn between(stream: &mut Stream, low: f64, high: f64) -> f64 {
    low + (high - low) * (stream.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// A free pose of the robot, and bodies that have turned.
fn free_pose(world: &World, stream: &mut Stream) -> (Pose, Vec<Pose>) {
    let turned = |p: Pose, stream: &mut Stream| Pose::new(p.x, p.y, p.heading + between(stream, -0.5, 0.5));
    let bodies: Vec<_> = world.body_poses().into_iter().map(|p| turned(p, stream)).collect();
    let reach = |f: fn(&Vector2<f64>) -> f64| {
        let all = world.outline.iter().map(f);
        (all.clone().fold(f64::MAX, f64::min), all.fold(f64::MIN, f64::max))
    };
    let ((x0, x1), (y0, y1)) = (reach(|p| p.x), reach(|p| p.y));
    loop {
        let pose = Pose::new(between(stream, x0, x1), between(stream, y0, y1), between(stream, -3.2, 3.2));
        if world.is_free(&pose, 0.0, &bodies).is_ok() {
            return (pose, bodies);
        }
    }
}

/// Shares of pixels that differ in instance or range, and of the others in colour.
fn differences(a: &Panorama, b: &Panorama) -> (f64, f64) {
    assert!(a.range_m.len() == b.range_m.len() && a.instance.len() == b.instance.len() && a.rgba.len() == b.rgba.len());
    let (mut outlines, mut colours) = (0, 0);
    for k in 0..a.projection.pixels() {
        if a.instance[k] != b.instance[k] || (a.range_m[k] - b.range_m[k]).abs() > RANGE * b.range_m[k] {
            outlines += 1;
        } else if (4 * k..4 * k + 4).any(|j| a.rgba[j].abs_diff(b.rgba[j]) > LEVELS) {
            colours += 1;
        }
    }
    let share = |n: i32| f64::from(n) / a.projection.pixels() as f64;
    (share(outlines), share(colours))
}

fn keep_evidence(name: &str, cpu: &Panorama, gpu: &Panorama) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("wayhome-agreement-{name}"));
    std::fs::create_dir_all(&folder).unwrap();
    let (width, height) = (cpu.projection.width, cpu.projection.height);
    let save = |file: &str, pixels: &[u8]| {
        image::save_buffer(folder.join(file), pixels, width, height, image::ColorType::Rgba8).unwrap();
    };
    save("cpu.png", &cpu.rgba);
    save("gpu.png", &gpu.rgba);
    // Colour differences, eight times enlarged; white where instances differ.
    let difference: Vec<u8> = (0..cpu.projection.pixels())
        .flat_map(|k| {
            let apart = cpu.instance[k] != gpu.instance[k];
            let channel = |c: usize| cpu.rgba[4 * k + c].abs_diff(gpu.rgba[4 * k + c]).saturating_mul(8);
            if apart { [255; 4] } else { [channel(0), channel(1), channel(2), 255] }
        })
        .collect();
    save("difference.png", &difference);
    folder
}

#[test]
fn gpu_and_cpu_agree() {
    let Some(mut gpu) = device() else { return };
    let mut cpu = CpuRenderer::new();
    let text = |text: &str| World::from_toml(text, "test").unwrap();
    let mut stream = Seed(1).stream("agreement");
    let (mut worst, mut total, mut pictures) = ((0.0_f64, 0.0_f64), (0.0, 0.0), 0.0);
    let (mut bytes, mut unequal) = (0, 0);
    let builtin = World::builtin_names().into_iter().map(|name| World::open(name).unwrap());
    let flat = text(include_str!("support/flat.toml"));
    for world in builtin.chain([text(CELLAR), text(&forest()), text(&queue()), flat, building(7).unwrap()]) {
        let name = world.spec.name.clone();
        let scene = Scene::new(&world).unwrap();
        for k in 0..LightPreset::ALL.len() * CameraPreset::ALL.len() {
            // Sizes that are no multiple of a workgroup or a band, too.
            let (width, height) = [(561, 81), (720, 90), (1000, 130)][k % 3];
            let kind = if k % 4 == 1 { ProjectionKind::EqualAngle } else { world.spec.camera.projection };
            let mount_rad = 0.1 * k as f64;
            let mut projection = Projection { mount_rad, kind, ..world.projection_of_size(width, height) };
            if k == 1 {
                // A row that looks level but for rounding.
                projection.horizon_row = 0.35 * f64::from(height);
            }
            let light = LightPreset::ALL[k % LightPreset::ALL.len()];
            let optics = OpticsSpec { noise: None, ..CameraPreset::ALL[k / LightPreset::ALL.len()].optics() };
            let scene = scene.under(light, optics.exposure);
            let (robot, bodies) = free_pose(&world, &mut stream);
            let view = View { projection, robot, bodies: &bodies };
            let twist = Twist { v: 0.3, omega: 0.5 };
            let take = |renderer: &mut dyn Renderer| {
                let mut out = Panorama::black(Projection::new(4, 4));
                Camera::new(optics).take(renderer, &scene, &view, twist, Seed(0), &mut out).unwrap();
                out
            };
            let (a, b) = (take(&mut cpu), take(&mut *gpu));
            bytes += a.rgba.len();
            unequal += a.rgba.iter().zip(&b.rgba).filter(|(a, b)| a != b).count();
            let (outlines, colours) = differences(&a, &b);
            if outlines > OUTLINES || colours > COLOURS {
                let folder = keep_evidence(&format!("{name}-{k}"), &a, &b);
                panic!(
                    "{name}, picture {k} ({light:?}, {optics:?}) at {:?}: {outlines:.5} of the pixels differ in instance or range, {colours:.5} in \
                     colour; see {}",
                    view.robot,
                    folder.display()
                );
            }
            worst = (worst.0.max(outlines), worst.1.max(colours));
            total = (total.0 + outlines, total.1 + colours);
            pictures += 1.0;
        }
    }
    eprintln!(
        "{}: {pictures} pictures; outlines differ in {:.6} of the pixels (worst {:.6}), colours in {:.6} (worst {:.6}), and \
         {unequal} of {bytes} bytes of colour at all",
        gpu.info().adapter,
        total.0 / pictures,
        worst.0,
        total.1 / pictures,
        worst.1
    );
}

#[test]
fn a_picture_beyond_the_device_is_refused() {
    let Some(mut gpu) = device() else { return };
    let world = World::from_toml(CELLAR, "test").unwrap();
    let scene = Scene::new(&world).unwrap();
    let bodies = world.body_poses();
    for (width, height, expected) in [(1 << 23, 2, "panorama size: found 8388608 x 2"), (2, 4097, "found 4097 rows")] {
        let view = View { projection: Projection::new(width, height), robot: world.home, bodies: &bodies };
        let message = gpu.render(&scene, &view, &mut Panorama::black(Projection::new(4, 4))).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}
