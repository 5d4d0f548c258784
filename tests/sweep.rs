//! Stress studies at the process boundary: resumed, sharded, merged, replayed, run by HyperQueue, read in a browser.

#![allow(clippy::unwrap_used, reason = "helpers of tests are not recognised as tests")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use wayhome::study::sweep::Study;
use wayhome::table::{Cells, Table};

/// A study that takes a second: no camera, one cell that fails, one in which no run can start.
const STUDY: &str = r#"
name = "quick"
world = "lab"
seeds = "1..23"
[settings]
bearings = "noisy"
world.task.time_limit_s = 30
[[axes]]
setting = "start_distance_m"
values = [1.0, 2.0, 9.0]
[[axes]]
setting = "hidden_share"
values = [0.0, 0.9]
[[axes]]
setting = "method"
values = ["anchored-ekf", "alv"]
"#;

fn wayhome(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wayhome"));
    command.current_dir(folder).args(arguments).env_remove("RUST_LOG");
    for name in ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX", "WAYHOME_SHARDS"] {
        command.env_remove(name);
    }
    command
}

#[track_caller]
fn done(mut command: Command) -> Output {
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

#[track_caller]
fn refused(output: &Output, code: i32, words: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(words.iter().all(|word| text.contains(word)) && !text.contains("panicked"), "{words:?} in: {text}");
}

fn texts(table: &Table, column: &str) -> Vec<String> {
    let Some(Cells::Text(cells)) = table.column(column) else { panic!("no {column}") };
    cells.iter().map(|cell| cell.clone().unwrap()).collect()
}

fn ready() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("quick.toml"), STUDY).unwrap();
    folder
}

#[test]
fn rows_are_the_same_however_they_came_about() {
    let base = ready();
    let at = base.path();
    let rows = |folder: &str| fs::read(at.join(folder).join("rows.parquet")).unwrap();
    done(wayhome(at, &["sweep", "quick.toml", "--out", "one", "--threads", "1"]));
    let whole = rows("one");

    // Shards in folders of their own, one by Slurm's variables, put together.
    done(wayhome(at, &["sweep", "quick.toml", "--out", "a", "--shard", "1/3", "--threads", "3"]));
    done(wayhome(at, &["sweep", "quick.toml", "--out", "b", "--shard", "3/3"]));
    let partial = wayhome(at, &["sweep", "merge", "a", "b", "--out", "partial"]).output().unwrap();
    refused(&partial, 1, &["episodes are missing"]);
    let mut slurm = wayhome(at, &["sweep", "quick.toml", "--out", "c"]);
    let array = [("SLURM_ARRAY_TASK_ID", "6"), ("SLURM_ARRAY_TASK_MIN", "5"), ("SLURM_ARRAY_TASK_COUNT", "3")];
    slurm.envs(array);
    done(slurm);
    done(wayhome(at, &["sweep", "merge", "c", "a", "b", "--out", "all"]));
    assert!(rows("all") == whole, "three shards make the same file");

    // A killed run has some parts and the beginning of another; shards may share a folder.
    let parts = at.join("one/parts");
    for chunk in [3, 4, 9] {
        fs::remove_file(parts.join(format!("{chunk:08}.parquet"))).unwrap();
    }
    fs::remove_file(at.join("one/rows.parquet")).unwrap();
    fs::write(parts.join("00000003.parquet.1-2.wayhome-partial"), "cut off").unwrap();
    done(wayhome(at, &["sweep", "quick.toml", "--out", "one", "--shard", "1/2"]));
    assert!(!at.join("one/rows.parquet").exists());
    let last = done(wayhome(at, &["sweep", "quick.toml", "--out", "one", "--shard", "2/2", "--json"]));
    let told: serde_json::Value = serde_json::from_slice(&last.stdout).unwrap();
    assert_eq!((told["complete"].as_bool(), told["episodes_done"].as_u64()), (Some(true), Some(276)));
    assert!(rows("one") == whole && fs::read_dir(&parts).unwrap().count() == 24);

    // What went wrong is a row with its reason.
    let table = Table::from_parquet(whole).unwrap();
    assert_eq!(table.rows(), 3 * 2 * 2 * 23);
    let (outcomes, reasons) = (texts(&table, "outcome"), texts(&table, "reason"));
    assert!(outcomes[..23].iter().all(|o| o == "home"), "nothing hidden: {outcomes:?}");
    assert!(outcomes[184..].iter().all(|o| o == "error") && reasons[184].contains("no free place"), "{}", reasons[184]);
    assert!(outcomes[69..92].iter().any(|o| o != "home"), "nine of ten hidden: {outcomes:?}");
    let Some(Cells::Real(starts)) = table.column("start_x_m") else { panic!() };
    assert!(starts[..23] == starts[23..46] && starts[..23] == starts[46..69], "one seed, one start, whatever the method");
}

