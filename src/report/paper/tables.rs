//! Tables I and II and the drawings of the paths.

use super::{Section, Target, short};
use crate::control::Law;
use crate::draw::image::colours_png;
use crate::draw::map::{MapDrawing, Stroke};
use crate::draw::markdown::table_of_numbers;
use crate::error::Result;
use crate::geometry::Vector2;
use crate::panorama::{Panorama, Projection};
use crate::study::paper::claims::{Both, Tally, median_rmse};
use crate::study::paper::course::{Course, Run, StartError, Variant};
use crate::study::paper::evidence::{Evidence, SetEvidence};
use crate::study::paper::images::{ImageCase, ImageSet};
use crate::study::paper::objects::{Object, WIDTH_RAD};
use crate::study::paper::{LAWS, PrintedTable, STARTS, TABLE_I, TABLE_II, law_name};
use crate::world::World;
use crate::world::polygon::contains;

/// Table I.
pub(super) fn table_one(evidence: &Evidence) -> Result<Section> {
    let runs = evidence.table_one()?;
    let text = format!(
        include_str!("table1.md"),
        errors = rmse_table(runs, Some(&TABLE_I)),
        right = short(median_rmse(runs, 2)),
        wrong = short(median_rmse(&evidence.ideal.runs(&Variant::default().printed())?, 2)),
    );
    Ok(Section::new(Target::Table1, text, []))
}

/// Root mean square errors by start, state and law, with the paper's beside ours where it prints them.
fn rmse_table(runs: &[Run], printed: Option<&PrintedTable>) -> String {
    let row = |(k, start): (usize, &str)| {
        let found = LAWS.map(|law| runs.iter().find(|run| run.start == start && run.law == law));
        let error = |state: usize, law: usize| {
            let ours = found[law].and_then(|run| run.track.rmse()).map_or("-".to_owned(), |rmse| short(rmse[state]));
            printed.map_or(ours.clone(), |table| format!("{ours} / {}", short(table[k][law][state])))
        };
        let times = found.map(|run| run.and_then(|run| run.track.time_s()).map_or("-".to_owned(), |t| format!("{t:.1} s")));
        let errors = (0..3).flat_map(|state| [error(state, 0), error(state, 1)]);
        [start.to_owned()].into_iter().chain(errors).chain([times.join(", ")]).collect::<Vec<_>>()
    };
    let errors = ["R (cm)", "theta (rad)", "alpha (rad)"].map(|state| LAWS.map(|law| format!("{state}, {}", law_name(law))));
    let columns = format!("start | {} | home after", errors.as_flattened().join(" | "));
    table_of_numbers(&columns, 1, STARTS.into_iter().enumerate().map(row))
}

/// How many errors of R are at or below the printed ones: "8 of 8".
pub(super) fn below(runs: &[Run], table: &PrintedTable) -> String {
    let cells = runs.iter().filter_map(|run| {
        let row = STARTS.iter().position(|start| *start == run.start)?;
        Some(run.track.rmse()?[0] <= table[row][usize::from(run.law == Law::Lyapunov)][0])
    });
    let cells: Vec<bool> = cells.collect();
    format!("{} of {}", cells.iter().filter(|below| **below).count(), cells.len())
}

/// Fig. 3.
pub(super) fn fig_three(evidence: &Evidence) -> Result<Section> {
    let paths = path_figures(&evidence.world, evidence.table_one()?, "Fig. 3");
    Ok(Section::new(Target::Fig3, include_str!("fig3.md"), paths))
}

/// The colours of P1 to P4.
const STARTS_IN: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];

/// One map a law.
fn path_figures(world: &World, runs: &[Run], name: &str) -> [Vec<u8>; 2] {
    LAWS.map(|law| {
        let title = format!("{name}: {} law, filter started at the truth", law_name(law));
        let mut drawing = MapDrawing::new(world).title(title);
        for (run, colour) in runs.iter().filter(|r| r.law == law).zip(STARTS_IN) {
            let truth = Stroke { colour, width_px: 2.2, dashes: "" };
            let believed = Stroke { colour: "#1a1a1a", width_px: 1.0, dashes: "3 4" };
            let ended = run.track.time_s().map_or("not home".to_owned(), |t| format!("home after {t:.1} s"));
            let samples = &run.track.samples;
            let inside = |p: &Vector2<f64>| contains(&world.outline, *p);
            let truths = samples.iter().map(|s| world.home.compose(&s.truth).position());
            let estimates = samples.iter().filter_map(|s| Some(world.home.compose(&s.estimate?.pose).position()));
            drawing = drawing.path(truths, &truth, &format!("{}, {ended}", run.start));
            drawing = drawing.path(estimates.filter(inside), &believed, "estimates");
        }
        drawing.to_svg().into_bytes()
    })
}

