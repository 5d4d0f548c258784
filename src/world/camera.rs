//! The camera: where it sits, how it projects, and what it does to a picture.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use crate::panorama::ProjectionKind;

/// The panoramic camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSpec {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// How elevation is spread over the rows.
    pub projection: ProjectionKind,
    /// Height of the camera's centre above the floor, m.
    pub height_m: f64,
    /// Position of the camera from the middle of the axle, forward and to the left, m.
    pub offset_m: [f64; 2],
    /// Direction of column 0 from the robot's heading, degrees.
    pub mount_deg: f64,
    /// Share of the rows above the horizon.
    pub horizon: f64,
    /// The optics that fields not given in `optics` are taken from.
    pub preset: CameraPreset,
    /// What the camera does to a picture.
    pub optics: OpticsSpec,
}

impl Default for CameraSpec {
    fn default() -> Self {
        Self {
            width_px: 1440,
            height_px: 180,
            projection: ProjectionKind::Cylindrical,
            height_m: 0.4,
            offset_m: [0.0; 2],
            mount_deg: 0.0,
            horizon: 0.6,
            preset: CameraPreset::default(),
            optics: OpticsSpec::default(),
        }
    }
}

/// A ready-made camera. The numbers are typical ones; those of noise follow from pixels of about 3 micrometres, which hold some
/// 10,000 electrons, and from the amplification that a setting needs.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema, EnumMessage, IntoStaticStr, VariantArray,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum CameraPreset {
    /// Shows colours as they are.
    #[default]
    Ideal,
    /// A good industrial camera: little noise, a short shutter, slightly darker rims.
    Decent,
    /// A cheap one: noise, soft focus, dark rims, a warm cast, a flat tone curve.
    Cheap,
    /// A decent one that has driven through dust and splashes.
    Dirty,
    /// A decent one in the dark: four times the exposure by a long shutter, amplified noise.
    Night,
}

impl CameraPreset {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Ideal, Self::Decent, Self::Cheap, Self::Dirty, Self::Night];

    /// What it does to a picture.
    #[must_use]
    pub fn optics(self) -> OpticsSpec {
        let decent = OpticsSpec {
            vignetting: 0.15,
            focus_blur_deg: 0.06,
            shutter_s: 0.004,
            noise: Some(NoiseSpec { saturation_electrons: 10_000.0, read_electrons: 5.0 }),
            ..OpticsSpec::default()
        };
        match self {
            Self::Ideal => OpticsSpec::default(),
            Self::Decent => decent,
            Self::Cheap => OpticsSpec {
                exposure: 0.9,
                gamma: 1.25,
                white_balance: [1.08, 1.0, 0.84],
                vignetting: 0.4,
                focus_blur_deg: 0.15,
                shutter_s: 0.015,
                noise: Some(NoiseSpec { saturation_electrons: 2_500.0, read_electrons: 12.0 }),
                dirt: None,
            },
            Self::Dirty => OpticsSpec { dirt: Some(DirtSpec { spots: 60, size_deg: 3.0, opacity: 0.85, seed: 0 }), ..decent },
            Self::Night => OpticsSpec {
                exposure: 4.0,
                gamma: 1.5,
                shutter_s: 0.03,
                noise: Some(NoiseSpec { saturation_electrons: 1_500.0, read_electrons: 5.0 }),
                ..decent
            },
        }
    }
}

/// What a camera does to a picture, in the order of light's way: exposure, motion and focus, rims and dirt, noise, colours.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OpticsSpec {
    /// Factor on all light, by aperture, shutter and amplification together; what comes out above 1 is clipped.
    pub exposure: f64,
    /// Tone curve: a share x of full brightness is shown as x^(1/gamma).
    pub gamma: f64,
    /// Factors on red, green and blue.
    pub white_balance: [f64; 3],
    /// Share of light lost in the row farthest from the horizon; it grows with the square of the distance.
    pub vignetting: f64,
    /// Standard deviation of the spot that a point is imaged as, degrees.
    pub focus_blur_deg: f64,
    /// How long the shutter is open, s: what moves meanwhile is blurred.
    pub shutter_s: f64,
    /// Noise of the sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseSpec>,
    /// Dirt on the lens.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dirt: Option<DirtSpec>,
}

impl Default for OpticsSpec {
    fn default() -> Self {
        Self {
            exposure: 1.0,
            gamma: 1.0,
            white_balance: [1.0; 3],
            vignetting: 0.0,
            focus_blur_deg: 0.0,
            shutter_s: 0.0,
            noise: None,
            dirt: None,
        }
    }
}

/// Noise of a sensor: the number of electrons that a pixel collects varies as the light's quanta do, and so does reading it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseSpec {
    /// Electrons that stand for full brightness; the fewer, the more shot noise. Amplification by two halves them.
    pub saturation_electrons: f64,
    /// Standard deviation of reading a pixel, electrons.
    pub read_electrons: f64,
}

/// Dirt on the lens: grey spots at fixed places in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirtSpec {
    /// How many.
    pub spots: u32,
    /// Radius of the largest, degrees.
    pub size_deg: f64,
    /// Share of light that the thickest spots keep back, 0 to 1.
    pub opacity: f64,
    /// Seed of their places, sizes and shades.
    #[serde(default)]
    pub seed: u64,
}
