//! The files of one open-loop drive.

use super::{OutputFolder, json};
use crate::episode::open_loop::{DriveRecord, DriveStep, DriveSummary};
use crate::error::Result;
use crate::world::World;

/// Names of all files of a drive.
pub const FILES: &[&str] = &["summary.json", "drive.csv", "path.svg"];

/// Columns of `drive.csv`. Slip, forces and loads are means over the interval that ends at the row's time, in the robot's frame;
/// everything else is as of that time.
const COLUMNS: [&str; 33] = [
    "t_s",
    "v_cmd_m_s",
    "omega_cmd_rad_s",
    "x_m",
    "y_m",
    "heading_rad",
    "v_forward_m_s",
    "v_leftward_m_s",
    "yaw_rate_rad_s",
    "x_odom_m",
    "y_odom_m",
    "heading_odom_rad",
    "v_odom_m_s",
    "omega_odom_rad_s",
    "wheel_left_rad_s",
    "wheel_right_rad_s",
    "slip_left_forward_m_s",
    "slip_left_leftward_m_s",
    "slip_right_forward_m_s",
    "slip_right_leftward_m_s",
    "force_left_forward_n",
    "force_left_leftward_n",
    "force_right_forward_n",
    "force_right_leftward_n",
    "force_caster_forward_n",
    "force_caster_leftward_n",
    "load_left_n",
    "load_right_n",
    "load_caster_n",
    "collisions",
    "odometry_error_x_m",
    "odometry_error_y_m",
    "odometry_error_m",
];

/// Writes all files of a drive.
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, world: &World, record: &DriveRecord, summary: &DriveSummary) -> Result<()> {
    folder.write("drive.csv", drive_csv(&record.steps).as_bytes())?;
    folder.write("path.svg", path_svg(world, record).as_bytes())?;
    // Last, so that a folder with a summary is complete.
    folder.write("summary.json", json(summary).as_bytes())?;
    folder.finish()
}

/// One row a state. Numbers have as many digits as it takes to read them back without loss.
#[must_use]
pub fn drive_csv(steps: &[DriveStep]) -> String {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    for step in steps {
        text.push_str(&row(step).map(|value| value.to_string()).join(","));
        text.push('\n');
    }
    text
}

/// The numbers of one state in the order of [`COLUMNS`].
fn row(step: &DriveStep) -> [f64; 33] {
    let s = step;
    let [slip_left, slip_right] = s.floor.slip_m_s;
    let [left, right, caster] = s.floor.force_n;
    let error = s.dead_reckoned.position() - s.truth.position();
    [
        s.time_s,
        s.command.v,
        s.command.omega,
        s.truth.x,
        s.truth.y,
        s.truth.heading,
        s.velocity_m_s.x,
        s.velocity_m_s.y,
        s.yaw_rate_rad_s,
        s.dead_reckoned.x,
        s.dead_reckoned.y,
        s.dead_reckoned.heading,
        s.odometry.v,
        s.odometry.omega,
        s.wheel_speeds_rad_s[0],
        s.wheel_speeds_rad_s[1],
        slip_left.x,
        slip_left.y,
        slip_right.x,
        slip_right.y,
        left.x,
        left.y,
        right.x,
        right.y,
        caster.x,
        caster.y,
        s.floor.load_n[0],
        s.floor.load_n[1],
        s.floor.load_n[2],
        f64::from(s.collisions),
        error.x,
        error.y,
        error.norm(),
    ]
}

/// True path beside odometry path.
fn path_svg(world: &World, record: &DriveRecord) -> String {
    use super::map::{MapDrawing, PathStyle};
    MapDrawing::new(world)
        .title(format!("Open-loop drive in {}", world.spec.name))
        .path(record.steps.iter().map(|s| s.truth.position()), &PathStyle::TRUTH, "true path")
        .path(record.steps.iter().map(|s| s.dead_reckoned.position()), &PathStyle::ODOMETRY, "path by odometry")
        .start(&record.steps[0].truth)
        .end(&record.last().truth)
        .to_svg()
}
