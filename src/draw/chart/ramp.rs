//! Colours for values.

use svg::node::element::Group;

use crate::draw::shapes::{INK, blend, rectangle, text};

/// Height of a key with what is below it, px.
pub(crate) const KEY_PX: f64 = 200.0;

/// From the least value, light, to the greatest, dark. Lightness falls all the way, so it reads in grey too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// Value of the lightest colour.
    pub low: f64,
    /// Value of the darkest colour.
    pub high: f64,
}

/// Colours at even steps from the lightest to the darkest.
const COLOURS: [(f64, [f64; 3]); 6] = [
    (0.0, [253.0, 247.0, 226.0]),
    (1.0, [250.0, 214.0, 150.0]),
    (2.0, [240.0, 160.0, 96.0]),
    (3.0, [206.0, 92.0, 82.0]),
    (4.0, [132.0, 45.0, 92.0]),
    (5.0, [54.0, 20.0, 76.0]),
];

impl Ramp {
    /// Colour of a value, and that of a text on it.
    pub(crate) fn colour(&self, value: f64) -> (String, &'static str) {
        let share = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        let colour = blend(&COLOURS, share * (COLOURS.len() - 1) as f64);
        (colour, if share > 0.5 { "#ffffff" } else { INK })
    }

    /// A column of colours with the values at its ends and in its middle.
    pub(crate) fn draw_key(&self, label: &str, x: f64, y: f64) -> Group {
        const STEPS: u32 = 30;
        const COLUMN_PX: f64 = 150.0;
        let mut group = Group::new().add(text(label, x, y + 4.0, 12.0));
        let top = y + 18.0;
        for k in 0..STEPS {
            let share = (f64::from(k) + 0.5) / f64::from(STEPS);
            let at = top + COLUMN_PX * (1.0 - f64::from(k + 1) / f64::from(STEPS));
            let colour = self.colour(self.low + share * (self.high - self.low)).0;
            group = group.add(rectangle([x, at, x + 18.0, at + COLUMN_PX / f64::from(STEPS) + 0.4]).set("fill", colour));
        }
        for share in [0.0, 0.5, 1.0] {
            let value = self.low + share * (self.high - self.low);
            let number = format!("{value:.1}");
            group = group.add(text(&number, x + 26.0, top + COLUMN_PX * (1.0 - share) + 4.0, 12.0).set("fill", INK));
        }
        group
    }
}
