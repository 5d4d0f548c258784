//! How a surface looks: a pattern drawn from a seed, or an image file.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::picture::{Picture, Pictures};

/// Pattern families; each is drawn from a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TextureFamily {
    /// One colour.
    Plain,
    /// Smooth noise over several octaves.
    Noise,
    /// Brickwork with mortar joints.
    Brick,
    /// Boards with grain.
    Planks,
    /// Square tiles with joints, each of its own shade.
    Tiles,
    /// A poster wall: panels with bars, discs and glyph-like strokes.
    Posters,
    /// Shelves of books: upright blocks of many widths, heights and colours.
    Shelves,
    /// Horizontal bands, the same from all sides: no azimuth can be read off inside them.
    Bands,
}

/// How a surface looks, as written: either `family` or `image` is given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TextureSpec {
    /// Pattern family.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub family: Option<TextureFamily>,
    /// Image file (PNG, JPEG or PNM) in the world file's folder or below. A person in the room sees it the right way round; it
    /// stands on the floor, or on the underside of its body, and begins at the left end of its wall or at the body's first
    /// corner.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<String>,
    /// Base colour: red, green, blue, 0 to 255. Of an image it is what shows through where the image is transparent.
    #[serde(default = "TextureSpec::default_colour")]
    pub colour: [u8; 3],
    /// Width of surface after which it repeats, m. A pattern is as high as wide, an image as its sides ask. By default an image is
    /// 4 m wide, and a pattern does not repeat.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period_m: Option<f64>,
    /// Strength of the pattern, 0 (plain) to 1; by default 0.6 of a pattern, 1 of an image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contrast: Option<f64>,
    /// Seed of the pattern; by default each surface of a world gets its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
}

impl TextureSpec {
    /// A texture of the given family and colour with default period and contrast.
    #[must_use]
    pub fn new(family: TextureFamily, colour: [u8; 3]) -> Self {
        Self { family: Some(family), image: None, colour, period_m: None, contrast: None, seed: None }
    }
    fn default_colour() -> [u8; 3] {
        [170, 165, 155]
    }
}

/// What a texture shows.
#[derive(Debug, Clone, PartialEq)]
pub enum Pattern {
    /// A pattern drawn from the texture's seed.
    Family(TextureFamily),
    /// An image.
    Image(Arc<Picture>),
}

/// How a surface of a checked world looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// What it shows.
    pub pattern: Pattern,
    /// Base colour: red, green, blue.
    pub colour: [u8; 3],
    /// Width and height of surface after which the pattern repeats, m.
    pub period_m: [f64; 2],
    /// Whether the period was chosen for the surface, so that the pattern does not repeat along it.
    pub fitted: bool,
    /// Strength of the pattern, 0 to 1.
    pub contrast: f64,
    /// Seed of the pattern.
    pub seed: u64,
}

/// Period of textures that are given none, m, unless it is fitted to a longer surface.
const USUAL_PERIOD_M: f64 = 4.0;

impl Texture {
    /// The checked form of `spec`, whose image is among `pictures`; `seed` is taken where it has none of its own. Along `length_m` of
    /// its surface a pattern without a given period does not repeat.
    ///
    /// A longer period is a larger piece of the same pattern: details keep their size.
    pub(super) fn new(spec: &TextureSpec, length_m: f64, seed: u64, pictures: &Pictures) -> Self {
        let (pattern, high) = match &spec.image {
            Some(path) => {
                let picture = pictures.get(path);
                let high = f64::from(picture.height) / f64::from(picture.width);
                (Pattern::Image(picture), high)
            }
            None => (Pattern::Family(spec.family.unwrap_or(TextureFamily::Plain)), 1.0),
        };
        let usual = if spec.image.is_some() { 1.0 } else { 0.6 };
        let fitted = spec.period_m.is_none() && varies_along(&pattern) && spec.image.is_none() && length_m > USUAL_PERIOD_M;
        let period_m = spec.period_m.unwrap_or(if fitted { length_m } else { USUAL_PERIOD_M });
        Self {
            pattern,
            colour: spec.colour,
            period_m: [period_m, high * period_m],
            fitted,
            contrast: spec.contrast.unwrap_or(usual),
            seed: spec.seed.unwrap_or(seed),
        }
    }
}

impl Texture {
    /// In how many places of a surface of this length it looks the same.
    pub(super) fn repeats(&self, length_m: f64) -> usize {
        if varies_along(&self.pattern) && self.contrast > 0.0 {
            libm::ceil(length_m / self.period_m[0] - 1e-3).max(1.0) as usize
        } else {
            1
        }
    }
}

/// Whether something can be told apart along a surface with this pattern.
fn varies_along(pattern: &Pattern) -> bool {
    !matches!(pattern, Pattern::Family(TextureFamily::Plain | TextureFamily::Bands))
}
