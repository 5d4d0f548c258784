//! Fig. 8: bar charts and the full table of times.

use std::fmt::Write;

use super::tables::{law_name, set_text};
use super::{Section, Target};
use crate::control::Law;
use crate::control::vectors::VectorLaw;
use crate::draw::chart::{BarSeries, Bars};
use crate::study::paper::STARTS;
use crate::study::paper::contest::{Contest, Entrant, Row, Source, Told};
use crate::study::paper::images::{ImageCase, ImageSet};

/// What a table calls a method.
pub(super) fn entrant_name(entrant: Entrant) -> &'static str {
    match entrant {
        Entrant::Paper(_) | Entrant::PaperUntold(_) => "the paper's EKF",
        Entrant::Anchored(_) => "anchored filter",
        Entrant::Vector(VectorLaw::Alv, ..) => "ALV",
        Entrant::Vector(VectorLaw::TronDaniilidis, ..) => "Tron-Daniilidis",
        Entrant::Vector(VectorLaw::Weber, ..) => "Weber",
        Entrant::Vector(VectorLaw::Ibvs, ..) => "IBVS",
    }
}

fn told_name(told: Told) -> &'static str {
    match told {
        Told::Start => "the true start",
        Told::Compass => "a perfect compass",
        Told::Nothing => "nothing",
    }
}

/// The bars of the drawing: as in the paper, and what belongs beside them.
const BARS: [(Entrant, &str); 8] = [
    (Entrant::Paper(Law::Proportional), "paper's EKF, proportional, told the true start"),
    (Entrant::Paper(Law::Lyapunov), "paper's EKF, nonlinear, told the true start"),
    (Entrant::Vector(VectorLaw::Ibvs, Law::Proportional, Told::Compass), "IBVS, proportional, compass"),
    (Entrant::Vector(VectorLaw::Alv, Law::Proportional, Told::Compass), "ALV, proportional, compass"),
    (Entrant::Vector(VectorLaw::Alv, Law::Lyapunov, Told::Compass), "ALV, nonlinear, compass"),
    (Entrant::Vector(VectorLaw::Alv, Law::Proportional, Told::Nothing), "ALV, proportional, told nothing"),
    (Entrant::Anchored(Law::Proportional), "anchored filter, proportional, told nothing"),
    (Entrant::PaperUntold(Law::Proportional), "paper's EKF, proportional, told nothing"),
];

/// Fig. 8: for each set its case, and the contests with bearings from images and from points.
#[must_use]
pub fn contest(sets: &[(&ImageCase, &[Contest; 2])]) -> Section {
    let mut text = "## Fig. 8: time home, beside other methods\n\n`wayhome reproduce fig8`: Ts = 10 ms, v = 10 cm/s, the starts of Table II \
         and of Fig. 7, until the robot is truly within 5 cm of home. All drive at the same speed under the same limit of the turn rate \
         (pi rad/s), steered by one of the paper's two laws; what each is told beside bearings and odometry is stated. The paper's \
         \"bearing only method [6]\" is IBVS with a constant range (Liu et al. 2010) and its \"ALV method [9]\" the average landmark \
         vector, as we read it: the reference list is not in the text. Without a compass the vector laws align the two sets of bearings \
         by their circular mean difference. The paper's text and Fig. 8 print no times to hold ours against, only the order: its own method is always \
         first.\n\n"
        .to_owned();
    let mut figures = Vec::new();
    for (case, contests) in sets {
        let (file, part) = match case.set {
            ImageSet::Paper => ("fig8a.svg", "8a"),
            ImageSet::Vardy => ("fig8b.svg", "8b"),
        };
        let _ = writeln!(text, "### Fig. {part}: {}\n\n![Times home](", set_text(case));
        text.truncate(text.trim_end().len());
        let _ = write!(text, "{file})\n\n");
        figures.push((file, bars(&contests[0], part).into_bytes()));
        text += &table(contests);
        text += &verdict(&contests[0]);
        text.push('\n');
    }
    Section { target: Target::Fig8, markdown: text.trim_end().to_owned() + "\n", figures }
}

