//! The geometric check: one planar motion must explain all matches.
//!
//! The robot moved from home, in direction d (home frame), and turned by alpha. A landmark at azimuth a* and range r* from
//! home is now seen at azimuth a, range r; with phi = a + alpha its direction now in the home frame,
//!
//! ```text
//! r* u(a*) = R u(d) + r u(phi).
//! ```
//!
//! The cross product with u(d) gives r* sin(a* - d) = r sin(phi - d). The landmark's height over the camera stays,
//! h = r* t* = r t with t the tangent of elevation, so
//!
//! ```text
//! t sin(a* - d) = t* sin(phi - d),                                                       (1)
//! ```
//!
//! free of all ranges: the epipolar constraint of a planar motion. The cross product with u(a*) gives
//! sin(phi - a*) = (R / r) sin(a* - d): landmarks move away from d, the more the nearer they are, and never beyond its
//! opposite. At home itself (R = 0) both hold for every d with phi = a*, t = t*, so a pure turn needs no case of its own.
//!
//! Two matches fix (d, alpha) in closed form; random pairs propose motions, all matches judge them, Gauss-Newton steps
//! polish the best. Elevations serve only here, to tell right matches from wrong: what leaves vision is azimuths.

use std::f64::consts::{PI, TAU};

use rand::RngExt;
use rand_pcg::rand_core::Rng;

use crate::geometry::{Vector2, cross, direction, wrap};
use crate::random::Seed;

/// A feature as the geometry sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    /// Unit vector of the azimuth in the frame of the robot (at home: the home frame).
    pub unit: Vector2<f64>,
    /// Tangent of elevation.
    pub tan: f64,
    /// Variance of azimuth and of the tangent of elevation, rad^2.
    pub variance: f64,
    /// Scale, rad.
    pub scale: f64,
}

/// Direction of the step from home and turn since home.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlanarMotion {
    /// d, rad, home frame.
    pub direction_rad: f64,
    /// alpha, rad.
    pub turn_rad: f64,
}

/// How a match fits a motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    /// Squared residual of (1) over its variance.
    pub chi2: f64,
    /// Whether sense and reach of the motion and the change of scale are possible.
    pub possible: bool,
}

impl Fit {
    /// Whether the match may be right.
    pub fn is_good(&self) -> bool {
        self.possible & (self.chi2 < CHI2_LIMIT)
    }
}

/// A motion with its vectors at hand.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    step: Vector2<f64>,
    turn: Vector2<f64>,
}

impl PlanarMotion {
    pub fn frame(&self) -> Frame {
        Frame { step: direction(self.direction_rad), turn: direction(self.turn_rad) }
    }
}

/// Largest allowed ratio between the change of scale and the change of range, either way.
const SCALE_SLACK: f64 = 1.8;
/// Standard deviations by which a match may miss what geometry allows.
const REACH: f64 = 3.0;
/// The same squared: the limit of `Fit::chi2`.
const CHI2_LIMIT: f64 = REACH * REACH;

/// Matches judged together, before asking whether to go on.
const JUDGED_AT_ONCE: usize = 16;

/// The sines and cosines that (1) is made of.
struct Angles {
    /// sin(a* - d), cos(a* - d).
    home: (f64, f64),
    /// sin(phi - d), cos(phi - d).
    now: (f64, f64),
    /// sin(phi - a*).
    parallax: f64,
}

impl Frame {
    #[inline(always)]
    fn angles(&self, home: &Sight, now: &Sight) -> Angles {
        let phi = Vector2::new(
            self.turn.x * now.unit.x - self.turn.y * now.unit.y,
            self.turn.y * now.unit.x + self.turn.x * now.unit.y,
        );
        Angles {
            home: (cross(self.step, home.unit), self.step.dot(&home.unit)),
            now: (cross(self.step, phi), self.step.dot(&phi)),
            parallax: cross(home.unit, phi),
        }
    }

    /// Residual of (1) and its variance.
    #[inline(always)]
    fn residual(angles: &Angles, home: &Sight, now: &Sight) -> (f64, f64) {
        let ((a, a_cos), (b, b_cos)) = (angles.home, angles.now);
        let error = now.tan * a - home.tan * b;
        let variance = home.variance * (now.tan * now.tan * a_cos * a_cos + b * b)
            + now.variance * (home.tan * home.tan * b_cos * b_cos + a * a)
            + 1e-12;
        (error, variance)
    }

