//! The command at its process boundary: what it prints, writes and exits with.

#![allow(clippy::unwrap_used, reason = "helpers of tests are not recognised as tests")]

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

const LAB: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/worlds/lab.toml");

/// `wayhome` with the given arguments, in `folder`.
fn wayhome(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wayhome"));
    command.current_dir(folder).args(arguments).env_remove("RUST_LOG");
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    wayhome(folder, arguments).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Checks that a command fails with the code, says all of `words`, prints no result and does not panic.
#[track_caller]
fn assert_fails(output: &Output, code: i32, words: &[&str]) {
    let text = stderr(output);
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
    assert!(output.stdout.is_empty(), "a failure prints no result: {}", String::from_utf8_lossy(&output.stdout));
}

#[track_caller]
fn assert_done(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

/// What git itself says is checked out is what the program names, in `--version` and in a summary.
#[test]
fn the_commit_is_named() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let git = Command::new("git").arg("-C").arg(package).args(["rev-parse", "HEAD"]).output();
    let commit = git.ok().filter(|output| output.status.success() && package.join(".git").exists());
    let expected = match commit.map(|output| String::from_utf8(output.stdout).unwrap()) {
        Some(commit) => format!("{} ({}", env!("CARGO_PKG_VERSION"), &commit[..7]),
        None => env!("CARGO_PKG_VERSION").to_owned(),
    };
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["--version"]);
    assert_done(&output);
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(printed.starts_with(&format!("wayhome {expected}")), "{printed} is not of {expected}");
    std::fs::write(folder.path().join("drive.csv"), "t_s,v_m_s,omega_rad_s\n0,0.3,0\n0.1,0,0\n").unwrap();
    assert_done(&run(folder.path(), &["drive", "lab", "--commands", "drive.csv", "--out", "run"]));
    let summary = std::fs::read_to_string(folder.path().join("run/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["version"], printed.trim_start_matches("wayhome ").trim_end());
}

#[test]
fn bad_worlds_are_explained() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let lab = std::fs::read_to_string(LAB).unwrap();
    write("broken.toml", "name = \"lab\n[room");
    write("unknown.toml", &lab.replace("[room]", "[room]\nceiling_height = 3"));
    write("walled.toml", &lab.replace("x_m = 3.4", "x_m = 0.0"));

    assert_fails(&run(folder.path(), &["home", "missing.toml"]), 2, &["missing.toml"]);
    assert_fails(&run(folder.path(), &["world", "check", "broken.toml"]), 1, &["broken.toml", "1"]);
    assert_fails(&run(folder.path(), &["world", "check", "unknown.toml"]), 1, &["unknown.toml", "ceiling_height"]);
    assert_fails(&run(folder.path(), &["world", "check", "walled.toml"]), 1, &["walled.toml", "home"]);
    assert_fails(&run(folder.path(), &["render", "unknown.toml", "--pose", "1,1,0"]), 1, &["ceiling_height"]);
    assert!(!folder.path().join("results").exists(), "a failure leaves no folder behind");
}

#[test]
fn bad_values_are_usage_errors() {
    let folder = tempfile::tempdir().unwrap();
    let home = |more: &[&str]| run(folder.path(), &[&["home", LAB], more].concat());
    for size in ["0x0", "1440", "15x64", "100000x64", "-1x8"] {
        assert_fails(&home(&[&format!("--size={size}")]), 2, &["--size"]);
    }
    for pose in ["1,2", "1,2,NaN", "1,2,east", "1,2,3,4"] {
        assert_fails(&run(folder.path(), &["render", LAB, "--pose", pose]), 2, &["--pose"]);
    }
    assert_fails(&home(&["--seeds", "9..1"]), 2, &["--seeds"]);
    assert_fails(&home(&["--threads", "0"]), 2, &["--threads"]);
    assert_fails(&home(&["--time-limit-s", "-1"]), 2, &["--time-limit-s"]);
    assert_fails(&home(&["--plant", "hovercraft"]), 2, &["rapier", "unicycle"]);
    assert_fails(&home(&["--noise-deg", "1"]), 2, &["--bearings noisy"]);
    assert_fails(&home(&["--bearings", "ideal", "--size", "64x32"]), 2, &["--bearings rendered"]);
    assert_fails(&home(&["--bearings", "ideal", "--start", "nowhere"]), 2, &["nowhere"]);
    assert_fails(&home(&["--light", "dusk"]), 2, &["--light", "evening"]);
    assert_fails(&home(&["--bearings", "ideal", "--home-camera", "cheap"]), 2, &["--bearings rendered"]);
    assert_fails(&run(folder.path(), &[]), 2, &["Usage"]);
    assert!(!folder.path().join("results").exists(), "a failure leaves no folder behind");
}

#[test]
fn places_where_nothing_can_stand_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let home = |start: &str| run(folder.path(), &["home", LAB, "--bearings", "ideal", "--start", start]);
    assert_fails(&home("0.05,3,0"), 2, &["start", "wall"]);
    assert_fails(&home("-5,3,0"), 2, &["start", "room"]);
    let render = |pose: &str| run(folder.path(), &["render", LAB, "--pose", pose]);
    assert_fails(&render("-1,3,0"), 2, &["--pose", "outside the room"]);
    assert_fails(&render("0,3,0"), 2, &["--pose", "in a wall"]);
    let world: toml::Table = toml::from_str(&std::fs::read_to_string(LAB).unwrap()).unwrap();
    let pillar = world["landmarks"].as_array().unwrap().iter().find(|b| b["name"].as_str() == Some("pillar")).unwrap();
    let (x, y) = (&pillar["position_m"][0], &pillar["position_m"][1]);
    assert_fails(&home(&format!("{x},{y},0")), 2, &["start", "pillar"]);
    assert_fails(&render(&format!("{x},{y},0")), 2, &["--pose", "pillar"]);
}

