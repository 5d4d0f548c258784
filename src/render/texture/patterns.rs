//! The pattern families.

use super::canvas::{Canvas, Colour, below, between};
use crate::random::Stream;

/// Red, green and blue of a hue (0 to 1), a saturation and a lightness of the brightest channel.
fn hued(hue: f64, saturation: f64, value: f64) -> Colour {
    let channel = |shift: f64| {
        let x = hue + shift;
        let x = 6.0 * (x - libm::floor(x));
        let ramp = (libm::fabs(x - 3.0) - 1.0).clamp(0.0, 1.0);
        (255.0 * value * (1.0 - saturation * (1.0 - ramp))) as f32
    };
    [channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)]
}

/// A dark colour of any hue.
fn dark(stream: &mut Stream) -> Colour {
    hued(between(stream, 0.0, 1.0), between(stream, 0.3, 0.9), between(stream, 0.05, 0.3))
}

/// A light colour of any hue.
fn light(stream: &mut Stream) -> Colour {
    hued(between(stream, 0.0, 1.0), between(stream, 0.0, 0.45), between(stream, 0.8, 1.0))
}

/// A strong colour of any hue.
fn strong(stream: &mut Stream) -> Colour {
    hued(between(stream, 0.0, 1.0), between(stream, 0.6, 1.0), between(stream, 0.45, 0.95))
}

/// A colour times a random factor, with a little tint of its own.
fn varied(stream: &mut Stream, base: Colour, range: f64) -> Colour {
    let factor = between(stream, 1.0 - range, 1.0 + range) as f32;
    base.map(|x| x * factor * between(stream, 0.93, 1.07) as f32)
}

/// Smooth noise over octaves from the period down to 3 cm, the low ones strongest.
pub(super) fn noise(canvas: &mut Canvas, stream: &mut Stream) {
    let mut wavelength = 1.0_f64.min(canvas.period);
    let mut strength = 130.0;
    while wavelength > 0.03 {
        canvas.noise(stream, [wavelength; 2], strength, 0.3);
        wavelength *= 0.5;
        strength *= 0.85;
    }
}

/// Bricks of 24 x 8 cm in running bond, each of its own shade, and stains over them.
pub(super) fn brick(canvas: &mut Canvas, stream: &mut Stream) {
    const JOINT: f64 = 0.011;
    let mortar = canvas.base.map(|x| 0.6 * x + 85.0);
    let (rows, height) = canvas.divide(0.08);
    let (columns, length) = canvas.divide(0.24);
    canvas.each(|_, _, c| *c = mortar);
    for row in 0..rows {
        let v = row as f64 * height;
        for column in 0..columns {
            let u = (column as f64 + 0.5 * (row % 2) as f64) * length;
            let shade = match below(stream, 8) {
                0 => varied(stream, canvas.base.map(|x| 0.35 * x), 0.3),
                1 => varied(stream, canvas.base.map(|x| 0.5 * x + 110.0), 0.2),
                _ => varied(stream, canvas.base, 0.45),
            };
            canvas.rectangle([u, u + length - JOINT], [v, v + height - JOINT], shade);
            if below(stream, 3) == 0 {
                let (x, y) = (between(stream, 0.02, length - 0.04), between(stream, 0.015, height - 0.025));
                let spot = varied(stream, shade.map(|x| 0.5 * x), 0.3);
                canvas.disc(u + x, v + y, between(stream, 0.008, 0.022), spot);
            }
        }
    }
    canvas.noise(stream, [0.9; 2], 40.0, 0.2);
    canvas.noise(stream, [0.3; 2], 25.0, 0.2);
    canvas.noise(stream, [0.025; 2], 14.0, 0.2);
}

