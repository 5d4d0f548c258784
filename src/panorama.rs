//! Panoramas: what a camera with a full turn of view sees, with range and instance beside the colours.
//!
//! Columns are evenly spaced in azimuth, and pixels are square at the horizon. Rows are evenly spaced in the tangent of
//! elevation (a cylinder) or in elevation itself (equal angles), see [`ProjectionKind`]. Column 0 looks along the robot's heading plus the camera's mounting offset; azimuth grows
//! anti-clockwise with the column. Row 0 is the top.

mod shot;

use std::f64::consts::TAU;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::geometry::{atan2, sin_cos, wrap};
pub use shot::{Appearance, Shot};

/// Instance id of the floor.
pub const INSTANCE_FLOOR: u16 = 1;
/// Instance id of the ceiling.
pub const INSTANCE_CEILING: u16 = 2;
/// Instance id of the first wall; walls and then bodies follow in the order of the world file.
pub const INSTANCE_FIRST_WALL: u16 = 3;

/// How elevation is spread over the rows of a panorama.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ProjectionKind {
    /// Evenly in its tangent: upright straight lines keep their proportions.
    #[default]
    Cylindrical,
    /// Evenly in the angle itself, by the same angle as the columns: 2 to 1 is the whole sphere.
    EqualAngle,
}

/// Size and projection of a panorama.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Projection {
    /// Columns; a full turn.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row of the horizon, in rows from the top edge; `height / 2` puts it in the middle.
    pub horizon_row: f64,
    /// Azimuth of the centre of column 0 from the robot's heading, rad.
    pub mount_rad: f64,
    /// How elevation is spread over the rows.
    #[serde(default)]
    pub kind: ProjectionKind,
}

impl Projection {
    /// A panorama of `width` x `height` with the horizon in the middle and column 0 along the heading.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, horizon_row: f64::from(height) / 2.0, mount_rad: 0.0, kind: ProjectionKind::Cylindrical }
    }

    /// Angle between neighbouring columns, rad; also the step between rows, of elevation or of its tangent.
    #[must_use]
    pub fn pixel_rad(&self) -> f64 {
        TAU / f64::from(self.width)
    }

    /// Azimuth from the robot's heading of a (sub-pixel) column, rad, in (-pi, pi]. Whole numbers are column centres.
    #[must_use]
    pub fn azimuth(&self, column: f64) -> f64 {
        wrap(column * self.pixel_rad() + self.mount_rad)
    }

    /// Column in [0, width) that looks along `azimuth_rad` from the robot's heading: the inverse of [`Projection::azimuth`].
    #[must_use]
    pub fn column(&self, azimuth_rad: f64) -> f64 {
        let width = f64::from(self.width);
        let column = wrap(azimuth_rad - self.mount_rad) / self.pixel_rad();
        let column = if column < 0.0 { column + width } else { column };
        if column >= width { 0.0 } else { column }
    }

    /// Tangent of the elevation of a (sub-pixel) row. Whole numbers are row centres.
    #[must_use]
    pub fn tan_elevation(&self, row: f64) -> f64 {
        let up = (self.horizon_row - 0.5 - row) * self.pixel_rad();
        match self.kind {
            ProjectionKind::Cylindrical => up,
            ProjectionKind::EqualAngle => {
                let (sin, cos) = sin_cos(up);
                sin / cos
            }
        }
    }

    /// Row whose tangent of elevation is `tan`: the inverse of [`Projection::tan_elevation`].
    #[must_use]
    pub fn row(&self, tan: f64) -> f64 {
        let up = match self.kind {
            ProjectionKind::Cylindrical => tan,
            ProjectionKind::EqualAngle => atan2(tan, 1.0),
        };
        self.horizon_row - 0.5 - up / self.pixel_rad()
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// A rendered or loaded panorama; all buffers are row-major, row 0 on top.
#[derive(Debug, Clone, PartialEq)]
pub struct Panorama {
    /// Size and projection.
    pub projection: Projection,
    /// Colours, 4 bytes a pixel (red, green, blue, 255).
    pub rgba: Vec<u8>,
    /// Range, m: straight-line distance from the camera's centre to the surface seen. Empty where unknown (a loaded image).
    pub range_m: Vec<f32>,
    /// Instance id of the surface seen. Empty where unknown.
    pub instance: Vec<u16>,
}

impl Panorama {
    /// A black panorama with buffers of the right size.
    #[must_use]
    pub fn black(projection: Projection) -> Self {
        let n = projection.pixels();
        Self { projection, rgba: vec![0; 4 * n], range_m: vec![0.0; n], instance: vec![0; n] }
    }

    /// A panorama without pixels, for [`Panorama::reshape`].
    #[must_use]
    pub fn empty() -> Self {
        Self::black(Projection::new(0, 0))
    }

    /// Makes room for another projection; what the pixels show afterwards is left open.
    ///
    /// # Errors
    /// [`Error::Memory`] when there is no room for so many.
    pub fn reshape(&mut self, projection: Projection) -> Result<()> {
        fn resize<T: Default + Clone>(values: &mut Vec<T>, count: usize) -> Result<()> {
            let bytes = count * size_of::<T>();
            values.try_reserve_exact(count.saturating_sub(values.len())).map_err(|_| Error::Memory { bytes })?;
            values.resize(count, T::default());
            Ok(())
        }
        let pixels = projection.pixels();
        resize(&mut self.rgba, 4 * pixels)?;
        resize(&mut self.range_m, pixels)?;
        resize(&mut self.instance, pixels)?;
        self.projection = projection;
        Ok(())
    }

    /// Its colours alone.
    #[must_use]
    pub fn picture(&self) -> Picture<'_> {
        Picture { projection: self.projection, rgba: &self.rgba }
    }

    /// Luma of every pixel (BT.601 weights), row-major, 0 to 255.
    #[must_use]
    pub fn luma(&self) -> Vec<f32> {
        self.rgba.chunks_exact(4).map(|p| 0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2])).collect()
    }
}

