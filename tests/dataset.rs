//! Data sets: what is written is read back equal, interrupted and split work gives the same bytes, damage is found.

#![allow(clippy::unwrap_used, reason = "helpers of tests are not recognised as tests")]

#[allow(dead_code, reason = "other tests use the rest")]
mod support;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use support::{assert_same_files, files};
use wayhome::Error;
use wayhome::dataset::check::{FaultKind, check};
use wayhome::dataset::conditions::Condition;
use wayhome::dataset::pipeline::{Job, Outcome};
use wayhome::dataset::plan::{Headings, Places, Plan, Request};
use wayhome::episode::{PlantKind, SensorKind, Setup, Simulation, Start};
use wayhome::geometry::{Pose, wrap};
use wayhome::method::MethodKind;
use wayhome::panorama::Panorama;
use wayhome::panorama_set::{LayoutKind, PanoramaSet, Place};
use wayhome::render::{CpuRenderer, Renderer, Scene, View};
use wayhome::report::dataset::card;
use wayhome::sensor::{DatasetChoice, DatasetField, DatasetSensor, Sensor};
use wayhome::table::{Cells, Table};
use wayhome::vision::ExtractorSettings;
use wayhome::world::World;

/// Width of the small panoramas here.
const SIZE: (u32, u32) = (180, 24);

fn request(layout: LayoutKind) -> Request {
    Request {
        places: Places::Grid { columns: 5, rows: 4, spacing_m: 0.9, origin_m: None },
        headings: Headings::Own,
        conditions: ["original", "night+moved"].iter().map(|c| c.parse().unwrap()).collect(),
        size_px: Some(SIZE),
        layout,
        seed: 3,
        licence: "Apache-2.0".into(),
        command: "test".into(),
    }
}

fn make(plan: &Plan, out: &Path, shard: (usize, usize)) -> Result<Outcome, Error> {
    Job { plan, out, shard, extras: &card }.run(&mut CpuRenderer::new(), &mut |_| ControlFlow::Continue(()))
}

fn faults(folder: &Path) -> Vec<(String, FaultKind)> {
    let found = check(folder, &|_, _| ControlFlow::Continue(())).unwrap();
    found.faults.into_iter().map(|f| (f.path, f.kind)).collect()
}

#[test]
fn every_layout_is_read_back_equal() {
    let world = World::open("lab").unwrap();
    for layout in LayoutKind::written() {
        let folder = tempfile::tempdir().unwrap();
        let plan = Plan::new(&world, request(layout)).unwrap();
        assert!(make(&plan, folder.path(), (1, 1)).unwrap().complete);
        assert_eq!(faults(folder.path()), [], "{layout:?}");
        let set = PanoramaSet::open(folder.path()).unwrap();
        assert_eq!((set.layout(), set.shape()), (layout, (4, 5)));
        assert_eq!(set.conditions(), ["original", "night-moved"]);
        assert_eq!(set.warnings(), &[] as &[String], "{layout:?}");
        assert_eq!(set.entries().len(), plan.frames());
        let mut entries = 0;
        for (k, stage) in plan.stages.iter().enumerate() {
            let staged = &stage.staged;
            let scene = Scene::new(&staged.world).unwrap().under(staged.light, staged.optics.exposure);
            for frame in plan.stage_frames(k) {
                let bodies = staged.world.body_poses();
                let view = View { projection: plan.projection, robot: frame.robot, bodies: &bodies };
                let mut wanted = Panorama::empty();
                CpuRenderer::new().render(&scene, &view, &mut wanted).unwrap();
                let which = |e: &wayhome::panorama_set::Entry| e.condition == frame.condition && e.place == frame.place;
                let k = set.entries().iter().position(which).unwrap();
                let (entry, got) = (&set.entries()[k], set.load(k).unwrap());
                entries += 1;
                assert_eq!(got.projection, wanted.projection);
                for (a, b) in got.rgba.chunks_exact(4).zip(wanted.rgba.chunks_exact(4)) {
                    let weights = [0.299, 0.587, 0.114];
                    let luma = b.iter().zip(weights).map(|(c, w)| f64::from(*c) * w).sum::<f64>();
                    if layout.layout().is_grey() {
                        assert!((f64::from(a[0]) - luma).abs() <= 0.5 + 1e-9 && a[0] == a[1] && a[1] == a[2]);
                    } else {
                        assert_eq!(a[..3], b[..3]);
                    }
                }
                assert!(got.range_m.iter().zip(&wanted.range_m).all(|(a, b)| (a - b).abs() <= 5.1e-4), "{layout:?}");
                assert_eq!(got.instance, wanted.instance);
                let pose = entry.pose.unwrap();
                assert!((pose.position() - frame.robot.position()).norm() < 1e-9, "{layout:?}");
                assert!(wrap(pose.heading - frame.robot.heading).abs() < 1e-9);
            }
        }
        assert_eq!(entries, set.entries().len());
        assert_eq!(set.clone().only("original").unwrap().at(Place { i: 0, j: 9 }).map(|_| ()).map_err(|_| ()), Err(()));
        // A condition by itself is a set, too.
        if !layout.layout().is_one_folder() {
            let alone = PanoramaSet::open(&folder.path().join("original")).unwrap();
            assert_eq!((alone.layout(), alone.load(0).unwrap().rgba), (layout, set.load(0).unwrap().rgba));
        }
    }
}

