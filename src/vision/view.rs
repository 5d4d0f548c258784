//! Views: the features of a panorama as a chain of snapshots keeps and compares them.
//!
//! The [`Extractor`](super::Extractor) belongs to one home. A route has a snapshot every metre or so, each of which is looked for in the
//! same picture; so here the features of a picture are found once ([`ViewFinder::look`]) and held against as many snapshots as is
//! liked: near a place that is known, feature by feature within a window of azimuth and elevation ([`ViewFinder::find`]); where nothing is
//! known, all against all, checked by the one planar motion that must explain them ([`ViewFinder::compare`]).

use crate::geometry::{direction, wrap};
use crate::panorama::{Panorama, Projection};
use crate::random::Seed;

use super::ExtractorSettings;
use super::describe::{Describer, Descriptor, LENGTH, UNRELATED, distance};
use super::detect::{self, Criteria, Feature};
use super::motion::{self, Chance, Pair, Sight};
use super::pyramid::Pyramid;

/// A feature of a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewFeature {
    /// Azimuth from the robot's heading, rad, in (-pi, pi].
    pub azimuth_rad: f64,
    /// Tangent of elevation.
    pub tan: f64,
    /// Scale: standard deviation of the Gaussian that fits the blob, rad.
    pub scale_rad: f64,
    /// How loosely the blob fixes its own azimuth; 1 for a round one.
    pub looseness: f64,
    /// Whether it is brighter than its surroundings.
    pub is_bright: bool,
    /// Strength, grey levels of 255.
    pub strength: f64,
    /// What its surroundings look like.
    pub descriptor: [u8; LENGTH],
}

/// Where a feature of a snapshot is expected in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// Azimuth, rad.
    pub azimuth_rad: f64,
    /// Half width of the window around it, rad.
    pub window_rad: f64,
    /// Range at the snapshot over range now: tangent of elevation and scale change by this factor.
    pub zoom: f64,
    /// Factor by which that may be wrong, either way.
    pub zoom_slack: f64,
}

/// A feature of a snapshot found in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighted {
    /// Index in the view.
    pub now: usize,
    /// Descriptor distance, 0 (equal) to about 1 (unrelated).
    pub distance: f64,
}

/// A snapshot that a view was compared with as a whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreement {
    /// Direction from the snapshot's place to that of the view, in the snapshot's frame, rad; it means nothing where they coincide.
    pub direction_rad: f64,
    /// Heading of the view in the snapshot's frame, rad.
    pub turn_rad: f64,
    /// Features of the snapshot and of the view that the motion explains.
    pub matches: Vec<(usize, usize)>,
    /// Natural logarithm of how many motions chance would bring that explain as many.
    pub log_false_alarms: f64,
}

/// Finds the features of panoramas, and those of snapshots among them.
pub struct ViewFinder {
    settings: ExtractorSettings,
    criteria: Criteria,
    describer: Describer,
    pyramid: Pyramid,
    found: Vec<Feature>,
    view: Vec<ViewFeature>,
    pixel_rad: f64,
}

/// Largest descriptor distance of a feature that is found where it was expected.
const DISTANCE: f64 = 0.55;
/// Largest ratio of it to the runner-up's within the window.
const RATIO: f64 = 0.92;
/// Tolerance in tangent of elevation that does not depend on the zoom.
const TAN_SLACK: f64 = 0.02;

impl ViewFinder {
    /// One that keeps at most `features` of each panorama.
    #[must_use]
    pub fn new(settings: ExtractorSettings, features: usize) -> Self {
        let criteria = Criteria {
            contrast: settings.contrast,
            edge_ratio: settings.edge_ratio,
            spread_rad: settings.spread_rad,
            limit: features,
            contenders: settings.contenders(features),
        };
        Self {
            settings,
            criteria,
            describer: Describer::new(),
            pyramid: Pyramid::default(),
            found: Vec::new(),
            view: Vec::new(),
            pixel_rad: 1.0,
        }
    }

