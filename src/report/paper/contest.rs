//! Fig. 8: bar charts and the full table of times.

use super::tables::set_text;
use super::{Section, Target};
use crate::control::Law;
use crate::draw::chart::{BarSeries, Bars};
use crate::draw::markdown::table_of_numbers;
use crate::error::Result;
use crate::method::MethodKind;
use crate::study::paper::contest::{Contest, Row, Told};
use crate::study::paper::evidence::Evidence;
use crate::study::paper::images::ImageSet;
use crate::study::paper::{LAWS, STARTS, law_name};

/// What a table calls a method.
fn method_name(method: &MethodKind) -> &'static str {
    match method {
        MethodKind::PaperEkf => "the paper's EKF",
        MethodKind::AnchoredEkf => "anchored filter",
        MethodKind::Alv => "ALV",
        MethodKind::TronDaniilidis => "Tron-Daniilidis",
        MethodKind::Weber => "Weber",
        MethodKind::Ibvs => "IBVS",
        MethodKind::Exec(_) => method.name(),
    }
}

/// The bars of the drawing: as in the paper, and what belongs beside them.
const BARS: [(MethodKind, Law, Told, &str); 8] = [
    (MethodKind::PaperEkf, Law::Proportional, Told::Start, "paper's EKF, proportional, told the true start"),
    (MethodKind::PaperEkf, Law::Lyapunov, Told::Start, "paper's EKF, nonlinear, told the true start"),
    (MethodKind::Ibvs, Law::Proportional, Told::Compass, "IBVS, proportional, compass"),
    (MethodKind::Alv, Law::Proportional, Told::Compass, "ALV, proportional, compass"),
    (MethodKind::Alv, Law::Lyapunov, Told::Compass, "ALV, nonlinear, compass"),
    (MethodKind::Alv, Law::Proportional, Told::Nothing, "ALV, proportional, told nothing"),
    (MethodKind::AnchoredEkf, Law::Proportional, Told::Nothing, "anchored filter, proportional, told nothing"),
    (MethodKind::PaperEkf, Law::Proportional, Told::Nothing, "paper's EKF, proportional, told nothing"),
];

/// Fig. 8: a chart and a table for each set of images.
pub(super) fn fig_eight(evidence: &Evidence) -> Result<Section> {
    let (mut parts, mut charts) = (Vec::new(), Vec::new());
    for (set, part) in ImageSet::ALL.into_iter().zip(["8a", "8b"]) {
        let set = evidence.set(set)?;
        let contests @ [images, _] = set.contests()?;
        charts.push(bars(images, part).into_bytes());
        parts.push(format!(
            "### Fig. {part}: {}\n\n![Times home](fig{part}.svg)\n\n{}\n{}",
            set_text(&set.case),
            table(contests),
            verdict(images)
        ));
    }
    Ok(Section::new(Target::Fig8, format!(include_str!("fig8.md"), parts = parts.join("\n\n")), charts))
}

fn bars(contest: &Contest, part: &str) -> String {
    let series = BARS.iter().map(|(method, law, told, label)| BarSeries {
        label: (*label).to_owned(),
        values: contest.row(method, *law, *told).map_or(vec![None; 4], |row| row.times_s.to_vec()),
    });
    // A robot that comes by home after half a minute of wandering is not what the chart compares.
    Bars {
        title: format!("Fig. {part}: time home, bearings from images"),
        axis: "time to 5 cm from home (s)".into(),
        groups: STARTS.map(str::to_owned).to_vec(),
        series: series.collect(),
        bound: ("straight line at this speed".into(), contest.straight_s.to_vec()),
        note: "a cross: did not come home".into(),
    }
    .to_svg()
}

/// All methods with bearings from images, and their ratio with those of points.
fn table([images, points]: &[Contest; 2]) -> String {
    let ratio = |row: &Row| row.mean_ratio.map_or_else(|| format!("{} of 4 home", row.home()), |r| format!("{r:.3}"));
    let straight = images.straight_s.map(|t| format!("{t:.2}"));
    let head = ["straight line", "", "", ""].map(str::to_owned);
    let mut rows = vec![[&head[..], &straight, &["1".to_owned(), "1".to_owned()]].concat()];
    rows.extend(images.rows.iter().zip(&points.rows).map(|(row, exact)| {
        let ended =
            row.times_s.iter().zip(row.ends_m).map(|(time_s, end_m)| {
                time_s.map_or_else(|| format!("ends {:.0} cm off", 100.0 * end_m), |t| format!("{t:.2}"))
            });
        let words = [method_name(&row.entrant.method), law_name(row.entrant.law), row.entrant.told.into()];
        let mut cells = words.map(str::to_owned).to_vec();
        cells.push(row.objects.to_string());
        cells.extend(ended);
        cells.extend([ratio(row), ratio(exact)]);
        cells
    }));
    let columns = "method | law | told | objects | P1 (s) | P2 (s) | P3 (s) | P4 (s) | time ratio | with exact bearings";
    table_of_numbers(columns, 3, rows)
}