/// Boards of 12 cm along u, of many lengths and shades, with grain and knots.
pub(super) fn planks(canvas: &mut Canvas, stream: &mut Stream) {
    let (rows, width) = canvas.divide(0.12);
    for row in 0..rows {
        let v = row as f64 * width;
        let start = between(stream, 0.0, canvas.period);
        let mut u = 0.0;
        while u < canvas.period - 1e-9 {
            let rest = canvas.period - u;
            let length = between(stream, 0.5, 1.6);
            let length = if rest - length < 0.5 { rest } else { length };
            let board = [start + u, start + u + length];
            let shade = varied(stream, canvas.base, 0.4);
            canvas.rectangle(board, [v, v + width], shade);
            for _ in 0..below(stream, 4) {
                let y = between(stream, 0.15, 0.85) * width;
                let from = between(stream, 0.0, 0.6) * length;
                let to = (from + between(stream, 0.1, 0.5)).min(length);
                let drift = between(stream, -0.1, 0.1) * width;
                let grain = shade.map(|x| 0.7 * x);
                let width = between(stream, 0.004, 0.01);
                canvas.stroke([board[0] + from, v + y], [board[0] + to, v + y + drift], width, grain);
            }
            if below(stream, 2) == 0 {
                let x = board[0] + between(stream, 0.1, 0.9) * length;
                let y = v + between(stream, 0.3, 0.7) * width;
                let radius = between(stream, 0.008, 0.02);
                canvas.disc(x, y, 1.6 * radius, shade.map(|x| 0.75 * x));
                canvas.disc(x, y, radius, shade.map(|x| 0.45 * x));
            }
            canvas.darken([board[1] - 0.006, board[1]], [v, v + width], 0.4);
            u += length;
        }
        canvas.darken([0.0, canvas.period], [v, v + 0.005], 0.4);
    }
    canvas.noise(stream, [0.4, 0.02], 14.0, 0.1);
    canvas.noise(stream, [0.8; 2], 18.0, 0.2);
}

/// Square tiles of 20 cm with joints, each of its own shade, many with a motif.
pub(super) fn tiles(canvas: &mut Canvas, stream: &mut Stream) {
    let (n, edge) = canvas.divide(0.2);
    let joint = 0.03 * edge;
    let grout = canvas.base.map(|x| 0.45 * x);
    canvas.each(|_, _, c| *c = grout);
    for k in 0..n * n {
        let (u, v) = ((k / n) as f64 * edge, (k % n) as f64 * edge);
        let shade = if below(stream, 6) == 0 { strong(stream) } else { varied(stream, canvas.base, 0.5) };
        canvas.rectangle([u + joint, u + edge], [v + joint, v + edge], shade);
        let (x, y) = (u + 0.5 * (edge + joint), v + 0.5 * (edge + joint));
        let r = between(stream, 0.15, 0.42) * edge;
        let motif = if below(stream, 2) == 0 { dark(stream) } else { light(stream) };
        match below(stream, 7) {
            0 => canvas.disc(x, y, r, motif),
            1 => canvas.polygon(&[[x - r, y], [x, y - r], [x + r, y], [x, y + r]], motif),
            2 => canvas.polygon(&[[u + joint, v + joint], [u + edge, v + joint], [u + edge, v + edge]], motif),
            3 => {
                canvas.disc(x, y, r, motif);
                canvas.disc(x, y, 0.5 * r, shade);
            }
            4 => canvas.stroke([x - r, y - r], [x + r, y + r], 0.1 * edge, motif),
            _ => {}
        }
    }
    canvas.noise(stream, [0.7; 2], 20.0, 0.2);
}

/// Horizontal bands of 4 to 30 cm.
pub(super) fn bands(canvas: &mut Canvas, stream: &mut Stream) {
    let mut v = 0.0;
    while v < canvas.period {
        let height = between(stream, 0.04, 0.3);
        let shade = match below(stream, 3) {
            0 => dark(stream),
            1 => light(stream),
            _ => varied(stream, canvas.base, 0.4),
        };
        canvas.rectangle([0.0, canvas.period], [v, (v + height).min(canvas.period)], shade);
        v += height;
    }
}

