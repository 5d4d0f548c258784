//! The renderer against closed forms and parry2d's ray cast, and properties that every picture has.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use parry2d::math::{Pose as ParryPose, Vector};
use parry2d::query::{Ray, RayCast};
use parry2d::shape::{Ball, ConvexPolygon, Segment};
use wayhome::geometry::{Pose, direction};
use wayhome::panorama::{INSTANCE_CEILING, INSTANCE_FLOOR, Panorama, Projection};
use wayhome::render::{CpuRenderer, Renderer, SHADER, Scene, View};
use wayhome::world::{Footprint, World};

/// An L-shaped room with bodies of every shape, as high as the room.
const HALL: &str = r#"
name = "hall"
room = { outline_m = [[-4, -3], [4, -3], [4, 0.5], [1, 0.5], [1, 3], [-4, 3]], height_m = 2.5 }
home = { x_m = 0, y_m = -1 }
camera = { height_m = 0.5, horizon = 0.5 }
light = { ambient = 0.4, lamps = [{ position_m = [-2, 0, 2.3], intensity = 1.5 }] }
landmarks = [
  { name = "pillar", position_m = [-2, 1.5], height_m = 2.5, shape = { disc = { radius_m = 0.3 } }, texture = { family = "brick" } },
  { name = "rack", position_m = [2.5, -2], heading_deg = 35, height_m = 2.5, shape = { box = { size_m = [0.8, 0.3] } }, texture = { family = "shelves" } },
  { name = "wedge", position_m = [-3, -2], heading_deg = -20, height_m = 2.5, shape = { polygon = { corners_m = [[-0.3, -0.3], [0.5, 0], [-0.2, 0.4]] } }, texture = { family = "posters" } },
]
"#;

/// Low, stacked and hanging boxes in front of a wall at x = 3; the camera is at the origin, 0.8 m high.
const STACK: &str = r#"
name = "stack"
room = { outline_m = [[-3, -3], [3, -3], [3, 3], [-3, 3]], height_m = 2.5, walls = [{ family = "posters" }] }
home = { x_m = 0, y_m = 0 }
camera = { height_m = 0.8, horizon = 0.5 }
robot = { height_m = 0.6 }
landmarks = [
  { name = "table", position_m = [1.5, 0], height_m = 0.5, shape = { box = { size_m = [1, 1] } }, texture = { family = "planks" } },
  { name = "box", position_m = [1.75, 0], elevation_m = 0.5, height_m = 0.2, shape = { box = { size_m = [0.3, 1] } }, texture = { family = "tiles" } },
  { name = "lintel", position_m = [1.5, 0], elevation_m = 1.4, height_m = 0.3, shape = { box = { size_m = [1, 1] } }, texture = { family = "noise" } },
]
"#;

fn world(text: &str) -> World {
    World::from_toml(text, "test").unwrap()
}

fn render(world: &World, projection: Projection, robot: Pose) -> Panorama {
    let scene = Scene::new(world).unwrap();
    let mut out = Panorama::black(projection);
    let bodies = world.body_poses();
    CpuRenderer::new().render(&scene, &View { projection, robot, bodies: &bodies }, &mut out).unwrap();
    out
}

/// Range and instance of what a horizontal ray meets, by parry2d.
fn cast(world: &World, origin: Pose, azimuth: f64) -> (f32, u16) {
    let d = direction(azimuth);
    let ray = Ray::new(Vector::new(origin.x as f32, origin.y as f32), Vector::new(d.x as f32, d.y as f32));
    let mut nearest = (f32::MAX, 0);
    let mut offer = |range: Option<f32>, instance: u16| {
        if let Some(range) = range.filter(|r| *r < nearest.0) {
            nearest = (range, instance);
        }
    };
    let corner = |k: usize| {
        let p = world.outline[k % world.outline.len()];
        Vector::new(p.x as f32, p.y as f32)
    };
    for k in 0..world.outline.len() {
        let wall = Segment::new(corner(k), corner(k + 1));
        offer(wall.cast_ray(&ParryPose::identity(), &ray, 100.0, true), world.wall_instance(k));
    }
    for body in &world.bodies {
        let p = body.pose;
        let at = ParryPose::new(Vector::new(p.x as f32, p.y as f32), p.heading as f32);
        let range = match &body.footprint {
            Footprint::Disc(radius) => Ball::new(*radius as f32).cast_ray(&at, &ray, 100.0, true),
            Footprint::Polygon(corners) => {
                let corners = corners.iter().map(|c| Vector::new(c.x as f32, c.y as f32)).collect();
                ConvexPolygon::from_convex_polyline(corners).unwrap().cast_ray(&at, &ray, 100.0, true)
            }
        };
        offer(range, body.instance);
    }
    nearest
}

#[test]
fn horizon_agrees_with_parrys_ray_cast() {
    let world = world(HALL);
    let projection = Projection { mount_rad: 0.2, ..Projection::new(1440, 31) };
    let horizon = 15;
    assert_eq!(projection.tan_elevation(f64::from(horizon)), 0.0);
    for robot in [Pose::new(0.0, -1.0, 0.3), Pose::new(-3.5, 2.5, -2.0), Pose::new(3.7, 0.3, 1.0)] {
        let picture = render(&world, projection, robot);
        for column in 0..projection.width {
            let at = (horizon * projection.width + column) as usize;
            let seen = (picture.range_m[at], picture.instance[at]);
            let azimuth = robot.heading + projection.azimuth(f64::from(column));
            // At an outline, either side of it will do.
            let allowed = [0.0, -2e-5, 2e-5].map(|e| cast(&world, robot, azimuth + e));
            let agrees = |a: &(f32, u16)| a.1 == seen.1 && (a.0 - seen.0).abs() < 3e-4 * a.0.max(1.0);
            assert!(allowed.iter().any(agrees), "column {column} of {robot:?}: {seen:?} not in {allowed:?}");
        }
    }
}

