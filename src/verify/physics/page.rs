//! The page on the physics: a chart for each closed form, the slip map, and the comparison with another engine.

use super::{ClosedForm, SlipMap, Validation};
use crate::draw::chart::{Axis, Chart, HeatMap, Mark, Ramp, Stroke};
use crate::draw::markdown::table;
use crate::error::Result;
use crate::storage::OutputFolder;
use crate::verify::outside;

/// Trajectories of the same drives in another engine.
const DRIVES: &str = "mujoco.csv";
/// What the benchmark measured.
const SPEED: &str = "speed.csv";
/// What others put into the folder.
pub const OUTSIDE: &[&str] = &[DRIVES, SPEED];

/// Writes the page and its drawings. What another engine made of the same drives and what the benchmark measured is shown if it
/// lies in the folder.
///
/// # Errors
/// When a file cannot be written, or a table from outside is not what its script writes.
pub fn write(mut folder: OutputFolder, found: &Validation) -> Result<()> {
    let drives = outside::keep(&mut folder, DRIVES, "tests/outside/mujoco_planar.py")?.map(drives);
    let speeds = outside::keep(&mut folder, SPEED, "tests/outside/physics_speed.py")?;
    for form in &found.closed_forms {
        folder.write(&format!("{}.svg", form.name), closed_form_svg(form).as_bytes())?;
    }
    folder.write("energy.svg", energy_svg(&found.energy).as_bytes())?;
    folder.write("convergence.svg", convergence_svg(&found.convergence).as_bytes())?;
    folder.write("slip-map.svg", slip_map_svg(&found.slip_map).as_bytes())?;
    if let Some(drives) = &drives {
        folder.write("mujoco.svg", drives_svg(drives).as_bytes())?;
    }
    folder.write("README.md", page(found, drives.as_deref(), speeds.as_deref()).as_bytes())?;
    folder.finish()
}

/// The greatest differences, for a terminal.
pub fn text(found: &Validation) -> String {
    let line = |form: &ClosedForm| {
        let (difference, allowed) = (100.0 * form.greatest_difference(), 100.0 * form.tolerance);
        format!("{:20} {:44} off by {difference:9.5} % at most, {allowed} % allowed\n", form.name, form.equation)
    };
    found.closed_forms.iter().map(line).collect()
}

fn closed_form_svg(form: &ClosedForm) -> String {
    let [x, y] = form.axes.map(Axis::linear);
    let mut chart = Chart::new(form.title, x, y);
    let many = form.curves.len() > 1;
    for (k, curve) in form.curves.iter().enumerate() {
        let stroke = if many { Stroke::series(k) } else { Stroke::EXACT };
        let label = if many { format!("exact, {}", curve.label) } else { "exact".to_owned() };
        chart = chart.line(curve.exact.iter().copied(), &stroke, &label);
    }
    for (k, curve) in form.curves.iter().enumerate() {
        let mark = if many { Mark::series(k) } else { Mark::MEASURED };
        chart = chart.points(curve.measured.iter().copied(), &mark, &format!("measured, {}", curve.label));
    }
    chart.note(form.equation).note(format!("greatest difference {}", percent(form.greatest_difference()))).to_svg()
}

fn energy_svg(curves: &[(f64, Vec<[f64; 2]>)]) -> String {
    let chart = Chart::new(
        "Energy of a robot thrown across the floor",
        Axis::linear("time (s)"),
        Axis::linear("energy / energy at the start").from(0.0),
    );
    curves
        .iter()
        .enumerate()
        .fold(chart, |chart, (k, (mu, curve))| {
            chart.line(curve.iter().step_by(10).copied(), &Stroke::series(k), &format!("mu = {mu}"))
        })
        .note("wheels free, no torque: it never rises")
        .to_svg()
}

fn convergence_svg(points: &[[f64; 2]]) -> String {
    let anchor = points.get(2).copied().unwrap_or([1e-3, 1e-3]);
    let slope = points.iter().map(|p| [p[0] * 1e3, 1e6 * anchor[1] * p[0] / anchor[0]]);
    Chart::new("A shorter substep converges", Axis::log("substep (ms)"), Axis::log("error of the end of a tour (\u{b5}m)"))
        .line(slope, &Stroke::BOUND, "first order")
        .points(points.iter().map(|p| [p[0] * 1e3, 1e6 * p[1]]), &Mark::MEASURED, "to the end at 1/64 ms")
        .to_svg()
}

fn slip_map_svg(map: &SlipMap) -> String {
    let values: Vec<Vec<f64>> = map.drift_m.iter().map(|row| row.iter().map(|d| 100.0 * d).collect()).collect();
    let high = values.iter().flatten().copied().fold(0.0, f64::max);
    let limit = map.friction.iter().map(|mu| [*mu, mu * 9.81]);
    Chart::new(
        "Slip map: greatest distance between odometry and truth",
        Axis::log("friction mu"),
        Axis::log("commanded acceleration (m/s\u{b2})"),
    )
    .heat(HeatMap {
        x: map.friction.clone(),
        y: map.acceleration_m_s2.clone(),
        values,
        ramp: Ramp { low: 0.0, high },
        label: "distance (cm)".into(),
        decimals: 1,
    })
    .line(limit, &Stroke { colour: "#0072b2", width_px: 2.0, dashes: "6 4" }, "a = mu g")
    .note("two legs of 3 s, full stops, a turn on the spot")
    .to_svg()
}