#[test]
fn shards_together_are_the_same_set() {
    let world = World::open("lab").unwrap();
    for layout in [LayoutKind::Webdataset, LayoutKind::Folder] {
        let places = Places::Random(150);
        let request = Request { places, headings: Headings::Random(1), size_px: Some((64, 8)), ..request(layout) };
        let plan = Plan::new(&world, request).unwrap();
        assert!(plan.parts.len() >= 4);
        let base = tempfile::tempdir().unwrap();
        let (whole, joined) = (base.path().join("whole"), base.path().join("joined"));
        make(&plan, &whole, (1, 1)).unwrap();
        for shard in 1..=3 {
            let own = base.path().join(format!("shard-{shard}"));
            assert!(!make(&plan, &own, (shard, 3)).unwrap().complete);
            assert!(faults(&own).iter().all(|(_, kind)| *kind == FaultKind::Unfinished));
            for (path, bytes) in files(&own) {
                let to = joined.join(path);
                std::fs::create_dir_all(to.parent().unwrap()).unwrap();
                std::fs::write(to, bytes).unwrap();
            }
        }
        let outcome = make(&plan, &joined, (1, 1)).unwrap();
        assert_eq!((outcome.rendered, outcome.complete), (0, true));
        assert_same_files(&whole, &joined);
    }
}

#[test]
fn a_full_stop_and_damage_are_mended() {
    let world = World::open("lab").unwrap();
    let request = Request { places: Places::Random(200), headings: Headings::Random(1), ..request(LayoutKind::Folder) };
    let plan = Plan::new(&world, Request { size_px: Some((64, 8)), ..request }).unwrap();
    let base = tempfile::tempdir().unwrap();
    let (whole, broken) = (base.path().join("whole"), base.path().join("broken"));
    make(&plan, &whole, (1, 1)).unwrap();
    let mut calls = 0;
    let stopped = Job { plan: &plan, out: &broken, shard: (1, 1), extras: &card }.run(&mut CpuRenderer::new(), &mut |_| {
        calls += 1;
        if calls > 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(stopped, Err(Error::Interrupted)));
    assert!(files(&broken).keys().all(|path| !path.to_string_lossy().ends_with("-partial")), "whole files only");
    let outcome = make(&plan, &broken, (1, 1)).unwrap();
    assert!(outcome.complete);
    assert_same_files(&whole, &broken);

    // Every kind of damage by its name; the same job mends what is missing or cut.
    let file = |name: &str| broken.join(name);
    std::fs::remove_file(file("original/000003.range.png")).unwrap();
    let cut = std::fs::read(file("original/000004.rgb.png")).unwrap();
    std::fs::write(file("original/000004.rgb.png"), &cut[..cut.len() / 2]).unwrap();
    std::fs::write(file("original/note.txt"), "mine").unwrap();
    let mut altered = std::fs::read(file("night-moved/000005.instance.png")).unwrap_or_default();
    let at = altered.len() / 2;
    altered[at] ^= 1;
    std::fs::write(file("night-moved/000005.instance.png"), altered).unwrap();
    assert_eq!(
        faults(&broken),
        [
            ("night-moved/000005.instance.png".to_owned(), FaultKind::Altered),
            ("original/000003.range.png".to_owned(), FaultKind::Missing),
            ("original/000004.rgb.png".to_owned(), FaultKind::Cut),
            ("original/note.txt".to_owned(), FaultKind::Extra),
        ]
    );
    let error = PanoramaSet::open(&broken).and_then(|s| s.load(4)).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("000004.rgb.png"), "{error}");
    std::fs::remove_file(file("original/note.txt")).unwrap();
    std::fs::remove_file(file("night-moved/000005.instance.png")).unwrap();
    assert!(make(&plan, &broken, (1, 1)).unwrap().complete);
    assert_same_files(&whole, &broken);
}

