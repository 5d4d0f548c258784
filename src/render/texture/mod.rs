//! Baking of textures: each surface's pattern, drawn from its seed, as a chain of ever coarser square tiles.
//!
//! A tile covers the square of `period_m` by `period_m` after which the pattern repeats, and joins itself at all borders. It
//! is drawn at twice its resolution and averaged over ever larger texels, four levels an octave down to a single texel. Within a
//! level v runs fastest: a column of the picture walks along v, thus along memory. A border of one texel, in which the tile
//! goes on, saves who samples it from minding the edges.
//!
//! Patterns are drawn in metres. They carry detail from about 3 cm to 60 cm, so that something can be recognised from half a
//! metre as well as from across a room, and no two places of a tile look alike. Images are stretched to a square tile, some
//! times side by side where they are far from square themselves, and texels are as wide and as high on the surface as that takes.

mod canvas;
mod patterns;
mod picture;

use std::collections::VecDeque;

use canvas::Canvas;

use crate::random::Seed;
use crate::world::{Pattern, Texture, TextureFamily};

/// A texture as a surface shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Surface<'a> {
    pub texture: &'a Texture,
    /// Whether u runs from right to left for who looks at it.
    pub mirrored: bool,
}

impl<'a> Surface<'a> {
    pub fn new(texture: &'a Texture, mirrored: bool) -> Self {
        // Patterns have no right way round: they are shared.
        Self { texture, mirrored: mirrored && matches!(texture.pattern, Pattern::Image(_)) }
    }
}

/// What a baked texture consists of.
pub(super) struct Baked {
    /// Texels along an edge of each level, the finest first, borders not counted.
    pub sizes: Vec<u32>,
    /// Periods of the texture that the tile covers along u and v.
    pub periods: [u32; 2],
}

/// Levels an octave.
const PER_OCTAVE: u32 = 4;
/// Most texels of an atlas: 128 MiB, and up to three times as much on a graphics device, where they lie in pairs and tiles.
const ATLAS_TEXELS: usize = 32 << 20;
/// A tile is made as fine as this, in metres a texel, ...
const COARSEST_M: f64 = 0.008;
/// ... and finer, up to [`SMALL`] texels along an edge, unless its texels are as small as this already.
const FINE_M: f64 = 0.004;
const SMALL: u32 = 9;
/// Most texels along an edge, as a binary logarithm.
const LARGEST: u32 = 11;
/// The same as a fineness; see [`fineness`].
pub(super) const FINEST: u32 = PER_OCTAVE * LARGEST;

/// Coarser than this nothing is made, as a fineness.
const COARSE: u32 = 2 * PER_OCTAVE;
/// Texels of an image are no smaller than this, m: no camera here sees more.
const FINEST_M: f64 = 0.001;

/// How fine tiles are: number of the coarsest level, which has one texel. All are coarsened alike where the atlas would get too
/// large.
pub(super) fn fineness<'a>(textures: impl Iterator<Item = &'a Texture>) -> Vec<u32> {
    let wanted = |texture: &Texture| {
        if texture.fitted {
            // No power of two: many walls are a little longer than one.
            return (0..FINEST).find(|&f| f64::from(size(f)) * COARSEST_M >= texture.period_m[0]).unwrap_or(FINEST);
        }
        let period_m = texture.period_m[0].max(texture.period_m[1]);
        let reach = |texel_m: f64, most: u32| (0..most).find(|&n| f64::from(1 << n) * texel_m >= period_m).unwrap_or(most);
        let log2_size = match &texture.pattern {
            Pattern::Family(TextureFamily::Plain) => 0,
            Pattern::Family(_) => reach(COARSEST_M, LARGEST).max(reach(FINE_M, SMALL)).max(4),
            Pattern::Image(picture) => {
                let pixels = picture.width.max(picture.height);
                pixels.next_power_of_two().ilog2().min(reach(FINEST_M, LARGEST)).max(1)
            }
        };
        PER_OCTAVE * log2_size
    };
    let mut all: Vec<u32> = textures.map(wanted).collect();
    while all.iter().map(|&f| texels(f)).sum::<usize>() > ATLAS_TEXELS && all.iter().any(|&f| f > COARSE) {
        for f in all.iter_mut().filter(|f| **f > COARSE) {
            *f -= 1;
        }
    }
    all
}

/// Texels along an edge of a level that is `fineness` levels finer than one texel.
fn size(fineness: u32) -> u32 {
    /// Powers of the fourth root of two, in 1/1024.
    const ROOTS: [u32; PER_OCTAVE as usize] = [1024, 1218, 1448, 1722];
    let root = ROOTS[(fineness % PER_OCTAVE) as usize];
    ((root << (fineness / PER_OCTAVE)) + 512) >> 10
}

/// Texels of all levels of a tile, with their borders.
pub(super) fn texels(fineness: u32) -> usize {
    (0..=fineness).map(|f| (size(f) as usize + 2).pow(2)).sum()
}

