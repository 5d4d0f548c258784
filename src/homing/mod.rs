//! Homing from two panoramas: the one at home and the one of now say which way home is, with nothing between them.
//!
//! A [`Homing`] keeps the panorama at home and gives an [`Answer`] to each other one. What a robot makes of many such answers on its way
//! is a [`method`](crate::method)'s; here each stands alone, which is how home vectors over a grid of places are judged, and pictures that
//! somebody took. [`Features`] goes by what vision believes; the others compare whole images, as half of the field does.
//!
//! Knows of: panoramas, vision, estimation. Must not know of worlds or the truth.

pub mod descent;
mod features;
pub mod grey;
pub mod ridf;
pub mod warping;

pub use features::Features;

use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use crate::error::Result;
use crate::estimation::two_view::Seen;
use crate::panorama::Panorama;
use crate::vision::ExtractorSettings;

/// An angle and how sure it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Angle {
    /// The angle, rad.
    pub rad: f64,
    /// Its standard deviation, rad; `None` from a method that states none.
    pub sd_rad: Option<f64>,
}

/// What a method makes of a panorama.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Answer {
    /// Visual compass: turn since home, which is the heading in the home frame.
    pub turn: Option<Angle>,
    /// Direction of home from the heading now.
    pub home: Option<Angle>,
    /// Median angle by which landmarks are displaced since home, rad, of a method that has landmarks: 0 at home.
    pub parallax_rad: Option<f64>,
    /// The landmarks that the answer rests on, of a method that has them.
    pub landmarks: Vec<Seen>,
    /// Other readings of the same panorama that are as possible: where they are, the answer may be another.
    pub alternatives: usize,
}

/// A home panorama in the form that a method compares others with.
pub trait Homing: Send {
    /// The way home from where `now` was taken.
    ///
    /// # Errors
    /// When the panorama is of another form than that at home.
    fn look(&mut self, now: &Panorama) -> Result<Answer>;
}

/// The methods.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, EnumMessage, IntoStaticStr, VariantArray,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum HomingKind {
    /// Bearings of features, and the one planar motion that explains them.
    Features,
    /// Visual compass: the turn at which the whole image differs least (Zeil and others 2003). No direction of home.
    Ridf,
    /// Descent in image distances by matched filters (Moeller, Vardy 2006), after the visual compass.
    Mfdid,
    /// MinWarping (Moeller 2009): all steps and turns are tried, columns move as some distance predicts.
    Minwarping,
    /// The same after the mean of each column is taken away and all views are brought to one contrast, against changes of light.
    MinwarpingNormalised,
}

impl HomingKind {
    /// What files and the command line call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The method with this panorama at home.
    #[must_use]
    pub fn at_home(self, home: &Panorama) -> Box<dyn Homing> {
        match self {
            Self::Features => Box::new(Features::new(ExtractorSettings::default(), home)),
            Self::Ridf => Box::new(ridf::Compass::new(home)),
            Self::Mfdid => Box::new(descent::Descent::new(home)),
            Self::MinwarpingNormalised => {
                let settings = warping::WarpingSettings { is_light_free: true, ..warping::WarpingSettings::default() };
                Box::new(warping::MinWarping::new(settings, home))
            }
            Self::Minwarping => Box::new(warping::MinWarping::new(warping::WarpingSettings::default(), home)),
        }
    }
}