#[test]
fn one_axis_at_a_time_is_a_slice_of_the_grid() {
    let base = ready();
    let at = base.path();
    let rows = |folder: &str| Table::from_parquet(fs::read(at.join(folder).join("rows.parquet")).unwrap()).unwrap();
    let alone = STUDY.replace("\"quick\"", "\"alone\"").replace("[settings]", "design = \"one-at-a-time\"\n[settings]");
    fs::write(at.join("alone.toml"), alone.replace("2.0, 9.0]", "2.0]").replace("1..23", "1..2")).unwrap();
    done(wayhome(at, &["sweep", "alone.toml", "--out", "a", "--shard", "2/2"]));
    done(wayhome(at, &["sweep", "alone.toml", "--out", "a", "--shard", "1/2"]));
    done(wayhome(at, &["sweep", "report", "a"]));
    let table = rows("a");
    // Two starts and two shares, for two methods and two seeds each.
    assert_eq!(table.rows(), (2 + 2) * 2 * 2);
    let Some(Cells::Real(distances)) = table.column("start_distance_m") else { panic!() };
    let Some(Cells::Real(hidden)) = table.column("hidden_share") else { panic!() };
    assert!(distances.iter().zip(hidden).all(|(distance, hidden)| distance.is_some() != hidden.is_some()));
    assert!(texts(&table, "method").chunks(4).all(|four| four == ["anchored-ekf", "anchored-ekf", "alv", "alv"]));

    // A start at 1 m with nothing else set is the grid's with nothing hidden.
    done(wayhome(at, &["sweep", "quick.toml", "--seeds", "1..2", "--out", "grid"]));
    let numbers = |table: &Table| match table.column("final_distance_m") {
        Some(Cells::Real(cells)) => cells[..4].to_vec(),
        _ => panic!(),
    };
    assert_eq!(numbers(&table), numbers(&rows("grid")));
    let cells = fs::read_to_string(at.join("a/report/cells.csv")).unwrap();
    let starts: Vec<&str> = cells.lines().map(|line| line.split(",2,").next().unwrap()).collect();
    let head = "start_distance_m,hidden_share,method,";
    assert!(starts[0].starts_with(head) && starts[1..3] == ["1,,anchored-ekf", "1,,alv"] && starts[8] == ",0.9,alv", "{cells}");
    assert!(at.join("a/report/success-by-hidden_share.svg").is_file() && !at.join("a/report/success-alv.svg").exists());
}

