//! What panoramas are taken under: how far off, how turned, in what light, with what noise, behind what.

use rand::RngExt;
use serde::Serialize;
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use crate::panorama::Panorama;
use crate::random::{Stream, standard_normal};
use crate::world::{CameraPreset, LightPreset};

/// What is changed, one factor at a time, in the order of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Factor {
    /// Distance from home, 0.25 to 3 m.
    Distance,
    /// Turn since home, 0 to 180 degrees.
    Rotation,
    /// Factor on all grey levels, 0.25 to 2, clipped at white.
    Gain,
    /// Exponent on all grey levels, 0.5 to 2, white staying white.
    Gamma,
    /// Light of the world, by its presets.
    Light,
    /// Standard deviation of noise on each channel of each pixel, at home too, 0 to 20 grey levels of 255.
    Noise,
    /// Camera, by its presets.
    Camera,
    /// Share of the turn that is hidden by things which were not there, 0 to 70 %.
    Occlusion,
}

impl Factor {
    /// Name in files.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The levels that are measured. Presets are counted in their order, the home panorama's first.
    pub fn levels(self) -> &'static [f64] {
        match self {
            Self::Distance => &[0.25, 0.5, 1.0, 2.0, 3.0],
            Self::Rotation => &[0.0, 45.0, 90.0, 135.0, 180.0],
            Self::Gain => &[0.25, 0.5, 0.7, 1.0, 1.4, 2.0],
            Self::Gamma => &[0.5, 0.7, 1.0, 1.4, 2.0],
            Self::Noise => &[0.0, 2.0, 5.0, 10.0, 20.0],
            Self::Occlusion => &[0.0, 0.1, 0.3, 0.5, 0.7],
            Self::Light | Self::Camera => &[0.0, 1.0, 2.0, 3.0, 4.0],
        }
    }

    /// What a level is called: the preset's name or the number.
    pub fn label(self, level: f64) -> String {
        let condition = Condition::at(self, level);
        match self {
            Self::Light => <&str>::from(condition.light).to_owned(),
            Self::Camera => <&str>::from(condition.camera).to_owned(),
            _ => level.to_string(),
        }
    }
}

/// Conditions of a panorama, beside where it is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// Factor on all grey levels.
    pub gain: f64,
    /// Exponent on all grey levels.
    pub gamma: f64,
    /// Standard deviation of noise, grey levels.
    pub noise: f64,
    /// Share of the turn that is hidden.
    pub occlusion: f64,
    /// Light in which the panorama is rendered.
    pub light: LightPreset,
    /// Camera through which it is taken.
    pub camera: CameraPreset,
}

impl Condition {
    /// As it is.
    pub const CLEAR: Self =
        Self { gain: 1.0, gamma: 1.0, noise: 0.0, occlusion: 0.0, light: LightPreset::Day, camera: CameraPreset::Ideal };

    /// The condition at a level of a factor.
    pub fn at(factor: Factor, level: f64) -> Self {
        match factor {
            Factor::Distance | Factor::Rotation => Self::CLEAR,
            Factor::Gain => Self { gain: level, ..Self::CLEAR },
            Factor::Gamma => Self { gamma: level, ..Self::CLEAR },
            Factor::Noise => Self { noise: level, ..Self::CLEAR },
            Factor::Occlusion => Self { occlusion: level, ..Self::CLEAR },
            Factor::Light => Self { light: preset(&LightPreset::ALL, level), ..Self::CLEAR },
            Factor::Camera => Self { camera: preset(&CameraPreset::ALL, level), ..Self::CLEAR },
        }
    }

    /// Makes of a rendered panorama what is seen under this condition; light and camera are there already. What is hidden loses
    /// its range and instance.
    pub fn apply(&self, panorama: &mut Panorama, stream: &mut Stream) {
        if self.occlusion > 0.0 {
            hide(panorama, self.occlusion, stream);
        }
        if self.gain != 1.0 || self.gamma != 1.0 {
            let table: [u8; 256] = std::array::from_fn(|v| {
                let share = libm::pow(v as f64 / 255.0, self.gamma) * self.gain;
                (255.0 * share).round().clamp(0.0, 255.0) as u8
            });
            for p in panorama.rgba.as_chunks_mut::<4>().0 {
                *p = [table[p[0] as usize], table[p[1] as usize], table[p[2] as usize], p[3]];
            }
        }
        if self.noise > 0.0 {
            for p in panorama.rgba.as_chunks_mut::<4>().0 {
                for v in &mut p[..3] {
                    *v = (f64::from(*v) + self.noise * standard_normal(stream)).round().clamp(0.0, 255.0) as u8;
                }
            }
        }
    }
}

