//! The page on the extractor: tables, charts, and the comparison with OpenCV.

use std::fmt::Write;

use super::outside::{FILE as OUTSIDE, Outside};
use crate::draw::chart::{Axis as ChartAxis, Chart, Mark, Stroke};
use crate::error::Result;
use crate::storage::OutputFolder;
use crate::verify::vision::conditions::Axis;
use crate::verify::vision::score::{RIGHT_PX, Spread};
use crate::verify::vision::{Cell, VisionStudy};

/// Names of all files of the page. [`OUTSIDE`] comes from outside and is kept as it is.
pub const FILES: &[&str] = &[
    "README.md",
    "vision.csv",
    "matches.svg",
    "precision.svg",
    "repeatability.svg",
    "errors.svg",
    "conditions-rotation.svg",
    "conditions-gain.svg",
    "conditions-gamma.svg",
    "conditions-noise.svg",
    "conditions-occlusion.svg",
    OUTSIDE,
    "opencv.svg",
];

/// Writes the page that `command` has made. `outside` is the text of [`OUTSIDE`] where the folder has one.
///
/// # Errors
/// When a file cannot be written, or the table from outside is not what its script writes.
pub fn write(mut folder: OutputFolder, study: &VisionStudy, command: &str, outside: Option<&str>) -> Result<()> {
    let table = outside.map(Outside::parse).transpose()?;
    folder.write("vision.csv", csv(study).as_bytes())?;
    for (name, _, chart) in charts(study) {
        folder.write(name, chart.to_svg().as_bytes())?;
    }
    if let (Some(table), Some(text)) = (&table, outside) {
        folder.write(OUTSIDE, text.as_bytes())?;
        folder.write("opencv.svg", table.chart().to_svg().as_bytes())?;
    }
    folder.write("README.md", page(study, command, table.as_ref()).as_bytes())?;
    folder.finish()
}

/// Columns of `vision.csv`.
const COLUMNS: &str = "world,axis,level,panoramas,repeatability,matches,right,least_right,precision,wrong,wrong_same_instance,\
     wrong_near,wrong_wild,error_median_deg,error_q95_deg,error_median_px,error_q95_px,error_q68_sd,error_q95_sd,objects,\
     object_error_median_deg,object_error_q95_deg,object_error_q68_sd,object_error_q95_sd";

/// One row a cell, empty cells where there is no number.
#[must_use]
pub fn csv(study: &VisionStudy) -> String {
    let mut text = format!("{COLUMNS}\n");
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    for c in &study.cells {
        let _ = write!(text, "{},{},{},{},", c.world, c.axis.name(), c.label, c.panoramas);
        let _ = write!(text, "{},{},{},{},{},", c.repeatability, c.matches, c.right, c.least_right, c.precision);
        let _ = write!(text, "{},{},{},{}", c.wrong, c.wrong_same_instance, c.wrong_near, c.wrong_wild);
        let spreads = [
            c.error_deg.map(|s| s.median),
            c.error_deg.map(|s| s.q95),
            c.error_px.map(|s| s.median),
            c.error_px.map(|s| s.q95),
            c.error_sd.map(|s| s.q68),
            c.error_sd.map(|s| s.q95),
            Some(c.objects),
            c.object_error_deg.map(|s| s.median),
            c.object_error_deg.map(|s| s.q95),
            c.object_error_sd.map(|s| s.q68),
            c.object_error_sd.map(|s| s.q95),
        ];
        for value in spreads {
            let _ = write!(text, ",{}", number(value));
        }
        text.push('\n');
    }
    text
}

fn of<'a>(study: &'a VisionStudy, world: &'a str, axis: Axis) -> impl Iterator<Item = &'a Cell> {
    study.cells.iter().filter(move |c| c.world == world && c.axis == axis)
}

/// What an axis shows, with its unit.
fn title(axis: Axis) -> &'static str {
    match axis {
        Axis::Distance => "distance from home (m)",
        Axis::Rotation => "turn since home (degrees)",
        Axis::Gain => "factor on the grey levels",
        Axis::Gamma => "exponent on the grey levels",
        Axis::Noise => "noise (sd, grey levels)",
        Axis::Occlusion => "share of the turn that is hidden (%)",
        Axis::Light => "light",
        Axis::Camera => "camera",
    }
}

/// A level in the unit of the title.
fn shown(axis: Axis, level: f64) -> f64 {
    if axis == Axis::Occlusion { 100.0 * level } else { level }
}

/// A level as a table shows it.
fn name(cell: &Cell) -> String {
    if cell.axis == Axis::Occlusion { shown(cell.axis, cell.level).to_string() } else { cell.label.clone() }
}

/// A chart of one line a world.
fn chart(study: &VisionStudy, axis: Axis, name: &str, y: &str, value: impl Fn(&Cell) -> f64) -> Chart {
    let x = if matches!(axis, Axis::Gain | Axis::Gamma) { ChartAxis::log(title(axis)) } else { ChartAxis::linear(title(axis)) };
    let mut chart = Chart::new(name, x, ChartAxis::linear(y).from(0.0));
    for (k, (world, _)) in study.worlds.iter().enumerate() {
        let points: Vec<[f64; 2]> = of(study, world, axis).map(|c| [shown(axis, c.level), value(c)]).collect();
        chart = chart.line(points.iter().copied(), &Stroke::series(k), world).points(points, &Mark::series(k), "");
    }
    chart
}

