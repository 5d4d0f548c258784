//! Observability over a room, along paths, and for sets of landmarks: where the paper's rank condition holds and how well.

use rayon::prelude::*;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::estimation::observability::{Observability, observability};
use crate::geometry::{Pose, Vector2, angle_of, direction};
use crate::random::Seed;
use crate::sensor::{IdealSensor, Sensor};
use crate::statistics::mean;
use crate::world::World;
use crate::world::polygon::{bounds, contains};

/// Conditions above this count as degenerate in practice: an error of a thousandth of a degree a second is then one of a degree.
pub const DEGENERATE: f64 = 1000.0;
/// Headings tried at a place where the best and the median one are wanted.
const HEADINGS: usize = 72;

/// The condition is taken this far off a cell's middle, m: on the line through home and a landmark the model divides zero by zero,
/// and round numbers meet such lines where nothing else would.
const OFF: Vector2<f64> = Vector2::new(1.1e-3, 0.7e-3);

/// How the robot faces at each place of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Facing {
    /// Towards home, as it does on its way.
    Homeward,
    /// One heading everywhere, rad in the room.
    Heading(f64),
}

/// One place of a map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PlaceObservability {
    /// x in the room, m.
    pub x_m: f64,
    /// y in the room, m.
    pub y_m: f64,
    /// Landmarks that are seen from here and from home.
    pub landmarks: usize,
    /// Rank of O beyond the bearings themselves, 3 at most.
    pub rank: usize,
    /// Condition of [J K P]; infinite where it is singular, which JSON shows as null.
    pub condition: f64,
    /// The least over all headings.
    pub best_condition: f64,
    /// The median over all headings.
    pub median_condition: f64,
}

/// A map of a world.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObservabilityMap {
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file.
    pub world_sha256: String,
    /// Distance between places, m.
    pub spacing_m: f64,
    /// Landmarks that are seen from home.
    pub home_landmarks: usize,
    /// The length that R is measured in, the mean distance of those landmarks from home, m.
    pub length_m: f64,
    /// All places in the room.
    pub places: Vec<PlaceObservability>,
}

impl ObservabilityMap {
    /// Share of the places whose condition is above [`DEGENERATE`].
    pub fn degenerate_share(&self) -> f64 {
        degenerate_share(self.places.iter().map(|p| p.condition))
    }

    /// A quantile of the condition over the places.
    pub fn condition_quantile(&self, share: f64) -> f64 {
        ranked(self.places.iter().map(|p| p.condition), share)
    }
}

/// Share of conditions above [`DEGENERATE`]; 0 of none.
fn degenerate_share(conditions: impl Iterator<Item = f64>) -> f64 {
    mean(conditions.map(|c| if c > DEGENERATE || c.is_nan() { 1.0 } else { 0.0 })).unwrap_or(0.0)
}

/// A quantile that is one of the values, because between infinite ones nothing can be interpolated. NaN of none.
pub fn ranked(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    sorted.get((share.clamp(0.0, 1.0) * last as f64).round() as usize).copied().unwrap_or(f64::NAN)
}