/// The preset of this number.
fn preset<T: Copy>(presets: &[T], number: f64) -> T {
    presets[(number as usize).min(presets.len() - 1)]
}

/// Widths of the things that hide others, rad: of people from 3 m to 1 m away.
const HIDER_RAD: (f64, f64) = (0.15, 0.45);
/// Edge of the patches that they wear, px.
const PATCH_PX: usize = 7;

/// Puts upright things with a patchy dress into the picture, from top to bottom, until `share` of the columns is hidden.
fn hide(panorama: &mut Panorama, share: f64, stream: &mut Stream) {
    let mut unit = || stream.random::<f64>();
    let (width, height) = (panorama.projection.width as usize, panorama.projection.height as usize);
    let mut hidden = vec![false; width];
    let wanted = (share * width as f64).round() as usize;
    let mut count = 0;
    while count < wanted.min(width) {
        let first = (unit() * width as f64) as usize;
        let columns = ((HIDER_RAD.0 + (HIDER_RAD.1 - HIDER_RAD.0) * unit()) / panorama.projection.pixel_rad()) as usize;
        let colour = [unit(), unit(), unit()];
        for patch in 0..columns.div_ceil(PATCH_PX) {
            let shades: Vec<f64> = (0..height.div_ceil(PATCH_PX)).map(|_| 60.0 + 180.0 * unit()).collect();
            for offset in patch * PATCH_PX..columns.min((patch + 1) * PATCH_PX) {
                let column = (first + offset) % width;
                if count == wanted || std::mem::replace(&mut hidden[column], true) {
                    continue;
                }
                count += 1;
                for row in 0..height {
                    let k = row * width + column;
                    for (value, tint) in panorama.rgba[4 * k..4 * k + 3].iter_mut().zip(colour) {
                        *value = (shades[row / PATCH_PX] * (0.4 + 0.6 * tint)) as u8;
                    }
                    panorama.range_m[k] = 0.0;
                    panorama.instance[k] = 0;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::Projection;
    use crate::random::Seed;

    fn grey(value: u8) -> Panorama {
        let mut panorama = Panorama::black(Projection::new(360, 40));
        panorama.rgba.fill(value);
        panorama.range_m.fill(2.0);
        panorama
    }

    #[test]
    fn conditions_do_what_they_say() {
        let apply = |condition: Condition| {
            let mut panorama = grey(100);
            condition.apply(&mut panorama, &mut Seed(1).stream("test"));
            panorama
        };
        assert_eq!(apply(Condition::CLEAR), grey(100));
        assert!(apply(Condition::at(Factor::Gain, 1.4)).rgba.chunks(4).all(|p| p[0] == 140));
        assert!(apply(Condition::at(Factor::Gain, 4.0)).rgba.chunks(4).all(|p| p[0] == 255));
        let half = (255.0 * (100.0_f64 / 255.0).sqrt()).round() as u8;
        assert!(apply(Condition::at(Factor::Gamma, 0.5)).rgba.chunks(4).all(|p| p[1] == half));
        let hidden = apply(Condition::at(Factor::Occlusion, 0.3)).range_m.iter().filter(|r| **r == 0.0).count();
        assert_eq!(hidden, 108 * 40);
        let noisy = apply(Condition::at(Factor::Noise, 5.0));
        let values: Vec<f64> = noisy.rgba.chunks(4).flat_map(|p| &p[..3]).map(|v| f64::from(*v) - 100.0).collect();
        let variance = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        // 43,200 draws: three standard errors are 2 %; rounding adds 1/12.
        assert!((variance - 25.0 - 1.0 / 12.0).abs() < 0.6, "{variance}");
    }
}
