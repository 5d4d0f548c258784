//! The renderer against closed forms and parry2d's ray cast, and properties that every picture has.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use parry2d::math::{Pose as ParryPose, Vector};
use parry2d::query::{Ray, RayCast};
use parry2d::shape::{ConvexPolygon, Cuboid, Segment, SharedShape};
use wayhome::geometry::{Pose, Twist, Vector2, direction};
use wayhome::panorama::{INSTANCE_CEILING, INSTANCE_FLOOR, Panorama, Projection, ProjectionKind};
use wayhome::random::Seed;
use wayhome::render::{Camera, CpuRenderer, Renderer, SHADER, Scene, View};
use wayhome::verify::render::building;
use wayhome::world::spec::LightSpec;
use wayhome::world::{Body, Footprint, LightPreset, OpticsSpec, Window, World, WorldSpec};

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

/// Everything that stands in a room as shapes of parry2d, with instance and heights.
struct Shapes {
    walls: Vec<(Segment, u16)>,
    bodies: Vec<(SharedShape, ParryPose, u16, [f32; 2])>,
}

impl Shapes {
    fn of(world: &World, poses: &[Pose]) -> Self {
        let point = |p: &Vector2<f64>| Vector::new(p.x as f32, p.y as f32);
        let n = world.outline.len();
        let corner = |k: usize| point(&world.outline[k % n]);
        let walls = (0..n).map(|k| (Segment::new(corner(k), corner(k + 1)), world.wall_instance(k))).collect();
        let polygon = |corners: &[Vector2<f64>]| {
            SharedShape::new(ConvexPolygon::from_convex_polyline(corners.iter().map(point).collect()).unwrap())
        };
        let body = |(b, pose): (&Body, &Pose)| {
            let shape = match &b.footprint {
                Footprint::Disc(radius) => SharedShape::ball(*radius as f32),
                Footprint::Polygon(corners) => polygon(corners),
            };
            let at = ParryPose::new(point(&pose.position()), pose.heading as f32);
            (shape, at, b.instance, [b.bottom_m as f32, b.top_m as f32])
        };
        let window =
            |w: &Window| (polygon(&w.footprint), ParryPose::identity(), w.instance, [w.bottom_m as f32, w.top_m as f32]);
        let pieces = world.partitions.iter().flat_map(|w| w.pieces.iter().map(move |piece| (w, piece)));
        let pieces = pieces.map(|(w, piece)| {
            let heights = [piece.bottom_m as f32, piece.top_m as f32];
            (polygon(&w.footprint(piece.along_m)), ParryPose::identity(), w.instance, heights)
        });
        let bodies = world.bodies.iter().zip(poses).map(body).chain(world.windows.iter().map(window));
        let bodies = bodies.chain(pieces).collect();
        Self { walls, bodies }
    }

    /// What the upright plane through the camera at `azimuth` cuts: bodies as boxes of near, far, bottom and top, and the wall
    /// behind them.
    fn cut(&self, camera: Vector2<f64>, azimuth: f64) -> (Vec<([f32; 4], u16)>, f32, u16) {
        const REACH: f32 = 70.0;
        let d = direction(azimuth);
        let (origin, d) = (Vector::new(camera.x as f32, camera.y as f32), Vector::new(d.x as f32, d.y as f32));
        let (ray, back) = (Ray::new(origin, d), Ray::new(origin + d * REACH, -d));
        let walls = self
            .walls
            .iter()
            .filter_map(|(wall, instance)| Some((wall.cast_ray(&ParryPose::identity(), &ray, REACH, true)?, *instance)));
        let (wall, instance) = walls.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        let boxes = self.bodies.iter().filter_map(|(shape, at, instance, [bottom, top])| {
            let near = shape.cast_ray(at, &ray, REACH, true)?;
            let far = REACH - shape.cast_ray(at, &back, REACH, true)?;
            Some(([near, far, *bottom, *top], *instance))
        });
        (boxes.collect(), wall, instance)
    }
}

