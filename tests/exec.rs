//! Programs as homing methods, at the process boundary.

#![allow(clippy::unwrap_used, reason = "helpers of tests are not recognised as tests")]

#[allow(dead_code, reason = "other tests use the rest")]
mod support;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::Value;
use support::{assert_exit, project, python, run, wayhome};

const EXAMPLE: &str = "tests/outside/alv_method.py";

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// `--method` for a Python program in `folder`.
fn program(python: &str, folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    format!("exec:'{python}' '{}'", path.display())
}

#[test]
fn the_readme_shows_the_example() {
    let readme = fs::read_to_string(project("README.md")).unwrap();
    let example = fs::read_to_string(project(EXAMPLE)).unwrap();
    assert!(readme.contains(&format!("```python\n{example}```")), "README.md and {EXAMPLE} differ");
    assert!(example.lines().count() <= 20);
}

#[test]
fn the_example_comes_home_alone_in_a_batch_and_in_company() {
    let Some(python) = python("") else { return };
    let folder = tempfile::tempdir().unwrap();
    let method = format!("exec:'{python}' '{}'", project(EXAMPLE).display());
    let home =
        |more: &[&str]| run(folder.path(), &[&["home", "lab", "--bearings", "noisy", "--method", &method], more].concat());

    assert_exit(&home(&["--seed", "1", "--out", "one"]), 0, &[]);
    let summary = json(&folder.path().join("one/summary.json"));
    assert_eq!((&summary["outcome"], &summary["setup"]["method"]), (&"home".into(), &method.as_str().into()));
    assert_exit(&home(&["--seed", "1", "--out", "again"]), 0, &[]);
    let path = |out: &str| fs::read(folder.path().join(out).join("trajectory.csv")).unwrap();
    assert!(path("one") == path("again"), "the same seed, the same bytes");

    // A process for each run, side by side; the built-in average landmark vector does about as well.
    assert_exit(&home(&["--seeds", "1..12", "--threads", "3", "--out", "batch"]), 0, &[]);
    let batch = json(&folder.path().join("batch/summary.json"));
    assert!(batch["home"].as_u64().unwrap() >= 8, "{batch}");
    assert!(batch["outcomes"].get("failed").is_none() && !folder.path().join("batch/failures.csv").exists());

    let compare = ["compare", "lab", "--seeds", "1..4", "--places", "6", "--contenders", "alv", "--method", &method];
    assert_exit(&run(folder.path(), &[&compare[..], &["--out", "compare"]].concat()), 0, &[]);
    let table = fs::read_to_string(folder.path().join("compare/compare.csv")).unwrap();
    let rows: Vec<&str> = table.lines().skip(1).map(|row| row.split(',').next().unwrap()).collect();
    assert_eq!(rows, ["alv", "exec-1"]);
    assert!(folder.path().join("compare/map-exec-1.svg").exists());
    let page = fs::read_to_string(folder.path().join("compare/README.md")).unwrap();
    assert!(page.contains(&format!("`exec-1` is the program `{}`", method.strip_prefix("exec:").unwrap())));
}

#[test]
fn a_program_that_breaks_is_a_recorded_failure() {
    let Some(python) = python("") else { return };
    let folder = tempfile::tempdir().unwrap();
    let home = |method: &str, more: &[&str]| {
        run(folder.path(), &[&["home", "lab", "--bearings", "ideal", "--method", method], more].concat())
    };
    let dies = "import sys\nsys.stdin.readline(); print('{}', flush=True)\nfor k in range(3):\n    sys.stdin.readline()\n    \
                print('{\"v_m_s\": 0.1, \"omega_rad_s\": 0}', flush=True)\nraise ValueError('no way')\n";
    let dies = program(&python, folder.path(), "dies.py", dies);
    assert_exit(&home(&dies, &["--out", "dies"]), 3, &[]);
    let summary = json(&folder.path().join("dies/summary.json"));
    let failure = summary["failure"].as_str().unwrap();
    assert_eq!((&summary["outcome"], &summary["claimed_home"]), (&"failed".into(), &false.into()));
    assert!(failure.contains("ended (exit status: 1)") && failure.ends_with("ValueError: no way"), "{failure}");
    assert_eq!(summary["steps"], 4);

    let hangs = program(&python, folder.path(), "hangs.py", "import time\nprint('{}', flush=True)\ntime.sleep(99)\n");
    let began = Instant::now();
    assert_exit(&home(&hangs, &["--seeds", "1..3", "--method-timeout-s", "0.3", "--out", "hangs"]), 0, &[]);
    assert!(began.elapsed() < Duration::from_secs(20));
    let batch = json(&folder.path().join("hangs/summary.json"));
    assert_eq!((&batch["outcomes"]["failed"], &batch["home"]), (&3.into(), &0.into()));
    let reasons = fs::read_to_string(folder.path().join("hangs/failures.csv")).unwrap();
    assert!(
        reasons.starts_with("seed,failure\n1,") && reasons.matches("did not answer within 0.3 s").count() == 3,
        "{reasons}"
    );
}

