//! What else the paper says, or leaves unsaid, put to the test on its ideal setting.

use super::LAWS;
use super::ideal::{Ideal, Run, Twists};
use super::images::{ImageCase, image_settings};
use crate::control::{BETA, Law};
use crate::error::Result;
use crate::estimation::paper::{PaperSettings, Prediction, Transition};
use crate::geometry::{Pose, Vector2, angle_of, direction};
use crate::method::untold;
use crate::ode::Tolerance;

/// A way in which the supposed start differs from the true one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StartError {
    /// Not at all.
    None,
    /// R times this.
    Range(f64),
    /// alpha plus this, rad.
    Heading(f64),
    /// R = 50 cm and theta plus this, rad.
    Place(f64),
    /// Nothing known: R = 50 cm, theta = 0.1, alpha = 0.
    Untold,
}

impl StartError {
    /// Those of the audit.
    pub const ALL: [Self; 8] = [
        Self::None,
        Self::Range(1.01),
        Self::Range(1.2),
        Self::Range(0.8),
        Self::Heading(10.0 * std::f64::consts::PI / 180.0),
        Self::Heading(45.0 * std::f64::consts::PI / 180.0),
        Self::Place(0.5),
        Self::Untold,
    ];

    /// The supposed start for a true one, both in the home frame.
    #[must_use]
    pub fn apply(self, truth: &Pose) -> Pose {
        match self {
            Self::None => *truth,
            Self::Range(factor) => Pose::new(factor * truth.x, factor * truth.y, truth.heading),
            Self::Heading(angle) => Pose::new(truth.x, truth.y, truth.heading + angle),
            Self::Place(angle) => {
                let p = direction(angle_of(truth.position()) + angle) * 0.5;
                Pose::new(p.x, p.y, truth.heading)
            }
            Self::Untold => untold(),
        }
    }
}

/// Outcome of P1 to P4 under one law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tally {
    /// How many of the four came home.
    pub home: usize,
    /// Median of their RMSE of R, cm.
    pub range_rmse_cm: f64,
    /// Median of their RMSE of alpha, rad.
    pub heading_rmse_rad: f64,
    /// Mean of time over straight-line time of those that came home; `None` if none did.
    pub ratio: Option<f64>,
}

/// Of the runs of one law.
#[must_use]
pub fn tally(runs: &[Run], law: Law) -> Tally {
    let runs: Vec<&Run> = runs.iter().filter(|r| r.law == law).collect();
    let rmse: Vec<_> = runs.iter().filter_map(|r| r.track.rmse()).collect();
    let median = |k: usize| {
        let values: Vec<f64> = rmse.iter().map(|r| r[k]).collect();
        crate::study::statistics::quantile(&values, 0.5).unwrap_or(f64::NAN)
    };
    let ratios: Vec<f64> = runs.iter().filter_map(|r| Some(r.track.time_s()? / r.track.straight_s)).collect();
    Tally {
        home: ratios.len(),
        range_rmse_cm: median(0),
        heading_rmse_rad: median(2),
        ratio: (!ratios.is_empty()).then(|| ratios.iter().sum::<f64>() / ratios.len() as f64),
    }
}

/// Both laws' tallies, proportional first.
pub type Both = [Tally; 2];

/// The experiments behind the audit, on the paper's ideal setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Claims {
    /// The filter started elsewhere than at the truth.
    pub starts: Vec<(StartError, Both)>,
    /// The same with the Jacobian as printed.
    pub starts_printed: Vec<(StartError, Both)>,
    /// Noise on bearings (standard deviation, rad), the filter started at the truth; over ten seeds.
    pub noise: Vec<(f64, Both)>,
    /// The filter started at the truth with a prediction by Euler's method.
    pub euler: Both,
    /// The same with a prediction to ode45's default tolerance.
    pub ode45: Both,
    /// The anchored filter, told nothing.
    pub anchored: Both,
    /// Beta, Ts (s), and the tally of the nonlinear law.
    pub beta: Vec<(f64, f64, Tally)>,
}

/// Seeds of the runs with noise.
const NOISE_SEEDS: u64 = 10;