#[test]
fn folders_that_cannot_be_written_are_named() {
    let folder = tempfile::tempdir().unwrap();
    // Below a regular file no folder can be made, whoever asks.
    std::fs::write(folder.path().join("file"), "").unwrap();
    let below = run(folder.path(), &["home", LAB, "--bearings", "ideal", "--out", "file/below"]);
    assert_fails(&below, 1, &["file/below"]);
    std::fs::create_dir(folder.path().join("mine")).unwrap();
    std::fs::write(folder.path().join("mine/summary.json"), "mine").unwrap();
    let taken = run(folder.path(), &["home", LAB, "--bearings", "ideal", "--out", "mine"]);
    assert_fails(&taken, 1, &["mine", "summary.json", "--out"]);
    assert_eq!(std::fs::read(folder.path().join("mine/summary.json")).unwrap(), b"mine");
}

#[test]
fn no_adapter_is_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    // No driver file, no Vulkan adapter; the other back ends do not exist where these variables mean anything.
    for verb in [&["render", LAB, "--pose", "3,3,0"][..], &["home", LAB]] {
        let mut command = wayhome(folder.path(), verb);
        command.args(["--renderer", "gpu"]).env("VK_DRIVER_FILES", "/nonexistent.json");
        command.env("VK_ICD_FILENAMES", "/nonexistent.json").env_remove("VK_ADD_DRIVER_FILES");
        let output = command.output().unwrap();
        if cfg!(target_os = "linux") {
            assert_fails(&output, 1, &["no graphics adapter", "--renderer cpu"]);
        }
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_in_good_order() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["home", LAB, "--bearings", "noisy", "--seeds", "1..90000", "--out", "batch"];
    let mut child = wayhome(folder.path(), &arguments).stderr(std::process::Stdio::piped()).spawn().unwrap();
    // The folder is opened once the handler is in place.
    let marker = folder.path().join("batch/.wayhome");
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(20);
    while !marker.exists() {
        assert!(std::time::Instant::now() < deadline, "the batch does not start");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(130));
    let held: Vec<_> = std::fs::read_dir(folder.path().join("batch")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(held, [".wayhome"], "nothing half done is left");
}

/// The summary of a finished run without what may differ from run to run.
fn summary(folder: &Path) -> Value {
    let text = std::fs::read_to_string(folder.join("summary.json")).unwrap();
    let mut summary: Value = serde_json::from_str(&text).unwrap();
    summary.as_object_mut().unwrap().remove("timing").expect("a summary has timings");
    summary
}

#[test]
fn a_run_comes_home_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["home", LAB, "--plant", "unicycle", "--bearings", "ideal", "--seed", "3", "--json", "--out", "run"];
    let output = run(folder.path(), &arguments);
    assert_done(&output);
    assert_eq!(stderr(&output), "", "no progress where stderr is no terminal");
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let summary = summary(&folder.path().join("run"));
    for (key, value) in summary.as_object().unwrap() {
        assert_eq!(&printed[key], value, "{key}");
    }
    assert_eq!(summary["outcome"], "home");
    assert!(summary["final_distance_m"].as_f64().unwrap() <= 0.05);
    assert!(summary["time_ratio"].as_f64().unwrap() >= 0.9);
    assert_eq!(summary["renderer"], Value::Null);

    // What the summary says must follow from the trajectory beside it.
    let text = std::fs::read_to_string(folder.path().join("run/trajectory.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(rows[0][..4], ["t_s", "x_m", "y_m", "heading_rad"]);
    assert!(rows.iter().all(|r| r.len() == rows[0].len()));
    let number = |row: &[&str], column: usize| row[column].parse::<f64>().unwrap();
    let (first, last) = (&rows[1], &rows[rows.len() - 1]);
    assert_eq!(number(first, 0), 0.0);
    assert_eq!(summary["start"]["x_m"].as_f64().unwrap(), number(first, 1));
    let home = |axis: &str| summary["home"][axis].as_f64().unwrap();
    let distance = (number(last, 1) - home("x_m")).hypot(number(last, 2) - home("y_m"));
    assert!((summary["final_distance_m"].as_f64().unwrap() - distance).abs() < 1e-12);
    assert!(std::fs::read_to_string(folder.path().join("run/path.svg")).unwrap().contains("<svg"));
}

#[test]
fn a_run_that_does_not_come_home_exits_with_3() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["home", LAB, "--bearings", "ideal", "--time-limit-s", "1"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("out of time"));
    assert_eq!(summary(&folder.path().join("results/runs/home-lab-0"))["outcome"], "timeout");
}

#[test]
fn a_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let files = |sensor: &[&str], threads: &str, out: &str| {
        let common =
            ["home", LAB, "--seed", "7", "--time-limit-s", "3", "--renderer", "cpu", "--threads", threads, "--out", out];
        let output = run(folder.path(), &[&common, sensor].concat());
        assert!(matches!(output.status.code(), Some(0 | 3)), "{}", stderr(&output));
        let path = folder.path().join(out);
        (std::fs::read(path.join("trajectory.csv")).unwrap(), summary(&path))
    };
    let cheap =
        ["--bearings", "rendered", "--size", "720x90", "--camera", "cheap", "--light", "evening", "--home-light", "day"];
    for sensor in [&["--bearings", "noisy"][..], &["--bearings", "rendered", "--size", "720x90"], &cheap] {
        let first = files(sensor, "1", "a");
        assert!(first.0.len() > 1000, "a trajectory of some steps");
        assert_eq!(first, files(sensor, "1", "a"), "a second time, in the same folder");
        assert_eq!(first, files(sensor, "2", "b"), "on two threads");
    }
}

