//! Trajectories in the TUM format, which `evo` and most tools for odometry and SLAM read: `t x y z qx qy qz qw` a line.

use std::fmt::Write;

use crate::episode::Record;
use crate::geometry::{Pose, sin_cos};

/// Truth, odometry and, where the method has one, the estimate, as names and texts of files. All are in the room's frame, so that
/// they can be held against one another without alignment: odometry from the true start on, estimates by way of the true home.
pub(super) fn trajectories(record: &Record) -> Vec<(&'static str, String)> {
    let steps = &record.steps;
    let truth = text(steps.iter().map(|s| (s.time_s, s.truth)));
    let odometry = text(steps.iter().map(|s| (s.time_s, s.dead_reckoned)));
    let estimates = steps.iter().filter_map(|s| Some((s.time_s, record.home.compose(&s.estimate.as_ref()?.pose))));
    let mut files = vec![("trajectory.tum", truth), ("odometry.tum", odometry)];
    files.extend(Some(("estimate.tum", text(estimates))).filter(|(_, text)| !text.is_empty()));
    files
}

fn text(poses: impl Iterator<Item = (f64, Pose)>) -> String {
    let mut text = String::new();
    for (time_s, pose) in poses.filter(|(_, pose)| pose.is_finite()) {
        let (z, w) = sin_cos(0.5 * pose.heading);
        let _ = writeln!(text, "{time_s} {} {} 0 0 0 {z} {w}", pose.x, pose.y);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_becomes_a_quaternion() {
        let poses = [(0.5, Pose::new(1.0, -2.0, std::f64::consts::PI)), (1.0, Pose { x: f64::NAN, ..Pose::IDENTITY })];
        let text = text(poses.into_iter());
        let numbers: Vec<f64> = text.split_whitespace().map(|n| n.parse().unwrap()).collect();
        assert_eq!(numbers[..7], [0.5, 1.0, -2.0, 0.0, 0.0, 0.0, 1.0]);
        assert!(numbers.len() == 8 && numbers[7].abs() < 1e-15, "{text}");
    }
}