/// Maps a world: at every place of an even grid in the room, the landmarks that are seen there and were seen at home.
///
/// # Errors
/// When the spacing gives no place or more than 250,000, or home sees fewer than three landmarks.
pub fn map(world: &World, facing: Facing, spacing_m: f64) -> Result<ObservabilityMap> {
    let (low, high) = bounds(&world.outline);
    let count = |length: f64| (length / spacing_m).floor();
    let (columns, rows) = (count(high.x - low.x), count(high.y - low.y));
    if !(spacing_m > 0.0 && columns * rows >= 1.0 && columns * rows <= 250_000.0) {
        return Err(Error::Invalid {
            what: "distance between places".into(),
            found: format!("{spacing_m} m"),
            allowed: "one that gives 1 to 250000 places".into(),
        });
    }
    let bodies = world.body_poses();
    let at_home = IdealSensor::new(world).home().clone();
    let seen_at_home: Vec<(u32, Vector2<f64>)> =
        at_home.bearings.iter().map(|b| (b.id.0, world.home.inverse_transform(bodies[b.id.0 as usize].position()))).collect();
    if seen_at_home.len() < 3 {
        return Err(Error::Unfit {
            what: format!("landmarks of world `{}` that home sees", world.spec.name),
            found: seen_at_home.len().to_string(),
            needed: "at least 3".into(),
        });
    }
    let length_m = mean(seen_at_home.iter().map(|(_, l)| l.norm())).unwrap_or_default();
    // Middles of cells that fill the room evenly.
    let centre = 0.5 * (low + high);
    let middle = |k: usize, count: f64, centre: f64| centre + (k as f64 - 0.5 * (count - 1.0)) * spacing_m;
    let points: Vec<Vector2<f64>> = (0..rows as usize)
        .flat_map(|row| (0..columns as usize).map(move |column| (row, column)))
        .map(|(row, column)| Vector2::new(middle(column, columns, centre.x), middle(row, rows, centre.y)))
        .filter(|point| contains(&world.outline, *point))
        .collect();
    let place = |point: &Vector2<f64>| -> Result<PlaceObservability> {
        let mut sensor = IdealSensor::new(world);
        let seen = sensor.observe(Pose::new(point.x, point.y, 0.0), &bodies)?;
        let landmarks: Vec<Vector2<f64>> =
            seen_at_home.iter().filter(|(id, _)| seen.iter().any(|b| b.id.0 == *id)).map(|(_, l)| *l).collect();
        let local = world.home.inverse_transform(*point + OFF);
        let at = |heading: f64| observability(&Pose::new(local.x, local.y, heading), &landmarks, true, length_m);
        let here = at(match facing {
            Facing::Homeward => angle_of(-local),
            Facing::Heading(heading) => heading - world.home.heading,
        });
        let all: Vec<f64> =
            (0..HEADINGS).map(|k| at(k as f64 * std::f64::consts::TAU / HEADINGS as f64 + 0.01).condition).collect();
        Ok(PlaceObservability {
            x_m: point.x,
            y_m: point.y,
            landmarks: landmarks.len(),
            rank: here.rank - landmarks.len(),
            condition: here.condition,
            best_condition: all.iter().copied().fold(f64::INFINITY, f64::min),
            median_condition: ranked(all.iter().copied(), 0.5),
        })
    };
    Ok(ObservabilityMap {
        world: world.spec.name.clone(),
        world_sha256: world.sha256.clone(),
        spacing_m,
        home_landmarks: seen_at_home.len(),
        length_m,
        places: points.par_iter().map(place).collect::<Result<_>>()?,
    })
}

/// The degenerate cases one by one, each with what is special about it: at P2 of the paper's ideal setting but for what it says.
pub fn cases(landmarks: &[Vector2<f64>; 3], usual: Pose) -> [(&'static str, Observability); 10] {
    let length_m = mean(landmarks.iter().map(|l| l.norm())).unwrap_or_default();
    let among = |landmarks: &[Vector2<f64>], pose: Pose| observability(&pose, landmarks, true, length_m);
    let at = |pose: Pose| among(landmarks, pose);
    let p = usual.position();
    let facing = |heading: f64| Pose::new(p.x, p.y, heading);
    let towards = angle_of(landmarks[1] - p);
    let standing = |p: Vector2<f64>| Pose::new(p.x, p.y, usual.heading);
    // Two landmarks in line with the robot: the second is put behind the first.
    let aligned = [landmarks[0], p + (landmarks[0] - p) * 1.7, landmarks[2]];
    [
        ("as it is at P2", at(usual)),
        ("at rest, turning or not (v = 0)", observability(&usual, landmarks, false, length_m)),
        ("driving towards landmark 2", at(facing(towards))),
        ("driving away from landmark 2", at(facing(towards + std::f64::consts::PI))),
        ("0.1 degrees off landmark 2", at(facing(towards + 0.1_f64.to_radians()))),
        ("on the line through home and landmark 1, behind home", at(standing(-landmarks[0] * 0.5))),
        ("at home", at(standing(Vector2::zeros()))),
        ("1 cm from home", at(standing(p / p.norm() * 0.01))),
        ("two landmarks in line with the robot", among(&aligned, usual)),
        ("landmarks 100 times as far away", among(&landmarks.map(|l| l * 100.0), usual)),
    ]
}

/// A set of landmarks and how well the state can be told among them.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    /// How many landmarks, evenly over an arc.
    pub count: usize,
    /// The arc as seen from home, rad.
    pub arc_rad: f64,
    /// Their distance from home, m.
    pub range_m: f64,
    /// Median of the condition over random poses.
    pub median: f64,
    /// Share of poses with a condition above [`DEGENERATE`].
    pub degenerate_share: f64,
}

