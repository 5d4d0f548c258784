//! Names on a map, placed so that they neither cover one another nor other things where that can be helped.

use svg::node::element::Group;

use crate::draw::shapes::{px, text};
use crate::geometry::Vector2;
use crate::world::polygon::{bounds, contains};

/// A rectangle on the page: least x, least y, greatest x, greatest y, px.
pub(super) type Area = [f64; 4];

/// Size of names, px.
const SIZE_PX: f64 = 11.5;
/// Height of a line, px.
const LINE_PX: f64 = 1.15 * SIZE_PX;
/// Mean advance of a letter as a share of the size; measured on DejaVu Sans, the widest of the fonts asked for.
const ADVANCE: f64 = 0.6;
/// Space between a thing and its name, px.
const GAP_PX: f64 = 4.0;

/// What a name belongs to.
#[derive(Debug, Clone)]
enum Thing {
    /// A thing with its name on its surface if that is given and the name fits, else beside it.
    Beside { area: Area, surface: Vec<Vector2<f64>> },
    /// A patch of floor with its name anywhere on it.
    Within { polygon: Vec<Vector2<f64>> },
}

#[derive(Debug, Clone)]
struct Wish {
    content: String,
    colour: &'static str,
    thing: Thing,
}

/// A place for a name, with how much worse it is than the best one by its looks alone.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    area: Area,
    upright: bool,
    malus: f64,
}

/// Names wanted, and areas better left free.
#[derive(Debug, Clone, Default)]
pub(super) struct Labels {
    wishes: Vec<Wish>,
    things: Vec<Area>,
    room: Vec<Vector2<f64>>,
}

impl Labels {
    /// Keeps names inside this polygon of the page.
    pub(super) fn keep_within(&mut self, room: Vec<Vector2<f64>>) {
        self.room = room;
    }

    /// Marks an area that names should not cover.
    pub(super) fn avoid(&mut self, thing: Area) {
        self.things.push(thing);
    }

    /// Asks for a name beside a thing.
    pub(super) fn add_beside(&mut self, content: &str, colour: &'static str, area: Area) {
        self.wish(content, colour, Thing::Beside { area, surface: Vec::new() });
    }

    /// Asks for a name on a thing of this shape if it fits, else beside it.
    pub(super) fn add_on(&mut self, content: &str, colour: &'static str, surface: Vec<Vector2<f64>>) {
        let (low, high) = bounds(&surface);
        self.wish(content, colour, Thing::Beside { area: [low.x, low.y, high.x, high.y], surface });
    }

    /// Asks for a name on a patch of floor.
    pub(super) fn add_within(&mut self, content: &str, colour: &'static str, polygon: Vec<Vector2<f64>>) {
        self.wish(content, colour, Thing::Within { polygon });
    }

    fn wish(&mut self, content: &str, colour: &'static str, thing: Thing) {
        if !content.is_empty() {
            self.wishes.push(Wish { content: content.to_owned(), colour, thing });
        }
    }

    /// Places all names, one after the other, each where it covers least.
    pub(super) fn draw(&self) -> Group {
        let mut placed: Vec<Area> = Vec::new();
        let mut halos = Group::new().set("stroke", "#ffffff").set("stroke-width", 3).set("stroke-linejoin", "round");
        let mut names = Group::new();
        for wish in &self.wishes {
            let own = match &wish.thing {
                Thing::Beside { area, surface } if !surface.is_empty() => *area,
                _ => [0.0; 4],
            };
            let cost = |candidate: &Candidate| {
                let area = &candidate.area;
                let covers = |others: &[Area]| others.iter().map(|other| overlap(area, other)).sum::<f64>();
                let outside = corners(area).iter().filter(|&&corner| !contains(&self.room, corner)).count();
                20.0 * covers(&placed) + covers(&self.things) - overlap(area, &own) + 400.0 * outside as f64 + candidate.malus
            };
            let candidates = wish.candidates();
            let mut best = candidates[0];
            let mut least = f64::INFINITY;
            for candidate in candidates {
                let cost = cost(&candidate);
                if cost < least {
                    (best, least) = (candidate, cost);
                }
            }
            placed.push(best.area);
            let name = wish.draw(&best);
            halos = halos.add(name.clone().set("fill", "#ffffff").set("stroke-opacity", 0.8));
            names = names.add(name.set("fill", wish.colour));
        }
        Group::new().add(halos).add(names)
    }
}

