//! Failures to look at: the path and the last panorama of a run, small enough to travel in a page.

use image::codecs::jpeg::JpegEncoder;
use image::imageops::FilterType;
use image::{DynamicImage, ImageBuffer, Rgb};

use crate::error::Result;
use crate::panorama::Panorama;
use crate::record::path_plot::path_drawing;
use crate::study::sweep::store::StudyFolder;
use crate::study::sweep::{Row, replay};

/// Width of a panorama in the page, px.
const WIDTH_PX: u32 = 480;
/// Quality of its JPEG.
const QUALITY: u8 = 72;

/// A failed run as the page shows it.
pub(super) struct Exhibit {
    /// Its row.
    pub row: Row,
    /// The path on the map, SVG.
    pub path: String,
    /// The last panorama, JPEG; `None` for a sensor without a camera.
    pub panorama: Option<Vec<u8>>,
}

/// Runs an episode again, and keeps what the page shows of it. `None` where it does not run as its row says, because another
/// machine's graphics or another build made the row.
pub(super) fn exhibit(folder: &StudyFolder, row: &Row) -> Result<Option<Exhibit>> {
    let (world, _, record, _, again) = replay(folder.study(), row.episode)?;
    if again != *row {
        return Ok(None);
    }
    let panorama = record.pictures.end.as_ref().and_then(jpeg);
    Ok(Some(Exhibit { row: again, path: path_drawing(&world, &record).without_legend().to_svg(), panorama }))
}

fn jpeg(panorama: &Panorama) -> Option<Vec<u8>> {
    let (width, height) = (panorama.projection.width, panorama.projection.height);
    let colours: Vec<u8> = panorama.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let picture = ImageBuffer::<Rgb<u8>, _>::from_raw(width, height, colours).map(DynamicImage::ImageRgb8)?;
    let picture = if width > WIDTH_PX { picture.resize(WIDTH_PX, height, FilterType::Triangle) } else { picture };
    let mut bytes = Vec::new();
    picture.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY)).ok()?;
    Some(bytes)
}

/// Bytes as a URI that holds them (RFC 2397), in base 64 (RFC 4648).
pub(super) fn data_uri(kind: &str, bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut uri = format!("data:{kind};base64,");
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0_u32, |bits, k| bits << 8 | u32::from(three.get(k).copied().unwrap_or(0)));
        for k in 0..4 {
            let letter = char::from(LETTERS[(bits >> (18 - 6 * k) & 63) as usize]);
            uri.push(if k <= three.len() { letter } else { '=' });
        }
    }
    uri
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_64_as_the_standard_has_it() {
        for (plain, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(data_uri("text/plain", plain.as_bytes()), format!("data:text/plain;base64,{coded}"));
        }
    }
}
