//! Observability of the paper's system: the matrix O of (14), its rank and its condition.
//!
//! For n landmarks the state is X = (R, theta, alpha, theta_1 .. theta_n). O stacks the gradients of the outputs, (0 I), and those of
//! their Lie derivatives along g1, which are the bearings' rates at unit speed, (J K P diag Q). The gradients along g2 are zero: turning
//! changes all bearings alike whatever the state. So rank O = n + rank [J K P], and six for three landmarks if that 3 x 3 block is
//! regular. At rest g1 does not act and the rank is n.
//!
//! The printed J, K, P, Q are damaged; these are derived from (4) with (3) put in,
//! theta_i' = v sin(theta_i) sin(theta_i* - theta_i - alpha) / (R sin(theta - theta_i*)) - omega, and automatic differentiation of
//! the printed form agrees (`tests/paper.rs`).

use crate::geometry::{Pose, Vector2, angle_of, cross, sin_cos, wrap};

/// Singular values below this share of the greatest are zero but for rounding.
const ZERO: f64 = 1e-9;

/// J, K, P and Q of one landmark at unit speed: the rate of its bearing over R, theta, alpha and the bearing itself. R in the unit that
/// the speed has per second. Infinite or NaN where the model is singular: at R = 0 and on the line through home and landmark.
#[must_use]
pub fn rate_gradient(r: f64, theta: f64, alpha: f64, bearing: f64, home_bearing: f64) -> [f64; 4] {
    let (st, ct) = sin_cos(bearing);
    let (sa, ca) = sin_cos(home_bearing - bearing - alpha);
    let (sb, cb) = sin_cos(theta - home_bearing);
    let scale = 1.0 / (r * sb);
    [-scale * st * sa / r, -scale * st * sa * cb / sb, -scale * st * ca, scale * (ct * sa - st * ca)]
}

/// How well the state can be told at one pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observability {
    /// Landmarks n.
    pub landmarks: usize,
    /// Rank of O, n + 3 at most.
    pub rank: usize,
    /// Greatest over least singular value of [J K P], with R in units of `length_m` so that it does not hang on the unit; infinite
    /// where the block is singular. Landmarks on whose line through home the robot stands are left out.
    pub condition: f64,
    /// The same with the place across the line of sight, R theta, in that unit instead of theta: free of what is singular about polar
    /// coordinates alone.
    pub condition_in_plane: f64,
}

impl Observability {
    /// Whether R, theta and alpha can all be told.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.rank == self.landmarks + 3
    }
}

/// Observability at a pose in the home frame, of a robot that moves straight on if `moving`, for landmarks in the home frame, m.
/// `length_m` is a length of the scene, such as the landmarks' mean distance.
#[must_use]
pub fn observability(pose: &Pose, landmarks: &[Vector2<f64>], moving: bool, length_m: f64) -> Observability {
    let n = landmarks.len();
    let blind = Observability { landmarks: n, rank: n, condition: f64::INFINITY, condition_in_plane: f64::INFINITY };
    if !moving {
        return blind;
    }
    let position = pose.position();
    let (r, theta) = (position.norm(), angle_of(position));
    let rows: Vec<[f64; 3]> = landmarks
        .iter()
        // On the line through home and a landmark (3) divides by zero: its row has no value, the others decide.
        .filter(|landmark| r > 0.0 && (cross(position, **landmark) / (r * landmark.norm())).abs() > ZERO)
        .map(|landmark| {
            let bearing = wrap(angle_of(landmark - position) - pose.heading);
            let [j, k, p, _] = rate_gradient(r, theta, pose.heading, bearing, angle_of(*landmark));
            [j * length_m, k, p]
        })
        .collect();
    let values = singular_values(&rows);
    let rank = n + values.iter().filter(|v| **v > ZERO * values[0]).count();
    let in_plane: Vec<[f64; 3]> = rows.iter().map(|[j, k, p]| [*j, k / r * length_m, *p]).collect();
    Observability {
        landmarks: n,
        rank,
        condition: condition(&values),
        condition_in_plane: condition(&singular_values(&in_plane)),
    }
}

