//! Textures do not shimmer: features repeat when the robot turns by less than a pixel.
//!
//! A picture that is sampled without a filter shows something else wherever a pattern is finer than the pixels, as soon as these
//! have moved by a part of their width. Two controls tell what the measure can show. One takes every eighth column and row of a
//! picture eight times as large, whose pixels are filtered for its own size and thus too little: it shimmers. The other takes the
//! mean of 8 x 8 such pixels, as a perfect camera would: no renderer repeats better, since the extractor itself loses some.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use wayhome::geometry::{Pose, wrap};
use wayhome::panorama::{Panorama, Projection};
use wayhome::render::{CpuRenderer, Renderer, Scene, View};
use wayhome::vision::{Extractor, ExtractorSettings};
use wayhome::world::World;

/// Rotations, in pixels.
const TURNS: [f64; 3] = [0.23, 0.5, 0.77];
/// How near to where it must be a feature has to be found again, pixels.
const NEAR_PX: f64 = 0.5;

struct Studio {
    world: World,
    scene: Scene,
    renderer: CpuRenderer,
}

impl Studio {
    fn new(world: World) -> Self {
        Self { scene: Scene::new(&world).unwrap(), world, renderer: CpuRenderer::new() }
    }

    fn render(&mut self, projection: Projection, robot: Pose) -> Panorama {
        let mut out = Panorama::black(projection);
        let view = View { projection, robot, bodies: &self.world.body_poses() };
        self.renderer.render(&self.scene, &view, &mut out).unwrap();
        out
    }

    /// Three pictures: the renderer's, the mean of each 8 x 8 pixels of one eight times as large, and every eighth of those.
    fn take(&mut self, robot: Pose) -> [Panorama; 3] {
        const TIMES: usize = 8;
        let projection = self.world.projection();
        let (width, height) = (projection.width as usize, projection.height as usize);
        // Column 0 of the small picture looks along the middle of its eight.
        let large = self.world.projection_of_size((width * TIMES) as u32, (height * TIMES) as u32);
        let mount_rad = large.mount_rad - 0.5 * (TIMES - 1) as f64 * large.pixel_rad();
        let large = self.render(Projection { mount_rad, ..large }, robot);
        let (mut mean, mut every_eighth) = (Panorama::black(projection), Panorama::black(projection));
        for (k, (mean, one)) in mean.rgba.chunks_mut(4).zip(every_eighth.rgba.chunks_mut(4)).enumerate() {
            let (row, column) = (k / width, k % width);
            let at = |dr: usize, dc: usize| 4 * ((row * TIMES + dr) * width * TIMES + column * TIMES + dc);
            for c in 0..3 {
                let all = (0..TIMES * TIMES).map(|k| u32::from(large.rgba[at(k / TIMES, k % TIMES) + c]));
                mean[c] = (all.sum::<u32>() / (TIMES * TIMES) as u32) as u8;
                one[c] = large.rgba[at(TIMES / 2, TIMES / 2) + c];
            }
        }
        [self.render(projection, robot), mean, every_eighth]
    }

    /// For each kind of picture: share of home features that are found again where they must be, and the root mean square of the
    /// errors of those, pixels.
    fn repeats(&mut self) -> [(f64, f64); 3] {
        let (home, projection) = (self.world.home, self.world.projection());
        let mut extractors = self.take(home).map(|home| Extractor::new(ExtractorSettings::default(), &home));
        let snapshots = [0, 1, 2].map(|k| extractors[k].home_snapshot());
        let (mut found, mut sums) = ([0_usize; 3], [0.0; 3]);
        for turn in TURNS {
            let turn_rad = turn * projection.pixel_rad();
            let pictures = self.take(Pose { heading: home.heading + turn_rad, ..home });
            for (k, picture) in pictures.iter().enumerate() {
                for bearing in extractors[k].observe(picture) {
                    let at_home = snapshots[k].bearings[bearing.id.0 as usize].azimuth_rad;
                    let error_px = wrap(bearing.azimuth_rad - at_home + turn_rad) / projection.pixel_rad();
                    if error_px.abs() < NEAR_PX {
                        found[k] += 1;
                        sums[k] += error_px * error_px;
                    }
                }
            }
        }
        let share = |k: usize| found[k] as f64 / (TURNS.len() * snapshots[k].bearings.len()) as f64;
        [0, 1, 2].map(|k| (share(k), (sums[k] / found[k].max(1) as f64).sqrt()))
    }
}

/// A room of 7 x 6 m whose walls all have one texture.
fn plain_room(texture: &str) -> World {
    let text = format!(
        "name = \"one-texture\"\nseed = 3\n[room]\noutline_m = [[0, 0], [7, 0], [7, 6], [0, 6]]\nwalls = [{texture}]\n\
         floor = {{ family = \"planks\", contrast = 0.4 }}\n[home]\nx_m = 3.1\ny_m = 2.8\n"
    );
    World::from_toml(&text, "test").unwrap()
}

#[test]
fn features_repeat_under_rotation_by_parts_of_a_pixel() {
    let mut rooms: Vec<(String, World)> = ["noise", "brick", "planks", "tiles", "posters", "shelves"]
        .into_iter()
        .map(|family| (family.to_owned(), plain_room(&format!("{{ family = \"{family}\", contrast = 0.8 }}"))))
        .collect();
    rooms.extend(["lab", "gallery"].map(|name| (name.to_owned(), World::open(name).unwrap())));
    let count = rooms.len() as f64;
    let mut means = [0.0; 3];
    for (name, world) in rooms {
        let measured = Studio::new(world).repeats();
        let [(share, px), (perfect, perfect_px), (without, without_px)] = measured;
        eprintln!(
            "{name:8} {share:.3} repeat ({px:.3} px); perfect {perfect:.3} ({perfect_px:.3}), unfiltered {without:.3} ({without_px:.3})"
        );
        assert!(share > 0.88 * perfect, "{name}: {share}, perfect is {perfect}");
        for (mean, (share, _)) in means.iter_mut().zip(measured) {
            *mean += share / count;
        }
    }
    let [share, perfect, without] = means;
    eprintln!("mean     {share:.3} repeat; perfect {perfect:.3}, unfiltered {without:.3}");
    assert!(share > 0.95 * perfect);
    assert!(share - without > 0.5 * (perfect - without) && perfect - without > 0.05, "the measure notices shimmer");
}