/// Poses that a geometry is judged by.
const POSES: u64 = 400;

/// Sets of landmarks, judged over the same random poses 0.3 to 1.2 m from home. Lengths are measured in metres.
pub fn geometries() -> Vec<Geometry> {
    use rand::RngExt;
    use std::f64::consts::TAU;
    let mut stream = Seed(0).stream("observability poses");
    let mut pose = |_| {
        let [r, theta, alpha] = std::array::from_fn(|_| stream.random::<f64>());
        let at = direction(TAU * theta) * (0.3 + 0.9 * r);
        Pose::new(at.x, at.y, TAU * alpha)
    };
    let poses: Vec<Pose> = (0..POSES).map(&mut pose).collect();
    let judge = |(count, arc_rad, range_m): (usize, f64, f64)| {
        // A full turn has no two ends: there the last one does not fall on the first.
        let step = if arc_rad < TAU { arc_rad / (count as f64 - 1.0) } else { arc_rad / count as f64 };
        let landmarks: Vec<Vector2<f64>> = (0..count).map(|k| direction(0.2 + k as f64 * step) * range_m).collect();
        let conditions = || poses.iter().map(|pose| observability(pose, &landmarks, true, 1.0).condition);
        Geometry {
            count,
            arc_rad,
            range_m,
            median: ranked(conditions(), 0.5),
            degenerate_share: degenerate_share(conditions()),
        }
    };
    let full = [(3, TAU, 1.5), (3, TAU, 3.0), (3, TAU, 6.0), (3, TAU, 20.0)];
    let others = [(3, TAU / 4.0, 3.0), (3, TAU / 24.0, 3.0), (8, TAU, 3.0), (20, TAU, 3.0)];
    full.into_iter().chain(others).map(judge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_covers_the_room_and_degenerates_where_it_must() {
        let world = World::open("paper-ideal").unwrap();
        let map = map(&world, Facing::Homeward, 0.25).unwrap();
        assert_eq!(map.places.len(), 400);
        assert_eq!((map.home_landmarks, map.places[0].landmarks), (3, 3));
        // Around home it is worse than half way out.
        let near = |x: f64, y: f64| {
            map.places.iter().min_by(|a, b| {
                let d = |p: &PlaceObservability| (p.x_m - x) * (p.x_m - x) + (p.y_m - y) * (p.y_m - y);
                d(a).total_cmp(&d(b))
            })
        };
        assert!(near(-0.9, 0.9).unwrap().condition < DEGENERATE);
        assert!(map.places.iter().all(|p| p.best_condition <= p.median_condition));
        assert!(super::map(&world, Facing::Homeward, 0.0).is_err() && super::map(&world, Facing::Homeward, 99.0).is_err());
    }

    #[test]
    fn landmarks_all_round_and_near_tell_most() {
        let all = geometries();
        assert!(all[0].median < all[3].median && all[6].median < all[5].median, "{all:?}");
    }
}