/// Book shelves: boards and uprights, between them books, boxes and gaps.
pub(super) fn shelves(canvas: &mut Canvas, stream: &mut Stream) {
    let wood = canvas.base;
    let back = wood.map(|x| 0.3 * x);
    let (rows, height) = canvas.divide(0.34);
    let (bays, bay) = canvas.divide(0.8);
    canvas.each(|_, _, c| *c = back);
    for row in 0..rows {
        let v = row as f64 * height;
        let clear = height - 0.025;
        // Uprights of neighbouring rows need not line up: no two rows are then alike.
        let shift = between(stream, 0.0, bay);
        for k in 0..bays {
            let u = shift + k as f64 * bay;
            fill_bay(canvas, stream, [u + 0.025, u + bay], [v + 0.025, v + 0.025 + clear]);
            canvas.rectangle([u, u + 0.025], [v, v + height], varied(stream, wood, 0.15));
        }
        canvas.rectangle([0.0, canvas.period], [v, v + 0.025], varied(stream, wood, 0.2));
    }
    canvas.noise(stream, [0.6; 2], 12.0, 0.1);
}

fn fill_bay(canvas: &mut Canvas, stream: &mut Stream, [mut u, end]: [f64; 2], [bottom, top]: [f64; 2]) {
    let clear = top - bottom;
    while u < end {
        let rest = end - u;
        match below(stream, 14) {
            0 => u += between(stream, 0.03, 0.15), // a gap
            1 => {
                // A pile of books lying flat.
                let width = between(stream, 0.15, 0.26).min(rest);
                let mut v = bottom;
                while v < bottom + 0.6 * clear {
                    let thick = between(stream, 0.02, 0.05);
                    let inset = between(stream, 0.0, 0.04).min(0.4 * width);
                    let cover = book(stream);
                    canvas.rectangle([u + inset, u + width], [v, v + thick - 0.003], cover);
                    v += thick;
                }
                u += width;
            }
            2 => {
                // A box with a label.
                let width = between(stream, 0.12, 0.3).min(rest);
                let height = between(stream, 0.5, 0.9) * clear;
                let (case, label) = (strong(stream), light(stream));
                canvas.rectangle([u, u + width - 0.005], [bottom, bottom + height], case);
                let (x, y) = (u + 0.5 * width, bottom + between(stream, 0.3, 0.7) * height);
                canvas.rectangle([x - 0.3 * width, x + 0.3 * width], [y - 0.035, y + 0.035], label);
                if below(stream, 2) == 0 {
                    let ink = dark(stream);
                    canvas.disc(x, y, 0.02, ink);
                }
                u += width;
            }
            _ => {
                // A set of 1 to 5 volumes of one kind.
                let (cover, ink) = (book(stream), if below(stream, 2) == 0 { light(stream) } else { dark(stream) });
                let height = between(stream, 0.55, 0.95) * clear;
                let thick = between(stream, 0.018, 0.065);
                let band = between(stream, 0.15, 0.8) * height;
                let wide = between(stream, 0.01, 0.06);
                for _ in 0..=below(stream, 5) {
                    if u + thick > end {
                        break;
                    }
                    let spine = [u, u + thick - 0.003];
                    canvas.rectangle(spine, [bottom, bottom + height], varied(stream, cover, 0.12));
                    canvas.rectangle(spine, [bottom + band, bottom + band + wide], ink);
                    if below(stream, 3) == 0 {
                        canvas.rectangle(spine, [bottom + 0.02, bottom + 0.035], ink);
                    }
                    u += thick;
                }
                if rest < 0.02 || u + thick > end {
                    u += 0.02;
                }
            }
        }
    }
}

fn book(stream: &mut Stream) -> Colour {
    match below(stream, 4) {
        0 => dark(stream),
        1 => light(stream),
        _ => strong(stream),
    }
}

