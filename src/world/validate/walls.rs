//! Walls inside the room: their measures, their openings, where they stand.

use super::room::texture;
use super::{Faults, LEAST_SIZE_M, TOLERANCE_M};
use crate::world::spec::{OpeningKind, OpeningSpec, WallSpec};
use crate::world::{World, WorldSpec};

/// Greatest thickness of a wall, m.
const THICKEST_M: f64 = 2.0;

/// Whether the measures of wall `k` are sound, so that it can be compared with what stands near it.
pub(super) fn is_sound(k: usize, faults: &Faults) -> bool {
    let fields = ["from_m", "to_m", "thickness_m", "height_m", "openings"];
    !fields.iter().any(|field| faults.touch(&format!("walls[{k}].{field}")))
}

pub(super) fn check_values(spec: &WorldSpec, faults: &mut Faults) {
    for (k, wall) in spec.walls.iter().enumerate() {
        check_wall(&format!("walls[{k}]"), wall, spec, faults);
    }
}

fn check_wall(place: &str, wall: &WallSpec, spec: &WorldSpec, faults: &mut Faults) {
    let [from, to] = ["from_m", "to_m"].map(|end| format!("{place}.{end}"));
    faults.point(&from, &wall.from_m);
    faults.point(&to, &wall.to_m);
    let length_m = wall.length_m();
    let has_ends = !faults.touch(&from) && !faults.touch(&to);
    if has_ends && length_m < LEAST_SIZE_M {
        let found = format!("{:?}, {length_m} m from the wall's beginning", wall.to_m);
        faults.add(&to, found, format!("an end at least {LEAST_SIZE_M} m from from_m"));
    }
    faults.between(format!("{place}.thickness_m"), wall.thickness_m, LEAST_SIZE_M, THICKEST_M);
    let room_height_m = spec.room.height_m;
    let height_m = wall.height_m.unwrap_or(room_height_m);
    if !faults.touch("room.height_m") {
        let good = height_m >= LEAST_SIZE_M && height_m <= room_height_m + TOLERANCE_M;
        let allowed = format!("{LEAST_SIZE_M} to the room's height, {room_height_m}");
        faults.unless(good, format!("{place}.height_m"), height_m.to_string(), allowed);
    }
    if let Some(spec) = &wall.texture {
        texture(&format!("{place}.texture"), spec, faults);
    }
    if !has_ends || faults.touch(&to) || faults.touch(&format!("{place}.height_m")) {
        return;
    }
    for (k, opening) in wall.openings.iter().enumerate() {
        check_opening(&format!("{place}.openings[{k}]"), opening, length_m, height_m, spec, faults);
    }
    check_overlap(place, &wall.openings, faults);
}

fn check_opening(place: &str, opening: &OpeningSpec, length_m: f64, height_m: f64, spec: &WorldSpec, faults: &mut Faults) {
    let OpeningSpec { from_start_m, width_m, .. } = *opening;
    faults.between(format!("{place}.from_start_m"), from_start_m, 0.0, length_m);
    faults.between(format!("{place}.width_m"), width_m, LEAST_SIZE_M, length_m + TOLERANCE_M);
    if !faults.touch(place) && from_start_m + width_m > length_m + TOLERANCE_M {
        let found = format!("{width_m}, which ends {} m along the wall", from_start_m + width_m);
        faults.add(format!("{place}.width_m"), found, format!("an end within the wall, which is {length_m} m long"));
    }
    let (sill_m, top_m) = (opening.bottom_m(), opening.top_in(height_m));
    faults.unless(
        top_m > 0.0 && top_m <= height_m + TOLERANCE_M,
        format!("{place}.top_m"),
        top_m.to_string(),
        format!("more than 0, at most the wall's height, {height_m}"),
    );
    if faults.touch(&format!("{place}.top_m")) {
        return;
    }
    let allowed = format!("0 to less than the opening's top, {top_m}");
    faults.unless(sill_m >= 0.0 && sill_m < top_m, format!("{place}.sill_m"), sill_m.to_string(), allowed);
    if opening.kind == Some(OpeningKind::Door) {
        faults.unless(sill_m == 0.0, format!("{place}.sill_m"), sill_m.to_string(), "0 for a door");
    }
    // What the robot passes under must clear the camera on top of it too. A camera that is at or above the ceiling is a fault of its own.
    let (robot_m, camera_m) = (spec.robot.height_m, spec.camera.height_m);
    if camera_m < spec.room.height_m && sill_m == 0.0 && top_m < height_m && top_m >= robot_m && top_m <= camera_m {
        let allowed = format!(
            "below {robot_m} (robot.height_m, so that the robot cannot pass) or above {camera_m} (camera.height_m, so that the \
             camera clears it)"
        );
        faults.add(format!("{place}.top_m"), top_m.to_string(), allowed);
    }
}

/// Asks that no two openings of a wall overlap; they may join.
fn check_overlap(place: &str, openings: &[OpeningSpec], faults: &mut Faults) {
    if faults.touch(&format!("{place}.openings")) {
        return;
    }
    let mut order: Vec<usize> = (0..openings.len()).collect();
    order.sort_by(|&a, &b| openings[a].from_start_m.total_cmp(&openings[b].from_start_m));
    for pair in order.windows(2) {
        let [before, after] = [pair[0], pair[1]].map(|k| &openings[k]);
        let end_m = before.from_start_m + before.width_m;
        if after.from_start_m < end_m - TOLERANCE_M {
            let found = format!("{}, where opening {} is, which ends at {end_m}", after.from_start_m, pair[0]);
            faults.add(format!("{place}.openings[{}].from_start_m", pair[1]), found, "openings that don't overlap");
        }
    }
}

/// Walls inside the room: the line from end to end may run along a wall of the room, but not beyond. `numbers` are those in the
/// file of the world's partitions.
pub(super) fn check_places(world: &World, numbers: &[usize], faults: &mut Faults) {
    for (partition, k) in world.partitions.iter().zip(numbers) {
        let [a, b] = [partition.from, partition.from + partition.along * partition.length_m];
        if !world.boundary().contains_segment(a, b, TOLERANCE_M) {
            let found = format!("a wall from [{}, {}] to [{}, {}] that leaves the room", a.x, a.y, b.x, b.y);
            faults.add(format!("walls[{k}].to_m"), found, "a wall inside the room; its ends may lie on the room's walls");
        }
    }
}
