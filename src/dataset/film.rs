//! Films: panoramas along a way, and contact sheets of a world.

use std::path::Path;

use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2};
use crate::random::Seed;
use crate::storage::io_error;
use crate::table::{Row, Rows};
use crate::world::World;

/// A robot's pose at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Time, s.
    pub time_s: f64,
    /// Pose of the robot.
    pub robot: Pose,
}

/// A point of a way as a table tells it.
pub(super) struct Point {
    /// Position in the room, m.
    pub at: Vector2<f64>,
    /// Heading, rad, where the table has one.
    pub heading: Option<f64>,
    time_s: Option<f64>,
}

/// Reads the points of a table with a header: `x_m`, `y_m`, and perhaps `heading_rad` or `heading_deg`, and `t_s`; in SI units also
/// `x`, `y`, `heading` and `t`. Further columns are left alone. `needed` are those that must be there beside x and y.
///
/// # Errors
/// When the file cannot be read, a column is missing, a number is missing or not finite, or there is no row.
pub(super) fn points(path: &Path, needed: &[&[&str]]) -> Result<Vec<Point>> {
    let table = Rows::parse(&std::fs::read(path).map_err(io_error("read", path))?, path, "point")?;
    let (x, y) = (table.needed(&["x_m", "x"])?, table.needed(&["y_m", "y"])?);
    needed.iter().try_for_each(|names| table.needed(names).map(|_| ()))?;
    let (time, radians) = (table.column(TIME), table.column(&["heading_rad", "heading"]));
    let heading = radians.map(|k| (k, 1.0)).or(table.column(&["heading_deg"]).map(|k| (k, 1_f64.to_radians())));
    let point = |row: Row<'_>| {
        Ok(Point {
            at: Vector2::new(row.number(x)?, row.number(y)?),
            heading: heading.map(|(k, to_rad)| Ok::<_, Error>(row.number(k)? * to_rad)).transpose()?,
            time_s: time.map(|k| row.number(k)).transpose()?,
        })
    };
    table.rows().map(point).collect()
}

/// Columns of time and of heading.
const TIME: &[&str] = &["t_s", "t"];
const HEADING: &[&str] = &["heading_rad", "heading_deg", "heading"];

/// Reads a way from a table with time, x, y and heading, as `t_s,x_m,y_m,heading_rad`, `t_s,x_m,y_m,heading_deg` or, in SI units,
/// `t,x,y,heading`. Further columns are left alone, so that the `trajectory.csv` of a run is such a table.
///
/// # Errors
/// When the file cannot be read, a column is missing, a number is missing or not finite, or there is no row.
pub fn load(path: &Path) -> Result<Vec<Frame>> {
    let frame = |p: Point| Some(Frame { time_s: p.time_s?, robot: Pose::new(p.at.x, p.at.y, p.heading?) });
    Ok(points(path, &[TIME, HEADING])?.into_iter().filter_map(frame).collect())
}

/// Poses that show a world: home, and places from which a run may start, drawn by `seed`.
///
/// # Errors
/// When the world's start region leaves no place.
pub fn poses(world: &World, count: usize, seed: Seed) -> Result<Vec<Pose>> {
    let mut stream = seed.stream("sheet");
    let mut poses = vec![world.home];
    while poses.len() < count {
        poses.push(world.random_start(&mut stream)?);
    }
    poses.truncate(count);
    Ok(poses)
}

/// Some of the frames, evenly from the first to the last.
pub fn pick(frames: &[Frame], count: usize) -> Vec<Frame> {
    let count = count.min(frames.len());
    let last = (frames.len() - usize::from(!frames.is_empty())) as f64;
    let share = |k: usize| if count > 1 { k as f64 / (count - 1) as f64 } else { 0.0 };
    (0..count).map(|k| frames[(share(k) * last).round() as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Frame>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("way.csv");
        std::fs::write(&path, text).unwrap();
        load(&path)
    }

    #[test]
    fn ways_are_read_and_faults_named() {
        let frames = read("t_s,x_m,y_m,heading_rad,v_cmd\n0,1,2,0.5,9\n0.1, 1.5,2,-1,\n").unwrap();
        assert_eq!(frames[1], Frame { time_s: 0.1, robot: Pose::new(1.5, 2.0, -1.0) });
        assert_eq!(read("t,x,y,heading\n0,1,2,3\n").unwrap()[0].robot.heading, 3.0);
        let degrees = read("t_s,x_m,y_m,heading_deg\n0,1,2,180\n").unwrap()[0].robot.heading;
        assert!((degrees - std::f64::consts::PI).abs() < 1e-12);
        for (bad, words) in [
            ("x,y\n1,2\n", "found `x,y`"),
            ("t,x,y,heading\n", "no row"),
            ("t,x,y,heading\n0,1,2,3\n1,2,NaN,0\n", "line 3, y: found `NaN`"),
            ("t,x,y,heading\n0,1\n", "line 2, y: found ``"),
            ("", "found ``"),
        ] {
            let message = read(bad).unwrap_err().to_string();
            assert!(message.contains(words), "{bad:?}: {message}");
        }
        assert!(load(Path::new("/nonexistent/way.csv")).is_err());
    }

    #[test]
    fn frames_are_picked_from_end_to_end() {
        let frames: Vec<Frame> = (0..10).map(|k| Frame { time_s: f64::from(k), robot: Pose::IDENTITY }).collect();
        let times = |count| pick(&frames, count).iter().map(|f| f.time_s).collect::<Vec<_>>();
        assert_eq!(times(4), [0.0, 3.0, 6.0, 9.0]);
        assert_eq!(times(1), [0.0]);
        assert_eq!(times(99).len(), 10);
        assert!(pick(&[], 3).is_empty());
    }
}
