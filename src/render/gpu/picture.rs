//! Pictures as the shader writes them: a word for each pixel, its colour and a code for what it shows, and for each column what
//! its codes stand for. Range follows from that and the row: so a pixel is 4 bytes on its way back instead of 10.

use bytemuck::{Pod, Zeroable};

use super::gpu_error;
use crate::error::Result;
use crate::panorama::{INSTANCE_CEILING, INSTANCE_FLOOR, Panorama, Projection};
use crate::render::columns::MAX_HITS;
use crate::render::now::{Now, Shown, Unit};
use crate::render::records::Row;

/// Bytes that the shader writes for a pixel.
pub(super) const PIXEL_BYTES: u64 = 4;
/// Bytes that it writes for a column.
const COLUMN_BYTES: u64 = (MAX_HITS * size_of::<SeenHit>()) as u64;
/// Codes of a column, as the shader has them: nothing, floor, ceiling, and for each hit one for its side and one for its top or
/// underside.
const CODES: usize = 3 + 2 * MAX_HITS;
/// The code of a column whose first row has not come yet.
const NO_CODE: u8 = u8::MAX;

/// A hit of a column. The layout is that which `show_hits` of `shaders/panorama.wgsl` writes.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct SeenHit {
    /// Instance id.
    instance: u32,
    /// Horizontal distance of the side, m.
    near: f32,
    /// Height of the top or underside over the camera, m.
    height: f32,
}

/// Bytes that the shader writes for a picture.
pub(super) fn bytes_of(projection: &Projection) -> u64 {
    projection.pixels() as u64 * PIXEL_BYTES + u64::from(projection.width) * COLUMN_BYTES
}

/// What the columns of a picture show in the row at work; its memory serves one picture after the other.
#[derive(Debug, Default)]
pub(super) struct Unpacker {
    codes: Vec<u8>,
    now: Now,
}

impl Unpacker {
    /// Puts what the shader wrote into a panorama that has its size; `rows` are those of its view.
    pub fn unpack(&mut self, written: &[u8], rows: &[Row], out: &mut Panorama) -> Result<()> {
        let width = out.projection.width as usize;
        let (pixels, hits) = written.split_at(out.projection.pixels() * PIXEL_BYTES as usize);
        let pixels: &[u32] = bytemuck::try_cast_slice(pixels).map_err(|e| gpu_error(&e))?;
        let hits: &[[SeenHit; MAX_HITS]] = bytemuck::try_cast_slice(hits).map_err(|e| gpu_error(&e))?;
        self.codes.clear();
        self.codes.resize(width, NO_CODE);
        self.now.resize(width);
        let out_rows = out.rgba.chunks_exact_mut(4 * width).zip(out.range_m.chunks_exact_mut(width));
        let out_rows = out_rows.zip(out.instance.chunks_exact_mut(width));
        for (((rgba, range), instance), (pixels, row)) in out_rows.zip(pixels.chunks_exact(width).zip(rows)) {
            for (rgba, pixel) in rgba.as_chunks_mut().0.iter_mut().zip(pixels) {
                *rgba = (pixel | 0xff00_0000).to_le_bytes();
            }
            for (column, (pixel, code)) in pixels.iter().zip(&mut self.codes).enumerate() {
                let new = (pixel >> 24) as u8;
                if new != *code {
                    *code = new;
                    self.now.set(column, shown(new, &hits[column]));
                }
            }
            self.now.show(*row, instance, range);
        }
        Ok(())
    }
}

/// What a code of a column with such hits stands for.
fn shown(code: u8, hits: &[SeenHit; MAX_HITS]) -> Shown {
    let room = |instance| Shown { distance: 1.0, unit: Unit::Plane, instance };
    match usize::from(code) {
        1 => room(INSTANCE_FLOOR),
        2 => room(INSTANCE_CEILING),
        code @ 3..CODES => {
            let hit = hits[(code - 3) / 2];
            let instance = hit.instance as u16;
            if code % 2 == 1 {
                Shown { distance: hit.near, unit: Unit::Metre, instance }
            } else {
                Shown { distance: hit.height, unit: Unit::InverseTan, instance }
            }
        }
        // Nothing is at no distance.
        _ => Shown::default(),
    }
}
