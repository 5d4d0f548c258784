//! Maps of robots as worlds, and worlds as maps.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says so by panicking")]

#[allow(dead_code, reason = "other tests use the rest")]
mod support;

use std::path::Path;

use parry2d::math::{Pose2, Vec2};
use parry2d::shape::{Ball, ConvexPolygon, Shape};
use support::{assert_exit, run};
use wayhome::geometry::{Pose, Vector2, direction};
use wayhome::panorama::Panorama;
use wayhome::render::{self, RendererChoice, Scene, View};
use wayhome::world::map::{FREE, ImportSettings, Imported, Map, OCCUPIED, UNKNOWN, export, import};
use wayhome::world::{Footprint, World};

/// What `map_server` writes with its default thresholds, and an image of these greys beside it.
fn write_map(folder: &Path, settings: &str, [columns, rows]: [usize; 2], greys: &[u8]) {
    let image = [format!("P5\n# drawn\n{columns} {rows}\n255\n").as_bytes(), greys].concat();
    std::fs::write(folder.join("map.pgm"), image).unwrap();
    std::fs::write(folder.join("map.yaml"), format!("image: map.pgm\n{settings}")).unwrap();
}

const USUAL: &str = "resolution: 0.05\norigin: [-1.0, 2, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

#[test]
fn pixels_mean_what_nav2_says() {
    let folder = tempfile::tempdir().unwrap();
    let read = |settings: &str, greys: &[u8]| {
        write_map(folder.path(), settings, [greys.len(), 1], greys);
        Map::load(&folder.path().join("map.yaml")).unwrap()
    };
    let greys = [0, 89, 90, 100, 101, 127, 204, 205, 206, 254, 255];
    let usual = read(USUAL, &greys);
    // Occupied is 1 - grey / 255 from 0.65 on, which 89 still has; free up to 0.196, which 206 has and 205 just misses.
    assert_eq!(usual.cells, [100, 100, -1, -1, -1, -1, -1, -1, 0, 0, 0]);
    assert_eq!((usual.origin, usual.resolution_m), (Pose::new(-1.0, 2.0, 0.0), 0.05));
    // By hand: (1 - 90/255 - 0.196) / 0.454 = 0.9937, (1 - 127/255 - 0.196) / 0.454 = 0.6740.
    let scale = read(&format!("{USUAL}mode: scale\n"), &greys);
    assert_eq!(scale.cells, [100, 100, 99, 91, 90, 67, 1, 0, 0, 0, 0]);
    let raw = read(&format!("{USUAL}mode: raw\n"), &greys);
    assert_eq!(raw.cells, [0, 89, 90, 100, -1, -1, -1, -1, -1, -1, -1]);
    assert!(raw.is_free(0) && !raw.is_free(1) && raw.is_occupied(2) && !raw.is_occupied(4));
    let negated = read(&USUAL.replace("negate: 0", "negate: true"), &greys);
    assert_eq!(negated.cells, [0, -1, -1, -1, -1, -1, 100, 100, 100, 100, 100]);
    // The grey of unknown cells is free with thresholds of another program, and the map says so.
    let wide = read(&USUAL.replace("0.196", "0.25"), &greys);
    assert!(wide.cells[7] == FREE && wide.warnings[0].contains("1 pixels have the grey 205"), "{:?}", wide.warnings);
    assert!(usual.warnings.is_empty());

    // The first row of an image is the farthest along y. Numbers may be written out, and white may be any number.
    std::fs::write(folder.path().join("map.pgm"), "P2\n2 2\n15\n15 15\n0 7\n").unwrap();
    assert_eq!(Map::load(&folder.path().join("map.yaml")).unwrap().cells, [100, -1, 0, 0]);
    // What is not opaque is unknown.
    let pixels = image::GrayAlphaImage::from_raw(3, 1, vec![255, 255, 255, 254, 0, 255]).unwrap();
    pixels.save(folder.path().join("map.png")).unwrap();
    std::fs::write(folder.path().join("map.yaml"), format!("image: map.png\n{USUAL}")).unwrap();
    assert_eq!(Map::load(&folder.path().join("map.yaml")).unwrap().cells, [FREE, UNKNOWN, OCCUPIED]);
}

