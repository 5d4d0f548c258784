//! Pictures of real cameras as panoramas: equirectangular and cylindrical ones, and the ring that a mirror or a fisheye makes.
//!
//! A [`Lens`] says what a picture's pixels look at. All become panoramas of this project, columns anti-clockwise, rows evenly spaced in
//! elevation or, of a cylinder, in its tangent. A picture that is turned by its EXIF orientation is turned first.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use image::RgbaImage;
use image::imageops::{FilterType, resize};
use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use super::source::{MOST_PX, Source, mirror};
use crate::error::{Error, Result};
use crate::geometry::{atan2, sin_cos};
use crate::panorama::{Panorama, Projection, ProjectionKind};

/// How a camera spreads what it sees over its picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum LensKind {
    /// A full turn, rows evenly spaced in elevation: what panoramic cameras write, 2 to 1 for the whole sphere.
    #[default]
    Equirectangular,
    /// A full turn, rows evenly spaced in the tangent of elevation, pixels square at the horizon.
    Cylindrical,
    /// A ring around a centre: a camera under a mirror, or a fisheye that looks straight up or down.
    Ring,
}

/// How far from the centre of a ring a direction is seen, by its angle from the optical axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum RingModel {
    /// The angle itself: equi-angular mirrors and most fisheyes.
    #[default]
    Equidistant,
    /// The tangent of half the angle: stereographic fisheyes, and a parabolic mirror under an orthographic camera.
    Stereographic,
    /// The sine of half the angle.
    Equisolid,
    /// The sine of the angle.
    Orthographic,
}

impl RingModel {
    fn radius(self, angle_rad: f64) -> f64 {
        match self {
            Self::Equidistant => angle_rad,
            Self::Stereographic => {
                let (sin, cos) = sin_cos(0.5 * angle_rad);
                sin / cos
            }
            Self::Equisolid => sin_cos(0.5 * angle_rad).0,
            Self::Orthographic => sin_cos(angle_rad).0,
        }
    }

    /// Largest angle from the axis up to which the radius grows, rad.
    fn most_rad(self) -> f64 {
        if self == Self::Orthographic { FRAC_PI_2 } else { PI }
    }
}

/// What the pixels of a picture look at.
#[derive(Debug, Clone, PartialEq)]
pub struct Lens {
    /// How directions are spread over the picture.
    pub kind: LensKind,
    /// Row of the horizon from the top edge, rows of the picture; by default its middle. Not of a ring.
    pub horizon_row: Option<f64>,
    /// Whether azimuth grows with the column, or anti-clockwise around a ring. Cameras turn the other way.
    pub is_anticlockwise: bool,
    /// Azimuth from the heading at which column 0 looks, or what is right of a ring's centre, rad.
    pub column_0_rad: f64,
    /// Lowest and highest elevation that is kept, rad; less where the picture has less.
    pub elevation_rad: [f64; 2],
    /// Columns of the panorama; by default as many as the picture has, around the outer edge of a ring.
    pub width_px: Option<u32>,
    /// Centre of a ring: column and row, pixels from the upper left corner; by default the picture's middle.
    pub centre_px: Option<[f64; 2]>,
    /// Inner and outer radius of a ring, pixels; by default from a tenth of the largest that the picture holds to that.
    pub radii_px: Option<[f64; 2]>,
    /// Elevations at the inner and at the outer radius of a ring, rad. Where they rise, the camera or its mirror looks down.
    pub ring_elevations_rad: [f64; 2],
    /// How elevation goes from one to the other.
    pub model: RingModel,
}

impl Default for Lens {
    /// A camera's equirectangular picture, from 45 degrees below the horizon to 45 above: nearer to the poles rows are stretched beyond
    /// recognition.
    fn default() -> Self {
        Self {
            kind: LensKind::default(),
            horizon_row: None,
            is_anticlockwise: false,
            column_0_rad: 0.0,
            elevation_rad: [-PI / 4.0, PI / 4.0],
            width_px: None,
            centre_px: None,
            radii_px: None,
            ring_elevations_rad: [-PI / 3.0, PI / 9.0],
            model: RingModel::default(),
        }
    }
}

impl Lens {
    /// Reads a picture (PNG, JPEG or PNM).
    ///
    /// # Errors
    /// When it cannot be read or decoded, or cannot be a picture of this lens; the message says what it is and what is allowed.
    pub fn read(&self, path: &Path) -> Result<Panorama> {
        let root = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        self.read_within(root, &Source::File(path.to_owned()))
    }

    pub(super) fn read_within(&self, root: &Path, source: &Source) -> Result<Panorama> {
        self.unwrap(source.decode(root)?.to_rgba8(), source.file())
    }

