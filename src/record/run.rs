//! The files of one run.

use std::path::Path;

use super::path_plot::path_svg;
use super::tum;
use crate::draw::image::colours_png;
use crate::episode::{Belief, Record, Recorder, Step, Summary};
use crate::error::Result;
use crate::observation::Estimate;
use crate::storage::csv::{self, Columns, number};
use crate::storage::{OutputFolder, json};
use crate::world::World;

/// Columns of `trajectory.csv`, of a step and of what its method believes to be about.
const COLUMNS: &Columns<(Step, Option<Belief>)> = &[
    ("t_s", |(s, _)| number(s.time_s)),
    ("x_m", |(s, _)| number(s.truth.x)),
    ("y_m", |(s, _)| number(s.truth.y)),
    ("heading_rad", |(s, _)| number(s.truth.heading)),
    ("v_cmd", |(s, _)| number(s.command.v)),
    ("omega_cmd", |(s, _)| number(s.command.omega)),
    ("v_odom", |(s, _)| number(s.odometry.v)),
    ("omega_odom", |(s, _)| number(s.odometry.omega)),
    ("slip_left", |(s, _)| number(s.slip_m_s[0])),
    ("slip_right", |(s, _)| number(s.slip_m_s[1])),
    ("range_est_m", |(s, _)| number(s.estimate.as_ref().map(Estimate::range_m))),
    ("bearing_est_rad", |(s, _)| number(s.estimate.as_ref().map(Estimate::bearing_rad))),
    ("heading_est_rad", |(s, _)| number(s.estimate.as_ref().map(|e| e.pose.heading))),
    ("range_sd_m", |(s, _)| number(s.estimate.as_ref().map(Estimate::range_sd_m))),
    ("bearing_sd_rad", |(s, _)| number(s.estimate.as_ref().map(Estimate::bearing_sd_rad))),
    ("heading_sd_rad", |(s, _)| number(s.estimate.as_ref().map(Estimate::heading_sd_rad))),
    ("matched", |(s, _)| number(s.seen.map(|_| s.matched as f64))),
    ("rejected", |(s, _)| number(s.seen.map(|_| s.rejected as f64))),
    ("nis", |(s, _)| number(s.nis)),
    ("belief", |(_, belief)| belief.map_or_else(String::new, |belief| belief.name().to_owned())),
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
        Ok(Self { world, folder: Some(OutputFolder::open(path, verb)?) })
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

/// One row a control step, empty cells where there is no number.
pub fn trajectory_csv(steps: &[Step]) -> String {
    let rows = steps.iter().copied().zip(Belief::of_steps(steps)).map(|of| csv::row(COLUMNS, &of));
    std::iter::once(csv::header(COLUMNS)).chain(rows).collect()
}