/// A building of 7.5 x 6 m in cells of 5 cm, turned and far from its origin: a slanting wall, round and square pillars, posts of one
/// cell, a thin wall with a gap, an island with a bay, two boxes that meet in a corner, a courtyard that cannot be reached.
fn building() -> Map {
    let (columns, rows) = (150, 120);
    let cell = |k: usize| {
        let (x, y) = ((k % columns) as f64 + 0.5, (k / columns) as f64 + 0.5);
        let within = |low: [f64; 2], high: [f64; 2]| x > low[0] && x < high[0] && y > low[1] && y < high[1];
        let inside = within([4.0, 5.0], [146.0, 115.0]) && y < 190.0 - 0.7 * x;
        let round = (x - 40.0).hypot(y - 40.0) < 8.0;
        let thin = within([70.0, 5.0], [71.0, 60.0]) && !within([0.0, 20.0], [150.0, 38.0]);
        let bay = within([90.0, 20.0], [130.0, 60.0]) && !within([100.0, 30.0], [120.0, 61.0]);
        let meeting = within([20.0, 80.0], [30.0, 90.0]) || within([30.0, 90.0], [37.0, 97.0]);
        let posts = [(60.0, 80.0), (63.0, 80.0), (60.0, 84.0)].iter().any(|(u, v)| within([*u, *v], [u + 1.0, v + 1.0]));
        let court = within([95.0, 75.0], [115.0, 95.0]) && !within([98.0, 78.0], [112.0, 92.0]);
        let square = within([12.0, 20.0], [18.0, 26.0]);
        match (inside, round || thin || bay || meeting || posts || court || square) {
            (false, _) => UNKNOWN,
            (true, true) => OCCUPIED,
            (true, false) => FREE,
        }
    };
    Map::new(columns, rows, 0.05, Pose::new(-20.0, 35.0, 0.3), (0..columns * rows).map(cell).collect())
}

/// All that is solid in a world, by another library, up to the robot's height.
struct Solids(Vec<(Pose2, Box<dyn Shape>)>, Vec<Vector2<f64>>);

impl Solids {
    fn new(world: &World) -> Self {
        let of = |corners: &[Vector2<f64>]| -> Box<dyn Shape> {
            let corners: Vec<Vec2> = corners.iter().map(|c| Vec2::new(c.x as f32, c.y as f32)).collect();
            Box::new(ConvexPolygon::from_convex_hull(&corners).unwrap())
        };
        let bodies = world.bodies.iter().map(|b| {
            let at = Pose2::new(Vec2::new(b.pose.x as f32, b.pose.y as f32), b.pose.heading as f32);
            let shape: Box<dyn Shape> = match &b.footprint {
                Footprint::Disc(radius_m) => Box::new(Ball::new(*radius_m as f32)),
                Footprint::Polygon(corners) => of(corners),
            };
            (at, shape)
        });
        let stretches = world.partitions.iter().flat_map(|w| w.stretches(0.0, 0.3).into_iter().map(|s| w.footprint(s)));
        let walls = stretches.map(|corners| (Pose2::IDENTITY, of(&corners)));
        Self(bodies.chain(walls).collect(), world.outline.clone())
    }

