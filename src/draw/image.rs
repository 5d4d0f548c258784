//! Panoramas as PNG files.

use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{DynamicImage, ImageBuffer};

use crate::error::{Error, Result};
use crate::panorama::Panorama;

/// The colours, 8 bits a channel.
///
/// # Errors
/// When the panorama cannot be encoded; `name` is what the error calls it.
pub fn colours_png(panorama: &Panorama, name: &str) -> Result<Vec<u8>> {
    panorama.picture().png().map_err(|source| Error::Image { path: Path::new(name).to_owned(), source })
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
    let image = image.ok_or_else(|| Error::Invalid {
        what: format!("panorama for {name}"),
        found: "a channel of another size than the panorama".into(),
        allowed: "a value for every pixel".into(),
    })?;
    encode(&DynamicImage::ImageLuma16(image), name)
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
