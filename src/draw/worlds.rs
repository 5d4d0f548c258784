//! Contact sheets of worlds: what the camera sees at home, and the room from above.

use std::path::Path;

use color_quant::NeuQuant;
use image::{Rgb, RgbImage, imageops};

use super::image::colours;
use super::raster::{RoomRaster, opaque};
use crate::error::{Error, Result};
use crate::panorama::Panorama;
use crate::world::World;

/// Width of a world's cell, and greatest height of its room from above, px.
pub const CELL_PX: u32 = 420;
const ROOM_PX: u32 = 240;
/// Worlds beside one another, and free space between them, px.
const COLUMNS: u32 = 3;
const GAP_PX: u32 = 12;
/// Every how many pixels colours are chosen from.
const SAMPLE: i32 = 5;
/// Colours of a sheet.
const COLOURS: usize = 256;

/// A sheet in the making: three worlds in a row, in the order in which they come.
#[derive(Debug, Clone, Default)]
pub struct WorldSheet {
    cells: Vec<RgbImage>,
}

impl WorldSheet {
    /// Adds a world, with what its camera sees at home, [`CELL_PX`] columns wide.
    ///
    /// # Errors
    /// When there is no memory for the picture.
    pub fn add(&mut self, world: &World, seen: &Panorama) -> Result<()> {
        let memory = || Error::Memory { bytes: 4 * (CELL_PX * ROOM_PX) as usize };
        let room = RoomRaster::new(world, CELL_PX, ROOM_PX).ok_or_else(memory)?.at_rest();
        let (room, panorama) = opaque(&room).zip(colours(seen)).ok_or_else(memory)?;
        let mut cell = RgbImage::from_pixel(CELL_PX, panorama.height() + room.height(), Rgb([255; 3]));
        imageops::replace(&mut cell, &panorama, 0, 0);
        imageops::replace(&mut cell, &room, 0, i64::from(panorama.height()));
        self.cells.push(cell);
        Ok(())
    }

    /// The sheet.
    pub fn image(&self) -> RgbImage {
        let rows: Vec<&[RgbImage]> = self.cells.chunks(COLUMNS as usize).collect();
        let heights: Vec<u32> = rows.iter().map(|row| row.iter().map(RgbImage::height).max().unwrap_or(0)).collect();
        let columns = (self.cells.len() as u32).clamp(1, COLUMNS);
        let width = columns * (CELL_PX + GAP_PX) - GAP_PX;
        let height = heights.iter().map(|h| h + GAP_PX).sum::<u32>().max(GAP_PX + 1) - GAP_PX;
        let mut sheet = RgbImage::from_pixel(width, height, Rgb([255; 3]));
        let mut top = 0;
        for (row, height) in rows.into_iter().zip(heights) {
            for (cell, column) in row.iter().zip(0_u32..) {
                imageops::replace(&mut sheet, cell, i64::from(column * (CELL_PX + GAP_PX)), i64::from(top));
            }
            top += height + GAP_PX;
        }
        sheet
    }

    /// The sheet as a PNG file of 256 colours: a third of the size that it has with all of them.
    ///
    /// # Errors
    /// When it cannot be encoded; `path` is what the error calls it.
    pub fn png(&self, path: &Path) -> Result<Vec<u8>> {
        let image = self.image();
        let rgba: Vec<u8> = image.pixels().flat_map(|p| [p.0[0], p.0[1], p.0[2], 255]).collect();
        let palette = NeuQuant::new(SAMPLE, COLOURS, &rgba);
        let numbers: Vec<u8> = rgba.chunks_exact(4).map(|p| palette.index_of(p) as u8).collect();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, image.width(), image.height());
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        encoder.set_filter(png::Filter::NoFilter);
        encoder.set_palette(palette.color_map_rgb());
        let fault = |e: png::EncodingError| Error::Io { action: "write", path: path.to_owned(), source: e.into() };
        let mut writer = encoder.write_header().map_err(fault)?;
        writer.write_image_data(&numbers).map_err(fault)?;
        writer.finish().map_err(fault)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_rows_of_three_and_keeps_its_colours() {
        let world = World::open("lab").unwrap();
        let mut seen = Panorama::black(world.projection_of_size(CELL_PX, 20));
        seen.rgba.chunks_exact_mut(4).for_each(|p| p.copy_from_slice(&[200, 30, 40, 255]));
        let mut sheet = WorldSheet::default();
        for _ in 0..4 {
            sheet.add(&world, &seen).unwrap();
        }
        let image = sheet.image();
        assert_eq!(image.width(), 3 * CELL_PX + 2 * GAP_PX);
        let again = image::load_from_memory(&sheet.png(Path::new("sheet.png")).unwrap()).unwrap().to_rgb8();
        assert_eq!(again.dimensions(), image.dimensions());
        let near = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) < 12);
        assert!(near(again.get_pixel(5, 5).0, [200, 30, 40]), "{:?}", again.get_pixel(5, 5));
        assert!(near(again.get_pixel(CELL_PX + 5, 5).0, [255; 3]), "between the cells");
        assert!(near(again.get_pixel(2 * CELL_PX, image.height() - 9).0, [255; 3]), "where the last row ends");
    }
}
