//! The files of one open-loop drive.

use crate::draw::map::{MapDrawing, Stroke};
use crate::episode::open_loop::{DriveStep, DriveSummary};
use crate::error::Result;
use crate::geometry::{Pose, Vector2};
use crate::physics::Collision;
use crate::storage::csv::{self, Columns, number};
use crate::storage::{FolderFile, OutputFolder, json};
use crate::world::World;

/// Columns of `drive.csv`. Slip, forces and loads are means over the interval that ends at the row's time, in the robot's frame;
/// everything else is as of that time.
const COLUMNS: &Columns<DriveStep> = &[
    ("t_s", |s| number(s.time_s)),
    ("v_cmd_m_s", |s| number(s.command.v)),
    ("omega_cmd_rad_s", |s| number(s.command.omega)),
    ("x_m", |s| number(s.truth.x)),
    ("y_m", |s| number(s.truth.y)),
    ("heading_rad", |s| number(s.truth.heading)),
    ("v_forward_m_s", |s| number(s.wheels.velocity_m_s.x)),
    ("v_leftward_m_s", |s| number(s.wheels.velocity_m_s.y)),
    ("yaw_rate_rad_s", |s| number(s.wheels.yaw_rate_rad_s)),
    ("x_odom_m", |s| number(s.dead_reckoned.x)),
    ("y_odom_m", |s| number(s.dead_reckoned.y)),
    ("heading_odom_rad", |s| number(s.dead_reckoned.heading)),
    ("v_odom_m_s", |s| number(s.odometry.v)),
    ("omega_odom_rad_s", |s| number(s.odometry.omega)),
    ("wheel_left_rad_s", |s| number(s.wheels.wheel_speeds_rad_s[0])),
    ("wheel_right_rad_s", |s| number(s.wheels.wheel_speeds_rad_s[1])),
    ("slip_left_forward_m_s", |s| number(s.wheels.floor.slip_m_s[0].x)),
    ("slip_left_leftward_m_s", |s| number(s.wheels.floor.slip_m_s[0].y)),
    ("slip_right_forward_m_s", |s| number(s.wheels.floor.slip_m_s[1].x)),
    ("slip_right_leftward_m_s", |s| number(s.wheels.floor.slip_m_s[1].y)),
    ("force_left_forward_n", |s| number(s.wheels.floor.force_n[0].x)),
    ("force_left_leftward_n", |s| number(s.wheels.floor.force_n[0].y)),
    ("force_right_forward_n", |s| number(s.wheels.floor.force_n[1].x)),
    ("force_right_leftward_n", |s| number(s.wheels.floor.force_n[1].y)),
    ("force_caster_forward_n", |s| number(s.wheels.floor.force_n[2].x)),
    ("force_caster_leftward_n", |s| number(s.wheels.floor.force_n[2].y)),
    ("load_left_n", |s| number(s.wheels.floor.load_n[0])),
    ("load_right_n", |s| number(s.wheels.floor.load_n[1])),
    ("load_caster_n", |s| number(s.wheels.floor.load_n[2])),
    ("collisions", |s| number(f64::from(s.collisions))),
    ("odometry_error_x_m", |s| number(error(s).x)),
    ("odometry_error_y_m", |s| number(error(s).y)),
    ("odometry_error_m", |s| number(error(s).norm())),
];

/// How far odometry is off.
fn error(step: &DriveStep) -> Vector2<f64> {
    step.dead_reckoned.position() - step.truth.position()
}

/// The files of a drive under way: rows go to disk as they come, and of the paths only what a drawing can show is kept.
pub struct DriveFiles<'a> {
    folder: OutputFolder,
    world: &'a World,
    rows: FolderFile,
    collisions: FolderFile,
    truth: Trail,
    odometry: Trail,
    /// Poses at the start and now.
    ends: Option<(Pose, Pose)>,
}

