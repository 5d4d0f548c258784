//! Finds the commit that the program is built from, for `wayhome::VERSION`.
//!
//! The commit is asked of git where the package is the top of a checkout, and read from the note that `cargo package` leaves in
//! a published package. Without either the version stands alone. The script runs again when the commit or the sources change.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

/// What goes into the program. A change elsewhere (documentation, results) leaves the program as the commit has it.
const SOURCES: [&str; 5] = ["Cargo.toml", "Cargo.lock", "src", "shaders", "worlds"];

/// The note of `cargo package`.
const NOTE: &str = ".cargo_vcs_info.json";

fn main() {
    // Cargo runs a build script in the folder of its package.
    let version = env::var("CARGO_PKG_VERSION").unwrap_or_default();
    let version = match if Path::new(".git").exists() { of_checkout() } else { of_package() } {
        Some(commit) => format!("{version} ({commit})"),
        None => version,
    };
    println!("cargo::rustc-env=WAYHOME_VERSION={version}");
    // A path that does not exist would make cargo run the script each time.
    for path in SOURCES.into_iter().chain([NOTE]).filter(|path| Path::new(path).exists()) {
        println!("cargo::rerun-if-changed={path}");
    }
}

/// The commit that git has checked out, marked where the sources differ from it.
fn of_checkout() -> Option<String> {
    let commit = git(&["rev-parse", "--short=7", "HEAD"])?;
    // The log grows with each commit; the others stand in for it where a repository keeps no logs. In a linked work tree
    // they lie in different folders, which git knows.
    let branch = git(&["symbolic-ref", "--quiet", "HEAD"]);
    for name in ["HEAD", "logs/HEAD", "packed-refs"].into_iter().chain(branch.as_deref()) {
        if let Some(path) = git(&["rev-parse", "--git-path", name]).filter(|path| Path::new(path).exists()) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    let changed = git(&[&["status", "--porcelain", "--"], &SOURCES[..]].concat())?;
    Some(if changed.is_empty() { commit } else { format!("{commit}+changes") })
}

/// The commit in the note of a published package, marked where the package was made of changed sources.
fn of_package() -> Option<String> {
    let note = fs::read_to_string(NOTE).ok()?;
    let commit = note.split_once("\"sha1\": \"")?.1.get(..7)?;
    Some(if note.contains("\"dirty\": true") { format!("{commit}+changes") } else { commit.to_owned() })
}

/// What git prints; `None` where there is no git or it fails.
fn git(arguments: &[&str]) -> Option<String> {
    // Without locks, so that a build does not disturb what a user does in the checkout.
    let output = Command::new("git").arg("--no-optional-locks").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
