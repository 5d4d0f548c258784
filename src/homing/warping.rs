//! MinWarping (Moeller 2009; Moeller, Krzykawski and Gerstmayr 2010): all steps and turns are tried, and for each of them every column of
//! home is looked for where it might be seen now.
//!
//! On a step in direction d a column at azimuth a* = d + x is seen at d + x + u now, where u is between 0 and what is left to the opposite
//! of d; which u, only its distance tells. It is as much larger then as the ratio of the ranges says, sin(x + u) / sin(x). Columns are
//! compared by the sum of absolute differences, magnified about the horizon by one of a few scales (the planes). The score
//! of (d, alpha) is the sum over the columns of home of the least difference over u; the least score wins. Minima over
//! stretches of u at one scale are taken from tables of minima over powers of two.

use std::f64::consts::{PI, TAU};

use super::grey::Grey;
use super::{Angle, Answer, Homing};
use crate::error::Result;
use crate::geometry::{sin_cos, wrap};
use crate::panorama::Panorama;

/// Settings of MinWarping; the defaults are those of the paper's fast variant.
#[derive(Debug, Clone, PartialEq)]
pub struct WarpingSettings {
    /// Directions and turns that are tried, evenly over a full turn.
    pub steps: usize,
    /// Columns are this many times the steps.
    pub columns_per_step: usize,
    /// Most rows, around the horizon.
    pub rows: usize,
    /// Scales at which columns are compared, rising; of what is farther off the nearest is taken.
    pub scales: Vec<f64>,
    /// Whether the mean of each column is taken away, and the rest is brought to one contrast: light that changes a wall's brightness as a
    /// whole, and that of all by one factor, then changes nothing.
    pub is_light_free: bool,
}

impl Default for WarpingSettings {
    fn default() -> Self {
        let scales = (-4..=4).map(|k| libm::exp2(f64::from(k) / 4.0)).collect();
        Self { steps: 128, columns_per_step: 3, rows: 48, scales, is_light_free: false }
    }
}

impl WarpingSettings {
    fn width(&self) -> usize {
        self.steps * self.columns_per_step
    }

    /// The plane whose scale is nearest.
    fn plane(&self, scale: f64) -> usize {
        let off = |k: &usize| (libm::log(scale.max(1e-9)) - libm::log(self.scales[*k])).abs();
        (0..self.scales.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }
}

/// A stretch of displacements u, columns, both ends included, that belong to one plane.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    from: usize,
    to: usize,
    plane: usize,
}

/// Displacements that a column `x` columns from the direction of the step may have.
fn stretches(settings: &WarpingSettings, x: usize) -> Vec<Stretch> {
    let width = settings.width();
    let angle = |columns: usize| TAU * columns as f64 / width as f64;
    let mut all: Vec<Stretch> = Vec::new();
    // Straight ahead and straight behind a column stays where it is, whatever its size.
    let most = if x == 0 || 2 * x >= width { 0 } else { width / 2 - x };
    for u in 0..=most {
        let scale = if most == 0 { 1.0 } else { sin_cos(angle(x + u)).0.max(0.0) / sin_cos(angle(x)).0 };
        let plane = settings.plane(scale);
        match all.last_mut() {
            Some(last) if last.plane == plane => last.to = u,
            _ => all.push(Stretch { from: u, to: u, plane }),
        }
    }
    all
}

/// Columns of a view at a scale: row by row, magnified about the horizon where the scale is above 1.
fn magnified(view: &Grey, scale: f64) -> Vec<u8> {
    let (width, height) = (view.width(), view.height());
    let horizon = view.projection.horizon_row - 0.5;
    let mut out = Vec::with_capacity(width * height);
    for row in 0..height {
        let from = (horizon + (row as f64 - horizon) / scale).clamp(0.0, height as f64 - 1.0);
        let upper = from as usize;
        let lower = (upper + 1).min(height - 1);
        let share = ((from - upper as f64) * 256.0) as u32;
        let rows = view.pixels[upper * width..(upper + 1) * width].iter().zip(&view.pixels[lower * width..(lower + 1) * width]);
        out.extend(rows.map(|(a, b)| ((u32::from(*a) * (256 - share) + u32::from(*b) * share + 128) >> 8) as u8));
    }
    out
}