    /// The features of a panorama, by rising azimuth.
    pub fn look(&mut self, now: &Panorama) -> &[ViewFeature] {
        let settings = &self.settings;
        self.pyramid.build(now, settings.octaves);
        let mut hopeless = detect::detect(&self.pyramid, &self.criteria, &mut self.found);
        if hopeless == 0.0 && self.criteria.contrast > settings.contrast {
            self.criteria.contrast = settings.contrast; // a poorer view, or darker light
            hopeless = detect::detect(&self.pyramid, &self.criteria, &mut self.found);
        }
        // The next view shows much the same surfaces: what is far too weak here need not be looked at there.
        self.criteria.contrast = settings.contrast.max(0.6 * hopeless);
        let projection = now.projection;
        self.pixel_rad = projection.pixel_rad();
        let (describer, pyramid) = (&self.describer, &self.pyramid);
        let cell = settings.cell;
        self.view.clear();
        self.view.extend(self.found.iter().map(|f| kept(f, &projection, describer.describe(pyramid, f, cell, 1.0))));
        self.view.sort_by(|a, b| a.azimuth_rad.total_cmp(&b.azimuth_rad).then(a.tan.total_cmp(&b.tan)));
        &self.view
    }

    /// Takes features that were found earlier, in panoramas with pixels of this angle, for those of the last panorama.
    pub fn recall(&mut self, features: Vec<ViewFeature>, pixel_rad: f64) {
        self.view = features;
        self.view.sort_by(|a, b| a.azimuth_rad.total_cmp(&b.azimuth_rad).then(a.tan.total_cmp(&b.tan)));
        self.pixel_rad = pixel_rad;
    }

    /// The features of the last panorama, by rising azimuth.
    #[must_use]
    pub fn view(&self) -> &[ViewFeature] {
        &self.view
    }

    /// Standard deviation of a feature's azimuth, rad, given the descriptor distance to what it is taken for.
    #[must_use]
    pub fn sd_rad(&self, feature: &ViewFeature, distance: f64) -> f64 {
        let settings = &self.settings;
        let size = feature.scale_rad / self.pixel_rad * feature.looseness;
        let own = settings.sd_per_scale * size;
        let changed = settings.sd_per_scale_and_distance * distance * size;
        let sharp = settings.sd_px * settings.sd_px + own * own + changed * changed;
        (settings.usual_misfit * sharp).sqrt() * self.pixel_rad
    }

    /// Looks for a feature of a snapshot where it is expected in the last panorama; `None` where nothing there looks like it, or two
    /// things do.
    #[must_use]
    pub fn find(&self, feature: &ViewFeature, expected: &Expected) -> Option<Sighted> {
        let mut best: Option<(u32, usize)> = None;
        let mut second = u32::MAX;
        let window = expected.window_rad.min(std::f64::consts::PI);
        let (tan, scale) = (feature.tan * expected.zoom, feature.scale_rad * expected.zoom);
        let reach = tan.abs() * (expected.zoom_slack - 1.0) + TAN_SLACK;
        let sizes = scale / (1.35 * expected.zoom_slack)..=scale * 1.35 * expected.zoom_slack;
        let mut judge = |k: usize, now: &ViewFeature| {
            if now.is_bright != feature.is_bright || (now.tan - tan).abs() > reach || !sizes.contains(&now.scale_rad) {
                return;
            }
            let d = distance(&feature.descriptor, &now.descriptor);
            match best {
                Some((least, at)) if d >= least => {
                    if !same_place(&self.view[at], now) {
                        second = second.min(d);
                    }
                }
                _ => {
                    if let Some((least, at)) = best
                        && !same_place(&self.view[at], now)
                    {
                        second = second.min(least);
                    }
                    best = Some((d, k));
                }
            }
        };
        let low = wrap(expected.azimuth_rad - window);
        let from = self.view.partition_point(|f| f.azimuth_rad < low);
        for j in 0..self.view.len() {
            let k = (from + j) % self.view.len();
            let now = &self.view[k];
            if wrap(now.azimuth_rad - expected.azimuth_rad).abs() > window {
                break;
            }
            judge(k, now);
        }
        let (least, now) = best?;
        let share = f64::from(least) / f64::from(UNRELATED);
        (share <= DISTANCE && f64::from(least) <= RATIO * f64::from(second)).then_some(Sighted { now, distance: share })
    }

