//! Does a world make sense? Checks of values and of places, after the file's form is known to be right.
//!
//! Checks run in two passes. The first looks at each value by itself: sizes, ranges, names, polygons. The second looks at
//! places, where things stand relative to one another, and leaves out whatever the first found fault with, so that one slip
//! of the pen gives one message and not ten.

mod bodies;
mod camera;
mod light;
mod robot;
mod room;
mod starts;
mod walls;

use std::path::Path;

use super::picture::Pictures;
use super::polygon::{edges, reflex_corner, self_intersection, signed_area};
use super::{World, WorldSpec};
use crate::fault::Fault;
use crate::geometry::Vector2;

/// How deep a body may stand in a wall or another body, and how far outside the room a zone's corner may lie, m. Contact is
/// allowed, and decimal fractions don't always meet exactly.
const TOLERANCE_M: f64 = 1e-3;

/// The least length of anything that has a size, m.
const LEAST_SIZE_M: f64 = 5e-3;

/// Greatest coordinate or length, m: beyond, the f32 of physics and renderers no longer resolves a millimetre.
const GREATEST_M: f64 = 1000.0;

/// All faults of a world's values and places. `known` are the faults of its form, found before; no fault is told twice.
pub(super) fn check(spec: &WorldSpec, known: &[Fault]) -> Vec<Fault> {
    let mut faults = Faults { known: known.to_vec(), found: Vec::new() };
    check_name(spec, &mut faults);
    room::check_values(spec, &mut faults);
    walls::check_values(spec, &mut faults);
    bodies::check_values(spec, &mut faults);
    light::check_values(spec, &mut faults);
    camera::check(spec, &mut faults);
    robot::check(spec, &mut faults);
    starts::check_values(spec, &mut faults);
    starts::check_disturbances(spec, &mut faults);
    if faults.touch("room.outline_m") || spec.room.walls.is_empty() {
        return faults.found; // without a room nothing has a place
    }
    // Geometry comes from the resolved form, the same that a run uses. Bodies and walls with faulty geometry are left out of it.
    let mut world = World::resolve(spec.clone(), Path::new(""), String::new(), &Pictures::default());
    let mut places = Vec::new();
    let mut sound = Vec::new();
    for place in bodies::places(spec) {
        sound.push(!bodies::GEOMETRY.iter().any(|field| faults.touch(&format!("{place}.{field}"))));
        places.push(place);
    }
    let mut keep = sound.iter();
    world.bodies.retain(|_| *keep.next().unwrap_or(&false));
    let mut keep = sound.iter();
    places.retain(|_| *keep.next().unwrap_or(&false));

    let sound: Vec<usize> = (0..spec.walls.len()).filter(|&k| walls::is_sound(k, &faults)).collect();
    let mut number = 0..;
    world.partitions.retain(|_| number.next().is_some_and(|k| sound.binary_search(&k).is_ok()));
    world.index();

    room::check_places(&world, &mut faults);
    walls::check_places(&world, &sound, &mut faults);
    light::check_places(&world, &mut faults);
    bodies::check_places(&world, &places, &mut faults);
    starts::check_places(&world, &mut faults);
    faults.found
}

/// The name becomes part of a folder's name.
fn check_name(spec: &WorldSpec, faults: &mut Faults) {
    let mut letters = spec.name.chars();
    let plain = |c: char| c.is_ascii_alphanumeric();
    let good = letters.next().is_some_and(plain) && letters.all(|c| plain(c) || "-_.".contains(c)) && spec.name.len() <= 64;
    faults.unless(good, "name", format!("\"{}\"", spec.name), "1 to 64 letters, digits, '-', '_' and '.', the first no sign");
}

/// Collects faults, each place once.
struct Faults {
    known: Vec<Fault>,
    found: Vec<Fault>,
}