fn wayhome(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wayhome"));
    command.args(arguments).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

fn run(arguments: &[&str]) -> Output {
    wayhome(arguments).output().unwrap()
}

#[track_caller]
fn assert_fails(output: &Output, code: i32, words: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}

#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let base = tempfile::tempdir().unwrap();
    for layout in ["folder", "webdataset"] {
        let path = |name: &str| base.path().join(format!("{layout}-{name}")).display().to_string();
        let arguments = |out: &str, threads: &str| -> Vec<String> {
            let set = ["dataset", "crowd", "--random", "330", "--headings", "random", "--size", "360x45", "--renderer", "cpu"];
            let rest = ["--conditions", "original+cheap", "--layout", layout, "--out", out, "--threads", threads];
            set.iter().chain(&rest).map(|s| (*s).to_owned()).collect()
        };
        let as_words = |all: &[String]| all.iter().map(String::as_str).collect::<Vec<_>>().join(" ");
        let start = |out: &str, threads: &str| {
            let all = arguments(out, threads);
            wayhome(&all.iter().map(String::as_str).collect::<Vec<_>>())
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap()
        };
        let (killed, whole) = (path("killed"), path("whole"));
        assert!(start(&whole, "3").wait().unwrap().success(), "{}", as_words(&arguments(&whole, "3")));
        let mut child = start(&killed, "2");
        let begun = Instant::now();
        while !Path::new(&killed).join("parts/000001.json").exists() {
            assert!(begun.elapsed() < Duration::from_secs(120), "no part after two minutes");
            std::thread::sleep(Duration::from_millis(2));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        // Files that are not marked as being written are whole.
        for (name, bytes) in files(Path::new(&killed)) {
            if name.extension().is_some_and(|e| e == "png") {
                image::load_from_memory(&bytes).unwrap();
            }
        }
        let mut again = start(&killed, "1");
        assert!(again.wait().unwrap().success());
        assert_same_files(Path::new(&whole), Path::new(&killed));
        assert!(run(&["dataset", "check", &killed]).status.success());
    }
}

#[test]
fn bad_sets_are_refused_before_anything_is_written() {
    let base = tempfile::tempdir().unwrap();
    let out = base.path().join("set").display().to_string();
    let set = |more: &[&str]| run(&[&["dataset", "lab", "--renderer", "cpu", "--size", "64x8", "--out", &out], more].concat());
    assert_fails(&set(&["--grid", "50x9", "--spacing-m", "0.5"]), 2, &["--grid", "50x9", "24.50 x 4.00 m", "7.00 x 6.00 m"]);
    assert_fails(&set(&["--grid", "3x3", "--spacing-m", "0"]), 2, &["--spacing-m", "greater than 0"]);
    assert_fails(&set(&["--grid", "0x3", "--spacing-m", "1"]), 2, &["--grid"]);
    assert_fails(&set(&["--grid", "3x3"]), 2, &["--spacing-m"]);
    assert_fails(&set(&["--grid", "3x3", "--spacing-m", "1", "--origin", "6,1"]), 2, &["--grid", "7.00 x 6.00 m"]);
    assert_fails(&set(&["--random", "0"]), 2, &["--random", "1 to"]);
    assert_fails(&set(&[]), 2, &["--grid"]);
    assert_fails(&set(&["--random", "3", "--layout", "kitti"]), 2, &["kitti", "image-database", "webdataset"]);
    assert_fails(&set(&["--random", "3", "--layout", "vardy"]), 2, &["vardy", "grid"]);
    assert_fails(&set(&["--random", "3", "--conditions", "dusk"]), 2, &["dusk", "winlit"]);
    assert_fails(&set(&["--random", "3", "--conditions", "winlit"]), 2, &["windows"]);
    assert_fails(&set(&["--random", "3", "--conditions", "day,day"]), 2, &["day", "twice"]);
    assert_fails(&set(&["--random", "3", "--shard", "4/3"]), 2, &["--shard"]);
    let grid = ["--grid", "2x2", "--spacing-m", "0.5", "--layout", "vardy", "--headings", "0,90"];
    assert_fails(&set(&grid), 2, &["several headings"]);
    let route = |text: &str| {
        let path = base.path().join("route.csv");
        std::fs::write(&path, text).unwrap();
        set(&["--route", &path.display().to_string()])
    };
    assert_fails(&route("x_m,heading_deg\n1,2\n"), 1, &["route.csv", "line 1", "y_m"]);
    assert_fails(&route("x_m,y_m\n1,2\n3,north\n"), 1, &["route.csv", "line 3", "y_m", "north"]);
    assert_fails(&route("x_m,y_m\n"), 1, &["route.csv", "no row"]);
    assert_fails(&route("x_m,y_m\n99,99\n"), 1, &["outside of the room"]);
    // More than any disk holds, told before the first picture of it.
    let huge = ["dataset", "lab", "--random", "100000", "--size", "8192x2048", "--renderer", "cpu", "--out", &out];
    if cfg!(unix) {
        assert_fails(&run(&huge), 1, &["room on the disk", "MB free"]);
    }
    assert!(!Path::new(&out).exists(), "nothing is left behind");

    // What is there already stays.
    std::fs::create_dir(&out).unwrap();
    std::fs::write(Path::new(&out).join("notes.md"), "mine").unwrap();
    assert_fails(&set(&["--random", "2"]), 1, &["notes.md"]);
    std::fs::remove_file(Path::new(&out).join("notes.md")).unwrap();
    assert!(set(&["--random", "2"]).status.success());
    let before = files(Path::new(&out));
    assert_fails(&set(&["--random", "3"]), 1, &["another set", "--random 2", "--random 3"]);
    assert_eq!(files(Path::new(&out)), before);
    assert_fails(&run(&["dataset", "check", &base.path().display().to_string()]), 1, &["dataset.json"]);
}

/// A PGM whose pixels tell row and column.
fn pgm(folder: &Path, name: &str, width: u32, height: u32) {
    std::fs::create_dir_all(folder).unwrap();
    let mut bytes = format!("P5\n{width} {height}\n255\n").into_bytes();
    bytes.extend((0..height).flat_map(|row| (0..width).map(move |column| (10 * row + column) as u8)));
    std::fs::write(folder.join(name), bytes).unwrap();
}

#[test]
fn real_sets_have_their_ways() {
    let base = tempfile::tempdir().unwrap();
    let red = |p: &Panorama, column: usize, row: usize| p.rgba[4 * (row * p.projection.width as usize + column)];
    // Grey, clockwise, from 1, without ground truth; the other files of the folder do not matter.
    let vardy = base.path().join("original");
    for (i, j) in [(1, 1), (1, 2), (2, 2)] {
        pgm(&vardy, &format!("{i}_{j}.pgm"), 8, 3);
    }
    std::fs::write(vardy.join("README"), "").unwrap();
    let error = PanoramaSet::open(&vardy).unwrap().whole().unwrap_err().to_string();
    assert!(error.contains("none of place (1, 0)"), "{error}");
    pgm(&vardy, "2_1.pgm", 8, 3);
    let set = PanoramaSet::open(&vardy).unwrap().whole().unwrap();
    assert_eq!((set.layout(), set.shape()), (LayoutKind::Vardy, (2, 2)));
    let seen = set.at(Place { i: 0, j: 1 }).unwrap();
    assert_eq!((red(&seen, 0, 1), red(&seen, 1, 1), red(&seen, 7, 1)), (10, 17, 11), "column 0 stays, the others turn round");
    assert!(seen.range_m.is_empty() && seen.instance.is_empty());
    assert!(seen.projection.tan_elevation(1.0).abs() < 1e-12, "the horizon is in the middle");
    assert!(set.at(Place { i: 2, j: 0 }).unwrap_err().to_string().contains("2 rows"));
    // Mirrored x.
    let mirrored = base.path().join("mirrored");
    for i in 0..3 {
        pgm(&mirrored, &format!("cv_{i}_0_bw0.19.pgm"), 8, 3);
    }
    let set = PanoramaSet::open(&mirrored).unwrap();
    assert_eq!(set.entries()[0].key, "cv_2_0_bw0.19");
    assert_eq!(set.entries()[0].place, Some(Place { i: 0, j: 0 }));
    // Moeller: rows twice as far apart as columns.
    let moeller = base.path().join("moeller");
    for (x, y) in [(2, 5), (3, 5)] {
        pgm(&moeller.join("DATA2/living3dayHh8sh"), &format!("cv_{x}_{y}_bw0.10.pgm"), 8, 3);
    }
    let step = 2.0 * std::f64::consts::TAU / 8.0;
    std::fs::write(moeller.join("DATA2/living3_Hh8sh.db"), format!("8 2 3 5 5 {step} 1\n")).unwrap();
    let set = PanoramaSet::open(&moeller).unwrap();
    assert_eq!((set.conditions(), set.shape()), (vec!["day"], (2, 1)));
    let seen = set.at(Place { i: 0, j: 0 }).unwrap();
    assert_eq!(seen.projection.height, 6, "rows are as far apart as columns");
    let horizon = seen.projection.row(0.0);
    let at = |row: f64| (f64::from(red(&seen, 0, row as usize)) + f64::from(red(&seen, 0, row as usize + 1))) / 2.0;
    assert!((at(horizon.floor()) - 10.0).abs() <= 0.5, "what was on the horizon is there");
    std::fs::write(moeller.join("DATA2/living3_Hh8sh.db"), "8 2 3\n").unwrap();
    let error = PanoramaSet::open(&moeller).unwrap_err().to_string();
    assert!(error.contains("line 1") && error.contains("vertRes"), "{error}");
    // A picture that is cut off.
    std::fs::write(vardy.join("1_1.pgm"), "P5\n8 3\n255\n12345").unwrap();
    let error = PanoramaSet::open(&vardy).unwrap().load(0).unwrap_err().to_string();
    assert!(error.contains("1_1.pgm"), "{error}");
    assert!(PanoramaSet::open(&base.path().join("nowhere")).is_err());
}

#[test]
fn the_table_of_an_image_database_wins() {
    let folder = tempfile::tempdir().unwrap();
    let png = |name: &str| image::RgbImage::from_pixel(16, 8, image::Rgb([1, 2, 3])).save(folder.path().join(name)).unwrap();
    for name in ["a.png", "b.png"] {
        png(name);
    }
    let table = |text: &str| std::fs::write(folder.path().join("database_entries.csv"), text).unwrap();
    let open = || PanoramaSet::open(folder.path());
    let header = "X [mm], Y [mm], Z [mm], Heading [degrees], Filename, Grid X, Grid Y, Grid Z, Battery [V]\n";
    table(&format!("{header}100, 200, 0, 90, a.png, 0, 0, 0, 7.1\n400, 200, 0, , b.png, 1, 0, 0, 7.0\n"));
    let meta = "%YAML:1.0\n---\nmetadata:\n   type: grid\n   grid:\n      beginAtMM: [ 0, 200, 0 ]\n      separationMM: [ 300, 300, 0 ]\n      \
                size: [ 3, 1, 1 ]\n   needsUnwrapping: 0\n";
    std::fs::write(folder.path().join("database_metadata.yaml"), meta).unwrap();
    let set = open().unwrap();
    assert_eq!(set.shape(), (1, 2));
    assert_eq!(set.entries()[0].pose, Some(Pose::new(0.1, 0.2, std::f64::consts::FRAC_PI_2)));
    assert_eq!(set.entries()[1].pose, None, "a blank heading is not known");
    let warnings = set.warnings().join("\n");
    assert!(warnings.contains("beginAtMM") && warnings.contains("grid.size") && warnings.contains("is right"), "{warnings}");
    table("X [mm], Y [mm], Heading [degrees], Filename\n1, 2, 3, a.png\n");
    let error = open().unwrap_err().to_string();
    assert!(error.contains("database_entries.csv: line 1") && error.contains("`Z [mm]`"), "{error}");
    table("X [mm], Y [mm], Z [mm], Heading [degrees], Filename\n1, 2, 3, 4, a.png\n1, 2, x, 4, b.png\n");
    let error = open().unwrap_err().to_string();
    assert!(error.contains("line 3, Z [mm]: found `x`"), "{error}");
    table("X [mm], Y [mm], Z [mm], Heading [degrees], Filename\n1, 2, 3, 4, c.png\n");
    let error = open().unwrap_err().to_string();
    assert!(error.contains("line 2: found `c.png`"), "{error}");
}

/// A picture of one colour in each file, and a table that has the places `(0, 0)` to `(0, n - 1)` and home's heading.
fn image_database(folder: &Path, names: &[&str]) {
    let mut table = "X [mm], Y [mm], Z [mm], Heading [degrees], Filename, Grid X, Grid Y, Grid Z\n".to_owned();
    for (k, name) in (0_u8..).zip(names) {
        image::RgbImage::from_pixel(64, 16, image::Rgb([k, 2, 3])).save(folder.join(name)).unwrap();
        table += &format!("{}, 0, 0, 0, {name}, {k}, 0, 0\n", 100 * u32::from(k));
    }
    std::fs::write(folder.join("database_entries.csv"), table).unwrap();
}

#[test]
fn home_is_where_it_is_told_to_be() {
    let world = World::open("lab").unwrap();
    let folder = tempfile::tempdir().unwrap();
    image_database(folder.path(), &["a.png", "b.png", "c.png", "d.png"]);
    let choice = |home| DatasetChoice { folder: folder.path().to_owned(), home, ..DatasetChoice::default() };
    let red_at_home = |home| {
        let field = DatasetField::new(&world, &choice(home))?;
        let sensor = DatasetSensor::new(&world, field.into(), ExtractorSettings::default());
        Ok::<u8, Error>(sensor.home_panorama().unwrap().rgba[0])
    };
    assert_eq!(red_at_home(Some(Place { i: 0, j: 2 })).unwrap(), 2);
    assert_eq!(red_at_home(None).unwrap(), 1, "the middle");
    assert!(red_at_home(Some(Place { i: 0, j: 4 })).unwrap_err().to_string().contains("none at place (0, 4)"));
    let table = "X [mm], Y [mm], Z [mm], Heading [degrees], Filename\n0, 0, 0, 0, b.png\n9, 0, 0, 0, c.png\n";
    std::fs::write(folder.path().join("database_entries.csv"), table).unwrap();
    assert_eq!(red_at_home(None).unwrap(), 1, "the first");
    let error = red_at_home(Some(Place { i: 0, j: 1 })).unwrap_err().to_string();
    assert!(error.contains("--dataset-home") && error.contains("places of a grid"), "{error}");
}

/// A robot that starts where no panorama is near is told of, not left to stand without a word.
#[test]
fn a_start_outside_a_set_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan::new(
        &World::open("lab").unwrap(),
        Request {
            places: Places::Grid { columns: 3, rows: 2, spacing_m: 0.3, origin_m: None },
            conditions: vec![Condition::original()],
            ..request(LayoutKind::Folder)
        },
    )
    .unwrap();
    let set = folder.path().join("set");
    make(&plan, &set, (1, 1)).unwrap();
    let set = set.display().to_string();
    let out = folder.path().join("run").display().to_string();
    let home = ["home", "lab", "--bearings", "dataset", "--dataset", &set, "--seed", "1", "--out", &out, "--time-limit-s", "1"];
    let told = |start: &str| {
        let output = run(&[&home[..], &["--start", start]].concat());
        String::from_utf8_lossy(&output.stderr).matches("outside the set").count()
    };
    assert_eq!((told("6.2,0.8,0"), told("3.5,3,0")), (1, 0), "once, and only there");
}