    /// Holds a snapshot against the last panorama as a whole, whichever way the robot faces. `None` where no motion explains three
    /// matches.
    #[must_use]
    pub fn compare(&self, snapshot: &[ViewFeature]) -> Option<Agreement> {
        let settings = &self.settings;
        let limit = (settings.distance * UNRELATED) as u32;
        let mut of_snapshot = vec![(u32::MAX, usize::MAX); snapshot.len()];
        let mut matches = Vec::new();
        for (k, now) in self.view.iter().enumerate() {
            let (mut best, mut second) = ((u32::MAX, 0), u32::MAX);
            for (j, feature) in snapshot.iter().enumerate() {
                if feature.is_bright != now.is_bright || !alike_in_height(feature, now, settings.height_slack) {
                    continue;
                }
                let d = distance(&feature.descriptor, &now.descriptor);
                if d < best.0 {
                    if best.0 < second && !same_place(&snapshot[best.1], feature) {
                        second = best.0;
                    }
                    best = (d, j);
                } else if d < second && !same_place(&snapshot[best.1], feature) {
                    second = d;
                }
                if d < of_snapshot[j].0 {
                    of_snapshot[j] = (d, k);
                }
            }
            if best.0 <= limit && best.0 as f32 <= settings.ratio * second as f32 {
                matches.push((best.0 as f32 / second.max(1) as f32, best.1, k));
            }
        }
        matches.retain(|(_, j, k)| of_snapshot[*j].1 == *k);
        matches.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let pairs: Vec<Pair> =
            matches.iter().map(|(_, j, k)| Pair { home: self.sight(&snapshot[*j]), now: self.sight(&self.view[*k]) }).collect();
        let seed = Seed(settings.seed);
        let motion = motion::estimate(&pairs, settings.draws, seed)?;
        let motion = motion::polish(&pairs, motion);
        let frame = motion.frame();
        let right = matches.iter().zip(&pairs).filter(|(_, pair)| frame.fit(&pair.home, &pair.now).is_good());
        let matches: Vec<(usize, usize)> = right.map(|((_, j, k), _)| (*j, *k)).collect();
        let log_false_alarms = Chance::of(&pairs, seed).log_false_alarms(matches.len());
        Some(Agreement { direction_rad: motion.direction_rad, turn_rad: motion.turn_rad, matches, log_false_alarms })
    }

    fn sight(&self, feature: &ViewFeature) -> Sight {
        let pixel = self.pixel_rad;
        let scaled = self.settings.check_per_scale * feature.scale_rad / pixel;
        Sight {
            unit: direction(feature.azimuth_rad),
            tan: feature.tan,
            variance: (self.settings.check_px * self.settings.check_px + scaled * scaled) * pixel * pixel,
            scale: feature.scale_rad,
        }
    }
}

fn kept(feature: &Feature, projection: &Projection, descriptor: Descriptor) -> ViewFeature {
    ViewFeature {
        azimuth_rad: projection.azimuth(f64::from(feature.x)),
        tan: projection.tan_elevation(f64::from(feature.y)),
        scale_rad: f64::from(feature.sigma) * projection.pixel_rad(),
        looseness: f64::from(feature.looseness),
        is_bright: feature.response < 0.0,
        strength: f64::from(feature.response.abs()),
        descriptor,
    }
}

/// Whether two features are the same blob, found twice.
fn same_place(a: &ViewFeature, b: &ViewFeature) -> bool {
    let near = a.scale_rad.min(b.scale_rad);
    wrap(a.azimuth_rad - b.azimuth_rad).abs() < near && (a.tan - b.tan).abs() < near
}

/// Whether heights over sizes agree to within an absolute and a relative part, and the sizes do by far.
fn alike_in_height(a: &ViewFeature, b: &ViewFeature, slack: (f32, f32)) -> bool {
    let (of_a, of_b) = (a.tan / a.scale_rad, b.tan / b.scale_rad);
    let zoom = a.scale_rad / b.scale_rad;
    (of_a - of_b).abs() <= f64::from(slack.0) + f64::from(slack.1) * of_b.abs() && (0.22..=4.5).contains(&zoom)
}
