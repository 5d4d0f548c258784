//! What the columns show in the row at work, and the row's ranges and instances that follow. Both renderers end with this.

use super::records::{FAR, Row};

/// What the distance of a face is told in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub(super) enum Unit {
    /// Metres, for an upright face.
    #[default]
    Metre,
    /// The inverse tangent of the row, for the top or underside of a body.
    InverseTan,
    /// The distance of floor or ceiling in the row.
    Plane,
}

/// What a column shows, from some row on.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shown {
    /// Horizontal distance.
    pub distance: f32,
    /// Its unit.
    pub unit: Unit,
    /// Instance id.
    pub instance: u16,
}

/// What some columns show.
#[derive(Debug, Default)]
pub(super) struct Now {
    distance: Vec<f32>,
    unit: Vec<Unit>,
    instance: Vec<u16>,
}

impl Now {
    /// Makes room for so many columns.
    pub fn resize(&mut self, columns: usize) {
        self.distance.resize(columns, 0.0);
        self.unit.resize(columns, Unit::Metre);
        self.instance.resize(columns, 0);
    }

    /// Notes what a column shows.
    #[inline(always)]
    pub fn set(&mut self, column: usize, shown: Shown) {
        (self.distance[column], self.unit[column], self.instance[column]) = (shown.distance, shown.unit, shown.instance);
    }

    /// Instances and ranges of a row.
    #[inline(always)]
    pub fn show(&self, row: Row, instance: &mut [u16], range: &mut [f32]) {
        let count = range.len();
        instance.copy_from_slice(&self.instance[..count]);
        let (distance, unit) = (&self.distance[..count], &self.unit[..count]);
        for k in 0..count {
            let of_level = if unit[k] == Unit::Plane { row.plane } else { row.inverse_tan };
            let distance = distance[k] * if unit[k] == Unit::Metre { 1.0 } else { of_level };
            range[k] = if distance < FAR { distance * row.stretch } else { 0.0 };
        }
    }
}