/// What a stranger's set may not do: ask for more than a set of this program does, or lead out of its folder.
#[test]
fn sets_of_strangers_are_held_to_their_bounds() {
    let base = tempfile::tempdir().unwrap();
    let set = base.path().join("set");
    let places = Places::Grid { columns: 2, rows: 2, spacing_m: 0.3, origin_m: None };
    let small =
        Request { places, conditions: vec![Condition::original()], size_px: Some((64, 8)), ..request(LayoutKind::Vardy) };
    make(&Plan::new(&World::open("lab").unwrap(), small).unwrap(), &set, (1, 1)).unwrap();
    let refused = |folder: &Path, words: &[&str]| {
        let error = PanoramaSet::open(folder).and_then(|set| set.load(0)).map(|_| ()).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{words:?} are not in: {error}");
    };
    // Its document.
    let document = set.join("dataset.json");
    let written = std::fs::read(&document).unwrap();
    for (place, value) in [
        ("/grid/rows", serde_json::json!(0)),
        ("/grid/rows", serde_json::json!(1_000_000_000_000_000_000_u64)),
        ("/grid/columns", serde_json::json!(u64::MAX)),
        ("/grid/spacing_m", serde_json::json!(0.0)),
        ("/grid/spacing_m", serde_json::json!(-0.3)),
        ("/grid/first_m/0", serde_json::json!(1e300)),
        ("/grid/home", serde_json::json!([1_000_000_000_000_000_000_u64, 0])),
        ("/home/x_m", serde_json::json!(1e18)),
        ("/projection/horizon_row", serde_json::json!(1e300)),
        ("/projection/width", serde_json::json!(0)),
        ("/conditions/0/name", serde_json::json!("../original")),
        ("/parts", serde_json::json!(1_000_000_000_000_000_000_u64)),
        ("/layout", serde_json::json!("kitti")),
    ] {
        let mut told: serde_json::Value = serde_json::from_slice(&written).unwrap();
        *told.pointer_mut(place).unwrap() = value;
        std::fs::write(&document, told.to_string()).unwrap();
        let name = place.trim_start_matches('/').split('/').next().unwrap();
        refused(&set, &["dataset.json", name, "allowed is"]);
    }
    std::fs::write(&document, &written).unwrap();
    // A place that the grid does not have, a picture that is too large, one that is cut off.
    let extra = set.join("original/99_0.pgm");
    std::fs::write(&extra, "").unwrap();
    refused(&set, &["99_0.pgm", "(99, 0)"]);
    std::fs::remove_file(&extra).unwrap();
    std::fs::write(set.join("original/0_0.pgm"), "P5\n16384 16384\n255\n").unwrap();
    refused(&set, &["0_0.pgm", "16384 x 16384 pixels"]);
    let far = base.path().join("far");
    pgm(&far, "0_0.pgm", 8, 3);
    pgm(&far, "18446744073709551615_5.pgm", 8, 3);
    refused(&far, &["places, expected at most"]);
    let photographs = base.path().join("photographs");
    std::fs::create_dir(&photographs).unwrap();
    image_database(&photographs, &["a.jpg"]);
    assert!(PanoramaSet::open(&photographs).unwrap().load(0).is_ok());
    let whole = std::fs::read(photographs.join("a.jpg")).unwrap();
    std::fs::write(photographs.join("a.jpg"), &whole[..whole.len() - 8]).unwrap();
    refused(&photographs, &["a.jpg", "cut off"]);
    // Moeller's line.
    let moeller = base.path().join("moeller");
    pgm(&moeller.join("DATA2/hall1day8"), "cv_0_0_bw0.10.pgm", 8, 3);
    for line in [
        "8 0 0 0 0 1e3 1",
        "8 0 0 0 0 1e300 1",
        "8 0 0 0 0 0 1",
        "8 0 0 0 0 0.1 1e300",
        "8 0 1e300 0 0 0.1 1",
        "8 0 0 0 0 nan 1",
    ] {
        std::fs::write(moeller.join("DATA2/hall1_8.db"), line).unwrap();
        refused(&moeller, &["hall1_8.db", "line 1", "vertRes"]);
    }
    // Ways out of the folder, and files that never end.
    let checked = || check(&set, &|_, _| ControlFlow::Continue(())).map(|_| ()).unwrap_err().to_string();
    let sums = std::fs::read_to_string(set.join("SHA256SUMS")).unwrap();
    let outside = photographs.join("a.jpg").display().to_string();
    for path in [outside.as_str(), "../photographs/a.jpg"] {
        std::fs::write(set.join("SHA256SUMS"), format!("{sums}{}  {path}\n", "0".repeat(64))).unwrap();
        let error = checked();
        assert!(error.contains("a.jpg") && error.contains("expected a plain file in"), "{error}");
    }
    #[cfg(unix)]
    {
        std::fs::write(set.join("SHA256SUMS"), sums).unwrap();
        let picture = set.join("original/0_0.pgm");
        for target in [outside.as_str(), "/dev/zero"] {
            std::fs::remove_file(&picture).unwrap();
            std::os::unix::fs::symlink(target, &picture).unwrap();
            refused(&set, &["0_0.pgm", "expected a plain file in"]);
            assert!(checked().contains("0_0.pgm"));
        }
        std::fs::remove_file(&picture).unwrap();
        assert!(Command::new("mkfifo").arg(&picture).status().unwrap().success());
        refused(&set, &["0_0.pgm", "a pipe or a device"]);
        assert!(checked().contains("0_0.pgm"));
    }
}