    /// How a match fits this motion, and how it fits the opposite step with the same turn: residual and scale are the same,
    /// the sense is not.
    #[inline(always)]
    fn fit_both(&self, home: &Sight, now: &Sight) -> [Fit; 2] {
        let angles = self.angles(home, now);
        let (error, variance) = Self::residual(&angles, home, now);
        let chi2 = error * error / variance;
        let (a, b) = (angles.home.0, angles.now.0);
        // r*/r = sin(phi - d) / sin(a* - d), and that is also the ratio of the scales.
        let (near, far) = (now.scale * a.abs(), home.scale * b.abs());
        // No short cuts: many matches are judged at once.
        let scale_fits = (near < SCALE_SLACK * far + 0.1 * home.scale) & (far < SCALE_SLACK * near + 0.1 * now.scale);
        let slack = REACH * (home.variance + now.variance).sqrt();
        let side = if a < 0.0 { -1.0 } else { 1.0 };
        [side, -side].map(|side| Fit { chi2, possible: scale_fits & (angles.parallax * side > -slack) & (b * side > -slack) })
    }

    /// How a match fits this motion.
    #[inline]
    pub fn fit(&self, home: &Sight, now: &Sight) -> Fit {
        self.fit_both(home, now)[0]
    }
}

/// A match as the check takes it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub home: Sight,
    pub now: Sight,
}

/// Some matches, number by number, as vector instructions take them.
#[derive(Debug, Clone, Copy, Default)]
struct Lanes {
    /// Of home and of now: x and y of the azimuth, tangent of elevation, variance, scale. Where there is no match all are 0, and
    /// what has no scale fits no motion.
    numbers: [[[f64; JUDGED_AT_ONCE]; 5]; 2],
}

impl Lanes {
    fn of(pairs: &[Pair]) -> Vec<Self> {
        let together = |block: &[Pair]| {
            let mut lanes = Self::default();
            for (i, pair) in block.iter().enumerate() {
                for (numbers, s) in lanes.numbers.iter_mut().zip([&pair.home, &pair.now]) {
                    for (number, value) in numbers.iter_mut().zip([s.unit.x, s.unit.y, s.tan, s.variance, s.scale]) {
                        number[i] = value;
                    }
                }
            }
            lanes
        };
        pairs.chunks(JUDGED_AT_ONCE).map(together).collect()
    }

    #[inline(always)]
    fn sights(&self, i: usize) -> [Sight; 2] {
        self.numbers.each_ref().map(|[x, y, tan, variance, scale]| Sight {
            unit: Vector2::new(x[i], y[i]),
            tan: tan[i],
            variance: variance[i],
            scale: scale[i],
        })
    }
}

/// Finds the motion that explains most of `pairs`, which are ordered best first. `None` if there are fewer than
/// three or nothing explains three.
pub(super) fn estimate(pairs: &[Pair], draws: usize, seed: Seed) -> Option<PlanarMotion> {
    if pairs.len() < 3 {
        return None;
    }
    let lanes = Lanes::of(pairs);
    let mut stream = seed.stream("vision/motion");
    let mut best: Option<(f64, PlanarMotion)> = None;
    let mut needed = draws;
    let mut k = 0;
    while k < needed {
        // The pool grows from the best matches to all of them (PROSAC).
        let pool = (12 + pairs.len() * 2 * k / draws).min(pairs.len());
        k += 1;
        let i = (stream.next_u64() % pool as u64) as usize;
        let j = (stream.next_u64() % pool as u64) as usize;
        if i == j {
            continue;
        }
        for motion in solve(&pairs[i], &pairs[j]).into_iter().flatten() {
            let least = best.map_or(0.0, |(score, _)| score);
            let Some((score, motion)) = judge(&lanes, pairs.len(), motion, least) else { continue };
            let better = judge(&lanes, pairs.len(), polish(pairs, motion), score).unwrap_or((score, motion));
            // Enough draws for several pairs of right matches, whose noise still varies.
            let right = better.0 / pairs.len() as f64;
            needed = ((12.0 / (right * right)) as usize).clamp(20, draws);
            best = Some(better);
        }
    }
    best.filter(|(score, _)| *score > 2.0).map(|(_, motion)| motion)
}

