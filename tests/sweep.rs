//! Stress studies at the process boundary: resumed, sharded, merged, replayed.

#![allow(clippy::unwrap_used, reason = "helpers of tests are not recognised as tests")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

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
    refused(&wayhome(at, &["home", "--replay", "nowhere:1"]).output().unwrap(), 2, &["study.json"]);
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
    refused(&wayhome(at, &["sweep", "merge", "mine", "theirs", "--out", "both"]).output().unwrap(), 2, &["theirs", "other"]);
    let reseeded = wayhome(at, &["sweep", "quick.toml", "--out", "mine", "--seeds", "1..2"]).output().unwrap();
    refused(&reseeded, 1, &["another edition"]);
    fs::create_dir(at.join("precious")).unwrap();
    fs::write(at.join("precious/thesis.tex"), "mine").unwrap();
    refused(&wayhome(at, &["sweep", "quick.toml", "--out", "precious"]).output().unwrap(), 1, &["thesis.tex"]);
    assert_eq!(fs::read_dir(at.join("precious")).unwrap().count(), 1, "nothing is left behind");
}
