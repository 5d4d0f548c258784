//! Pictures as the shader writes them.

use super::gpu_error;
use crate::error::Result;
use crate::panorama::{INSTANCE_CEILING, INSTANCE_FLOOR, Panorama, Projection};
use crate::render::columns::MAX_HITS;

/// Bytes that the shader writes for a pixel: colour, a code for the instance, and range.
pub(super) const PIXEL_BYTES: u64 = 8;
/// Bytes that it writes for a column: what its codes stand for.
const COLUMN_BYTES: u64 = 2 * MAX_HITS as u64;
/// Codes of nothing, floor and ceiling; those of a column's hits follow.
const ROOM_CODES: [u16; 3] = [0, INSTANCE_FLOOR, INSTANCE_CEILING];
/// Codes that there are at most; a power of two, so that none leads out of a list of them.
const CODES: usize = 32;

/// For each column the instances that its codes stand for.
pub(super) type Codes = Vec<[u16; CODES]>;

/// Bytes that the shader writes for a picture.
pub(super) fn bytes_of(projection: &Projection) -> u64 {
    projection.pixels() as u64 * PIXEL_BYTES + u64::from(projection.width) * COLUMN_BYTES
}

/// Puts what the shader wrote into a panorama that has its size.
pub(super) fn unpack(written: &[u8], codes: &mut Codes, out: &mut Panorama) -> Result<()> {
    let (pixels, hits) = written.split_at(out.projection.pixels() * PIXEL_BYTES as usize);
    let pixels: &[[u32; 2]] = bytemuck::try_cast_slice(pixels).map_err(|e| gpu_error(&e))?;
    let hits: &[[u16; MAX_HITS]] = bytemuck::try_cast_slice(hits).map_err(|e| gpu_error(&e))?;
    codes.clear();
    codes.extend(hits.iter().map(|hits| {
        let mut codes = [0; CODES];
        codes[..ROOM_CODES.len()].copy_from_slice(&ROOM_CODES);
        codes[ROOM_CODES.len()..][..MAX_HITS].copy_from_slice(hits);
        codes
    }));
    let width = hits.len();
    let rows = out.rgba.chunks_exact_mut(4 * width).zip(out.range_m.chunks_exact_mut(width));
    let rows = rows.zip(out.instance.chunks_exact_mut(width)).zip(pixels.chunks_exact(width));
    for (((rgba, range), instance), pixels) in rows {
        for ((rgba, range), [colour, bits]) in rgba.as_chunks_mut().0.iter_mut().zip(range).zip(pixels) {
            *rgba = (colour | 0xff00_0000).to_le_bytes();
            *range = f32::from_bits(*bits);
        }
        for ((instance, codes), [colour, _]) in instance.iter_mut().zip(&*codes).zip(pixels) {
            *instance = codes[(colour >> 24) as usize % CODES];
        }
    }
    Ok(())
}