/// How ready the matches of a view are to fit a motion that has nothing to do with them, after Moisan and Stival's a-contrario
/// criterion (2004): what wrong matches would do as well proves nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chance {
    /// Matches.
    count: usize,
    /// Probability that one of them fits a motion drawn blindly.
    fit: f64,
}

impl Chance {
    /// Motions drawn to find out. On 3,237 views of generated rooms the probability is 0.02 to 0.03.
    const BLIND: usize = 24;
    /// However rarely matches fit, this probability is supposed.
    const LEAST_FIT: f64 = 0.005;

    /// Asks how many of `pairs` fit motions drawn blindly.
    pub fn of(pairs: &[Pair], seed: Seed) -> Self {
        let mut stream = seed.stream("vision/chance");
        let mut angle = || TAU * stream.random::<f64>();
        let fits = |_| {
            let frame = PlanarMotion { direction_rad: angle(), turn_rad: angle() }.frame();
            pairs.iter().filter(|pair| frame.fit(&pair.home, &pair.now).is_good()).count()
        };
        let all: usize = (0..Self::BLIND).map(fits).sum();
        let fit = all as f64 / (Self::BLIND * pairs.len()).max(1) as f64;
        Self { count: pairs.len(), fit: fit.max(Self::LEAST_FIT) }
    }

    /// Natural logarithm of the number of motions that would be expected to explain at least `right` of the matches if all of them
    /// were wrong: the tail of a binomial distribution, for each motion that two of the matches propose.
    pub fn log_false_alarms(&self, right: usize) -> f64 {
        if right < 3 {
            return f64::INFINITY;
        }
        // Two of them made the motion.
        let (n, k) = (self.count - 2, right - 2);
        let proposed = 2.0 * (self.count * (self.count - 1)) as f64;
        let (of, log) = (|k: usize| libm::lgamma(k as f64 + 1.0), libm::log);
        let first = of(n) - of(k) - of(n - k) + k as f64 * log(self.fit) + (n - k) as f64 * log(1.0 - self.fit);
        // The terms after the first one, by their ratios.
        let odds = self.fit / (1.0 - self.fit);
        let next = |(term, sum): (f64, f64), j: usize| {
            let term = term * odds * (n - j) as f64 / (j + 1) as f64;
            (term, sum + term)
        };
        let (_, sum) = (k..n).fold((1.0, 1.0), next);
        log(proposed) + first + log(sum)
    }
}

/// The motions through two matches: those with the opposite step, which fit (1) as well, are left to `judge`.
fn solve(first: &Pair, second: &Pair) -> [Option<PlanarMotion>; 2] {
    // (1) is linear in u(d) and in u(beta), beta = alpha - d: M u(d) = N u(beta).
    let row = |p: &Pair| {
        let m = p.now.tan * Vector2::new(p.home.unit.y, -p.home.unit.x);
        let n = p.home.tan * Vector2::new(p.now.unit.y, p.now.unit.x);
        (m, n)
    };
    let ((m1, n1), (m2, n2)) = (row(first), row(second));
    let det = cross(n1, n2);
    if det.abs() < 1e-6 {
        return [None, None];
    }
    // Columns of N^-1 M.
    let column = |c1: f64, c2: f64| Vector2::new(n2.y * c1 - n1.y * c2, n1.x * c2 - n2.x * c1) / det;
    let (p, q) = (column(m1.x, m2.x), column(m1.y, m2.y));
    // |N^-1 M u(d)| = 1: mean + swing cos(2 d - psi) = 1.
    let (pp, qq, pq) = (p.dot(&p), q.dot(&q), p.dot(&q));
    let mean = 0.5 * (pp + qq);
    let (half, psi) = (0.5 * (pp - qq), libm::atan2(pq, 0.5 * (pp - qq)));
    let swing = (half * half + pq * pq).sqrt();
    if (1.0 - mean).abs() > 1.2 * swing + 0.1 {
        return [None, None];
    }
    // Noise may push the cosine beyond 1; near home it is all noise, and any d serves.
    let opening = libm::acos(((1.0 - mean) / swing.max(1e-9)).clamp(-1.0, 1.0));
    [1.0, -1.0].map(|sign| {
        let direction_rad = 0.5 * (psi + sign * opening);
        let u = direction(direction_rad);
        let beta = p * u.x + q * u.y;
        let turn_rad = wrap(direction_rad + libm::atan2(beta.y, beta.x));
        Some(PlanarMotion { direction_rad, turn_rad })
    })
}

