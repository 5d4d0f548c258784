//! The paper's observer: an EKF over X = (R, theta, alpha, theta_1, theta_2, theta_3).
//!
//! Equation numbers are those of "Bearing only visual homing: Observer based approach". R and theta are the robot's position in
//! polar form around home, alpha its heading, theta_i the bearing of landmark i from the heading. With the home range
//! eliminated by (3), equation (4) becomes
//!
//! theta_i' = v sin(theta_i) sin(theta_i* - theta_i - alpha) / (R sin(theta - theta_i*)) - omega.
//!
//! Two departures from the printed text. The text prints the covariance prediction with G = dg/dX; a discrete filter needs the
//! transition Jacobian, so I + Ts dg/dX stands here, and the printed one is kept as [`Transition::Printed`] to show what it
//! does. And the model is singular at home and on the lines through home and a landmark; there the denominators are held away
//! from zero, so that no state ever becomes NaN.

use nalgebra::{SMatrix, SVector};

use crate::geometry::{Pose, Twist, sin_cos, wrap};
use crate::observation::Estimate;
use crate::ode::{Tolerance, integrate};

/// The state vector X.
pub type State = SVector<f64, 6>;
/// A 6 x 6 matrix.
pub type Matrix = SMatrix<f64, 6, 6>;

/// Smallest R (m) and smallest |sin(theta - theta_i*)| that the model divides by.
const SMALLEST: f64 = 1e-3;

/// Noise settings; defaults are the paper's for ideal conditions (Q = 0.01 I, M = 0.1 I, P0 = I, as printed, in cm and rad).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperSettings {
    /// Process noise, on the diagonal of Q.
    pub process: f64,
    /// Measurement noise, on the diagonal of M.
    pub measurement: f64,
    /// Initial covariance, on the diagonal of P(0|0).
    pub initial: f64,
    /// Jacobian of the covariance prediction.
    pub transition: Transition,
    /// How the mean is predicted.
    pub prediction: Prediction,
}

/// The G of P(k|k-1) = G P G^T + Q.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transition {
    /// I + Ts dg/dX, what a discrete filter needs.
    Discrete,
    /// dg/dX, as the paper prints it: a rate, not a transition.
    Printed,
}

/// How the mean is carried over a sampling interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prediction {
    /// By Dormand and Prince's method, as the paper has it, to this tolerance.
    Ode(Tolerance),
    /// One step of Euler's method.
    Euler,
}

impl Default for PaperSettings {
    fn default() -> Self {
        Self {
            process: 0.01,
            measurement: 0.1,
            initial: 1.0,
            transition: Transition::Discrete,
            prediction: Prediction::Ode(Tolerance::TIGHT),
        }
    }
}

/// The six-state filter. Ranges are kept in cm inside, because the paper's noise matrices are stated in cm.
#[derive(Debug, Clone)]
pub struct PaperEkf {
    settings: PaperSettings,
    home_bearings: [f64; 3],
    state: State,
    covariance: Matrix,
}

const CM: f64 = 100.0;

fn away_from_zero(v: f64) -> f64 {
    if v.abs() >= SMALLEST {
        v
    } else if v < 0.0 {
        -SMALLEST
    } else {
        SMALLEST
    }
}

/// Right-hand side of (6), X' = g(X) u, with v in the unit of R per second, and its Jacobian with respect to X.
#[must_use]
pub fn dynamics(x: &State, twist: Twist, home_bearings: &[f64; 3]) -> (State, Matrix) {
    let (r, theta, alpha) = (if x[0] < SMALLEST { SMALLEST } else { x[0] }, x[1], x[2]);
    let v = twist.v;
    let (s, c) = sin_cos(alpha - theta);
    let mut f = State::zeros();
    let mut j = Matrix::zeros();
    f[0] = v * c;
    j[(0, 1)] = v * s;
    j[(0, 2)] = -v * s;
    f[1] = v * s / r;
    j[(1, 0)] = -v * s / (r * r);
    j[(1, 1)] = -v * c / r;
    j[(1, 2)] = v * c / r;
    f[2] = twist.omega;
    for (i, &home) in home_bearings.iter().enumerate() {
        let t = x[3 + i];
        let (st, ct) = sin_cos(t);
        let (sa, ca) = sin_cos(home - t - alpha);
        let (sb, cb) = sin_cos(theta - home);
        let sb = away_from_zero(sb);
        let scale = v / (r * sb);
        f[3 + i] = scale * st * sa - twist.omega;
        j[(3 + i, 0)] = -scale * st * sa / r;
        j[(3 + i, 1)] = -scale * st * sa * cb / sb;
        j[(3 + i, 2)] = -scale * st * ca;
        j[(3 + i, 3 + i)] = scale * (ct * sa - st * ca);
    }
    (f, j)
}