/// A robot that only has a set of panoramas comes home, whatever the layout, also where the set tells nothing but its pictures.
#[test]
fn a_set_leads_home() {
    let world = World::open("lab").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let places = Places::Grid { columns: 13, rows: 11, spacing_m: 0.3, origin_m: None };
    let conditions = vec![Condition::original()];
    let request = Request { places, conditions, size_px: Some((720, 90)), ..request(LayoutKind::Vardy) };
    let plan = Plan::new(&world, request).unwrap();
    make(&plan, folder.path(), (1, 1)).unwrap();
    let document = PanoramaSet::open(folder.path()).unwrap().document().cloned().unwrap();
    let [i, j] = document.grid.unwrap().home.unwrap();
    let untold = DatasetChoice {
        folder: folder.path().join("original"),
        spacing_m: Some(0.3),
        home: Some(Place { i, j }),
        ..DatasetChoice::default()
    };
    for choice in [DatasetChoice { folder: folder.path().to_owned(), ..DatasetChoice::default() }, untold] {
        let setup = Setup {
            plant: PlantKind::Unicycle,
            sensor: SensorKind::Dataset,
            method: MethodKind::Weber,
            dataset: Some(choice),
            compass_sd_rad: Some(0.0),
            start: Start::At(Pose::new(4.3, 3.9, 2.0)),
            ..Setup::default()
        };
        let record = Simulation::new(&world, &setup).unwrap().run(1, &mut |_| ControlFlow::Continue(())).unwrap();
        let last = record.steps.last().unwrap();
        let distance_m = (last.truth.position() - world.home.position()).norm();
        assert!(distance_m < 0.15, "{distance_m} m from home, {:?}", record.outcome);
    }
    let bad = |choice: DatasetChoice| {
        let setup = Setup { sensor: SensorKind::Dataset, dataset: Some(choice), ..Setup::default() };
        Simulation::new(&world, &setup).map(|_| ()).unwrap_err().to_string()
    };
    // Of another world.
    let setup = Setup {
        sensor: SensorKind::Dataset,
        dataset: Some(DatasetChoice { folder: folder.path().to_owned(), ..DatasetChoice::default() }),
        ..Setup::default()
    };
    let message = Simulation::new(&World::open("gallery").unwrap(), &setup).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("set of the world `lab`") && message.contains("home of `gallery`"), "{message}");
    let folder = folder.path().join("original");
    assert!(bad(DatasetChoice { folder: folder.clone(), ..DatasetChoice::default() }).contains("--dataset-spacing-m"));
    let elsewhere = Some(Place { i: 99, j: 0 });
    assert!(
        bad(DatasetChoice { folder, spacing_m: Some(0.3), home: elsewhere, ..DatasetChoice::default() }).contains("(99, 0)")
    );
}

