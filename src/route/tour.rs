//! Ways through a world for which nobody names way-points: from one far place to the next, with room to either side.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rand_pcg::rand_core::Rng;

use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2};
use crate::random::Seed;
use crate::world::World;

/// Edge of a cell of the map that ways are sought on, m.
const CELL_M: f64 = 0.15;
/// What a way keeps between the robot and what stands, m, ...
const MARGIN_M: f64 = 0.12;
/// ... and within which it is loath to go on.
const LOATH_M: f64 = 0.35;
/// Most cells.
const MOST: usize = 1_000_000;

/// Which cells the robot can stand on.
struct Cells<'a> {
    world: &'a World,
    low: Vector2<f64>,
    columns: usize,
    /// Cost of a cell: 1, more near to things; `None` where the robot cannot stand.
    cost: Vec<Option<u32>>,
}

impl<'a> Cells<'a> {
    fn new(world: &'a World) -> Result<Self> {
        let (mut low, mut high) = (world.outline[0], world.outline[0]);
        for corner in &world.outline {
            low = low.inf(corner);
            high = high.sup(corner);
        }
        let size = high - low;
        let [columns, rows] = [size.x, size.y].map(|s| (s / CELL_M).ceil() as usize);
        if columns * rows > MOST {
            return Err(Error::Unfit {
                what: "world for a tour".into(),
                found: format!("{:.0} x {:.0} m", size.x, size.y),
                needed: "at most 22,500 square metres; name way-points instead".into(),
            });
        }
        let standing: Vec<Pose> = world.body_poses();
        let mut cells = Self { world, low, columns, cost: vec![None; columns * rows] };
        for k in 0..cells.cost.len() {
            let middle = cells.middle(k);
            let at = Pose::new(middle.x, middle.y, 0.0);
            cells.cost[k] = match (world.is_free(&at, MARGIN_M, &standing), world.is_free(&at, LOATH_M, &standing)) {
                (Err(_), _) => None,
                (Ok(()), Err(_)) => Some(30),
                (Ok(()), Ok(())) => Some(10),
            };
        }
        Ok(cells)
    }

    fn middle(&self, k: usize) -> Vector2<f64> {
        self.low + Vector2::new((k % self.columns) as f64 + 0.5, (k / self.columns) as f64 + 0.5) * CELL_M
    }

    /// Cells around one, with tenths of the steps to them.
    fn around(&self, k: usize) -> impl Iterator<Item = (usize, u32)> + '_ {
        let (x, y) = ((k % self.columns) as i64, (k / self.columns) as i64);
        let rows = (self.cost.len() / self.columns) as i64;
        let steps = [(-1, 0, 10), (1, 0, 10), (0, -1, 10), (0, 1, 10), (-1, -1, 14), (-1, 1, 14), (1, -1, 14), (1, 1, 14)];
        steps.into_iter().filter_map(move |(dx, dy, step)| {
            let (x, y) = (x + dx, y + dy);
            let inside = x >= 0 && y >= 0 && x < self.columns as i64 && y < rows;
            let k = (y * self.columns as i64 + x) as usize;
            (inside && self.cost[k].is_some()).then_some((k, step))
        })
    }

    /// Cost of the cheapest way from a cell to each, and where it comes from.
    fn ways(&self, from: usize) -> (Vec<u32>, Vec<usize>) {
        let mut cost = vec![u32::MAX; self.cost.len()];
        let mut before = vec![usize::MAX; self.cost.len()];
        cost[from] = 0;
        let mut queue = BinaryHeap::from([Reverse((0, from))]);
        while let Some(Reverse((so_far, k))) = queue.pop() {
            if so_far > cost[k] {
                continue;
            }
            for (next, step) in self.around(k) {
                let new = so_far + step * self.cost[next].unwrap_or(10) / 10;
                if new < cost[next] {
                    cost[next] = new;
                    before[next] = k;
                    queue.push(Reverse((new, next)));
                }
            }
        }
        (cost, before)
    }

    /// Whether the robot can drive straight between two cells with the same room to either side that cells have.
    fn sees(&self, from: usize, to: usize) -> bool {
        let (a, b) = (self.middle(from), self.middle(to));
        let steps = ((b - a).norm() / (0.4 * CELL_M)).ceil().max(1.0);
        let free = (0..=steps as usize).all(|k| {
            let at = (a + (b - a) * (k as f64 / steps) - self.low) / CELL_M;
            self.cost[at.y as usize * self.columns + at.x as usize].is_some()
        });
        free && self.world.is_corridor_free(a, b).is_ok()
    }
}

