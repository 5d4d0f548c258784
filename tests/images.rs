//! Image textures: from the file to the pixel, and everything that can be wrong with them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, Rgb, RgbImage};
use wayhome::geometry::Pose;
use wayhome::panorama::{Panorama, Projection};
use wayhome::render::{CpuRenderer, Renderer, Scene, View};
use wayhome::world::{CameraPreset, Pattern, World};

/// A room of 4 x 4 m with a box of 2 x 2 m, 2 m high, whose texture is `texture`.
fn world_text(texture: &str) -> String {
    format!(
        "name = \"images\"\n[room]\noutline_m = [[-4, -4], [4, -4], [4, 4], [-4, 4]]\nheight_m = 3\n[light]\nambient = 1\n\
         [home]\nx_m = 0\ny_m = 0\n[camera]\nheight_m = 1\nhorizon = 0.5\n[robot]\nheight_m = 0.8\n\
         [[landmarks]]\nname = \"board\"\nshape = {{ box = {{ size_m = [0.1, 2] }} }}\nposition_m = [2.05, 0]\nheight_m = 2\n\
         texture = {texture}\n"
    )
}

/// Loads a world that lies in `folder` and has `texture`.
fn load(folder: &Path, texture: &str) -> wayhome::Result<World> {
    let path = folder.join("world.toml");
    std::fs::write(&path, world_text(texture)).unwrap();
    World::load(&path)
}

/// An image with a colour a quarter: red and green above, blue and white below.
fn quarters() -> RgbImage {
    RgbImage::from_fn(64, 64, |x, y| match (x < 32, y < 32) {
        (true, true) => Rgb([200, 0, 0]),
        (false, true) => Rgb([0, 200, 0]),
        (true, false) => Rgb([0, 0, 200]),
        (false, false) => Rgb([200, 200, 200]),
    })
}

fn encoded(format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    quarters().write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

#[test]
fn an_image_is_seen_upright_the_right_way_round_and_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("art")).unwrap();
    for (name, format) in [("a.png", ImageFormat::Png), ("b.jpg", ImageFormat::Jpeg), ("c.ppm", ImageFormat::Pnm)] {
        std::fs::write(folder.path().join("art").join(name), encoded(format)).unwrap();
        // The board's west side, which home sees, is its fourth; a period of 2 m begins anew with each of the long sides.
        let world = load(folder.path(), &format!("{{ image = \"art/{name}\", period_m = 2.1 }}")).unwrap();
        let projection = Projection::new(720, 181);
        let mut seen = Panorama::black(projection);
        let view = View { projection, robot: Pose::IDENTITY, bodies: &world.body_poses() };
        CpuRenderer::new().render(&Scene::new(&world).unwrap(), &view, &mut seen).unwrap();
        // To the left of a person who looks at the board is a positive azimuth.
        let at = |azimuth: f64, tan: f64| {
            let pixel = projection.row(tan) as usize * 720 + projection.column(azimuth) as usize;
            [0, 1, 2].map(|c| seen.rgba[4 * pixel + c])
        };
        let near = |seen: [u8; 3], wanted: [u8; 3]| (0..3).all(|c| seen[c].abs_diff(wanted[c]) < 12);
        for (azimuth, tan, wanted) in
            [(0.25, 0.25, [200, 0, 0]), (-0.25, 0.25, [0, 200, 0]), (0.25, -0.25, [0, 0, 200]), (-0.25, -0.25, [200; 3])]
        {
            assert!(near(at(azimuth, tan), wanted), "{name} at {azimuth}, {tan}: {:?}, not {wanted:?}", at(azimuth, tan));
        }
    }
}

#[test]
fn a_built_in_world_brings_its_images_and_they_count_in_its_fingerprint() {
    let world = World::open("gallery").unwrap();
    assert!(world.bodies.iter().any(|b| matches!(b.texture.pattern, Pattern::Image(_))));
    let folder = tempfile::tempdir().unwrap();
    let file = |format| std::fs::write(folder.path().join("a.png"), encoded(format)).unwrap();
    file(ImageFormat::Png);
    let before = load(folder.path(), "{ image = \"a.png\" }").unwrap();
    file(ImageFormat::Pnm);
    let after = load(folder.path(), "{ image = \"a.png\" }").unwrap();
    assert_ne!(before.sha256, after.sha256);
    assert_eq!(before.bodies, after.bodies, "what counts is what is in a file, not how it is called");
}

