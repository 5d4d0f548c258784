//! The path of a run on the world's map.

use crate::draw::map::{MapDrawing, Stroke};
use crate::episode::{Outcome, Record, Step};
use crate::geometry::{Pose, Vector2, sin_cos};
use crate::observation::Estimate;
use crate::world::World;

/// About how many ellipses are drawn along a path.
const ELLIPSES: usize = 12;
/// Standard deviations that an ellipse covers.
const K_SIGMA: f64 = 2.0;

/// Draws the path of a run, with a title and a legend.
pub(crate) fn path_svg(world: &World, record: &Record) -> String {
    path_drawing(world, record).title(title(world, record)).to_svg()
}

/// Draws the true path, the estimated one with its ellipses, and the one that the odometry alone would tell.
pub(crate) fn path_drawing(world: &World, record: &Record) -> MapDrawing {
    let believed: Vec<(Pose, &Estimate)> = record
        .steps
        .iter()
        .filter_map(|step| step.estimate.as_ref())
        .map(|estimate| (record.home.compose(&estimate.pose), estimate))
        .collect();
    let mut drawing = MapDrawing::new(world)
        .path(positions(&record.steps, |s| s.dead_reckoned), &Stroke::ODOMETRY, "path by odometry alone")
        .path(positions(&record.steps, |s| s.truth), &Stroke::TRUTH, "true path")
        .start(&record.first().truth)
        .end(&record.last().truth);
    if !believed.is_empty() {
        drawing = drawing.path(believed.iter().map(|(pose, _)| pose.position()), &Stroke::ESTIMATE, "estimated path");
    }
    for (pose, estimate) in believed.iter().step_by(believed.len().div_ceil(ELLIPSES).max(1)) {
        drawing = drawing.ellipse(pose, in_room(&record.home, estimate), K_SIGMA);
    }
    drawing
}

fn title(world: &World, record: &Record) -> String {
    let outcome = match record.outcome {
        Outcome::Home => "home",
        Outcome::Timeout => "out of time",
        Outcome::Lost if record.claimed_home => "claimed to be home",
        Outcome::Lost => "lost",
        Outcome::Stuck => "stuck",
        Outcome::Failed => "method broke",
    };
    format!(
        "{}: {outcome}, {:.1} cm from home after {:.1} s",
        world.spec.name,
        100.0 * record.final_distance_m(),
        record.time_s
    )
}

fn positions(steps: &[Step], pose: impl Fn(&Step) -> Pose) -> impl Iterator<Item = Vector2<f64>> {
    steps.iter().map(move |s| pose(s).position())
}

/// Covariance of the estimate's position, turned from the home frame into the room's, m^2.
pub(crate) fn in_room(home: &Pose, estimate: &Estimate) -> [[f64; 2]; 2] {
    let (s, c) = sin_cos(home.heading);
    let p = &estimate.covariance;
    let (xx, xy, yy) = (p[(0, 0)], p[(0, 1)], p[(1, 1)]);
    let mixed = s * c * (xx - yy) + (c * c - s * s) * xy;
    [[c * c * xx - 2.0 * s * c * xy + s * s * yy, mixed], [mixed, s * s * xx + 2.0 * s * c * xy + c * c * yy]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Matrix3;

    #[test]
    fn ellipses_turn_with_home() {
        let covariance = Matrix3::new(4.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.1);
        let estimate = Estimate { pose: Pose::IDENTITY, covariance };
        let near = |found: [[f64; 2]; 2], wanted: [[f64; 2]; 2]| {
            found.iter().flatten().zip(wanted.iter().flatten()).for_each(|(f, w)| assert!((f - w).abs() < 1e-12, "{found:?}"));
        };
        near(in_room(&Pose::IDENTITY, &estimate), [[4.0, 0.0], [0.0, 1.0]]);
        near(in_room(&Pose::new(1.0, 2.0, std::f64::consts::FRAC_PI_2), &estimate), [[1.0, 0.0], [0.0, 4.0]]);
        // Along the diagonal the long axis makes x and y vary together.
        near(in_room(&Pose::new(0.0, 0.0, std::f64::consts::FRAC_PI_4), &estimate), [[2.5, 1.5], [1.5, 2.5]]);
    }
}
