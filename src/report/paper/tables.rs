//! Tables I and II and the drawings of the paths.

use std::fmt::Write;

use super::{Section, Target, short};
use crate::control::Law;
use crate::draw::image::colours_png;
use crate::draw::map::{MapDrawing, PathStyle};
use crate::error::Result;
use crate::panorama::{Panorama, Projection};
use crate::study::paper::claims::{ImageClaims, StartError, Tally};
use crate::study::paper::ideal::Run;
use crate::study::paper::images::{ImageCase, ImageSet};
use crate::study::paper::objects::WIDTH_RAD;
use crate::study::paper::{LAWS, PrintedTable, STARTS, TABLE_I, TABLE_II};
use crate::world::World;

/// What a table calls a law.
pub(super) fn law_name(law: Law) -> &'static str {
    match law {
        Law::Proportional => "proportional",
        Law::Lyapunov => "nonlinear",
    }
}

/// Table I.
#[must_use]
pub fn table_one(runs: &[Run], printed_g: &[Run]) -> Section {
    let mut text = "## Table I: errors with accurate bearings\n\n`wayhome reproduce table1`: three point landmarks, P1 to P4, Ts = 0.1 s, \
         v = 12 cm/s, Rc = 5 cm, Q = 0.01 I, M = 0.1 I, P(0|0) = I, truth by Dormand and Prince's method, **the filter started at the true \
         state**. Root mean square errors by (17); each cell is ours, then the paper's.\n\n"
        .to_owned();
    text += &rmse_table(runs, &TABLE_I, true);
    let _ = write!(
        text,
        "\nAll of ours for R and theta are below the paper's, because filter and truth start in the same state and nothing pulls them \
         apart but rounding: the table measures integrators, not an observer. The paper's alpha of 1e-16 and 0 says that its filter \
         knew alpha from the start and never changed it. Ours corrects alpha like every other state and stays at {right} rad; with \
         the Jacobian G as the paper prints it, whose row for alpha is zero, alpha is never corrected and its error is {wrong} rad \
         (median over the starts, both laws). What happens from another start stands in the audit.\n",
        right = short(alpha_median(runs)),
        wrong = short(alpha_median(printed_g)),
    );
    Section { target: Target::Table1, markdown: text, figures: Vec::new() }
}

fn alpha_median(runs: &[Run]) -> f64 {
    let values: Vec<f64> = runs.iter().filter_map(|r| Some(r.track.rmse()?[2])).collect();
    crate::study::statistics::quantile(&values, 0.5).unwrap_or(f64::NAN)
}

fn rmse_table(runs: &[Run], printed: &PrintedTable, with_alpha: bool) -> String {
    let states = if with_alpha { 3 } else { 2 };
    let names = ["R (cm)", "theta (rad)", "alpha (rad)"];
    let mut head = "| start |".to_owned();
    let mut rule = "|---|".to_owned();
    for name in &names[..states] {
        for law in LAWS {
            let _ = write!(head, " {name}, {} |", law_name(law));
            rule += "---:|";
        }
    }
    let mut text = format!("{head} home after |\n{rule}---:|\n");
    for (row, start) in STARTS.iter().enumerate() {
        let _ = write!(text, "| {start} |");
        let found = |law: Law| runs.iter().find(|r| r.start == *start && r.law == law);
        for state in 0..states {
            for (column, law) in LAWS.into_iter().enumerate() {
                let ours = found(law).and_then(|r| r.track.rmse()).map_or(f64::NAN, |rmse| rmse[state]);
                let _ = write!(text, " {} / {} |", short(ours), short(printed.rows[row][column][state]));
            }
        }
        let times = LAWS.map(|law| found(law).and_then(|r| r.track.time_s()).map_or("-".to_owned(), |t| format!("{t:.1} s")));
        let _ = writeln!(text, " {} |", times.join(", "));
    }
    text
}