/// Support of a motion or of its opposite among `count` matches, whichever has more, and that motion; `None` as soon as it is certain
/// that neither has more than `least`.
#[multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn judge(lanes: &[Lanes], count: usize, motion: PlanarMotion, least: f64) -> Option<(f64, PlanarMotion)> {
    let frame = motion.frame();
    let mut support = [0.0_f64; 2];
    let mut left = count;
    for block in lanes {
        let (mut gains, mut opposite_gains) = ([0.0; JUDGED_AT_ONCE], [0.0; JUDGED_AT_ONCE]);
        for (i, (gain, opposite_gain)) in gains.iter_mut().zip(&mut opposite_gains).enumerate() {
            let [home, now] = block.sights(i);
            let [fit, opposite] = frame.fit_both(&home, &now);
            let full = 1.0 - fit.chi2 / CHI2_LIMIT;
            *gain = if fit.is_good() { full } else { 0.0 };
            *opposite_gain = if opposite.is_good() { full } else { 0.0 };
        }
        for (support, gains) in support.iter_mut().zip([gains, opposite_gains]) {
            *support = gains.iter().fold(*support, |sum, gain| sum + gain);
        }
        left = left.saturating_sub(JUDGED_AT_ONCE);
        if support[0].max(support[1]) + left as f64 <= least {
            return None;
        }
    }
    Some(if support[0] >= support[1] {
        (support[0], motion)
    } else {
        (support[1], PlanarMotion { direction_rad: wrap(motion.direction_rad + PI), ..motion })
    })
}