#[test]
fn a_row_runs_again_exactly() {
    let base = ready();
    let at = base.path();
    done(wayhome(at, &["sweep", "quick.toml", "--out", "rows", "--keep-failures", "--seeds", "4..5"]));
    let table = Table::from_parquet(fs::read(at.join("rows/rows.parquet")).unwrap()).unwrap();
    let Some(Cells::Real(final_m)) = table.column("final_distance_m") else { panic!() };
    let outcomes = texts(&table, "outcome");
    for row in [1_usize, 7, 9] {
        let place = format!("rows:{row}");
        let again = wayhome(at, &["home", "--replay", &place, "--json", "--out", "again"]).output().unwrap();
        let code = if outcomes[row] == "home" { 0 } else { 3 };
        assert_eq!(again.status.code(), Some(code), "{}", String::from_utf8_lossy(&again.stderr));
        // Read as text, because not every reader of JSON rounds to the nearest number.
        let told = String::from_utf8(again.stdout).unwrap();
        let number = told.split("\"final_distance_m\": ").nth(1).unwrap().split(',').next().unwrap();
        assert_eq!(number.parse::<f64>().unwrap().to_bits(), final_m[row].unwrap().to_bits(), "row {row}");
    }
    for (row, outcome) in outcomes.iter().enumerate() {
        let kept = at.join(format!("rows/failures/{row:08}"));
        assert_eq!(
            kept.join("summary.json").is_file() && kept.join("trajectory.csv").is_file(),
            !["home", "error"].contains(&outcome.as_str())
        );
    }
    refused(&wayhome(at, &["home", "--replay", "rows:24"]).output().unwrap(), 2, &["row", "0 to 23"]);
    refused(&wayhome(at, &["home", "--replay", "nowhere:1"]).output().unwrap(), 1, &["study.json"]);
    refused(&wayhome(at, &["home", "--replay", "rows:1", "--method", "alv"]).output().unwrap(), 2, &["--replay", "--method"]);
}

#[test]
fn faults_of_a_study_are_told_before_anything_runs() {
    let base = ready();
    let at = base.path();
    let refuse = |from: &str, to: &str, code: i32, words: &[&str]| {
        fs::write(at.join("bad.toml"), STUDY.replacen(from, to, 1)).unwrap();
        refused(&wayhome(at, &["sweep", "bad.toml", "--out", "bad"]).output().unwrap(), code, words);
        assert!(!at.join("bad").exists(), "{to}: nothing is written");
    };
    refuse("\"hidden_share\"", "\"hiden_share\"", 1, &["bad.toml", "line 12", "hiden_share", "hidden_share"]);
    refuse("values = [0.0, 0.9]", "values = []", 1, &["line 13", "empty", "hidden_share"]);
    refuse("values = [0.0, 0.9]", "values = [0.0, 1.9]", 1, &["line 13", "hidden_share at 1.9", "0 to 1"]);
    refuse("values = [0.0, 0.9]", "", 1, &["line 11", "empty axis", "from and to"]);
    refuse("\"alv\"]", "\"magic\"]", 1, &["line 16", "magic", "weber"]);
    refuse(
        "world.task.time_limit_s = 30",
        "world.task.time_limt_s = 30",
        1,
        &["line 7", "time_limt_s", "world.task.time_limit_s"],
    );
    refuse("bearings = \"noisy\"", "noise_deg = 1.0", 1, &["the study's settings", "--noise-*", "--bearings noisy"]);
    refuse("seeds = \"1..23\"", "seeds = \"23..1\"", 1, &["line 4", "A..B"]);
    refuse("world = \"lab\"", "world = \"moon\"", 1, &["line 3", "moon", "built-in"]);
    refuse("name = \"quick\"", "nam = \"quick\"", 1, &["line 2", "nam", "name"]);

    refused(&wayhome(at, &["sweep", "quick.toml", "--shard", "4/3"]).output().unwrap(), 2, &["--shard", "1/3 to 3/3"]);
    refused(&wayhome(at, &["sweep", "nothing.toml"]).output().unwrap(), 2, &["nothing.toml", "slip-occlusion"]);
    let mut kubernetes = wayhome(at, &["sweep", "quick.toml"]);
    refused(&kubernetes.env("JOB_COMPLETION_INDEX", "1").output().unwrap(), 2, &["WAYHOME_SHARDS"]);

    done(wayhome(at, &["sweep", "quick.toml", "--out", "mine", "--seeds", "1..1", "--shard", "1/2"]));
    fs::write(at.join("other.toml"), STUDY.replace("\"quick\"", "\"other\"")).unwrap();
    let other = |out: &str| wayhome(at, &["sweep", "other.toml", "--seeds", "1..1", "--shard", "2/2", "--out", out]);
    refused(&other("mine").output().unwrap(), 1, &["mine", "study quick, not other"]);
    done(other("theirs"));
    refused(&wayhome(at, &["sweep", "merge", "mine", "theirs", "--out", "both"]).output().unwrap(), 1, &["theirs", "other"]);
    let reseeded = wayhome(at, &["sweep", "quick.toml", "--out", "mine", "--seeds", "1..2"]).output().unwrap();
    refused(&reseeded, 1, &["another edition"]);
    fs::create_dir(at.join("precious")).unwrap();
    fs::write(at.join("precious/thesis.tex"), "mine").unwrap();
    refused(&wayhome(at, &["sweep", "quick.toml", "--out", "precious"]).output().unwrap(), 1, &["thesis.tex"]);
    assert_eq!(fs::read_dir(at.join("precious")).unwrap().count(), 1, "nothing is left behind");
}

