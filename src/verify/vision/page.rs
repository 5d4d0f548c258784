//! The page on the extractor: tables, charts, and the comparison with OpenCV.

use std::fmt::Write;

use strum::VariantArray;

use super::condition::Factor;
use super::opencv::{self, Detections};
use super::score::{RIGHT_PX, Spread};
use super::{LevelScore, VisionStudy};
use crate::draw::chart::{Axis, Chart, Mark, Stroke};
use crate::draw::markdown::table;
use crate::error::Result;
use crate::storage::OutputFolder;
use crate::storage::csv::{Columns, csv, number};

/// What others put into the folder.
pub const OUTSIDE: &[&str] = &[opencv::FILE];

/// Writes the page that `command` has made. What OpenCV makes of the same pairs is shown if its table lies in the folder.
///
/// # Errors
/// When a file cannot be written, or the table from outside is not what its script writes.
pub fn write(mut folder: OutputFolder, study: &VisionStudy, command: &str) -> Result<()> {
    let detections = Detections::keep(&mut folder)?;
    folder.write("vision.csv", csv(COLUMNS, &study.levels).as_bytes())?;
    let figures = figures(study);
    for figure in &figures {
        folder.write(&figure.file, figure.chart.to_svg().as_bytes())?;
    }
    if let Some(detections) = &detections {
        folder.write("opencv.svg", detections.chart().to_svg().as_bytes())?;
    }
    folder.write("README.md", page(study, command, &figures, detections.as_ref()).as_bytes())?;
    folder.finish()
}

/// Columns of `vision.csv`: a row a level, empty cells where there is no number.
const COLUMNS: &Columns<LevelScore> = &[
    ("world", |c| c.world.clone()),
    ("axis", |c| c.factor.name().to_owned()),
    ("level", |c| c.label.clone()),
    ("panoramas", |c| c.panoramas.to_string()),
    ("repeatability", |c| c.repeatability.to_string()),
    ("matches", |c| c.matches.to_string()),
    ("right", |c| c.right.to_string()),
    ("least_right", |c| c.least_right.to_string()),
    ("precision", |c| c.precision.to_string()),
    ("wrong", |c| c.wrong.to_string()),
    ("wrong_same_instance", |c| c.wrong_same_instance.to_string()),
    ("wrong_near", |c| c.wrong_near.to_string()),
    ("wrong_wild", |c| c.wrong_wild.to_string()),
    ("error_median_deg", |c| number(c.error_deg.map(|s| s.median))),
    ("error_q95_deg", |c| number(c.error_deg.map(|s| s.q95))),
    ("error_median_px", |c| number(c.error_px.map(|s| s.median))),
    ("error_q95_px", |c| number(c.error_px.map(|s| s.q95))),
    ("error_q68_sd", |c| number(c.error_sd.map(|s| s.q68))),
    ("error_q95_sd", |c| number(c.error_sd.map(|s| s.q95))),
    ("objects", |c| c.objects.to_string()),
    ("object_error_median_deg", |c| number(c.object_error_deg.map(|s| s.median))),
    ("object_error_q95_deg", |c| number(c.object_error_deg.map(|s| s.q95))),
    ("object_error_q68_sd", |c| number(c.object_error_sd.map(|s| s.q68))),
    ("object_error_q95_sd", |c| number(c.object_error_sd.map(|s| s.q95))),
];

fn of<'a>(study: &'a VisionStudy, world: &'a str, factor: Factor) -> impl Iterator<Item = &'a LevelScore> {
    study.levels.iter().filter(move |c| c.world == world && c.factor == factor)
}

/// How the page tells of a factor.
struct About {
    heading: &'static str,
    /// Axis of charts, with its unit.
    axis: Axis,
    /// What exactly is done.
    explanation: &'static str,
    /// What is said above the chart of its levels, which has a name on file; `None` where charts are others or there is none.
    chart: Option<&'static str>,
}

fn about(factor: Factor) -> About {
    let (heading, axis, chart, explanation) = match factor {
        Factor::Distance => (
            "Distance from home",
            Axis::linear("distance from home (m)"),
            None,
            "People who walk have walked on for 2 s between one panorama and the next.",
        ),
        Factor::Rotation => (
            "Rotation",
            Axis::linear("turn since home (degrees)"),
            Some("Turned"),
            "1 m from home, turned by this much since home, in degrees.",
        ),
        Factor::Gain => (
            "Brightness",
            Axis::log("factor on the grey levels"),
            Some("In brighter and darker light"),
            "1 m from home; all grey levels times this factor, clipped at white. The home panorama is as it was.",
        ),
        Factor::Gamma => (
            "Contrast",
            Axis::log("exponent on the grey levels"),
            Some("With another contrast"),
            "1 m from home; grey levels of 0 to 1 to this power. The home panorama is as it was.",
        ),
        Factor::Light => (
            "Light",
            Axis::linear("light"),
            None,
            "1 m from home, which was seen by day: the light presets of the worlds. Where a room has no windows, `glare` is `day`.",
        ),
        Factor::Noise => (
            "Image noise",
            Axis::linear("noise (sd, grey levels)"),
            Some("With image noise"),
            "1 m from home; normal noise of this standard deviation, in grey levels of 255, on each channel of each pixel, in the \
             home panorama too.",
        ),
        Factor::Camera => (
            "Camera",
            Axis::linear("camera"),
            None,
            "1 m from home, which was seen through the ideal camera: the camera presets, the robot at rest.",
        ),
        Factor::Occlusion => (
            "Occlusion",
            Axis::linear("share of the turn that is hidden (%)"),
            Some("Behind what was not there"),
            "1 m from home; upright things with a patchy dress, 9 to 26 degrees wide and as high as the picture, hide this share of \
             the turn.",
        ),
    };
    About { heading, axis, explanation, chart }
}

