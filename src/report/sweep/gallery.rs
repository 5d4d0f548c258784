//! Failures to look at: the path and the last panorama of a run, small enough to travel in a page.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::draw::image::colours_jpeg;
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
    if let Some(jpeg) = record.pictures.end.as_ref().and_then(|end| colours_jpeg(end, QUALITY, WIDTH_PX, "last panorama").ok())
    {
        html += &picture("last panorama", row.episode, "jpeg", &jpeg);
    }
    html
}

/// A picture whose address holds its bytes (RFC 2397).
fn picture(what: &str, episode: u64, kind: &str, bytes: &[u8]) -> String {
    format!("<img alt=\"{what} of row {episode}\" src=\"data:image/{kind};base64,{}\">", STANDARD.encode(bytes))
}
