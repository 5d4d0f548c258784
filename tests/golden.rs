//! Golden strips: small pictures that must come out as they are kept, byte by byte, since the CPU renderer gives the same on every
//! machine.
//!
//! `WAYHOME_BLESS=1` writes them anew; look at them before they are kept. Without it a strip that is missing is a failure. What
//! came out instead, and the difference, are left in the folder for temporary files of the tests.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};

use image::{ColorType, RgbaImage};
use wayhome::geometry::Twist;
use wayhome::panorama::{Panorama, Projection, ProjectionKind};
use wayhome::random::Seed;
use wayhome::render::View;
use wayhome::render::{Camera, CpuRenderer, Scene};
use wayhome::world::{CameraPreset, LightPreset, World};

fn strip(world: &str, light: LightPreset, camera: CameraPreset, kind: ProjectionKind) -> Panorama {
    let world = World::open(world).unwrap();
    let projection = Projection { kind, ..world.projection_of_size(256, 48) };
    let optics = camera.optics();
    let scene = Scene::new(&world).unwrap().under(light, optics.exposure);
    let view = View { projection, robot: world.home, bodies: &world.body_poses() };
    let twist = Twist { v: 0.2, omega: 1.5 };
    let mut out = Panorama::black(projection);
    Camera::new(optics).take(&mut CpuRenderer::new(), &scene, &view, twist, Seed(9), &mut out).unwrap();
    out
}

/// Compares a strip with the one that is kept; what is wrong, if anything.
fn compare(name: &str, strip: &Panorama) -> Result<(), String> {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{name}.png"));
    let (width, height) = (strip.projection.width, strip.projection.height);
    let save = |path: &Path, pixels: &[u8]| image::save_buffer(path, pixels, width, height, ColorType::Rgba8).unwrap();
    if std::env::var("WAYHOME_BLESS").as_deref() == Ok("1") {
        std::fs::create_dir_all(golden.parent().unwrap()).unwrap();
        save(&golden, &strip.rgba);
        return Ok(());
    }
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("golden");
    std::fs::create_dir_all(&folder).unwrap();
    let got = folder.join(format!("{name}.png"));
    let kept: RgbaImage = match image::open(&golden) {
        Ok(kept) => kept.to_rgba8(),
        Err(error) => {
            save(&got, &strip.rgba);
            return Err(format!("{name}: no strip to compare with ({error}); it came out as {}", got.display()));
        }
    };
    if kept.dimensions() == (width, height) && kept.as_raw() == &strip.rgba {
        return Ok(());
    }
    save(&got, &strip.rgba);
    if kept.dimensions() != (width, height) {
        return Err(format!("{name}: {:?} pixels are kept; it came out as {}", kept.dimensions(), got.display()));
    }
    // Sixteen times enlarged.
    let pairs = kept.as_raw().chunks(4).zip(strip.rgba.chunks(4));
    let difference: Vec<u8> = pairs
        .flat_map(|(a, b)| [0, 1, 2, 3].map(|c| if c == 3 { 255 } else { a[c].abs_diff(b[c]).saturating_mul(16) }))
        .collect();
    let changed = difference.chunks(4).filter(|p| p[..3] != [0, 0, 0]).count();
    let shown = folder.join(format!("{name}-difference.png"));
    save(&shown, &difference);
    Err(format!("{name}: {changed} pixels differ; see {} and {}", got.display(), shown.display()))
}

#[test]
fn strips_come_out_as_they_are_kept() {
    let (day, flat) = (LightPreset::Day, ProjectionKind::Cylindrical);
    let strips = [
        ("lab", strip("lab", day, CameraPreset::Ideal, flat)),
        ("gallery", strip("gallery", day, CameraPreset::Ideal, flat)),
        ("gallery-night", strip("gallery", LightPreset::Night, CameraPreset::Night, flat)),
        ("gallery-dirty", strip("gallery", LightPreset::Evening, CameraPreset::Dirty, ProjectionKind::EqualAngle)),
        ("crowd-cheap", strip("crowd", LightPreset::Overcast, CameraPreset::Cheap, flat)),
    ];
    let faults: Vec<String> = strips.iter().filter_map(|(name, strip)| compare(name, strip).err()).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