/// Range and instance of what a ray at `azimuth` and `tan` of elevation meets, by parry2d: first in the floor plan, then in the
/// upright plane of the ray.
fn cast(world: &World, shapes: &Shapes, robot: Pose, azimuth: f64, tan: f64) -> (f32, u16) {
    let (boxes, wall, wall_instance) = shapes.cut(world.camera_pose(&robot).position(), azimuth);
    let eye = Vector::new(0.0, world.spec.camera.height_m as f32);
    let length = (1.0 + tan * tan).sqrt();
    let ray = Ray::new(eye, Vector::new((1.0 / length) as f32, (tan / length) as f32));
    let height = world.spec.room.height_m as f32;
    let line = |x0, y0, x1, y1| Segment::new(Vector::new(x0, y0), Vector::new(x1, y1));
    let room = [
        (line(0.0, 0.0, wall, 0.0), INSTANCE_FLOOR),
        (line(0.0, height, wall, height), INSTANCE_CEILING),
        (line(wall, -0.1, wall, height + 0.1), wall_instance),
    ];
    let room = room.iter().filter_map(|(s, id)| Some((s.cast_ray(&ParryPose::identity(), &ray, 100.0, true)?, *id)));
    let bodies = boxes.iter().filter_map(|([near, far, bottom, top], id)| {
        let half = Vector::new(0.5 * (far - near), 0.5 * (top - bottom));
        let at = ParryPose::new(Vector::new(0.5 * (near + far), 0.5 * (bottom + top)), 0.0);
        Some((Cuboid::new(half).cast_ray(&at, &ray, 100.0, true)?, *id))
    });
    room.chain(bodies).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f32::MAX, 0))
}

