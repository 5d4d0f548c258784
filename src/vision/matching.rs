//! Descriptor matching between the home panorama and the current one.
//!
//! The camera keeps its height, so a landmark's elevation and its scale change together: rows above the horizon over scale is
//! the landmark's height over its size, wherever it is seen from. And what is brighter than its surroundings stays so. Only
//! features that agree in both are compared at all, which saves most of the work and many wrong matches.

use std::ops::Range;

use multiversion::target::match_target;

#[cfg(target_arch = "x86_64")]
use super::describe::distance_avx2;
use super::describe::{Descriptor, UNRELATED, distance};
use super::detect::Feature;

/// Two features that may be the same landmark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    /// Index of the current feature.
    pub now: usize,
    /// Index of the home feature.
    pub home: usize,
    /// Descriptor distance, 0 (equal) to about 1 (unrelated).
    pub distance: f32,
}

/// A candidate that stands out from its rivals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    /// The candidate.
    pub candidate: Candidate,
    /// Its distance over that of the runner-up; small is distinct.
    pub ratio: f32,
}

/// The home features, ready to be compared: the dark ones, then the bright ones, each sorted by height over size.
#[derive(Debug, Clone, Default)]
pub(super) struct Gallery {
    entries: Vec<Entry>,
    /// Number of dark ones.
    dark: usize,
    plain: Vec<Descriptor>,
    /// Horizontally stretched descriptors, `variants` of each feature.
    stretched: Vec<Descriptor>,
    variants: usize,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    bright: bool,
    height_over_size: f32,
    sigma: f32,
    feature: usize,
}

/// Rows above the horizon in units of the scale.
fn height_over_size(feature: &Feature, horizon: f32) -> f32 {
    (horizon - feature.y) / feature.sigma
}

/// Whether a feature is brighter than its surroundings.
fn is_bright(feature: &Feature) -> bool {
    feature.response < 0.0
}

/// Largest change of scale between two sightings of a landmark.
const ZOOM: f32 = 4.5;
/// A plain descriptor this many times as far off as the limit is not worth stretching: that brings nearer what is related, not
/// what is unrelated.
const HOPELESS: f32 = 1.15;

impl Gallery {
    /// Describes every feature once plain and once for each of `stretches` by `describe(feature, stretch)`. `horizon` is the row of
    /// the horizon.
    pub fn new(features: &[Feature], stretches: &[f32], horizon: f32, describe: impl Fn(&Feature, f32) -> Descriptor) -> Self {
        let mut entries: Vec<_> = features
            .iter()
            .enumerate()
            .map(|(k, f)| Entry {
                bright: is_bright(f),
                height_over_size: height_over_size(f, horizon),
                sigma: f.sigma,
                feature: k,
            })
            .collect();
        let by_height = |a: &Entry, b: &Entry| a.height_over_size.total_cmp(&b.height_over_size);
        entries.sort_by(|a, b| a.bright.cmp(&b.bright).then_with(|| by_height(a, b)).then(a.feature.cmp(&b.feature)));
        let dark = entries.partition_point(|e| !e.bright);
        let plain = entries.iter().map(|e| describe(&features[e.feature], 1.0)).collect();
        let mut stretched = Vec::with_capacity(entries.len() * stretches.len());
        for entry in &entries {
            stretched.extend(stretches.iter().map(|s| describe(&features[entry.feature], *s)));
        }
        Self { entries, dark, plain, stretched, variants: stretches.len() }
    }

    /// Home features that agree in brightness with `feature`, and in height over size to within `slack` (an absolute and a
    /// relative part).
    fn alike(&self, feature: &Feature, horizon: f32, slack: (f32, f32)) -> Range<usize> {
        let height = height_over_size(feature, horizon);
        let reach = slack.0 + slack.1 * height.abs();
        let (start, class) =
            if is_bright(feature) { (self.dark, &self.entries[self.dark..]) } else { (0, &self.entries[..self.dark]) };
        let from = start + class.partition_point(|e| e.height_over_size < height - reach);
        let to = start + class.partition_point(|e| e.height_over_size <= height + reach);
        from..to
    }
}

/// The features of the current panorama as they are compared.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen<'a> {
    pub features: &'a [Feature],
    pub descriptors: &'a [Descriptor],
    /// Row of the horizon.
    pub horizon: f32,
}

