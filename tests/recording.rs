//! Recordings of a run, opened by the tools of others.

#![allow(clippy::unwrap_used, reason = "helpers of tests are not recognised as tests")]

#[allow(dead_code, reason = "other tests use the rest")]
mod support;

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use support::{assert_exit, project, python, run, wayhome};

/// A run in a room in which somebody walks, seen through a small camera.
const CROWD: &[&str] = &["home", "crowd", "--renderer", "cpu", "--size", "480x60", "--seed", "3"];

fn file_names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_recording_changes_nothing_and_is_the_same_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let home = |more: &[&str]| run(folder.path(), &[CROWD, &["--time-limit-s", "4"], more].concat());
    let read = |path: &str| fs::read(folder.path().join(path)).unwrap();
    assert_exit(&home(&["--out", "plain"]), 3, &[]);
    assert_exit(&home(&["--out", "told", "--record", "run.mcap", "--video", "run.gif"]), 3, &[]);
    for name in ["trajectory.csv", "trajectory.tum", "path.svg", "panorama_end.png"] {
        assert!(read(&format!("plain/{name}")) == read(&format!("told/{name}")), "{name} differs");
    }
    let first = ["run.mcap", "run.gif"].map(read);
    assert_exit(&home(&["--out", "told", "--record", "run.mcap", "--video", "run.gif"]), 3, &[]);
    assert!(first == ["run.mcap", "run.gif"].map(read), "the same run, the same bytes");
    assert_eq!(file_names(folder.path()), ["plain", "run.gif", "run.mcap", "told"], "nothing half written is left");

    // The film has the run's length, and its last picture the robot where it stopped.
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(&first[1][..]).unwrap();
    let (mut frames, mut hundredths) = (0, 0);
    let (mut width, mut height) = (0, 0);
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        (frames, hundredths) = (frames + 1, hundredths + u32::from(frame.delay));
        (width, height) = (frame.width, frame.height);
    }
    assert!((20..40).contains(&frames), "{frames} frames");
    assert!((400..800).contains(&hundredths), "{hundredths}");
    assert!(width == 720 && height > 300, "{width} x {height}");
}

#[test]
fn recordings_that_cannot_be_are_refused_before_the_run() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("mine.mcap"), "mine").unwrap();
    fs::write(folder.path().join("mine.gif"), "GIF89a mine").unwrap();
    fs::create_dir(folder.path().join("out")).unwrap();
    let home = |more: &[&str]| run(folder.path(), &[&["home", "lab", "--bearings", "ideal", "--out", "out"], more].concat());
    for (flag, path, code, words) in [
        ("--record", "nowhere/run.mcap", 1, ["nowhere", "cannot write to folder"]),
        ("--record", "mine.mcap", 1, ["mine.mcap", "another name"]),
        ("--video", "mine.gif", 1, ["mine.gif", "another name"]),
        ("--video", "run.mp4", 2, ["--video", ".gif"]),
        ("--video", "run", 2, ["--video", "no ending"]),
        ("--record", "run.bag", 2, ["--record", ".mcap"]),
        ("--record", "out/run.mcap", 2, ["out/run.mcap", "another folder"]),
        ("--video", "mine.gif/run.gif", 1, ["mine.gif", "cannot write to folder"]),
    ] {
        assert_exit(&home(&[flag, path]), code, &words);
    }
    assert_exit(&home(&["--record", "run.mcap", "--seeds", "1..2"]), 2, &["--record", "--seeds"]);
    assert_eq!(file_names(folder.path()), ["mine.gif", "mine.mcap", "out"]);
    assert!(file_names(&folder.path().join("out")).is_empty(), "nothing ran");
    assert_eq!(fs::read(folder.path().join("mine.mcap")).unwrap(), b"mine");
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_no_half_recording() {
    let folder = tempfile::tempdir().unwrap();
    // It turns on the spot until it is stopped.
    let turns =
        "exec:sh -c 'read hello; echo {}; while read line; do echo \"{\\\"v_m_s\\\":0,\\\"omega_rad_s\\\":0.5}\"; done'";
    let arguments = [
        &["home", "lab", "--bearings", "ideal", "--method", turns, "--time-limit-s", "100000"][..],
        &["--record", "run.mcap", "--video", "run.gif", "--out", "out"],
    ]
    .concat();
    let mut child = wayhome(folder.path(), &arguments).stderr(std::process::Stdio::null()).spawn().unwrap();
    let is_partial = |name: &std::ffi::OsStr| name.to_string_lossy().starts_with("run.gif.");
    let recorded = || {
        let files = fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap());
        files.filter(|file| is_partial(&file.file_name())).map(|file| file.metadata().map_or(0, |m| m.len())).sum::<u64>()
    };
    let deadline = Instant::now() + Duration::from_secs(20);
    while recorded() == 0 {
        assert!(Instant::now() < deadline, "nothing is recorded");
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(file_names(folder.path()), ["out"]);
}

/// The readers that MCAP's makers publish find in the file what the run's own files hold.
#[test]
fn the_mcap_reader_finds_the_run() {
    let Some(python) = python("mcap, mcap_protobuf") else { return };
    let folder = tempfile::tempdir().unwrap();
    let lab: &[&str] = &["home", "lab", "--bearings", "noisy", "--seed", "4"];
    for (name, arguments, topics) in [("crowd", CROWD, 14), ("lab", lab, 12)] {
        let recording = format!("{name}.mcap");
        let output = run(folder.path(), &[arguments, &["--record", &recording, "--out", name]].concat());
        assert_exit(&output, 0, &[]);
        let check = project("tests/outside/check_recording.py");
        let checked = Command::new(&python).current_dir(folder.path()).arg(check).args([&recording, name]).output().unwrap();
        assert_exit(&checked, 0, &[]);
        let listed = String::from_utf8_lossy(&checked.stdout).lines().count();
        assert_eq!(listed, topics, "{}", String::from_utf8_lossy(&checked.stdout));
    }
}

/// `evo_ape` computes from the trajectories what the summary says.
#[test]
fn evo_reads_the_trajectories() {
    let Some(python) = python("evo") else { return };
    let folder = tempfile::tempdir().unwrap();
    assert_exit(&run(folder.path(), &["home", "lab", "--bearings", "noisy", "--seed", "4", "--out", "run"]), 0, &[]);
    let evo = Path::new(&python).with_file_name("evo_ape");
    let evo = if evo.exists() { evo } else { Path::new("evo_ape").to_owned() };
    let rows = |name: &str| -> Vec<Vec<f64>> {
        let text = fs::read_to_string(folder.path().join("run").join(name)).unwrap();
        text.lines().map(|line| line.split(' ').map(|n| n.parse().unwrap()).collect()).collect()
    };
    let truth = rows("trajectory.tum");
    for name in ["odometry.tum", "estimate.tum"] {
        let output = Command::new(&evo)
            .current_dir(folder.path().join("run"))
            .env("HOME", folder.path()) // evo keeps its settings there
            .args(["tum", "trajectory.tum", name])
            .output()
            .unwrap();
        assert_exit(&output, 0, &[]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let rmse: f64 = text.lines().find_map(|l| l.trim().strip_prefix("rmse")).unwrap().trim().parse().unwrap();
        let squares: Vec<f64> = rows(name)
            .iter()
            .map(|row| {
                let at = truth.iter().find(|t| t[0] == row[0]).unwrap();
                (at[1] - row[1]).powi(2) + (at[2] - row[2]).powi(2)
            })
            .collect();
        let own = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((rmse - own).abs() < 1e-5 && own > 0.0, "{name}: evo {rmse}, here {own}");
    }
}