#[test]
fn a_batch_counts_its_runs() {
    let folder = tempfile::tempdir().unwrap();
    let batch = |threads: &str, out: &str| {
        let output = run(
            folder.path(),
            &["home", LAB, "--bearings", "noisy", "--seeds", "1..6", "--threads", threads, "--json", "--out", out],
        );
        assert_done(&output);
        let rows = std::fs::read_to_string(folder.path().join(out).join("seeds.csv")).unwrap();
        (rows, serde_json::from_slice::<Value>(&output.stdout).unwrap())
    };
    let (rows, printed) = batch("1", "one");
    assert_eq!(rows.lines().count(), 7);
    let home = rows.lines().filter(|l| l.split(',').nth(1) == Some("home")).count();
    assert_eq!((printed["runs"].as_u64(), printed["home"].as_u64()), (Some(6), Some(home as u64)));
    assert_eq!(printed["per_seed"].as_array().unwrap().len(), 6);
    assert_eq!(rows, batch("2", "two").0, "on two threads");

    // A seed gives the same run alone and in a batch.
    run(folder.path(), &["home", LAB, "--bearings", "noisy", "--seed", "4", "--out", "single"]);
    let alone = summary(&folder.path().join("single"));
    let mut within = printed["per_seed"][3].clone();
    within.as_object_mut().unwrap().remove("timing");
    assert_eq!(alone, within);
}

