//! How a person names a homing method: one of the project's own, or a program.

use std::ffi::OsStr;
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;
use wayhome::method::MethodKind;
use wayhome::method::exec::ExecCommand;

use super::args::positive;

/// What `--help` says of the project's own methods.
fn help(kind: &MethodKind) -> &'static str {
    match kind {
        MethodKind::AnchoredEkf => "Filter that starts from nothing and anchors home when it can",
        MethodKind::PaperEkf => "The paper's filter on three landmarks, started at a supposed pose",
        MethodKind::Alv => "Average landmark vector; no estimate",
        MethodKind::TronDaniilidis => "Tron and Daniilidis' descent on bearings; no estimate",
        MethodKind::Weber => "Weber's bearing vectors; no estimate",
        MethodKind::Ibvs => "Visual servoing with one constant range; no estimate",
        MethodKind::Exec(_) => PROGRAM_HELP,
    }
}

const PROGRAM_HELP: &str =
    "A program of your own, such as exec:\"python3 my_method.py\"; the README says what it is told and answers";

/// Reads `--method`.
#[derive(Clone)]
pub struct MethodParser;

impl TypedValueParser for MethodParser {
    type Value = MethodKind;

    fn parse_ref(&self, command: &clap::Command, arg: Option<&clap::Arg>, value: &OsStr) -> Result<MethodKind, clap::Error> {
        let text = value.to_string_lossy();
        if !text.starts_with("exec:") {
            PossibleValuesParser::new(names()).parse_ref(command, arg, value)?;
        }
        text.parse().map_err(|fault| invalid(command, arg, &text, &fault))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(names().into_iter()))
    }
}

fn names() -> Vec<PossibleValue> {
    let own = MethodKind::BUILT_IN.into_iter().map(|kind| PossibleValue::new(kind.name()).help(help(&kind)));
    own.chain([PossibleValue::new("exec:COMMAND").help(PROGRAM_HELP)]).collect()
}

/// Reads `--method` where only programs are meant.
pub fn program(text: &str) -> Result<ExecCommand, String> {
    match text.parse() {
        Ok(MethodKind::Exec(command)) => Ok(command),
        Ok(_) => Err("only a program, exec:COMMAND: the project's own methods are chosen by --contenders".to_owned()),
        Err(fault) => Err(fault.to_string()),
    }
}

fn invalid(command: &clap::Command, arg: Option<&clap::Arg>, value: &str, fault: &wayhome::Error) -> clap::Error {
    let place = arg.map_or_else(String::new, |arg| format!(" for '{arg}'"));
    clap::Error::raw(ErrorKind::ValueValidation, format!("invalid value '{value}'{place}: {fault}\n")).with_cmd(command)
}

/// How long a program may take.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct PatienceArgs {
    /// How long a method that is a program may take for an answer, s; six times as long for its first one
    #[arg(long, value_name = "S", default_value = "5", allow_negative_numbers = true, value_parser = seconds)]
    pub method_timeout_s: Duration,
}

impl PatienceArgs {
    /// The method with this patience.
    pub fn method(self, kind: &MethodKind) -> MethodKind {
        match kind {
            MethodKind::Exec(command) => MethodKind::Exec(command.clone().with_time_limit(self.method_timeout_s)),
            other => other.clone(),
        }
    }
}

/// A time that a clock can wait for.
fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = positive(text)?;
    if seconds > 86_400.0 {
        return Err("must not be more than a day, 86400 s".to_owned());
    }
    Ok(Duration::from_secs_f64(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_are_read_by_name() {
        let command = clap::Command::new("test");
        let read = |text: &str| MethodParser.parse_ref(&command, None, OsStr::new(text));
        assert_eq!(read("alv").unwrap(), MethodKind::Alv);
        assert_eq!(read("exec:python3 'a b.py'").unwrap().to_string(), "exec:python3 'a b.py'");
        for bad in ["", "alvv", "exec:", "exec: 'open", "exec"] {
            assert!(read(bad).is_err(), "{bad}");
        }
        assert!(program("alv").is_err() && program("exec:a").is_ok());
        assert!(seconds("0").is_err() && seconds("1e30").is_err() && seconds("0.5").is_ok());
    }
}
