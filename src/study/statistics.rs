//! Small statistics over runs.

/// 97.5 % quantile of the standard normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// 95 % interval of a share by Wilson's score method (1927): of `trials`, `successes` succeeded. All of [0, 1] without trials.
///
/// ```
/// let [low, high] = wayhome::study::statistics::wilson_95(38, 40);
/// assert!((low - 0.835).abs() < 5e-4 && (high - 0.986).abs() < 5e-4);
/// ```
#[must_use]
pub fn wilson_95(successes: usize, trials: usize) -> [f64; 2] {
    if trials == 0 {
        return [0.0, 1.0];
    }
    let n = trials as f64;
    let share = successes as f64 / n;
    let z_squared = Z_95 * Z_95;
    let middle = share + z_squared / (2.0 * n);
    let half = Z_95 * (share * (1.0 - share) / n + z_squared / (4.0 * n * n)).sqrt();
    let scale = 1.0 + z_squared / n;
    [((middle - half) / scale).max(0.0), ((middle + half) / scale).min(1.0)]
}

/// Quantile of the values at `share` in [0, 1], linear between neighbours; `None` of no values. NaN sorts last.
#[must_use]
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = (place as usize).min(last);
    let above = (below + 1).min(last);
    Some(sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64))
}

/// 95 % interval of a chi-square variable with so many degrees of freedom, by the cube-root approximation of Wilson and Hilferty
/// (1931): below 0.1 % off from 30 degrees of freedom on.
///
/// ```
/// let [low, high] = wayhome::study::statistics::chi_square_95(600.0);
/// assert!((low / 534.0 - 1.0).abs() < 1e-3 && (high / 669.8 - 1.0).abs() < 1e-3);
/// ```
#[must_use]
pub fn chi_square_95(freedom: f64) -> [f64; 2] {
    let spread = 2.0 / (9.0 * freedom);
    [-Z_95, Z_95].map(|z| {
        let root = (1.0 - spread + z * spread.sqrt()).max(0.0);
        freedom * root * root * root
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_bounds_solve_the_score_equation() {
        // The bounds are where the score test is just significant: (share - p)^2 = z^2 p (1 - p) / n.
        for (successes, trials) in [(1, 7), (20, 40), (38, 40)] {
            let share = successes as f64 / trials as f64;
            for p in wilson_95(successes, trials) {
                let excess = (share - p).powi(2) - Z_95 * Z_95 * p * (1.0 - p) / trials as f64;
                assert!(excess.abs() < 1e-12, "{successes}/{trials}: {excess}");
            }
        }
        assert_eq!((wilson_95(0, 5)[0], wilson_95(5, 5)[1]), (0.0, 1.0));
        assert_eq!(wilson_95(0, 0), [0.0, 1.0]);
    }

    #[test]
    fn quantiles_of_a_short_list() {
        assert_eq!(quantile(&[3.0, 1.0, 2.0], 0.5), Some(2.0));
        assert_eq!(quantile(&[4.0, 1.0, 2.0, 3.0], 0.5), Some(2.5));
        assert_eq!(quantile(&[7.0], 0.9), Some(7.0));
        assert_eq!(quantile(&[], 0.5), None);
    }
}