/// Way-points of a tour of about `length_m` from one far place to the next, drawn by `seed`; it begins at a place near home.
///
/// # Errors
/// When the world is too large, or the robot cannot drive anywhere from home.
pub fn tour(world: &World, seed: u64, length_m: f64) -> Result<Vec<Vector2<f64>>> {
    let cells = Cells::new(world)?;
    let nearest = |point: Vector2<f64>| {
        let free = (0..cells.cost.len()).filter(|k| cells.cost[*k].is_some());
        free.min_by(|a, b| (cells.middle(*a) - point).norm().total_cmp(&(cells.middle(*b) - point).norm()))
    };
    let nowhere = || Error::Unfit {
        what: format!("tour through `{}`", world.spec.name),
        found: "no place that the robot can drive to from home".into(),
        needed: "free floor around home, at least 3 m across".into(),
    };
    let mut stream = Seed(seed).stream("tour");
    let mut at = nearest(world.home.position()).ok_or_else(nowhere)?;
    let mut way = vec![at];
    let mut been = vec![at];
    let mut so_far_m = 0.0;
    while so_far_m < length_m {
        let (cost, before) = cells.ways(at);
        // Far from where the tour has been, of a few places drawn.
        let reached: Vec<usize> = (0..cost.len()).filter(|k| cost[*k] != u32::MAX && cells.cost[*k] == Some(10)).collect();
        if reached.len() < 200 {
            return Err(nowhere());
        }
        let worth = |k: &usize| been.iter().map(|b| (cells.middle(*b) - cells.middle(*k)).norm()).fold(f64::INFINITY, f64::min);
        let drawn: Vec<usize> = (0..24).map(|_| reached[(stream.next_u64() % reached.len() as u64) as usize]).collect();
        let Some(goal) = drawn.into_iter().max_by(|a, b| worth(a).total_cmp(&worth(b))) else { return Err(nowhere()) };
        let mut piece = vec![goal];
        while let Some(k) = piece.last().map(|k| before[*k]).filter(|k| *k != usize::MAX) {
            piece.push(k);
        }
        piece.reverse();
        so_far_m += piece.windows(2).map(|p| (cells.middle(p[1]) - cells.middle(p[0])).norm()).sum::<f64>();
        way.extend(&piece[1..]);
        been.push(goal);
        at = goal;
    }
    // Straight where it can be, but never back over a goal.
    let mut points = vec![way[0]];
    let mut k = 0;
    while k + 1 < way.len() {
        let goal = (k + 1..way.len()).find(|j| been.contains(&way[*j])).unwrap_or(way.len() - 1);
        let next = (k + 1..=goal).rev().find(|j| cells.sees(way[k], way[*j])).unwrap_or(k + 1);
        points.push(way[next]);
        k = next;
    }
    Ok(points.into_iter().map(|k| cells.middle(k)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tour_can_be_driven_and_is_the_same_again() {
        let world = World::open("flat:3").unwrap();
        let points = tour(&world, 1, 20.0).unwrap();
        let (line, along) = crate::route::teach::way(&world, &points).unwrap();
        assert!((18.0..45.0).contains(&line.length_m()), "{}", line.length_m());
        assert!(along.is_sorted() && along.len() == points.len());
        assert_eq!(points, tour(&world, 1, 20.0).unwrap());
        assert_ne!(points, tour(&world, 2, 20.0).unwrap());
    }

    #[test]
    fn ways_that_cannot_be_driven_are_named() {
        let world = World::open("lab").unwrap();
        let told = |points: &[(f64, f64)]| {
            let points: Vec<Vector2<f64>> = points.iter().map(|(x, y)| Vector2::new(*x, *y)).collect();
            crate::route::teach::way(&world, &points).unwrap_err().to_string()
        };
        assert!(told(&[(1.5, 1.2)]).contains("at least 2"));
        assert!(told(&[(1.5, 1.2), (1.5, 1.21), (3.0, 1.4)]).contains("numbers 1 and 2"));
        assert!(told(&[(3.4, 3.0), (3.4, 9.0)]).contains("in the way from"));
    }
}