#[test]
fn programs_that_cannot_be_run_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    for (method, words) in [
        ("exec:", ["no program", "--method"]),
        ("exec:'python3", ["not closed", "--method"]),
        ("exec:no-such-program-anywhere x", ["no-such-program-anywhere", "PATH"]),
        ("exec:./missing.sh", ["./missing.sh", "PATH"]),
        ("exec", ["exec:COMMAND", "--method"]),
    ] {
        for verb in [&["home", "lab"][..], &["home", "lab", "--seeds", "1..2"], &["compare", "lab"], &["robustness", "lab"]] {
            let words = if verb[0] == "compare" && method == "exec" { &words[1..] } else { &words[..] };
            assert_exit(&run(folder.path(), &[verb, &["--method", method]].concat()), 2, words);
        }
    }
    assert_exit(&run(folder.path(), &["home", "lab", "--method-timeout-s", "0"]), 2, &["--method-timeout-s"]);
    assert!(!folder.path().join("results").exists(), "a failure leaves no folder behind");
}

/// What the program was told, from a run in which it kept everything. It is asked for twice: panoramas as files, and as bytes.
#[test]
fn a_program_is_told_what_a_robot_knows_and_nothing_more() {
    let Some(python) = python("") else { return };
    let folder = tempfile::tempdir().unwrap();
    for form in ["png", "raw"] {
        let keeps = format!(
            "import json, shutil, sys\nkept = open('{form}.jsonl', 'w')\nkept.write(sys.stdin.readline())\n\
             print(json.dumps({{'panorama': '{form}'}}), flush=True)\nfor k, line in enumerate(sys.stdin):\n    kept.write(line)\n    \
             now = json.loads(line)\n    for name in ('panorama', 'home_panorama'):\n        \
             if 'png' in now.get(name, {{}}): shutil.copy(now[name]['png'], f'{{name}}-{{k}}.png')\n    \
             print(json.dumps({{'v_m_s': 0.1, 'omega_rad_s': 0.5, 'lost': k == 2}}), flush=True)\n"
        );
        let method = program(&python, folder.path(), &format!("{form}.py"), &keeps);
        let arguments =
            ["home", "lab", "--size", "96x16", "--renderer", "cpu", "--compass-deg", "1", "--method", &method, "--out", form];
        assert_exit(&run(folder.path(), &arguments), 3, &[]);
        let text = fs::read_to_string(folder.path().join(format!("{form}.jsonl"))).unwrap();
        let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!(lines.len(), 4, "a hello and three observations");
        let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>().join(" ");
        assert_eq!(keys(&lines[0]), "camera compass home protocol robot task type version");
        assert_eq!(keys(&lines[1]), "bearings bumper compass_rad home_panorama odometry panorama time_s type");
        assert_eq!(keys(&lines[2]), "bearings bumper compass_rad odometry panorama time_s type");
        assert_eq!(lines[0]["camera"]["width_px"], 96);
        assert!(lines[0]["compass"] == true && lines[3]["compass_rad"].is_f64() && lines[3]["time_s"] == 0.2);

        // The pictures are those that the run has kept of its own.
        let rgb = |path: &str| image::open(folder.path().join(path)).unwrap().to_rgb8().into_raw();
        let sent = |line: &Value, name: &str, k: usize| -> Vec<u8> {
            match form {
                "png" => rgb(&format!("{name}-{k}.png")),
                _ => {
                    use base64::Engine;
                    let text = line[name]["rgb_base64"].as_str().unwrap();
                    base64::engine::general_purpose::STANDARD.decode(text).unwrap()
                }
            }
        };
        assert!(sent(&lines[1], "home_panorama", 0) == rgb(&format!("{form}/home.png")));
        assert!(sent(&lines[1], "panorama", 0) == rgb(&format!("{form}/panorama_start.png")));
        assert!(sent(&lines[3], "panorama", 2) == rgb(&format!("{form}/panorama_end.png")));
        if form == "png" {
            let left = lines[1]["panorama"]["png"].as_str().unwrap();
            assert!(!Path::new(left).exists(), "the folder for panoramas is gone");
        }
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_program_that_hangs() {
    let folder = tempfile::tempdir().unwrap();
    let hangs = "exec:sh -c 'echo $$ > id; read hello; echo {}; read line; sleep 99'";
    let arguments = ["home", "lab", "--bearings", "ideal", "--method", hangs, "--method-timeout-s", "60", "--out", "run"];
    let mut child = wayhome(folder.path(), &arguments).stderr(std::process::Stdio::null()).spawn().unwrap();
    let deadline = Instant::now() + Duration::from_secs(20);
    let id = loop {
        let text = fs::read_to_string(folder.path().join("id")).unwrap_or_default();
        if let Ok(id) = text.trim().parse::<i32>() {
            break id;
        }
        assert!(Instant::now() < deadline, "the program does not start");
        std::thread::sleep(Duration::from_millis(10));
    };
    std::thread::sleep(Duration::from_millis(200));
    let stop = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(stop.success());
    let began = Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(began.elapsed() < Duration::from_secs(5), "{:?}", began.elapsed());
    let alive = std::process::Command::new("kill").args(["-0", &id.to_string()]).output().unwrap();
    assert!(!alive.status.success(), "the program lives on");
    assert!(!folder.path().join("run/summary.json").exists());
}