#[test]
fn a_robustness_study_is_the_same_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let study = |threads: &str, more: &[&str]| {
        let common = ["robustness", LAB, "--bearings", "ideal", "--time-limit-s", "5", "--seeds", "1..3", "--out", "study"];
        run(folder.path(), &[&common, &["--threads", threads][..], more].concat())
    };
    let files = |threads: &str| {
        assert_done(&study(threads, &["--axis", "noise,hidden"]));
        ["README.md", "robustness.csv", "robustness.svg"].map(|name| {
            let text = std::fs::read_to_string(folder.path().join("study").join(name)).unwrap();
            assert!(!text.contains("--threads"), "what does not matter is not told");
            text
        })
    };
    let first = files("1");
    assert_eq!(first[1].lines().count(), 1 + 8 + 6);
    assert!(first[0].contains("--seeds 1..3 --axis noise,hidden"), "{}", first[0]);
    assert_eq!(first, files("2"));

    assert_fails(&study("1", &["--axis", "weather"]), 2, &["--axis", "friction"]);
    assert_fails(&study("1", &["--size", "64x32"]), 2, &["--bearings rendered"]);
    assert_fails(&run(folder.path(), &["robustness", LAB, "--seeds", "3..1"]), 2, &["--seeds"]);
}

/// Runs a command, then the one that its page prints, through a shell, and compares what they wrote.
#[cfg(unix)]
#[track_caller]
fn assert_printed_command_runs_again(arguments: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(LAB, folder.path().join("my room.toml")).unwrap();
    let out = "out of '$HOME'";
    assert_done(&run(folder.path(), &[arguments, &["--out", out]].concat()));
    let held = |name: &str| files(&folder.path().join(name));
    std::fs::rename(folder.path().join(out), folder.path().join("first")).unwrap();
    let page = std::fs::read_to_string(folder.path().join("first/README.md")).unwrap();
    let command = page.split_once("```sh\n").unwrap().1.split_once("\n```").unwrap().0;
    let programs = Path::new(env!("CARGO_BIN_EXE_wayhome")).parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let again = Command::new("sh").args(["-c", command]).current_dir(folder.path()).env("PATH", path).output().unwrap();
    assert!(again.status.success(), "{command}: {}", stderr(&again));
    assert!(held("first") == held(out), "{command} wrote other files");
}

#[cfg(unix)]
#[test]
fn a_printed_command_runs_again() {
    // A program that answers nonsense: its runs fail, and are recorded.
    let program = "exec:echo 'it is' \"$HOME, sweet\" it\\'s";
    let short = ["--seeds", "1..2", "--time-limit-s", "1", "--bearings", "ideal"];
    let robustness = ["robustness", "my room.toml", "--axis", "noise", "--method", program];
    assert_printed_command_runs_again(&[&robustness[..], &short].concat());
    let compare = [
        "compare",
        "my room.toml",
        "--places",
        "0",
        "--contenders",
        "alv,weber",
        "--method",
        program,
        "--method",
        "exec:false",
    ];
    assert_printed_command_runs_again(&[&compare[..], &short].concat());
}

#[test]
fn a_panorama_comes_with_its_truth() {
    let folder = tempfile::tempdir().unwrap();
    let output =
        run(folder.path(), &["render", LAB, "--pose", "3,3,90", "--size", "256x64", "--renderer", "cpu", "--out", "view"]);
    assert_done(&output);
    let path = folder.path().join("view");
    let open = |name: &str| image::open(path.join(name)).unwrap();
    let (colours, range, instance) = (open("rgb.png"), open("range.png"), open("instance.png"));
    assert_eq!((colours.width(), colours.height()), (256, 64));
    let (range, instance) = (range.as_luma16().unwrap(), instance.as_luma16().unwrap());
    let meta: Value = serde_json::from_str(&std::fs::read_to_string(path.join("meta.json")).unwrap()).unwrap();
    let known: Vec<u64> = meta["instances"].as_array().unwrap().iter().map(|i| i["id"].as_u64().unwrap()).collect();
    assert!(instance.pixels().all(|p| known.contains(&u64::from(p.0[0]))), "every instance has a name");
    assert!(range.pixels().all(|p| (200..10_000).contains(&p.0[0])), "ranges of a room, in mm");
    assert_eq!(meta["pose"]["heading_rad"].as_f64(), Some(std::f64::consts::FRAC_PI_2));
    // The bottom row looks at the floor, at a range that the camera's height and the row's elevation fix.
    let projection = &meta["projection"];
    let tan = (projection["horizon_row"].as_f64().unwrap() - 63.5) * std::f64::consts::TAU / 256.0;
    let expected_mm = 1000.0 * meta["camera_height_m"].as_f64().unwrap() * (1.0 + tan * tan).sqrt() / -tan;
    let floor = meta["instances"].as_array().unwrap().iter().find(|i| i["name"] == "floor").unwrap()["id"].as_u64();
    for (range, _) in range
        .rows()
        .next_back()
        .unwrap()
        .zip(instance.rows().next_back().unwrap())
        .filter(|(_, i)| Some(u64::from(i.0[0])) == floor)
    {
        assert!((f64::from(range.0[0]) - expected_mm).abs() < 2.0, "{} mm, expected {expected_mm}", range.0[0]);
    }
}

