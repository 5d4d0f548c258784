//! Walls, floors and ceilings that look the same in several places, because their pattern repeats along them.
//!
//! A robot that sees one of those places cannot tell which. A person who gives a period may want just that; one who does not know
//! of it is told.

use super::polygon::{bounds, edges};
use super::{Footprint, Texture, World};
use crate::fault::Warning;

/// One warning for each texture of the file that repeats along a wall or along a side of a body.
pub(super) fn warnings(world: &World) -> Vec<Warning> {
    let spec = &world.spec;
    let mut found = Vec::new();
    // Walls that share a texture of the file are told together, by the longest.
    for (k, texture) in spec.room.walls.iter().enumerate() {
        let n = spec.room.outline_m.len();
        let shared = spec.room.walls.len() == 1;
        let clockwise = world.outline.get(1).is_some_and(|c| [c.x, c.y] != spec.room.outline_m[1]);
        let wall = |as_written: usize| if clockwise { n - 1 - as_written } else { as_written };
        let longest = (0..n).filter(|&w| shared || w == k).map(|w| (w, length_m(world, wall(w))));
        if let Some((w, length_m)) = longest.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))) {
            let place = place(&format!("room.walls[{k}]"), texture.period_m.is_some());
            note(&mut found, place, &world.wall_textures[wall(w)], &format!("wall {w}"), length_m);
        }
    }
    let (low, high) = bounds(&world.outline);
    let longest_m = (high.x - low.x).max(high.y - low.y);
    for (name, given, texture) in
        [("floor", &spec.room.floor, &world.floor_texture), ("ceiling", &spec.room.ceiling, &world.ceiling_texture)]
    {
        let place = place(&format!("room.{name}"), given.period_m.is_some());
        note(&mut found, place, texture, &format!("the {name}"), longest_m);
    }
    for (k, (wall, partition)) in spec.walls.iter().zip(&world.partitions).enumerate() {
        let place = match &wall.texture {
            Some(texture) => place(&format!("walls[{k}].texture"), texture.period_m.is_some()),
            None => format!("walls[{k}]"),
        };
        note(&mut found, place, &partition.texture, &partition.name, partition.length_m);
    }
    for (k, body) in world.bodies.iter().enumerate() {
        let Footprint::Polygon(corners) = &body.footprint else { continue };
        let longest_m = edges(corners).map(|(a, b)| (b - a).norm()).fold(0.0, f64::max);
        let (list, number, texture) = match k.checked_sub(world.landmark_count) {
            None => ("landmarks", k, &spec.landmarks[k].texture),
            Some(number) => ("obstacles", number, &spec.obstacles[number].texture),
        };
        let place = place(&format!("{list}[{number}].texture"), texture.period_m.is_some());
        note(&mut found, place, &body.texture, &format!("the longest side of \"{}\"", body.name), longest_m);
    }
    found
}

fn length_m(world: &World, wall: usize) -> f64 {
    let (a, b) = world.wall(wall);
    (b - a).norm()
}

/// The period of a texture where there is one, else the texture itself.
fn place(texture: &str, has_period: bool) -> String {
    if has_period { format!("{texture}.period_m") } else { texture.to_owned() }
}

fn note(found: &mut Vec<Warning>, place: String, texture: &Texture, what: &str, length_m: f64) {
    let places = texture.repeats(length_m);
    if places > 1 {
        let period_m = texture.period_m[0];
        let message = format!(
            "{what}, {length_m:.2} m long, looks the same in {places} places, since its texture repeats every {period_m} m; a pattern \
             without period_m does not repeat"
        );
        found.push(Warning { place, message, owner: None, line: None });
    }
}