#[test]
fn every_pixel_sees_what_parrys_rays_meet() {
    let built_in = World::builtin_names().into_iter().map(|name| World::open(name).unwrap());
    let mut stream = Seed(4).stream("poses");
    let (mut pixels, mut at_outlines) = (0, 0);
    for world in built_in.chain([world(HALL), world(STACK), world(include_str!("support/flat.toml")), building(7).unwrap()]) {
        // What can move has moved.
        let moved = |b: &Body| {
            if b.motion.is_some() { Pose::new(b.pose.x + 0.1, b.pose.y - 0.2, b.pose.heading + 0.7) } else { b.pose }
        };
        let bodies: Vec<Pose> = world.bodies.iter().map(moved).collect();
        let shapes = Shapes::of(&world, &bodies);
        for kind in [ProjectionKind::Cylindrical, ProjectionKind::EqualAngle] {
            let robot = Pose { heading: 0.3, ..world.random_start(&mut stream).unwrap_or(world.home) };
            let projection = Projection { mount_rad: 0.2, kind, ..world.projection_of_size(200, 80) };
            let mut picture = Panorama::black(projection);
            let view = View { projection, robot, bodies: &bodies };
            CpuRenderer::new().render(&Scene::new(&world).unwrap(), &view, &mut picture).unwrap();
            for k in 0..projection.pixels() {
                let (column, row) = (k as u32 % projection.width, k as u32 / projection.width);
                let azimuth = robot.heading + projection.azimuth(f64::from(column));
                let tan = projection.tan_elevation(f64::from(row));
                let seen = (picture.range_m[k], picture.instance[k]);
                let agrees = |a: (f32, u16)| a.1 == seen.1 && (a.0 - seen.0).abs() < 1e-4 * a.0.max(1.0);
                pixels += 1;
                if agrees(cast(&world, &shapes, robot, azimuth, tan)) {
                    continue;
                }
                // At an outline either side of it will do, and at a grazing angle parry's f32 is good for some 1e-6 rad.
                at_outlines += 1;
                let near = |e: f64, f: f64| cast(&world, &shapes, robot, azimuth + 3e-5 * e, tan + 3e-5 * f);
                let around = [-1.0, 0.0, 1.0].map(|e| [-1.0, 0.0, 1.0].map(|f| near(e, f)));
                let same = || around.iter().flatten().filter(|a| a.1 == seen.1).map(|a| a.0);
                let (low, high) = (same().fold(f32::MAX, f32::min), same().fold(0.0, f32::max));
                let found = (low * 0.9999..=high * 1.0001).contains(&seen.0);
                assert!(found, "{}: column {column}, row {row} of {robot:?}: {seen:?}, not {around:?}", world.spec.name);
            }
        }
    }
    eprintln!("{pixels} pixels, {at_outlines} of them at outlines");
    assert!(at_outlines * 1000 < pixels);
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

/// The texture of a wall inside the room runs on where there are openings, and its sides differ.
#[test]
fn openings_do_not_shift_the_texture_of_their_wall() {
    let room = |openings: &str| {
        let text = "name = \"walls\"\nhome = { x_m = 2, y_m = 2 }\ncamera = { height_m = 1.2, horizon = 0.5 }\n[room]\n\
            outline_m = [[0, 0], [8, 0], [8, 4], [0, 4]]\n[[walls]]\nfrom_m = [4, 0]\nto_m = [4, 4]\n\
            texture = { family = \"posters\" }\nopenings = [";
        world(&format!("{text}{openings}]"))
    };
    let pierced =
        "{ kind = \"door\", from_start_m = 0.5, width_m = 0.8 }, { kind = \"window\", from_start_m = 2, width_m = 1 }";
    let (whole, pierced) = (room(""), room(pierced));
    let projection = Projection::new(1440, 300);
    let wall = whole.partitions[0].instance;
    for robot in [Pose::new(2.2, 1.9, 0.0), Pose::new(6.1, 2.1, 3.0)] {
        let (a, b) = (render(&whole, projection, robot), render(&pierced, projection, robot));
        let of_both: Vec<usize> = (0..projection.pixels())
            .filter(|&k| a.instance[k] == wall && b.instance[k] == wall && a.range_m[k] == b.range_m[k])
            .collect();
        let all = a.instance.iter().filter(|id| **id == wall).count();
        assert!(of_both.len() > all / 2 && of_both.len() < all * 9 / 10, "{} of {all}", of_both.len());
        // Measured from another corner, a place on the wall is the same but for rounding.
        let same = of_both.iter().filter(|&&k| (4 * k..4 * k + 4).all(|c| a.rgba[c].abs_diff(b.rgba[c]) <= 2)).count();
        assert!(same * 1000 > of_both.len() * 999, "{same} of {}", of_both.len());
    }
    let inside = Pose::new(4.0, 3.7, 0.0);
    let (scene, bodies) = (Scene::new(&pierced).unwrap(), pierced.body_poses());
    let view = View { projection, robot: inside, bodies: &bodies };
    let refused = CpuRenderer::new().render(&scene, &view, &mut Panorama::empty()).unwrap_err().to_string();
    assert!(refused.contains("inside `inner wall 0`"), "{refused}");
}

/// Two places 4 m apart before a wall of 12 m: with a period of 4 m they look the same, and with none given they do not.
#[test]
fn a_wall_looks_the_same_in_two_places_only_where_its_file_asks_for_that() {
    let change = |period: &str| {
        let plain = "{ family = \"plain\" }";
        let world = world(&format!(
            "name = \"long\"\nhome = {{ x_m = 4, y_m = 1 }}\n[room]\noutline_m = [[0, 0], [12, 0], [12, 3], [0, 3]]\n\
             floor = {plain}\nwalls = [{{ family = \"posters\"{period} }}, {plain}, {plain}, {plain}]\n"
        ));
        let projection = Projection::new(720, 90);
        let [a, b] = [4.0, 8.0].map(|x| render(&world, projection, Pose::new(x, 1.5, 0.0)).luma());
        // Columns that look at the wall at an angle of up to 45 degrees.
        let columns = (450..630).flat_map(|column| (0..90).map(move |row| row * 720 + column));
        columns.map(|k| f64::from((a[k] - b[k]).abs())).sum::<f64>() / (180.0 * 90.0)
    };
    let (given, fitted) = (change(", period_m = 4"), change(""));
    assert!(given < 0.5 && fitted > 5.0, "{given} {fitted} levels on average");
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
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&world, projection, robot))
    };
    let alone = by(1);
    assert!(by(3) == alone && by(8) == alone);
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
    let mut poses = bodies.clone();
    poses[1].heading = f64::NAN;
    assert!(message(View { bodies: &poses, ..good }).contains("pose of body `rack`"));
    for (k, name) in ["pillar", "rack", "wedge"].into_iter().enumerate() {
        assert!(message(View { robot: bodies[k], ..good }).contains(&format!("inside `{name}`")), "{name}");
    }
    let sphere = Projection { kind: ProjectionKind::EqualAngle, ..Projection::new(80, 41) };
    assert!(message(View { projection: sphere, ..good }).contains("up to 92.2 degrees"));
}

