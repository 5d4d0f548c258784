//! Films: panoramas along a way, and contact sheets of a world.

use std::path::Path;

use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::random::Seed;
use crate::world::World;

/// A robot's pose at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Time, s.
    pub time_s: f64,
    /// Pose of the robot.
    pub robot: Pose,
}

/// Reads a way from a table with a header: time, x, y and heading, in this order, as `t_s,x_m,y_m,heading_rad`,
/// `t_s,x_m,y_m,heading_deg` or, in SI units, `t,x,y,heading`. Further columns are left alone, so that the `trajectory.csv` of a
/// run is such a table.
///
/// # Errors
/// When the file cannot be read, the header is another one, a number is missing or not finite, or there is no row.
pub fn load(path: &Path) -> Result<Vec<Frame>> {
    let text = std::fs::read(path).map_err(|source| Error::Io { action: "read", path: path.to_owned(), source })?;
    let fault = |message: String| Error::Parse { path: path.to_owned(), message };
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text.as_slice());
    let header: Vec<String> = table.headers().map_err(|e| fault(e.to_string()))?.iter().take(4).map(str::to_owned).collect();
    let to_rad = match header.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["t_s", "x_m", "y_m", "heading_rad"] | ["t", "x", "y", "heading"] => 1.0,
        ["t_s", "x_m", "y_m", "heading_deg"] => 1.0_f64.to_radians(),
        _ => {
            let found = header.join(",");
            return Err(fault(format!("line 1: found `{found}`, expected a header that begins with t_s,x_m,y_m,heading_rad")));
        }
    };
    let mut frames = Vec::new();
    for row in table.records() {
        let row = row.map_err(|e| fault(e.to_string()))?;
        let line = row.position().map_or(0, csv::Position::line);
        let number = |k: usize| {
            let cell = row.get(k).unwrap_or_default();
            let found = cell.parse().ok().filter(|x: &f64| x.is_finite());
            found.ok_or_else(|| fault(format!("line {line}, {}: found `{cell}`, expected a finite number", header[k])))
        };
        let robot = Pose::new(number(1)?, number(2)?, number(3)? * to_rad);
        frames.push(Frame { time_s: number(0)?, robot });
    }
    if frames.is_empty() {
        return Err(fault("found no row, expected one for each frame".to_owned()));
    }
    Ok(frames)
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
#[must_use]
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