#[test]
fn light_and_camera_change_colours_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let render = |more: &[&str]| {
        let common = ["render", "gallery", "--pose", "2.6,3.4,20", "--size", "256x48", "--renderer", "cpu", "--out", "view"];
        assert_done(&run(folder.path(), &[&common, more].concat()));
        ["rgb.png", "range.png", "instance.png", "meta.json"]
            .map(|file| std::fs::read(folder.path().join("view").join(file)).unwrap())
    };
    let plain = render(&["--camera", "ideal"]);
    let mut seen = vec![plain[0].clone()];
    for look in [
        &["--camera", "cheap"][..],
        &["--camera", "cheap", "--seed", "1"],
        &["--camera", "dirty"],
        &["--light", "night", "--camera", "night"],
        &["--light", "glare"],
    ] {
        let [rgb, range, instance, meta] = render(look);
        assert!(!seen.contains(&rgb), "{look:?}: a look of its own");
        assert!(range == plain[1] && instance == plain[2], "{look:?}: truth stays exact");
        let meta: Value = serde_json::from_slice(&meta).unwrap();
        assert_eq!(meta[look[0].trim_start_matches('-')], look[1]);
        seen.push(rgb);
    }
    assert!(render(&["--camera", "cheap", "--seed", "1"])[0] == seen[2], "the same seed, the same noise");
}

#[test]
fn worlds_can_be_checked_drawn_and_described() {
    let folder = tempfile::tempdir().unwrap();
    let check = run(folder.path(), &["world", "check", LAB]);
    assert_done(&check);
    assert!(String::from_utf8_lossy(&check.stdout).starts_with("OK: lab"));
    let plot = run(folder.path(), &["world", "plot", LAB]);
    assert_done(&plot);
    assert!(String::from_utf8_lossy(&plot.stdout).contains("<svg"));
    assert_done(&run(folder.path(), &["world", "plot", LAB, "--out", "map.svg"]));
    assert_eq!(std::fs::read(folder.path().join("map.svg")).unwrap(), plot.stdout);
    let schema = run(folder.path(), &["world", "schema"]);
    assert_done(&schema);
    let schema: Value = serde_json::from_slice(&schema.stdout).unwrap();
    assert!(schema["properties"]["room"].is_object(), "{schema}");
}

#[test]
fn a_table_of_commands_is_driven_and_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let table = |name: &str, rows: &str| {
        std::fs::write(folder.path().join(name), format!("t_s,v_m_s,omega_rad_s\n{rows}")).unwrap();
    };
    table("turn.csv", "0,0.25,0\n1,0.2,0.8\n3.05,0,0\n");
    let drive = |out: &str| {
        let output = run(folder.path(), &["drive", LAB, "--commands", "turn.csv", "--seed", "5", "--json", "--out", out]);
        assert_done(&output);
        let read = |name: &str| std::fs::read_to_string(folder.path().join(out).join(name)).unwrap();
        (read("drive.csv"), read("summary.json"), read("path.svg"))
    };
    let (csv, summary, drawing) = drive("first");
    assert_eq!((csv.clone(), summary.clone(), drawing.clone()), drive("second"), "same seed, same bytes");
    assert!(drawing.contains("<svg") && drawing.contains("odometry"));

    // What the summary says must follow from the table beside it.
    let summary: Value = serde_json::from_str(&summary).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|c| *c == name).expect(name);
    let number = |row: &[&str], name: &str| row[column(name)].parse::<f64>().unwrap();
    assert_eq!(rows.len(), 1 + 1 + 10 + 21, "a header, the start, and an interval of at most 0.1 s each");
    let last = rows.last().unwrap();
    assert_eq!((number(last, "t_s"), summary["time_s"].as_f64()), (3.05, Some(3.05)));
    let drift = (number(last, "x_odom_m") - number(last, "x_m")).hypot(number(last, "y_odom_m") - number(last, "y_m"));
    assert!((summary["odometry_drift_m"].as_f64().unwrap() - drift).abs() < 1e-12 && drift > 0.0);
    // Every collision is in a table of its own, with time, body and impulse.
    let hits = std::fs::read_to_string(folder.path().join("first/collisions.csv")).unwrap();
    assert_eq!(hits.lines().next(), Some("t_s,with,impulse_n_s"));
    assert_eq!(hits.lines().count() - 1, summary["collisions"].as_u64().unwrap() as usize);
    // Forces over an interval make the momentum gained in it: here straight ahead, from rest.
    let mass = 2.3;
    let force: f64 = ["left", "right", "caster"].iter().map(|w| number(&rows[2], &format!("force_{w}_forward_n"))).sum();
    let gained = mass * number(&rows[2], "v_forward_m_s");
    assert!((force * 0.1 / gained - 1.0).abs() < 1e-3, "{force} N for 0.1 s against {gained} N s");

    table("gap.csv", "0,0.25,0\n\n3,0,0\n");
    table("back.csv", "0,0.25,0\n2,0.1,0\n1,0,0\n");
    for (name, words) in [("gap.csv", ["gap.csv", "line 3", "blank"]), ("back.csv", ["back.csv", "line 4", "t_s"])] {
        assert_fails(&run(folder.path(), &["drive", LAB, "--commands", name]), 1, &words);
    }
    assert_fails(&run(folder.path(), &["drive", LAB]), 2, &["--commands"]);
    assert!(!folder.path().join("results").exists(), "a failure leaves no folder behind");
}

