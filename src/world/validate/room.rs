//! The room itself: outline, surfaces, floor zones.

use super::{Faults, GREATEST_M, TOLERANCE_M};
use crate::geometry::Vector2;
use crate::world::polygon::edges;
use crate::world::spec::TextureSpec;
use crate::world::{World, WorldSpec};

pub(super) fn check_values(spec: &WorldSpec, faults: &mut Faults) {
    let room = &spec.room;
    faults.polygon("room.outline_m", &room.outline_m, false);
    faults.between("room.height_m", room.height_m, 0.1, GREATEST_M);
    let (textures, walls) = (room.walls.len(), room.outline_m.len());
    faults.unless(
        textures == 1 || textures == walls,
        "room.walls",
        format!("{textures} textures"),
        format!("1 for all walls, or {walls}: one a wall"),
    );
    for (k, wall) in room.walls.iter().enumerate() {
        texture(&format!("room.walls[{k}]"), wall, faults);
    }
    texture("room.floor", &room.floor, faults);
    texture("room.ceiling", &room.ceiling, faults);

    faults.between("floor.friction", spec.floor.friction, 0.0, 10.0);
    for (k, zone) in spec.floor.zones.iter().enumerate() {
        faults.polygon(&format!("floor.zones[{k}].polygon_m"), &zone.polygon_m, false);
        faults.between(format!("floor.zones[{k}].friction"), zone.friction, 0.0, 10.0);
    }
    let zones = spec.floor.zones.iter().enumerate().filter(|(_, z)| !z.name.is_empty());
    faults.distinct(zones.map(|(k, z)| (format!("floor.zones[{k}]"), z.name.as_str())));
}

/// A texture's numbers.
pub(super) fn texture(place: &str, texture: &TextureSpec, faults: &mut Faults) {
    match (texture.family, &texture.image) {
        (None, None) => faults.add(place, "neither family nor image", "one of them"),
        (Some(_), Some(_)) => faults.add(format!("{place}.image"), "an image beside a family", "one of them"),
        _ => {}
    }
    if let Some(period_m) = texture.period_m {
        faults.between(format!("{place}.period_m"), period_m, 0.01, GREATEST_M);
    }
    if let Some(contrast) = texture.contrast {
        faults.between(format!("{place}.contrast"), contrast, 0.0, 1.0);
    }
}

pub(super) fn check_places(world: &World, faults: &mut Faults) {
    for (k, zone) in world.zones.iter().enumerate() {
        let place = format!("floor.zones[{k}].polygon_m");
        if !faults.touch(&place) {
            polygon_inside(world, &zone.polygon, &place, faults);
        }
    }
}

/// Asks that a polygon lies in the room.
pub(super) fn polygon_inside(world: &World, polygon: &[Vector2<f64>], place: &str, faults: &mut Faults) {
    let outside = edges(polygon).find(|&(a, b)| !world.boundary().contains_segment(a, b, TOLERANCE_M));
    if let Some((a, b)) = outside {
        let found = format!("an edge from [{}, {}] to [{}, {}] that leaves the room", a.x, a.y, b.x, b.y);
        faults.add(place, found, "a polygon inside the room");
    }
}
