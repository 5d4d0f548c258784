//! OpenCV's detectors on the same pairs, as `tests/outside/opencv_features.py` writes them.

use std::fmt::Write;

use crate::draw::chart::{Axis as ChartAxis, Chart, Mark, Stroke};
use crate::error::{Error, Result};
use crate::verify::vision::VisionStudy;
use crate::verify::vision::conditions::Axis;

/// Name of the table, which the page keeps as it is.
pub const FILE: &str = "opencv.csv";

/// First line of the table.
const HEADER: &str = "world,distance_m,method,keypoints,panoramas,matches,right,extract_ms,match_ms";

/// A method at a distance in a world.
struct Row {
    world: String,
    distance_m: f64,
    method: String,
    keypoints: f64,
    matches: f64,
    right: f64,
    extract_ms: f64,
    match_ms: f64,
}

/// The table.
pub(super) struct Outside {
    rows: Vec<Row>,
}

impl Outside {
    /// Reads the table.
    ///
    /// # Errors
    /// When it is not what the script writes; the message names the line.
    pub fn parse(text: &str) -> Result<Self> {
        let fault = |line: usize, expected: &str| Error::Parse {
            path: FILE.into(),
            message: format!("line {line}: expected {expected}, as tests/outside/opencv_features.py writes it"),
        };
        let mut lines = text.lines().zip(1..);
        if lines.next().is_none_or(|(line, _)| line != HEADER) {
            return Err(fault(1, HEADER));
        }
        let rows = lines.map(|(line, number)| {
            let cells: Vec<&str> = line.split(',').collect();
            let value = |k: usize| cells.get(k).and_then(|c| c.parse::<f64>().ok()).filter(|v| v.is_finite());
            let row = || {
                Some(Row {
                    world: cells[0].to_owned(),
                    distance_m: value(1)?,
                    method: cells.get(2)?.to_string(),
                    keypoints: value(3)?,
                    matches: value(5)?,
                    right: value(6)?,
                    extract_ms: value(7)?,
                    match_ms: value(8)?,
                })
            };
            row().ok_or_else(|| fault(number, "a world, a distance, a method and six numbers"))
        });
        Ok(Self { rows: rows.collect::<Result<_>>()? })
    }

    /// The methods in the order of the table, each once.
    fn methods(&self) -> Vec<&str> {
        let mut methods: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !methods.contains(&row.method.as_str()) {
                methods.push(&row.method);
            }
        }
        methods
    }

    /// Right matches over distance in the first world.
    pub fn chart(&self) -> Chart {
        let world = self.rows.first().map_or("", |r| r.world.as_str());
        let mut chart = Chart::new(
            format!("Right matches in {world}, by method"),
            ChartAxis::linear("distance from home (m)"),
            ChartAxis::log("right matches a panorama"),
        );
        for (k, method) in self.methods().into_iter().enumerate() {
            let rows = self.rows.iter().filter(|r| r.method == method && r.world == world);
            let points: Vec<[f64; 2]> = rows.map(|r| [r.distance_m, r.right]).collect();
            // Six colours; what comes after them is dashed.
            let stroke = if k < 6 { Stroke::series(k) } else { Stroke::series(k).dashed("6 4") };
            chart = chart.line(points.iter().copied(), &stroke, method).points(points, &Mark::series(k), "");
        }
        chart
    }

    /// The table as Markdown: right matches and precision by distance, and time.
    pub fn section(&self, study: &VisionStudy) -> String {
        let mut text = "## Beside OpenCV\n\n![Right matches by method](opencv.svg)\n\nThe same pairs through OpenCV's detectors \
                        ([`opencv.csv`](opencv.csv), made by `tests/outside/opencv_features.py` with `opencv-python-headless`), scored by the same \
                        rule: ratio test at 0.8, mutual nearest neighbours, the strip padded cyclically, one thread. OpenCV has no geometric \
                        check here; wayhome's is part of it. Cells are right matches a panorama and, in brackets, precision. Times are those \
                        of one machine under load, medians: processor time for OpenCV, the clock for wayhome, which has its matching \
                        in the first number.\n\n"
            .to_owned();
        let distances: Vec<f64> = Axis::Distance.levels().to_vec();
        let _ = write!(text, "| world | method | keypoints |");
        for d in &distances {
            let _ = write!(text, " {d} m |");
        }
        let _ = writeln!(text, " extract + match (ms) |\n|{}", "---|".repeat(4 + distances.len()));
        for (world, _) in &study.worlds {
            for method in self.methods() {
                let rows: Vec<&Row> = self.rows.iter().filter(|r| r.world == *world && r.method == method).collect();
                let Some(first) = rows.first() else { continue };
                let _ = write!(text, "| {world} | {method} | {:.0} |", first.keypoints);
                for d in &distances {
                    let cell = rows.iter().find(|r| r.distance_m == *d).map_or_else(String::new, |r| {
                        format!("{:.0} ({:.0} %)", r.right, 100.0 * r.right / r.matches.max(1e-9))
                    });
                    let _ = write!(text, " {cell} |");
                }
                let mean = |value: fn(&Row) -> f64| rows.iter().map(|r| value(r)).sum::<f64>() / rows.len() as f64;
                let _ = writeln!(text, " {:.1} + {:.1} |", mean(|r| r.extract_ms), mean(|r| r.match_ms));
            }
        }
        text + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_read_and_a_bad_one_refused() {
        let good = format!("{HEADER}\nlab,0.5,ORB,500,12,200,180,9.5,4\nlab,1,ORB,500,12,100,80,9.5,4\n");
        assert_eq!(Outside::parse(&good).map(|t| t.methods().len()).unwrap(), 1);
        for bad in [String::new(), "world\n".into(), format!("{HEADER}\nlab,0.5,ORB,500,12,x,180,9.5,4\n")] {
            assert!(Outside::parse(&bad).is_err(), "{bad}");
        }
    }
}