/// Each seed has a room of its own, the same for all methods; a run of the room by itself is the same run.
#[test]
fn a_study_may_draw_a_world_for_each_seed() {
    let text = "name = \"drawn\"\nworld = \"lab:seed\"\nseeds = \"3..4\"\n[settings]\nbearings = \"ideal\"\ntime_limit_s = 40\n\
                [[axes]]\nsetting = \"world\"\nvalues = [\"office:seed\", \"bare:seed\"]\n\
                [[axes]]\nsetting = \"method\"\nvalues = [\"anchored-ekf\", \"alv\"]\n";
    let base = tempfile::tempdir().unwrap();
    let at = base.path();
    fs::write(at.join("drawn.toml"), text).unwrap();
    done(wayhome(at, &["sweep", "drawn.toml", "--out", "rows"]));
    let table = Table::from_parquet(fs::read(at.join("rows/rows.parquet")).unwrap()).unwrap();
    let [Some(Cells::Real(starts)), Some(Cells::Real(ends))] = ["start_x_m", "final_distance_m"].map(|name| table.column(name))
    else {
        panic!()
    };
    assert!(starts[0] == starts[2] && starts[1] == starts[3] && starts[0] != starts[1], "one seed, one room: {starts:?}");
    assert!(starts[4] != starts[0], "another kind, another room");
    let alone = ["home", "office:4", "--seed", "4", "--bearings", "ideal", "--time-limit-s", "40", "--json", "--out", "alone"];
    let told: serde_json::Value = serde_json::from_slice(&wayhome(at, &alone).output().unwrap().stdout).unwrap();
    assert!((told["final_distance_m"].as_f64().unwrap() - ends[1].unwrap()).abs() < 1e-12);
    fs::write(at.join("none.toml"), text.replace("bare:seed", "castle:seed")).unwrap();
    refused(&wayhome(at, &["sweep", "none.toml", "--out", "none"]).output().unwrap(), 1, &["castle"]);
}

