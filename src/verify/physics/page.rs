//! The page on the physics: a chart for each closed form, the slip map, and the comparison with another engine.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::draw::chart::{Axis, Chart, HeatMap, Mark, Ramp, Stroke};
use crate::error::{Error, Result};
use crate::storage::OutputFolder;
use crate::verify::physics::{ClosedForm, SlipMap};

/// Names of all files of the page. [`OUTSIDE`] comes from outside and is kept as it is.
pub const FILES: &[&str] = &[
    "README.md",
    "sideways-stop.svg",
    "traction-limit.svg",
    "launch.svg",
    "yaw-braking.svg",
    "rolling-resistance.svg",
    "load-transfer.svg",
    "circle-grip.svg",
    "worn-tyre.svg",
    "carton.svg",
    "gyro.svg",
    "energy.svg",
    "convergence.svg",
    "slip-map.svg",
    OUTSIDE,
    "mujoco.svg",
    SPEED,
];

/// Trajectories of the same drives in another engine, written by `tests/outside/mujoco_planar.py`.
pub const OUTSIDE: &str = "mujoco.csv";

/// What the benchmark measured, written by `tests/outside/physics_speed.py`.
pub const SPEED: &str = "speed.csv";

/// All that the page shows.
#[derive(Debug, Clone)]
pub struct Findings {
    /// Closed forms with what was measured.
    pub closed_forms: Vec<ClosedForm>,
    /// Energy over time: (friction, curve).
    pub energy: Vec<(f64, Vec<[f64; 2]>)>,
    /// End error over substep, (s, m).
    pub convergence: Vec<[f64; 2]>,
    /// Odometry drift over friction and acceleration.
    pub slip_map: SlipMap,
    /// The text of [`OUTSIDE`] where the folder has one.
    pub outside: Option<String>,
    /// The text of [`SPEED`] where the folder has one.
    pub speed: Option<String>,
}

/// Writes the page and its drawings.
///
/// # Errors
/// When a file cannot be written, or the trajectories from outside are not what their script writes.
pub fn write(mut folder: OutputFolder, findings: &Findings) -> Result<()> {
    let outside = findings.outside.as_deref().map(OutsideDrives::parse).transpose()?;
    for form in &findings.closed_forms {
        let Some(name) = FILES.iter().find(|f| f.strip_suffix(".svg") == Some(form.name)) else { continue };
        folder.write(name, closed_form_svg(form).as_bytes())?;
    }
    folder.write("energy.svg", energy_svg(&findings.energy).as_bytes())?;
    folder.write("convergence.svg", convergence_svg(&findings.convergence).as_bytes())?;
    folder.write("slip-map.svg", slip_map_svg(&findings.slip_map).as_bytes())?;
    if let (Some(drives), Some(text)) = (&outside, &findings.outside) {
        folder.write(OUTSIDE, text.as_bytes())?;
        folder.write("mujoco.svg", drives.svg().as_bytes())?;
    }
    let speed = findings.speed.as_deref().map(Speed::parse).transpose()?;
    if let Some(text) = &findings.speed {
        folder.write(SPEED, text.as_bytes())?;
    }
    folder.write("README.md", page(findings, outside.as_ref(), speed.as_ref()).as_bytes())?;
    folder.finish()
}