#[test]
fn what_is_wrong_with_an_image_is_told_with_its_place() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("world");
    std::fs::create_dir_all(folder.join("sub")).unwrap();
    let good = encoded(ImageFormat::Png);
    let damaged = &good[..good.len() / 2];
    let png = |width: u32, height: u32| {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
        bytes.extend([width, height].map(u32::to_be_bytes).concat());
        bytes.extend([8, 2, 0, 0, 0, 0, 0, 0, 0]);
        bytes
    };
    std::fs::write(outer.path().join("secret.png"), &good).unwrap();
    for (name, bytes) in [
        ("good.png", &good[..]),
        ("damaged.png", damaged),
        ("text.png", b"hello"),
        ("empty.png", b""),
        ("zero.png", &png(0, 0)),
        ("wide.png", &png(100_000, 8)),
    ] {
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    let mut cases = vec![
        ("missing.png", "cannot be read"),
        ("damaged.png", "cannot be decoded"),
        ("text.png", "cannot be decoded"),
        ("empty.png", "cannot be decoded"),
        ("zero.png", "0 x 0 pixels, allowed is 1 to 16384 pixels a side"),
        ("wide.png", "100000 x 8 pixels"),
        ("sub", "no file"),
        ("", "outside the world file's folder"),
        ("../secret.png", "outside the world file's folder"),
        ("sub/../../secret.png", "outside the world file's folder"),
        ("/etc/hostname", "outside the world file's folder"),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(outer.path().join("secret.png"), folder.join("link.png")).unwrap();
        std::os::unix::fs::symlink(outer.path(), folder.join("up")).unwrap();
        std::os::unix::fs::symlink(folder.join("good.png"), folder.join("inside.png")).unwrap();
        cases.extend([("link.png", "outside the world file's folder"), ("up/secret.png", "outside the world file's folder")]);
        load(&folder, "{ image = \"inside.png\" }").unwrap();
    }
    for (image, reason) in cases {
        let message = load(&folder, &format!("{{ image = \"{image}\" }}")).unwrap_err().to_string();
        let place = format!("landmarks[0].texture.image (\"board\"): found \"{image}\"");
        assert!(message.contains(&place) && message.contains(reason) && message.contains("line "), "{image}: {message}");
    }
    let neither = load(&folder, "{ colour = [1, 2, 3] }").unwrap_err().to_string();
    assert!(neither.contains("landmarks[0].texture (\"board\"): found neither family nor image"), "{neither}");
    let both = load(&folder, "{ family = \"brick\", image = \"good.png\" }").unwrap_err().to_string();
    assert!(both.contains("found an image beside a family"), "{both}");
    let unknown = load(&folder, "{ family = \"bricks\" }").unwrap_err().to_string();
    assert!(unknown.contains("found \"bricks\", allowed is \"plain\", \"noise\", \"brick\""), "{unknown}");
    load(&folder, "{ image = \"./good.png\" }").unwrap();
}

#[test]
fn a_cameras_preset_fills_what_the_file_leaves_out() {
    let text = |camera: &str| world_text("{ family = \"brick\" }").replace("[camera]\n", &format!("[camera]\n{camera}\n"));
    let optics = |camera: &str| World::from_toml(&text(camera), "test").unwrap().spec.camera.optics;
    assert_eq!(optics(""), CameraPreset::Ideal.optics());
    assert_eq!(optics("preset = \"cheap\""), CameraPreset::Cheap.optics());
    let mixed = optics("preset = \"cheap\"\noptics = { gamma = 1.0 }");
    assert_eq!(mixed, wayhome::world::OpticsSpec { gamma: 1.0, ..CameraPreset::Cheap.optics() });
    let message = World::from_toml(&text("preset = \"night\"\noptics = { gamma = -1.0 }"), "test").unwrap_err().to_string();
    assert!(message.contains("camera.optics.gamma: found -1, allowed is 0.1 to 10"), "{message}");
}
