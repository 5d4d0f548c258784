//! What the columns show in the row at work, and the row's ranges and instances that follow. Both renderers end with this.

use super::frame::{FAR, Row};

/// What a column shows, from some row on.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shown {
    /// Horizontal distance is this, ...
    pub near: f32,
    /// ... and this times the inverse tangent of the row, ...
    pub height: f32,
    /// ... and this times the distance of floor or ceiling.
    pub room: f32,
    /// Instance id.
    pub instance: u16,
}

/// What some columns show.
#[derive(Debug, Default)]
pub(super) struct Now {
    near: Vec<f32>,
    height: Vec<f32>,
    room: Vec<f32>,
    instance: Vec<u16>,
}

impl Now {
    /// Makes room for so many columns.
    pub fn resize(&mut self, columns: usize) {
        for values in [&mut self.near, &mut self.height, &mut self.room] {
            values.resize(columns, 0.0);
        }
        self.instance.resize(columns, 0);
    }

    /// Notes what a column shows.
    #[inline(always)]
    pub fn set(&mut self, column: usize, shown: Shown) {
        (self.near[column], self.height[column], self.room[column]) = (shown.near, shown.height, shown.room);
        self.instance[column] = shown.instance;
    }

    /// Instances and ranges of a row.
    #[inline(always)]
    pub fn show(&self, row: Row, instance: &mut [u16], range: &mut [f32]) {
        let count = range.len();
        instance.copy_from_slice(&self.instance[..count]);
        let (near, height, room) = (&self.near[..count], &self.height[..count], &self.room[..count]);
        for k in 0..count {
            let distance = near[k] + height[k] * row.inverse_tan + room[k] * row.plane;
            range[k] = if distance < FAR { distance * row.stretch } else { 0.0 };
        }
    }
}