/// Homing by MinWarping.
pub struct MinWarping {
    settings: WarpingSettings,
    home: Grey,
    /// Home at the scale of each plane.
    planes: Vec<Vec<u8>>,
    /// By distance from the direction of the step, columns.
    stretches: Vec<Vec<Stretch>>,
}

/// Scores of all directions and turns that were tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Scores {
    /// Directions, and turns.
    pub steps: usize,
    /// Scores, direction by direction, in each turn by turn.
    pub values: Vec<u32>,
}

impl Scores {
    /// The least score: direction of the step and turn since home, rad, each between its neighbours by a parabola.
    #[must_use]
    pub fn best(&self) -> (f64, f64) {
        let n = self.steps;
        let k = self.values.iter().enumerate().min_by_key(|(_, score)| **score).map_or(0, |(k, _)| k);
        let (d, turn) = (k / n, k % n);
        let fine = |at: &dyn Fn(usize) -> usize, middle: usize| {
            let [before, after] = [n - 1, 1].map(|step| f64::from(self.values[at((middle + step) % n)]));
            let bend = before - 2.0 * f64::from(self.values[k]) + after;
            let shift = if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
            wrap(TAU * (middle as f64 + shift) / n as f64)
        };
        (fine(&|d| d * n + turn, d), fine(&|turn| d * n + turn, turn))
    }
}

impl MinWarping {
    /// With this view at home.
    #[must_use]
    pub fn new(settings: WarpingSettings, home: &Panorama) -> Self {
        let home = prepared(&Grey::of(home), &settings);
        let planes = settings.scales.iter().map(|&s| if s > 1.0 { magnified(&home, s) } else { home.pixels.clone() }).collect();
        let stretches = (0..=settings.width() / 2).map(|x| stretches(&settings, x)).collect();
        Self { settings, home, planes, stretches }
    }

    /// The scores of a view of home's size.
    ///
    /// # Errors
    /// When it is of another size or projection.
    pub fn scores(&self, now: &Panorama) -> Result<Scores> {
        let now = prepared(&Grey::of(now), &self.settings);
        now.check_like(&self.home)?;
        let planes: Vec<Vec<u8>> =
            self.settings.scales.iter().map(|&s| if s > 1.0 { now.pixels.clone() } else { magnified(&now, 1.0 / s) }).collect();
        let n = self.settings.steps;
        let mut values = vec![0; n * n];
        search(self, &planes, &mut values);
        // Turns were counted backwards, so that memory is walked forwards.
        for row in values.chunks_exact_mut(n) {
            row.reverse();
        }
        Ok(Scores { steps: n, values })
    }
}

/// A view as wide as is searched, with no more rows than are compared.
fn prepared(view: &Grey, settings: &WarpingSettings) -> Grey {
    let mut view = view.resized(settings.width() as u32);
    let (width, height) = (view.width(), view.height());
    if height > settings.rows {
        let first =
            (view.projection.horizon_row - 0.5 * settings.rows as f64).round().clamp(0.0, (height - settings.rows) as f64);
        let first = first as usize;
        view.pixels = view.pixels[first * width..(first + settings.rows) * width].to_vec();
        view.projection.height = settings.rows as u32;
        view.projection.horizon_row -= first as f64;
    }
    if settings.is_light_free {
        view.pixels = light_free(&view);
    }
    view
}

/// Grey level that stands for a column's mean, and standard deviation of a whole view.
const MIDDLE: f64 = 128.0;
const CONTRAST: f64 = 40.0;

/// The pixels less the mean of their column, with the same standard deviation for every view.
fn light_free(view: &Grey) -> Vec<u8> {
    let (width, height) = (view.width(), view.height());
    let mut sums = vec![0_u32; width];
    for row in view.pixels.chunks_exact(width) {
        sums.iter_mut().zip(row).for_each(|(sum, pixel)| *sum += u32::from(*pixel));
    }
    let means: Vec<f64> = sums.iter().map(|sum| f64::from(*sum) / height as f64).collect();
    let off = |k: usize| f64::from(view.pixels[k]) - means[k % width];
    let squares: f64 = (0..view.pixels.len()).map(|k| off(k) * off(k)).sum();
    let gain = CONTRAST / (squares / view.pixels.len() as f64).sqrt().max(1.0);
    (0..view.pixels.len()).map(|k| (MIDDLE + gain * off(k)).round().clamp(0.0, 255.0) as u8).collect()
}