/// A wall of posters and notes, the largest drawn first and the small ones in what is left.
pub(super) fn posters(canvas: &mut Canvas, stream: &mut Stream) {
    canvas.noise(stream, [1.0; 2], 25.0, 0.4);
    canvas.noise(stream, [0.12; 2], 12.0, 0.3);
    // A coarse grid remembers what is taken.
    let (n, cell) = canvas.divide(0.04);
    let mut taken = vec![false; n * n];
    for (largest, smallest, tries) in [(0.9, 0.5, 40), (0.6, 0.3, 80), (0.35, 0.2, 200), (0.22, 0.12, 400), (0.12, 0.06, 800)] {
        for _ in 0..tries {
            let size = [(); 2].map(|()| between(stream, smallest, largest).min(0.9 * canvas.period));
            let cells = size.map(|s| (libm::ceil(s / cell) as usize).clamp(1, n));
            let at = [(); 2].map(|()| below(stream, n));
            let covered: Vec<usize> =
                (0..cells[0] * cells[1]).map(|k| (at[0] + k / cells[1]) % n * n + (at[1] + k % cells[1]) % n).collect();
            if covered.iter().any(|&k| taken[k]) {
                continue;
            }
            for k in covered {
                taken[k] = true;
            }
            let [u, v] = at.map(|k| k as f64 * cell);
            panel(canvas, stream, [u, u + size[0]], [v, v + size[1]]);
        }
    }
}

/// One poster, filling the box.
fn panel(canvas: &mut Canvas, stream: &mut Stream, u: [f64; 2], v: [f64; 2]) {
    let (width, height) = (u[1] - u[0], v[1] - v[0]);
    let small = width.min(height);
    let dark_ground = below(stream, 5) < 2;
    let ground = if dark_ground { dark(stream) } else { light(stream) };
    let ink = |stream: &mut Stream| if dark_ground { light(stream) } else { dark(stream) };
    canvas.rectangle(u, v, ground);
    let edge = 0.04 * small;
    if small > 0.15 && below(stream, 2) == 0 {
        let frame = strong(stream);
        for (a, b) in [(u, [v[0], v[0] + edge]), (u, [v[1] - edge, v[1]])] {
            canvas.rectangle(a, b, frame);
        }
        for (a, b) in [([u[0], u[0] + edge], v), ([u[1] - edge, u[1]], v)] {
            canvas.rectangle(a, b, frame);
        }
    }
    let (u, v) = ([u[0] + 2.0 * edge, u[1] - 2.0 * edge], [v[0] + 2.0 * edge, v[1] - 2.0 * edge]);
    if small < 0.13 {
        let ink = ink(stream);
        note(canvas, stream, u, v, ink);
        return;
    }
    match below(stream, 7) {
        0 => text(canvas, stream, u, v, dark_ground),
        1 => chart(canvas, stream, u, v),
        2 => mosaic(canvas, stream, u, v, dark_ground),
        3 => nested(canvas, stream, u, v),
        4 => shapes(canvas, stream, u, v),
        5 => {
            // A picture above, text below.
            let middle = v[0] + between(stream, 0.3, 0.5) * (v[1] - v[0]);
            text(canvas, stream, u, [v[0], middle - edge], dark_ground);
            let sky = strong(stream);
            canvas.rectangle(u, [middle, v[1]], sky);
            shapes(canvas, stream, u, [middle, v[1]]);
        }
        _ => rays(canvas, stream, u, v),
    }
}

