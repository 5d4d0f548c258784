//! The files of one run.

use std::path::Path;

use super::path_plot::path_svg;
use super::tum;
use crate::draw::image::colours_png;
use crate::episode::{Belief, Record, Recorder, Step, Summary};
use crate::error::Result;
use crate::storage::{OutputFolder, json};
use crate::world::World;

/// Names of all files of a run; those of panoramas are there when the sensor has a camera, that of estimates when the method has any.
const FILES: &[&str] = &[
    "summary.json",
    "trajectory.csv",
    "trajectory.tum",
    "odometry.tum",
    "estimate.tum",
    "path.svg",
    "home.png",
    "panorama_start.png",
    "panorama_end.png",
];

/// Columns of `trajectory.csv`.
const COLUMNS: [&str; 20] = [
    "t_s",
    "x_m",
    "y_m",
    "heading_rad",
    "v_cmd",
    "omega_cmd",
    "v_odom",
    "omega_odom",
    "slip_left",
    "slip_right",
    "range_est_m",
    "bearing_est_rad",
    "heading_est_rad",
    "range_sd_m",
    "bearing_sd_rad",
    "heading_sd_rad",
    "matched",
    "rejected",
    "nis",
    "belief",
];

/// Writes all files of a run into a folder when it has ended.
pub struct RunFiles<'a> {
    world: &'a World,
    folder: Option<OutputFolder>,
}

impl<'a> RunFiles<'a> {
    /// Opens the folder `path` for the files of a run in `world`; `verb` is what writes it.
    ///
    /// # Errors
    /// As [`OutputFolder::open`].
    pub fn open(path: &Path, verb: &str, world: &'a World) -> Result<Self> {
        Ok(Self { world, folder: Some(OutputFolder::open(path, verb, FILES)?) })
    }
}

impl Recorder for RunFiles<'_> {
    fn finish(&mut self, record: &Record, summary: &Summary) -> Result<()> {
        self.folder.take().map_or(Ok(()), |folder| write(folder, self.world, record, summary))
    }
}

fn write(mut folder: OutputFolder, world: &World, record: &Record, summary: &Summary) -> Result<()> {
    let pictures = &record.pictures;
    for (name, picture) in
        [("home.png", &pictures.home), ("panorama_start.png", &pictures.start), ("panorama_end.png", &pictures.end)]
    {
        if let Some(picture) = picture {
            folder.write(name, &colours_png(picture, name)?)?;
        }
    }
    folder.write("trajectory.csv", trajectory_csv(&record.steps).as_bytes())?;
    for (name, text) in tum::trajectories(record) {
        folder.write(name, text.as_bytes())?;
    }
    folder.write("path.svg", path_svg(world, record).as_bytes())?;
    // Last, so that a folder with a summary is complete.
    folder.write("summary.json", json(summary).as_bytes())?;
    folder.finish()
}

/// One row a control step, empty cells where there is no number. Numbers have as many digits as it takes to read them back
/// without loss.
#[must_use]
pub fn trajectory_csv(steps: &[Step]) -> String {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    for (step, belief) in steps.iter().zip(Belief::of_steps(steps)) {
        let cells = row(step).map(|value| value.filter(|v| v.is_finite()).map_or_else(String::new, |v| v.to_string()));
        text.push_str(&cells.join(","));
        text.push(',');
        text.push_str(belief.map_or("", Belief::name));
        text.push('\n');
    }
    text
}

/// The numbers of one step in the order of [`COLUMNS`], all but the last.
fn row(step: &Step) -> [Option<f64>; 19] {
    let estimate = step.estimate.as_ref();
    let observed = |count: usize| step.seen.map(|_| count as f64);
    [
        Some(step.time_s),
        Some(step.truth.x),
        Some(step.truth.y),
        Some(step.truth.heading),
        Some(step.command.v),
        Some(step.command.omega),
        Some(step.odometry.v),
        Some(step.odometry.omega),
        Some(step.slip_m_s[0]),
        Some(step.slip_m_s[1]),
        estimate.map(|e| e.range_m()),
        estimate.map(|e| e.bearing_rad()),
        estimate.map(|e| e.pose.heading),
        estimate.map(|e| e.range_sd_m()),
        estimate.map(|e| e.bearing_sd_rad()),
        estimate.map(|e| e.heading_sd_rad()),
        observed(step.matched),
        observed(step.rejected),
        Some(step.nis),
    ]
}
