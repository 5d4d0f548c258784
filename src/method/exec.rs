//! A program of the user's own as a homing method: observations go to its stdin, commands come from its stdout, one JSON object
//! a line.
//!
//! The program is told what any [`Method`] is told and nothing more: the briefing in a first line, then one observation a control
//! step. Whatever it does wrong ends its episode with [`Status::Failed`] and a reason: it cannot be started, ends, takes too
//! long, or answers what is no answer. One program runs for each episode, and it is ended with the episode.

mod child;
mod command;
mod protocol;

use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use tempfile::TempDir;

use crate::geometry::Twist;
use crate::observation::{Briefing, CameraSheet, Decision, Method, Observation, Status};
use crate::panorama::Picture;
use child::{Child, Silence};
use protocol::{Answer, Hello, Line, PROTOCOL, PanoramaForm, SentPicture, Wishes};

pub(super) use command::PREFIX;

pub use child::end_all;
pub use command::ExecCommand;

/// The first answer may take this many times as long as the others: programs load what they need first.
const START_FACTOR: u32 = 6;
/// Longest part of a wrong answer that a reason quotes, bytes.
const QUOTED: usize = 200;

/// A program as a method.
pub(super) struct ExecHoming {
    command: ExecCommand,
    limit: Duration,
    /// The program, once it has been started and as long as it does what it should.
    child: Option<Child>,
    /// What was seen at home, until it has been sent.
    camera: Option<CameraSheet>,
    panorama: Option<PanoramaForm>,
    /// Folder for panoramas on the way to the program.
    folder: Option<TempDir>,
    failure: Option<String>,
}

impl ExecHoming {
    /// Starts the program and tells it the briefing. What goes wrong shows in the first step.
    pub(super) fn new(command: ExecCommand, briefing: Briefing) -> Self {
        let limit = command.time_limit();
        let mut homing = Self { command, limit, child: None, camera: None, panorama: None, folder: None, failure: None };
        let greeted = homing.greet(&briefing);
        homing.camera = briefing.camera;
        homing.note(greeted);
        homing
    }

    fn greet(&mut self, briefing: &Briefing) -> Result<(), String> {
        self.child = Some(Child::start(&self.command).map_err(|e| format!("cannot be started: {e}"))?);
        let wishes: Wishes = self.ask(&Hello::new(briefing), START_FACTOR * self.limit)?;
        if let Some(other) = wishes.protocol.filter(|p| *p != PROTOCOL) {
            return Err(format!("speaks protocol {other}, allowed is {PROTOCOL}"));
        }
        if wishes.panorama.is_some() && briefing.camera.is_none() {
            return Err("asks for panoramas, and there is no camera: they come with rendered bearings only".to_owned());
        }
        self.panorama = wishes.panorama;
        if self.panorama == Some(PanoramaForm::Png) {
            let folder = tempfile::Builder::new().prefix("wayhome-").tempdir();
            self.folder = Some(folder.map_err(|e| format!("cannot be handed panoramas: no temporary folder, {e}"))?);
        }
        Ok(())
    }

    /// Sends a line and reads the next one.
    fn ask<T: serde::de::DeserializeOwned>(&mut self, line: &impl serde::Serialize, limit: Duration) -> Result<T, String> {
        let mut bytes = serde_json::to_vec(line).map_err(|e| format!("cannot be asked: {e}"))?;
        bytes.push(b'\n');
        let Some(child) = &mut self.child else { return Err("is not running".to_owned()) };
        let answer = child.ask(bytes, limit).map_err(|silence| match silence {
            Silence::Ended => match child.last_words().0 {
                Some(status) => format!("ended ({status})"),
                None => "ended".to_owned(),
            },
            Silence::TooLong => format!("did not answer within {} s (a line has to be flushed)", limit.as_secs_f64()),
            Silence::Endless => "answered with a line that does not end".to_owned(),
            Silence::Unasked => "wrote a line that it was not asked for".to_owned(),
        })?;
        serde_json::from_slice(&answer).map_err(|fault| {
            let start = String::from_utf8_lossy(&answer[..answer.len().min(QUOTED)]);
            format!("answered `{}`: {fault}", start.trim_end())
        })
    }

    fn decide(&mut self, observation: &Observation<'_>) -> Result<Decision, String> {
        let panorama = self.sent(observation.panorama, "panorama.png")?;
        let home = self.camera.take();
        let home = self.sent(home.as_ref().map(CameraSheet::home_picture), "home.png")?;
        let answer: Answer = self.ask(&Line::new(observation, panorama, home), self.limit)?;
        answer.decision(observation.bearings.len()).map_err(|fault| format!("answered nonsense: {fault}"))
    }

    /// A picture in the form that the program wants, if it wants any.
    fn sent(&self, picture: Option<Picture<'_>>, name: &str) -> Result<Option<SentPicture>, String> {
        let Some((picture, form)) = picture.zip(self.panorama) else { return Ok(None) };
        let Some(folder) = self.folder.as_ref().filter(|_| form == PanoramaForm::Png) else {
            return Ok(Some(SentPicture::raw(&picture)));
        };
        let path: PathBuf = folder.path().join(name);
        let fault = |e: &dyn std::fmt::Display| format!("cannot be handed {}: {e}", path.display());
        fs::write(&path, picture.png().map_err(|e| fault(&e))?).map_err(|e| fault(&e))?;
        Ok(Some(SentPicture::Png { png: path.display().to_string() }))
    }

