//! OpenCV's detectors on the same pairs, as `tests/outside/opencv_features.py` writes them.

use serde::Deserialize;

use super::VisionStudy;
use super::condition::Factor;
use crate::draw::chart::{Axis, Chart, Mark, Stroke};
use crate::draw::markdown::table;
use crate::error::Result;
use crate::storage::OutputFolder;
use crate::verify::outside;

/// Name of the table.
pub(super) const FILE: &str = "opencv.csv";

/// A method at a distance in a world.
#[derive(Debug, Deserialize)]
struct Detection {
    world: String,
    distance_m: f64,
    method: String,
    keypoints: f64,
    matches: f64,
    right: f64,
    extract_ms: f64,
    match_ms: f64,
}

/// All of them, in the order of the table.
pub(super) struct Detections(Vec<Detection>);

impl Detections {
    /// The table that may lie in the page's folder.
    ///
    /// # Errors
    /// When it is not what the script writes, or cannot be written again.
    pub fn keep(folder: &mut OutputFolder) -> Result<Option<Self>> {
        Ok(outside::keep(folder, FILE, "tests/outside/opencv_features.py")?.map(Self))
    }

    /// The methods in the order of the table, each once.
    fn methods(&self) -> Vec<&str> {
        let mut methods: Vec<&str> = Vec::new();
        for detection in &self.0 {
            if !methods.contains(&detection.method.as_str()) {
                methods.push(&detection.method);
            }
        }
        methods
    }

    /// Those of a method in a world, by distance.
    fn of<'a>(&'a self, world: &'a str, method: &'a str) -> impl Iterator<Item = &'a Detection> {
        self.0.iter().filter(move |d| d.world == world && d.method == method)
    }

    /// Right matches over distance in the first world.
    pub fn chart(&self) -> Chart {
        let world = self.0.first().map_or("", |d| d.world.as_str());
        let mut chart = Chart::new(
            format!("Right matches in {world}, by method"),
            Axis::linear("distance from home (m)"),
            Axis::log("right matches a panorama"),
        );
        for (k, method) in self.methods().into_iter().enumerate() {
            let points: Vec<[f64; 2]> = self.of(world, method).map(|d| [d.distance_m, d.right]).collect();
            // Six colours; what comes after them is dashed.
            let stroke = if k < 6 { Stroke::series(k) } else { Stroke::series(k).dashed("6 4") };
            chart = chart.line(points.iter().copied(), &stroke, method).points(points, &Mark::series(k), "");
        }
        chart
    }

    /// The table as Markdown: right matches and precision by distance, and time.
    pub fn section(&self, study: &VisionStudy) -> String {
        let distances = Factor::Distance.levels();
        let by_distance: String = distances.iter().map(|d| format!("{d} m | ")).collect();
        let columns = format!("world | method | keypoints | {by_distance}extract + match (ms)");
        let mut rows = Vec::new();
        for (world, _) in &study.worlds {
            for method in self.methods() {
                let found: Vec<&Detection> = self.of(world, method).collect();
                let Some(first) = found.first() else { continue };
                let mut row = vec![world.clone(), method.to_owned(), format!("{:.0}", first.keypoints)];
                row.extend(distances.iter().map(|distance| {
                    let at = found.iter().find(|d| d.distance_m == *distance);
                    let cell = at.map(|d| format!("{:.0} ({:.0} %)", d.right, 100.0 * d.right / d.matches.max(1e-9)));
                    cell.unwrap_or_default()
                }));
                let mean = |value: fn(&Detection) -> f64| found.iter().map(|d| value(d)).sum::<f64>() / found.len() as f64;
                row.push(format!("{:.1} + {:.1}", mean(|d| d.extract_ms), mean(|d| d.match_ms)));
                rows.push(row);
            }
        }
        format!(include_str!("opencv.md"), table = table(&columns, rows))
    }
}