fn condition(values: &[f64; 3]) -> f64 {
    if values[2] > ZERO * values[0] { values[0] / values[2] } else { f64::INFINITY }
}

/// Singular values of a matrix of three columns, descending, by one-sided Jacobi rotations (Hestenes 1958), which keep small ones exact
/// where rows differ much in size.
#[must_use]
pub fn singular_values(rows: &[[f64; 3]]) -> [f64; 3] {
    let mut columns: [Vec<f64>; 3] = std::array::from_fn(|k| rows.iter().map(|row| row[k]).collect());
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    for _ in 0..30 {
        let mut greatest = 0.0_f64;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (pp, qq, pq) = (dot(&columns[p], &columns[p]), dot(&columns[q], &columns[q]), dot(&columns[p], &columns[q]));
            if pq == 0.0 {
                continue;
            }
            greatest = greatest.max(pq.abs() / (pp * qq).sqrt());
            let zeta = (qq - pp) / (2.0 * pq);
            let t = (if zeta < 0.0 { -1.0 } else { 1.0 }) / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
            let c = 1.0 / (1.0 + t * t).sqrt();
            let s = c * t;
            let [a, b] = [std::mem::take(&mut columns[p]), std::mem::take(&mut columns[q])];
            columns[p] = a.iter().zip(&b).map(|(a, b)| c * a - s * b).collect();
            columns[q] = a.iter().zip(&b).map(|(a, b)| s * a + c * b).collect();
        }
        if greatest < 1e-15 {
            break;
        }
    }
    let mut values = columns.map(|column| dot(&column, &column).sqrt());
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    const LANDMARKS: [Vector2<f64>; 3] = [Vector2::new(1.5, 0.3), Vector2::new(1.0, 1.8), Vector2::new(0.2, 0.6)];

    #[test]
    fn singular_values_are_those_of_known_matrices() {
        // diag(3, 2) beside zeros, turned by a rotation from the left; then one that is of rank 2 by construction.
        let values = singular_values(&[[0.0, 1.6, 1.8], [0.0, -1.2, 2.4], [0.0, 0.0, 0.0]]);
        assert!((values[0] - 3.0).abs() < 1e-14 && (values[1] - 2.0).abs() < 1e-14 && values[2] == 0.0, "{values:?}");
        let values = singular_values(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]);
        assert!((values[0] - 16.848_103_352_614_21).abs() < 1e-12 && values[2] < 1e-14, "{values:?}");
    }

    /// Full in general; not at rest, not towards a landmark, not on the line through home and a landmark.
    #[test]
    fn rank_six_holds_in_general_and_fails_where_it_must() {
        let at = |x, y, heading| observability(&Pose::new(x, y, heading), &LANDMARKS, true, 1.0);
        assert!(at(-0.6, 0.4, 1.5).is_full() && at(-0.6, 0.4, 1.5).condition < 1e3);
        assert_eq!(observability(&Pose::new(-0.6, 0.4, 1.5), &LANDMARKS, false, 1.0).rank, 3);
        let robot = Vector2::new(-0.6, 0.4);
        let towards = angle_of(LANDMARKS[1] - robot);
        assert_eq!(at(robot.x, robot.y, towards).rank, 5, "its bearing stands still whatever its range");
        let half = LANDMARKS[1] * 0.5;
        assert_eq!((at(half.x, half.y, 0.3).rank, at(half.x, half.y, 0.3).condition), (5, f64::INFINITY));
        assert_eq!(at(0.0, 0.0, 0.3).rank, 3);
        // Near home it is theta that cannot be told, not the place.
        let near = at(-0.006, 0.004, 1.5);
        assert!(near.condition > 100.0 && near.condition_in_plane < 100.0, "{near:?}");
    }
}
