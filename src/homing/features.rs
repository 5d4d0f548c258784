//! By features: bearings that vision believes, and the planar motion between the two views.

use super::{Angle, Answer, Homing};
use crate::error::Result;
use crate::estimation::two_view::{Ray, Seen, planar_step};
use crate::panorama::{Panorama, Projection};
use crate::vision::{Extractor, ExtractorSettings};

/// Homing by the features of the home panorama. It says nothing where chance would bring as many matches.
pub struct Features {
    extractor: Extractor,
    home: Projection,
}

impl Features {
    /// Makes the features of `home` the landmarks.
    #[must_use]
    pub fn new(settings: ExtractorSettings, home: &Panorama) -> Self {
        Self { extractor: Extractor::new(settings, home), home: home.projection }
    }

    /// How many landmarks there are.
    #[must_use]
    pub fn landmarks(&self) -> usize {
        self.extractor.home_keypoints().count()
    }
}

impl Homing for Features {
    fn look(&mut self, now: &Panorama) -> Result<Answer> {
        self.extractor.observe(now);
        let ray = |projection: &Projection, px: (f64, f64), sd_rad: f64| Ray {
            azimuth_rad: projection.azimuth(px.0),
            tan_elevation: projection.tan_elevation(px.1),
            sd_rad,
        };
        let landmarks: Vec<Seen> = self
            .extractor
            .matches()
            .iter()
            .map(|m| Seen {
                home: ray(&self.home, m.home_px, m.home_sd_rad),
                now: ray(&now.projection, m.now_px, m.now_sd_rad),
            })
            .collect();
        let alternatives = self.extractor.readings().count().saturating_sub(1);
        let Some(step) = planar_step(&landmarks) else {
            return Ok(Answer { landmarks, alternatives, ..Answer::default() });
        };
        let angle = |rad: f64, sd_rad: f64| Some(Angle { rad, sd_rad: Some(sd_rad) });
        Ok(Answer {
            turn: angle(step.turn_rad, step.turn_sd_rad),
            home: angle(step.home_rad(), step.direction_sd_rad.hypot(step.turn_sd_rad)),
            parallax_rad: Some(step.parallax_rad),
            landmarks,
            alternatives,
        })
    }
}
