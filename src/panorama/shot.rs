//! Where a surface point that one panorama shows must appear in another: geometry from range and poses.

use super::Panorama;
use crate::geometry::{Pose, angle_of, direction};

/// A panorama with its buffers of range and instance, and where the camera was.
#[derive(Debug, Clone)]
pub struct Shot {
    /// What was seen.
    pub panorama: Panorama,
    /// Pose of the camera in the room.
    pub pose: Pose,
}

/// Where something that was seen from home appears now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// Column and row, px.
    pub px: (f64, f64),
    /// Horizontal range at home over that now: by so much it looks larger.
    pub zoom: f64,
    /// Whether nothing hides it and it lies within the picture.
    pub visible: bool,
}

impl Shot {
    fn index(&self, (x, y): (f64, f64)) -> usize {
        let (w, h) = (i64::from(self.panorama.projection.width), i64::from(self.panorama.projection.height));
        let (x, y) = ((x.round() as i64).rem_euclid(w), (y.round() as i64).clamp(0, h - 1));
        (y * w + x) as usize
    }

    fn range(&self, px: (f64, f64)) -> f64 {
        f64::from(self.panorama.range_m[self.index(px)])
    }

    /// Where the surface point that is seen from here at `px` appears in `now`. A pixel at a silhouette is half one surface,
    /// half another, so a point counts as visible if any pixel next to its place shows its range.
    #[must_use]
    pub fn appearance(&self, now: &Shot, px: (f64, f64)) -> Appearance {
        let (from, to) = (self.panorama.projection, now.panorama.projection);
        let tan = from.tan_elevation(px.1);
        let flat = self.range(px) / (1.0 + tan * tan).sqrt();
        let point = self.pose.transform(direction(from.azimuth(px.0)) * flat);
        let seen = now.pose.inverse_transform(point);
        let flat_now = seen.norm();
        let height = flat * tan;
        let (x, y) = (to.column(angle_of(seen)), to.row(height / flat_now));
        let expected = (flat_now * flat_now + height * height).sqrt();
        let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (f64::from(dx), f64::from(dy))));
        let agrees = |(dx, dy): (f64, f64)| (now.range((x + dx, y + dy)) - expected).abs() < 0.02 + 0.02 * expected;
        let inside = y >= -0.5 && y <= f64::from(to.height) - 0.5;
        Appearance { px: (x, y), zoom: flat / flat_now, visible: inside && around.into_iter().any(agrees) }
    }

    /// Instance seen at a place.
    #[must_use]
    pub fn instance(&self, px: (f64, f64)) -> u16 {
        self.panorama.instance[self.index(px)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::Projection;

    /// In a round room of radius 4 m around home, from 1 m to the left: what was ahead is 4.12 m away, 14 degrees to the right.
    #[test]
    fn a_point_appears_where_geometry_says() {
        let projection = Projection::new(720, 90);
        let shot = |pose: Pose, range: &dyn Fn(f64, f64) -> f64| {
            let mut panorama = Panorama::black(projection);
            for (k, r) in panorama.range_m.iter_mut().enumerate() {
                let azimuth = projection.azimuth((k % 720) as f64);
                let tan = projection.tan_elevation((k / 720) as f64);
                *r = (range(azimuth, tan) * (1.0 + tan * tan).sqrt()) as f32;
            }
            Shot { panorama, pose }
        };
        let home = shot(Pose::new(2.0, 1.0, 0.5), &|_, _| 4.0);
        let place = home.pose.transform(crate::geometry::Vector2::new(0.0, 1.0));
        // From 1 m off the centre: distance to the circle in direction a.
        let off_centre = |a: f64| {
            let (s, _) = crate::geometry::sin_cos(a);
            -s + (s * s + 15.0).sqrt()
        };
        let now = shot(Pose::new(place.x, place.y, 0.5), &|a, _| off_centre(a));
        let there = home.appearance(&now, (0.0, 30.0));
        assert!(there.visible);
        let azimuth = crate::geometry::atan2(-1.0, 4.0);
        assert!((there.px.0 - projection.column(azimuth)).abs() < 1e-4, "{there:?}");
        let tan = projection.tan_elevation(30.0) * 4.0 / 17f64.sqrt();
        assert!((there.px.1 - projection.row(tan)).abs() < 1e-4 && (there.zoom - 4.0 / 17f64.sqrt()).abs() < 1e-6, "{there:?}");
        let hidden = shot(now.pose, &|_, _| 1.0);
        assert!(!home.appearance(&hidden, (0.0, 30.0)).visible);
    }
}