/// Least squares over the matches that fit, by a few damped Gauss-Newton steps. The first steps take in more of the matches: the
/// narrow valley around the answer has false bottoms beside it.
pub(super) fn polish(pairs: &[Pair], start: PlanarMotion) -> PlanarMotion {
    let mut motion = start;
    for widening in [64.0, 16.0, 4.0, 1.0, 1.0] {
        let limit = widening * CHI2_LIMIT;
        let frame = motion.frame();
        let (mut dd, mut da, mut aa, mut gd, mut ga) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for pair in pairs {
            let (home, now) = (&pair.home, &pair.now);
            let fit = frame.fit(home, now);
            if !fit.possible || fit.chi2 > limit {
                continue;
            }
            let angles = frame.angles(home, now);
            let (error, spread) = Frame::residual(&angles, home, now);
            let (a_cos, b_cos) = (angles.home.1, angles.now.1);
            let weight = (1.0 - fit.chi2 / limit) / spread;
            let by_direction = home.tan * b_cos - now.tan * a_cos;
            let by_turn = -home.tan * b_cos;
            dd += weight * by_direction * by_direction;
            da += weight * by_direction * by_turn;
            aa += weight * by_turn * by_turn;
            gd += weight * by_direction * error;
            ga += weight * by_turn * error;
        }
        // The damping keeps d where it is when, near home, nothing tells it.
        let damping = 1e-3 * (dd + aa) + 1e-9;
        let (dd, aa) = (dd + damping, aa + 1e-9);
        let det = dd * aa - da * da;
        if det <= 0.0 {
            break;
        }
        motion.direction_rad = wrap(motion.direction_rad - (aa * gd - da * ga) / det);
        motion.turn_rad = wrap(motion.turn_rad - (dd * ga - da * gd) / det);
    }
    motion
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose, angle_of};

    /// Sights of landmarks spread over a room, from home and from `pose` (home frame), in exact projection. The first
    /// `wrong` of every ten are paired with the next landmark instead of themselves.
    fn room(pose: Pose, wrong: usize) -> Vec<Pair> {
        let mut stream = Seed(7).stream("test");
        let mut unit = || (stream.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        let sights: Vec<Pair> = (0..200)
            .map(|_| {
                let place = Vector2::new(8.0 * unit() - 4.0, 6.0 * unit() - 3.0);
                let (height, size) = (2.2 * unit() - 0.4, 0.05);
                let sight = |p: Vector2<f64>| Sight {
                    unit: direction(angle_of(p)),
                    tan: height / p.norm(),
                    variance: 1e-6,
                    scale: size / p.norm(),
                };
                Pair { home: sight(place), now: sight(pose.inverse_transform(place)) }
            })
            .collect();
        (0..sights.len())
            .map(|k| {
                let now = if k % 10 < wrong { sights[(k + 1) % sights.len()].now } else { sights[k].now };
                Pair { home: sights[k].home, now }
            })
            .collect()
    }

    #[test]
    fn exact_sights_fit_their_motion_and_no_other() {
        let pose = Pose::new(1.2, -0.7, 2.0);
        let motion = PlanarMotion { direction_rad: angle_of(pose.position()), turn_rad: pose.heading };
        let pairs = room(pose, 0);
        let count = |motion: PlanarMotion| {
            let frame = motion.frame();
            pairs.iter().filter(|p| frame.fit(&p.home, &p.now).is_good()).count()
        };
        assert_eq!(count(motion), pairs.len());
        assert!(count(PlanarMotion { turn_rad: 2.2, ..motion }) < pairs.len() / 5);
        assert!(count(PlanarMotion { direction_rad: wrap(motion.direction_rad + 3.0), ..motion }) < pairs.len() / 5);
    }

    #[test]
    fn the_motion_is_found_among_wrong_matches() {
        for (pose, wrong) in [(Pose::new(1.2, -0.7, 2.0), 6), (Pose::new(-0.2, 0.1, -0.4), 6), (Pose::new(0.0, 2.4, 3.0), 5)] {
            let found = estimate(&room(pose, wrong), 300, Seed(0)).expect("a motion");
            assert!(wrap(found.direction_rad - angle_of(pose.position())).abs() < 0.01, "{pose:?}: {found:?}");
            assert!(wrap(found.turn_rad - pose.heading).abs() < 0.01, "{pose:?}: {found:?}");
        }
    }

    #[test]
    fn a_pure_turn_needs_no_direction() {
        let found = estimate(&room(Pose::new(0.0, 0.0, -2.5), 3), 300, Seed(0)).expect("a motion");
        assert!(wrap(found.turn_rad + 2.5).abs() < 0.005, "{found:?}");
    }

    #[test]
    fn too_few_matches_give_no_motion() {
        assert!(estimate(&room(Pose::new(1.0, 0.0, 0.0), 0)[..2], 300, Seed(0)).is_none());
    }

    /// The tail of the binomial distribution against its sum, term by term; and right matches against the same ones shuffled.
    #[test]
    fn chance_explains_shuffled_matches_and_no_right_ones() {
        let chance = Chance { count: 12, fit: 0.2 };
        let term = |n: i32, j: i32| {
            let choose = (1..=j).map(|i| f64::from(n - j + i) / f64::from(i)).product::<f64>();
            choose * 0.2_f64.powi(j) * 0.8_f64.powi(n - j)
        };
        let tail: f64 = (3..=10).map(|j| term(10, j)).sum();
        assert!((chance.log_false_alarms(5) - (2.0 * 12.0 * 11.0 * tail).ln()).abs() < 1e-12);
        for wrong in [0, 10] {
            let pairs = room(Pose::new(1.2, -0.7, 2.0), wrong);
            let chance = Chance::of(&pairs, Seed(0));
            let motion = estimate(&pairs, 300, Seed(0)).expect("a motion");
            let right = pairs.iter().filter(|p| motion.frame().fit(&p.home, &p.now).is_good()).count();
            let log = chance.log_false_alarms(right);
            assert!(if wrong == 0 { log < -100.0 } else { log > -10.0 }, "{right} of 200 fit: {log}, {chance:?}");
        }
    }
}
