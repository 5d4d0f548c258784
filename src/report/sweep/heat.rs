//! Heat maps: a coloured cell a pair of levels, with a number and its interval in it.

use svg::node::element::{Group, Title};

use crate::draw::chart::{FAINT_INK, INK, blend, line, px, rectangle, text};
use crate::report::curves::{WIDTH_PX, document};
use crate::study::sweep::duels::Scale;

/// Sizes of the font that intervals are written in, px: the usual one, and the least, below which they are left out.
const INTERVAL_PX: [f64; 2] = [9.0, 7.0];
/// Height of a row, px.
const ROW_PX: f64 = 36.0;
/// About how wide a letter is, as a share of the font's size.
const LETTER: f64 = 0.56;

/// A cell of a heat map.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cell {
    /// From 0, bad, to 1, good.
    pub colour: f64,
    /// The number.
    pub number: String,
    /// Its interval.
    pub interval: String,
    /// What a pointer that rests on it is told.
    pub told: String,
    /// Whether it has a frame.
    pub framed: bool,
}

/// A heat map over the levels of two axes: `cells[y][x]`. Without a `y` it has one row.
pub(super) fn heat(title: &str, x: &Scale, y: Option<&Scale>, cells: &[Vec<Option<Cell>>], key: [&str; 3]) -> String {
    let letters = |scale: &Scale| scale.levels.iter().map(|level| level.chars().count()).max().unwrap_or(0) as f64;
    let left = y.map_or(10.0, |y| 26.0 + (12.0 * LETTER * letters(y)).min(110.0));
    let (top, right) = (34.0, WIDTH_PX - 6.0);
    let column = (right - left) / x.levels.len() as f64;
    let bottom = top + ROW_PX * cells.len() as f64;
    let slanted = 12.0 * LETTER * letters(x) > column - 4.0;
    let labels = if slanted { (11.0 * LETTER * letters(x) * 0.75).min(90.0) + 10.0 } else { 18.0 };
    let height = bottom + labels + 22.0 + 34.0;
    let longest = cells.iter().flatten().flatten().map(|cell| cell.interval.chars().count()).max().unwrap_or(0);
    let interval_px = ((column - 5.0) / (LETTER * longest.max(1) as f64)).min(INTERVAL_PX[0]);
    let mut page = document([WIDTH_PX, height]).add(text(title, 4.0, 18.0, 14.0).set("font-weight", "bold").set("fill", INK));
    for (row, cells) in cells.iter().enumerate() {
        let at = top + ROW_PX * row as f64;
        if let Some(y) = y {
            let label = text(&y.levels[row], left - 6.0, at + 0.5 * ROW_PX + 4.0, 12.0).set("text-anchor", "end");
            page = page.add(label.set("fill", INK));
        }
        for (k, cell) in cells.iter().enumerate() {
            let from = left + column * k as f64;
            page = page.add(draw(cell.as_ref(), [from, at, from + column, at + ROW_PX], interval_px));
        }
    }
    for (k, level) in x.levels.iter().enumerate() {
        let middle = left + column * (k as f64 + 0.5);
        let label = if slanted {
            let turn = format!("rotate(-48 {} {})", px(middle), px(bottom + 12.0));
            text(level, middle + 3.0, bottom + 14.0, 11.0).set("text-anchor", "end").set("transform", turn)
        } else {
            text(level, middle, bottom + 16.0, 12.0).set("text-anchor", "middle")
        };
        page = page.add(label.set("fill", INK));
    }
    let name = text(&x.label, 0.5 * (left + right), bottom + labels + 16.0, 12.0).set("text-anchor", "middle");
    page = page.add(name.set("fill", FAINT_INK));
    if let Some(y) = y {
        let middle = 0.5 * (top + bottom);
        let name = text(&y.label, 12.0, middle, 12.0).set("text-anchor", "middle").set("fill", FAINT_INK);
        page = page.add(name.set("transform", format!("rotate(-90 12 {})", px(middle))));
    }
    page.add(draw_key([left, height - 24.0, right], key)).to_string() + "\n"
}

fn draw(cell: Option<&Cell>, [left, top, right, bottom]: [f64; 4], interval_px: f64) -> Group {
    let inset = [left + 1.0, top + 1.0, right - 1.0, bottom - 1.0];
    let Some(cell) = cell else {
        let cross = line([inset[0], inset[1]], [inset[2], inset[3]]).set("stroke", "#d8d6d0");
        return Group::new().add(rectangle(inset).set("fill", "#f4f3f0")).add(cross);
    };
    let (colour, ink) = colour(cell.colour);
    let (middle, centre) = (0.5 * (left + right), 0.5 * (top + bottom));
    let wide = interval_px >= INTERVAL_PX[1] && !cell.interval.is_empty();
    let number = text(&cell.number, middle, if wide { centre } else { centre + 4.0 }, 12.5).set("text-anchor", "middle");
    let mut field = rectangle(inset).set("fill", colour).set("rx", 2);
    if cell.framed {
        field = field.set("stroke", INK).set("stroke-width", 1.6);
    }
    let mut group =
        Group::new().add(Title::new(cell.told.clone())).add(field).add(number.set("fill", ink).set("font-weight", "bold"));
    if wide {
        let interval = text(&cell.interval, middle, centre + 12.0, interval_px).set("text-anchor", "middle");
        group = group.add(interval.set("fill", ink));
    }
    group
}

/// From rust (0) over sand to blue (1), which people with any colour vision tell apart, and that of a text on it.
fn colour(share: f64) -> (String, &'static str) {
    const STOPS: [(f64, [f64; 3]); 5] = [
        (0.0, [165.0, 58.0, 38.0]),
        (0.25, [221.0, 150.0, 105.0]),
        (0.5, [243.0, 232.0, 208.0]),
        (0.75, [128.0, 178.0, 205.0]),
        (1.0, [26.0, 98.0, 148.0]),
    ];
    (blend(&STOPS, share), if (0.14..0.86).contains(&share) { INK } else { "#ffffff" })
}

/// A strip of all colours with words at its beginning, middle and end.
fn draw_key([left, top, right]: [f64; 3], words: [&str; 3]) -> Group {
    const STEPS: usize = 40;
    let step = (right - left) / STEPS as f64;
    let mut group = Group::new();
    for k in 0..STEPS {
        let from = left + step * k as f64;
        let fill = colour((k as f64 + 0.5) / STEPS as f64).0;
        group = group.add(rectangle([from, top, from + step + 0.3, top + 7.0]).set("fill", fill));
    }
    for (word, at, anchor) in [(words[0], left, "start"), (words[1], 0.5 * (left + right), "middle"), (words[2], right, "end")]
    {
        group = group.add(text(word, at, top + 19.0, 10.5).set("text-anchor", anchor).set("fill", FAINT_INK));
    }
    group
}