/// The colours of a panorama, without the ranges and instance ids that a rendered one has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picture<'a> {
    /// Size and projection.
    pub projection: Projection,
    /// Colours, row-major from the top, 4 bytes a pixel (red, green, blue, 255).
    pub rgba: &'a [u8],
}

impl Picture<'_> {
    /// Its colours, 3 bytes a pixel.
    #[must_use]
    pub fn rgb(&self) -> Vec<u8> {
        self.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
    }

    /// As a PNG file, 8 bits a channel, by the fast compression: the better one takes twenty times as long for a tenth less.
    ///
    /// # Errors
    /// When it cannot be encoded.
    pub fn png(&self) -> image::ImageResult<Vec<u8>> {
        let mut bytes = Vec::new();
        let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
        encoder.write_image(&self.rgb(), self.projection.width, self.projection.height, ExtendedColorType::Rgb8)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn column_and_azimuth_are_inverse() {
        let p = Projection { mount_rad: 0.3, ..Projection::new(1440, 180) };
        for column in [0.0, 0.25, 719.9, 720.0, 1439.5] {
            assert!((p.column(p.azimuth(column)) - column).abs() < 1e-9, "{column}");
        }
        for kind in [ProjectionKind::Cylindrical, ProjectionKind::EqualAngle] {
            let p = Projection { kind, ..p };
            assert!((p.row(p.tan_elevation(12.5)) - 12.5).abs() < 1e-9);
        }
        let sphere = Projection { kind: ProjectionKind::EqualAngle, ..Projection::new(720, 360) };
        assert!((sphere.tan_elevation(89.5) - 1.0).abs() < 1e-12, "45 degrees up");
        assert_eq!(Projection::new(8, 4).azimuth(2.0), std::f64::consts::FRAC_PI_2);
    }
}
