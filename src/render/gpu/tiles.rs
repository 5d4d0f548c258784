//! The scene's textures as the shader reads them.

use std::collections::HashMap;

use crate::render::Scene;
use crate::render::scene::{LEVELS, Material, MipLevel};

// The shader counts a material's texels, of two words each: MATERIAL_TEXELS of `shaders/sample.wgsl`.
const _: () = assert!(size_of::<Material>() == 8 * (2 + LEVELS) && LEVELS == 45);

/// Texels along the edge of a tile, as the shader has them: two pages of memory.
pub(super) const TILE: usize = 32;
/// Tiles in a layer of the atlas, as the shader has them.
pub(super) const LAYER_TILES: usize = 256;

/// The scene's texels in tiles, and its materials with the numbers of these.
///
/// The CPU's texels are lines of whole textures on large pages. A device's driver lays its memory on small ones where it is
/// software, and reads in squares where it is not.
pub(super) fn tile(scene: &Scene) -> (Vec<Material>, Vec<[u32; 2]>) {
    let mut texels: Vec<[u32; 2]> = Vec::new();
    // Surfaces share textures.
    let mut known = HashMap::new();
    let mut tiled = |level: &mut MipLevel| {
        let pitch = level.pitch() as usize;
        let tiles = pitch.div_ceil(TILE);
        level.base = *known.entry(level.base).or_insert_with(|| {
            let first = texels.len();
            texels.resize(first + tiles * tiles * TILE * TILE, [0; 2]);
            let lines = scene.atlas[level.base as usize..][..pitch * pitch].chunks_exact(pitch);
            for (u, line) in lines.enumerate() {
                for (k, part) in line.chunks(TILE).enumerate() {
                    let tile = u / TILE * tiles + k;
                    let next = line[k * TILE + 1..].iter().chain(&line[..1]);
                    let places = texels[first + (tile * TILE + u % TILE) * TILE..].iter_mut();
                    for (place, (texel, next)) in places.zip(part.iter().zip(next)) {
                        *place = [*texel, *next];
                    }
                }
            }
            (first / (TILE * TILE)) as u32
        });
    };
    let mut materials = scene.materials.to_vec();
    for material in &mut materials {
        material.levels[..=material.last_level as usize].iter_mut().for_each(&mut tiled);
    }
    (materials, texels)
}
