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
/// A tile is made as fine as this, in metres a texel, ...
const COARSEST_M: f64 = 0.008;
/// ... and finer, up to [`SMALL`] texels along an edge, unless its texels are as small as this already.
const FINE_M: f64 = 0.004;
const SMALL: u32 = 9;
/// Most texels along an edge, as a binary logarithm.
const LARGEST: u32 = 11;

/// Binary logarithms of the tiles' edge lengths in texels. All are coarsened alike where the atlas would get too large.
pub(super) fn log2_sizes(specs: &[&TextureSpec]) -> Vec<u32> {
    let wanted = |spec: &TextureSpec| {
        let reach = |texel_m: f64, most: u32| (0..most).find(|&n| f64::from(1 << n) * texel_m >= spec.period_m).unwrap_or(most);
        match spec.family {
            TextureFamily::Plain => 0,
            _ => reach(COARSEST_M, LARGEST).max(reach(FINE_M, SMALL)).max(4),
        }
    };
    let mut sizes: Vec<u32> = specs.iter().map(|s| wanted(s)).collect();
    while sizes.iter().map(|&n| texels(n)).sum::<usize>() > ATLAS_TEXELS && sizes.iter().any(|&n| n > 2) {
        for n in sizes.iter_mut().filter(|n| **n > 2) {
            *n -= 1;
        }
    }
    sizes
}

/// Texels of all levels of a tile.
fn texels(log2_size: u32) -> usize {
    ((4 << (2 * log2_size)) - 1) / 3
}

/// Draws a texture of 2^`log2_size` texels along each edge.
pub(super) fn bake(spec: &TextureSpec, log2_size: u32) -> Baked {
    // Large tiles are drawn at their own resolution: what is beyond is seldom looked at so closely.
    let twice = u32::from(log2_size <= SMALL);
    let mut canvas = Canvas::new(1 << (log2_size + twice), spec.period_m, spec.colour.map(f32::from));
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
    let mut all = Vec::with_capacity(texels(log2_size));
    if twice == 1 {
        canvas.halve();
    }
    for level in 0..=log2_size {
        if level > 0 {
            canvas.halve();
        }
        all.extend(canvas.texels());
    }
    Baked { log2_size, texels: all }
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
        let plain = spec(TextureFamily::Plain);
        assert_eq!(bake(&plain, log2_sizes(&[&plain])[0]).texels, [0xff5a_7896]);
    }

    #[test]
    fn an_atlas_keeps_its_budget_and_tiles_their_resolution() {
        let of_period = |period_m| TextureSpec { period_m, ..spec(TextureFamily::Noise) };
        let sizes =
            |periods: &[f64]| log2_sizes(&periods.iter().map(|p| of_period(*p)).collect::<Vec<_>>().iter().collect::<Vec<_>>());
        assert_eq!(sizes(&[1.0, 2.0, 4.0, 7.0, 16.0, 100.0]), [8, 9, 9, 10, 11, 11]);
        for count in [1, 30, 100, 1000] {
            let sizes = sizes(&vec![16.0; count]);
            assert!(sizes.iter().map(|n| texels(*n)).sum::<usize>() <= ATLAS_TEXELS, "{count}");
        }
        assert_eq!(bake(&of_period(7.0), 10).texels.len(), texels(10));
    }
}