/// Fig. 3.
///
/// # Errors
/// When the world cannot be opened.
pub fn fig_three(runs: &[Run]) -> Result<Section> {
    let world = World::open("paper-ideal")?;
    let figures = path_figures(&world, runs, "Fig. 3", ["fig3-proportional.svg", "fig3-nonlinear.svg"]);
    let text = "## Fig. 3: paths with accurate bearings\n\n`wayhome reproduce fig3`: the runs of Table I. Dashes are the estimate; it \
         lies on the truth.\n\n![Paths under the proportional law](fig3-proportional.svg)\n\n![Paths under the nonlinear \
         law](fig3-nonlinear.svg)\n";
    Ok(Section { target: Target::Fig3, markdown: text.into(), figures })
}

/// The colours of P1 to P4.
const STARTS_IN: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];

fn path_figures(world: &World, runs: &[Run], name: &str, files: [&'static str; 2]) -> Vec<(&'static str, Vec<u8>)> {
    let draw = |(law, file): (Law, &'static str)| {
        let title = format!("{name}: {} law, filter started at the truth", law_name(law));
        let mut drawing = MapDrawing::new(world).title(title);
        for (run, colour) in runs.iter().filter(|r| r.law == law).zip(STARTS_IN) {
            let truth = PathStyle { colour, width_px: 2.2, dashes: "" };
            let believed = PathStyle { colour: "#1a1a1a", width_px: 1.0, dashes: "3 4" };
            let ended = run.track.time_s().map_or("not home".to_owned(), |t| format!("home after {t:.1} s"));
            let samples = &run.track.samples;
            let inside = |p: &crate::geometry::Vector2<f64>| crate::world::polygon::contains(&world.outline, *p);
            drawing = drawing
                .path(
                    samples.iter().map(|s| world.home.compose(&s.truth).position()),
                    &truth,
                    &format!("{}, {ended}", run.start),
                )
                .path(
                    samples.iter().filter_map(|s| Some(world.home.compose(&s.estimate?).position())).filter(inside),
                    &believed,
                    "estimates",
                );
        }
        (file, drawing.to_svg().into_bytes())
    };
    LAWS.into_iter().zip(files).map(draw).collect()
}

/// Table II.
///
/// # Errors
/// When the picture of the objects cannot be encoded.
pub fn table_two(case: &ImageCase, runs: &[Run], claims: &ImageClaims) -> Result<Section> {
    let mut text = format!(
        "## Table II: errors with bearings from images, the paper's own set\n\n`wayhome reproduce table2`: {set}. Ts = 0.1 s, v = {v:.0} cm/s \
         (the paper gives none here; this is that of its section IV-C), Q = 0.01 I, **M = I**, P(0|0) = I, **the filter started at the \
         true state**, odometry exact. Each cell is ours, then the paper's.\n\n",
        set = set_text(case),
        v = 100.0 * case.world.spec.task.speed_m_s,
    );
    text += &rmse_table(runs, &TABLE_II, true);
    text += &format!("\n![The three objects in the home panorama](fig4-objects.png)\n\n{}\n", objects_table(case));
    text += &variants(claims);
    let figures = vec![("fig4-objects.png", objects_png(case, "fig4-objects.png")?)];
    Ok(Section { target: Target::Table2, markdown: text, figures })
}

/// Fig. 5.
///
/// # Errors
/// When the world cannot be opened.
pub fn fig_five(case: &ImageCase, runs: &[Run]) -> Result<Section> {
    let world = World::open(case.set.world_name())?;
    let figures = path_figures(&world, runs, "Fig. 5", ["fig5-proportional.svg", "fig5-nonlinear.svg"]);
    let text = format!(
        "## Fig. 5: paths on the paper's own set\n\n`wayhome reproduce fig5`: the runs of Table II, {set}.\n\n![Paths under the \
         proportional law](fig5-proportional.svg)\n\n![Paths under the nonlinear law](fig5-nonlinear.svg)\n",
        set = set_text(case)
    );
    Ok(Section { target: Target::Fig5, markdown: text, figures })
}

/// Fig. 7.
///
/// # Errors
/// When the world cannot be opened, or the picture of the objects cannot be encoded.
pub fn fig_seven(case: &ImageCase, runs: &[Run], claims: &ImageClaims) -> Result<Section> {
    let world = World::open(case.set.world_name())?;
    let mut figures = path_figures(&world, runs, "Fig. 7", ["fig7-proportional.svg", "fig7-nonlinear.svg"]);
    figures.push(("fig6-objects.png", objects_png(case, "fig6-objects.png")?));
    let mut text = format!(
        "## Fig. 7: paths on Vardy's set\n\n`wayhome reproduce fig7`: {set}. Everything else as for Table II. The paper prints no table for \
         it; errors are \"of the same magnitude\". Ours:\n\n| start | R (cm), proportional | R (cm), nonlinear | theta (rad), proportional | \
         theta (rad), nonlinear | alpha (rad), proportional | alpha (rad), nonlinear | home after |\n|---|---:|---:|---:|---:|---:|---:|---:|\n",
        set = set_text(case),
    );
    for start in STARTS {
        let found = LAWS.map(|law| runs.iter().find(|r| r.start == start && r.law == law));
        let rmse = |state: usize| {
            found.map(|r| r.and_then(|r| r.track.rmse()).map_or(String::from("-"), |rmse| short(rmse[state]))).join(" | ")
        };
        let times = found.map(|r| r.and_then(|r| r.track.time_s()).map_or("-".to_owned(), |t| format!("{t:.1} s"))).join(", ");
        let _ = writeln!(text, "| {start} | {} | {} | {} | {times} |", rmse(0), rmse(1), rmse(2));
    }
    text += "\n![Paths under the proportional law](fig7-proportional.svg)\n\n![Paths under the nonlinear \
             law](fig7-nonlinear.svg)\n\n![The three objects in the home panorama](fig6-objects.png)\n\n";
    text += &objects_table(case);
    text.push('\n');
    text += &variants(claims);
    Ok(Section { target: Target::Fig7, markdown: text, figures })
}

/// A set in words.
pub(super) fn set_text(case: &ImageCase) -> String {
    let grid = case.field.grid;
    let [width, height] = case.field.size_px;
    let from = if case.rendered {
        format!("panoramas of the world `{}`, rendered by the program", case.set.world_name())
    } else {
        "panoramas of a set on disk".to_owned()
    };
    format!(
        "{from}, {} x {} places {} cm apart, {width} x {height} pixels, bearings of three objects found in the images at the places and \
         interpolated linearly between them",
        grid.rows,
        grid.columns,
        100.0 * grid.spacing_m
    )
}

fn objects_table(case: &ImageCase) -> String {
    let field = &case.field;
    let mut text = format!(
        "The landmarks are three strips of 12 degrees of the home panorama, chosen by how often they are found together in the {} panoramas \
         ({:.0} features are matched in one on average). How well a strip's bearings at the places agree with one point in the plane, \
         which nothing here uses:\n\n| object | azimuth at home | found at | distance of the point | off it, rms | off it, most |\n\
         |---|---:|---:|---:|---:|---:|\n",
        field.grid.rows * field.grid.columns,
        field.matches_mean,
    );
    for (k, object) in field.objects.iter().take(3).enumerate() {
        let found = object.seen_rad.iter().flatten().count();
        let fix = field.fix(object);
        let of = |value: Option<f64>, unit: &str| value.map_or("-".to_owned(), |v| format!("{v:.2} {unit}"));
        let _ = writeln!(
            text,
            "| {} | {:.0} deg | {found} of {} | {} | {} | {} |",
            k + 1,
            object.home_rad.to_degrees(),
            object.seen_rad.len(),
            of(fix.map(|f| f.point.norm()), "m"),
            of(fix.map(|f| f.rms_rad.to_degrees()), "deg"),
            of(fix.map(|f| f.worst_rad.to_degrees()), "deg"),
        );
    }
    text
}

/// Where the small errors come from.
fn variants(claims: &ImageClaims) -> String {
    let mut text = "Where these errors come from:\n\n| filter | R rmse (cm), proportional, nonlinear | alpha rmse (rad) | home of 4 |\n|---|---:|---:|---:|\n".to_owned();
    let mut row = |name: &str, both: &[Tally; 2]| {
        let of = |f: &dyn Fn(&Tally) -> String| both.iter().map(f).collect::<Vec<_>>().join(", ");
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} |",
            of(&|t| short(t.range_rmse_cm)),
            of(&|t| short(t.heading_rmse_rad)),
            of(&|t| t.home.to_string())
        );
    };
    row("as above", &claims.faithful);
    row("with G as printed", &claims.printed);
    row("bearings ignored: exact odometry from the true start, nothing else", &claims.blind);
    row("told nothing of the start (R = 50 cm, theta = 0.1, alpha = 0)", &claims.untold);
    let _ = writeln!(
        text,
        "\nMedians over the starts. The bearings make the estimate worse, not better: without them it would be exact, because the start \
         and the odometry are. What they are worth by themselves: off by {:.2} deg rms at the places and {:.2} deg more between \
         them by interpolation, three of them fix a position that knows its landmarks to {:.1} cm at best (median over the grid, one \
         look, heading unknown).",
        claims.bearing_rms_rad.to_degrees(),
        claims.interpolation_rms_rad.to_degrees(),
        claims.one_look_cm
    );
    text
}