/// A drive here and in another engine.
struct Drive {
    name: String,
    /// Time; then x, y, heading here, here with wheels that hardly creep, and there.
    rows: Vec<[f64; 10]>,
}

/// The rows of the table by drive.
fn drives(table: Vec<(String, [f64; 10])>) -> Vec<Drive> {
    let mut drives: Vec<Drive> = Vec::new();
    for (name, row) in table {
        match drives.last_mut() {
            Some(drive) if drive.name == name => drive.rows.push(row),
            _ => drives.push(Drive { name, rows: vec![row] }),
        }
    }
    drives
}

fn drives_svg(drives: &[Drive]) -> String {
    let mut chart = Chart::new("The same drives here and in MuJoCo", Axis::linear("x (m)"), Axis::linear("y (m)"));
    for (k, drive) in drives.iter().enumerate() {
        chart = chart.line(drive.rows.iter().map(|r| [r[1], r[2]]), &Stroke::series(k), &drive.name);
    }
    for (k, drive) in drives.iter().enumerate() {
        let points = drive.rows.iter().step_by((drive.rows.len() / 16).max(1)).map(|r| [r[7], r[8]]);
        chart = chart.points(points, &Mark { radius_px: 2.8, ..Mark::series(k) }, "");
    }
    chart.note("lines: wayhome").note("points: MuJoCo").to_svg()
}

fn drives_table(drives: &[Drive]) -> String {
    let row = |drive: &Drive| {
        let end = drive.rows.last()?;
        let length: f64 = drive.rows.windows(2).map(|w| libm::hypot(w[1][1] - w[0][1], w[1][2] - w[0][2])).sum();
        let mut row = vec![drive.name.clone(), format!("{length:.2}")];
        for k in [1, 4] {
            let apart = |r: &[f64; 10]| 1e3 * libm::hypot(r[7] - r[k], r[8] - r[k + 1]);
            let most = drive.rows.iter().map(apart).fold(0.0, f64::max);
            let turn = (100.0 * crate::geometry::wrap(end[9] - end[k + 2]).to_degrees()).round() / 100.0 + 0.0; // no -0
            row.extend([apart(end), most, turn].map(|value| format!("{value:.2}")));
        }
        Some(row)
    };
    let columns = "drive | path, m | apart at the end, mm | at most, mm | heading, deg | with little creep: at the end, mm | at most, mm | heading, deg";
    table(columns, drives.iter().filter_map(row))
}

/// The table of what each benchmark takes for a substep, ns.
fn speed_table(speeds: &[(String, f64)]) -> String {
    let time = |name: &str| speeds.iter().find(|(other, _)| other == name).map(|(_, ns)| *ns);
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let row = |(name, ns): &(String, f64)| {
        let share = match (time("rapier/pushing a carton"), name.as_str()) {
            (Some(rapier), "plant/pushing a carton") => percent(rapier / ns),
            (_, "rapier/in every substep") => {
                time("plant/open floor").map_or_else(String::new, |ours| percent(1.0 - ours / ns))
            }
            _ => "none".to_owned(),
        };
        [format!("`{name}`"), rounded(1e9 / ns), share]
    };
    let mut shown: Vec<_> = speeds.iter().filter(|(name, _)| !name.starts_with("rapier/pushing")).collect();
    shown.sort_by(|a, b| a.0.cmp(&b.0));
    table("scene | substeps a second and core | of the time rapier's", shown.into_iter().map(row))
}

/// A large number, to two digits or so.
fn rounded(value: f64) -> String {
    if value >= 1e6 { format!("{:.1} million", value / 1e6) } else { format!("{:.0} 000", (value / 1e4).round() * 10.0) }
}

fn percent(share: f64) -> String {
    match 100.0 * share {
        small if small < 1e-4 => "below 0.0001 %".to_owned(),
        small if small < 0.1 => format!("{small:.4} %"),
        large => format!("{large:.2} %"),
    }
}

fn page(found: &Validation, drives: Option<&[Drive]>, speeds: Option<&[(String, f64)]>) -> String {
    let rises = found.energy.iter().flat_map(|(_, curve)| curve.windows(2)).filter(|w| w[1][1] > w[0][1] * (1.0 + 1e-14));
    let energy = ["[Energy](#energy)".into(), "never rises".into(), format!("{} rises", rises.count()), "none".into()];
    let rows = found.closed_forms.iter().map(|form| {
        let title = format!("[{}](#{})", form.title, form.name);
        let allowed = format!("{} %", 100.0 * form.tolerance);
        [title, format!("`{}`", form.equation), percent(form.greatest_difference()), allowed]
    });
    let form = |ClosedForm { name, title, equation, story, .. }: &ClosedForm| {
        format!("<a id=\"{name}\"></a>\n## {title}\n\n`{equation}`. {story}\n\n![{title}]({name}.svg)\n\n")
    };
    format!(
        include_str!("page.md"),
        version = crate::VERSION,
        table = table("what | equation | greatest difference | allowed by the tests", rows.chain([energy])),
        forms = found.closed_forms.iter().map(form).collect::<String>(),
        mujoco = drives.map_or_else(String::new, |drives| format!(include_str!("mujoco.md"), table = drives_table(drives))),
        speed = speeds.map_or_else(String::new, |speeds| format!(include_str!("speed.md"), table = speed_table(speeds))),
    )
}
