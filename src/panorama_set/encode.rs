//! Panoramas as the bytes of picture files.
//!
//! Which compression and filter serve a channel best was measured: `wayhome verify dataset` makes the table again. Colours and
//! ranges are predicted by Paeth's filter, instances by the row above, and all go through fdeflate, which is some three times
//! as fast on them as zlib's fastest level.

use std::path::Path;

use png::{BitDepth, ColorType, DeflateCompression, Filter};

use crate::error::{Error, Result};
use crate::panorama::Panorama;

/// A filter and a compression of PNG files.
#[derive(Debug, Clone, Copy)]
pub struct Coding {
    /// Compression.
    pub compression: DeflateCompression,
    /// Filter.
    pub filter: Filter,
}

/// How colours are coded.
pub(super) const RGB: Coding = Coding { compression: DeflateCompression::FdeflateUltraFast, filter: Filter::Paeth };
/// How ranges are coded.
pub(super) const RANGE: Coding = RGB;
/// How instances are coded.
pub(super) const INSTANCE: Coding = Coding { filter: Filter::Up, ..RGB };

/// The codings that are worth comparing, with their names.
#[must_use]
pub fn modes() -> Vec<(String, Coding)> {
    let filters = [Filter::NoFilter, Filter::Sub, Filter::Up, Filter::Avg, Filter::Paeth, Filter::Adaptive];
    let compressions = [
        ("fdeflate", DeflateCompression::FdeflateUltraFast),
        ("zlib 1", DeflateCompression::Level(1)),
        ("zlib 6", DeflateCompression::Level(6)),
    ];
    let stored = Coding { compression: DeflateCompression::NoCompression, filter: Filter::NoFilter };
    let all = compressions.into_iter().flat_map(|(name, compression)| {
        filters.map(|filter| (format!("{name}, {}", filter_name(filter)), Coding { compression, filter }))
    });
    std::iter::once(("stored".to_owned(), stored)).chain(all).collect()
}

fn filter_name(filter: Filter) -> &'static str {
    match filter {
        Filter::NoFilter => "no filter",
        Filter::Sub => "sub",
        Filter::Up => "up",
        Filter::Avg => "average",
        Filter::Paeth => "Paeth",
        _ => "adaptive",
    }
}

/// Red, green, blue, row-major.
#[must_use]
pub fn packed_rgb(panorama: &Panorama) -> Vec<u8> {
    let mut packed = vec![0; 3 * panorama.projection.pixels()];
    for (to, from) in packed.chunks_exact_mut(3).zip(panorama.rgba.chunks_exact(4)) {
        to.copy_from_slice(&from[..3]);
    }
    packed
}

/// Ranges in millimetres, rounded, 16 bits with the higher byte first; 65535 stands for all that is farther.
#[must_use]
pub fn packed_range(panorama: &Panorama) -> Vec<u8> {
    let mut packed = vec![0; 2 * panorama.range_m.len()];
    for (to, range_m) in packed.chunks_exact_mut(2).zip(&panorama.range_m) {
        // The cast saturates: below zero at 0, above at 65535. Rounding is to the nearest, as ranges are not negative.
        to.copy_from_slice(&((f64::from(*range_m) * 1000.0 + 0.5) as u16).to_be_bytes());
    }
    packed
}

/// Instance ids, 16 bits with the higher byte first.
#[must_use]
pub fn packed_instance(panorama: &Panorama) -> Vec<u8> {
    panorama.instance.iter().flat_map(|id| id.to_be_bytes()).collect()
}

/// The colours as PNG, 8 bits a channel.
///
/// # Errors
/// When the panorama cannot be encoded; `name` is what the error calls the file.
pub fn encode_rgb(panorama: &Panorama, name: &str) -> Result<Vec<u8>> {
    encode(&packed_rgb(panorama), panorama, (ColorType::Rgb, BitDepth::Eight), RGB, name)
}

/// The range as PNG: millimetres, 16 bits.
///
/// # Errors
/// As [`encode_rgb`], and when the panorama has no range.
pub fn encode_range(panorama: &Panorama, name: &str) -> Result<Vec<u8>> {
    encode(&packed_range(panorama), panorama, (ColorType::Grayscale, BitDepth::Sixteen), RANGE, name)
}

/// The instance ids as PNG, 16 bits.
///
/// # Errors
/// As [`encode_rgb`], and when the panorama has no instances.
pub fn encode_instance(panorama: &Panorama, name: &str) -> Result<Vec<u8>> {
    encode(&packed_instance(panorama), panorama, (ColorType::Grayscale, BitDepth::Sixteen), INSTANCE, name)
}

/// The luma as binary PGM, 8 bits.
#[must_use]
pub fn encode_grey(panorama: &Panorama) -> Vec<u8> {
    let (width, height) = (panorama.projection.width, panorama.projection.height);
    let mut bytes = format!("P5\n{width} {height}\n255\n").into_bytes();
    bytes.extend(panorama.rgba.chunks_exact(4).map(luma));
    bytes
}

/// Luma of a pixel by BT.601's weights in integers: the same on every machine.
pub(super) fn luma(pixel: &[u8]) -> u8 {
    let [r, g, b] = [pixel[0], pixel[1], pixel[2]].map(u32::from);
    ((299 * r + 587 * g + 114 * b + 500) / 1000) as u8
}

impl Coding {
    /// Codes packed colours (3 bytes a pixel) or 16-bit numbers (2 bytes a pixel).
    ///
    /// # Errors
    /// When the bytes are not as many as the size asks for.
    pub fn encode(self, packed: &[u8], width: u32, height: u32) -> std::result::Result<Vec<u8>, png::EncodingError> {
        let pixels = width as usize * height as usize;
        let format = if packed.len() == 3 * pixels {
            (ColorType::Rgb, BitDepth::Eight)
        } else {
            (ColorType::Grayscale, BitDepth::Sixteen)
        };
        self.encode_as(packed, (width, height), format)
    }

    fn encode_as(
        self,
        packed: &[u8],
        (width, height): (u32, u32),
        (colour, depth): (ColorType, BitDepth),
    ) -> std::result::Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::with_capacity(packed.len() / 2 + 1024);
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        encoder.set_deflate_compression(self.compression);
        encoder.set_filter(self.filter);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(packed)?;
        writer.finish()?;
        Ok(bytes)
    }
}

fn encode(packed: &[u8], of: &Panorama, format: (ColorType, BitDepth), coding: Coding, name: &str) -> Result<Vec<u8>> {
    let size = (of.projection.width, of.projection.height);
    coding.encode_as(packed, size, format).map_err(|e| {
        let error = image::error::EncodingError::new(image::ImageFormat::Png.into(), e);
        Error::Image { path: Path::new(name).to_owned(), source: image::ImageError::Encoding(error) }
    })
}