/// Every file of a folder with its bytes, by name.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut held: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(&path).unwrap()))
        .collect();
    held.sort();
    held
}

#[test]
fn parts_of_the_paper_are_reproduced_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    assert_done(&run(folder.path(), &["reproduce", "fig3", "observability", "--threads", "1", "--out", "one"]));
    let two = run(folder.path(), &["reproduce", "observability", "fig3", "--threads", "3", "--out", "two", "--json"]);
    assert_done(&two);
    assert_eq!(files(&folder.path().join("one")), files(&folder.path().join("two")));
    let printed: Value = serde_json::from_slice(&two.stdout).unwrap();
    assert_eq!(printed["sections"][0]["target"], "fig3");
    // A part takes its place in the page; the others stay.
    assert_done(&run(folder.path(), &["reproduce", "table1", "--out", "one"]));
    let page = std::fs::read_to_string(folder.path().join("one/README.md")).unwrap();
    let at = |heading: &str| page.find(heading).unwrap_or_else(|| panic!("{heading}: {page}"));
    assert!(at("## Table I") < at("## Fig. 3") && at("## Fig. 3") < at("## Observability"));
    assert!(folder.path().join("one/observability-homeward.svg").is_file());
}

#[test]
fn a_set_of_panoramas_is_checked_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("set")).unwrap();
    let reproduce = |target: &str, set: &str| run(folder.path(), &["reproduce", target, "--dataset", set]);
    assert_fails(&reproduce("fig8", "set"), 2, &["--dataset", "fig8", "fig7"]);
    assert_fails(&reproduce("fig7", "nowhere"), 1, &["nowhere"]);
    assert_fails(&reproduce("fig7", "set"), 1, &["set", "<i>_<j>.pgm"]);
    assert_fails(&reproduce("fig9", "set"), 2, &["fig9", "table1"]);
    std::fs::write(folder.path().join("set/0_0.pgm"), "P5\n4 2\n255\n12345678").unwrap();
    assert_fails(&reproduce("fig7", "set"), 1, &["1 x 1", "10 x 17"]);
    assert!(!folder.path().join("results").exists());
}

#[test]
fn methods_are_compared_from_the_same_starts() {
    let folder = tempfile::tempdir().unwrap();
    let common = ["compare", "paper-ideal", "--plant", "unicycle", "--bearings", "ideal", "--seeds", "1..3", "--places", "9"];
    let chosen = ["--contenders", "paper-ekf-told,alv-compass", "--json"];
    let compare = |threads: &str, out: &str| {
        let output = run(folder.path(), &[&common[..], &chosen[..], &["--threads", threads, "--out", out]].concat());
        assert_done(&output);
        serde_json::from_slice::<Value>(&output.stdout).unwrap()
    };
    let (one, two) = (compare("1", "one"), compare("2", "two"));
    assert_eq!(one["standings"], two["standings"]);
    assert_eq!((&one["standings"][0]["home"], &one["standings"][1]["runs"]), (&Value::from(3), &Value::from(3)));
    let names: Vec<String> = files(&folder.path().join("one")).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, [".wayhome", "README.md", "compare.csv", "compare.svg", "map-alv-compass.svg", "map-paper-ekf-told.svg"]);
    assert_fails(&run(folder.path(), &["compare", "--contenders", "nobody"]), 2, &["nobody", "anchored-ekf"]);
}