impl Wish {
    /// Places for the name; never empty.
    fn candidates(&self) -> Vec<Candidate> {
        let width = self.content.chars().count() as f64 * ADVANCE * SIZE_PX;
        let at = |x: f64, y: f64, malus: f64| Candidate {
            area: [x - 0.5 * width, y - 0.5 * LINE_PX, x + 0.5 * width, y + 0.5 * LINE_PX],
            upright: false,
            malus,
        };
        match &self.thing {
            Thing::Beside { area: [x0, y0, x1, y1], surface } => {
                let (cx, cy) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
                let (right, left) = (x1 + GAP_PX + 0.5 * width, x0 - GAP_PX - 0.5 * width);
                let (below, above) = (y1 + GAP_PX + 0.5 * LINE_PX, y0 - GAP_PX - 0.5 * LINE_PX);
                let mut places = Vec::new();
                let fits = |place: &Candidate| corners(&place.area).iter().all(|&corner| contains(surface, corner));
                let area = [cx - 0.5 * LINE_PX, cy - 0.5 * width, cx + 0.5 * LINE_PX, cy + 0.5 * width];
                let upright = Candidate { area, upright: true, malus: 2.0 };
                places.extend([at(cx, cy, 0.0), upright].into_iter().filter(fits));
                places.extend([at(cx, above, 4.0), at(cx, below, 7.0), at(right, cy, 9.0), at(left, cy, 11.0)]);
                for (y, malus) in [(above, 14.0), (below, 18.0)] {
                    // Flush with the left or right side.
                    places.extend([at(x0 + 0.5 * width, y, malus), at(x1 - 0.5 * width, y, malus + 2.0)]);
                }
                // One line farther out, for crowded places.
                places.extend([at(cx, above - LINE_PX, 25.0), at(cx, below + LINE_PX, 28.0)]);
                places
            }
            Thing::Within { polygon } => {
                let (low, high) = bounds(polygon);
                let middle = 0.5 * (low + high);
                let mut places = Vec::new();
                for (row, column) in (0..9).flat_map(|row| (0..9).map(move |column| (row, column))) {
                    let share = Vector2::new(f64::from(column), f64::from(row)) / 8.0;
                    let point = low + (high - low).component_mul(&share);
                    let place = at(point.x, point.y, 0.3 * (point - middle).norm());
                    if corners(&place.area).iter().all(|&corner| contains(polygon, corner)) {
                        places.push(place);
                    }
                }
                if places.is_empty() { vec![at(middle.x, middle.y, 0.0)] } else { places }
            }
        }
    }

    fn draw(&self, place: &Candidate) -> svg::node::element::Text {
        let [x0, y0, x1, y1] = place.area;
        let (cx, cy) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
        let italic = matches!(self.thing, Thing::Within { .. });
        let name = text(&self.content, cx, cy + 0.35 * SIZE_PX, SIZE_PX)
            .set("text-anchor", "middle")
            .set("font-style", if italic { "italic" } else { "normal" });
        if place.upright { name.set("transform", format!("rotate(-90 {} {})", px(cx), px(cy))) } else { name }
    }
}

fn corners(area: &Area) -> [Vector2<f64>; 4] {
    let [x0, y0, x1, y1] = *area;
    [Vector2::new(x0, y0), Vector2::new(x1, y0), Vector2::new(x1, y1), Vector2::new(x0, y1)]
}

fn size(area: &Area) -> f64 {
    (area[2] - area[0]).max(0.0) * (area[3] - area[1]).max(0.0)
}

fn overlap(a: &Area, b: &Area) -> f64 {
    size(&[a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_neither_cover_each_other_nor_leave_the_room() {
        let mut labels = Labels::default();
        labels.keep_within(corners(&[0.0, 0.0, 400.0, 300.0]).to_vec());
        let things: [Area; 3] = [[100.0, 100.0, 110.0, 110.0], [112.0, 100.0, 122.0, 110.0], [0.0, 0.0, 5.0, 5.0]];
        for thing in things {
            labels.avoid(thing);
            labels.add_beside("workbench", "#000000", thing);
        }
        let svg = labels.draw().to_string();
        let number = |text: &str, key: &str| -> f64 {
            let rest = text.split(&format!(" {key}=\"")).nth(1).expect("attribute");
            rest.split('"').next().expect("value").parse().expect("number")
        };
        let at: Vec<[f64; 2]> = svg.split("<text").skip(1).take(3).map(|t| [number(t, "x"), number(t, "y")]).collect();
        let width = 9.0 * ADVANCE * SIZE_PX;
        assert!((at[0][0] - at[1][0]).abs() >= width || (at[0][1] - at[1][1]).abs() >= SIZE_PX, "{at:?}");
        assert!(at[2][0] >= 0.5 * width && at[2][1] >= 0.8 * SIZE_PX, "the corner's name stays in the room: {at:?}");
    }
}
