//! Small statistics over runs.

/// 97.5 % quantile of the standard normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// 95 % interval of a share by Wilson's score method (1927): of `trials`, `successes` succeeded. All of [0, 1] without trials.
///
/// ```
/// let [low, high] = wayhome::statistics::wilson_95(38, 40);
/// assert!((low - 0.835).abs() < 5e-4 && (high - 0.986).abs() < 5e-4);
/// ```
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

/// How two things fared on the same trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Paired {
    /// Trials in which both succeeded.
    pub both: usize,
    /// Trials in which only the first did.
    pub only_first: usize,
    /// Trials in which only the second did.
    pub only_second: usize,
    /// Trials in which neither did.
    pub neither: usize,
}

impl Paired {
    /// Counts one more trial.
    pub fn add(&mut self, first: bool, second: bool) {
        let count = match (first, second) {
            (true, true) => &mut self.both,
            (true, false) => &mut self.only_first,
            (false, true) => &mut self.only_second,
            (false, false) => &mut self.neither,
        };
        *count += 1;
    }

    /// Number of trials.
    pub fn trials(&self) -> usize {
        self.both + self.only_first + self.only_second + self.neither
    }

    /// Share in which the first succeeded less that of the second; 0 without trials.
    pub fn difference(&self) -> f64 {
        (self.only_first as f64 - self.only_second as f64) / self.trials().max(1) as f64
    }

    /// 95 % interval of the difference for independent trials, by Newcombe's method 10 (1998): Wilson's intervals of the two
    /// shares, joined by square and add with the correlation of the pairs. All of [-1, 1] without trials.
    ///
    /// ```
    /// use wayhome::statistics::Paired;
    ///
    /// // Airway hyper-responsiveness before and after transplantation (Bentur et al. 2009), as Fagerland et al. (2014) give it.
    /// let [low, high] = Paired { both: 1, only_first: 1, only_second: 7, neither: 12 }.difference_95();
    /// assert!((low + 0.507).abs() < 5e-4 && (high + 0.026).abs() < 5e-4);
    /// ```
    pub fn difference_95(&self) -> [f64; 2] {
        let trials = self.trials();
        if trials == 0 {
            return [-1.0, 1.0];
        }
        let [e, f, g, h] = [self.both, self.only_first, self.only_second, self.neither].map(|n| n as f64);
        let n = trials as f64;
        let (first, second) = ((e + f) / n, (e + g) / n);
        let [low_1, high_1] = wilson_95(self.both + self.only_first, trials);
        let [low_2, high_2] = wilson_95(self.both + self.only_second, trials);
        let margins = (e + f) * (g + h) * (e + g) * (f + h);
        let excess = e * h - f * g;
        let corrected = if excess > 0.0 { (excess - 0.5 * n).max(0.0) } else { excess };
        let phi = if margins > 0.0 { corrected / margins.sqrt() } else { 0.0 };
        let joined = |a: f64, b: f64| (a * a - 2.0 * phi * a * b + b * b).max(0.0).sqrt();
        let difference = self.difference();
        let low = difference - joined(first - low_1, high_2 - second);
        let high = difference + joined(high_1 - first, second - low_2);
        [low.max(-1.0), high.min(1.0)]
    }

    /// Two-sided P value of McNemar's test (1947) by the mid-P rule: how likely so unequal a split of the trials in which only one
    /// succeeded is, if both are equally good. 1 where there are none.
    pub fn mid_p(&self) -> f64 {
        let (few, all) = (self.only_first.min(self.only_second), self.only_first + self.only_second);
        let log_choose = |k: usize| {
            let ln_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
            ln_factorial(all) - ln_factorial(k) - ln_factorial(all - k)
        };
        if 2 * few == all {
            return 1.0;
        }
        let chance = |k: usize| libm::exp(log_choose(k) - all as f64 * std::f64::consts::LN_2);
        2.0 * (0..few).map(chance).sum::<f64>() + chance(few)
    }
}

/// Draws of a [`cluster_bootstrap_95`].
const BOOTSTRAP_DRAWS: usize = 2000;

/// Mean of `sum / count` over clusters, all sums over all counts, and its 95 % percentile bootstrap interval (Efron 1979): whole
/// clusters are drawn with replacement, so that what is alike within a cluster does not pass for many independent trials. The same
/// clusters give the same interval. `None` without counts.
pub fn cluster_bootstrap_95(clusters: &[(f64, usize)]) -> Option<(f64, [f64; 2])> {
    use rand::RngExt;
    let mean = |drawn: &mut dyn Iterator<Item = &(f64, usize)>| {
        let (sum, count) = drawn.fold((0.0, 0_usize), |(sum, count), (s, c)| (sum + s, count + c));
        (count > 0).then(|| sum / count as f64)
    };
    let all = mean(&mut clusters.iter())?;
    let mut stream = crate::random::Seed(0).stream("bootstrap");
    let draws: Vec<f64> = (0..BOOTSTRAP_DRAWS)
        .filter_map(|_| {
            let places: Vec<usize> =
                clusters.iter().map(|_| (stream.random::<f64>() * clusters.len() as f64) as usize).collect();
            mean(&mut places.iter().map(|&k| &clusters[k]))
        })
        .collect();
    Some((all, [quantile(&draws, 0.025)?, quantile(&draws, 0.975)?]))
}

/// Mean of the values; `None` of none.
pub fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.into_iter().fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}

/// Quantile of the values at `share` in [0, 1], linear between neighbours; `None` of no values. NaN sorts last.
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = (place as usize).min(last);
    let above = (below + 1).min(last);
    Some(sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64))
}

