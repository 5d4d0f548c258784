//! Images as tiles.

use super::canvas::{Colour, shares};
use crate::world::Picture;

/// How often an image that is not square stands in its tile, along u and v. A tile that covers about as much along u as along v
/// can be filtered alike along both.
pub(super) fn copies(picture: &Picture) -> [u32; 2] {
    let rounded = |long: u32, short: u32| (2 * long + short) / (2 * short);
    let (width, height) = (picture.width, picture.height);
    if width > height { [1, rounded(width, height)] } else { [rounded(height, width), 1] }
}

/// Stretches an image to a tile of `size` x `size` pixels, v fastest and upwards, in which it stands so often; `ground` shows
/// where it is transparent.
///
/// Each pixel of the tile is the mean of what it covers of the image, so that nothing is left out and nothing flickers.
pub(super) fn stretch(picture: &Picture, ground: [u8; 3], size: usize, mirrored: bool, copies: [u32; 2]) -> Vec<Colour> {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let columns = shares(width * copies[0] as usize, size);
    let rows = shares(height * copies[1] as usize, size);
    let ground = ground.map(f32::from);
    let colour = |p: &[u8]| -> Colour {
        let opacity = f32::from(p[3]) / 255.0;
        std::array::from_fn(|c| ground[c] + (f32::from(p[c]) - ground[c]) * opacity)
    };
    let mut tile = vec![[0.0; 3]; size * size];
    let mut line = vec![[0.0_f32; 3]; width];
    for (k, covered) in rows.iter().enumerate() {
        line.fill([0.0; 3]);
        for &(row, share) in covered {
            for (sum, p) in line.iter_mut().zip(picture.rgba[4 * (row % height) * width..].chunks_exact(4)) {
                let colour = colour(p);
                *sum = std::array::from_fn(|c| sum[c] + share * colour[c]);
            }
        }
        let v = size - 1 - k;
        for (k, covered) in columns.iter().enumerate() {
            let u = if mirrored { size - 1 - k } else { k };
            for &(column, share) in covered {
                let sum = tile[u * size + v];
                tile[u * size + v] = std::array::from_fn(|c| sum[c] + share * line[column % width][c]);
            }
        }
    }
    tile
}
