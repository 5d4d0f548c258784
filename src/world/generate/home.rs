//! Home, where runs start, people who walk, patches of floor.

use std::f64::consts::TAU;

use super::dice::{Dice, hundredths, mm};
use super::furniture;
use super::knobs::{Drawn, Knob};
use super::looks::Looks;
use super::plan::Plan;
use super::reach::{CELL_M, Grid};
use crate::geometry::{Vector2, angle_of, direction};
use crate::world::convex::Convex;
use crate::world::polygon::{contains_segment, distance_to_segment, edges};
use crate::world::robot::RobotSpec;
use crate::world::spec::{
    BodySpec, MotionSpec, NamedStartSpec, OpeningKind, PoseSpec, ShapeSpec, StartSpec, WallSpec, ZoneSpec,
};

/// Least distance from home of a random start, m.
const NEAREST_START_M: f64 = 0.8;
/// Places that are tried as home.
const HOMES: usize = 60;
/// Places around one that are looked at from it, and how many of them must see it.
const LOOKS: usize = 160;
const SEEN: usize = 10;
/// Radius and height of a person, m.
const PERSON_M: [f64; 2] = [0.2, 1.7];

/// Home, starts, and how the room can be driven through.
pub(super) struct Task {
    pub home: PoseSpec,
    pub start: StartSpec,
}

/// Finds a home that is seen from many places around it, the farthest about as far as starts are to be, and starts from which the
/// robot can drive there. `None` where the room has no such place.
pub(super) fn choose(plan: &Plan, drawn: &Drawn, robot: &RobotSpec, dice: &mut Dice) -> Option<Task> {
    let grid = Grid::new(plan, robot.radius_m, robot.height_m);
    let free: Vec<usize> = (0..grid.cells()).filter(|&c| grid.is_free(c)).collect();
    let reached = largest_component(&grid, &free, dice)?;
    if !plan.walls.iter().all(|wall| doors_are_passed(&grid, &reached, wall)) {
        return None;
    }
    let (low, high) = plan.bounds();
    let farthest_m = drawn.get(Knob::StartDistanceM).min(0.55 * (high - low).norm());
    // Most docking stations stand at a wall; a home in the open is as far from everything as the room allows.
    let at_wall = dice.chance(0.35);
    for k in 0..HOMES {
        let cell = *dice.pick(&free);
        let clearance_m = grid.clearance_m(cell);
        let wanted_m = if at_wall { 0.1..0.35 } else { 0.5 * (1.0 - k as f64 / HOMES as f64)..f64::INFINITY };
        let at = grid.middle(cell);
        if !reached[cell] || !wanted_m.contains(&clearance_m) || is_covered(plan, at) {
            continue;
        }
        let heading_deg = if at_wall { off_wall_deg(plan, at) } else { dice.between(-180.0, 180.0).round() };
        if let Some(start) = starts(&grid, &reached, at, farthest_m, drawn, dice) {
            return Some(Task { home: PoseSpec { x_m: mm(at.x), y_m: mm(at.y), heading_deg }, start });
        }
    }
    None
}

/// The cells that hang together with most others.
fn largest_component(grid: &Grid, free: &[usize], dice: &mut Dice) -> Option<Vec<bool>> {
    if free.is_empty() {
        return None;
    }
    // Rooms whose free space falls apart are drawn again: what is sought holds most of it, and a draw soon hits it.
    (0..8).map(|_| grid.component(*dice.pick(free))).find(|reached| {
        let count = reached.iter().filter(|r| **r).count();
        10 * count >= 9 * free.len()
    })
}

/// Whether the robot, from wherever it can be, drives through all doors of a wall and out again on the other side.
fn doors_are_passed(grid: &Grid, reached: &[bool], wall: &WallSpec) -> bool {
    /// How far from the line of its wall a place is beyond a door, m.
    const BEYOND_M: f64 = 0.35;
    let [from, to] = [wall.from_m, wall.to_m].map(|[x, y]| Vector2::new(x, y));
    let along = (to - from) / wall.length_m();
    let left = Vector2::new(-along.y, along.x);
    wall.openings.iter().filter(|o| o.kind == Some(OpeningKind::Door)).all(|door| {
        let steps = (door.width_m / (0.5 * CELL_M)).floor().max(1.0);
        let mut places = (0..=steps as usize).map(|k| from + along * (door.from_start_m + door.width_m * (k as f64 / steps)));
        places.any(|at| {
            let [right, left] = [-1.0, 1.0].map(|side| at + left * (side * BEYOND_M));
            grid.cell(right).is_some_and(|cell| reached[cell]) && grid.sees(right, left)
        })
    })
}