/// Runs the experiments.
///
/// # Errors
/// When the anchored filter cannot be built.
pub fn claims(ideal: &Ideal) -> Result<Claims> {
    let printed = PaperSettings { transition: Transition::Printed, ..PaperSettings::default() };
    let started = |settings: PaperSettings| {
        let twists = Twists { settings, ..Twists::default() };
        let each = |error: StartError| Ok((error, both(&ideal.runs(&twists, |start| error.apply(start))?)));
        StartError::ALL.into_iter().map(each).collect::<Result<Vec<_>>>()
    };
    let noise = |sd_rad: f64| {
        let runs: Vec<Vec<Run>> = (1..=NOISE_SEEDS)
            .map(|seed| ideal.runs(&Twists { noise: Some((sd_rad, seed)), ..Twists::default() }, |start| *start))
            .collect::<Result<_>>()?;
        Ok((sd_rad, both(&runs.concat())))
    };
    let predicted = |prediction| -> Result<Both> {
        let settings = PaperSettings { prediction, ..PaperSettings::default() };
        Ok(both(&ideal.runs(&Twists { settings, ..Twists::default() }, |start| *start)?))
    };
    let beta = |beta: f64, period_s: f64| {
        let mut faster = ideal.clone();
        faster.world.spec.task.control_period_s = period_s;
        let runs = faster.runs(&Twists { beta, ..Twists::default() }, |start| *start)?;
        Ok((beta, period_s, tally(&runs, Law::Lyapunov)))
    };
    let betas = [1.01, BETA, 2.0, 3.0, 5.0, 10.0, 20.0];
    Ok(Claims {
        starts: started(PaperSettings::default())?,
        starts_printed: started(printed)?,
        // 0.3 degrees, 1 degree, and the square root of M = 0.1.
        noise: [0.3_f64.to_radians(), 1.0_f64.to_radians(), 0.1_f64.sqrt()].into_iter().map(noise).collect::<Result<_>>()?,
        euler: predicted(Prediction::Euler)?,
        ode45: predicted(Prediction::Ode(Tolerance::ODE45))?,
        anchored: both(&ideal.anchored()?),
        beta: [0.1, 0.01]
            .into_iter()
            .flat_map(|period_s| betas.map(|b| (b, period_s)))
            .map(|(b, period_s)| beta(b, period_s))
            .collect::<Result<_>>()?,
    })
}

fn both(runs: &[Run]) -> Both {
    LAWS.map(|law| tally(runs, law))
}

/// What a set's images have to do with the errors that the paper reports for them.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageClaims {
    /// The paper's settings, started at the truth.
    pub faithful: Both,
    /// The same with the Jacobian as printed.
    pub printed: Both,
    /// The same with bearings that count for nothing (M without bound): odometry alone.
    pub blind: Both,
    /// Told nothing of the start.
    pub untold: Both,
    /// Standard deviation of the position in its weakest direction that one look at the three objects allows if it is known where
    /// they are, cm: its median over the grid.
    pub one_look_cm: f64,
    /// Root mean square of what the objects' bearings are off the points that explain them best, at the places of the grid, rad.
    pub bearing_rms_rad: f64,
    /// Root mean square of what linear interpolation adds between places (in the middles of the cells, for those points), rad.
    pub interpolation_rms_rad: f64,
}

/// Runs a set's experiments.
///
/// # Errors
/// When the set has fewer than three objects.
pub fn image_claims(case: &ImageCase) -> Result<ImageClaims> {
    let usual = image_settings();
    let printed = PaperSettings { transition: Transition::Printed, ..usual };
    let blind = PaperSettings { measurement: 1e12, ..usual };
    let (one_look_cm, bearing_rms_rad, interpolation_rms_rad) = one_look(case);
    Ok(ImageClaims {
        faithful: both(&case.runs(usual, |start| *start)?),
        printed: both(&case.runs(printed, |start| *start)?),
        blind: both(&case.runs(blind, |start| *start)?),
        untold: both(&case.runs(usual, |_| untold())?),
        one_look_cm,
        bearing_rms_rad,
        interpolation_rms_rad,
    })
}

fn one_look(case: &ImageCase) -> (f64, f64, f64) {
    let grid = case.field.grid;
    let fixes: Vec<_> = case.field.objects.iter().take(3).filter_map(|o| case.field.fix(o)).collect();
    let bearing_rms = (fixes.iter().map(|f| f.rms_rad * f.rms_rad).sum::<f64>() / fixes.len().max(1) as f64).sqrt();
    let middle = Vector2::new(0.5, 0.5) * grid.spacing_m;
    let (mut square, mut count) = (0.0, 0.0);
    let mut sds = Vec::new();
    for place in grid.places() {
        let at = grid.position(place);
        let rows: Vec<[f64; 3]> = fixes
            .iter()
            .map(|fix| {
                let to = fix.point - at;
                let r = to.norm_squared();
                // Bearing over x, y and heading (turned into metres by nothing: the heading is free).
                [to.y / r, -to.x / r, -1.0]
            })
            .collect();
        let information = rows.iter().fold(nalgebra::Matrix3::zeros(), |sum, row| {
            let row = nalgebra::RowVector3::from(*row);
            sum + row.transpose() * row / (bearing_rms * bearing_rms)
        });
        if let Some(covariance) = information.try_inverse() {
            let position = covariance.fixed_view::<2, 2>(0, 0);
            let mean = 0.5 * (position[(0, 0)] + position[(1, 1)]);
            let half = 0.5 * (position[(0, 0)] - position[(1, 1)]);
            sds.push(100.0 * (mean + (half * half + position[(0, 1)] * position[(0, 1)]).sqrt()).sqrt());
        }
        let Some(cell) = grid.cell(at + middle) else { continue };
        for fix in &fixes {
            let exact = |p: Vector2<f64>| angle_of(fix.point - p);
            let truth = exact(at + middle);
            let between: f64 = cell
                .corners
                .iter()
                .zip(cell.weights)
                .map(|(corner, weight)| weight * crate::geometry::wrap(exact(grid.position(*corner)) - truth))
                .sum();
            square += between * between;
            count += 1.0;
        }
    }
    let one_look = crate::study::statistics::quantile(&sds, 0.5).unwrap_or(f64::NAN);
    (one_look, bearing_rms, (square / f64::max(count, 1.0)).sqrt())
}