/// The interpreter with the packages of `tests/outside/requirements.txt`, where `.ci/run` or a person has made one.
fn python() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/python-venv/bin/python");
    if path.exists() {
        return Some(path);
    }
    assert!(std::env::var_os("WAYHOME_REQUIRE_PYTHON").is_none(), "{} is missing; .ci/run makes it", path.display());
    eprintln!("NOT RUN: no {}; it takes the packages of tests/outside/requirements.txt, and .ci/run makes it", path.display());
    None
}

/// What `checksum` of `tests/outside/dataset_readers.py` says of some values.
fn checksum(values: impl Iterator<Item = u64>) -> u64 {
    values.zip(1..).fold(0, |sum, (value, number)| (sum + value * number) % 1_000_000_007)
}

fn checksum_rgb(seen: &Panorama) -> u64 {
    checksum(seen.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).map(u64::from))
}

/// What a script of `tests/outside/` prints of a folder.
fn told_by(python: &Path, script: &str, folder: &Path) -> serde_json::Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/outside").join(script);
    let cache = tempfile::tempdir().unwrap();
    let mut command = Command::new(python);
    command.arg(script).arg(folder).env("HF_HOME", cache.path()).env("HF_HUB_OFFLINE", "1");
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Hugging Face's `datasets` sees pictures and poses of an ImageFolder.
#[test]
fn datasets_loads_an_image_folder() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan::new(&World::open("lab").unwrap(), request(LayoutKind::ImageFolder)).unwrap();
    make(&plan, folder.path(), (1, 1)).unwrap();
    let told = told_by(&python, "image_folder.py", &folder.path().join("original"));
    let set = PanoramaSet::open(folder.path()).unwrap().only("original").unwrap();
    let samples = told.as_array().unwrap();
    assert_eq!(samples.len(), set.entries().len());
    for (k, (sample, entry)) in samples.iter().zip(set.entries()).enumerate() {
        let (pose, place) = (entry.pose.unwrap(), entry.place.unwrap());
        let wanted = serde_json::json!({
            "condition": "original", "row": place.i, "column": place.j, "t_s": null,
            "x_m": pose.x, "y_m": pose.y, "heading_rad": pose.heading,
            "size": [SIZE.0, SIZE.1], "rgb": checksum_rgb(&set.load(k).unwrap()),
        });
        assert_eq!(*sample, wanted);
    }
}