/// A level in the unit of the axis.
fn shown(factor: Factor, level: f64) -> f64 {
    if factor == Factor::Occlusion { 100.0 * level } else { level }
}

/// A level as a table shows it.
fn name(c: &LevelScore) -> String {
    if c.factor == Factor::Occlusion { shown(c.factor, c.level).to_string() } else { c.label.clone() }
}

/// A chart of one line a world.
fn chart(study: &VisionStudy, factor: Factor, title: &str, y: &str, value: impl Fn(&LevelScore) -> f64) -> Chart {
    let mut chart = Chart::new(title, about(factor).axis, Axis::linear(y).from(0.0));
    for (k, (world, _)) in study.worlds.iter().enumerate() {
        let points: Vec<[f64; 2]> = of(study, world, factor).map(|c| [shown(factor, c.level), value(c)]).collect();
        chart = chart.line(points.iter().copied(), &Stroke::series(k), world).points(points, &Mark::series(k), "");
    }
    chart
}

/// A chart of the page.
struct Figure {
    file: String,
    caption: &'static str,
    chart: Chart,
}

/// The charts of those factors that were measured.
fn figures(study: &VisionStudy) -> Vec<Figure> {
    let mut figures: Vec<Figure> = Vec::new();
    let mut add = |file: &str, caption, chart| figures.push(Figure { file: format!("{file}.svg"), caption, chart });
    for factor in measured(study) {
        if let Some(caption) = about(factor).chart {
            let title = format!("{caption}, 1 m from home");
            let drawing = chart(study, factor, &title, "right matches a panorama", |c| c.right);
            add(&format!("conditions-{}", factor.name()), caption, drawing);
        }
        if factor == Factor::Distance {
            let chart = |title: &str, y: &str, value: fn(&LevelScore) -> f64| chart(study, factor, title, y, value);
            let matches = chart("Home features found again", "right matches a panorama", |c| c.right);
            add("matches", "Right matches over distance", matches);
            let precision = chart("Matching precision", "right of all matches (%)", |c| 100.0 * c.precision)
                .line([[1.9, 90.0], [2.1, 90.0]], &Stroke::EXACT, "asked for at 2 m and 3 m")
                .line([[2.9, 80.0], [3.1, 80.0]], &Stroke::EXACT, "");
            add("precision", "Precision over distance", precision);
            let repeatability = chart("Repeatability", "visible home features found (%)", |c| 100.0 * c.repeatability);
            add("repeatability", "Repeatability over distance", repeatability);
            add("errors", "Bearing errors", errors(study));
        }
    }
    figures
}

fn measured(study: &VisionStudy) -> impl Iterator<Item = Factor> {
    Factor::VARIANTS.iter().copied().filter(|factor| study.levels.iter().any(|c| c.factor == *factor))
}

/// Share of the bearing errors below each size, a curve a distance; all worlds together.
fn errors(study: &VisionStudy) -> Chart {
    let x = Axis::log("bearing error (degrees)");
    let mut chart = Chart::new("Bearing errors of right matches", x, Axis::linear("smaller (%)").from(0.0));
    for (k, (distance_m, errors)) in study.errors_rad.iter().enumerate() {
        let mut sorted: Vec<f64> = errors.iter().map(|e| e.to_degrees()).collect();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len();
        let shares = (1..=100).map(|percent| [sorted.get(percent * count / 101).copied().unwrap_or(f64::NAN), percent as f64]);
        let points: Vec<[f64; 2]> = shares.filter(|p| p[0] > 1e-3).collect();
        chart = chart.line(points, &Stroke::series(k), &format!("{distance_m} m"));
    }
    chart.note(format!("all worlds; one pixel is {:.2} degrees", 360.0 / f64::from(study.size_px[0])))
}

