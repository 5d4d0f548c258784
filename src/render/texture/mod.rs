//! Baking of textures: each surface's pattern, drawn from its seed, as a chain of ever coarser square tiles.
//!
//! A tile covers the square of `period_m` by `period_m` after which the pattern repeats, and joins itself at all borders. It
//! is drawn at twice its resolution and averaged, then averaged two by two down to one texel. Within a level, texel (u, v) has
//! index `u * size + v`: a column of the picture walks along v, thus along memory.
//!
//! Patterns are drawn in metres. They carry detail from about 3 cm to 60 cm, so that something can be recognised from half a
//! metre as well as from across a room, and no two places of a tile look alike.

mod canvas;
mod patterns;

use canvas::Canvas;

use crate::random::Seed;
use crate::world::{TextureFamily, TextureSpec};

/// A baked texture.
pub(super) struct Baked {
    /// Binary logarithm of the finest level's edge length.
    pub log2_size: u32,
    /// All levels, the finest first; red in the lowest byte.
    pub texels: Vec<u32>,
}

/// Most texels of an atlas: 128 MiB, what every graphics device binds as one buffer.
const ATLAS_TEXELS: usize = 32 << 20;

/// Binary logarithm of a tile's edge length, such that `count` tiles fit into the atlas: 512 texels, or less for a crowd.
pub(super) fn log2_size(count: usize) -> u32 {
    (4..9_u32).rev().map(|n| n + 1).find(|&n| count * (((4_usize << (2 * n)) - 1) / 3) <= ATLAS_TEXELS).unwrap_or(4)
}

/// Draws a texture of 2^`log2_size` texels along each edge; a plain one has a single texel.
pub(super) fn bake(spec: &TextureSpec, log2_size: u32) -> Baked {
    let log2_size = if spec.family == TextureFamily::Plain { 0 } else { log2_size };
    let mut canvas = Canvas::new(2 << log2_size, spec.period_m, spec.colour.map(f32::from));
    let mut stream = Seed(spec.seed.unwrap_or(0)).stream("texture");
    match spec.family {
        TextureFamily::Plain => {}
        TextureFamily::Noise => patterns::noise(&mut canvas, &mut stream),
        TextureFamily::Brick => patterns::brick(&mut canvas, &mut stream),
        TextureFamily::Planks => patterns::planks(&mut canvas, &mut stream),
        TextureFamily::Tiles => patterns::tiles(&mut canvas, &mut stream),
        TextureFamily::Posters => patterns::posters(&mut canvas, &mut stream),
        TextureFamily::Shelves => patterns::shelves(&mut canvas, &mut stream),
        TextureFamily::Bands => patterns::bands(&mut canvas, &mut stream),
    }
    canvas.weaken(spec.contrast.clamp(0.0, 1.0) as f32);
    let mut texels = Vec::with_capacity(((4 << (2 * log2_size)) - 1) / 3);
    for _ in 0..=log2_size {
        canvas.halve();
        texels.extend(canvas.texels());
    }
    Baked { log2_size, texels }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(family: TextureFamily) -> TextureSpec {
        TextureSpec { seed: Some(7), ..TextureSpec::new(family, [150, 120, 90]) }
    }

    #[test]
    fn bands_do_not_depend_on_u_and_plain_is_one_texel() {
        let bands = bake(&spec(TextureFamily::Bands), 6);
        let finest = &bands.texels[..64 * 64];
        assert!(finest.chunks(64).all(|line| line == &finest[..64]));
        assert!(finest[..64].iter().any(|t| *t != finest[0]));
        assert_eq!(bake(&spec(TextureFamily::Plain), 6).texels, [0xff5a_7896]);
    }

    #[test]
    fn an_atlas_keeps_its_budget() {
        assert_eq!(log2_size(10), 9);
        for count in [10, 96, 97, 400, 5000] {
            assert!(count * ((4 << (2 * log2_size(count))) - 1) / 3 <= ATLAS_TEXELS, "{count}");
        }
    }
}
