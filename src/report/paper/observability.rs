//! The observability section, and the table and drawing for any world.

use std::fmt::Write;

use super::{Section, Target, short};
use crate::control::Law;
use crate::draw::chart::{Axis, Chart, Ramp, Stroke};
use crate::draw::map::MapDrawing;
use crate::error::Result;
use crate::geometry::Vector2;
use crate::study::observability::{Case, DEGENERATE, Geometry, ObservabilityMap, along, cases, geometries, ranked};
use crate::study::paper::ideal::{Ideal, Run};
use crate::world::World;

/// Colours of conditions: the logarithm to base ten from 0 to this.
const MOST_LOG: f64 = 4.0;

/// The section: maps of `paper-ideal` (towards home, and facing along x), cases, geometries, and the condition along the paths.
///
/// # Errors
/// When the world cannot be opened.
pub fn observability(ideal: &Ideal, runs: &[Run], homeward: &ObservabilityMap, east: &ObservabilityMap) -> Result<Section> {
    let world = World::open("paper-ideal")?;
    let landmarks: [Vector2<f64>; 3] = std::array::from_fn(|k| ideal.landmarks.get(k).copied().unwrap_or_default());
    let start = ideal.starts.get(1).map(|s| s.1).unwrap_or_default();
    let mut text = format!(
        "## Observability: the rank and condition of O\n\n`wayhome reproduce observability`; for any world `wayhome observability \
         WORLD`. O of (14) stacks the gradients of the bearings and of their rates at unit speed, so its rank is the number of \
         landmarks plus the rank of the block [J K P]. The printed J, K, P and Q are damaged; here they are derived anew, and a test \
         holds them against automatic differentiation of (4) with (3). The condition is that of [J K P] with R in units of the \
         landmarks' mean distance ({length:.2} m); above {limit:.0} it is degenerate in practice.\n\n{cases}\n\
         So rank six holds for a robot that moves, away from home, with no landmark straight ahead or behind, off the lines through home \
         and a landmark. Nothing in omega changes it: the gradients of the Lie derivatives along g2 are zero everywhere. Two bearing \
         sets without motion leave R, theta and alpha open. Close to home it is the bearing theta of a vanishing R that cannot be told; in \
         the plane the place can. On the lines through home and a landmark (3) divides by zero: parallax from home says nothing of \
         that landmark's range. This is O as the paper cuts it off, after first derivatives; what a whole path \
         tells, turns included, is what `wayhome bound` computes.\n\n![Condition, driving towards home](observability-homeward.svg)\n\n\
         Driving towards home, {share:.1} % of the room is degenerate in practice, median condition {median:.0}: at home and at the \
         landmarks. The lines through home and a landmark do not show: along them the rate of its bearing vanishes as fast as the \
         divisor. To any other heading they are walls, as the next map shows.\n\n![Condition, facing along x](observability-east.svg)\n\nFacing along x everywhere, {east_share:.1} % is degenerate: the lines \
         through home and a landmark, and a level one through each landmark, where it lies straight ahead or behind.\n\n![Condition along the paths](observability-paths.svg)\n\n{geometries}",
        length = homeward.length_m,
        limit = DEGENERATE,
        cases = cases_table(&cases(&landmarks, start)),
        share = 100.0 * homeward.degenerate_share(),
        median = homeward.condition_quantile(0.5),
        east_share = 100.0 * east.degenerate_share(),
        geometries = geometries_table(&geometries()),
    );
    text.push('\n');
    let figures = vec![
        ("observability-homeward.svg", map_svg(&world, homeward, "driving towards home").into_bytes()),
        ("observability-east.svg", map_svg(&world, east, "facing along x").into_bytes()),
        ("observability-paths.svg", paths_svg(runs, &ideal.landmarks).into_bytes()),
    ];
    Ok(Section { target: Target::Observability, markdown: text, figures })
}

/// A map as a table: one row a place; `inf` where the block is singular.
#[must_use]
pub fn map_csv(map: &ObservabilityMap) -> String {
    let mut text = "x_m,y_m,landmarks,rank,condition,best_condition,median_condition\n".to_owned();
    for p in &map.places {
        let (rank, median) = (p.landmarks + p.rank, p.median_condition);
        let _ = writeln!(text, "{},{},{},{rank},{},{},{median}", p.x_m, p.y_m, p.landmarks, p.condition, p.best_condition);
    }
    text
}

