//! Landmark objects: neighbouring features clustered into one landmark, whose centre is the bearing.
//!
//! The literature on bearing-only homing speaks of few landmarks, each an object on which many features lie. Here an object is
//! a cluster of home features, and its bearing at home is the mean of their azimuths. Later some of its features are found
//! again. Their azimuths are those of home, moved and stretched,
//!
//! ```text
//! a_i = c + s u_i,                 u_i: how far the feature lies from the centre at home,
//! ```
//!
//! and c is where the centre is now. A mean of what happens to be found would jump with every feature that comes or goes; this
//! fit does not. The stretch s is held near the ratio of the features' scales, since few features fix it badly.

use crate::geometry::wrap;
use crate::observation::{Bearing, LandmarkId};

/// Standard deviation of the stretch around the ratio of scales, as a share of it: scales are rough, and a surface is seen at
/// another slant.
const STRETCH_SD: f64 = 0.3;
/// Features further off than this many standard deviations are left out of the fit.
const OUTLIER: f64 = 3.0;
/// What is known of an object's scatter before its features are seen: as if so many of them had this mean square in units of
/// their variance. Few features tell little of their own scatter.
const USUAL: (f64, f64) = (4.0, 2.5);
/// Fewest features that make an object's bearing.
const FEWEST: usize = 3;

/// A feature as the clustering sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Azimuth, rad.
    pub azimuth_rad: f64,
    /// Tangent of elevation.
    pub tan: f64,
    /// Standard deviation of the azimuth, rad.
    pub sd_rad: f64,
}

/// A home feature that was found again.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    /// Index of the home feature.
    pub feature: usize,
    /// Azimuth now, rad.
    pub azimuth_rad: f64,
    /// Standard deviation of azimuth now and at home together, rad.
    pub sd_rad: f64,
    /// Scale now over that at home.
    pub zoom: f64,
}

/// Clusters of home features.
#[derive(Debug, Clone, Default)]
pub(super) struct Objects {
    bearings: Vec<Bearing>,
    /// For each home feature its object and how far it lies from its centre, rad.
    member: Vec<Option<(usize, f64)>>,
}

impl Objects {
    /// Clusters the home features: where most lie within `radius_rad` of one another is the first object, what is left makes
    /// the next, as long as there are `fewest` together.
    pub fn new(places: &[Place], radius_rad: f64, fewest: usize) -> Self {
        let near = |a: &Place, b: &Place| {
            let (x, y) = (wrap(a.azimuth_rad - b.azimuth_rad), a.tan - b.tan);
            x * x + y * y <= radius_rad * radius_rad
        };
        let fewest = fewest.max(FEWEST);
        let mut objects = Self { bearings: Vec::new(), member: vec![None; places.len()] };
        let mut free = vec![true; places.len()];
        loop {
            let cluster = |k: usize| (0..places.len()).filter(|&j| free[j] && near(&places[k], &places[j])).collect::<Vec<_>>();
            let sizes = (0..places.len()).filter(|&k| free[k]).map(|k| (cluster(k).len(), k));
            // Of equally crowded places the first.
            let Some((size, centre)) = sizes.max_by_key(|&(size, k)| (size, std::cmp::Reverse(k))) else { break };
            if size < fewest {
                break;
            }
            let members = cluster(centre);
            let reference = places[centre].azimuth_rad;
            let count = members.len() as f64;
            let mean = members.iter().map(|&j| wrap(places[j].azimuth_rad - reference)).sum::<f64>() / count;
            let variance = members.iter().map(|&j| places[j].sd_rad * places[j].sd_rad).sum::<f64>() / (count * count);
            let azimuth_rad = wrap(reference + mean);
            for j in members {
                free[j] = false;
                objects.member[j] = Some((objects.bearings.len(), wrap(places[j].azimuth_rad - azimuth_rad)));
            }
            let id = LandmarkId(objects.bearings.len() as u32);
            objects.bearings.push(Bearing { id, azimuth_rad, sd_rad: variance.sqrt() });
        }
        objects
    }

    /// The bearings at home.
    pub fn home(&self) -> &[Bearing] {
        &self.bearings
    }

    /// Features of an object.
    pub fn members(&self, object: usize) -> Vec<usize> {
        let of = |member: &Option<(usize, f64)>| member.is_some_and(|(o, _)| o == object);
        (0..self.member.len()).filter(|&k| of(&self.member[k])).collect()
    }

    /// Bearings of the objects of which enough was found, in the order of their ids.
    pub fn bearings(&self, found: &[Found]) -> Vec<Bearing> {
        let mut sightings: Vec<Vec<Sighting>> = vec![Vec::new(); self.bearings.len()];
        for f in found {
            if let Some((object, offset)) = self.member[f.feature] {
                sightings[object].push(Sighting { offset, azimuth_rad: f.azimuth_rad, sd_rad: f.sd_rad, zoom: f.zoom });
            }
        }
        let centres = self.bearings.iter().zip(&sightings).filter_map(|(home, seen)| {
            let (azimuth_rad, sd_rad) = centre(seen)?;
            Some(Bearing { id: home.id, azimuth_rad, sd_rad })
        });
        centres.collect()
    }
}