    fn hold(&self, p: Vector2<f64>) -> bool {
        let crosses = |(a, b): (Vector2<f64>, Vector2<f64>)| {
            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        let n = self.1.len();
        let inside = (0..n).filter(|&k| crosses((self.1[k], self.1[(k + 1) % n]))).count() % 2 == 1;
        let point = Vec2::new(p.x as f32, p.y as f32);
        !inside || self.0.iter().any(|(at, shape)| shape.contains_point(at, point))
    }
}

fn imported(map: &Map) -> (Imported, World) {
    let imported = import(map, &ImportSettings::default()).unwrap();
    let world = World::from_toml(&imported.toml, "map.toml").unwrap();
    assert_eq!(world.spec, imported.spec);
    (imported, world)
}

/// The open places of a lattice that hang together with one. Those at its border are not open.
fn flood(count: usize, columns: usize, first: usize, is_open: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut reached = vec![false; count];
    let mut queue = vec![first];
    reached[first] = true;
    while let Some(k) = queue.pop() {
        for next in [k - 1, k + 1, k - columns, k + columns] {
            if !reached[next] && is_open(next) {
                reached[next] = true;
                queue.push(next);
            }
        }
    }
    reached
}

#[test]
fn what_is_reached_in_the_world_is_what_is_free_in_the_map() {
    let map = building();
    let (imported, world) = imported(&map);
    assert!(imported.report.deviation_m <= 0.05, "{:?}", imported.report);
    // The courtyard is another region.
    assert!((imported.report.left_out_m2 - 0.05 * 0.05 * 14.0 * 14.0).abs() < 1e-9, "{:?}", imported.report);
    let solids = Solids::new(&world);
    // Places every 1 cm, which a wall of 2 cm does not fall between.
    const FINER: usize = 5;
    let (columns, rows) = (FINER * map.columns, FINER * map.rows);
    let at = |k: usize| Vector2::new((k % columns) as f64 + 0.5, (k / columns) as f64 + 0.5) * 0.01;
    let cell = |k: usize| (k / columns / FINER) * map.columns + k % columns / FINER;
    let is_solid: Vec<bool> = (0..columns * rows).map(|k| solids.hold(map.origin.transform(at(k)))).collect();
    let home = map.origin.inverse_transform(world.home.position()) / 0.01;
    let first = home.y as usize * columns + home.x as usize;
    let (driven, free) = (
        flood(is_solid.len(), columns, first, |k| !is_solid[k]),
        flood(is_solid.len(), columns, first, |k| map.is_free(cell(k))),
    );
    // Farther from a border than it may have moved, both say the same.
    let reach = (imported.report.deviation_m / 0.01).ceil() as usize + 1;
    let mut looked_at = 0;
    for k in 0..columns * rows {
        let (x, y) = (k % columns, k / columns);
        if x < reach || y < reach || x + reach >= columns || y + reach >= rows {
            continue;
        }
        let around = (y - reach..=y + reach).flat_map(|y| (x - reach..=x + reach).map(move |x| y * columns + x));
        if around.into_iter().all(|n| free[n] == free[k]) {
            looked_at += 1;
            assert_eq!(driven[k], free[k], "at {} m of the map's lattice", at(k));
        }
    }
    assert!(looked_at > columns * rows / 2, "{looked_at}");
    // No disc as small as the smallest robot finds a place in what was solid.
    for k in (0..columns * rows).filter(|&k| !free[k] && !map.is_free(cell(k))) {
        let [p, r] = [map.origin.transform(at(k)), Vector2::new(0.105, 0.0)];
        let open = |turn: usize| !solids.hold(p + Pose::new(0.0, 0.0, 0.2 * turn as f64).transform(r));
        assert!(is_solid[k] || !(0..32).all(open) || driven[k], "a robot would stand at {} m", at(k));
    }
}

/// What the camera sees as far as it sees it is what a ray meets in the exported map.
#[test]
fn ranges_in_the_map_are_those_of_the_renderer() {
    const CELL_M: f64 = 0.02;
    for name in ["lab", "flat:17"] {
        let mut spec = World::open(name).unwrap().spec;
        // What the camera looks over or that hangs above the robot is in one of the two only.
        let eye_m = spec.camera.height_m;
        for list in [&mut spec.landmarks, &mut spec.obstacles] {
            list.retain(|b| b.elevation_m == 0.0 && b.height_m > eye_m && b.motion.is_none());
        }
        let world = World::from_spec(&spec, "tall.toml").unwrap();
        let map = export(&world, CELL_M).unwrap();
        let projection = world.projection_of_size(720, 90);
        let mut seen = Panorama::black(projection);
        let mut renderer = render::create(RendererChoice::Cpu).unwrap();
        let view = View { projection, robot: world.home, bodies: &world.body_poses() };
        renderer.render(&Scene::new(&world).unwrap(), &view, &mut seen).unwrap();
        let (eye, row) = (world.camera_pose(&world.home), projection.horizon_row as usize);
        let mut close = 0;
        for column in 0..720 {
            let range_m = f64::from(seen.range_m[row * 720 + column]);
            let towards = direction(eye.heading + projection.azimuth(column as f64));
            let is_free =
                |n: &usize| map.cell_at(eye.position() + towards * (0.001 * *n as f64)).is_some_and(|c| map.is_free(c));
            let in_map_m = 0.001 * (0..30_000).take_while(is_free).count() as f64;
            assert!(in_map_m <= range_m + 2.0 * CELL_M, "{name}, column {column}: {in_map_m} m in the map, {range_m} m seen");
            close += usize::from((in_map_m - range_m).abs() < 3.0 * CELL_M);
        }
        // The others graze a wall, which a map has up to a cell thicker.
        assert!(close > 680, "{name}: {close} of 720");
    }
}

#[test]
fn a_map_of_an_imported_map_is_the_map() {
    for (name, seed) in [("lab", 0), ("flat:17", 1), ("warehouse:3", 2)] {
        let map = export(&World::open(name).unwrap(), 0.05).unwrap();
        let home = World::open(name).unwrap().home;
        let settings = ImportSettings { home: Some(home), seed, tolerance_m: Some(0.0), ..ImportSettings::default() };
        let exact = import(&map, &settings).unwrap();
        assert!(exact.report.deviation_m < 1e-9, "{name}: {:?}", exact.report);
        let again = export(&World::from_toml(&exact.toml, "again.toml").unwrap(), 0.05).unwrap();
        let first = again.cell_at(home.position()).unwrap();
        let reached = flood(again.cells.len(), again.columns, first, |k| again.is_free(k));
        // The second map may begin elsewhere, and has nothing where the first one cannot be driven to.
        let (mut count, mut differ) = (0, 0);
        for cell in (0..reached.len()).filter(|k| reached[*k]) {
            count += 1;
            differ += usize::from(!map.cell_at(again.middle(cell)).is_some_and(|c| map.is_free(c)));
        }
        let area_m2 = count as f64 * 0.05 * 0.05;
        assert_eq!(differ, 0, "{name}: of {count}");
        assert!((area_m2 - exact.report.free_m2).abs() < 0.01 * area_m2, "{name}: {area_m2} m^2, {:?}", exact.report);
    }
}

#[test]
fn a_floor_plan_is_read_and_bad_maps_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let write = |name: &str, text: &str| std::fs::write(at.join(name), text).unwrap();
    // A plan on paper that goes on around it: two rooms of 3 x 3 m, one of them larger by a niche.
    let plan = image::GrayImage::from_fn(200, 120, |x, y| {
        let room = |low: u32, high: u32| x >= low && x < high && (20..80).contains(&y);
        let niche = (110..120).contains(&x) && (78..82).contains(&y);
        let wall = (16..144).contains(&x) && (16..84).contains(&y);
        let is_open = room(26, 80) || room(84, 140) || niche;
        image::Luma([if wall && !is_open { 20 } else { 240 }])
    });
    plan.save(at.join("plan.png")).unwrap();
    let import = |arguments: &[&str]| run(at, &[&["world", "import"], arguments].concat());
    assert_exit(&import(&["plan.png", "--resolution-m", "0.05", "--out", "plan.toml", "--seed", "3"]), 0, &[]);
    let world = World::load(&at.join("plan.toml")).unwrap();
    // Rows of an image run down: 84 to 140 of 200 columns, 20 to 80 of 120 rows.
    assert!(world.boundary().contains(Vector2::new(5.6, 3.5)) && !world.boundary().contains(Vector2::new(2.5, 3.5)));
    assert!((wayhome::world::polygon::signed_area(&world.outline) - (56.0 * 60.0 + 20.0) * 0.0025).abs() < 1e-9);
    // The same command may write the file again; no other file is touched.
    assert_exit(&import(&["plan.png", "--resolution-m", "0.05", "--out", "plan.toml"]), 0, &[]);
    write("own.toml", "mine = true\n");
    assert_exit(&import(&["plan.png", "--resolution-m", "0.05", "--out", "own.toml"]), 1, &["own.toml is there"]);

