//! Batches of panoramas: the same pictures as one by one, in order, with moving bodies, in bounded memory.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use wayhome::Error;
use wayhome::geometry::Pose;
use wayhome::panorama::{Panorama, Projection};
use wayhome::render::{CpuRenderer, GpuRenderer, InstructionSet, Renderer, Scene, View};
use wayhome::world::World;

/// A robot that turns on the spot while all bodies wander.
struct Film {
    scene: Scene,
    projection: Projection,
    robot: Vec<Pose>,
    bodies: Vec<Vec<Pose>>,
}

impl Film {
    fn new(frames: u32, width: u32, height: u32) -> Self {
        let world = World::open("crowd").unwrap();
        let moved = |k: u32| {
            let step = 0.01 * f64::from(k);
            world.body_poses().iter().map(|p| Pose::new(p.x + step, p.y - step, p.heading + step)).collect()
        };
        Self {
            scene: Scene::new(&world).unwrap(),
            projection: world.projection_of_size(width, height),
            robot: (0..frames).map(|k| Pose { heading: 0.2 * f64::from(k), ..world.home }).collect(),
            bodies: (0..frames).map(moved).collect(),
        }
    }

    fn views(&self) -> Vec<View<'_>> {
        let view = |(robot, bodies): (&Pose, _)| View { projection: self.projection, robot: *robot, bodies };
        self.robot.iter().zip(self.bodies.iter().map(Vec::as_slice)).map(view).collect()
    }

    /// Renders the film as a batch and holds every picture against one rendered alone.
    fn check(&self, renderer: &mut dyn Renderer) {
        let views = self.views();
        let mut batch = Vec::new();
        renderer
            .render_batch(&self.scene, &views, &mut |first, panoramas| {
                assert_eq!(first, batch.len(), "in order");
                batch.extend_from_slice(panoramas);
                Ok(())
            })
            .unwrap();
        assert_eq!(batch.len(), views.len());
        let mut alone = Panorama::black(self.projection);
        for (k, (view, picture)) in views.iter().zip(&batch).enumerate() {
            renderer.render(&self.scene, view, &mut alone).unwrap();
            assert!(alone == *picture, "picture {k}");
        }
        assert!(batch[0].instance != batch[1].instance, "the bodies move");
    }
}

#[test]
fn a_batch_is_the_same_pictures_one_by_one() {
    Film::new(101, 96, 13).check(&mut CpuRenderer::new());
    let film = Film::new(7, 96, 13);
    // In pools of another size, and where threads share pictures.
    for threads in [1, 3, 16] {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| film.check(&mut CpuRenderer::new()));
    }
    film.check_sizes();
}

impl Film {
    fn check_sizes(&self) {
        let mut views = self.views();
        views[3].projection = Projection::new(200, 30);
        let mut sizes = Vec::new();
        CpuRenderer::new()
            .render_batch(&self.scene, &views, &mut |_, panoramas| {
                sizes.extend(panoramas.iter().map(|p| (p.projection.width, p.rgba.len())));
                Ok(())
            })
            .unwrap();
        assert_eq!(sizes[2..5], [(96, 4 * 96 * 13), (200, 4 * 200 * 30), (96, 4 * 96 * 13)]);
    }
}

#[test]
fn several_pictures_under_way_on_the_gpu_are_the_same_pictures() {
    match GpuRenderer::new() {
        Ok(mut renderer) => Film::new(40, 561, 81).check(&mut renderer),
        Err(Error::NoAdapter(why)) => {
            eprintln!("\n*** NOT RUN: there is no graphics adapter ({why}) ***\n");
            assert!(std::env::var("WAYHOME_REQUIRE_GPU").as_deref() != Ok("1"), "WAYHOME_REQUIRE_GPU is 1");
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_batch_ends_with_its_first_error() {
    let film = Film::new(200, 96, 13);
    let mut views = film.views();
    let mut calls = 0;
    let refused = CpuRenderer::new().render_batch(&film.scene, &views, &mut |_, _| {
        calls += 1;
        Err(Error::Interrupted)
    });
    assert!(matches!(refused, Err(Error::Interrupted)));
    assert_eq!(calls, 1);
    views[199].robot.x = f64::NAN;
    let mut shown = 0;
    let error = CpuRenderer::new().render_batch(&film.scene, &views, &mut |_, panoramas| {
        shown += panoramas.len();
        Ok(())
    });
    assert!(error.unwrap_err().to_string().contains("NaN"));
    assert_eq!(shown, 199);
    CpuRenderer::new().render_batch(&film.scene, &[], &mut |_, _| panic!("nothing to show")).unwrap();
}

#[test]
fn instruction_sets_and_their_widths_do_not_change_the_picture() {
    // Sizes that are no multiple of a vector, a group of columns or a band.
    for (width, height) in [(96, 13), (301, 517), (1000, 40)] {
        let film = Film::new(3, width, height);
        // Bodies so far away that their distance is no number.
        let far: Vec<_> = film.bodies[0].iter().map(|p| Pose { x: 1e39, y: 1e39, ..*p }).collect();
        let odd = View { bodies: &far, ..film.views()[0] };
        for view in film.views().into_iter().chain([odd]) {
            let picture = |set| {
                let mut out = Panorama::empty();
                CpuRenderer::on(set).unwrap().render(&film.scene, &view, &mut out).unwrap();
                out
            };
            let portable = picture(InstructionSet::Portable);
            for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
                assert!(picture(set) == portable, "{set}, {width} x {height}");
            }
        }
    }
}