/// 95 % interval of a chi-square variable with so many degrees of freedom: its exact 2.5 % and 97.5 % quantiles. Both are 0 without
/// freedom.
///
/// Crates for this (`statrs`, `puruspe`) take exponentials from the platform, whose last digits differ from machine to machine.
///
/// ```
/// let [low, high] = wayhome::statistics::chi_square_95(600.0);
/// assert!((low - 534.019).abs() < 1e-3 && (high - 669.769).abs() < 1e-3);
/// ```
pub fn chi_square_95(freedom: f64) -> [f64; 2] {
    [0.025, 0.975].map(|share| chi_square_quantile(freedom, share))
}

/// Newton's method on the distribution function, within bounds that each step narrows.
fn chi_square_quantile(freedom: f64, share: f64) -> f64 {
    if freedom <= 0.0 {
        return 0.0;
    }
    let shape = 0.5 * freedom;
    // The 97.5 % quantile lies less than this far above the mean, whatever the freedom.
    let (mut low, mut high, mut x) = (0.0, freedom + 6.0 * (2.0 * freedom).sqrt() + 6.0, freedom);
    for _ in 0..200 {
        let excess = gamma_share(shape, 0.5 * x) - share;
        *(if excess > 0.0 { &mut high } else { &mut low }) = x;
        let density = 0.5 * libm::exp((shape - 1.0) * libm::log(0.5 * x) - 0.5 * x - libm::lgamma(shape));
        let newton = x - excess / density;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        let step = (next - x).abs();
        x = next;
        if step <= 1e-14 * x {
            break;
        }
    }
    x
}

/// The regularised lower incomplete gamma function P(a, x): below a + 1 by its series, above by Legendre's continued fraction in
/// Lentz' form (Abramowitz and Stegun 1964, 6.5.29 and 6.5.31).
fn gamma_share(a: f64, x: f64) -> f64 {
    let front = libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > 1e-17 * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return front * sum;
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (f64::INFINITY, 1.0 / b);
    let mut fraction = d;
    for k in 1..100_000 {
        let numerator = f64::from(k) * (a - f64::from(k));
        b += 2.0;
        d = 1.0 / (b + numerator * d);
        c = b + numerator / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < 1e-16 {
            break;
        }
    }
    1.0 - front * fraction
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
    fn chi_square_quantiles_are_those_of_tables() {
        // NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7.4, three decimals; more digits, and 600, from mpmath 1.3 at 30 digits.
        for (freedom, low, high) in [
            (1.0, 0.000_982_069_117_175, 5.023_886_187_314_889),
            (3.0, 0.215_795_282_623_898, 9.348_403_604_496_148),
            (30.0, 16.790_772_265_566_62, 46.979_242_243_671_16),
            (600.0, 534.018_550_465_932_6, 669.769_152_216_411_2),
            (100_000.0, 99_125.373_300_647_35, 100_878.415_305_665_57),
        ] {
            for (found, table) in chi_square_95(freedom).into_iter().zip([low, high]) {
                assert!((found / table - 1.0).abs() < 1e-11, "{freedom}: {found}, not {table}");
            }
        }
        assert_eq!(chi_square_95(0.0), [0.0, 0.0]);
    }

    #[test]
    fn pairs_are_counted_and_compared() {
        let mut pairs = Paired::default();
        for (first, second) in [(true, true), (true, false), (true, false), (false, false)] {
            pairs.add(first, second);
        }
        assert_eq!((pairs.trials(), pairs.difference()), (4, 0.5));
        let swapped = Paired { only_first: pairs.only_second, only_second: pairs.only_first, ..pairs };
        let ([low, high], [back_low, back_high]) = (pairs.difference_95(), swapped.difference_95());
        assert!((low + back_high).abs() < 1e-12 && (high + back_low).abs() < 1e-12, "turned round with the order");
        // By hand: of 10 that differ 2 the one way, 2 (1 + 10) / 1024 + 45 / 1024.
        let eight_to_two = Paired { only_first: 8, only_second: 2, ..Paired::default() };
        assert!((eight_to_two.mid_p() - 67.0 / 1024.0).abs() < 1e-12, "{}", eight_to_two.mid_p());
        assert_eq!(Paired { only_first: 3, only_second: 3, ..Paired::default() }.mid_p(), 1.0);
        assert_eq!(Paired { both: 5, ..Paired::default() }.mid_p(), 1.0);
    }

    #[test]
    fn a_bootstrap_draws_whole_clusters() {
        let independent: Vec<(f64, usize)> = (0..100).map(|k| (f64::from(k % 2), 1)).collect();
        let (mean, [low, high]) = cluster_bootstrap_95(&independent).unwrap();
        // Half of 100 independent trials: a standard deviation of 0.05, so about 0.4 to 0.6.
        assert!(mean == 0.5 && (low - 0.4).abs() < 0.02 && (high - 0.6).abs() < 0.02, "{low} to {high}");
        let alike: Vec<(f64, usize)> = (0..10).map(|k| (10.0 * f64::from(k % 2), 10)).collect();
        let (_, [low, high]) = cluster_bootstrap_95(&alike).unwrap();
        assert!(high - low > 0.5, "ten clusters of equals are ten trials, not a hundred: {low} to {high}");
        assert_eq!(cluster_bootstrap_95(&[]), None);
    }

    #[test]
    fn quantiles_of_a_short_list() {
        assert_eq!(quantile(&[3.0, 1.0, 2.0], 0.5), Some(2.0));
        assert_eq!(quantile(&[4.0, 1.0, 2.0, 3.0], 0.5), Some(2.5));
        assert_eq!(quantile(&[7.0], 0.9), Some(7.0));
        assert_eq!(quantile(&[], 0.5), None);
    }
}
