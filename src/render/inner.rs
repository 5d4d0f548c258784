//! Walls inside the room as renderers see them: faces as high as the room, and blocks that are not.

use crate::geometry::Vector2;
use crate::world::{Partition, World};

/// What a surface is: number of its material, and instance id, packed as the shader has them.
pub(super) fn look(material: usize, instance: u16) -> u32 {
    debug_assert!(material <= usize::from(u16::MAX), "materials have 16 bits");
    material as u32 | u32::from(instance) << 16
}

/// An upright face from the floor to the ceiling, seen from the right of the way from `a` to `b`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    pub a: Vector2<f64>,
    pub b: Vector2<f64>,
    /// Texture coordinate u at `a`, m.
    pub u: f64,
    /// See [`look`].
    pub look: u32,
}

/// A piece of a wall that ends below the ceiling or begins above the floor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Its sides, anti-clockwise.
    pub sides: [Face; 4],
    /// Height of the underside, m.
    pub bottom_m: f64,
    /// Height of the top, m.
    pub top_m: f64,
    /// What it looks like from the left of its wall; from the right it is as its first side.
    pub left_look: u32,
    /// Where its wall begins, and which way it goes: the axes of the textures on top and underside.
    pub origin: Vector2<f64>,
    pub along: Vector2<f64>,
}

/// The pieces of all walls inside a room.
#[derive(Debug, Clone, Default)]
pub(super) struct InnerWalls {
    pub faces: Vec<Face>,
    pub blocks: Vec<Block>,
    /// Each piece as a whole, for a camera that is in it: name of its wall, corners, and heights of underside and top, m.
    pub solids: Vec<(String, [Vector2<f64>; 4], [f64; 2])>,
}

impl InnerWalls {
    /// Those of a world; `first_material` is that of the first wall's right side.
    pub fn new(world: &World, first_material: usize) -> Self {
        let mut all = Self::default();
        let room_height_m = world.spec.room.height_m;
        for (k, wall) in world.partitions.iter().enumerate() {
            for piece in &wall.pieces {
                let sides = sides(wall, piece.along_m, first_material + 2 * k);
                all.solids.push((wall.name.clone(), sides.map(|side| side.a), [piece.bottom_m, piece.top_m]));
                if piece.bottom_m <= 0.0 && piece.top_m >= room_height_m {
                    all.faces.extend(sides);
                } else {
                    let (bottom_m, top_m) = (piece.bottom_m, piece.top_m.min(room_height_m));
                    let (left_look, origin, along) = (sides[2].look, wall.from, wall.along);
                    all.blocks.push(Block { sides, bottom_m, top_m, left_look, origin, along });
                }
            }
        }
        all
    }
}

/// The sides of a stretch of a wall, anti-clockwise from the right one.
fn sides(wall: &Partition, stretch: [f64; 2], material: usize) -> [Face; 4] {
    let [start, end] = stretch;
    let corners = wall.footprint(stretch);
    // Around the end of a piece the texture of the right side goes on.
    let u = [start, end, wall.left_start_m + wall.length_m - end, start - wall.thickness_m];
    std::array::from_fn(|k| Face {
        a: corners[k],
        b: corners[(k + 1) % 4],
        u: u[k],
        look: look(material + usize::from(k == 2), wall.instance),
    })
}
