//! Failures to look at: the path and the last panorama of a run, small enough to travel in a page.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::FilterType;
use image::{DynamicImage, ImageBuffer, Rgb};

use crate::panorama::Panorama;
use crate::record::path_plot::path_drawing;
use crate::study::sweep::Exhibit;

/// Width of a panorama in the page, px.
const WIDTH_PX: u32 = 480;
/// Quality of its JPEG.
const QUALITY: u8 = 72;

/// The path of a run on the map, and its last panorama where there is one, as elements of a page.
pub(super) fn pictures(Exhibit { row, world, record }: &Exhibit) -> String {
    let path = path_drawing(world, record).without_legend().to_svg();
    let mut html = picture("path", row.episode, "svg+xml", path.as_bytes());
    if let Some(jpeg) = record.pictures.end.as_ref().and_then(jpeg) {
        html += &picture("last panorama", row.episode, "jpeg", &jpeg);
    }
    html
}

/// A picture whose address holds its bytes (RFC 2397).
fn picture(what: &str, episode: u64, kind: &str, bytes: &[u8]) -> String {
    format!("<img alt=\"{what} of row {episode}\" src=\"data:image/{kind};base64,{}\">", STANDARD.encode(bytes))
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