impl Faults {
    /// Records a fault, unless its place, or a part of it, is known to be at fault already.
    fn add(&mut self, place: impl Into<String>, found: impl Into<String>, allowed: impl Into<String>) {
        let place = place.into();
        if !self.known.iter().any(|f| is_part(&f.place, &place) || is_part(&place, &f.place)) {
            self.found.push(Fault { place, found: found.into(), allowed: allowed.into(), owner: None, line: None });
        }
    }

    /// Records a fault where `good` does not hold.
    fn unless(&mut self, good: bool, place: impl Into<String>, found: impl Into<String>, allowed: impl Into<String>) {
        if !good {
            self.add(place, found, allowed);
        }
    }

    /// Whether a fault lies at `place` or below it.
    fn touch(&self, place: &str) -> bool {
        self.known.iter().chain(&self.found).any(|f| is_part(&f.place, place))
    }

    /// Asks for `low <= value <= high`. NaN is outside.
    fn between(&mut self, place: impl Into<String>, value: f64, low: f64, high: f64) {
        self.unless(value >= low && value <= high, place, value.to_string(), format!("{low} to {high}"));
    }

    /// Asks for `0 < value <= most`.
    fn positive(&mut self, place: impl Into<String>, value: f64, most: f64) {
        self.unless(value > 0.0 && value <= most, place, value.to_string(), format!("more than 0, at most {most}"));
    }

    /// Asks for a length that something of its own can have.
    fn size(&mut self, place: impl Into<String>, value: f64) {
        self.between(place, value, LEAST_SIZE_M, GREATEST_M);
    }

    /// Asks for coordinates within the range that the engines resolve.
    fn point(&mut self, place: &str, point: &[f64]) {
        for (k, value) in point.iter().enumerate() {
            self.between(format!("{place}[{k}]"), *value, -GREATEST_M, GREATEST_M);
        }
    }

    /// Asks for a simple polygon that encloses something, and a convex one where `convex`.
    fn polygon(&mut self, place: &str, corners: &[[f64; 2]], convex: bool) {
        if corners.len() < 3 {
            return self.add(place, format!("{} corners", corners.len()), "at least 3 corners");
        }
        for (k, corner) in corners.iter().enumerate() {
            self.point(&format!("{place}[{k}]"), corner);
        }
        if self.touch(place) {
            return;
        }
        let points: Vec<Vector2<f64>> = corners.iter().map(|&[x, y]| Vector2::new(x, y)).collect();
        let twice = edges(&points).position(|(a, b)| (b - a).norm() < TOLERANCE_M);
        let area = signed_area(&points).abs();
        if let Some(k) = twice {
            let found = format!("the same point as corner {}", (k + 1) % points.len());
            self.add(format!("{place}[{k}]"), found, "neighbouring corners at least 1 mm apart");
        } else if let Some((k, l)) = self_intersection(&points) {
            let found = format!("edge {k} meets edge {l} (an edge has the number of its first corner)");
            self.add(place, found, "a simple polygon: edges meet only at shared corners");
        } else if area < LEAST_SIZE_M * LEAST_SIZE_M {
            self.add(place, format!("an area of {area} m^2"), "a polygon that encloses something");
        } else if let Some(k) = reflex_corner(&points).filter(|_| convex) {
            let found = format!("{:?}, where the polygon does not turn to its inside", corners[k]);
            self.add(format!("{place}[{k}]"), found, "a convex polygon: every corner turns to the same side");
        }
    }

    /// Asks that no name comes twice. `names` are pairs of place and name.
    fn distinct<'a>(&mut self, names: impl Iterator<Item = (String, &'a str)>) {
        let mut seen: std::collections::BTreeMap<&str, String> = std::collections::BTreeMap::new();
        for (place, name) in names {
            if let Some(first) = seen.get(name) {
                let found = format!("\"{name}\", which is the name of {first}");
                self.add(format!("{place}.name"), found, "a name that nothing else has");
            } else {
                seen.insert(name, place);
            }
        }
    }
}

/// Whether `place` is `whole` or lies within it: `room.walls[1]` is part of `room`.
fn is_part(place: &str, whole: &str) -> bool {
    place.strip_prefix(whole).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
}
