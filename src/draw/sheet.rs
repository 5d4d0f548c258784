//! Contact sheets: panoramas beneath one another, each with its range and instances in false colours.

use image::{DynamicImage, Rgb, RgbImage};

use super::image::{colours, encode};
use crate::error::Result;
use crate::panorama::Panorama;

/// Free rows between the parts of a picture, and between pictures.
const GAP_PX: [u32; 2] = [2, 10];
/// Colour of what is free.
const PAPER: Rgb<u8> = Rgb([255, 255, 255]);
/// Colours of ranges, from near to far. Lightness falls all the way.
const RANGE: [[f32; 3]; 5] =
    [[253.0, 231.0, 37.0], [94.0, 201.0, 98.0], [33.0, 145.0, 140.0], [59.0, 82.0, 139.0], [68.0, 1.0, 84.0]];

/// A sheet in the making: all panoramas that it gets should be as wide.
#[derive(Debug, Clone, Default)]
pub struct Sheet {
    strips: Vec<(RgbImage, u32)>,
}

impl Sheet {
    /// A sheet without pictures.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a panorama's colours and, where it has them, its ranges and instances beneath.
    pub fn add(&mut self, panorama: &Panorama) {
        let [within, between] = GAP_PX;
        self.add_colours(panorama);
        // Nearest to farthest of what is seen fill the colours; 0 is nothing.
        let farthest = panorama.range_m.iter().copied().fold(0.0, f32::max);
        for colours in [
            panorama.range_m.iter().map(|r| range_colour(r / farthest)).collect::<Vec<_>>(),
            panorama.instance.iter().map(|id| instance_colour(*id)).collect(),
        ] {
            if let (Some(last), Some(image)) = (self.strips.last_mut(), strip(panorama, colours.concat())) {
                last.1 = within;
                self.strips.push((image, between));
            }
        }
    }

    /// Adds the colours of a panorama.
    pub fn add_colours(&mut self, panorama: &Panorama) {
        self.strips.extend(colours(panorama).map(|image| (image, GAP_PX[1])));
    }

    /// The sheet.
    pub fn image(&self) -> RgbImage {
        let width = self.strips.iter().map(|s| s.0.width()).max().unwrap_or(1);
        let height: u32 = self.strips.iter().map(|(image, gap)| image.height() + gap).sum();
        let last_gap = self.strips.last().map_or(0, |s| s.1);
        let mut sheet = RgbImage::from_pixel(width, (height - last_gap).max(1), PAPER);
        let mut top = 0;
        for (image, gap) in &self.strips {
            image::imageops::replace(&mut sheet, image, 0, i64::from(top));
            top += image.height() + gap;
        }
        sheet
    }

    /// The sheet as a PNG file.
    ///
    /// # Errors
    /// When it cannot be encoded; `name` is what the error calls it.
    pub fn png(&self, name: &str) -> Result<Vec<u8>> {
        encode(&DynamicImage::ImageRgb8(self.image()), name)
    }
}

fn strip(panorama: &Panorama, rgb: Vec<u8>) -> Option<RgbImage> {
    // `None` where the panorama lacks the channel.
    RgbImage::from_raw(panorama.projection.width, panorama.projection.height, rgb).filter(|i| i.width() > 0)
}

/// Colour of a range as a share of the farthest one; nothing is black.
fn range_colour(share: f32) -> [u8; 3] {
    if share <= 0.0 || share.is_nan() {
        return [0; 3];
    }
    // Near things differ in small steps: the root gives them more of the colours.
    let place = share.sqrt().min(1.0) * (RANGE.len() - 1) as f32;
    let before = (place as usize).min(RANGE.len() - 2);
    let t = place - before as f32;
    std::array::from_fn(|c| (RANGE[before][c] + t * (RANGE[before + 1][c] - RANGE[before][c]) + 0.5) as u8)
}

/// Colour of an instance: always the same one, and far from those of its neighbours. Nothing is black.
fn instance_colour(id: u16) -> [u8; 3] {
    if id == 0 {
        return [0; 3];
    }
    // Hues by the golden section, in two shades.
    let hue = (0.618_034 * f32::from(id)).fract() * 6.0;
    let value = if id.is_multiple_of(2) { 235.0 } else { 165.0 };
    [5.0_f32, 3.0, 1.0].map(|offset| {
        let k = (offset + hue) % 6.0;
        (value * (1.0 - 0.65 * k.min(4.0 - k).clamp(0.0, 1.0)) + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::Projection;

    #[test]
    fn a_sheet_shows_what_a_panorama_has() {
        let mut panorama = Panorama::black(Projection::new(6, 4));
        panorama.range_m.fill(2.0);
        panorama.instance.fill(3);
        let mut sheet = Sheet::new();
        sheet.add(&panorama);
        sheet.add(&panorama);
        let image = sheet.image();
        assert_eq!((image.width(), image.height()), (6, 2 * (3 * 4 + 2 * 2) + 10));
        assert_eq!(image.get_pixel(0, 0).0, [0; 3]);
        assert_eq!(image.get_pixel(0, 4).0, PAPER.0);
        assert_eq!(image.get_pixel(5, 6).0, [68, 1, 84], "the farthest is dark");
        assert_eq!(image.get_pixel(5, 12).0, instance_colour(3));
        panorama.range_m.clear();
        panorama.instance.clear();
        let mut colours = Sheet::new();
        colours.add(&panorama);
        assert_eq!(colours.image().height(), 4);
    }

    #[test]
    fn neighbouring_instances_differ() {
        for id in 1..200_u16 {
            let (a, b) = (instance_colour(id), instance_colour(id + 1));
            let apart: u32 = a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(b))).sum();
            assert!(apart > 90, "{id}: {a:?} and {b:?}");
        }
    }
}