#[test]
fn low_stacked_and_hanging_boxes_are_seen_as_they_stand() {
    let world = world(STACK);
    // The tangents of the rows reach from 1 to -1.
    let projection = Projection::new(1440, 460);
    let picture = render(&world, projection, Pose::IDENTITY);
    let eye = 0.8;
    let [table, case, lintel] = [0, 1, 2].map(|k| world.bodies[k].instance);
    for row in 0..projection.height {
        let tan = projection.tan_elevation(f64::from(row));
        // Faces in the plane y = 0 that the ray meets: instance and horizontal distance. The nearest is seen.
        let mut faces = vec![(world.wall_instance(1), 3.0)];
        for (instance, x, bottom, top) in [(table, 1.0, 0.0, 0.5), (case, 1.6, 0.5, 0.7), (lintel, 1.0, 1.4, 1.7)] {
            let z = eye + x * tan;
            if z >= bottom && z <= top {
                faces.push((instance, x));
            }
        }
        for (instance, z, from, to) in [
            (table, 0.5, 1.0, 2.0),
            (case, 0.7, 1.6, 1.9),
            (lintel, 1.4, 1.0, 2.0),
            (INSTANCE_FLOOR, 0.0, 0.0, f64::MAX),
            (INSTANCE_CEILING, 2.5, 0.0, f64::MAX),
        ] {
            let x = (z - eye) / tan;
            if x >= from && x <= to {
                faces.push((instance, x));
            }
        }
        let (instance, x) = faces.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        let at = (row * projection.width) as usize;
        assert_eq!(picture.instance[at], instance, "row {row}, tangent {tan}");
        let range = x * (1.0 + tan * tan).sqrt();
        assert!((f64::from(picture.range_m[at]) / range - 1.0).abs() < 1e-5, "row {row}: {}", picture.range_m[at]);
    }
    let seen = |instance| (0..projection.height).any(|r| picture.instance[(r * projection.width) as usize] == instance);
    assert!([table, case, lintel, world.wall_instance(1)].into_iter().all(seen), "the rows cover all cases");
}

#[test]
fn a_turned_camera_sees_the_rolled_panorama() {
    let world = world(HALL);
    let projection = Projection::new(720, 90);
    let robot = Pose::new(-0.5, -1.2, 0.4);
    let straight = render(&world, projection, robot);
    let k = 123;
    let turned = render(&world, projection, Pose { heading: robot.heading + f64::from(k) * projection.pixel_rad(), ..robot });
    let mut different = 0;
    for row in 0..projection.height {
        for column in 0..projection.width {
            let a = (row * projection.width + (column + k) % projection.width) as usize;
            let b = (row * projection.width + column) as usize;
            let far = (0..3).any(|c| straight.rgba[4 * a + c].abs_diff(turned.rgba[4 * b + c]) > 2);
            different += usize::from(far || straight.instance[a] != turned.instance[b]);
        }
    }
    assert!(different * 1000 <= projection.pixels(), "{different} pixels differ");
}

#[test]
fn small_steps_change_the_picture_little() {
    // Unfiltered, patterns finer than a pixel flicker with every step.
    let world = world(HALL);
    let projection = Projection::new(720, 90);
    let at = |x: f64| render(&world, projection, Pose::new(x, -1.2, 0.4));
    let (here, there) = (at(-0.5), at(-0.495));
    let change: f64 = here.luma().iter().zip(there.luma()).map(|(a, b)| f64::from((a - b).abs())).sum();
    let change = change / projection.pixels() as f64;
    eprintln!("change {change}");
    assert!(change < 1.5, "{change} levels on average");
}

#[test]
fn threads_do_not_change_the_picture() {
    let world = world(HALL);
    let projection = Projection::new(300, 151);
    let robot = Pose::new(-0.5, -1.2, 0.4);
    // Outside a pool the rows are shared out, inside they are not.
    let shared = render(&world, projection, robot);
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| render(&world, projection, robot));
    assert!(shared == alone);
}

#[test]
fn the_shader_is_valid() {
    let module = naga::front::wgsl::parse_str(SHADER).unwrap_or_else(|e| panic!("{}", e.emit_to_string(SHADER)));
    let flags = naga::valid::ValidationFlags::all();
    naga::valid::Validator::new(flags, naga::valid::Capabilities::empty()).validate(&module).unwrap();
}

#[test]
fn a_view_that_cannot_be_is_refused() {
    let world = world(HALL);
    let scene = Scene::new(&world).unwrap();
    let mut out = Panorama::black(Projection::new(8, 8));
    let bodies = world.body_poses();
    let good = View { projection: out.projection, robot: Pose::IDENTITY, bodies: &bodies };
    let mut message = |view: View<'_>| CpuRenderer::new().render(&scene, &view, &mut out).unwrap_err().to_string();
    assert!(message(View { bodies: &bodies[1..], ..good }).contains("found 2, allowed is 3"));
    assert!(message(View { projection: Projection::new(0, 8), ..good }).contains("0 x 8"));
    assert!(message(View { robot: Pose { x: f64::NAN, ..good.robot }, ..good }).contains("NaN"));
}
