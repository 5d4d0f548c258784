//! Panoramas as PNG files.

use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::imageops::FilterType::Triangle;
use image::{DynamicImage, ImageBuffer, RgbImage};

use crate::error::{Error, Result};
use crate::panorama::Panorama;

/// The colours, 8 bits a channel.
///
/// # Errors
/// When the panorama cannot be encoded; `name` is what the error calls it.
pub fn colours_png(panorama: &Panorama, name: &str) -> Result<Vec<u8>> {
    panorama.picture().png().map_err(|source| Error::Image { path: Path::new(name).to_owned(), source })
}

/// The colours as a picture; `None` where the panorama has not all of them.
pub(crate) fn colours(panorama: &Panorama) -> Option<RgbImage> {
    RgbImage::from_raw(panorama.projection.width, panorama.projection.height, panorama.picture().rgb())
}

/// The colours as a JPEG file, made smaller where they are wider than `widest_px`.
///
/// # Errors
/// When the panorama lacks colours or cannot be encoded; `name` is what the error calls it.
pub(crate) fn colours_jpeg(panorama: &Panorama, quality: u8, widest_px: u32, name: &str) -> Result<Vec<u8>> {
    let picture = DynamicImage::ImageRgb8(colours(panorama).ok_or_else(|| unfilled(name))?);
    let small = picture.width() <= widest_px;
    let picture = if small { picture } else { picture.resize(widest_px, picture.height(), Triangle) };
    let mut bytes = Vec::new();
    let written = picture.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, quality));
    written.map_err(|source| Error::Image { path: Path::new(name).to_owned(), source })?;
    Ok(bytes)
}

/// The range in millimetres, rounded, 16 bits; 65535 stands for all that is farther.
///
/// # Errors
/// When the panorama has no range or cannot be encoded; `name` is what the error calls it.
pub fn range_png(panorama: &Panorama, name: &str) -> Result<Vec<u8>> {
    // The cast saturates: below zero at 0, above at 65535.
    let millimetres = panorama.range_m.iter().map(|r| (f64::from(*r) * 1000.0).round() as u16).collect();
    encode_16_bits(panorama, millimetres, name)
}

/// The instance ids, 16 bits.
///
/// # Errors
/// When the panorama has no instances or cannot be encoded; `name` is what the error calls it.
pub fn instance_png(panorama: &Panorama, name: &str) -> Result<Vec<u8>> {
    encode_16_bits(panorama, panorama.instance.clone(), name)
}

fn encode_16_bits(panorama: &Panorama, values: Vec<u16>, name: &str) -> Result<Vec<u8>> {
    let (width, height) = (panorama.projection.width, panorama.projection.height);
    let filled = values.len() == panorama.projection.pixels();
    let image = filled.then(|| ImageBuffer::from_raw(width, height, values)).flatten();
    encode(&DynamicImage::ImageLuma16(image.ok_or_else(|| unfilled(name))?), name)
}

fn unfilled(name: &str) -> Error {
    let found = "a channel of another size than the panorama".into();
    Error::Invalid { what: format!("panorama for {name}"), found, allowed: "a value for every pixel".into() }
}

/// An image as a PNG file, by the fast compression: the better one takes twenty times as long for a tenth less.
///
/// # Errors
/// When it cannot be encoded; `name` is what the error calls it.
pub(super) fn encode(image: &DynamicImage, name: &str) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    image.write_with_encoder(encoder).map_err(|source| Error::Image { path: Path::new(name).to_owned(), source })?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::Projection;

    #[test]
    fn channels_survive_the_file() {
        let mut panorama = Panorama::black(Projection::new(4, 2));
        panorama.rgba[4..8].copy_from_slice(&[10, 20, 30, 255]);
        panorama.range_m[1] = 1.2346;
        panorama.range_m[2] = 99.0;
        panorama.instance[3] = 700;
        let load = |bytes: Vec<u8>| image::load_from_memory(&bytes).unwrap();
        assert_eq!(load(colours_png(&panorama, "rgb").unwrap()).to_rgb8().get_pixel(1, 0).0, [10, 20, 30]);
        let range = load(range_png(&panorama, "range").unwrap());
        assert_eq!(range.as_luma16().unwrap().as_raw()[..4], [0, 1235, 65535, 0]);
        let instance = load(instance_png(&panorama, "instance").unwrap());
        assert_eq!(instance.as_luma16().unwrap().get_pixel(3, 0).0, [700]);
        panorama.range_m.clear();
        assert!(range_png(&panorama, "range").is_err());
    }
}