/// The study for a terminal.
pub fn text(study: &VisionStudy) -> String {
    let mut text = format!(
        "{:10} {:9} {:>8} {:>5} {:>7} {:>7} {:>7} {:>7} {:>8} {:>8} {:>7} {:>7}\n",
        "world", "axis", "level", "shots", "repeat%", "matches", "right", "prec%", "med deg", "95% deg", "68% sd", "95% sd"
    );
    for c in &study.levels {
        let number = |value: Option<f64>, decimals: usize| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.decimals$}"));
        let _ = writeln!(
            text,
            "{:10} {:9} {:>8} {:>5} {:>7.1} {:>7.1} {:>7.1} {:>7.1} {:>8} {:>8} {:>7} {:>7}",
            c.world,
            c.factor.name(),
            name(c),
            c.panoramas,
            100.0 * c.repeatability,
            c.matches,
            c.right,
            100.0 * c.precision,
            number(c.error_deg.map(|s| s.median), 3),
            number(c.error_deg.map(|s| s.q95), 3),
            number(c.error_sd.map(|s| s.q68), 2),
            number(c.error_sd.map(|s| s.q95), 2),
        );
    }
    let _ = writeln!(text, "\n{:.2} ms an observation on one thread, median", study.observe_ms);
    text
}

/// The study as Markdown.
fn page(study: &VisionStudy, command: &str, figures: &[Figure], detections: Option<&Detections>) -> String {
    let worlds: Vec<String> = study.worlds.iter().map(|(name, sha)| format!("`{name}` (SHA-256 `{}`)", &sha[..12])).collect();
    let figure = |Figure { file, caption, .. }: &Figure| format!("![{caption}]({file})\n\n");
    let section = |factor: Factor| {
        let About { heading, explanation, .. } = about(factor);
        format!("## {heading}\n\n{explanation}\n\n{}\n", factor_table(study, factor))
    };
    format!(
        include_str!("page.md"),
        command = command,
        version = study.version,
        worlds = worlds.join(", "),
        width = study.size_px[0],
        height = study.size_px[1],
        keypoints = study.keypoints,
        right = RIGHT_PX,
        figures = figures.iter().map(figure).collect::<String>(),
        factors = measured(study).map(section).collect::<String>(),
        wrong = wrong_matches(study),
        objects = objects(study),
        opencv = detections.map_or_else(String::new, |detections| detections.section(study)),
    )
}

/// Two quantiles of a spread.
fn two(spread: Option<Spread>, pick: fn(Spread) -> [f64; 2], decimals: usize) -> String {
    let pair = spread.map(pick).map(|[a, b]| format!("{a:.decimals$}, {b:.decimals$}"));
    pair.unwrap_or_else(|| "-".to_owned())
}

fn factor_table(study: &VisionStudy, factor: Factor) -> String {
    let columns = "world | level | panoramas | repeatability % | matches | right (least) | precision % | error median, 95 % (degrees) | (pixels) | 68 %, 95 % (stated sd)";
    let row = |c: &LevelScore| {
        [
            c.world.clone(),
            name(c),
            c.panoramas.to_string(),
            format!("{:.1}", 100.0 * c.repeatability),
            format!("{:.1}", c.matches),
            format!("{:.1} ({})", c.right, c.least_right),
            format!("{:.1}", 100.0 * c.precision),
            two(c.error_deg, |s| [s.median, s.q95], 3),
            two(c.error_px, |s| [s.median, s.q95], 2),
            two(c.error_sd, |s| [s.q68, s.q95], 2),
        ]
    };
    table(columns, study.levels.iter().filter(|c| c.factor == factor).map(row))
}

/// What kind of wrong the wrong matches are.
fn wrong_matches(study: &VisionStudy) -> String {
    let row = |(world, _): &(String, String)| {
        let levels: Vec<&LevelScore> = of(study, world, Factor::Distance).collect();
        let sum = |value: fn(&LevelScore) -> usize| levels.iter().map(|c| value(c)).sum::<usize>();
        let wrong = sum(|c| c.wrong);
        let matches: f64 = levels.iter().map(|c| c.matches * c.panoramas as f64).sum();
        let percent = |count: usize| format!("{count} ({:.0} %)", 100.0 * count as f64 / wrong.max(1) as f64);
        [
            world.clone(),
            format!("{wrong} of {matches:.0} ({:.1} %)", 100.0 * wrong as f64 / matches.max(1.0)),
            percent(sum(|c| c.wrong_same_instance)),
            percent(sum(|c| c.wrong_near)),
            percent(sum(|c| c.wrong_wild)),
        ]
    };
    let columns = "world | wrong of all | same instance | within 30 pixels | wild: neither instance nor place";
    table(columns, study.worlds.iter().map(row))
}

/// Landmark objects.
fn objects(study: &VisionStudy) -> String {
    let row = |c: &LevelScore| {
        let (world, level, objects) = (c.world.clone(), c.level.to_string(), format!("{:.1}", c.objects));
        [
            world,
            level,
            objects,
            two(c.object_error_deg, |s| [s.median, s.q95], 3),
            two(c.object_error_sd, |s| [s.q68, s.q95], 2),
        ]
    };
    let seen = study.levels.iter().filter(|c| c.factor == Factor::Distance && c.object_error_deg.is_some());
    let columns = "world | distance (m) | objects a panorama | error median, 95 % (degrees) | 68 %, 95 % (stated sd)";
    table(columns, seen.map(row))
}
