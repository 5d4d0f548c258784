//! The lines that go to a program and come back: one JSON object a line.
//!
//! The README describes them for those who write such programs; field names carry their units. What a robot knows goes out as
//! [`observation`](crate::observation) has it.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Serialize};

use crate::geometry::{Matrix3, Pose, Twist};
use crate::observation::{
    Bearing, Briefing, BumperSector, Decision, Estimate, HomeSnapshot, Observation, RobotSheet, Status, TaskSheet,
};
use crate::panorama::Picture;

/// Version of what is said here. It grows when a program written for an older one would fail.
pub(super) const PROTOCOL: u32 = 1;

/// First line to the program: what a robot knows before it drives.
#[derive(Serialize)]
pub(super) struct Hello<'a> {
    #[serde(rename = "type")]
    kind: &'static str,
    protocol: u32,
    version: &'static str,
    robot: &'a RobotSheet,
    task: &'a TaskSheet,
    /// Whether observations tell a heading.
    compass: bool,
    /// `null` for a robot that gets bearings without panoramas.
    camera: Option<Camera>,
    home: &'a HomeSnapshot,
}

#[derive(Serialize)]
struct Camera {
    width_px: u32,
    height_px: u32,
    horizon_row: f64,
    mount_rad: f64,
    projection: crate::panorama::ProjectionKind,
}

impl<'a> Hello<'a> {
    pub(super) fn new(briefing: &'a Briefing) -> Self {
        Self {
            kind: "hello",
            protocol: PROTOCOL,
            version: crate::VERSION,
            robot: &briefing.robot,
            task: &briefing.task,
            compass: briefing.compass,
            camera: briefing.camera.as_ref().map(|camera| Camera {
                width_px: camera.projection.width,
                height_px: camera.projection.height,
                horizon_row: camera.projection.horizon_row,
                mount_rad: camera.projection.mount_rad,
                projection: camera.projection.kind,
            }),
            home: &briefing.home,
        }
    }
}

/// The program's answer to the hello: what it wants to be sent.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wishes {
    /// The protocol that it speaks, where it says so.
    pub protocol: Option<u32>,
    /// How panoramas shall come; absent or `null` for none.
    pub panorama: Option<PanoramaForm>,
}

/// How a panorama is handed over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum PanoramaForm {
    /// As the path of a PNG file, which is there until the program answers.
    Png,
    /// As its bytes in base64: red, green, blue, row by row from the top.
    Raw,
}

/// A line to the program at every control step.
#[derive(Serialize)]
pub(super) struct Line<'a> {
    #[serde(rename = "type")]
    kind: &'static str,
    time_s: f64,
    odometry: Motion,
    bearings: &'a [Bearing],
    compass_rad: Option<f64>,
    /// Sectors of the bumper that were pressed since the last observation.
    bumper: Vec<BumperSector>,
    #[serde(skip_serializing_if = "Option::is_none")]
    panorama: Option<SentPicture>,
    /// With the first observation.
    #[serde(skip_serializing_if = "Option::is_none")]
    home_panorama: Option<SentPicture>,
}

#[derive(Serialize)]
struct Motion {
    v_m_s: f64,
    omega_rad_s: f64,
    dt_s: f64,
}

/// A panorama on its way to the program.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum SentPicture {
    Png { png: String },
    Raw { width_px: u32, height_px: u32, rgb_base64: String },
}

impl SentPicture {
    pub(super) fn raw(picture: &Picture<'_>) -> Self {
        let (width_px, height_px) = (picture.projection.width, picture.projection.height);
        Self::Raw { width_px, height_px, rgb_base64: STANDARD.encode(picture.rgb()) }
    }
}

impl<'a> Line<'a> {
    pub(super) fn new(
        observation: &Observation<'a>,
        panorama: Option<SentPicture>,
        home_panorama: Option<SentPicture>,
    ) -> Self {
        let odometry = &observation.odometry;
        Self {
            kind: "observation",
            time_s: observation.time_s,
            odometry: Motion { v_m_s: odometry.twist.v, omega_rad_s: odometry.twist.omega, dt_s: odometry.dt_s },
            bearings: observation.bearings,
            compass_rad: observation.compass_rad,
            bumper: observation.bumper.sectors().collect(),
            panorama,
            home_panorama,
        }
    }
}

