//! Home vectors over a grid of places: does who follows them come home?
//!
//! The protocol of the field (Vardy and Moeller 2005; Moeller and Vardy 2006): every place of a grid is home in turn, and every other one gets a
//! home vector. Their errors make the average angular error (AAE); the share of places from which an agent that always follows the
//! vector of the place nearest to it arrives makes the return ratio (RR), and the area of these places is the catchment area.

use serde::Serialize;

use super::pairs::PairRow;
use crate::geometry::{Vector2, direction};
use crate::homing::HomingKind;
use crate::panorama_set::{PanoramaSet, Place};
use crate::statistics::mean;

/// Steps of the agent, as shares of the grid's spacing.
const STEP: f64 = 0.5;

/// What the vectors to one home come to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HomeField {
    /// Method.
    pub method: HomingKind,
    /// Picture at home.
    pub home: String,
    /// Other places.
    pub places: usize,
    /// Those with a home vector.
    pub answered: usize,
    /// Average angular error of the vectors, degrees.
    pub aae_deg: Option<f64>,
    /// Mean size of the error of the turn since home, degrees.
    pub compass_deg: Option<f64>,
    /// Share of the other places from which who follows the vectors arrives.
    pub return_ratio: f64,
    /// Area of these places, m^2.
    pub catchment_m2: f64,
}

/// The fields of all homes that the rows are about, method by method; none for a set that is not on a grid with known spacing.
#[must_use]
pub fn fields(rows: &[PairRow], set: &PanoramaSet, spacing_m: Option<f64>) -> Vec<HomeField> {
    let Some(spacing_m) = set.grid(spacing_m, Some(Place { i: 0, j: 0 })).map(|grid| grid.spacing_m) else { return Vec::new() };
    let same = |a: &&PairRow, b: &&PairRow| (a.method, &a.home) == (b.method, &b.home);
    let all: Vec<&PairRow> = rows.iter().collect();
    all.chunk_by(same).map(|of_home| field(of_home, spacing_m)).collect()
}

fn field(rows: &[&PairRow], spacing_m: f64) -> HomeField {
    let arrived = rows.iter().filter(|row| arrives(rows, row, spacing_m)).count();
    let sizes = |value: fn(&PairRow) -> Option<f64>| mean(rows.iter().filter_map(|r| value(r)).map(f64::abs));
    HomeField {
        method: rows[0].method,
        home: rows[0].home.clone(),
        places: rows.len(),
        answered: rows.iter().filter(|r| r.home_error_deg.is_some()).count(),
        aae_deg: sizes(|r| r.home_error_deg),
        compass_deg: sizes(|r| r.turn_error_deg),
        return_ratio: arrived as f64 / rows.len() as f64,
        catchment_m2: arrived as f64 * spacing_m * spacing_m,
    }
}

/// Whether an agent that starts at a place comes within half a spacing of home.
fn arrives(rows: &[&PairRow], start: &PairRow, spacing_m: f64) -> bool {
    // Places as they lie from home.
    let at = |row: &PairRow| Vector2::new(row.from_home_m[0], row.from_home_m[1]);
    let mut place = at(start);
    for _ in 0..2 * rows.len() {
        if place.norm() <= 0.5 * spacing_m {
            return true;
        }
        let off = |row: &&&PairRow| (at(row) - place).norm();
        let Some(nearest) = rows.iter().min_by(|a, b| off(a).total_cmp(&off(b))) else { return false };
        // Outside of the grid nobody says which way.
        let Some(toward) = nearest.toward_deg.filter(|_| off(&nearest) <= spacing_m) else { return false };
        place += direction(toward.to_radians()) * (STEP * spacing_m);
    }
    false
}

/// A method's fields together: means over homes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldSummary {
    /// Method.
    pub method: HomingKind,
    /// Homes.
    pub homes: usize,
    /// Share of places with a home vector.
    pub answered: f64,
    /// Average angular error, degrees.
    pub aae_deg: Option<f64>,
    /// Mean size of the error of the turn, degrees.
    pub compass_deg: Option<f64>,
    /// Return ratio; 0 of a method that gives no direction.
    pub return_ratio: f64,
    /// Catchment area, m^2.
    pub catchment_m2: f64,
}

/// The fields by method.
#[must_use]
pub fn summaries(fields: &[HomeField]) -> Vec<FieldSummary> {
    let one = |of: &[HomeField]| {
        let share = |value: fn(&HomeField) -> f64| mean(of.iter().map(value)).unwrap_or_default();
        FieldSummary {
            method: of[0].method,
            homes: of.len(),
            answered: share(|f| f.answered as f64 / f.places as f64),
            aae_deg: mean(of.iter().filter_map(|f| f.aae_deg)),
            compass_deg: mean(of.iter().filter_map(|f| f.compass_deg)),
            return_ratio: share(|f| f.return_ratio),
            catchment_m2: share(|f| f.catchment_m2),
        }
    };
    fields.chunk_by(|a, b| a.method == b.method).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::angle_of;
    use crate::study::pairs::Lie;

    /// Vectors of a grid of 5 x 5 places about its middle, each turned by so much.
    fn rows(turned_deg: impl Fn(Vector2<f64>) -> Option<f64>) -> Vec<PairRow> {
        let places = (0..25).map(|k| Vector2::new(f64::from(k % 5 - 2), f64::from(k / 5 - 2)) * 0.3);
        let row = |at: Vector2<f64>| PairRow {
            from_home_m: [at.x, at.y],
            toward_deg: turned_deg(at).map(|turned| angle_of(-at).to_degrees() + turned),
            home_error_deg: turned_deg(at),
            ..PairRow::empty(HomingKind::Mfdid, Lie::To1M)
        };
        places.filter(|at| at.norm() > 0.1).map(row).collect()
    }

    fn of(rows: &[PairRow]) -> HomeField {
        field(&rows.iter().collect::<Vec<_>>(), 0.3)
    }

    #[test]
    fn who_follows_right_vectors_arrives() {
        let right = of(&rows(|_| Some(0.0)));
        assert_eq!((right.places, right.answered, right.return_ratio, right.aae_deg), (24, 24, 1.0, Some(0.0)));
        assert!((right.catchment_m2 - 24.0 * 0.09).abs() < 1e-12);
        // Half a right angle off one still spirals in; beyond a right angle one leaves.
        assert_eq!(of(&rows(|_| Some(40.0))).return_ratio, 1.0);
        assert_eq!(of(&rows(|_| Some(135.0))).return_ratio, 0.0);
        // With vectors on one side alone that side arrives.
        let half = of(&rows(|at| Some(if at.x > 0.1 { 180.0 } else { 0.0 })));
        assert!((half.return_ratio - 14.0 / 24.0).abs() < 1e-12, "{half:?}");
        let none = of(&rows(|_| None));
        assert_eq!((none.answered, none.return_ratio, none.aae_deg), (0, 0.0, None));
    }
}