/// A feature of one object.
#[derive(Debug, Clone, Copy)]
struct Sighting {
    offset: f64,
    azimuth_rad: f64,
    sd_rad: f64,
    zoom: f64,
}

/// Azimuth of an object's centre and its standard deviation.
fn centre(seen: &[Sighting]) -> Option<(f64, f64)> {
    let reference = seen.first()?.azimuth_rad;
    let mut zooms: Vec<f64> = seen.iter().map(|s| s.zoom).collect();
    zooms.sort_by(f64::total_cmp);
    let zoom = zooms[zooms.len() / 2];
    let residual = |fit: &Fit, s: &Sighting| wrap(s.azimuth_rad - reference) - fit.centre - fit.stretch * s.offset;
    let mut kept = seen.to_vec();
    loop {
        if kept.len() < FEWEST {
            return None;
        }
        let fit = Fit::new(&kept, reference, zoom);
        let chi2: f64 = kept.iter().map(|s| (residual(&fit, s) / s.sd_rad) * (residual(&fit, s) / s.sd_rad)).sum();
        // What lies at another depth moves otherwise than the rest: the scatter tells, and the stated deviation follows it.
        let scatter = (chi2 + USUAL.0 * USUAL.1) / ((kept.len() - 1) as f64 + USUAL.0);
        let limit = OUTLIER * OUTLIER * scatter;
        let worst = kept.iter().map(|s| (residual(&fit, s) / s.sd_rad).abs()).fold(0.0, f64::max);
        if worst * worst <= limit {
            return Some((wrap(reference + fit.centre), (fit.variance * scatter).sqrt()));
        }
        kept.retain(|s| (residual(&fit, s) / s.sd_rad).abs() < worst);
    }
}

/// Least squares for centre and stretch.
struct Fit {
    centre: f64,
    stretch: f64,
    /// Variance of the centre.
    variance: f64,
}

impl Fit {
    fn new(seen: &[Sighting], reference: f64, zoom: f64) -> Self {
        let prior = 1.0 / (STRETCH_SD * zoom * STRETCH_SD * zoom);
        let (mut w, mut wu, mut wuu, mut wa, mut wua) = (0.0, 0.0, prior, 0.0, prior * zoom);
        for s in seen {
            let weight = 1.0 / (s.sd_rad * s.sd_rad);
            let azimuth = wrap(s.azimuth_rad - reference);
            w += weight;
            wu += weight * s.offset;
            wuu += weight * s.offset * s.offset;
            wa += weight * azimuth;
            wua += weight * s.offset * azimuth;
        }
        let det = w * wuu - wu * wu; // positive: the prior sees to it
        Self { centre: (wa * wuu - wua * wu) / det, stretch: (w * wua - wu * wa) / det, variance: wuu / det }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places() -> Vec<Place> {
        let cluster = |azimuth: f64, count: u32| {
            (0..count).map(move |k| Place {
                azimuth_rad: wrap(azimuth + 0.01 * (f64::from(k) - 0.5 * f64::from(count - 1))),
                tan: 0.1,
                sd_rad: 0.001,
            })
        };
        cluster(3.13, 7).chain(cluster(1.0, 5)).chain(cluster(-1.0, 2)).collect()
    }

    #[test]
    fn crowds_become_objects_and_pairs_do_not() {
        let objects = Objects::new(&places(), 0.05, 4);
        let home = objects.home();
        assert_eq!(home.len(), 2);
        assert!(wrap(home[0].azimuth_rad - 3.13).abs() < 1e-12, "across the seam");
        assert!((home[1].azimuth_rad - 1.0).abs() < 1e-12);
        assert!((home[1].sd_rad - 0.001 / 5f64.sqrt()).abs() < 1e-12);
    }

    /// Whichever of its features are seen, an object that moved, came nearer and lost a feature to a wrong match is where it is.
    #[test]
    fn the_centre_does_not_depend_on_what_is_found() {
        let places = places();
        let objects = Objects::new(&places, 0.05, 4);
        let now = |k: usize| Found {
            feature: k,
            azimuth_rad: wrap(-0.4 + 1.3 * wrap(places[k].azimuth_rad - 3.13)),
            sd_rad: 0.001,
            zoom: 1.25,
        };
        let wrong = Found { azimuth_rad: -0.1, ..now(6) };
        for found in [vec![now(0), now(1), now(2)], vec![now(0), now(3), now(4), now(5), wrong], (0..7).map(now).collect()] {
            let seen = objects.bearings(&found);
            assert_eq!(seen.len(), 1);
            assert!((seen[0].azimuth_rad + 0.4).abs() < 3.0 * seen[0].sd_rad, "{seen:?}");
        }
        assert!(objects.bearings(&[now(0), now(1)]).is_empty(), "two features are no object");
    }
}