impl PaperEkf {
    /// A filter for three landmarks with their home bearings and first bearings (rad), started at `initial`: the robot's pose
    /// in the home frame (m, rad) as the user supposes it.
    #[must_use]
    pub fn new(settings: PaperSettings, home_bearings: [f64; 3], first_bearings: [f64; 3], initial: Pose) -> Self {
        let p = initial.position();
        let state = State::from_column_slice(&[
            p.norm() * CM,
            crate::geometry::angle_of(p),
            initial.heading,
            first_bearings[0],
            first_bearings[1],
            first_bearings[2],
        ]);
        Self { settings, home_bearings, state, covariance: Matrix::identity() * settings.initial }
    }

    /// The state X: cm, rad.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Its covariance.
    #[must_use]
    pub fn covariance(&self) -> &Matrix {
        &self.covariance
    }

    /// The robot's pose in the home frame, m and rad.
    #[must_use]
    pub fn pose(&self) -> Pose {
        let p = crate::geometry::direction(self.state[1]) * (self.state[0] / CM);
        Pose::new(p.x, p.y, self.state[2])
    }

    /// The pose with its covariance, mapped from polar to Cartesian form.
    #[must_use]
    pub fn estimate(&self) -> Estimate {
        let (s, c) = sin_cos(self.state[1]);
        let r = self.state[0] / CM;
        let j = nalgebra::Matrix3::new(c / CM, -r * s, 0.0, s / CM, r * c, 0.0, 0.0, 0.0, 1.0);
        let p = self.covariance.fixed_view::<3, 3>(0, 0);
        Estimate { pose: self.pose(), covariance: j * p * j.transpose() }
    }

    /// Time update over `dt` seconds with a constant twist (m/s, rad/s).
    pub fn predict(&mut self, twist: Twist, dt: f64) {
        let before = self.state;
        let u = Twist { v: twist.v * CM, omega: twist.omega };
        let jacobian = dynamics(&self.state, u, &self.home_bearings).1;
        let transition = match self.settings.transition {
            Transition::Discrete => Matrix::identity() + jacobian * dt,
            Transition::Printed => jacobian,
        };
        let slope = |x: &State| dynamics(x, u, &self.home_bearings).0;
        self.state = match self.settings.prediction {
            Prediction::Ode(tolerance) => {
                let slope = |x: &[f64; 6]| slope(&State::from(*x)).into();
                State::from(integrate(slope, self.state.into(), dt, tolerance))
            }
            Prediction::Euler => self.state + slope(&self.state) * dt,
        };
        self.tame();
        self.covariance = transition * self.covariance * transition.transpose() + Matrix::identity() * self.settings.process;
        // Near a singularity the Jacobian may grow without bound; the filter then starts over from where it was.
        if !self.state.iter().chain(self.covariance.iter()).all(|v| v.is_finite() && v.abs() < 1e12) {
            self.state = before;
            self.covariance = Matrix::identity() * self.settings.initial;
        }
    }

    /// Measurement update with the bearings that are seen; unseen ones are left out. Returns the normalised innovation
    /// squared and how many bearings there were.
    pub fn update(&mut self, bearings: [Option<f64>; 3]) -> (f64, usize) {
        let (mut nis, mut count) = (0.0, 0);
        // M is diagonal, so the bearings may be taken one after the other.
        for (i, bearing) in bearings.into_iter().enumerate() {
            let Some(bearing) = bearing.filter(|b| b.is_finite()) else { continue };
            let k = 3 + i;
            let innovation = wrap(bearing - self.state[k]);
            let s = self.covariance[(k, k)] + self.settings.measurement;
            let column: State = self.covariance.column(k).into_owned();
            self.state += column * (innovation / s);
            self.covariance -= column * column.transpose() / s;
            nis += innovation * innovation / s;
            count += 1;
        }
        self.tame();
        (nis, count)
    }

    /// Keeps R positive (the same point in polar form), angles wrapped, and the state finite.
    fn tame(&mut self) {
        if self.state[0] < 0.0 {
            self.state[0] = -self.state[0];
            self.state[1] += std::f64::consts::PI;
        }
        for k in 1..6 {
            self.state[k] = wrap(self.state[k]);
        }
    }
}