/// Adds up the scores; turns run backwards.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512bw+avx2+bmi1+bmi2+lzcnt+popcnt",
    "x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"
))]
fn search(warping: &MinWarping, planes: &[Vec<u8>], values: &mut [u32]) {
    let (settings, home) = (&warping.settings, &warping.home);
    let (n, per, width, height) = (settings.steps, settings.columns_per_step, home.width(), home.height());
    let levels = (width / 2).max(1).ilog2() as usize + 1;
    // Four times round, one column in `per` after another, so that turns lie side by side.
    let lane = 4 * n;
    let mut sums = vec![0_u16; width];
    let mut tables = vec![0_u16; planes.len() * levels * per * lane];
    let size = per * lane;
    let mut row = vec![0_u16; 4 * width];
    let mut wide = vec![0_u16; 4 * width];
    for i in 0..width {
        for (plane, pixels) in planes.iter().enumerate() {
            sums.fill(0);
            for r in 0..height {
                let kept = warping.planes[plane][r * width + i];
                for (sum, seen) in sums.iter_mut().zip(&pixels[r * width..(r + 1) * width]) {
                    *sum += u16::from(kept.abs_diff(*seen));
                }
            }
            for part in row.chunks_exact_mut(width) {
                part.copy_from_slice(&sums);
            }
            for level in 0..levels {
                let table = &mut tables[(plane * levels + level) * size..(plane * levels + level + 1) * size];
                for (residue, lane) in table.chunks_exact_mut(lane).enumerate() {
                    for (k, value) in lane.iter_mut().enumerate() {
                        *value = row[k * per + residue];
                    }
                }
                let step = 1 << level;
                wide.copy_from_slice(&row);
                for (value, after) in wide.iter_mut().zip(&row[step..]) {
                    *value = (*value).min(*after);
                }
                std::mem::swap(&mut row, &mut wide);
            }
        }
        for d in 0..n {
            // How far the column is from the direction of the step, and on which side.
            let x = (i + width - d * per) % width;
            let left = 2 * x <= width;
            let x = if left { x } else { width - x };
            let mut least = [u16::MAX; MOST_STEPS];
            let least = &mut least[..n];
            for stretch in &warping.stretches[x] {
                let (first, last) = if left {
                    (i + 2 * width + stretch.from, i + 2 * width + stretch.to)
                } else {
                    (i + 2 * width - stretch.to, i + 2 * width - stretch.from)
                };
                let level = (last - first + 1).ilog2() as usize;
                let table = &tables[(stretch.plane * levels + level) * size..(stretch.plane * levels + level + 1) * size];
                for start in [first, last + 1 - (1 << level)] {
                    // Turned by k steps, the stretch lies k steps farther right; k runs backwards from n - 1.
                    let start = start - (n - 1) * per;
                    let from = (start % per) * lane + start / per;
                    for (value, other) in least.iter_mut().zip(&table[from..from + n]) {
                        *value = (*value).min(*other);
                    }
                }
            }
            for (score, least) in values[d * n..(d + 1) * n].iter_mut().zip(&*least) {
                *score += u32::from(*least);
            }
        }
    }
}

/// Most directions and turns.
const MOST_STEPS: usize = 512;