    let home = |home: &'static str| vec!["plan.png", "--resolution-m", "0.05", "--home", home];
    for (arguments, code, words) in [
        (vec!["plan.png"], 2, ["--resolution-m: found nothing", "map.yaml"]),
        (vec!["plan.png", "--resolution-m", "0"], 2, ["resolution-m", "greater than 0"]),
        (vec!["plan.png", "--resolution-m", "NaN"], 2, ["resolution-m", "finite"]),
        (vec!["plan.png", "--resolution-m", "40"], 2, ["found 40", "0.005 to 5 m"]),
        (vec!["plan.png", "--resolution-m", "0.005"], 1, ["largest free region", "is the resolution right?"]),
        (vec!["plan.png", "--resolution-m", "0.05", "--tolerance-m", "9"], 2, ["tolerance: found 9", "0 to 1 m"]),
        (vec!["plan.png", "--resolution-m", "0.05", "--height-m", "0.2"], 1, ["camera.height_m", "found 0.4"]),
        (home("4.1,3.5,0"), 2, ["home: found (4.1, 3.5) m, in an occupied cell", "a place in free space"]),
        (home("4.3,3.5,0"), 2, ["home: found (4.3, 3.5) m, about 0.08 m", "0.164 m around it"]),
        (home("-1,3.5,0"), 2, ["home: found (-1, 3.5) m, outside the map", "a place in free space"]),
        (vec!["none.yaml"], 1, ["cannot read none.yaml", "No such file"]),
    ] {
        assert_exit(&import(&arguments), code, &words);
    }