fn closed_form_svg(form: &ClosedForm) -> String {
    let axis = |k: usize| if form.log[k] { Axis::log(form.axes[k]) } else { Axis::linear(form.axes[k]) };
    let mut chart = Chart::new(form.title, axis(0), axis(1));
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
    chart.note(form.equation).note(format!("greatest difference {}", percent(form.worst))).to_svg()
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

/// The same drives here and in another engine.
struct OutsideDrives {
    drives: Vec<OutsideDrive>,
}

struct OutsideDrive {
    name: String,
    /// Time; then x, y, heading here, here with wheels that hardly creep, and there.
    rows: Vec<[f64; 10]>,
}

impl OutsideDrives {
    fn parse(text: &str) -> Result<Self> {
        let fault = |line: usize| Error::Parse {
            path: OUTSIDE.into(),
            message: format!("line {line}: expected a name and ten numbers, as tests/outside/mujoco_planar.py writes them"),
        };
        let mut drives: Vec<OutsideDrive> = Vec::new();
        for (line, number) in text.lines().zip(1..).skip(1) {
            let (name, rest) = line.split_once(',').ok_or_else(|| fault(number))?;
            let cells: Vec<f64> = rest.split(',').map_while(|cell| cell.parse().ok()).collect();
            let row: [f64; 10] = cells.try_into().map_err(|_| fault(number))?;
            match drives.last_mut() {
                Some(drive) if drive.name == name => drive.rows.push(row),
                _ => drives.push(OutsideDrive { name: name.to_owned(), rows: vec![row] }),
            }
        }
        Ok(Self { drives })
    }

    fn svg(&self) -> String {
        let chart = Chart::new("The same drives here and in MuJoCo", Axis::linear("x (m)"), Axis::linear("y (m)"));
        let chart = self.drives.iter().enumerate().fold(chart, |chart, (k, drive)| {
            chart.line(drive.rows.iter().map(|r| [r[1], r[2]]), &Stroke::series(k), &drive.name)
        });
        let every = |rows: &[[f64; 10]]| (rows.len() / 16).max(1);
        self.drives
            .iter()
            .enumerate()
            .fold(chart, |chart, (k, drive)| {
                let points = drive.rows.iter().step_by(every(&drive.rows)).map(|r| [r[7], r[8]]);
                chart.points(points, &Mark { radius_px: 2.8, ..Mark::series(k) }, "")
            })
            .note("lines: wayhome")
            .note("points: MuJoCo")
            .to_svg()
    }

    fn table(&self) -> String {
        let mut text = "| drive | path, m | apart at the end, mm | at most, mm | heading, deg | with little creep: at the end, mm | at most, mm | heading, deg |\n\
            |---|---|---|---|---|---|---|---|\n"
            .to_owned();
        for drive in &self.drives {
            let Some(end) = drive.rows.last() else { continue };
            let length: f64 = drive.rows.windows(2).map(|w| libm::hypot(w[1][1] - w[0][1], w[1][2] - w[0][2])).sum();
            let _ = write!(text, "| {} | {length:.2} ", drive.name);
            for k in [1, 4] {
                let apart = |r: &[f64; 10]| 1e3 * libm::hypot(r[7] - r[k], r[8] - r[k + 1]);
                let most = drive.rows.iter().map(apart).fold(0.0, f64::max);
                let turn = (100.0 * crate::geometry::wrap(end[9] - end[k + 2]).to_degrees()).round() / 100.0 + 0.0; // no -0
                let _ = write!(text, "| {:.2} | {most:.2} | {turn:.2} ", apart(end));
            }
            text += "|\n";
        }
        text
    }
}

/// Nanoseconds that a substep takes in each benchmark, by name.
struct Speed(BTreeMap<String, f64>);

impl Speed {
    fn parse(text: &str) -> Result<Self> {
        let row = |(line, number): (&str, usize)| {
            let time = line.split_once(',').and_then(|(name, ns)| Some((name.to_owned(), ns.parse().ok()?)));
            time.ok_or_else(|| Error::Parse {
                path: SPEED.into(),
                message: format!("line {number}: expected a name and a number, as tests/outside/physics_speed.py writes them"),
            })
        };
        text.lines().zip(1..).skip(1).map(row).collect::<Result<_>>().map(Self)
    }

    fn table(&self) -> String {
        let mut text = "| scene | substeps a second and core | of the time rapier's |\n|---|---|---|\n".to_owned();
        let push = |group: &str| self.0.get(&format!("{group}/pushing a carton"));
        for (name, ns) in self.0.iter().filter(|(name, _)| !name.starts_with("rapier/pushing")) {
            let share = match (push("rapier"), name.as_str()) {
                (Some(rapier), "plant/pushing a carton") => format!("{:.0} %", 100.0 * rapier / ns),
                (_, "rapier/in every substep") => self
                    .0
                    .get("plant/open floor")
                    .map_or_else(String::new, |ours| format!("{:.0} %", 100.0 * (1.0 - ours / ns))),
                _ => "none".to_owned(),
            };
            let _ = writeln!(text, "| `{name}` | {} | {share} |", rounded(1e9 / ns));
        }
        text
    }
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

fn page(findings: &Findings, outside: Option<&OutsideDrives>, speed: Option<&Speed>) -> String {
    let mut text = format!(
        "# The physics against its closed forms\n\n\
        Made by `wayhome physics-report --out results/physics` with wayhome {}. Lines are equations, points are the plant of the\n\
        program at its substep of 1 ms. The same equations are tests in `tests/physics.rs` and `tests/physics_settings.rs`. Robot:\n\
        an iRobot Create 3 with equal wheels and, where the equation asks for it, its weight on the two wheels alone.\n\n\
        | what | equation | greatest difference | allowed by the tests |\n|---|---|---|---|\n",
        crate::VERSION
    );
    for form in &findings.closed_forms {
        let _ = writeln!(
            text,
            "| [{}](#{}) | `{}` | {} | {} % |",
            form.title,
            form.name,
            form.equation,
            percent(form.worst),
            100.0 * form.tolerance
        );
    }
    let rises = findings.energy.iter().flat_map(|(_, curve)| curve.windows(2)).filter(|w| w[1][1] > w[0][1] * (1.0 + 1e-14));
    let _ = write!(text, "| [Energy](#energy) | never rises | {} rises | none |\n\n", rises.count());
    for form in &findings.closed_forms {
        let _ = write!(
            text,
            "<a id=\"{}\"></a>\n## {}\n\n`{}`. {}\n\n![{}]({}.svg)\n\n",
            form.name, form.title, form.equation, form.story, form.title, form.name
        );
    }
    text += "<a id=\"energy\"></a>\n## Energy\n\nA robot thrown across the floor with wheels that spin the wrong way and no torque on them: friction takes energy from\n\
             body and wheels, and never gives any.\n\n![Energy](energy.svg)\n\n\
             ## Substep\n\nThe end of a tour of 5.5 s against that at a 64th of a millisecond. The error falls with the substep, as the implicit\n\
             first-order scheme promises; the program uses 1 ms.\n\n![Convergence](convergence.svg)\n\n\
             ## Slip map\n\nGreatest distance between the paths of odometry and truth on a tour of two legs of 3 s at up to 0.3 m/s with full stops and\n\
             a turn on the spot between them. Wheels are perfectly calibrated and encoders fine, so all of it is slip. Above the\n\
             dashed line a = mu g the wheels must spin and skid, by v^2/2 (1/(mu g) - 1/a) on a straight leg; below it only creep\n\
             is left, which grows as the acceleration nears the limit.\n\n![Slip map](slip-map.svg)\n";
    if let Some(drives) = outside {
        text += "\n## The same drives in MuJoCo\n\n";
        text += OUTSIDE_STORY;
        text += "\n\n";
        text += &drives.table();
        text += "\n![MuJoCo](mujoco.svg)\n";
    }
    if let Some(speed) = speed {
        text += "\n## Speed\n\n";
        text += SPEED_STORY;
        text += "\n\n";
        text += &speed.table();
    }
    text
}

/// What the benchmark does.
const SPEED_STORY: &str = "`cargo bench --bench physics`, then `tests/outside/physics_speed.py`: a robot with 4 walls, 10 standing and 5 moving bodies\n\
    around it, in substeps of 1 ms, by the core's own time (median). Rapier runs only where something can be pushed. Its share of\n\
    a push is what the same scene takes in rapier alone; `rapier/in every substep` is the open floor with rapier asked each\n\
    time, as it would be without a look around first. The machine is shared, and its numbers vary by a factor of two with its\n\
    other load.";

/// What `tests/outside/mujoco_planar.py` does, and why the paths differ.
const OUTSIDE_STORY: &str = "`tests/outside/mujoco_planar.py` drives the same Create 3 (equal wheels, no rolling resistance) through the same commands in\n\
    MuJoCo 4.0: a body with six degrees of freedom on two rolling spheres and a sliding one, elliptic friction cones, Newton\n\
    solver, a quarter of a millisecond a step. Motors and speed loop are the same equations, written twice; the contact is\n\
    MuJoCo's own. Friction is 0.75 (dry) and 0.04 (ice), where the commanded 0.9 m/s^2 are more than twice what the floor gives.\n\n\
    - MuJoCo's wheels grip almost without creep, ours creep by up to 1 cm/s at the friction limit, as rubber does. That is nearly\n\
      all of the difference on the dry floor: with a creep of 0.5 mm/s (right half of the table) a fraction of a millimetre is left.\n\
    - What is left on ice, 4 mm after a skid through two curves, is where the two solvers divide friction between the contacts\n\
      while everything slides: MuJoCo regularises it by `impratio`, here 100; with 1000 and steps of 0.1 ms it is 3.2 mm.\n\
    - Starting and stopping on ice, where the whole drive is a skid, agrees to a tenth of a millimetre.";