/// A room of 6 x 6 m, white, with the camera at 1.25 m in its middle.
fn white_room(light: &str) -> World {
    let white = "{ family = \"plain\", colour = [255, 255, 255] }";
    world(&format!(
        "name = \"white\"\nhome = {{ x_m = 3, y_m = 3 }}\nrobot = {{ height_m = 1 }}\n[camera]\nheight_m = 1.25\nhorizon = 0.5\n\
         [room]\noutline_m = [[0, 0], [6, 0], [6, 6], [0, 6]]\nwalls = [{white}]\nfloor = {white}\nceiling = {white}\n\
         [light]\nambient = 0\n{light}\n"
    ))
}

/// Level of the pixel at the horizon that looks along `azimuth`.
fn level_at(picture: &Panorama, azimuth: f64) -> f64 {
    let p = picture.projection;
    let at = p.height as usize / 2 * p.width as usize + (p.column(azimuth) + 0.5) as usize % p.width as usize;
    f64::from(picture.rgba[4 * at])
}

#[test]
fn lamps_shine_by_the_inverse_square_and_lamberts_law() {
    let world = white_room("lamps = [{ position_m = [3, 4, 1.25], intensity = 3 }]");
    let picture = render(&world, Projection::new(720, 91), world.home);
    for degrees in [90.0_f64, 75.0, 60.0, 50.0] {
        // A point on the wall at y = 6, 2 m behind the lamp.
        let aside = 3.0 / degrees.to_radians().tan();
        let square = 4.0 + aside * aside;
        let wanted = 255.0 * 3.0 * (2.0 / square.sqrt()) / square;
        let seen = level_at(&picture, degrees.to_radians());
        assert!((seen - wanted).abs() < 1.5, "{degrees}: {seen}, {wanted}");
    }
}

#[test]
fn a_window_lights_a_wall_as_a_rectangle_of_even_radiance() {
    let world = white_room("windows = [{ wall = 0, along_m = [2, 4], height_m = [0.25, 2.25], brightness = 6 }]");
    let picture = render(&world, Projection::new(720, 91), world.home);
    // Four rectangles of 1 x 1 m meet at the foot of the normal of a point 5.99 m away; each has the configuration factor of a
    // rectangle over whose corner an element stands (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-3).
    let a = 1.0 / 5.99_f64;
    let side = a / (1.0 + a * a).sqrt();
    let factor = (2.0 * side * side.atan()) / std::f64::consts::TAU;
    let wanted = 255.0 * 6.0 * std::f64::consts::PI * 4.0 * factor;
    let seen = level_at(&picture, 90_f64.to_radians());
    assert!((seen / wanted - 1.0).abs() < 0.02, "{seen}, {wanted}");
    // The window itself is seen, brighter than white, and the wall around it gets nothing of its light.
    assert_eq!(level_at(&picture, -90_f64.to_radians()), 255.0);
    assert!(picture.instance.contains(&world.windows[0].instance));
    assert_eq!(level_at(&picture, -60_f64.to_radians()), 0.0);
}

#[test]
fn corners_are_darker_and_no_light_comes_from_nowhere() {
    let world = white_room("corner_shade = 0.5\ncorner_reach_m = 1");
    let ambient = World::from_spec(
        &WorldSpec { light: LightSpec { ambient: 0.8, ..world.spec.light.clone() }, ..world.spec.clone() },
        "test",
    )
    .unwrap();
    let picture = render(&ambient, Projection::new(720, 181), world.home);
    // 255 * 0.8 in the open, half of it in the corner; half a metre from it a quarter of the shade.
    assert_eq!(level_at(&picture, 0.0), 204.0);
    assert!((level_at(&picture, 45_f64.to_radians() + 1e-9) - 102.0).abs() < 6.0);
    assert!((level_at(&picture, (2.5 / 3.0_f64).atan()) - 204.0 * (1.0 - 0.5 * 0.25)).abs() < 2.0);
    assert!(render(&world, Projection::new(64, 9), world.home).rgba.chunks(4).all(|p| p == [0, 0, 0, 255]));
}