/// A small note: one simple sign.
fn note(canvas: &mut Canvas, stream: &mut Stream, u: [f64; 2], v: [f64; 2], ink: Colour) {
    let (x, y) = (0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
    let r = 0.5 * (u[1] - u[0]).min(v[1] - v[0]);
    match below(stream, 5) {
        0 => canvas.disc(x, y, 0.8 * r, ink),
        1 => canvas.polygon(&[[x - r, y - r], [x + r, y - r], [x, y + r]], ink),
        2 => canvas.rectangle([x - 0.4 * r, x + r], [y - r, y + 0.2 * r], ink),
        3 => {
            canvas.stroke([u[0], v[0]], [u[1], v[1]], 0.4 * r, ink);
            canvas.disc(u[0], v[1], 0.5 * r, ink);
        }
        _ => glyph(canvas, stream, [x - r, x + r], [y - r, y + r], ink),
    }
}

/// A letter of no alphabet: strokes between the nodes of a 3 x 3 grid.
fn glyph(canvas: &mut Canvas, stream: &mut Stream, u: [f64; 2], v: [f64; 2], ink: Colour) {
    let pen = 0.2 * (v[1] - v[0]).min(u[1] - u[0]);
    let node = |stream: &mut Stream| {
        let k = below(stream, 9);
        let at = |[low, high]: [f64; 2], k: usize| low + pen + 0.5 * k as f64 * (high - low - 2.0 * pen);
        [at(u, k % 3), at(v, k / 3)]
    };
    let mut from = node(stream);
    for _ in 0..3 + below(stream, 3) {
        let to = node(stream);
        canvas.stroke(from, to, pen, ink);
        from = to;
    }
}

/// Lines of glyphs: a headline and smaller text.
fn text(canvas: &mut Canvas, stream: &mut Stream, u: [f64; 2], v: [f64; 2], on_dark: bool) {
    let mut size = ((v[1] - v[0]) * between(stream, 0.15, 0.4)).clamp(0.04, 0.25);
    let mut y = v[1];
    while y - size > v[0] {
        let ink = if on_dark { light(stream) } else { dark(stream) };
        let mut x = u[0] + between(stream, 0.0, 0.5) * size;
        let end = u[1] - between(stream, 0.0, 0.3) * (u[1] - u[0]);
        while x + 0.75 * size < end {
            if below(stream, 6) > 0 {
                glyph(canvas, stream, [x, x + 0.75 * size], [y - size, y], ink);
            }
            x += 0.85 * size;
        }
        y -= 1.25 * size;
        size = (size * between(stream, 0.5, 0.9)).max(0.035);
    }
}

/// A bar chart.
fn chart(canvas: &mut Canvas, stream: &mut Stream, u: [f64; 2], v: [f64; 2]) {
    let mut x = u[0];
    while x < u[1] {
        let width = between(stream, 0.03, 0.09).min(u[1] - x);
        let top = v[0] + between(stream, 0.1, 1.0) * (v[1] - v[0]);
        let bar = if below(stream, 2) == 0 { strong(stream) } else { dark(stream) };
        canvas.rectangle([x, x + 0.8 * width], [v[0], top], bar);
        let cap = light(stream);
        let middle = v[0] + between(stream, 0.2, 0.8) * (top - v[0]);
        canvas.rectangle([x, x + 0.8 * width], [middle, (middle + 0.03).min(top)], cap);
        x += width;
    }
}

/// Square cells, black or coloured at random.
fn mosaic(canvas: &mut Canvas, stream: &mut Stream, u: [f64; 2], v: [f64; 2], on_dark: bool) {
    let cell = between(stream, 0.035, 0.1);
    let ink = if on_dark { light(stream) } else { dark(stream) };
    let accent = strong(stream);
    let (nu, nv) = (((u[1] - u[0]) / cell) as usize, ((v[1] - v[0]) / cell) as usize);
    for k in 0..nu * nv {
        let colour = match below(stream, 9) {
            0..4 => ink,
            4 => accent,
            _ => continue,
        };
        let (x, y) = (u[0] + (k / nv) as f64 * cell, v[0] + (k % nv) as f64 * cell);
        canvas.rectangle([x, x + cell], [y, y + cell], colour);
    }
}

/// Rings or frames around a centre, dark and light by turns.
fn nested(canvas: &mut Canvas, stream: &mut Stream, u: [f64; 2], v: [f64; 2]) {
    let mut half = [0.5 * (u[1] - u[0]), 0.5 * (v[1] - v[0])];
    let mut centre = [0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1])];
    let round = below(stream, 2) == 0;
    let mut bright = false;
    while half[0].min(half[1]) > 0.015 {
        let colour = match (below(stream, 3), bright) {
            (0, _) => strong(stream),
            (_, true) => light(stream),
            _ => dark(stream),
        };
        bright = !bright;
        if round {
            canvas.disc(centre[0], centre[1], half[0].min(half[1]), colour);
        } else {
            let side = |k: usize| [centre[k] - half[k], centre[k] + half[k]];
            canvas.rectangle(side(0), side(1), colour);
        }
        let step = between(stream, 0.12, 0.4);
        for k in 0..2 {
            centre[k] += between(stream, -0.5, 0.5) * step * half[0].min(half[1]);
            half[k] *= 1.0 - step;
        }
    }
}