    /// The panorama in a picture; `path` is what errors name.
    ///
    /// # Errors
    /// When it cannot be a picture of this lens.
    pub fn unwrap(&self, picture: RgbaImage, path: &Path) -> Result<Panorama> {
        let [low, high] = self.elevation_rad.map(f64::to_degrees);
        if low >= high || low.is_nan() || high.is_nan() {
            return Err(invalid("elevations", format!("{low:.1} to {high:.1} degrees"), "a range that rises"));
        }
        if self.width_px.is_some_and(|width| !(8..=MOST_PX).contains(&width)) {
            return Err(invalid("columns", self.width_px.unwrap_or_default().to_string(), &format!("8 to {MOST_PX}")));
        }
        let mut panorama = match self.kind {
            LensKind::Ring => self.ring(&picture, path)?,
            LensKind::Equirectangular | LensKind::Cylindrical => self.rows(picture, path)?,
        };
        if !self.is_anticlockwise {
            mirror(&mut panorama);
        }
        Ok(panorama)
    }

    /// Columns and rows as the picture has them, less those that are beyond the elevations.
    fn rows(&self, picture: RgbaImage, path: &Path) -> Result<Panorama> {
        let (taken_width, taken_height) = picture.dimensions();
        let fault = |found: String, expected: &str| Error::Parse {
            path: path.to_owned(),
            message: format!("found {found}, expected {expected}"),
        };
        let horizon = self.horizon_row.unwrap_or(0.5 * f64::from(taken_height));
        let kind = match self.kind {
            LensKind::Cylindrical => ProjectionKind::Cylindrical,
            _ => ProjectionKind::EqualAngle,
        };
        let taken = Projection { horizon_row: horizon, kind, ..Projection::new(taken_width, taken_height) };
        let [above, below] = [horizon, f64::from(taken_height) - horizon];
        let quarter = 0.25 * f64::from(taken_width);
        // A row may be lost to rounding.
        if kind == ProjectionKind::EqualAngle && (above > quarter + 1.0 || below > quarter + 1.0) {
            let found = format!("{taken_width} x {taken_height} pixels with the horizon on row {horizon}");
            return Err(fault(
                found,
                "at most a quarter of the width above and below the horizon of an equirectangular picture",
            ));
        }
        let width = self.width_px.unwrap_or(taken_width);
        let scale = f64::from(width) / f64::from(taken_width);
        let height = ((f64::from(taken_height) * scale).round() as u32).max(1);
        // Fewer pixels are means of more: `image` averages.
        let pixels = if width == taken_width { picture } else { resize(&picture, width, height, FilterType::Triangle) };
        let whole = Projection { width, height, horizon_row: horizon * scale, ..taken };
        let tan = |elevation_rad: f64| {
            let (sin, cos) = sin_cos(elevation_rad.clamp(-1.57, 1.57));
            sin / cos
        };
        // From the row whose middle is the first within, to the one whose middle is the last.
        let [first, last] = [self.elevation_rad[1], self.elevation_rad[0]].map(|e| whole.row(tan(e)));
        let first = first.ceil().max(0.0) as u32;
        let last = last.floor().min(f64::from(height) - 1.0);
        if last < f64::from(first) {
            let [low, high] = self.elevation_rad.map(f64::to_degrees);
            return Err(fault(format!("no row from {low:.1} to {high:.1} degrees of elevation"), "some"));
        }
        let rows = last as u32 - first + 1;
        let bytes = 4 * width as usize;
        let rgba = pixels.into_raw()[first as usize * bytes..(first + rows) as usize * bytes].to_vec();
        let horizon_row = whole.horizon_row - f64::from(first);
        let projection = Projection { height: rows, horizon_row, mount_rad: self.column_0_rad, ..whole };
        Ok(Panorama { projection, rgba, range_m: Vec::new(), instance: Vec::new() })
    }

