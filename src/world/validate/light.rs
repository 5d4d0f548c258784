//! Light: lamps inside the room, windows on its walls.

use super::room::texture;
use super::{Faults, LEAST_SIZE_M, TOLERANCE_M};
use crate::world::{World, WorldSpec};

/// Most windows: each is part of every picture's light.
const MOST_WINDOWS: usize = 64;

pub(super) fn check_values(spec: &WorldSpec, faults: &mut Faults) {
    let light = &spec.light;
    faults.between("light.ambient", light.ambient, 0.0, 10.0);
    faults.between("light.corner_shade", light.corner_shade, 0.0, 1.0);
    faults.between("light.corner_reach_m", light.corner_reach_m, 0.01, 100.0);
    for (k, lamp) in light.lamps.iter().enumerate() {
        faults.point(&format!("light.lamps[{k}].position_m"), &lamp.position_m);
        faults.between(format!("light.lamps[{k}].intensity"), lamp.intensity, 0.0, 1e4);
    }
    let count = light.windows.len();
    faults.unless(count <= MOST_WINDOWS, "light.windows", format!("{count} windows"), format!("at most {MOST_WINDOWS}"));
    for (k, window) in light.windows.iter().enumerate() {
        let place = format!("light.windows[{k}]");
        faults.between(format!("{place}.brightness"), window.brightness, 0.0, 1e4);
        texture(&format!("{place}.texture"), &window.texture, faults);
        let outline = &spec.room.outline_m;
        let Some(&a) = outline.get(window.wall) else {
            let allowed = format!("the number of a wall, 0 to {}", outline.len().saturating_sub(1));
            faults.add(format!("{place}.wall"), window.wall.to_string(), allowed);
            continue;
        };
        let b = outline[(window.wall + 1) % outline.len()];
        let length = ((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1])).sqrt();
        let mut span = |field: &str, [from, to]: [f64; 2], most: f64, what: &str| {
            let good = from >= 0.0 && to - from >= LEAST_SIZE_M && to <= most + TOLERANCE_M;
            let allowed = format!("[from, to], rising, from 0 to {what}, {most:.3} m");
            faults.unless(good, format!("{place}.{field}"), format!("[{from}, {to}]"), allowed);
        };
        span("along_m", window.along_m, length, "the length of its wall");
        span("height_m", window.height_m, spec.room.height_m, "the height of the room");
    }
}

pub(super) fn check_places(world: &World, faults: &mut Faults) {
    for (k, lamp) in world.spec.light.lamps.iter().enumerate() {
        let [x, y, z] = lamp.position_m;
        let place = format!("light.lamps[{k}].position_m");
        if !faults.touch(&place) && !faults.touch("room.height_m") {
            let inside = world.boundary().contains([x, y].into()) && z > 0.0 && z <= world.spec.room.height_m;
            let allowed = format!("a point in the room, between the floor and its ceiling at {} m", world.spec.room.height_m);
            faults.unless(inside, place, format!("{:?}", lamp.position_m), allowed);
        }
    }
}
