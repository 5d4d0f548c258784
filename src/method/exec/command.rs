//! The command line of a program under test.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crate::error::{Error, Result};

/// What stands before the command where a method is named.
pub(in crate::method) const PREFIX: &str = "exec:";

/// How long a program may take for an answer if nothing else is said.
const TIME_LIMIT: Duration = Duration::from_secs(5);

/// A program and its arguments, and how long it may take for an answer.
///
/// The text is split into words as a shell splits them (blanks, quotes, backslashes), and no shell takes part: nothing is
/// expanded, and the program that is started is the one that is ended. Who wants a shell names it: `sh -c '...'`.
#[derive(Clone, PartialEq, Eq)]
#[must_use]
pub struct ExecCommand {
    text: Arc<str>,
    words: Arc<[String]>,
    time_limit: Duration,
}

impl ExecCommand {
    /// Reads a command.
    ///
    /// # Errors
    /// When it is empty or a quote is left open.
    pub fn parse(text: &str) -> Result<Self> {
        let fault = |found: &str| Error::Invalid {
            what: "command of a method".into(),
            found: found.into(),
            allowed: format!("{PREFIX}PROGRAM with its arguments, such as {PREFIX}\"python3 my_method.py\""),
        };
        if text.contains('\0') {
            return Err(fault("a NUL character"));
        }
        let words = shlex::split(text).ok_or_else(|| fault(&format!("`{text}`, a quote that is not closed")))?;
        if words.first().is_none_or(String::is_empty) {
            return Err(fault("no program"));
        }
        Ok(Self { text: text.trim().into(), words: words.into(), time_limit: TIME_LIMIT })
    }

    /// The same with another time limit for an answer.
    pub fn with_time_limit(self, time_limit: Duration) -> Self {
        Self { time_limit, ..self }
    }

    /// How long it may take for an answer; for its first one six times as long.
    pub fn time_limit(&self) -> Duration {
        self.time_limit
    }

    /// The program as written.
    pub fn program(&self) -> &str {
        self.words.first().map_or("", String::as_str)
    }

    /// Its arguments.
    pub fn arguments(&self) -> &[String] {
        self.words.get(1..).unwrap_or_default()
    }

    /// Checks that there is such a program, so that a slip of the pen is told before anything runs.
    ///
    /// # Errors
    /// When it is neither a file that can be run nor found along PATH.
    pub fn check(&self) -> Result<()> {
        let program = Path::new(self.program());
        let found = if program.components().count() > 1 {
            is_program(program)
        } else {
            let path = std::env::var_os("PATH").unwrap_or_default();
            std::env::split_paths(&path).any(|folder| is_program(&folder.join(program)))
        };
        if found {
            return Ok(());
        }
        Err(Error::Invalid {
            what: format!("program of the method `{self}`"),
            found: format!("`{}`, which cannot be run from here", self.program()),
            allowed: "a program along PATH, or the path of one".into(),
        })
    }
}

/// Whether a file is there that the system would run.
fn is_program(path: &Path) -> bool {
    let candidates = |path: &Path| -> Vec<PathBuf> {
        let mut all = vec![path.to_owned()];
        if cfg!(windows) {
            all.extend(["exe", "bat", "cmd"].map(|ending| path.with_extension(ending)));
        }
        all
    };
    candidates(path).iter().filter_map(|file| file.metadata().ok()).any(|found| found.is_file() && may_run(&found))
}

#[cfg(unix)]
fn may_run(file: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::PermissionsExt;
    file.permissions().mode() & 0o111 != 0
}

#[cfg(not(unix))]
fn may_run(_file: &std::fs::Metadata) -> bool {
    true
}

impl fmt::Display for ExecCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl fmt::Debug for ExecCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.words.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_split_and_looked_for() {
        let command = ExecCommand::parse(" python3 'my method.py' --gain 0.5 ").unwrap();
        assert_eq!(command.program(), "python3");
        assert_eq!(command.arguments(), ["my method.py", "--gain", "0.5"]);
        assert_eq!(command.to_string(), "python3 'my method.py' --gain 0.5");
        for bad in ["", "  ", "''", "python3 'open", "a\0b"] {
            let message = ExecCommand::parse(bad).unwrap_err().to_string();
            assert!(message.contains("exec:PROGRAM"), "{bad:?}: {message}");
        }
        let own = std::env::current_exe().unwrap();
        let quoted = shlex::try_quote(own.to_str().unwrap()).unwrap();
        assert!(ExecCommand::parse(&quoted).unwrap().check().is_ok());
        for missing in ["no-such-program-here", "./no/such/program", concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")] {
            let message = ExecCommand::parse(missing).unwrap().check().unwrap_err().to_string();
            assert!(message.contains(missing), "{message}");
        }
    }
}