/// Whether something hangs above a place, as the top of a table does.
fn is_covered(plan: &Plan, at: Vector2<f64>) -> bool {
    let disc = Convex::disc(at, 0.2);
    plan.solids.iter().any(|s| (s.pose.position() - at).norm() < s.reach_m + 0.2 && s.convex.gap_m(&disc) < 0.0)
}

/// The heading that faces away from the nearest wall, degrees.
fn off_wall_deg(plan: &Plan, at: Vector2<f64>) -> f64 {
    let distance = |(a, b): &(Vector2<f64>, Vector2<f64>)| distance_to_segment(at, *a, *b);
    let nearest = edges(&plan.outline).min_by(|p, q| distance(p).total_cmp(&distance(q)));
    nearest.map_or(0.0, |(a, b)| angle_of(Vector2::new(a.y - b.y, b.x - a.x)).to_degrees().round() + 0.0)
}

/// Starts around a home; `None` where too few places see it.
fn starts(
    grid: &Grid,
    reached: &[bool],
    home: Vector2<f64>,
    farthest_m: f64,
    drawn: &Drawn,
    dice: &mut Dice,
) -> Option<StartSpec> {
    let (low, high) = grid.bounds();
    let (mut seen, mut near, mut far, mut hidden) = (0, None, None::<(f64, Vector2<f64>)>, None);
    for _ in 0..LOOKS {
        let within = |low: f64, high: f64, home: f64, dice: &mut Dice| {
            dice.between(low.max(home - farthest_m), high.min(home + farthest_m))
        };
        let at = Vector2::new(within(low.x, high.x, home.x, dice), within(low.y, high.y, home.y, dice));
        let Some(cell) = grid.cell(at) else { continue };
        if !reached[cell] {
            continue;
        }
        let at = grid.middle(cell);
        let distance_m = (at - home).norm();
        if distance_m < NEAREST_START_M || distance_m > drawn.get(Knob::StartDistanceM) {
            continue;
        }
        if !grid.sees(at, home) {
            hidden.get_or_insert(at);
            continue;
        }
        seen += 1;
        if distance_m < NEAREST_START_M + 0.3 * farthest_m {
            near.get_or_insert(at);
        }
        if far.is_none_or(|(most_m, _)| distance_m > most_m) {
            far = Some((distance_m, at));
        }
    }
    let far = far.filter(|(most_m, _)| *most_m >= 0.85 * farthest_m).map(|(_, at)| at);
    if seen < SEEN || far.is_none() {
        return None;
    }
    let mut named = Vec::new();
    for (name, at) in [("near", near), ("far", far), ("behind", hidden)] {
        if let Some(at) = at {
            let heading_deg = 5.0 * dice.between(-36.0, 36.0).round() + 0.0;
            named.push(NamedStartSpec { name: name.to_owned(), x_m: mm(at.x), y_m: mm(at.y), heading_deg });
        }
    }
    let max_distance_m = drawn.get(Knob::StartDistanceM);
    Some(StartSpec { min_distance_m: NEAREST_START_M, max_distance_m, named, ..StartSpec::default() })
}