/// Draws a texture in so many levels, less one, which lie one after the other in `out`, with their borders; red in the lowest byte.
/// There must be room for [`texels()`] of them.
pub(super) fn bake(surface: &Surface<'_>, fineness: u32, mut out: &mut [u32]) -> Baked {
    let texture = surface.texture;
    let log2_size = fineness.div_ceil(PER_OCTAVE);
    // Large tiles are drawn at their own resolution: what is beyond is seldom looked at so closely.
    let drawn = matches!(texture.pattern, Pattern::Family(_));
    let twice = u32::from(drawn && log2_size <= SMALL && fineness > 0);
    // What is fitted to its surface is large already, and drawn as it will be.
    let edge = if texture.fitted && twice == 0 { size(fineness) as usize } else { 1 << (log2_size + twice) };
    let mut canvas = Canvas::new(edge, texture.period_m[0], texture.colour.map(f32::from));
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
    let sizes: Vec<u32> = (0..=fineness).rev().map(size).collect();
    // Each level is made of the one an octave finer, those of the first octave of what was drawn.
    let mut octave = VecDeque::with_capacity(PER_OCTAVE as usize);
    for &size in &sizes {
        let source = if octave.len() == PER_OCTAVE as usize { octave.pop_front() } else { None };
        let level = source.as_ref().unwrap_or(&canvas).shrunk(size as usize);
        let (texels, rest) = out.split_at_mut((size as usize + 2).pow(2));
        level.write_texels(texels);
        out = rest;
        octave.push_back(level);
    }
    Baked { sizes, periods }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(family: TextureFamily, period_m: f64) -> Texture {
        Texture {
            pattern: Pattern::Family(family),
            colour: [150, 120, 90],
            period_m: [period_m; 2],
            fitted: false,
            contrast: 0.6,
            seed: 7,
        }
    }

    fn baked(surface: &Surface<'_>, fineness: u32) -> (Baked, Vec<u32>) {
        let mut all = vec![0; texels(fineness)];
        (bake(surface, fineness, &mut all), all)
    }

    /// The finest level without its border.
    fn finest(surface: &Surface<'_>, log2_size: u32) -> Vec<u32> {
        let (baked, texels) = baked(surface, PER_OCTAVE * log2_size);
        let size = baked.sizes[0] as usize;
        texels.chunks(size + 2).skip(1).take(size).flat_map(|line| line[1..=size].to_vec()).collect()
    }

    #[test]
    fn bands_do_not_depend_on_u_and_plain_is_one_texel() {
        let finest = finest(&Surface::new(&texture(TextureFamily::Bands, 4.0), false), 6);
        assert!(finest.chunks(64).all(|line| line == &finest[..64]));
        assert!(finest[..64].iter().any(|t| *t != finest[0]));
        let plain = texture(TextureFamily::Plain, 4.0);
        let (plain, texels) = baked(&Surface::new(&plain, false), fineness([&plain].into_iter())[0]);
        assert_eq!((plain.sizes, texels), (vec![1], vec![0xff5a_7896; 9]));
    }

    #[test]
    fn an_atlas_keeps_its_budget_and_tiles_their_resolution() {
        let sizes = |periods: &[f64]| {
            let all: Vec<_> = periods.iter().map(|p| texture(TextureFamily::Noise, *p)).collect();
            fineness(all.iter())
        };
        let alone = [1.0, 2.0, 4.0, 7.0, 16.0, 100.0].map(|period_m| sizes(&[period_m])[0]);
        assert_eq!(alone, [8, 9, 9, 10, 11, 11].map(|n| PER_OCTAVE * n));
        for count in [1, 30, 100, 1000] {
            let sizes = sizes(&vec![16.0; count]);
            assert!(sizes.iter().map(|n| texels(*n)).sum::<usize>() <= ATLAS_TEXELS, "{count}");
        }
        // What covers a wall as a whole is no finer than it must be, and covers it.
        let fitted = |period_m| Texture { fitted: true, ..texture(TextureFamily::Noise, period_m) };
        let alone = [5.0, 8.0, 10.0, 100.0].map(|period_m| fineness([fitted(period_m)].iter())[0]);
        assert_eq!(alone, [38, 40, 42, FINEST]);
        let fitted = fitted(5.0);
        assert!(baked(&Surface::new(&fitted, false), 38).1.iter().all(|t| t >> 24 == 0xff));
        // All that was asked for is written: no texel is transparent.
        assert!(baked(&Surface::new(&texture(TextureFamily::Noise, 7.0), false), 40).1.iter().all(|t| t >> 24 == 0xff));
    }

    #[test]
    fn an_image_stands_upright_and_reads_the_right_way() {
        // White at the lower left, else black; transparent at the lower right, where the base colour shows.
        let rgba = [[0, 0, 0, 255], [0, 0, 0, 255], [255, 255, 255, 255], [9, 9, 9, 0]].concat();
        let picture = std::sync::Arc::new(crate::world::Picture { width: 2, height: 2, rgba });
        let image = Texture { pattern: Pattern::Image(picture), contrast: 1.0, ..texture(TextureFamily::Plain, 1.0) };
        // Texels run up each line of u.
        let (white, black, base) = (0xffff_ffff, 0xff00_0000, 0xff5a_7896);
        let seen = |mirrored: bool| finest(&Surface::new(&image, mirrored), 1);
        assert_eq!(seen(false), [white, black, base, black]);
        assert_eq!(seen(true), [base, black, white, black]);
        let long = crate::world::Picture { width: 5, height: 2, rgba: vec![0; 40] };
        assert_eq!(picture::copies(&long), [1, 3], "so that 5 x 6 pixels are about a square");
    }
}
