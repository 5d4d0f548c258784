//! Grey views, as whole-image methods compare them.

use image::GrayImage;
use image::imageops::{FilterType, resize};

use crate::error::{Error, Result};
use crate::panorama::{Panorama, Projection};

/// A grey panorama: rows of columns that go once round, anti-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Grey {
    /// Size and projection.
    pub projection: Projection,
    /// Grey levels, row by row from the top.
    pub pixels: Vec<u8>,
}

impl Grey {
    /// The luminance of a panorama (ITU-R BT.601).
    #[must_use]
    pub fn of(panorama: &Panorama) -> Self {
        let grey = |p: &[u8]| ((299 * u32::from(p[0]) + 587 * u32::from(p[1]) + 114 * u32::from(p[2]) + 500) / 1000) as u8;
        Self { projection: panorama.projection, pixels: panorama.rgba.chunks_exact(4).map(grey).collect() }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.projection.width as usize
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.projection.height as usize
    }

    /// The same view in so many columns, and as many fewer or more rows, each pixel a mean of those that it stands for.
    #[must_use]
    pub fn resized(&self, width: u32) -> Self {
        let taken = &self.projection;
        if width == taken.width {
            return self.clone();
        }
        let scale = f64::from(width) / f64::from(taken.width);
        let height = ((f64::from(taken.height) * scale).round() as u32).max(1);
        let Some(picture) = GrayImage::from_raw(taken.width, taken.height, self.pixels.clone()) else { return self.clone() };
        let pixels = resize(&picture, width, height, FilterType::Triangle).into_raw();
        Self { projection: Projection { width, height, horizon_row: taken.horizon_row * scale, ..*taken }, pixels }
    }

    /// Refuses a view of another size or projection.
    ///
    /// # Errors
    /// Where the two differ.
    pub fn check_like(&self, home: &Self) -> Result<()> {
        if self.projection == home.projection {
            return Ok(());
        }
        let say = |p: &Projection| {
            format!(
                "{} x {} pixels, horizon on row {:.1}, column 0 at {:.3} rad, {:?}",
                p.width, p.height, p.horizon_row, p.mount_rad, p.kind
            )
        };
        Err(Error::Unfit { what: "view".to_owned(), found: say(&self.projection), needed: say(&home.projection) })
    }
}