/// People who walk back and forth, clear of all that stands, of home and of the named starts.
pub(super) fn walkers(plan: &Plan, task: &Task, count: usize, dice: &mut Dice, looks: &mut Looks) -> Vec<BodySpec> {
    let [radius_m, height_m] = PERSON_M;
    let mut people: Vec<BodySpec> = Vec::new();
    if count == 0 {
        return people;
    }
    // A cell's corner is 7 cm from its middle, and the grid has 5 cm in hand.
    let grid = Grid::new(plan, radius_m + 0.03, height_m);
    let free: Vec<usize> = (0..grid.cells()).filter(|&c| grid.is_free(c)).collect();
    let home = Vector2::new(task.home.x_m, task.home.y_m);
    let starts: Vec<_> = task.start.named.iter().map(|n| Vector2::new(n.x_m, n.y_m)).collect();
    let clear = |a: Vector2<f64>, b: Vector2<f64>| distance_to_segment(home, a, b) > 0.75 && grid.sees(a, b);
    for _ in 0..30 * count {
        if people.len() == count || free.is_empty() {
            break;
        }
        let corner = |dice: &mut Dice| grid.middle(*dice.pick(&free)).map(mm);
        let (a, b, c) = (corner(dice), corner(dice), corner(dice));
        let long = |a: Vector2<f64>, b: Vector2<f64>| (1.5..12.0).contains(&(b - a).norm());
        let apart = |p: Vector2<f64>| (p - a).norm() > 0.65;
        let others = people.iter().map(|p| Vector2::new(p.position_m[0], p.position_m[1]));
        if !long(a, b) || !clear(a, b) || !starts.iter().all(|p| apart(*p)) || !others.into_iter().all(apart) {
            continue;
        }
        let mut corners_m = vec![[b.x, b.y]];
        if long(b, c) && clear(b, c) {
            corners_m.push([c.x, c.y]);
        }
        let speed_m_s = hundredths(dice.between(0.3, 0.9));
        let number = people.len() + 1;
        people.push(BodySpec {
            name: format!("person {number}"),
            shape: ShapeSpec::Disc { radius_m },
            position_m: [a.x, a.y],
            heading_deg: 0.0,
            height_m,
            elevation_m: 0.0,
            texture: furniture::coat(dice, looks),
            glow: 0.0,
            motion: Some(MotionSpec::Path { corners_m, speed_m_s, closed: false }),
        });
    }
    people
}

/// Patches of floor with a friction of their own.
pub(super) fn zones(plan: &Plan, drawn: &Drawn, dice: &mut Dice) -> Vec<ZoneSpec> {
    let (low, high) = plan.bounds();
    let mut zones: Vec<ZoneSpec> = Vec::new();
    let count = drawn.count(Knob::Zones);
    for _ in 0..20 * count {
        if zones.len() == count {
            break;
        }
        let at = Vector2::new(dice.between(low.x, high.x), dice.between(low.y, high.y));
        let (half_x, half_y) = (dice.between(0.4, 1.2), dice.between(0.4, 1.2));
        let is_mat = dice.chance(0.5);
        let corners: Vec<Vector2<f64>> = if is_mat {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| at + Vector2::new(x * half_x, y * half_y))
                .to_vec()
        } else {
            // Eight corners around a middle, each as far as it likes: a puddle.
            (0..8)
                .map(|k| direction(TAU * f64::from(k) / 8.0) * dice.between(0.6, 1.0))
                .map(|d| at + Vector2::new(d.x * half_x, d.y * half_y))
                .collect()
        };
        let corners: Vec<_> = corners.into_iter().map(|c| c.map(mm)).collect();
        if edges(&corners).all(|(a, b)| contains_segment(&plan.outline, a, b, 0.0)) {
            let name = if is_mat { format!("mat {}", zones.len() + 1) } else { format!("puddle {}", zones.len() + 1) };
            let polygon_m = corners.iter().map(|c| [c.x, c.y]).collect();
            zones.push(ZoneSpec { name, polygon_m, friction: drawn.get(Knob::ZoneFriction) });
        }
    }
    zones
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::generate::plan::Solid;
    use crate::world::spec::OpeningSpec;

    /// Two rooms with a door between them, which is passed until something stands before it, though both rooms stay in reach by
    /// another door.
    #[test]
    fn a_door_with_something_before_it_is_not_passed() {
        let door = |from_start_m: f64| OpeningSpec {
            kind: Some(OpeningKind::Door),
            from_start_m,
            width_m: 0.8,
            sill_m: None,
            top_m: Some(2.0),
        };
        let mut plan = Plan::new(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]], 2.5);
        plan.wall(WallSpec { openings: vec![door(0.3), door(2.5)], ..WallSpec::new([2.0, 0.0], [2.0, 4.0]) });
        let passed = |plan: &Plan| {
            let grid = Grid::new(plan, 0.164, 0.35);
            let reached = grid.component(grid.cell(Vector2::new(1.0, 2.0)).unwrap());
            assert!(reached[grid.cell(Vector2::new(3.0, 2.0)).unwrap()]);
            doors_are_passed(&grid, &reached, &plan.walls[0])
        };
        assert!(passed(&plan));
        let shape = ShapeSpec::Box { size_m: [0.4, 0.7] };
        plan.solids.push(Solid::new(&shape, crate::geometry::Pose::new(2.4, 2.9, 0.0), 0.0, 1.0));
        assert!(!passed(&plan));
    }
}
