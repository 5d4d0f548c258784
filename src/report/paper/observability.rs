//! The observability section, and the table and drawing for any world.

use super::{Section, Target, short};
use crate::control::Law;
use crate::draw::chart::{Axis, Chart, Ramp, Stroke};
use crate::draw::map::MapDrawing;
use crate::draw::markdown::table_of_numbers;
use crate::error::Result;
use crate::estimation::observability::Observability;
use crate::geometry::Vector2;
use crate::study::observability::{DEGENERATE, Geometry, ObservabilityMap, cases, geometries, ranked};
use crate::study::paper::course::Run;
use crate::study::paper::evidence::Evidence;
use crate::study::paper::ideal::Ideal;
use crate::study::paper::{STARTS, law_name};
use crate::world::World;

/// Colours of conditions: the logarithm to base ten from 0 to this.
const MOST_LOG: f64 = 4.0;

/// The section: maps of `paper-ideal` (towards home, and facing along x), cases, geometries, and the condition along the paths.
pub(super) fn observability(evidence: &Evidence) -> Result<Section> {
    let (ideal, homeward, east) = (&evidence.ideal, evidence.homeward()?, evidence.east()?);
    let landmarks: [Vector2<f64>; 3] = std::array::from_fn(|k| ideal.landmarks.get(k).copied().unwrap_or_default());
    let start = ideal.starts.get(1).map(|s| s.1).unwrap_or_default();
    let case = |(name, found): (&str, Observability)| {
        let rank = format!("{} of {}", found.rank, found.landmarks + 3);
        [name.to_owned(), rank, short(found.condition), short(found.condition_in_plane)]
    };
    let geometry = |g: Geometry| {
        let (arc, range) = (format!("{:.0} deg", g.arc_rad.to_degrees()), format!("{} m", g.range_m));
        [g.count.to_string(), arc, range, short(g.median), format!("{:.0} %", 100.0 * g.degenerate_share)]
    };
    let text = format!(
        include_str!("observability.md"),
        length = homeward.length_m,
        limit = DEGENERATE,
        cases = table_of_numbers(
            "case | rank of O | condition | condition with R theta for theta",
            1,
            cases(&landmarks, start).into_iter().map(case)
        ),
        share = 100.0 * homeward.degenerate_share(),
        median = homeward.condition_quantile(0.5),
        east = 100.0 * east.degenerate_share(),
        geometries = table_of_numbers(
            "landmarks | over an arc of | at | median condition | degenerate",
            0,
            geometries().into_iter().map(geometry)
        ),
    );
    let homeward = map_svg(&evidence.world, homeward, "driving towards home");
    let drawings = [homeward, map_svg(&evidence.world, &east, "facing along x"), paths_svg(evidence.table_one()?, ideal)];
    Ok(Section::new(Target::Observability, text, drawings.map(String::into_bytes)))
}

/// A map as a table: one row a place; `inf` where the block is singular.
pub fn map_csv(map: &ObservabilityMap) -> String {
    let mut text = "x_m,y_m,landmarks,rank,condition,best_condition,median_condition\n".to_owned();
    for p in &map.places {
        let (rank, median) = (p.landmarks + p.rank, p.median_condition);
        text += &format!("{},{},{},{rank},{},{},{median}\n", p.x_m, p.y_m, p.landmarks, p.condition, p.best_condition);
    }
    text
}

/// A world's map of the condition, for a robot that faces as `facing` says.
pub fn map_svg(world: &World, map: &ObservabilityMap, facing: &str) -> String {
    let log = |condition: f64| if condition.is_nan() { MOST_LOG } else { libm::log10(condition.clamp(1.0, 1e30)) };
    let cells = map.places.iter().map(|p| (Vector2::new(p.x_m, p.y_m), log(p.condition)));
    MapDrawing::new(world)
        .title(format!("{}: condition of [J K P], {facing}", map.world))
        .field(cells, map.spacing_m, Ramp { low: 0.0, high: MOST_LOG }, "condition 1 to 10000, logarithmic")
        .to_svg()
}

/// A world's map in numbers, for a terminal.
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

fn paths_svg(runs: &[Run], ideal: &Ideal) -> String {
    let y = Axis::log("condition").from(1.0).to(1e6);
    let mut chart = Chart::new("Condition of [J K P] along the paths of Fig. 3", Axis::linear("time (s)"), y);
    for run in runs {
        let k = STARTS.iter().position(|start| *start == run.start).unwrap_or(0);
        let stroke = match run.law {
            Law::Proportional => Stroke::series(k),
            Law::Lyapunov => Stroke::series(k).dashed("3 3"),
        };
        let points = ideal.conditions(&run.track).into_iter().map(|[t, c]| [t, if c.is_finite() { c.min(1e6) } else { 1e6 }]);
        chart = chart.line(points, &stroke, &format!("{}, {}", run.start, law_name(run.law)));
    }
    chart.to_svg()
}
