//! Descent in image distances by matched filters (Moeller and Vardy 2006, MFDID): home is where the view differs least from home's, and
//! the home vector is the way in which it falls.
//!
//! The view is turned as at home first, by the visual compass. How it would change on a step is told by its own gradients and the flow
//! that equally distant surroundings would show: for a step along x, azimuth grows by sin(a) / (R cos e) and elevation by
//! sin(e) cos(a) / R, where R is the distance of all. The gradient of half the sum of squares along x and y then is a sum over
//! the pixels, and home is against it. No displaced views are taken, and R, being one for all, does not change the direction.

use super::grey::Grey;
use super::ridf::Compass;
use super::{Angle, Answer, Homing};
use crate::error::Result;
use crate::geometry::{Vector2, angle_of, atan2, sin_cos, wrap};
use crate::panorama::{Panorama, ProjectionKind};

/// Homing by descent in image distances.
pub struct Descent {
    compass: Compass,
    /// What each pixel of home adds to the change of a view on a step along x and along y, for its current grey level: flow times gradient.
    filters: Vec<[f32; 2]>,
}

impl Descent {
    /// With this view at home, whose gradients serve for all others.
    #[must_use]
    pub fn new(home: &Panorama) -> Self {
        let compass = Compass::new(home);
        let filters = filters(compass.home());
        Self { compass, filters }
    }
}

/// Gradient times flow at each pixel, for a step along x and one along y.
fn filters(view: &Grey) -> Vec<[f32; 2]> {
    let (width, height) = (view.width(), view.height());
    let at = |row: usize, column: usize| f64::from(view.pixels[row * width + column % width]);
    let mut all = Vec::with_capacity(width * height);
    for row in 0..height {
        let tan = view.projection.tan_elevation(row as f64);
        let (sin_e, cos_e) = sin_cos(atan2(tan, 1.0));
        for column in 0..width {
            let (sin_a, cos_a) = sin_cos(view.projection.azimuth(column as f64));
            let across = 0.5 * (at(row, column + 1) - at(row, column + width - 1));
            // Rows count downwards, elevation upwards; rows of a cylinder are even in its tangent.
            let (above, below) = (row.saturating_sub(1), (row + 1).min(height - 1));
            let steps = (below - above).max(1) as f64;
            let mut up = (at(above, column) - at(below, column)) / steps;
            if view.projection.kind == ProjectionKind::Cylindrical {
                up /= cos_e * cos_e;
            }
            let along_x = -(across * sin_a / cos_e + up * sin_e * cos_a);
            let along_y = -(-across * cos_a / cos_e + up * sin_e * sin_a);
            all.push([along_x as f32, along_y as f32]);
        }
    }
    all
}

impl Homing for Descent {
    fn look(&mut self, now: &Panorama) -> Result<Answer> {
        let (turn, now) = self.compass.turn(now)?;
        let home = self.compass.home();
        let width = home.width();
        let roll = (turn / home.projection.pixel_rad()).round() as i64;
        let roll = roll.rem_euclid(width as i64) as usize;
        let mut gradient = Vector2::zeros();
        for (row, (seen, kept)) in now.pixels.chunks_exact(width).zip(home.pixels.chunks_exact(width)).enumerate() {
            for (c, seen) in seen.iter().enumerate() {
                let column = if c + roll < width { c + roll } else { c + roll - width };
                let off = f64::from(*seen) - f64::from(kept[column]);
                let [x, y] = self.filters[row * width + column];
                gradient += Vector2::new(off * f64::from(x), off * f64::from(y));
            }
        }
        // In the home frame, turned into that of the robot.
        let home = (gradient.norm() > 0.0).then(|| Angle { rad: wrap(angle_of(-gradient) - turn), sd_rad: None });
        Ok(Answer { turn: Some(Angle { rad: turn, sd_rad: None }), home, ..Answer::default() })
    }
}