/// The world as a table: a kind with its seeds is what `KIND:seed` and `seeds` are, and the files of a folder are levels of an axis.
#[test]
fn a_study_may_name_a_kind_or_a_folder_of_worlds() {
    let base = tempfile::tempdir().unwrap();
    let study = |world: &str, rest: &str| {
        let path = base.path().join("study.toml");
        let axis = "[[axes]]\nsetting = \"method\"\nvalues = [\"alv\", \"weber\"]";
        fs::write(&path, format!("name = \"s\"\nworld = {world}\n{rest}\n[settings]\nbearings = \"ideal\"\n{axis}\n")).unwrap();
        Study::open(&path.display().to_string(), None).map_err(|error| error.to_string())
    };
    let short = study("\"bare:seed\"", "seeds = \"2..5\"").unwrap();
    for (world, seeds) in [("seeds = \"2..5\"", ""), ("", "seeds = \"2..5\""), ("seeds = \"2..5\"", "seeds = \"2..5\"")] {
        let comma = if world.is_empty() { "" } else { ", " };
        let long = study(&format!("{{ generate = \"bare\"{comma}{world} }}"), seeds).unwrap();
        assert_eq!((&long.world, &long.seeds, &long.world_sha256), (&short.world, &short.seeds, &short.world_sha256));
    }
    fs::create_dir(base.path().join("rooms")).unwrap();
    for (name, world) in [("b", "lab"), ("a", "crowd")] {
        fs::write(base.path().join(format!("rooms/{name}.toml")), wayhome::world::World::open(world).unwrap().spec.to_toml())
            .unwrap();
    }
    let folder = study("{ folder = \"rooms\" }", "seeds = \"1..2\"").unwrap();
    assert_eq!((folder.axes[0].setting.as_str(), folder.axes[0].levels.listed().len()), ("world", 2));
    for (world, rest, wanted) in [
        ("{ generate = \"bare\", seeds = \"2..5\" }", "seeds = \"2..6\"", "seeds: found other seeds than those of `world`"),
        ("{ generate = \"bare\", seeds = \"5..2\" }", "", "world.seeds: found \"5..2\""),
        ("{ generate = \"castle\", seeds = \"2..5\" }", "", "castle"),
        ("{ generate = \"bare\", seed = 3 }", "seeds = \"1..2\"", "world.seed: found an unknown field"),
        ("{ folder = \"none\" }", "seeds = \"1..2\"", "world.folder: found \"none\""),
        ("{ }", "seeds = \"1..2\"", "generate = \"KIND\""),
    ] {
        let message = study(world, rest).unwrap_err();
        assert!(message.contains(wanted), "{world} {rest}: {message}");
    }
}

#[test]
fn built_in_studies_can_be_run() {
    for (name, cells, episodes) in [
        ("slip-occlusion", 144, 4320),
        ("wet-hall", 48, 960),
        ("light-camera", 50, 1000),
        ("faults-sobol", 768, 3072),
        ("robustness", 26, 1040),
        ("rooms", 28, 2800),
    ] {
        let study = Study::open(name, None).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!((study.cells(), study.episodes()), (cells, episodes), "{name}");
        let covered: u64 = (0..study.chunks()).map(|k| study.chunk(k).count).sum();
        assert_eq!(covered, episodes, "{name}: every episode is in a chunk");
        // Between listed levels everything was checked by opening it; of sampled points some are.
        for cell in (0..cells).step_by(7) {
            study
                .case(&study.values(cell), *study.seeds.start())
                .unwrap_or_else(|error| panic!("{name}, cell {cell}: {error}"));
        }
    }
    assert_eq!(Study::builtin_names().len(), 6, "the list above has all of them");
}

/// The interpreter with the packages of `tests/outside/requirements.txt`, where `.ci/run` or a person has made one.
fn python() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/python-venv/bin/python");
    if path.exists() {
        return Some(path);
    }
    stand_aside(&format!(
        "{} is missing; it takes the packages of tests/outside/requirements.txt, and .ci/run makes it",
        path.display()
    ));
    None
}

fn stand_aside(why: &str) {
    assert!(std::env::var_os("WAYHOME_REQUIRE_PYTHON").is_none(), "{why}");
    eprintln!("NOT RUN: {why}");
}

fn outside(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/outside").join(name)
}

/// A study of some seconds, so that a worker can be lost in the middle of a shard.
const LONGER: &str = r#"
name = "longer"
world = "lab"
seeds = "1..60"
[settings]
bearings = "noisy"
world.task.time_limit_s = 30
[[axes]]
setting = "hidden_share"
values = [0.0, 0.5, 0.9]
[[axes]]
setting = "method"
values = ["anchored-ekf", "alv"]
"#;