/// File name, caption and drawing.
type Figure = (&'static str, &'static str, Chart);

/// The charts of those axes that were measured.
fn charts(study: &VisionStudy) -> Vec<Figure> {
    let measured = |axis: Axis| study.cells.iter().any(|c| c.axis == axis);
    let mut figures: Vec<Figure> = Vec::new();
    if measured(Axis::Distance) {
        let matches = chart(study, Axis::Distance, "Home features found again", "right matches a panorama", |c| c.right);
        figures.push(("matches.svg", "Right matches over distance", matches));
        let precision = chart(study, Axis::Distance, "Matching precision", "right of all matches (%)", |c| 100.0 * c.precision)
            .line([[1.9, 90.0], [2.1, 90.0]], &Stroke::EXACT, "asked for at 2 m and 3 m")
            .line([[2.9, 80.0], [3.1, 80.0]], &Stroke::EXACT, "");
        figures.push(("precision.svg", "Precision over distance", precision));
        let repeat =
            chart(study, Axis::Distance, "Repeatability", "visible home features found (%)", |c| 100.0 * c.repeatability);
        figures.push(("repeatability.svg", "Repeatability over distance", repeat));
        figures.push(("errors.svg", "Bearing errors", errors(study)));
    }
    for (axis, file, name) in [
        (Axis::Rotation, "conditions-rotation.svg", "Turned"),
        (Axis::Gain, "conditions-gain.svg", "In brighter and darker light"),
        (Axis::Gamma, "conditions-gamma.svg", "With another contrast"),
        (Axis::Noise, "conditions-noise.svg", "With image noise"),
        (Axis::Occlusion, "conditions-occlusion.svg", "Behind what was not there"),
    ] {
        if measured(axis) {
            let drawing = chart(study, axis, &format!("{name}, 1 m from home"), "right matches a panorama", |c| c.right);
            figures.push((file, name, drawing));
        }
    }
    figures
}

/// Share of the bearing errors below each size, a curve a distance; all worlds together.
fn errors(study: &VisionStudy) -> Chart {
    let x = ChartAxis::log("bearing error (degrees)");
    let mut chart = Chart::new("Bearing errors of right matches", x, ChartAxis::linear("smaller (%)").from(0.0));
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
#[must_use]
pub fn table(study: &VisionStudy) -> String {
    let mut text = format!(
        "{:10} {:9} {:>8} {:>5} {:>7} {:>7} {:>7} {:>7} {:>8} {:>8} {:>7} {:>7}\n",
        "world", "axis", "level", "shots", "repeat%", "matches", "right", "prec%", "med deg", "95% deg", "68% sd", "95% sd"
    );
    for c in &study.cells {
        let number = |value: Option<f64>, decimals: usize| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.decimals$}"));
        let _ = writeln!(
            text,
            "{:10} {:9} {:>8} {:>5} {:>7.1} {:>7.1} {:>7.1} {:>7.1} {:>8} {:>8} {:>7} {:>7}",
            c.world,
            c.axis.name(),
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
fn page(study: &VisionStudy, command: &str, outside: Option<&Outside>) -> String {
    let worlds: Vec<String> = study.worlds.iter().map(|(name, sha)| format!("`{name}` (SHA-256 `{}`)", &sha[..12])).collect();
    let [width, height] = study.size_px;
    let mut text = format!(
        "# The extractor against ground truth\n\nMade by\n\n```sh\n{command}\n```\n\nwith wayhome {version}, worlds {worlds}, \
         {width} x {height} pixels, the {keypoints} strongest features of each panorama.\n\n\
         Panoramas are taken in 16 directions around home, wherever the robot can stand there, each turned differently; \
         the renderer's range says where each home feature must appear in them, and whether anything hides it. \
         A match is *right* within {RIGHT_PX} pixels of that place. *Repeatability*: of the home features that can be seen, how many \
         are found as features at all, within {RIGHT_PX} pixels and a factor 1.5 of the scale, matched or not. Matches are those that \
         pass the geometric check. *Error* is that of the bearings of right matches; in stated standard deviations it should stay \
         below 1 for 68 % and below 2 for 95 % of them. The extractor sees colours only.\n\n",
        version = study.version,
        worlds = worlds.join(", "),
        keypoints = study.keypoints,
    );
    for (file, caption, _) in charts(study) {
        let _ = writeln!(text, "![{caption}]({file})\n");
    }
    for axis in Axis::ALL.into_iter().filter(|axis| study.cells.iter().any(|c| c.axis == *axis)) {
        let _ = writeln!(text, "## {}\n\n{}\n", heading(axis), explanation(axis));
        text.push_str(&axis_table(study, axis));
    }
    text.push_str(&wrong_matches(study));
    text.push_str(&objects(study));
    if let Some(outside) = outside {
        text.push_str(&outside.section(study));
    }
    text
}

fn heading(axis: Axis) -> &'static str {
    match axis {
        Axis::Distance => "Distance from home",
        Axis::Rotation => "Rotation",
        Axis::Gain => "Brightness",
        Axis::Gamma => "Contrast",
        Axis::Noise => "Image noise",
        Axis::Occlusion => "Occlusion",
        Axis::Light => "Light",
        Axis::Camera => "Camera",
    }
}

/// What exactly is done.
fn explanation(axis: Axis) -> &'static str {
    match axis {
        Axis::Distance => "People who walk have walked on for 2 s between one panorama and the next.",
        Axis::Rotation => "1 m from home, turned by this much since home, in degrees.",
        Axis::Gain => "1 m from home; all grey levels times this factor, clipped at white. The home panorama is as it was.",
        Axis::Gamma => "1 m from home; grey levels of 0 to 1 to this power. The home panorama is as it was.",
        Axis::Light => {
            "1 m from home, which was seen by day: the light presets of the worlds. Where a room has no windows, `glare` is `day`."
        }
        Axis::Camera => "1 m from home, which was seen through the ideal camera: the camera presets, the robot at rest.",
        Axis::Noise => {
            "1 m from home; normal noise of this standard deviation, in grey levels of 255, on each channel of each pixel, in the \
             home panorama too."
        }
        Axis::Occlusion => {
            "1 m from home; upright things with a patchy dress, 9 to 26 degrees wide and as high as the picture, hide this share of \
             the turn."
        }
    }
}

fn axis_table(study: &VisionStudy, axis: Axis) -> String {
    let mut text =
        "| world | level | panoramas | repeatability % | matches | right (least) | precision % | error median, 95 % (degrees) \
                    | (pixels) | 68 %, 95 % (stated sd) |\n|---|---|---|---|---|---|---|---|---|---|\n"
            .to_owned();
    let two = |spread: Option<Spread>, pick: fn(Spread) -> [f64; 2], decimals: usize| {
        spread.map_or_else(
            || "-".to_owned(),
            |s| {
                let [a, b] = pick(s);
                format!("{a:.decimals$}, {b:.decimals$}")
            },
        )
    };
    for c in study.cells.iter().filter(|c| c.axis == axis) {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.1} | {:.1} | {:.1} ({}) | {:.1} | {} | {} | {} |",
            c.world,
            name(c),
            c.panoramas,
            100.0 * c.repeatability,
            c.matches,
            c.right,
            c.least_right,
            100.0 * c.precision,
            two(c.error_deg, |s| [s.median, s.q95], 3),
            two(c.error_px, |s| [s.median, s.q95], 2),
            two(c.error_sd, |s| [s.q68, s.q95], 2),
        );
    }
    text + "\n"
}