/// Outlines of the three objects.
const OUTLINES: [[u8; 3]; 3] = [[230, 30, 60], [30, 200, 80], [40, 110, 255]];
/// Widest picture of a home panorama, pixels.
const WIDEST_PX: u32 = 1170;

/// The home panorama, made smaller by averaging, with the three objects outlined.
fn objects_png(case: &ImageCase, name: &str) -> Result<Vec<u8>> {
    let full = &case.home;
    let factor = full.projection.width.div_ceil(WIDEST_PX).max(1);
    let (width, height) = (full.projection.width / factor, full.projection.height / factor);
    let mut picture = Panorama::black(Projection::new(width, height));
    for row in 0..height {
        for column in 0..width {
            for channel in 0..3 {
                let block = (0..factor).flat_map(|y| (0..factor).map(move |x| (x, y)));
                let at = |(x, y): (u32, u32)| {
                    let pixel = (row * factor + y) * full.projection.width + column * factor + x;
                    u32::from(full.rgba[4 * pixel as usize + channel])
                };
                let sum: u32 = block.map(at).sum();
                picture.rgba[4 * (row * width + column) as usize + channel] = (sum / (factor * factor)) as u8;
            }
            picture.rgba[4 * (row * width + column) as usize + 3] = 255;
        }
    }
    let thick = if case.set == ImageSet::Paper { 2 } else { 1 };
    for (object, colour) in case.field.objects.iter().zip(OUTLINES) {
        let edge = |side: f64| picture.projection.column(object.home_rad + side * 0.5 * WIDTH_RAD) as u32;
        let (left, strip) = (edge(-1.0), (WIDTH_RAD / picture.projection.pixel_rad()) as u32);
        for row in 0..height {
            for step in 0..=strip {
                let rim = row < thick || row + thick >= height || step < thick || step + thick > strip;
                if rim {
                    let at = 4 * (row * width + (left + step) % width) as usize;
                    picture.rgba[at..at + 3].copy_from_slice(&colour);
                }
            }
        }
    }
    colours_png(&picture, name)
}

/// A wrong start in words.
pub(super) fn start_error_name(error: StartError) -> String {
    match error {
        StartError::None => "the truth".into(),
        StartError::Range(factor) => format!("R {:+.0} %", 100.0 * (factor - 1.0)),
        StartError::Heading(angle) => format!("alpha {:+.0} deg", angle.to_degrees()),
        StartError::Place(angle) => format!("R = 50 cm, theta {angle:+} rad"),
        StartError::Untold => "R = 50 cm, theta = 0.1, alpha = 0".into(),
    }
}
