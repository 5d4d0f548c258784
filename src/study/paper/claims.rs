//! What else the paper says, or leaves unsaid, put to the test on its ideal setting and on the sets of images.

use super::LAWS;
use super::course::{Course, Run, StartError, Variant};
use super::ideal::Ideal;
use super::images::ImageCase;
use super::trial::method;
use crate::control::BETA;
use crate::error::Result;
use crate::estimation::paper::{PaperSettings, Prediction};
use crate::geometry::{Vector2, angle_of, wrap};
use crate::method::MethodKind;
use crate::ode::Tolerance;
use crate::statistics::{mean, quantile};

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

/// Both laws' tallies, proportional first.
pub type Both = [Tally; 2];

/// Of runs under both laws.
pub fn tally(runs: &[Run]) -> Both {
    LAWS.map(|law| {
        let runs = || runs.iter().filter(move |r| r.law == law);
        let ratios: Vec<f64> = runs().filter_map(|r| Some(r.track.time_s()? / r.track.straight_s)).collect();
        let [range_rmse_cm, heading_rmse_rad] = [0, 2].map(|state| median_rmse(runs(), state));
        Tally { home: ratios.len(), range_rmse_cm, heading_rmse_rad, ratio: mean(ratios) }
    })
}

/// Median over runs of an error: of R (0), theta (1), alpha (2). NaN without runs.
pub fn median_rmse<'a>(runs: impl IntoIterator<Item = &'a Run>, state: usize) -> f64 {
    let errors: Vec<f64> = runs.into_iter().filter_map(|r| Some(r.track.rmse()?[state])).collect();
    quantile(&errors, 0.5).unwrap_or(f64::NAN)
}

/// The experiments behind the audit, on the paper's ideal setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Claims {
    /// The filter started elsewhere than at the truth; then the same with the Jacobian as printed.
    pub starts: Vec<(StartError, [Both; 2])>,
    /// Runs of eight, with the Jacobian as printed and a start whose heading is 10 degrees off, in which it stays so.
    pub frozen: usize,
    /// The filter started at the truth, with noise on bearings of 0.3 degrees, of 1 degree, and of the stated M (18 degrees); over
    /// [`NOISE_SEEDS`] seeds.
    pub noise: [Both; 3],
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
pub const NOISE_SEEDS: u64 = 10;

impl Claims {
    /// Both laws with this start, with the right Jacobian and with the printed one; `None` if it is none of the audit's.
    pub fn started(&self, wanted: StartError) -> Option<&[Both; 2]> {
        self.starts.iter().find(|(start, _)| *start == wanted).map(|(_, both)| both)
    }
}

/// Runs the experiments.
///
/// # Errors
/// When there are fewer than three landmarks.
pub fn claims(ideal: &Ideal) -> Result<Claims> {
    let usual = Variant::default();
    let of = |variant: &Variant| Ok(tally(&ideal.runs(variant)?));
    let predicted = |prediction| of(&Variant { settings: PaperSettings { prediction, ..usual.settings }, ..usual });
    let started = |start| {
        let variant = usual.started(start);
        Ok((start, [of(&variant)?, of(&variant.printed())?]))
    };
    let noise = |sd_rad: f64| {
        let noisy = (1..=NOISE_SEEDS).map(|seed| Ideal { noise: Some((sd_rad, seed)), ..ideal.clone() }.runs(&usual));
        Ok(tally(&noisy.collect::<Result<Vec<_>>>()?.concat()))
    };
    let beta = |(beta, period_s)| {
        let mut sampled = ideal.clone();
        sampled.world.spec.task.control_period_s = period_s;
        let [_, nonlinear] = tally(&sampled.runs(&Variant { beta, ..usual })?);
        Ok((beta, period_s, nonlinear))
    };
    let betas = [1.01, BETA, 2.0, 3.0, 5.0, 10.0, 20.0];
    let off_rad = 10.0_f64.to_radians();
    let stays = |run: &&Run| run.track.rmse().is_some_and(|rmse| (rmse[2] - off_rad).abs() < 1e-9);
    Ok(Claims {
        starts: StartError::ALL.into_iter().map(started).collect::<Result<_>>()?,
        frozen: ideal.runs(&usual.printed().started(StartError::TEN_DEGREES))?.iter().filter(stays).count(),
        noise: [noise(0.3_f64.to_radians())?, noise(1.0_f64.to_radians())?, noise(0.1_f64.sqrt())?],
        euler: predicted(Prediction::Euler)?,
        ode45: predicted(Prediction::Ode(Tolerance::ODE45))?,
        anchored: tally(&ideal.runs_of(&|law, _| method(MethodKind::AnchoredEkf, law))?),
        beta: [0.1, 0.01].into_iter().flat_map(|s| betas.map(|b| (b, s))).map(beta).collect::<Result<_>>()?,
    })
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
    let usual = Variant::of_images();
    let blind = Variant { settings: PaperSettings { measurement: 1e12, ..usual.settings }, ..usual };
    let of = |variant: &Variant| Ok(tally(&case.runs(variant)?));
    let (one_look_cm, bearing_rms_rad, interpolation_rms_rad) = one_look(case);
    Ok(ImageClaims {
        faithful: of(&usual)?,
        printed: of(&usual.printed())?,
        blind: of(&blind)?,
        untold: of(&usual.started(StartError::Untold))?,
        one_look_cm,
        bearing_rms_rad,
        interpolation_rms_rad,
    })
}

fn one_look(case: &ImageCase) -> (f64, f64, f64) {
    let grid = case.field.grid;
    let fixes: Vec<_> = case.field.objects.iter().take(3).filter_map(|o| case.field.fix(o)).collect();
    let rms = |squares: &[f64]| mean(squares.iter().copied()).unwrap_or(0.0).sqrt();
    let bearing_rms_rad = rms(&fixes.iter().map(|f| f.rms_rad * f.rms_rad).collect::<Vec<_>>());
    let middle = Vector2::new(0.5, 0.5) * grid.spacing_m;
    let (mut squares, mut sds_cm) = (Vec::new(), Vec::new());
    for place in grid.places() {
        let at = grid.position(place);
        let information = fixes.iter().fold(nalgebra::Matrix3::zeros(), |sum, fix| {
            let to = fix.point - at;
            let r = to.norm_squared();
            // Bearing over x, y and heading (turned into metres by nothing: the heading is free).
            let row = nalgebra::RowVector3::new(to.y / r, -to.x / r, -1.0);
            sum + row.transpose() * row / (bearing_rms_rad * bearing_rms_rad)
        });
        if let Some(covariance) = information.try_inverse() {
            let position = covariance.fixed_view::<2, 2>(0, 0);
            let mean = 0.5 * (position[(0, 0)] + position[(1, 1)]);
            let half = 0.5 * (position[(0, 0)] - position[(1, 1)]);
            sds_cm.push(100.0 * (mean + (half * half + position[(0, 1)] * position[(0, 1)]).sqrt()).sqrt());
        }
        let Some(cell) = grid.cell(at + middle) else { continue };
        for fix in &fixes {
            let exact = |p: Vector2<f64>| angle_of(fix.point - p);
            let truth = exact(at + middle);
            let weighted = cell.corners.iter().zip(cell.weights);
            let off: f64 = weighted.map(|(corner, weight)| weight * wrap(exact(grid.position(*corner)) - truth)).sum();
            squares.push(off * off);
        }
    }
    (quantile(&sds_cm, 0.5).unwrap_or(f64::NAN), bearing_rms_rad, rms(&squares))
}
