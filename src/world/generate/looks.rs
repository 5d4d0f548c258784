//! How generated things look: colours as rooms have them, patterns as rich and as alike as the knobs say.

use std::collections::BTreeMap;

use super::dice::{Dice, hundredths};
use crate::random::Seed;
use crate::world::spec::{TextureFamily, TextureSpec};

/// Colours that things of a kind have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::world) enum Tone {
    /// White and off-white paint, light greys.
    Paint,
    /// Paint with a hue.
    Pastel,
    /// Wood, from birch to walnut.
    Wood,
    /// Metal and dark plastic.
    Metal,
    /// Covers and carpets.
    Fabric,
    /// What is meant to be seen: crates, signs, drums.
    Vivid,
    /// Brick and terracotta.
    Clay,
    /// Leaves.
    Leaf,
    /// Paper and boards.
    Paper,
    /// Cardboard.
    Carton,
    /// Concrete and screed.
    Concrete,
    /// What is seen outside: sky.
    Sky,
}

impl Tone {
    fn colours(self) -> &'static [[u8; 3]] {
        match self {
            Self::Paint => &[[226, 222, 212], [214, 210, 200], [232, 230, 226], [205, 207, 205], [222, 214, 198]],
            Self::Pastel => {
                &[[196, 206, 214], [206, 212, 194], [222, 204, 186], [214, 198, 196], [186, 200, 198], [216, 206, 164]]
            }
            Self::Wood => &[[196, 160, 112], [165, 122, 80], [126, 86, 56], [92, 64, 46], [212, 184, 142]],
            Self::Metal => &[[120, 125, 130], [90, 96, 104], [150, 152, 150], [62, 66, 72], [176, 178, 180]],
            Self::Fabric => &[[96, 104, 120], [128, 66, 64], [72, 92, 84], [140, 120, 98], [84, 76, 96], [168, 152, 128]],
            Self::Vivid => &[[196, 62, 48], [40, 98, 168], [230, 168, 40], [52, 132, 84], [212, 110, 42], [120, 60, 130]],
            Self::Clay => &[[165, 95, 75], [178, 112, 84], [150, 86, 70], [176, 140, 118]],
            Self::Leaf => &[[70, 115, 60], [92, 130, 72], [56, 98, 64]],
            Self::Paper => &[[236, 232, 222], [230, 215, 150], [204, 216, 228], [226, 196, 184], [210, 224, 206]],
            Self::Carton => &[[176, 140, 100], [190, 156, 116], [160, 126, 90]],
            Self::Concrete => &[[150, 150, 146], [132, 132, 130], [164, 160, 152]],
            Self::Sky => &[[190, 212, 236], [206, 222, 238], [168, 196, 226], [214, 220, 222]],
        }
    }

    /// A colour of this tone.
    pub(in crate::world) fn colour(self, dice: &mut Dice) -> [u8; 3] {
        let shade = dice.between(0.92, 1.06);
        let tint = [(); 3].map(|()| dice.between(-6.0, 6.0));
        let base = *dice.pick(self.colours());
        std::array::from_fn(|c| (f64::from(base[c]) * shade + tint[c]).round().clamp(20.0, 250.0) as u8)
    }
}

/// Draws textures.
pub(in crate::world) struct Looks {
    dice: Dice,
    /// Share of things that bear a pattern, and its strength.
    richness: f64,
    /// Share of things that look like others of their sort, and of walls whose pattern repeats along them.
    repetition: f64,
    /// What things of a name look like that look alike.
    alike: BTreeMap<&'static str, TextureSpec>,
}

impl Looks {
    pub(in crate::world) fn new(seed: Seed, richness: f64, repetition: f64) -> Self {
        Self { dice: Dice::new(seed, "looks"), richness, repetition, alike: BTreeMap::new() }
    }

    /// Strength of a pattern that has this strength in a rich room.
    fn contrast(&mut self, most: f64) -> f64 {
        hundredths((most * (0.25 + 0.75 * self.richness) * self.dice.between(0.8, 1.1)).clamp(0.05, 1.0))
    }