#[test]
fn exposure_scales_the_light_before_it_is_clipped() {
    let mut spec = white_room("lamps = [{ position_m = [3, 4, 1.25], intensity = 1 }]").spec;
    spec.light.ambient = 0.2;
    let world = World::from_spec(&spec, "test").unwrap();
    let projection = Projection::new(360, 45);
    let bodies = world.body_poses();
    let view = View { projection, robot: world.home, bodies: &bodies };
    for exposure in [0.25, 1.0, 2.5, 4.0] {
        let scene = Scene::new(&world).unwrap().under(LightPreset::Day, exposure);
        let mut picture = Panorama::black(projection);
        CpuRenderer::new().render(&scene, &view, &mut picture).unwrap();
        // Straight behind the lamp, 2 m from it, and on a wall that it does not reach at a right angle.
        for degrees in [90.0_f64, 60.0] {
            let aside = 3.0 / degrees.to_radians().tan();
            let square = 4.0 + aside * aside;
            let light = 0.2 + 2.0 / square.sqrt() / square;
            let (seen, wanted) = (level_at(&picture, degrees.to_radians()), (255.0 * exposure * light).min(255.0));
            assert!((seen - wanted).abs() < 1.5, "{exposure} {degrees}: {seen}, {wanted}");
        }
    }
}

/// While the shutter is open an edge sweeps over the pixels at even speed: it becomes a straight ramp as long as its way. What is
/// at the distance of a turning camera's wall moves by omega t, whatever the distance.
#[test]
fn an_edge_becomes_a_ramp_as_long_as_the_camera_turns() {
    let grey = |level: u8| format!("{{ family = \"plain\", colour = [{level}, {level}, {level}] }}");
    let world = world(&format!(
        "name = \"edge\"\nhome = {{ x_m = 3, y_m = 3 }}\nrobot = {{ height_m = 1 }}\n[camera]\nheight_m = 1.25\nhorizon = 0.5\n\
         [room]\noutline_m = [[0, 0], [6, 0], [6, 6], [0, 6]]\nwalls = [{}]\n[light]\nambient = 1\n[[landmarks]]\nname = \"screen\"\n\
         position_m = [5, 3]\nheight_m = 2.4\nshape = {{ box = {{ size_m = [0.1, 2] }} }}\ntexture = {}\n",
        grey(200),
        grey(40)
    ));
    let projection = Projection::new(1440, 31);
    let bodies = world.body_poses();
    let view = View { projection, robot: world.home, bodies: &bodies };
    let scene = Scene::new(&world).unwrap();
    let still = render(&world, projection, world.home);
    let edge = (1.0_f64 / 1.95).atan(); // of the screen's front face, to the left
    for (shutter_s, omega) in [(0.1, 0.3), (0.05, -1.0), (0.2, 0.2)] {
        let mut camera = Camera::new(OpticsSpec { shutter_s, ..OpticsSpec::default() });
        let mut out = Panorama::empty();
        let twist = Twist { v: 0.0, omega };
        camera.take(&mut CpuRenderer::new(), &scene, &view, twist, Seed(0), &mut out).unwrap();
        let way = shutter_s * f64::abs(omega);
        let pictures = (way / projection.pixel_rad()).ceil();
        for pixels in -12..=12 {
            let azimuth = edge + f64::from(pixels) * projection.pixel_rad();
            // The middle of the pixel that is looked at.
            let column = (projection.column(azimuth) + 0.5).floor();
            let from_edge = projection.azimuth(column) - edge;
            let wanted = 120.0 + 160.0 * (from_edge / way).clamp(-0.5, 0.5);
            let seen = level_at(&out, azimuth);
            assert!((seen - wanted).abs() <= 80.0 / pictures + 1.0, "{shutter_s} {omega}, {pixels}: {seen}, {wanted}");
        }
        // Range and instances are those of the middle of the exposure.
        assert_eq!((&out.range_m, &out.instance), (&still.range_m, &still.instance));
    }
}

#[test]
fn an_offset_camera_sees_what_a_robot_there_would() {
    let mut spec = world(HALL).spec;
    spec.camera.offset_m = [0.1, -0.05];
    let aside = World::from_spec(&spec, "test").unwrap();
    let robot = Pose::new(-0.5, -1.2, 0.7);
    let projection = Projection::new(300, 60);
    assert!(render(&aside, projection, robot) == render(&world(HALL), projection, aside.camera_pose(&robot)));
}