    /// A ring unwrapped: each pixel of the panorama is looked up between four of the picture.
    fn ring(&self, picture: &RgbaImage, path: &Path) -> Result<Panorama> {
        let (taken_width, taken_height) = (f64::from(picture.width()), f64::from(picture.height()));
        let [x, y] = self.centre_px.unwrap_or([0.5 * taken_width, 0.5 * taken_height]);
        let room = x.min(y).min(taken_width - x).min(taken_height - y);
        let [inner, outer] = self.radii_px.unwrap_or([0.1 * room, room]);
        if !(inner >= 0.0 && outer > inner + 1.0 && outer <= room + 0.5) {
            return Err(Error::Parse {
                path: path.to_owned(),
                message: format!(
                    "found a ring of radii {inner} to {outer} px around ({x}, {y}) in {taken_width} x {taken_height} pixels, expected \
                     rising radii up to {room}, where the picture ends"
                ),
            });
        }
        let [at_inner, at_outer] = self.ring_elevations_rad;
        let looks_down = at_outer > at_inner;
        let angle = |elevation: f64| if looks_down { FRAC_PI_2 + elevation } else { FRAC_PI_2 - elevation };
        let [from, to] = [angle(at_inner), angle(at_outer)];
        let most = self.model.most_rad();
        if from < 0.0 || to > most + 1e-9 || to - from < 1e-3 {
            let found = format!("{:.1} to {:.1} degrees", at_inner.to_degrees(), at_outer.to_degrees());
            let allowed = format!("two elevations that differ, within {:.0} degrees of the optical axis", most.to_degrees());
            return Err(invalid("elevations at the radii of the ring", found, &allowed));
        }
        let [r_from, r_to] = [from, to].map(|a| self.model.radius(a));
        let [low, high] =
            [at_inner.min(at_outer).max(self.elevation_rad[0]), at_inner.max(at_outer).min(self.elevation_rad[1])];
        let width = self.width_px.unwrap_or((TAU * outer).round().clamp(8.0, f64::from(MOST_PX)) as u32);
        let pixel = TAU / f64::from(width);
        let height = ((high - low) / pixel).floor();
        if height < 1.0 {
            let [low, high] = self.elevation_rad.map(f64::to_degrees);
            return Err(invalid("elevations", format!("{low:.1} to {high:.1} degrees"), "some that the ring shows"));
        }
        let horizon_row = high / pixel;
        let projection = Projection {
            width,
            height: height as u32,
            horizon_row,
            mount_rad: self.column_0_rad,
            kind: ProjectionKind::EqualAngle,
        };
        let mut rgba = Vec::with_capacity(4 * projection.pixels());
        for row in 0..projection.height {
            let elevation = (horizon_row - 0.5 - f64::from(row)) * pixel;
            let radius = inner + (self.model.radius(angle(elevation)) - r_from) / (r_to - r_from) * (outer - inner);
            for column in 0..width {
                // Anti-clockwise in the picture; who sees it the other way round mirrors the columns.
                let (sin, cos) = sin_cos(f64::from(column) * pixel);
                rgba.extend(between(picture, x + radius * cos - 0.5, y - radius * sin - 0.5));
            }
        }
        Ok(Panorama { projection, rgba, range_m: Vec::new(), instance: Vec::new() })
    }
}

/// Elevation at a tangent of it, rad.
#[must_use]
pub fn elevation_rad(tan: f64) -> f64 {
    atan2(tan, 1.0)
}

/// The colour between the four pixels around a place; pixel centres have whole numbers.
fn between(picture: &RgbaImage, x: f64, y: f64) -> [u8; 4] {
    let (right, bottom) = (f64::from(picture.width()) - 1.0, f64::from(picture.height()) - 1.0);
    let (x, y) = (x.clamp(0.0, right), y.clamp(0.0, bottom));
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let at = |x: f64, y: f64| picture.get_pixel(x.min(right) as u32, y.min(bottom) as u32).0.map(f64::from);
    let [a, b, c, d] = [at(x0, y0), at(x0 + 1.0, y0), at(x0, y0 + 1.0), at(x0 + 1.0, y0 + 1.0)];
    std::array::from_fn(|k| {
        let (upper, lower) = (a[k] + fx * (b[k] - a[k]), c[k] + fx * (d[k] - c[k]));
        (upper + fy * (lower - upper)).round() as u8
    })
}