/// The program's answer to an observation.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Answer {
    v_m_s: f64,
    omega_rad_s: f64,
    /// Whether it claims to be home; the robot is then stopped.
    #[serde(default)]
    done: bool,
    /// Whether it gives up.
    #[serde(default)]
    lost: bool,
    #[serde(default)]
    estimate: Option<Belief>,
    /// Bearings that it used; all of them where it does not say.
    matched: Option<usize>,
    /// Bearings that it refused as wrong.
    #[serde(default)]
    rejected: usize,
}

/// Pose in the home frame, with the covariance of (x, y, heading) row by row.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Belief {
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
    covariance: [[f64; 3]; 3],
}

impl Answer {
    /// What it comes to, with `seen` bearings at hand.
    ///
    /// # Errors
    /// A sentence on what is wrong with it.
    pub(super) fn decision(self, seen: usize) -> Result<Decision, String> {
        if self.done && self.lost {
            return Err("claims to be done and lost at once".to_owned());
        }
        let covariance = self.estimate.as_ref().map(|b| b.covariance);
        if let Some(c) = covariance.filter(|c| (0..3).any(|k| c[k][k] < 0.0)) {
            return Err(format!("estimates a covariance with a negative variance: {c:?}"));
        }
        let status = match (self.done, self.lost) {
            (true, _) => Status::Arrived,
            (_, true) => Status::Lost,
            _ => Status::Running,
        };
        let estimate = self.estimate.map(|b| Estimate {
            pose: Pose::new(b.x_m, b.y_m, b.heading_rad),
            covariance: Matrix3::from_fn(|row, column| b.covariance[row][column]),
        });
        let command = if self.done { Twist::default() } else { Twist { v: self.v_m_s, omega: self.omega_rad_s } };
        let matched = self.matched.unwrap_or(seen);
        Ok(Decision { command, estimate, status, matched, rejected: self.rejected, nis: f64::NAN })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decide(line: &str) -> Result<Decision, String> {
        serde_json::from_str::<Answer>(line).map_err(|e| e.to_string())?.decision(7)
    }

    #[test]
    fn answers_are_read_strictly() {
        let plain = decide(r#"{"v_m_s": 0.2, "omega_rad_s": -0.1}"#).unwrap();
        assert_eq!((plain.command, plain.status, plain.matched), (Twist { v: 0.2, omega: -0.1 }, Status::Running, 7));
        let full = r#"{"v_m_s":1,"omega_rad_s":0,"done":true,"matched":3,"rejected":2,
            "estimate":{"x_m":1,"y_m":2,"heading_rad":7,"covariance":[[1,0.5,0],[0.5,2,0],[0,0,3]]}}"#;
        let full = decide(full).unwrap();
        assert_eq!((full.command, full.status, full.matched, full.rejected), (Twist::default(), Status::Arrived, 3, 2));
        let estimate = full.estimate.unwrap();
        assert!((estimate.pose.heading - (7.0 - std::f64::consts::TAU)).abs() < 1e-12 && estimate.covariance[(0, 1)] == 0.5);
        for (bad, words) in [
            ("42", "invalid type"),
            ("{}", "v_m_s"),
            (r#"{"v_m_s":NaN,"omega_rad_s":0}"#, "expected value"),
            (r#"{"v_m_s":1e999,"omega_rad_s":0}"#, "out of range"),
            (r#"{"v_m_s":0,"omega_rad_s":0,"finished":true}"#, "finished"),
            (r#"{"v_m_s":0,"omega_rad_s":0,"done":true,"lost":true}"#, "at once"),
            (
                r#"{"v_m_s":0,"omega_rad_s":0,"estimate":{"x_m":0,"y_m":0,"heading_rad":0,"covariance":[[-1,0,0],[0,1,0],[0,0,1]]}}"#,
                "negative",
            ),
        ] {
            let message = decide(bad).unwrap_err();
            assert!(message.contains(words), "{bad}: {message}");
        }
    }
}