fn bars(contest: &Contest, part: &str) -> String {
    let series = BARS.iter().map(|(entrant, label)| BarSeries {
        label: (*label).to_owned(),
        values: contest.row(*entrant).map_or(vec![None; 4], |row| row.times_s.to_vec()),
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

fn table(contests: &[Contest; 2]) -> String {
    let [images, points] = contests;
    debug_assert!(images.source == Source::Images && points.source == Source::Points);
    let mut text = "| method | law | told | objects | P1 (s) | P2 (s) | P3 (s) | P4 (s) | time ratio | with exact bearings |\n\
         |---|---|---|---:|---:|---:|---:|---:|---:|---:|\n"
        .to_owned();
    let straight = images.straight_s.map(|t| format!("{t:.2}")).join(" | ");
    let _ = writeln!(text, "| straight line | | | | {straight} | 1 | 1 |");
    for (row, exact) in images.rows.iter().zip(&points.rows) {
        let cell = |k: usize| {
            row.times_s[k].map_or_else(|| format!("ends {:.0} cm off", 100.0 * row.ends_m[k]), |t| format!("{t:.2}"))
        };
        let ratio = |row: &Row, contest: &Contest| {
            row.mean_ratio(&contest.straight_s)
                .map_or_else(|| format!("{} of 4 home", row.times_s.iter().flatten().count()), |r| format!("{r:.3}"))
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            entrant_name(row.entrant),
            law_name(row.entrant.law()),
            told_name(row.entrant.told()),
            row.objects,
            [0, 1, 2, 3].map(cell).join(" | "),
            ratio(row, images),
            ratio(exact, points),
        );
    }
    text.push('\n');
    text
}

/// What the order is, from the numbers.
fn verdict(contest: &Contest) -> String {
    let order = Order::of(contest);
    format!(
        "With the same law the paper's filter, told the true start, has a lower mean time than every vector law{astray} {by_law}, by {range} \
         of its own; start by start a vector law is faster in {beaten} of {pairs} pairs. Across laws it is not always first: \
         {across}. Told nothing, it does not come home. The anchored filter, told nothing, {anchored}.\n",
        astray = match order.astray {
            0 => String::new(),
            n => format!(" but {n} that do not come home from all four"),
        },
        by_law = if order.percent.is_none_or(|[least, _]| least >= 0.0) { "under either law" } else { "under one law only" },
        range = range(order.percent),
        beaten = order.beaten,
        pairs = order.pairs,
        across = if order.across == 0 {
            "but no vector law under the nonlinear law beats its proportional one in the mean".to_owned()
        } else {
            format!(
                "{} of the {} vector laws with a compass, steered by the nonlinear law, have a lower mean time than it has under the \
                 proportional one",
                order.across, order.compasses
            )
        },
        anchored = anchored(contest),
    )
}

/// How the anchored filter fares on three objects, and why where it fails.
fn anchored(contest: &Contest) -> String {
    let Some(row) = contest.row(Entrant::Anchored(Law::Proportional)) else { return "did not run".into() };
    match row.mean_ratio(&contest.straight_s) {
        Some(ratio) => {
            format!("comes home from all four in {ratio:.3} times the straight-line time under the proportional law")
        }
        None => format!(
            "comes home from {} of 4 under the proportional law and from the others stops elsewhere, sure to be home; with exact bearings it \
             does not. Most likely because interpolated bearings are wrong by much the same amount over half a metre, and a filter that takes \
             a hundred of them a second for independent grows too sure",
            row.times_s.iter().flatten().count()
        ),
    }
}

/// Two percentages.
pub(super) fn range(percent: Option<[f64; 2]>) -> String {
    percent.map_or_else(|| "- %".to_owned(), |[least, most]| format!("{least:.1} to {most:.1} %"))
}

/// The order of a contest in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Order {
    /// Least and most by which a vector law's mean time exceeds that of the paper's filter, told the start, under the same law,
    /// percent, of those that come home from all starts; none where none does.
    pub percent: Option<[f64; 2]>,
    /// Vector laws that do not.
    pub astray: usize,
    /// Pairs of a vector law and a start in which it is faster than the paper's filter under the same law, and how many pairs.
    pub beaten: usize,
    pub pairs: usize,
    /// Vector laws with a compass and the nonlinear law that have a lower mean time than the paper's filter under the proportional law,
    /// and how many there are.
    pub across: usize,
    pub compasses: usize,
}

impl Order {
    pub(super) fn of(contest: &Contest) -> Self {
        let mut order = Self { percent: None, astray: 0, beaten: 0, pairs: 0, across: 0, compasses: 0 };
        let ratio = |row: &Row| row.mean_ratio(&contest.straight_s).unwrap_or(f64::INFINITY);
        for row in contest.rows.iter().filter(|r| matches!(r.entrant, Entrant::Vector(..)) && r.objects == 3) {
            let law = row.entrant.law();
            let Some(paper) = contest.row(Entrant::Paper(law)) else { continue };
            let excess = 100.0 * (ratio(row) / ratio(paper) - 1.0);
            if excess.is_finite() {
                let [least, most] = order.percent.unwrap_or([excess; 2]);
                order.percent = Some([excess.min(least), excess.max(most)]);
            } else {
                order.astray += 1;
            }
            for (theirs, ours) in row.times_s.iter().zip(&paper.times_s) {
                order.pairs += 1;
                order.beaten += usize::from(theirs.unwrap_or(f64::INFINITY) < ours.unwrap_or(f64::INFINITY));
            }
            if law == Law::Lyapunov && row.entrant.told() == Told::Compass {
                let proportional = contest.row(Entrant::Paper(Law::Proportional));
                order.compasses += 1;
                order.across += usize::from(proportional.is_some_and(|p| ratio(row) < ratio(p)));
            }
        }
        order
    }
}