/// Compares `some` of the current features with those home features that may be the same, which agree in height over size to within
/// `slack` (an absolute and a relative part). Candidates come grouped by current feature; those with a distance above `limit`
/// are left out.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2+bmi1+bmi2+lzcnt+popcnt",
    "x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"
))]
pub(super) fn compare(gallery: &Gallery, seen: Seen<'_>, some: Range<usize>, slack: (f32, f32), limit: f32) -> Vec<Candidate> {
    let distance = |a: &Descriptor, b: &Descriptor| {
        match_target! {
            "x86_64+avx2" => distance_avx2(a, b),
            _ => distance(a, b),
        }
    };
    let mut candidates = Vec::new();
    let hopeless = (HOPELESS * limit * UNRELATED) as u32;
    let limit = (limit * UNRELATED) as u32;
    for now in some {
        let (feature, descriptor) = (&seen.features[now], &seen.descriptors[now]);
        let sizes = feature.sigma / ZOOM..=feature.sigma * ZOOM;
        for k in gallery.alike(feature, seen.horizon, slack) {
            let entry = &gallery.entries[k];
            if !sizes.contains(&entry.sigma) {
                continue;
            }
            let mut best = distance(descriptor, &gallery.plain[k]);
            if best > hopeless {
                continue;
            }
            for variant in &gallery.stretched[k * gallery.variants..][..gallery.variants] {
                best = best.min(distance(descriptor, variant));
            }
            if best <= limit {
                candidates.push(Candidate { now, home: entry.feature, distance: best as f32 / UNRELATED });
            }
        }
    }
    candidates
}

/// The features of one of the two panoramas.
#[derive(Debug, Clone, Copy)]
pub(super) struct View<'a> {
    pub features: &'a [Feature],
    /// Columns of the panorama.
    pub width: f32,
}

impl View<'_> {
    /// Whether two features are the same blob, found twice.
    fn same_place(&self, i: usize, j: usize) -> bool {
        let (a, b) = (&self.features[i], &self.features[j]);
        let near = a.sigma.min(b.sigma);
        let apart = (a.x - b.x).abs();
        apart.min(self.width - apart) < near && (a.y - b.y).abs() < near
    }
}

/// Nearest neighbours both ways among the candidates that `allowed` lets pass, with a distance of at most `limit` and at most
/// `max_ratio` times the runner-up's. Rivals at the same place (a blob found twice) do not count against a match. Sorted from
/// the most to the least distinct.
pub(super) fn choose(
    candidates: &[Candidate],
    home: View<'_>,
    now: View<'_>,
    limit: f32,
    max_ratio: f32,
    allowed: impl Fn(&Candidate) -> bool,
) -> Vec<Choice> {
    let mut best_of_home: Vec<Option<Candidate>> = vec![None; home.features.len()];
    let mut choices = Vec::new();
    let mut passed = Vec::new();
    for group in candidates.chunk_by(|a, b| a.now == b.now) {
        passed.clear();
        passed.extend(group.iter().copied().filter(|c| allowed(c)));
        for candidate in &passed {
            let rival = &mut best_of_home[candidate.home];
            if rival.is_none_or(|r| candidate.distance < r.distance) {
                *rival = Some(*candidate);
            }
        }
        let Some(best) = passed.iter().copied().min_by(|a, b| a.distance.total_cmp(&b.distance)) else { continue };
        let others = passed.iter().filter(|c| !home.same_place(c.home, best.home));
        let second = others.map(|c| c.distance).fold(f32::INFINITY, f32::min);
        let choice = Choice { candidate: best, ratio: best.distance / second.max(1e-6) };
        if best.distance <= limit && choice.ratio <= max_ratio {
            choices.push(choice);
        }
    }
    choices.retain(|c| {
        let best = best_of_home[c.candidate.home];
        best.is_some_and(|b| b.now == c.candidate.now || now.same_place(b.now, c.candidate.now))
    });
    // Each home feature once, with its nearest.
    let by_distance = |a: &Candidate, b: &Candidate| a.distance.total_cmp(&b.distance).then(a.now.cmp(&b.now));
    choices.sort_by(|a, b| a.candidate.home.cmp(&b.candidate.home).then_with(|| by_distance(&a.candidate, &b.candidate)));
    choices.dedup_by_key(|c| c.candidate.home);
    choices.sort_by(|a, b| a.ratio.total_cmp(&b.ratio).then(a.candidate.home.cmp(&b.candidate.home)));
    choices
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever instruction computes them, distances are sums of absolute differences.
    #[test]
    fn distances_sum_absolute_differences() {
        let feature = Feature { x: 5.0, y: 3.0, sigma: 2.0, octave: 0, level: 0, response: 1.0, looseness: 1.0 };
        let home: Descriptor = std::array::from_fn(|k| (37 * k % 251) as u8);
        let now: Descriptor = std::array::from_fn(|k| (101 * k % 256) as u8);
        let sum: i32 = home.iter().zip(&now).map(|(a, b)| (i32::from(*a) - i32::from(*b)).abs()).sum();
        let gallery = Gallery::new(&[feature], &[], 0.0, |_, _| home);
        let seen = Seen { features: &[feature], descriptors: &[now], horizon: 0.0 };
        let candidates = compare(&gallery, seen, 0..1, (1.0, 0.0), 2.0 * sum as f32 / UNRELATED);
        assert_eq!(candidates, [Candidate { now: 0, home: 0, distance: sum as f32 / UNRELATED }]);
    }
}