/// Discs, triangles and strokes over one another.
fn shapes(canvas: &mut Canvas, stream: &mut Stream, u: [f64; 2], v: [f64; 2]) {
    let (width, height) = (u[1] - u[0], v[1] - v[0]);
    let small = width.min(height);
    let count = 4 + (width * height * 60.0).min(30.0) as usize;
    for k in 0..count {
        let size = small * between(stream, 0.5, 1.0) * 0.5 / (1.0 + 0.35 * k as f64);
        let r = size.max(0.012).min(0.5 * small);
        let x = between(stream, u[0] + r, u[1] - r + 1e-6);
        let y = between(stream, v[0] + r, v[1] - r + 1e-6);
        let colour = match below(stream, 3) {
            0 => dark(stream),
            1 => light(stream),
            _ => strong(stream),
        };
        match below(stream, 4) {
            0 => canvas.disc(x, y, r, colour),
            1 => canvas.rectangle([x - r, x + r], [y - between(stream, 0.3, 1.0) * r, y + r], colour),
            2 => {
                let tip = between(stream, x - r, x + r);
                let corners = if below(stream, 2) == 0 {
                    [[x - r, y - r], [x + r, y - r], [tip, y + r]]
                } else {
                    [[x - r, y + r], [x + r, y + r], [tip, y - r]]
                };
                canvas.polygon(&corners, colour);
            }
            _ => {
                let ends = [(); 4].map(|()| between(stream, -r, r));
                canvas.stroke([x + ends[0], y + ends[1]], [x + ends[2], y + ends[3]], 0.3 * r, colour);
            }
        }
    }
}

/// Wedges around a point, each of its own colour.
fn rays(canvas: &mut Canvas, stream: &mut Stream, u: [f64; 2], v: [f64; 2]) {
    let centre = [between(stream, u[0], u[1]), between(stream, v[0], v[1])];
    // Corners and points on the border, in order around it.
    let mut border: Vec<[f64; 2]> = Vec::new();
    for [a, b] in
        [[[u[0], v[0]], [u[1], v[0]]], [[u[1], v[0]], [u[1], v[1]]], [[u[1], v[1]], [u[0], v[1]]], [[u[0], v[1]], [u[0], v[0]]]]
    {
        border.push(a);
        let mut s = between(stream, 0.1, 0.4);
        while s < 0.95 {
            border.push([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]);
            s += between(stream, 0.1, 0.4);
        }
    }
    for k in 0..border.len() {
        let colour = match (below(stream, 3), k % 2) {
            (0, _) => strong(stream),
            (_, 0) => dark(stream),
            _ => light(stream),
        };
        canvas.polygon(&[centre, border[k], border[(k + 1) % border.len()]], colour);
    }
    let hub = light(stream);
    canvas.disc(centre[0], centre[1], 0.1 * (u[1] - u[0]).min(v[1] - v[0]), hub);
}