impl Homing for MinWarping {
    fn look(&mut self, now: &Panorama) -> Result<Answer> {
        let (direction, turn) = self.scores(now)?.best();
        let angle = |rad: f64| Some(Angle { rad, sd_rad: None });
        Ok(Answer { turn: angle(turn), home: angle(wrap(direction + PI - turn)), ..Answer::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::random::Seed;
    use crate::render::{CpuRenderer, Renderer, Scene, View};
    use crate::world::World;
    use rand_pcg::rand_core::Rng;

    fn noise(width: u32, height: u32, name: &str) -> Panorama {
        let mut stream = Seed(8).stream(name);
        let mut panorama = Panorama::black(crate::panorama::Projection::new(width, height));
        for pixel in panorama.rgba.chunks_exact_mut(4) {
            let grey = stream.next_u32() as u8;
            pixel[..3].fill(grey);
        }
        panorama
    }

    /// Home and current view at a plane's scale, as they are compared: what appears smaller is magnified.
    fn scaled(home: &Grey, now: &Grey, scale: f64) -> [Vec<u8>; 2] {
        if scale > 1.0 {
            [magnified(home, scale), now.pixels.clone()]
        } else {
            [home.pixels.clone(), magnified(now, 1.0 / scale)]
        }
    }

    /// The scores as the equations have them, column by column and displacement by displacement.
    #[test]
    fn scores_are_those_of_the_plain_equations() {
        let settings = WarpingSettings { steps: 16, columns_per_step: 3, rows: 9, ..WarpingSettings::default() };
        let (home, now) = (noise(48, 9, "home"), noise(48, 9, "now"));
        let warping = MinWarping::new(settings.clone(), &home);
        let found = warping.scores(&now).unwrap();
        let (home, now) = (Grey::of(&home), Grey::of(&now));
        let pairs: Vec<[Vec<u8>; 2]> = settings.scales.iter().map(|&s| scaled(&home, &now, s)).collect();
        let difference = |plane: usize, i: usize, j: usize| -> u32 {
            (0..9).map(|row| u32::from(pairs[plane][0][row * 48 + i].abs_diff(pairs[plane][1][row * 48 + j]))).sum()
        };
        for d in 0..16 {
            for turn in 0..16 {
                let mut score = 0;
                for i in 0..48_i64 {
                    let x = (i - 3 * d as i64 + 24).rem_euclid(48) - 24;
                    let (side, x) = if x < 0 { (-1, -x) } else { (1, x) };
                    let most = if x == 0 || x == 24 { 0 } else { 24 - x };
                    let least = (0..=most).map(|u| {
                        let sine = |columns: i64| (TAU * columns as f64 / 48.0).sin();
                        let scale = if most == 0 { 1.0 } else { sine(x + u).max(0.0) / sine(x) };
                        let seen = (i + side * u - 3 * turn as i64).rem_euclid(48);
                        difference(settings.plane(scale), i as usize, seen as usize)
                    });
                    score += least.min().unwrap();
                }
                assert_eq!(found.values[d * 16 + turn], score, "direction {d}, turn {turn}");
            }
        }
    }

    #[test]
    fn brightness_and_contrast_are_taken_away() {
        let bright = noise(48, 9, "home");
        let mut dark = bright.clone();
        for (k, pixel) in dark.rgba.chunks_exact_mut(4).enumerate() {
            // Half as much light, and a lamp beside some columns.
            let lamp = if k % 48 < 20 { 60 } else { 10 };
            pixel[..3].iter_mut().for_each(|p| *p = *p / 2 + lamp);
        }
        let [bright, dark] = [bright, dark].map(|view| light_free(&Grey::of(&view)));
        let most = bright.iter().zip(&dark).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(most.is_some_and(|most| most <= 2), "{most:?}");
    }

    #[test]
    fn it_finds_the_way_home_in_a_room() {
        let world = World::open("lab").unwrap();
        let scene = Scene::new(&world).unwrap();
        let mut renderer = CpuRenderer::new();
        let mut take = |robot: Pose| {
            let projection = world.projection_of_size(384, 48);
            let mut seen = Panorama::black(projection);
            renderer.render(&scene, &View { projection, robot, bodies: &world.body_poses() }, &mut seen).unwrap();
            seen
        };
        let home = world.home;
        let mut warping = MinWarping::new(WarpingSettings::default(), &take(home));
        for (k, way) in [0.4_f64, 2.2, -2.5].into_iter().enumerate() {
            let now = home.compose(&Pose::new(0.7 * way.cos(), 0.7 * way.sin(), 1.1 * k as f64));
            let answer = warping.look(&take(now)).unwrap();
            let true_home = now.inverse_transform(home.position());
            let off = wrap(answer.home.unwrap().rad - crate::geometry::angle_of(true_home)).abs();
            assert!(off < 0.4 && wrap(answer.turn.unwrap().rad - 1.1 * k as f64).abs() < 0.1, "{way}: {off}, {answer:?}");
        }
        assert!(warping.look(&noise(384, 20, "low")).unwrap_err().to_string().contains("384 x 20"));
    }
}
