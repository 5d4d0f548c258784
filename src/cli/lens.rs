//! What a user says of his own pictures.

use anyhow::Result;
use wayhome::panorama_set::{Lens, LensKind, RingModel};

use super::values::{choice, number, point};

/// Heading of these flags.
const PICTURES: &str = "Pictures";

/// How pictures become panoramas.
#[derive(Debug, Clone, clap::Args)]
pub struct LensArgs {
    /// How the camera spreads what it sees over its picture
    #[arg(long, default_value = "equirectangular", value_parser = choice::<LensKind>(), help_heading = PICTURES)]
    pub lens: LensKind,
    /// Row of the horizon, from the top edge [default: the middle]
    #[arg(long, value_name = "ROW", value_parser = number, help_heading = PICTURES)]
    pub horizon_row: Option<f64>,
    /// Azimuth grows with the column, or anti-clockwise around a ring: the other way than cameras show it
    #[arg(long, help_heading = PICTURES)]
    pub anticlockwise: bool,
    /// Azimuth, from the heading, at which column 0 looks, or what is right of a ring's centre
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true, value_parser = number, help_heading = PICTURES)]
    pub column_0_deg: f64,
    /// Elevations that are kept; nearer to the poles an equirectangular picture is stretched beyond recognition
    #[arg(long, value_name = "LOW,HIGH", default_value = "-45,45", allow_hyphen_values = true, value_parser = point, help_heading = PICTURES)]
    pub elevation_deg: [f64; 2],
    /// Columns of the panorama [default: those of the picture, or of a ring's outer edge, 720 at most]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=16384), help_heading = PICTURES)]
    pub width_px: Option<u32>,
    /// Centre of a ring, pixels from the upper left corner [default: the middle]
    #[arg(long, value_name = "X,Y", value_parser = point, help_heading = PICTURES)]
    pub centre: Option<[f64; 2]>,
    /// Inner and outer radius of a ring, pixels [default: a tenth of what the picture holds, and that]
    #[arg(long, value_name = "INNER,OUTER", value_parser = point, help_heading = PICTURES)]
    pub radii: Option<[f64; 2]>,
    /// Elevations at the inner and the outer radius: rising for a mirror above the camera or a camera that looks down, falling for a
    /// fisheye that looks up
    #[arg(long, value_name = "INNER,OUTER", default_value = "-60,20", allow_hyphen_values = true, value_parser = point, help_heading = PICTURES)]
    pub ring_deg: [f64; 2],
    /// How far from a ring's centre a direction is seen
    #[arg(long, default_value = "equidistant", value_parser = choice::<RingModel>(), help_heading = PICTURES)]
    pub model: RingModel,
}

/// Panoramas that nobody gave a width are no wider: photographs are not as sharp as they are large, and more is found in smaller ones.
const USUAL_PX: u32 = 720;

impl LensArgs {
    /// The lens, with the panorama's width where one is given.
    pub fn lens(&self) -> Lens {
        Lens {
            kind: self.lens,
            horizon_row: self.horizon_row,
            is_anticlockwise: self.anticlockwise,
            column_0_rad: self.column_0_deg.to_radians(),
            elevation_rad: self.elevation_deg.map(f64::to_radians),
            width_px: self.width_px,
            centre_px: self.centre,
            radii_px: self.radii,
            ring_elevations_rad: self.ring_deg.map(f64::to_radians),
            model: self.model,
        }
    }

    /// The lens for pictures of which this is one: all panoramas become as wide as it does.
    pub fn lens_like(&self, picture: &std::path::Path) -> Result<Lens> {
        let lens = self.lens();
        if lens.width_px.is_some() {
            return Ok(lens);
        }
        let width = lens.read(picture)?.projection.width;
        Ok(Lens { width_px: Some(width.min(USUAL_PX)), ..lens })
    }
}