/// What the order is, from the numbers.
fn verdict(contest: &Contest) -> String {
    let order = Order::of(contest);
    let astray = match order.astray {
        0 => String::new(),
        n => format!(" but {n} that do not come home from all four"),
    };
    let by_law = if order.percent.is_none_or(|[least, _]| least >= 0.0) { "under either law" } else { "under one law only" };
    let across = match order.across {
        0 => "but no vector law under the nonlinear law beats its proportional one in the mean".to_owned(),
        n => format!(
            "{n} of the {} vector laws with a compass, steered by the nonlinear law, have a lower mean time than it has under the \
             proportional one",
            order.compasses
        ),
    };
    // How the anchored filter fares on three objects, and why where it fails.
    let anchored = match contest.row(&MethodKind::AnchoredEkf, Law::Proportional, Told::Nothing) {
        None => "did not run".into(),
        Some(Row { mean_ratio: Some(ratio), .. }) => {
            format!("comes home from all four in {ratio:.3} times the straight-line time under the proportional law")
        }
        Some(row) => format!(
            "comes home from {} of 4 under the proportional law and from the others stops elsewhere, sure to be home; with exact bearings it \
             does not. Most likely because interpolated bearings are wrong by much the same amount over half a metre, and a filter that takes \
             a hundred of them a second for independent grows too sure",
            row.home()
        ),
    };
    format!(
        "With the same law the paper's filter, told the true start, has a lower mean time than every vector law{astray} {by_law}, by {range} \
         of its own; start by start a vector law is faster in {beaten} pairs. Across laws it is not always first: {across}. Told \
         nothing, it comes home from {untold} of 4 starts. The anchored filter, told nothing, {anchored}.",
        range = range(order.percent),
        beaten = order.beaten(),
        untold = untold_home(contest, &MethodKind::PaperEkf),
    )
}

/// From how many starts a method that is told nothing comes home under each law.
pub(super) fn untold_home(contest: &Contest, method: &MethodKind) -> String {
    LAWS.map(|law| contest.row(method, law, Told::Nothing).map_or(0, Row::home).to_string()).join(" and ")
}

/// Two percentages.
pub(super) fn range(percent: Option<[f64; 2]>) -> String {
    percent.map_or_else(|| "- %".to_owned(), |[least, most]| format!("{least:.1} to {most:.1} %"))
}

/// The order of a contest in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Order {
    /// Least and most by which a vector law's mean time exceeds that of the paper's filter, told the start, under the same law,
    /// percent, of those that come home from all starts; none where none does.
    pub percent: Option<[f64; 2]>,
    /// Vector laws that do not.
    astray: usize,
    /// Of all pairs of a vector law and a start those in which it is faster than the paper's filter under the same law.
    faster: usize,
    pairs: usize,
    /// Vector laws with a compass and the nonlinear law that have a lower mean time than the paper's filter under the proportional law,
    /// and how many there are.
    pub across: usize,
    pub compasses: usize,
}

impl Order {
    pub(super) fn of(contest: &Contest) -> Self {
        let mut order = Self::default();
        let time = |value: Option<f64>| value.unwrap_or(f64::INFINITY);
        let paper = |law| contest.row(&MethodKind::PaperEkf, law, Told::Start);
        for row in contest.rows.iter().filter(|r| r.entrant.is_vector() && r.objects == 3) {
            let (Some(same), Some(proportional)) = (paper(row.entrant.law), paper(Law::Proportional)) else { continue };
            let excess = 100.0 * (time(row.mean_ratio) / time(same.mean_ratio) - 1.0);
            if excess.is_finite() {
                let [least, most] = order.percent.unwrap_or([excess; 2]);
                order.percent = Some([excess.min(least), excess.max(most)]);
            } else {
                order.astray += 1;
            }
            order.pairs += row.times_s.len();
            order.faster += row.times_s.iter().zip(same.times_s).filter(|(theirs, ours)| time(**theirs) < time(*ours)).count();
            if row.entrant.law == Law::Lyapunov && row.entrant.told == Told::Compass {
                order.compasses += 1;
                order.across += usize::from(time(row.mean_ratio) < time(proportional.mean_ratio));
            }
        }
        order
    }

    /// In how many pairs a vector law is faster: "10 of 64".
    pub(super) fn beaten(&self) -> String {
        format!("{} of {}", self.faster, self.pairs)
    }
}
