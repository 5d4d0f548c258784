//! Whether the robot can drive home from where runs start, round what is in the way.

use std::collections::BTreeSet;

use super::World;
use super::polygon::{anticlockwise, contains};
use crate::fault::Fault;
use crate::geometry::Vector2;

/// Distance between places that are driven between, m: finer than any robot is wide.
const STEP_M: f64 = 0.1;
/// Most places that are looked at: a hall of 200 x 200 m.
const MOST: usize = 4_000_000;

impl World {
    /// Starts from which the robot cannot drive home, and a start region that has no place from which it can: a fault each. What moves
    /// by itself is not in the way.
    ///
    /// This takes longer than all other checks of a world together, and loading does not do it.
    #[must_use]
    pub fn unreachable_starts(&self) -> Vec<Fault> {
        let start = &self.spec.start;
        let Some(reached) = self.places_around_home() else { return Vec::new() };
        let at = |place: &(i32, i32)| self.home.position() + Vector2::new(f64::from(place.0), f64::from(place.1)) * STEP_M;
        let mut faults = Vec::new();
        for (k, named) in start.named.iter().enumerate() {
            let from = Vector2::new(named.x_m, named.y_m);
            let local = (from - self.home.position()) / STEP_M;
            let (column, row) = (local.x.round() as i32, local.y.round() as i32);
            let near = (-2..=2).flat_map(|dx| (-2..=2).map(move |dy| (column + dx, row + dy)));
            if !near.into_iter().any(|place| reached.contains(&place) && self.is_corridor_free(from, at(&place)).is_ok()) {
                faults.push(Fault {
                    place: format!("start.named[{k}]"),
                    found: format!("[{}, {}], from where the robot cannot drive home", from.x, from.y),
                    allowed: "a place that hangs together with home, wide enough for the robot all the way".to_owned(),
                    owner: Some(named.name.clone()),
                    line: None,
                });
            }
        }
        let region = start.region_m.as_deref().map_or_else(|| self.outline.clone(), anticlockwise);
        let distances = start.min_distance_m..=start.max_distance_m;
        let serves = |place: &(i32, i32)| {
            let from = at(place);
            distances.contains(&(from - self.home.position()).norm()) && contains(&region, from)
        };
        if !reached.iter().any(serves) {
            let place = if start.region_m.is_some() { "start.region_m" } else { "start.min_distance_m" };
            faults.push(Fault {
                place: place.to_owned(),
                found: format!(
                    "no place {} to {} m from home from where the robot can drive there",
                    distances.start(),
                    distances.end()
                ),
                allowed: "starts that hang together with home, wide enough for the robot all the way".to_owned(),
                owner: None,
                line: None,
            });
        }
        faults
    }

    /// The places of a lattice around home that the robot reaches from there by straight moves; `None` where they are too many.
    fn places_around_home(&self) -> Option<BTreeSet<(i32, i32)>> {
        let at = |(column, row): (i32, i32)| self.home.position() + Vector2::new(f64::from(column), f64::from(row)) * STEP_M;
        let mut reached = BTreeSet::from([(0, 0)]);
        let mut queue = vec![(0, 0)];
        while let Some((column, row)) = queue.pop() {
            for next in [(column - 1, row), (column + 1, row), (column, row - 1), (column, row + 1)] {
                if !reached.contains(&next) && self.is_corridor_free(at((column, row)), at(next)).is_ok() {
                    reached.insert(next);
                    queue.push(next);
                }
            }
            if reached.len() > MOST {
                return None;
            }
        }
        Some(reached)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_behind_a_wall_without_a_door_is_told() {
        let text = |door: &str, start: &str| {
            format!(
                "name = \"two-rooms\"\nhome = {{ x_m = 1, y_m = 1 }}\n[room]\noutline_m = [[0, 0], [6, 0], [6, 3], [0, 3]]\n\
                 [[walls]]\nfrom_m = [3, 0]\nto_m = [3, 3]\n{door}\n[start]\n{start}\n"
            )
        };
        let faults = |door: &str, start: &str| World::from_toml(&text(door, start), "w.toml").unwrap().unreachable_starts();
        let door = |width_m: f64| format!("openings = [{{ from_start_m = 1, width_m = {width_m} }}]");
        let starts = "named = [{ name = \"near\", x_m = 2, y_m = 2 }, { name = \"far\", x_m = 5.03, y_m = 2.27 }]";
        assert_eq!(faults(&door(0.6), starts), []);
        for walled in ["", &door(0.3)] {
            let found = faults(walled, starts);
            assert_eq!((found.len(), found[0].place.as_str(), found[0].owner.as_deref()), (1, "start.named[1]", Some("far")));
        }
        let region = "region_m = [[4, 0.5], [5.5, 0.5], [5.5, 2.5], [4, 2.5]]\nmax_distance_m = 5";
        assert_eq!(faults(&door(0.6), region), []);
        assert_eq!(faults("", region).iter().map(|f| f.place.as_str()).collect::<Vec<_>>(), ["start.region_m"]);
    }
}