    /// Textures of a room's walls, by their lengths: one paint for all of them, and one of the patterns of `rich` on as many as the
    /// room is rich. A pattern covers a wall once, unless it is drawn to repeat.
    pub(in crate::world) fn walls(
        &mut self,
        lengths_m: &[f64],
        paint: Tone,
        rich: &[(TextureFamily, Tone)],
    ) -> Vec<TextureSpec> {
        let colour = paint.colour(&mut self.dice);
        let alike = self.dice.texture_seed();
        let plaster = if self.dice.chance(0.2 + self.richness) { TextureFamily::Noise } else { TextureFamily::Plain };
        let faint = self.contrast(0.3);
        let dado = *self.dice.pick(rich);
        let dado = (dado.0, dado.1.colour(&mut self.dice), self.contrast(0.8));
        lengths_m
            .iter()
            .map(|&length_m| {
                let is_rich = self.dice.chance(self.richness) && length_m > 0.4;
                let same = self.dice.chance(self.repetition);
                let (family, colour, contrast) = match (is_rich, same) {
                    (false, _) => (plaster, colour, faint),
                    (true, true) => dado,
                    (true, false) => {
                        let &(family, tone) = self.dice.pick(rich);
                        (family, tone.colour(&mut self.dice), self.contrast(0.8))
                    }
                };
                let mut texture = self.texture(family, colour, self.period_m(length_m, same), contrast);
                texture.seed = (same && family != TextureFamily::Plain).then_some(alike);
                texture
            })
            .collect()
    }

    /// How far the pattern of a surface of this length reaches before it repeats, m.
    fn period_m(&self, length_m: f64, repeats: bool) -> f64 {
        if repeats { length_m.clamp(0.6, 1.2) } else { (10.0 * length_m).ceil().max(6.0) / 10.0 }
    }

    /// Texture of a floor or ceiling of this length, of one of these sorts, with at most this contrast.
    pub(in crate::world) fn ground(&mut self, length_m: f64, sorts: &[(TextureFamily, Tone)], most: f64) -> TextureSpec {
        let &(family, tone) = self.dice.pick(sorts);
        let (colour, contrast) = (tone.colour(&mut self.dice), self.contrast(most));
        // Floors are laid in a pattern that nobody draws anew for 20 m.
        let repeats = self.dice.chance(self.repetition);
        self.texture(family, colour, self.period_m(length_m.min(8.0), repeats), contrast)
    }

    /// Texture of a thing: `period_m` is how far its pattern reaches.
    pub(in crate::world) fn thing(
        &mut self,
        name: &'static str,
        family: TextureFamily,
        tone: Tone,
        period_m: f64,
    ) -> TextureSpec {
        if self.dice.chance(self.repetition) {
            if let Some(known) = self.alike.get(name) {
                return known.clone();
            }
            let mut texture = self.draw(family, tone, period_m);
            texture.seed = Some(self.dice.texture_seed());
            self.alike.insert(name, texture.clone());
            return texture;
        }
        self.draw(family, tone, period_m)
    }

    fn draw(&mut self, family: TextureFamily, tone: Tone, period_m: f64) -> TextureSpec {
        let family = if self.dice.chance(0.25 + 0.75 * self.richness) { family } else { TextureFamily::Plain };
        let colour = tone.colour(&mut self.dice);
        let contrast = self.contrast(0.9);
        self.texture(family, colour, (10.0 * period_m).ceil() / 10.0, contrast)
    }

    fn texture(&mut self, family: TextureFamily, colour: [u8; 3], period_m: f64, contrast: f64) -> TextureSpec {
        let texture = TextureSpec::new(family, colour);
        if family == TextureFamily::Plain {
            return texture;
        }
        // Blotches as strong as bricks are would be no paint that anybody has.
        let most = if family == TextureFamily::Noise { 0.35 } else { 1.0 };
        TextureSpec { period_m: Some(period_m), contrast: Some(contrast.min(most)), ..texture }
    }
}