#[test]
fn observability_is_mapped_for_any_world() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["observability", LAB, "--spacing-m", "0.5", "--heading-deg", "-30", "--out", "map"]);
    assert_done(&output);
    assert!(String::from_utf8_lossy(&output.stdout).contains("full rank"));
    let table = std::fs::read_to_string(folder.path().join("map/observability.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + 14 * 12);
    assert_fails(&run(folder.path(), &["observability", "lab", "--spacing-m", "0.001"]), 2, &["0.001", "250000"]);
}

#[test]
fn the_physics_page_holds_its_closed_forms() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["verify", "physics", "--json", "--out", "page"]);
    assert_done(&output);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let page = std::fs::read_to_string(folder.path().join("page/README.md")).unwrap();
    for form in printed["closed_forms"].as_array().unwrap() {
        let (difference, allowed) = (form["greatest_difference"].as_f64().unwrap(), form["allowed"].as_f64().unwrap());
        assert!(difference <= allowed, "{form}");
        let drawing = format!("{}.svg", form["name"].as_str().unwrap());
        assert!(page.contains(&drawing) && folder.path().join("page").join(&drawing).is_file(), "{drawing}");
    }
    assert!(page.contains("| 0 rises |"), "{page}");
    // What an older version has written may be written again, also by the old name.
    let marker = folder.path().join("page/.wayhome");
    std::fs::write(&marker, "physics-report\n").unwrap();
    assert_done(&run(folder.path(), &["physics-report", "--out", "page"]));
    assert!(std::fs::read_to_string(marker).unwrap().starts_with("verify physics\n"));
    assert_fails(&run(folder.path(), &["verify", "vision", "--out", "page"]), 1, &["verify physics"]);
}

#[test]
fn a_trajectory_becomes_a_film_and_a_sheet() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("way.csv", "t_s,x_m,y_m,heading_rad,v_cmd\n0,3,3,0,0.1\n0.1,3.1,3,0.1,0.1\n0.2,3.2,3,0.2,0.1\n");
    let common = ["render", LAB, "--size", "128x16", "--renderer", "cpu", "--trajectory"];
    let film = |file: &str, more: &[&str]| run(folder.path(), &[&common[..], &[file], more].concat());
    let output = film("way.csv", &["--out", "film", "--json"]);
    assert_done(&output);
    let meta: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(meta["frames"][2]["pose"]["x_m"], 3.2);
    let held = |name: &str| folder.path().join("film").join(name);
    let colours = |name: &str| image::open(held(name)).unwrap().to_rgb8().into_raw();
    assert_ne!(colours("rgb-000000.png"), colours("rgb-000002.png"));
    // A frame is what `--pose` gives, and a shorter film leaves none of the longer one.
    let pose = format!("3.2,3,{}", 0.2_f64.to_degrees());
    assert_done(&run(
        folder.path(),
        &["render", LAB, "--size", "128x16", "--renderer", "cpu", "--pose", &pose, "--out", "still"],
    ));
    let still = image::open(folder.path().join("still/range.png")).unwrap();
    assert_eq!(image::open(held("range-000002.png")).unwrap(), still);
    write("short.csv", "t,x,y,heading\n0,3,3,0\n");
    assert_done(&film("short.csv", &["--out", "film"]));
    assert!(held("instance-000000.png").exists() && !held("rgb-000001.png").exists());

    assert_done(&film("way.csv", &["--sheet", "--out", "sheet"]));
    let sheet = image::open(folder.path().join("sheet/sheet.png")).unwrap();
    assert_eq!((sheet.width(), sheet.height()), (128, 3 * (3 * 16 + 2 * 2) + 2 * 10));
    assert_done(&run(folder.path(), &["render", "crowd", "--sheet", "--size", "64x8", "--renderer", "cpu", "--out", "crowd"]));

    write("lost.csv", "t,x,y,heading\n0,3,3,0\n1,30,3,0\n");
    assert_fails(&film("lost.csv", &["--out", "lost"]), 1, &["lost.csv: frame 1", "outside the room"]);
    write("bad.csv", "t,x,y,heading\n0,3,,0\n");
    assert_fails(&film("bad.csv", &["--out", "lost"]), 1, &["line 2, y", "finite number"]);
    assert_fails(&film("none.csv", &["--out", "lost"]), 1, &["none.csv"]);
    assert!(!folder.path().join("lost").exists(), "a failure leaves no folder behind");
    assert_fails(&run(folder.path(), &["render", LAB]), 2, &["--pose", "--trajectory", "--sheet", "--bench"]);
    assert_fails(&run(folder.path(), &["render", LAB, "--bench"]), 2, &["--bench"]);
}