    /// Keeps a failure, with what the program wrote to stderr last, and ends the program.
    fn note<T>(&mut self, result: Result<T, String>) -> Option<T> {
        let fault = match result {
            Ok(value) => return Some(value),
            Err(fault) => fault,
        };
        let mut reason = format!("`{}` {fault}", self.command);
        if let Some(mut child) = self.child.take() {
            child.end();
            let (_, stderr) = child.last_words();
            if !stderr.is_empty() {
                reason += "; stderr ends with:\n";
                reason += &stderr;
            }
        }
        self.failure = Some(reason);
        None
    }
}

impl Method for ExecHoming {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let failed = Decision { status: Status::Failed, ..Decision::command(Twist::default()) };
        if self.failure.is_some() {
            return failed;
        }
        let decision = self.decide(observation);
        self.note(decision).unwrap_or(failed)
    }

    fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use std::time::Instant;

    use super::*;
    use crate::observation::{HomeSnapshot, Odometry, RobotSheet, TaskSheet};

    fn briefing() -> Briefing {
        Briefing {
            home: HomeSnapshot::default(),
            robot: RobotSheet {
                track_m: 0.2,
                camera_offset_m: [0.0; 2],
                max_speed_m_s: 0.4,
                max_turn_rate_rad_s: 2.0,
                max_acceleration_m_s2: 0.9,
            },
            task: TaskSheet { speed_m_s: 0.3, control_period_s: 0.1, arrival_radius_m: 0.05 },
            compass: false,
            camera: None,
        }
    }

    /// Steps a shell script until it fails or has been asked three times.
    fn run(script: &str, limit_ms: u64) -> (Vec<Decision>, Option<String>) {
        let command = ExecCommand::parse(&format!("sh -c {}", shlex::try_quote(script).unwrap())).unwrap();
        let command = command.with_time_limit(Duration::from_millis(limit_ms));
        let mut method = ExecHoming::new(command, briefing());
        let observation = Observation {
            time_s: 0.0,
            odometry: Odometry::default(),
            bearings: &[],
            alternatives: &[],
            compass_rad: None,
            bumper: crate::observation::Bumper::default(),
            panorama: None,
        };
        let step = |_| {
            let decision = method.step(&observation);
            std::thread::sleep(Duration::from_millis(30)); // what was not asked for has come by then
            decision
        };
        let decisions = (0..3).map(step).collect();
        (decisions, method.failure().map(str::to_owned))
    }

    const MOVE: &str = r#"echo '{"v_m_s":0.1,"omega_rad_s":0}'"#;

    #[test]
    fn a_program_is_asked_and_answers() {
        let (decisions, failure) = run(&format!("read hello; echo '{{}}'; while read line; do {MOVE}; done"), 2000);
        assert_eq!(failure, None);
        assert!(decisions.iter().all(|d| d.status == Status::Running && d.command.v == 0.1));
    }

    #[test]
    fn whatever_a_program_does_wrong_is_told() {
        let greet = "read hello; echo '{}'; read line; ";
        let flood = "read hello; echo '{}'; read line; head -c 3000000 /dev/zero; sleep 9";
        for (script, words) in [
            ("read hello; echo oh dear >&2; exit 3".to_owned(), "ended (exit status: 3); stderr ends with:\noh dear"),
            (format!("{greet} kill -9 $$"), "signal: 9"),
            (format!("{greet} sleep 30"), "did not answer within 0.2 s"),
            (format!("{greet} exec >&-; sleep 30"), "ended"),
            (format!("{greet} echo left; sleep 30"), "answered `left`: expected value"),
            (format!("{greet} {MOVE}; {MOVE}; sleep 30"), "not asked for"),
            (flood.to_owned(), "does not end"),
            ("read hello; echo '{\"protocol\":9}'; sleep 30".to_owned(), "speaks protocol 9"),
            ("read hello; echo '{\"panorama\":\"png\"}'; sleep 30".to_owned(), "no camera"),
            ("read hello; echo '{\"panorama\":\"jpeg\"}'; sleep 30".to_owned(), "unknown variant `jpeg`"),
        ] {
            let began = Instant::now();
            let (decisions, failure) = run(&script, 200);
            let failure = failure.unwrap_or_else(|| panic!("{script}: no failure"));
            assert!(failure.contains(words), "{script}: {failure}");
            assert_eq!(decisions[2].status, Status::Failed, "{script}");
            assert!(began.elapsed() < Duration::from_secs(5), "{script} took {:?}", began.elapsed());
        }
    }

    #[test]
    fn what_a_program_has_started_ends_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("id");
        // A grandchild that holds stdout and stderr open.
        let script =
            format!("sleep 60 & echo $! > {}; read hello; echo '{{}}'; while read line; do {MOVE}; done", file.display());
        let (_, failure) = run(&script, 5000);
        assert_eq!(failure, None);
        let id: i32 = fs::read_to_string(file).unwrap().trim().parse().unwrap();
        let pid = rustix::process::Pid::from_raw(id).unwrap();
        let deadline = Instant::now() + Duration::from_secs(5);
        // What is left is at most a zombie that nobody waits for.
        let is_over = || {
            let state = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
            rustix::process::test_kill_process(pid).is_err() || state.contains(") Z ")
        };
        while !is_over() {
            assert!(Instant::now() < deadline, "the grandchild lives on");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}
