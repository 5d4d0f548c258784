//! Baking of textures: each surface's pattern, drawn from its seed, as a chain of ever coarser square tiles.
//!
//! A tile covers the square of `period_m` by `period_m` after which the pattern repeats, and joins itself at all borders. It
//! is drawn at twice its resolution and averaged, then averaged two by two down to one texel. Within a level, texel (u, v) has
//! index `u * size + v`: a column of the picture walks along v, thus along memory.
//!
//! Patterns are drawn in metres. They carry detail from about 3 cm to 60 cm, so that something can be recognised from half a
//! metre as well as from across a room, and no two places of a tile look alike. Images are stretched to a square tile, some
//! times side by side where they are far from square themselves, and texels are as wide and as high on the surface as that takes.

mod canvas;
mod patterns;
mod picture;

use canvas::Canvas;

use super::scene::Surface;
use crate::random::Seed;
use crate::world::{Pattern, Texture, TextureFamily};

/// A baked texture.
pub(super) struct Baked {
    /// Binary logarithm of the finest level's edge length.
    pub log2_size: u32,
    /// All levels, the finest first; red in the lowest byte.
    pub texels: Vec<u32>,
    /// Periods of the texture that the tile covers along u and v.
    pub periods: [u32; 2],
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

/// Texels of an image are no smaller than this, m: no camera here sees more.
const FINEST_M: f64 = 0.001;

/// Binary logarithms of the tiles' edge lengths in texels. All are coarsened alike where the atlas would get too large.
pub(super) fn log2_sizes<'a>(textures: impl Iterator<Item = &'a Texture>) -> Vec<u32> {
    let wanted = |texture: &Texture| {
        let period_m = texture.period_m[0].max(texture.period_m[1]);
        let reach = |texel_m: f64, most: u32| (0..most).find(|&n| f64::from(1 << n) * texel_m >= period_m).unwrap_or(most);
        match &texture.pattern {
            Pattern::Family(TextureFamily::Plain) => 0,
            Pattern::Family(_) => reach(COARSEST_M, LARGEST).max(reach(FINE_M, SMALL)).max(4),
            Pattern::Image(picture) => {
                let pixels = picture.width.max(picture.height);
                pixels.next_power_of_two().ilog2().min(reach(FINEST_M, LARGEST)).max(1)
            }
        }
    };
    let mut sizes: Vec<u32> = textures.map(wanted).collect();
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
pub(super) fn bake(surface: &Surface<'_>, log2_size: u32) -> Baked {
    let texture = surface.texture;
    // Large tiles are drawn at their own resolution: what is beyond is seldom looked at so closely.
    let drawn = matches!(texture.pattern, Pattern::Family(_));
    let twice = u32::from(drawn && log2_size <= SMALL);
    let mut canvas = Canvas::new(1 << (log2_size + twice), texture.period_m[0], texture.colour.map(f32::from));
    let mut stream = Seed(texture.seed).stream("texture");
    let mut periods = [1, 1];
    match &texture.pattern {
        Pattern::Family(TextureFamily::Plain) => {}
        Pattern::Family(TextureFamily::Noise) => patterns::noise(&mut canvas, &mut stream),
        Pattern::Family(TextureFamily::Brick) => patterns::brick(&mut canvas, &mut stream),
        Pattern::Family(TextureFamily::Planks) => patterns::planks(&mut canvas, &mut stream),
        Pattern::Family(TextureFamily::Tiles) => patterns::tiles(&mut canvas, &mut stream),
        Pattern::Family(TextureFamily::Posters) => patterns::posters(&mut canvas, &mut stream),
        Pattern::Family(TextureFamily::Shelves) => patterns::shelves(&mut canvas, &mut stream),
        Pattern::Family(TextureFamily::Bands) => patterns::bands(&mut canvas, &mut stream),
        Pattern::Image(image) => {
            periods = picture::copies(image);
            canvas.fill(picture::stretch(image, texture.colour, 1 << log2_size, surface.mirrored, periods));
        }
    }
    canvas.weaken(texture.contrast.clamp(0.0, 1.0) as f32);
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
    Baked { log2_size, texels: all, periods }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(family: TextureFamily, period_m: f64) -> Texture {
        Texture { pattern: Pattern::Family(family), colour: [150, 120, 90], period_m: [period_m; 2], contrast: 0.6, seed: 7 }
    }

    fn baked(texture: &Texture, log2_size: u32) -> Baked {
        bake(&Surface::new(texture, false), log2_size)
    }

    #[test]
    fn bands_do_not_depend_on_u_and_plain_is_one_texel() {
        let bands = baked(&texture(TextureFamily::Bands, 4.0), 6);
        let finest = &bands.texels[..64 * 64];
        assert!(finest.chunks(64).all(|line| line == &finest[..64]));
        assert!(finest[..64].iter().any(|t| *t != finest[0]));
        let plain = texture(TextureFamily::Plain, 4.0);
        assert_eq!(baked(&plain, log2_sizes([&plain].into_iter())[0]).texels, [0xff5a_7896]);
    }

    #[test]
    fn an_atlas_keeps_its_budget_and_tiles_their_resolution() {
        let sizes = |periods: &[f64]| {
            let all: Vec<_> = periods.iter().map(|p| texture(TextureFamily::Noise, *p)).collect();
            log2_sizes(all.iter())
        };
        assert_eq!(sizes(&[1.0, 2.0, 4.0, 7.0, 16.0, 100.0]), [8, 9, 9, 10, 11, 11]);
        for count in [1, 30, 100, 1000] {
            let sizes = sizes(&vec![16.0; count]);
            assert!(sizes.iter().map(|n| texels(*n)).sum::<usize>() <= ATLAS_TEXELS, "{count}");
        }
        assert_eq!(baked(&texture(TextureFamily::Noise, 7.0), 10).texels.len(), texels(10));
    }

    #[test]
    fn an_image_stands_upright_and_reads_the_right_way() {
        // White at the lower left, else black; transparent at the lower right, where the base colour shows.
        let rgba = [[0, 0, 0, 255], [0, 0, 0, 255], [255, 255, 255, 255], [9, 9, 9, 0]].concat();
        let picture = std::sync::Arc::new(crate::world::Picture { width: 2, height: 2, rgba });
        let image = Texture { pattern: Pattern::Image(picture), contrast: 1.0, ..texture(TextureFamily::Plain, 1.0) };
        // Texels run up each line of u.
        let (white, black, base) = (0xffff_ffff, 0xff00_0000, 0xff5a_7896);
        assert_eq!(bake(&Surface::new(&image, false), 1).texels[..4], [white, black, base, black]);
        assert_eq!(bake(&Surface::new(&image, true), 1).texels[..4], [base, black, white, black]);
        let long = crate::world::Picture { width: 5, height: 2, rgba: vec![0; 40] };
        assert_eq!(picture::copies(&long), [1, 3], "so that 5 x 6 pixels are about a square");
    }
}
