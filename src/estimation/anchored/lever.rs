//! A camera that is not above the middle of the axle.
//!
//! Bearings say where the camera is, wheels where the axle goes. The filter works on the camera alone: what the wheels tell is
//! carried over to it, and where it is found is carried back to the axle. With the camera at c in the robot's frame and the
//! translation T by c, a motion D of the axle is T^-1 D T of the camera; and a camera at P in the frame of the camera at
//! home means a robot at T P T^-1 in the frame of the robot at home.

use nalgebra::Matrix3;

use super::motion::Motion;
use crate::geometry::{Pose, Vector2, sin_cos};
use crate::observation::Estimate;

/// Position of the camera from the middle of the axle, forward and left, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lever(Vector2<f64>);

impl Lever {
    /// The lever of a camera that is `[forward, left]` of the middle of the axle, m.
    #[must_use]
    pub fn new([forward, left]: [f64; 2]) -> Self {
        Self(Vector2::new(forward, left))
    }

    /// How far a turn about the middle of the axle carries the camera, in the frame before the turn.
    fn carried(&self, turn: f64) -> Vector2<f64> {
        Pose::new(0.0, 0.0, turn).transform(self.0) - self.0
    }

    /// The derivative of [`Lever::carried`] by the turn, as it enters the covariance of (x, y, heading).
    fn by_turn(&self, turn: f64, sign: f64) -> Matrix3<f64> {
        let (s, c) = sin_cos(turn);
        let [x, y] = [-(s * self.0.x + c * self.0.y), c * self.0.x - s * self.0.y].map(|by| sign * by);
        Matrix3::new(1.0, 0.0, x, 0.0, 1.0, y, 0.0, 0.0, 1.0)
    }

    /// The camera's motion, by that of the axle.
    #[must_use]
    pub fn camera_motion(&self, axle: &Motion) -> Motion {
        let Pose { heading, .. } = axle.delta;
        let at = axle.delta.position() + self.carried(heading);
        Motion { delta: Pose { x: at.x, y: at.y, heading }, covariance: self.camera_covariance(heading, &axle.covariance) }
    }

    /// Covariance of the camera's motion, by that of a motion of the axle which turns by `turn`.
    #[must_use]
    pub fn camera_covariance(&self, turn: f64, axle: &Matrix3<f64>) -> Matrix3<f64> {
        let by_turn = self.by_turn(turn, 1.0);
        by_turn * axle * by_turn.transpose()
    }

    /// Pose of the robot in the frame of a robot, by that of its camera in the frame of that one's camera.
    #[must_use]
    pub fn axle_pose(&self, camera: &Pose) -> Pose {
        let at = camera.position() - self.carried(camera.heading);
        Pose { x: at.x, y: at.y, ..*camera }
    }

    /// The same with its covariance.
    #[must_use]
    pub fn axle_estimate(&self, camera: &Estimate) -> Estimate {
        let by_turn = self.by_turn(camera.pose.heading, -1.0);
        Estimate { pose: self.axle_pose(&camera.pose), covariance: by_turn * camera.covariance * by_turn.transpose() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: [f64; 2] = [0.09, -0.04];

    /// Pose of the camera of a robot.
    fn camera(robot: &Pose) -> Pose {
        robot.compose(&Pose::new(CAMERA[0], CAMERA[1], 0.0))
    }

    fn difference(a: &Pose, b: &Pose) -> f64 {
        (a.position() - b.position()).norm() + crate::geometry::wrap(a.heading - b.heading).abs()
    }

    #[test]
    fn poses_and_motions_are_those_of_camera_and_robot_in_the_room() {
        let lever = Lever::new(CAMERA);
        let (home, before) = (Pose::new(1.0, 2.0, 0.4), Pose::new(-0.7, 1.1, 2.9));
        let after = before.compose(&Pose::new(0.3, 0.02, 0.8));
        let axle = Motion { delta: before.to_local(&after), covariance: Matrix3::identity() };
        assert!(difference(&lever.camera_motion(&axle).delta, &camera(&before).to_local(&camera(&after))) < 1e-12);
        let found = lever.axle_pose(&camera(&home).to_local(&camera(&after)));
        assert!(difference(&found, &home.to_local(&after)) < 1e-12);
    }

    /// Covariances against the Jacobians by differences.
    #[test]
    fn covariances_are_carried_over() {
        let lever = Lever::new(CAMERA);
        let covariance = Matrix3::new(4e-4, 1e-5, 3e-5, 1e-5, 2e-4, 2e-5, 3e-5, 2e-5, 3e-4);
        let at = Pose::new(0.3, -0.2, 1.1);
        let jacobian = |of: &dyn Fn(Pose) -> Pose| {
            let column = |k: usize| {
                let moved = |by: f64| {
                    let mut state = [at.x, at.y, at.heading];
                    state[k] += by;
                    let pose = of(Pose { x: state[0], y: state[1], heading: state[2] });
                    nalgebra::Vector3::new(pose.x, pose.y, pose.heading)
                };
                (moved(1e-6) - moved(-1e-6)) / 2e-6
            };
            Matrix3::from_columns(&[column(0), column(1), column(2)])
        };
        let motion = |delta: Pose| lever.camera_motion(&Motion { delta, covariance });
        let by = jacobian(&|delta| motion(delta).delta);
        assert!((motion(at).covariance - by * covariance * by.transpose()).amax() < 1e-12);
        let by = jacobian(&|pose| lever.axle_pose(&pose));
        let found = lever.axle_estimate(&Estimate { pose: at, covariance }).covariance;
        assert!((found - by * covariance * by.transpose()).amax() < 1e-12);
    }

    #[test]
    fn above_the_axle_nothing_changes() {
        let lever = Lever::new([0.0; 2]);
        let covariance = Matrix3::new(4e-4, 1e-5, 3e-5, 1e-5, 2e-4, 2e-5, 3e-5, 2e-5, 3e-4);
        let motion = Motion { delta: Pose::new(0.03, 0.001, 0.2), covariance };
        let carried = lever.camera_motion(&motion);
        assert_eq!((carried.delta, carried.covariance), (motion.delta, motion.covariance));
    }
}