/// A world's map of the condition, for a robot that faces as `facing` says.
#[must_use]
pub fn map_svg(world: &World, map: &ObservabilityMap, facing: &str) -> String {
    let log = |condition: f64| if condition.is_nan() { MOST_LOG } else { libm::log10(condition.clamp(1.0, 1e30)) };
    let cells = map.places.iter().map(|p| (Vector2::new(p.x_m, p.y_m), log(p.condition)));
    MapDrawing::new(world)
        .title(format!("{}: condition of [J K P], {facing}", map.world))
        .field(cells, map.spacing_m, Ramp { low: 0.0, high: MOST_LOG }, "condition 1 to 10000, logarithmic")
        .to_svg()
}

/// A world's map in numbers, for a terminal.
#[must_use]
pub fn summary(map: &ObservabilityMap, facing: &str) -> String {
    let [q10, q50, q90] = [0.1, 0.5, 0.9].map(|share| short(map.condition_quantile(share)));
    let full = map.places.iter().filter(|p| p.rank == 3).count();
    let blind = map.places.iter().filter(|p| p.landmarks < 3).count();
    let best = ranked(map.places.iter().map(|p| p.best_condition), 0.5);
    format!(
        "{world}, {facing}, {n} places {spacing} m apart, {landmarks} landmarks seen from home\n  full rank                    {full} of {n}\n  \
         fewer than three landmarks   {blind} of {n}\n  condition, 10 / 50 / 90 %    {q10} / {q50} / {q90}\n  degenerate in practice       \
         {share:.1} % of places (condition above {DEGENERATE:.0})\n  best heading, median         {best}\n",
        world = map.world,
        n = map.places.len(),
        spacing = map.spacing_m,
        landmarks = map.home_landmarks,
        share = 100.0 * map.degenerate_share(),
        best = short(best),
    )
}

fn cases_table(cases: &[Case]) -> String {
    let mut text = "| case | rank of O | condition | condition with R theta for theta |\n|---|---:|---:|---:|\n".to_owned();
    for case in cases {
        let o = case.found;
        let _ = writeln!(
            text,
            "| {} | {} of {} | {} | {} |",
            case.name,
            o.rank,
            o.landmarks + 3,
            short(o.condition),
            short(o.condition_in_plane)
        );
    }
    text
}

fn geometries_table(geometries: &[Geometry]) -> String {
    let mut text = "Over landmark geometries, 400 random poses 0.3 to 1.2 m from home, any heading, R in metres:\n\n| landmarks | over an \
         arc of | at | median condition | degenerate |\n|---:|---:|---:|---:|---:|\n"
        .to_owned();
    for g in geometries {
        let _ = writeln!(
            text,
            "| {} | {:.0} deg | {} m | {} | {:.0} % |",
            g.count,
            g.arc_rad.to_degrees(),
            g.range_m,
            short(g.median),
            100.0 * g.degenerate_share
        );
    }
    text
}

fn paths_svg(runs: &[Run], landmarks: &[Vector2<f64>]) -> String {
    let chart = Chart::new(
        "Condition of [J K P] along the paths of Fig. 3",
        Axis::linear("time (s)"),
        Axis::log("condition").from(1.0).to(1e6),
    );
    let chart = runs.iter().fold(chart, |chart, run| {
        let k = run.start.bytes().last().map_or(0, |digit| usize::from(digit.saturating_sub(b'1')));
        let (stroke, law) = match run.law {
            Law::Proportional => (Stroke::series(k), "proportional"),
            Law::Lyapunov => (Stroke::series(k).dashed("3 3"), "nonlinear"),
        };
        let points = along(run, landmarks).into_iter().map(|[t, c]| [t, if c.is_finite() { c.min(1e6) } else { 1e6 }]);
        chart.line(points, &stroke, &format!("{}, {law}", run.start))
    });
    chart.to_svg()
}