fn invalid(what: &str, found: String, allowed: &str) -> Error {
    Error::Invalid { what: what.to_owned(), found, allowed: allowed.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::wrap;

    /// What is seen in a direction, smooth and different everywhere.
    fn colour(azimuth_rad: f64, elevation_rad: f64) -> [u8; 4] {
        let (s, c) = sin_cos(azimuth_rad);
        [(127.0 + 100.0 * s) as u8, (127.0 + 100.0 * c) as u8, (127.0 + 80.0 * elevation_rad) as u8, 255]
    }

    /// Largest difference to what should be seen.
    fn off(panorama: &Panorama) -> i32 {
        let p = &panorama.projection;
        let mut most = 0;
        for (k, pixel) in panorama.rgba.chunks_exact(4).enumerate() {
            let (column, row) = (k % p.width as usize, k / p.width as usize);
            let wanted = colour(p.azimuth(column as f64), elevation_rad(p.tan_elevation(row as f64)));
            most = (0..3).map(|c| (i32::from(pixel[c]) - i32::from(wanted[c])).abs()).fold(most, i32::max);
        }
        most
    }

    fn taken(width: u32, height: u32, look: impl Fn(f64, f64) -> (f64, f64)) -> RgbaImage {
        RgbaImage::from_fn(width, height, |x, y| {
            let (azimuth, elevation) = look(f64::from(x), f64::from(y));
            image::Rgba(colour(azimuth, elevation))
        })
    }

    #[test]
    fn all_lenses_see_the_same_world() {
        let path = Path::new("taken.png");
        for is_anticlockwise in [false, true] {
            let sense = if is_anticlockwise { 1.0 } else { -1.0 };
            let wide = [-PI / 3.0, PI / 3.0];
            let lens = Lens { is_anticlockwise, column_0_rad: 0.7, elevation_rad: wide, ..Lens::default() };
            let pixel = TAU / 400.0;
            let azimuth = |x: f64| wrap(0.7 + sense * x * pixel);
            let sphere = taken(400, 200, |x, y| (azimuth(x), (99.5 - y) * pixel));
            let seen = lens.unwrap(sphere.clone(), path).unwrap();
            assert!(off(&seen) <= 2 && seen.projection.height < 140, "{}", off(&seen));
            let small = Lens { width_px: Some(200), ..lens.clone() }.unwrap(sphere, path).unwrap();
            assert!(small.projection.width == 200 && off(&small) <= 4, "{}", off(&small));
            let cylinder = taken(400, 120, |x, y| (azimuth(x), elevation_rad((39.5 - y) * pixel)));
            let lens = Lens { kind: LensKind::Cylindrical, horizon_row: Some(40.0), ..lens };
            assert!(off(&lens.unwrap(cylinder, path).unwrap()) <= 2);
            for model in RingModel::VARIANTS {
                for ring_elevations_rad in [[-1.2, 0.0], [1.3, 0.05]] {
                    let ring = Lens {
                        kind: LensKind::Ring,
                        centre_px: Some([210.0, 190.0]),
                        radii_px: Some([40.0, 180.0]),
                        ring_elevations_rad,
                        model: *model,
                        ..lens.clone()
                    };
                    let picture = ring_picture(&ring, sense);
                    let seen = ring.unwrap(picture, path).unwrap();
                    assert!(seen.projection.height > 100 && off(&seen) <= 3, "{model:?} {}", off(&seen));
                }
            }
        }
    }

    /// The picture of a ring, by search for the elevation of each radius.
    fn ring_picture(ring: &Lens, sense: f64) -> RgbaImage {
        let [at_inner, at_outer] = ring.ring_elevations_rad;
        let angle = |e: f64| if at_outer > at_inner { FRAC_PI_2 + e } else { FRAC_PI_2 - e };
        let [r0, r1] = [at_inner, at_outer].map(|e| ring.model.radius(angle(e)));
        taken(420, 400, |x, y| {
            let (dx, dy) = (x + 0.5 - 210.0, 190.0 - y - 0.5);
            let wanted = r0 + ((dx * dx + dy * dy).sqrt() - 40.0) / 140.0 * (r1 - r0);
            let (mut inner, mut outer) = (at_inner, at_outer);
            for _ in 0..40 {
                let middle = 0.5 * (inner + outer);
                *(if ring.model.radius(angle(middle)) < wanted { &mut inner } else { &mut outer }) = middle;
            }
            (wrap(0.7 + sense * atan2(dy, dx)), inner)
        })
    }

    #[test]
    fn what_cannot_be_is_named() {
        let path = Path::new("taken.png");
        let told =
            |lens: Lens, width: u32, height: u32| lens.unwrap(RgbaImage::new(width, height), path).unwrap_err().to_string();
        let ring = Lens { kind: LensKind::Ring, ..Lens::default() };
        for (lens, wanted) in [
            (Lens { radii_px: Some([10.0, 80.0]), ..ring.clone() }, "radii 10 to 80 px around (50, 50) in 100 x 100"),
            (Lens { radii_px: Some([30.0, 20.0]), ..ring.clone() }, "expected rising radii"),
            (Lens { ring_elevations_rad: [0.3, 0.3], ..ring.clone() }, "two elevations that differ"),
            (Lens::default(), "at most a quarter of the width above"),
            (Lens { elevation_rad: [0.2, -0.2], ..Lens::default() }, "a range that rises"),
            (Lens { width_px: Some(2), ..Lens::default() }, "8 to 16384"),
        ] {
            let message = told(lens, 100, 100);
            assert!(message.contains(wanted), "{message}");
        }
        let above = Lens { elevation_rad: [1.0, 1.2], ..Lens::default() };
        assert!(told(above, 200, 20).contains("no row from"), "a strip about the horizon");
    }
}
