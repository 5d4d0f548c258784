//! What tests at the process boundary share: running the command, and Python where it is there.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A file of the project.
pub fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// `wayhome` with the given arguments, in `folder`.
pub fn wayhome(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wayhome"));
    command.current_dir(folder).args(arguments).env_remove("RUST_LOG");
    command
}

pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    wayhome(folder, arguments).output().unwrap()
}

/// Checks the exit code and that stderr says all of `words`.
#[track_caller]
pub fn assert_exit(output: &Output, code: i32, words: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}

/// A Python 3 that can import all of `modules`: the one of the project's environment in `target/python-venv`, else that along PATH.
/// Where there is none the test that asks stands aside and says so; with `WAYHOME_REQUIRE_PYTHON=1` that is a failure.
pub fn python(modules: &str) -> Option<String> {
    let imports = if modules.is_empty() { "pass".to_owned() } else { format!("import {modules}") };
    let own = project("target/python-venv/bin/python").display().to_string();
    let serves = |program: &String| {
        let probe = Command::new(program).args(["-c", &imports]).output();
        probe.is_ok_and(|output| output.status.success())
    };
    let found = [own, "python3".to_owned()].into_iter().find(serves);
    if found.is_none() {
        let wanted = if modules.is_empty() { "Python 3".to_owned() } else { format!("Python 3 with {modules}") };
        assert!(std::env::var_os("WAYHOME_REQUIRE_PYTHON").is_none_or(|v| v != "1"), "{wanted} is required and not there");
        eprintln!("DID NOT RUN: this test needs {wanted}; `tests/outside/requirements.txt` lists the packages");
    }
    found
}

/// All files of a folder by path.
pub fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(path) = open.pop() {
        for entry in std::fs::read_dir(path).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// Holds two folders to the same files, byte by byte.
#[track_caller]
pub fn assert_same_files(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (path, bytes) in &a {
        assert!(*bytes == b[path], "{} differs", path.display());
    }
}