/// Table II.
pub(super) fn table_two(evidence: &Evidence) -> Result<Section> {
    let set = evidence.set(ImageSet::Paper)?;
    let text = format!(
        include_str!("table2.md"),
        set = set_text(&set.case),
        speed = 100.0 * set.case.world.spec.task.speed_m_s,
        errors = rmse_table(set.runs()?, Some(&TABLE_II)),
    );
    Ok(Section::new(Target::Table2, [text, images_text(set)?].join("\n"), [objects_png(&set.case)?]))
}

/// Fig. 5.
pub(super) fn fig_five(evidence: &Evidence) -> Result<Section> {
    let set = evidence.set(ImageSet::Paper)?;
    let paths = path_figures(&set.case.world, set.runs()?, "Fig. 5");
    Ok(Section::new(Target::Fig5, format!(include_str!("fig5.md"), set = set_text(&set.case)), paths))
}

/// Fig. 7.
pub(super) fn fig_seven(evidence: &Evidence) -> Result<Section> {
    let set = evidence.set(ImageSet::Vardy)?;
    let paths = path_figures(&set.case.world, set.runs()?, "Fig. 7");
    let text = format!(include_str!("fig7.md"), set = set_text(&set.case), errors = rmse_table(set.runs()?, None));
    let drawings = paths.into_iter().chain([objects_png(&set.case)?]);
    Ok(Section::new(Target::Fig7, [text, images_text(set)?].join("\n"), drawings))
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

/// A set's objects, and where the small errors come from.
fn images_text(set: &SetEvidence) -> Result<String> {
    let (field, claims) = (&set.case.field, set.claims()?);
    let object = |(k, object): (usize, &Object)| {
        let (found, fix) = (object.seen_rad.iter().flatten().count(), field.fix(object));
        let of = |value: Option<f64>, unit: &str| value.map_or("-".to_owned(), |v| format!("{v:.2} {unit}"));
        [
            (k + 1).to_string(),
            format!("{:.0} deg", object.home_rad.to_degrees()),
            format!("{found} of {}", object.seen_rad.len()),
            of(fix.map(|f| f.point.norm()), "m"),
            of(fix.map(|f| f.rms_rad.to_degrees()), "deg"),
            of(fix.map(|f| f.worst_rad.to_degrees()), "deg"),
        ]
    };
    let variants = [
        ("as above", &claims.faithful),
        ("with G as printed", &claims.printed),
        ("bearings ignored: exact odometry from the true start, nothing else", &claims.blind),
        ("told nothing of the start (R = 50 cm, theta = 0.1, alpha = 0)", &claims.untold),
    ];
    let variant = |(name, both): (&str, &Both)| {
        let [home, range, heading] = tally_cells(both);
        [name.to_owned(), range, heading, home]
    };
    Ok(format!(
        include_str!("images.md"),
        places = field.grid.rows * field.grid.columns,
        matches = field.matches_mean,
        objects = table_of_numbers(
            "object | azimuth at home | found at | distance of the point | off it, rms | off it, most",
            1,
            field.objects.iter().take(3).enumerate().map(object)
        ),
        variants = table_of_numbers(
            "filter | R rmse (cm), proportional, nonlinear | alpha rmse (rad) | home of 4",
            1,
            variants.into_iter().map(variant)
        ),
        places_deg = claims.bearing_rms_rad.to_degrees(),
        between_deg = claims.interpolation_rms_rad.to_degrees(),
        one_look_cm = claims.one_look_cm,
    ))
}

/// Both laws' runs that came home, errors of R (cm) and of alpha (rad).
pub(super) fn tally_cells(both: &Both) -> [String; 3] {
    let cell = |of: fn(&Tally) -> String| both.each_ref().map(of).join(", ");
    [cell(|t| t.home.to_string()), cell(|t| short(t.range_rmse_cm)), cell(|t| short(t.heading_rmse_rad))]
}

/// Outlines of the three objects.
const OUTLINES: [[u8; 3]; 3] = [[230, 30, 60], [30, 200, 80], [40, 110, 255]];
/// Widest picture of a home panorama, pixels.
const WIDEST_PX: u32 = 1170;

/// The home panorama, made smaller by averaging, with the three objects outlined.
fn objects_png(case: &ImageCase) -> Result<Vec<u8>> {
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
    colours_png(&picture, "picture of the objects")
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