#[test]
fn the_vision_page_keeps_its_pairs_to_itself() {
    let folder = tempfile::tempdir().unwrap();
    let report = |threads: &str, pairs: &str, out: &str| {
        let arguments = ["verify", "vision", LAB, "--axis", "distance", "--keypoints", "150", "--pairs", pairs, "--out", out];
        run(folder.path(), &[&arguments[..], &["--json", "--threads", threads]].concat())
    };
    let output = report("2", "pairs", "page");
    assert_done(&output);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let cells = printed["cells"].as_array().unwrap();
    assert!(cells.len() == 5 && cells[0]["precision"].as_f64().unwrap() > 0.9, "{}", cells[0]);
    let pairs: Value = serde_json::from_slice(&std::fs::read(folder.path().join("pairs/pairs.json")).unwrap()).unwrap();
    for pair in pairs.as_array().unwrap() {
        let name = pair["name"].as_str().unwrap();
        assert!(folder.path().join("pairs").join(format!("{name}-range.png")).is_file(), "{name}");
    }
    assert_fails(&report("2", "pairs", "page"), 1, &["pairs"]);
    assert_done(&report("1", "more", "again"));
    for name in ["vision.csv", "errors.svg"] {
        let read = |page: &str| std::fs::read(folder.path().join(page).join(name)).unwrap();
        assert_eq!(read("page"), read("again"), "{name}");
    }
}

/// The program's own panoramas as a camera's pictures: they say the way home, and what cannot be is named.
#[test]
fn pictures_say_the_way_home() {
    let folder = tempfile::tempdir().unwrap();
    for (name, pose) in [("home", "3.4,3.0,0"), ("now", "3.0,2.6,90")] {
        let out = ["render", "lab", "--pose", pose, "--size", "720x90", "--renderer", "cpu", "--out", name];
        assert_done(&run(folder.path(), &out));
    }
    let own = ["--lens", "cylindrical", "--anticlockwise", "--horizon-row", "54"];
    let bearings = ["bearings", "home/rgb.png", "now/rgb.png", "--out", "all.csv", "--json"];
    let output = run(folder.path(), &[&bearings[..], &own[..]].concat());
    assert_done(&output);
    let rows: Value = serde_json::from_slice(&output.stdout).unwrap();
    let number = |key: &str| rows[0][key].as_f64().unwrap();
    assert!((number("turn_deg") - 90.0).abs() < 1.0, "{rows}");
    // Home is ahead and to the left in the room, at 45 degrees, seen from a robot that looks along y.
    assert!((number("home_deg") + 45.0).abs() < 3.0, "{rows}");
    let table = std::fs::read_to_string(folder.path().join("all.csv")).unwrap();
    assert_eq!(table.lines().count() as u64, rows[0]["bearings"].as_u64().unwrap() + 1);
    assert_fails(&run(folder.path(), &[&bearings[..5], &own[..]].concat()), 1, &["all.csv"]);
    let ring = ["bearings", "home/rgb.png", "now/rgb.png", "--lens", "ring", "--radii", "10,300"];
    assert_fails(&run(folder.path(), &ring), 1, &["radii 10 to 300 px", "720 x 90 pixels"]);
    assert_fails(&run(folder.path(), &["bearings", "home/rgb.png", "gone.png"]), 1, &["gone.png"]);

    let set =
        ["dataset", "lab", "--grid", "3x3", "--spacing-m", "0.3", "--size", "360x45", "--renderer", "cpu", "--out", "set"];
    assert_done(&run(folder.path(), &set));
    let evaluate = ["evaluate", "set", "--methods", "ridf,minwarping", "--out", "evaluated", "--json"];
    let output = run(folder.path(), &evaluate);
    assert_done(&output);
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    let warping = &result["fields"][1];
    assert_eq!((warping["method"].as_str(), warping["homes"].as_u64()), (Some("minwarping"), Some(9)), "{result}");
    assert!(warping["return_ratio"].as_f64().unwrap() > 0.9 && warping["aae_deg"].as_f64().unwrap() < 15.0, "{result}");
    for file in ["README.md", "pairs.csv", "homes.csv"] {
        assert!(folder.path().join("evaluated").join(file).is_file(), "{file}");
    }
}