    let greys = vec![254; 60 * 60];
    for (change, words) in [
        (("image: map.pgm", "image: other.pgm"), ["cannot read other.pgm", "No such file"]),
        (("resolution: 0.05", "resolution: 0"), ["map.yaml: resolution: found 0,", "0.005 to 5"]),
        (("resolution: 0.05", "resolution: .nan"), ["map.yaml: resolution: found .nan", "0.005 to 5"]),
        (("negate: 0\n", ""), ["map.yaml: negate: found nothing", "Nav2 asks for it too"]),
        (("negate: 0", "negate: maybe"), ["map.yaml: negate: found \"maybe\"", "0, 1, false or true"]),
        (("origin: [-1.0, 2, 0.0]", "origin: [-1.0, 2]"), ["map.yaml: origin: found [-1.0, 2]", "[x, y, yaw]"]),
        (("origin: [-1.0, 2, 0.0]", "origin: [-1.0, 2000, 0.0]"), ["a corner at 2003 m", "within 1000 m"]),
        (("free_thresh: 0.196", "free_thresh: 0.9"), ["map.yaml: free_thresh: found 0.9", "less than occupied_thresh, 0.65"]),
        (("free_thresh: 0.196", "free_thresh: 0.001"), ["map.yaml: free cells: found none among 60 x 60", "free_thresh"]),
        (("negate: 0", "negate: 0\nmode: tinary"), ["map.yaml: mode: found \"tinary\"", "trinary, scale, raw"]),
        (("negate: 0", "negate: 0\nfree_tresh: 0.2"), ["map.yaml: \"free_tresh\": found an unknown key", "free_thresh"]),
        (("negate: 0", "negate: [0"), ["map.yaml: file: found", "YAML"]),
    ] {
        write_map(at, USUAL, [60, 60], &greys);
        let text = std::fs::read_to_string(at.join("map.yaml")).unwrap();
        assert!(text.contains(change.0), "{text}");
        write("map.yaml", &text.replace(change.0, change.1));
        assert_exit(&import(&["map.yaml"]), 1, &words);
    }
    write_map(at, USUAL, [60, 60], &greys[..2000]);
    assert_exit(&import(&["map.yaml"]), 1, &["map.pgm: image: found which cannot be decoded", "PNG"]);
    write_map(at, USUAL, [60_000, 60], &greys);
    assert_exit(&import(&["map.yaml"]), 1, &["map.pgm: image: found which is 60000 x 60 pixels", "16384 pixels a side"]);
    write_map(at, USUAL, [60, 60], &greys);
    assert_exit(&import(&["map.yaml", "--resolution-m", "0.1"]), 2, &["--resolution-m: found 0.1 beside a map.yaml"]);
    assert_exit(&import(&["map.yaml", "--out", "map.toml"]), 0, &[]);
}