/// What kind of wrong the wrong matches are.
fn wrong_matches(study: &VisionStudy) -> String {
    let mut text = "## Wrong matches\n\nOf the matches that pass the check and are wrong, at all distances: how many lie on the same \
                    instance as the home feature (the right thing, another mark on it), and how many within 30 pixels of the right \
                    place. What is left is wild.\n\n| world | wrong of all | same instance | within 30 pixels | wild: neither \
                    instance nor place |\n|---|---|---|---|---|\n"
        .to_owned();
    for (world, _) in &study.worlds {
        let cells: Vec<&Cell> = of(study, world, Axis::Distance).collect();
        let sum = |value: fn(&Cell) -> usize| cells.iter().map(|c| value(c)).sum::<usize>();
        let (wrong, same, near, wild) =
            (sum(|c| c.wrong), sum(|c| c.wrong_same_instance), sum(|c| c.wrong_near), sum(|c| c.wrong_wild));
        let matches: f64 = cells.iter().map(|c| c.matches * c.panoramas as f64).sum();
        let percent = |count: usize| format!("{count} ({:.0} %)", 100.0 * count as f64 / wrong.max(1) as f64);
        let _ = writeln!(
            text,
            "| {world} | {wrong} of {matches:.0} ({:.1} %) | {} | {} | {} |",
            100.0 * wrong as f64 / matches.max(1.0),
            percent(same),
            percent(near),
            percent(wild)
        );
    }
    text + "\n"
}

/// Landmark objects.
fn objects(study: &VisionStudy) -> String {
    let mut text = "## Landmark objects\n\n`wayhome home --landmarks objects`: neighbouring features clustered, the centre of the cluster \
                    the bearing. The truth of an object is the mean azimuth of its features' places.\n\n| world | distance (m) | objects \
                    a panorama | error median, 95 % (degrees) | 68 %, 95 % (stated sd) |\n|---|---|---|---|---|\n"
        .to_owned();
    for c in study.cells.iter().filter(|c| c.axis == Axis::Distance) {
        let (Some(degrees), Some(sd)) = (c.object_error_deg, c.object_error_sd) else { continue };
        let _ = writeln!(
            text,
            "| {} | {} | {:.1} | {:.3}, {:.3} | {:.2}, {:.2} |",
            c.world, c.level, c.objects, degrees.median, degrees.q95, sd.q68, sd.q95
        );
    }
    text + "\n"
}
