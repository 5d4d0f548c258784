//! Light: what shines in a room, and under which conditions.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use super::texture::{TextureFamily, TextureSpec};

/// Light. Intensities are relative: ambient plus lamps of about 1 in all show a texture's own colour.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LightSpec {
    /// Conditions: how much of what follows shines.
    pub preset: LightPreset,
    /// Share of light that comes from everywhere.
    pub ambient: f64,
    /// Share of the ambient light that does not reach the corners of the room, where walls, floor and ceiling meet.
    pub corner_shade: f64,
    /// How far from a corner that begins, m.
    pub corner_reach_m: f64,
    /// Lamps.
    pub lamps: Vec<LampSpec>,
    /// Windows.
    pub windows: Vec<WindowSpec>,
}

impl Default for LightSpec {
    fn default() -> Self {
        Self {
            preset: LightPreset::default(),
            ambient: 0.9,
            corner_shade: 0.0,
            corner_reach_m: 0.6,
            lamps: Vec::new(),
            windows: Vec::new(),
        }
    }
}

/// Conditions of light. Each scales a world's ambient light, lamps and windows.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema, EnumMessage, IntoStaticStr, VariantArray,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum LightPreset {
    /// As the world has it.
    #[default]
    Day,
    /// Rain outside, lamps off: half the ambient light, 0.4 of the windows'.
    Overcast,
    /// Low sun: windows shine three times as bright.
    Glare,
    /// Lamps on, dusk outside: 0.4 of the ambient light, 0.08 of the windows'.
    Evening,
    /// A few lamps left on: 0.05 of the ambient light, 0.3 of the lamps', dark windows.
    Night,
}

/// Factors on a world's light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightFactors {
    /// On ambient light.
    pub ambient: f64,
    /// On lamps.
    pub lamps: f64,
    /// On windows.
    pub windows: f64,
}

impl LightPreset {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Day, Self::Overcast, Self::Glare, Self::Evening, Self::Night];

    /// What it does to a world's light.
    #[must_use]
    pub fn factors(self) -> LightFactors {
        let [ambient, lamps, windows] = match self {
            Self::Day => [1.0, 1.0, 1.0],
            Self::Overcast => [0.5, 0.0, 0.4],
            Self::Glare => [1.0, 1.0, 3.0],
            Self::Evening => [0.4, 1.0, 0.08],
            Self::Night => [0.05, 0.3, 0.0],
        };
        LightFactors { ambient, lamps, windows }
    }
}

/// A point lamp with Lambert shading and inverse-square falloff; it casts no shadows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LampSpec {
    /// Position x, y, z, m.
    pub position_m: [f64; 3],
    /// Irradiance that a facing surface gets at 1 m.
    pub intensity: f64,
}

/// A window in a wall: a pane that is seen, and that shines into the room as a surface does, Lambert's law at both ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindowSpec {
    /// Name, for messages.
    #[serde(default)]
    pub name: String,
    /// Number of its wall.
    pub wall: usize,
    /// Where it begins and ends along the wall, from the wall's first corner, m.
    pub along_m: [f64; 2],
    /// Height of its lower and upper edge above the floor, m.
    pub height_m: [f64; 2],
    /// Light that it gives off: the irradiance that a square metre of it makes on a facing surface 1 m away.
    pub brightness: f64,
    /// What is seen in it, shining with pi times the brightness: what stands before a wide window gets as much.
    #[serde(default = "WindowSpec::default_texture")]
    pub texture: TextureSpec,
}

impl WindowSpec {
    fn default_texture() -> TextureSpec {
        TextureSpec::new(TextureFamily::Plain, [225, 238, 255])
    }
}