#[test]
fn hyperqueue_loses_a_worker_and_gets_the_same_rows() {
    let Some(python) = python() else { return };
    let base = tempfile::tempdir().unwrap();
    let at = base.path();
    fs::write(at.join("longer.toml"), LONGER).unwrap();
    done(wayhome(at, &["sweep", "longer.toml", "--out", "one"]));

    let mut script = Command::new(python);
    let study = at.join("longer.toml");
    script.arg(outside("hyperqueue_sweep.py")).arg(env!("CARGO_BIN_EXE_wayhome")).arg(study).arg("6").arg(at.join("queue"));
    let output = done(script);
    let told = String::from_utf8(output.stdout).unwrap();
    let told: serde_json::Value = serde_json::from_str(told.lines().last().unwrap()).unwrap();
    let attempts = told["attempts"].as_array().unwrap();
    let of = |shard: u64| attempts.iter().filter(move |attempt| attempt["shard"] == shard);
    assert!((1..=6).all(|shard| of(shard).count() > 0), "{told}");
    let again = attempts.iter().find(|attempt| attempt["instance"] == 1).expect("a shard that was started again");
    let shard = again["shard"].as_u64().unwrap();
    let workers: Vec<_> = of(shard).map(|attempt| attempt["worker"].as_str().unwrap()).collect();
    assert_eq!(workers, ["worker-1", "worker-2"], "lost with the one, done by the other: {told}");
    let rows = |folder: &str| fs::read(at.join(folder).join("rows.parquet")).unwrap();
    assert!(rows("queue/merged") == rows("one"), "the rows of one machine, to the byte");
}

/// Short runs through a small camera, of which many fail; names that must be written as HTML has them.
const SEEN: &str = r#"
name = "seen"
description = "All that a page can show: <two> axes & two methods, seen through a camera."
world = "crowd"
seeds = "1..2"
[settings]
bearings = "rendered"
size = "240x30"
renderer = "cpu"
extractor.features = 100
extractor.home_features = 100
time_limit_s = 8
world.task.arrival_radius_m = 0.3
world.start.max_distance_m = 1.2
[[axes]]
setting = "floor_friction"
label = "floor friction"
values = [0.8, 0.02]
[[axes]]
setting = "hidden_share"
label = "landmarks hidden"
values = [0.0, 0.5, 0.8, 0.9, 0.95, 0.98]
[[axes]]
setting = "method"
values = ["anchored-ekf", "alv"]
"#;

#[test]
fn the_page_is_drawn_in_a_browser() {
    let Some(python) = python() else { return };
    let base = tempfile::tempdir().unwrap();
    let at = base.path();
    fs::write(at.join("seen.toml"), SEEN).unwrap();
    done(wayhome(at, &["sweep", "seen.toml", "--out", "rows"]));
    done(wayhome(at, &["sweep", "report", "rows"]));
    let mut script = Command::new(python);
    let output = script.arg(outside("report_page.py")).arg(at.join("rows/report/index.html")).output().unwrap();
    if output.status.code() == Some(77) {
        return stand_aside(&String::from_utf8_lossy(&output.stderr));
    }
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    for width in ["390", "1280"] {
        let page = &told[width];
        assert_eq!(page["faults"], serde_json::json!([]), "at {width} px");
        // A map of success a method, of their difference one, and two curves an axis.
        assert_eq!(page["figures"].as_array().unwrap().len(), 2 + 1 + 2 * 2, "at {width} px: {page}");
        assert_eq!(page["pictures"], 24, "at {width} px: path and panorama of twelve failures");
    }
    done(wayhome(at, &["sweep", "report", "rows", "--no-gallery", "--out", "plain"]));
    let plain = fs::read_to_string(at.join("plain/index.html")).unwrap();
    assert_eq!((plain.matches("home --replay").count(), plain.matches("<img").count()), (0, 0));
    assert_eq!(plain.matches("<svg").count(), 2 + 1 + 2 * 2, "the figures stay");
}