impl<'a> DriveFiles<'a> {
    /// Begins the files in `folder`.
    ///
    /// # Errors
    /// When a file cannot be created.
    pub fn begin(mut folder: OutputFolder, world: &'a World) -> Result<Self> {
        let mut rows = folder.begin("drive.csv")?;
        rows.append(&csv::header(COLUMNS))?;
        let mut collisions = folder.begin("collisions.csv")?;
        collisions.append("t_s,with,impulse_n_s\n")?;
        Ok(Self { folder, world, rows, collisions, truth: Trail::default(), odometry: Trail::default(), ends: None })
    }

    /// Adds a state and the collisions that led to it. Numbers have as many digits as it takes to read them back without loss.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn add(&mut self, step: &DriveStep, collisions: &[Collision]) -> Result<()> {
        self.rows.append(&csv::row(COLUMNS, step))?;
        for hit in collisions {
            let with = hit.with.name(self.world).replace(['"', ',', '\n', '\r'], " ");
            self.collisions.append(&format!("{},{with},{}\n", hit.time_s, hit.impulse_n_s))?;
        }
        self.truth.add(step.truth.position());
        self.odometry.add(step.dead_reckoned.position());
        self.ends = Some((self.ends.map_or(step.truth, |(start, _)| start), step.truth));
        Ok(())
    }

    /// Puts all files in their places, with the drawing and the summary.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn finish(mut self, summary: &DriveSummary) -> Result<()> {
        self.folder.complete(self.rows)?;
        self.folder.complete(self.collisions)?;
        let drawing = MapDrawing::new(self.world)
            .title(format!("Open-loop drive in {}", self.world.spec.name))
            .path(self.truth.points(), &Stroke::TRUTH, "true path")
            .path(self.odometry.points(), &Stroke::ODOMETRY, "path by odometry");
        let drawing = match self.ends {
            Some((start, end)) => drawing.start(&start).end(&end),
            None => drawing,
        };
        self.folder.write("path.svg", drawing.to_svg().as_bytes())?;
        // Last, so that a folder with a summary is complete.
        self.folder.write("summary.json", json(summary).as_bytes())?;
        self.folder.finish()
    }
}

/// A path of any length, thinned out evenly to what a drawing can show.
#[derive(Debug, Clone)]
struct Trail {
    kept: Vec<Vector2<f64>>,
    /// Every how manyth point is kept.
    every: u64,
    /// Points so far, and the last of them.
    count: u64,
    last: Option<Vector2<f64>>,
}

impl Default for Trail {
    fn default() -> Self {
        Self { kept: Vec::new(), every: 1, count: 0, last: None }
    }
}

impl Trail {
    /// Points kept at most.
    const MOST: usize = 8192;

    fn add(&mut self, point: Vector2<f64>) {
        if self.count.is_multiple_of(self.every) {
            if self.kept.len() == Self::MOST {
                let mut index = 0;
                self.kept.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.every *= 2;
            }
            self.kept.push(point);
        }
        self.count += 1;
        self.last = Some(point);
    }

    /// The points kept, and the last one.
    fn points(&self) -> impl Iterator<Item = Vector2<f64>> + '_ {
        let end = self.last.filter(|last| self.kept.last() != Some(last));
        self.kept.iter().copied().chain(end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trail_of_any_length_keeps_its_ends_and_an_even_share() {
        let mut trail = Trail::default();
        for k in 0..100_001 {
            trail.add(Vector2::new(f64::from(k), 0.0));
        }
        let points: Vec<_> = trail.points().map(|p| p.x).collect();
        assert!(points.len() > Trail::MOST / 2 && points.len() <= Trail::MOST + 1, "{}", points.len());
        assert_eq!((points[0], points[points.len() - 1]), (0.0, 100_000.0));
        let steps: Vec<_> = points.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(steps[..steps.len() - 1].iter().all(|step| *step == steps[0]) && steps[0] == 16.0);
    }
}