/// PyPI's `webdataset` and `pyarrow` see what was written.
#[test]
fn outside_readers_agree() {
    let Some(python) = python() else { return };
    let world = World::open("lab").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan::new(&world, request(LayoutKind::Webdataset)).unwrap();
    make(&plan, folder.path(), (1, 1)).unwrap();
    let told = told_by(&python, "dataset_readers.py", folder.path());

    let samples = told["samples"].as_object().unwrap();
    let set = PanoramaSet::open(folder.path()).unwrap();
    assert_eq!(samples.len(), set.entries().len());
    for (k, entry) in set.entries().iter().enumerate() {
        let (sample, seen) = (&samples[&entry.key], set.load(k).unwrap());
        let range = checksum(seen.range_m.iter().map(|r| (f64::from(*r) * 1000.0).round() as u64));
        let instance = checksum(seen.instance.iter().map(|i| u64::from(*i)));
        let rgb = checksum_rgb(&seen);
        assert_eq!(sample["size"], serde_json::json!([SIZE.0, SIZE.1]));
        assert_eq!((&sample["rgb"], &sample["range"], &sample["instance"]), (&rgb.into(), &range.into(), &instance.into()));
        assert!((sample["x_m"].as_f64().unwrap() - entry.pose.unwrap().x).abs() < 1e-12);
    }
    for table in ["frames", "landmarks", "matches"] {
        let mut sums: BTreeMap<String, f64> = BTreeMap::new();
        let mut rows = 0;
        for part in &plan.parts {
            let path = folder.path().join(format!("truth/{table}-{:06}.parquet", part.number));
            let ours = Table::from_parquet(std::fs::read(path).unwrap()).unwrap();
            rows += ours.rows();
            for column in &ours.columns {
                *sums.entry(column.name.clone()).or_default() += match &column.cells {
                    Cells::Bool(cells) => cells.iter().flatten().filter(|b| **b).count() as f64,
                    Cells::Int(cells) => cells.iter().flatten().sum::<i64>() as f64,
                    Cells::Real(cells) => cells.iter().flatten().sum(),
                    Cells::Text(cells) => cells.iter().flatten().map(String::len).sum::<usize>() as f64,
                };
            }
        }
        let theirs = &told[table];
        assert!(rows > 0 && theirs["rows"] == rows, "{table}");
        assert_eq!(theirs["columns"].as_object().unwrap().len(), sums.len());
        for (name, sum) in sums {
            let told = theirs["columns"][&name].as_f64().unwrap();
            assert!((told - sum).abs() <= 1e-9 * sum.abs().max(1.0), "{table}.{name}: {told} {sum}");
        }
    }
}
