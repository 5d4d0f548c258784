//! The `wayhome` command. This is the one place that turns an outcome into an exit code.

mod cli;

use std::io::Write;
use std::process::ExitCode;

use wayhome::{Error, ErrorKind};

fn main() -> ExitCode {
    match cli::run() {
        Ok(cli::Verdict::Done) => ExitCode::SUCCESS,
        Ok(cli::Verdict::NotHome) => ExitCode::from(3),
        Err(error) => {
            // Nobody is left to tell when stderr is gone.
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            match error.downcast_ref().map(Error::kind) {
                Some(ErrorKind::Usage) => ExitCode::from(2),
                Some(ErrorKind::Interrupted) => ExitCode::from(cli::INTERRUPTED),
                Some(ErrorKind::Input | ErrorKind::Environment) | None => ExitCode::FAILURE,
            }
        }
    }
}
