//! Which figures a study has, and its tables.

use super::heat::{Cell, heat};
use crate::report::curves::{Curve, Unit, WIDTH_PX, curves, document};
use crate::statistics::Paired;
use crate::storage::csv::{Columns, csv_with, number};
use crate::study::row::Ending;
use crate::study::sweep::duels::{Duel, Scale, duels};
use crate::study::sweep::{Design, Row, Study};
use crate::study::tally::Tally;

/// A figure: what its file is called, what it shows, and the drawing.
pub(super) struct Figure {
    pub name: String,
    pub section: Section,
    pub svg: String,
}

/// What stands in a heat map at some levels.
type CellAt<'a> = dyn Fn(&[(&Scale, usize)]) -> Option<Cell> + 'a;

/// Parts of the page that have figures.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Section {
    Success,
    Curves,
    Pairs,
}

/// What the figures and tables are made of.
pub(super) struct Sums<'a> {
    pub study: &'a Study,
    pub rows: &'a [Row],
    /// The compared axis.
    pub compared: Option<Scale>,
    /// The other ones.
    pub others: Vec<Scale>,
    pub duels: Vec<Duel>,
}

impl<'a> Sums<'a> {
    pub fn new(study: &'a Study, rows: &'a [Row]) -> Self {
        let compared = study.compared();
        let others = (0..study.axes.len()).filter(|axis| Some(*axis) != compared).map(|axis| Scale::of(study, axis)).collect();
        Self { study, rows, compared: compared.map(|axis| Scale::of(study, axis)), others, duels: duels(study, rows) }
    }

    /// Names of the compared levels; one without a name where nothing is compared.
    pub fn names(&self) -> Vec<String> {
        self.compared.as_ref().map_or_else(|| vec![String::new()], |scale| scale.levels.clone())
    }

    /// The rows at these levels of these scales.
    fn at<'s>(&'s self, places: &'s [(&'s Scale, usize)]) -> impl Iterator<Item = &'s Row> + Clone {
        self.rows.iter().filter(move |row| places.iter().all(|(scale, level)| scale.level(self.study, row) == Some(*level)))
    }

    fn tally(&self, level: usize, places: &[(&Scale, usize)]) -> Tally {
        let mut places = places.to_vec();
        if let Some(scale) = &self.compared {
            places.push((scale, level));
        }
        Tally::of(self.at(&places).map(|row| &row.run))
    }

    /// The axes of the heat maps: the second of the others over the first, or the first alone.
    fn plane(&self) -> Option<(&Scale, Option<&Scale>)> {
        match &self.others[..] {
            _ if self.is_one_at_a_time() => None,
            [] => None,
            [x] => Some((x, None)),
            [y, x, ..] => Some((x, Some(y))),
        }
    }

    pub fn figures(&self) -> Vec<Figure> {
        let mut figures = Vec::new();
        let names = self.names();
        if let Some((x, y)) = self.plane() {
            let grid = |cell: &CellAt| -> Vec<Vec<Option<Cell>>> {
                let rows = y.map_or(1, |y| y.levels.len());
                let place = |row: usize, column: usize| {
                    let mut place = vec![(x, column)];
                    place.extend(y.map(|y| (y, row)));
                    place
                };
                (0..rows).map(|row| (0..x.levels.len()).map(|column| cell(&place(row, column))).collect()).collect()
            };
            for (level, name) in names.iter().enumerate() {
                let cells = grid(&|place| success_cell(&self.tally(level, place)));
                let title = if name.is_empty() { "runs that come home" } else { name };
                let key = ["none come home", "half", "all come home"];
                figures.push(Figure {
                    name: file_name("success", &[name]),
                    section: Section::Success,
                    svg: heat(title, x, y, &cells, key),
                });
            }
            // The first of the compared ones against each other one.
            for duel in self.duels.iter().filter(|duel| duel.levels[0] == 0) {
                let [a, b] = duel.levels.map(|level| names[level].as_str());
                let cells = grid(&|place| self.duel_cell(duel, place, [a, b]));
                let key = ["more with the second", "equal", "more with the first"];
                figures.push(Figure {
                    name: file_name("difference", &[a, b]),
                    section: Section::Pairs,
                    svg: heat(&format!("{a} against {b}"), x, y, &cells, key),
                });
            }
        }
        for scale in &self.others {
            let curve = |point: fn(&Tally) -> Option<[f64; 3]>| -> Vec<Curve> {
                let points = |level| (0..scale.levels.len()).map(|k| point(&self.tally(level, &[(scale, k)]))).collect();
                names.iter().enumerate().map(|(level, name)| Curve { label: name.clone(), points: points(level) }).collect()
            };
            let setting = &self.study.axes[scale.axis].setting;
            let success = curve(|t| (t.runs > 0).then(|| [t.home_share_95[0], t.home_share, t.home_share_95[1]]));
            let mut add = |kind: &str, title: &str, unit: Unit, lines: &[Curve]| {
                let (drawing, height) = curves(title, (&scale.label, &scale.levels), unit, lines);
                let svg = document([WIDTH_PX, height]).add(drawing).to_string() + "\n";
                figures.push(Figure { name: file_name(kind, &[setting]), section: Section::Curves, svg });
            };
            add("success-by", "Runs that come home, 95 % Wilson", Unit::Percent, &success);
            let ratio = curve(|t| {
                let [low, high] = t.time_ratio.quartiles;
                Some([low?, t.time_ratio.median?, high?])
            });
            add("time-ratio-by", "Time over straight-line time, quartiles", Unit::Ratio, &ratio);
        }
        figures
    }

    fn duel_cell(&self, duel: &Duel, places: &[(&Scale, usize)], [a, b]: [&str; 2]) -> Option<Cell> {
        let pairs = self.pairs_at(duel, places);
        (pairs.trials() > 0).then(|| {
            let [low, high] = pairs.difference_95();
            let points = |share: f64| format!("{:+.0}", 100.0 * share + 0.0).replace('-', "\u{2212}");
            Cell {
                colour: 0.5 + 0.5 * pairs.difference(),
                number: if pairs.difference() == 0.0 { "0".into() } else { points(pairs.difference()) },
                interval: format!("{}\u{2026}{}", points(low), points(high)),
                told: format!(
                    "of {} pairs both came home in {}, only {a} in {}, only {b} in {}, neither in {}",
                    pairs.trials(),
                    pairs.both,
                    pairs.only_first,
                    pairs.only_second,
                    pairs.neither
                ),
                framed: low > 0.0 || high < 0.0,
            }
        })
    }

    fn pairs_at(&self, duel: &Duel, places: &[(&Scale, usize)]) -> Paired {
        // A cell of the first compared level stands for the pairs that it is part of.
        let mut cells = std::collections::BTreeSet::new();
        let first = self.compared.as_ref().map(|scale| (scale, 0));
        let places: Vec<(&Scale, usize)> = places.iter().copied().chain(first).collect();
        cells.extend(self.at(&places).map(|row| row.cell));
        duel.within(|cell| cells.contains(&cell))
    }

    /// One row a cell of the study's grid: the listed levels and, of sampled axes, their classes.
    pub fn cells_csv(&self) -> String {
        let scales: Vec<&Scale> = self.tabled().into_iter().chain(&self.compared).collect();
        let row = |places: Vec<(&Scale, usize)>| {
            let tally = Tally::of(self.at(&places).map(|row| &row.run));
            (labels(&scales, &places), tally)
        };
        let rows: Vec<_> = self.places(self.compared.as_ref()).into_iter().map(row).collect();
        csv_with(&self.settings(&scales), CELLS, &rows)
    }

    /// One row for every two of the compared ones and cell, and one for all cells together.
    pub fn pairs_csv(&self) -> String {
        let (scales, names) = (self.tabled(), self.names());
        let mut rows = Vec::new();
        for duel in &self.duels {
            let mut add = |levels: Vec<String>, pairs: Paired, interval: [f64; 2]| {
                let two = duel.levels.iter().map(|level| names[*level].clone());
                rows.push((two.chain(levels).collect(), (pairs, interval)));
            };
            let bootstrap = duel.success.map_or([-1.0, 1.0], |(_, interval)| interval);
            add(vec!["all".to_owned(); scales.len()], duel.all, bootstrap);
            for places in self.places(None) {
                let pairs = self.pairs_at(duel, &places);
                add(labels(&scales, &places), pairs, pairs.difference_95());
            }
        }
        csv_with(&[&["first", "second"], &self.settings(&scales)[..]].concat(), PAIRS, &rows)
    }

    /// The scales, beside the compared one, that tables have columns for.
    fn tabled(&self) -> Vec<&Scale> {
        self.others.iter().take(if self.is_one_at_a_time() { usize::MAX } else { 2 }).collect()
    }

    /// The levels of each row of a table: all that go together, times those of `compared`.
    fn places<'s>(&'s self, compared: Option<&'s Scale>) -> Vec<Vec<(&'s Scale, usize)>> {
        let tabled = self.tabled();
        let together: Vec<Vec<&Scale>> =
            if self.is_one_at_a_time() { tabled.into_iter().map(|scale| vec![scale]).collect() } else { vec![tabled] };
        let all = together.into_iter().map(|scales| scales.into_iter().chain(compared).collect::<Vec<_>>());
        all.flat_map(|scales| combinations(&scales)).collect()
    }

    /// Settings of the scales' axes.
    fn settings(&self, scales: &[&Scale]) -> Vec<&str> {
        scales.iter().map(|scale| self.study.axes[scale.axis].setting.as_str()).collect()
    }

    /// All rows that came to nothing, panics and errors, with their reasons, and how often each came.
    pub fn broken(&self) -> Vec<(String, usize)> {
        let mut counts: std::collections::BTreeMap<&str, usize> = std::collections::BTreeMap::new();
        for row in self.rows.iter().filter(|row| matches!(row.run.outcome, Ending::Panic | Ending::Error)) {
            *counts.entry(&row.run.reason).or_default() += 1;
        }
        counts.into_iter().map(|(reason, count)| (reason.to_owned(), count)).collect()
    }

    /// Whether some axis is sampled.
    pub fn is_sampled(&self) -> bool {
        self.study.axes.iter().any(|axis| axis.levels.listed().is_empty())
    }

    /// Whether each axis varies by itself.
    pub fn is_one_at_a_time(&self) -> bool {
        self.study.design == Design::OneAtATime
    }
}

fn success_cell(tally: &Tally) -> Option<Cell> {
    let [low, high] = tally.home_share_95;
    (tally.runs > 0).then(|| Cell {
        colour: tally.home_share,
        number: format!("{:.0}", 100.0 * tally.home_share),
        interval: format!("{:.0}\u{2013}{:.0}", 100.0 * low, 100.0 * high),
        told: format!("{} of {} came home; {} claimed to wrongly", tally.home, tally.runs, tally.wrong_claims),
        framed: false,
    })
}

/// All combinations of the scales' levels, the last one changing fastest.
fn combinations<'s>(scales: &[&'s Scale]) -> Vec<Vec<(&'s Scale, usize)>> {
    scales.iter().fold(vec![Vec::new()], |known, &scale| {
        let longer = |places: Vec<_>| (0..scale.levels.len()).map(move |level| [&places[..], &[(scale, level)]].concat());
        known.into_iter().flat_map(longer).collect()
    })
}

/// A name for a file, of words that may hold anything.
fn file_name(kind: &str, words: &[&str]) -> String {
    let parts = [kind].into_iter().chain(words.iter().copied()).filter(|word| !word.is_empty());
    let name = parts.collect::<Vec<_>>().join("-");
    let harmless = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    name.chars().map(harmless).collect::<String>() + ".svg"
}

/// What figures call the levels of these scales; empty for those that have none here.
fn labels(scales: &[&Scale], places: &[(&Scale, usize)]) -> Vec<String> {
    let level = |scale: &&Scale| places.iter().find(|(other, _)| other.axis == scale.axis);
    scales.iter().map(|scale| level(scale).map_or_else(String::new, |(scale, level)| scale.levels[*level].clone())).collect()
}

/// Columns of `cells.csv`, after its levels.
const CELLS: &Columns<Tally> = &[
    ("runs", |t| t.runs.to_string()),
    ("home", |t| t.home.to_string()),
    ("home_share", |t| number(t.home_share)),
    ("home_share_low_95", |t| number(t.home_share_95[0])),
    ("home_share_high_95", |t| number(t.home_share_95[1])),
    ("wrong_claims", |t| t.wrong_claims.to_string()),
    ("timeout", |t| t.outcomes.timeout.to_string()),
    ("lost", |t| t.outcomes.lost.to_string()),
    ("stuck", |t| t.outcomes.stuck.to_string()),
    ("failed", |t| t.outcomes.failed.to_string()),
    ("panic", |t| t.outcomes.panic.to_string()),
    ("error", |t| t.outcomes.error.to_string()),
    ("collided", |t| t.runs_with_collisions.to_string()),
    ("time_ratio_q25", |t| number(t.time_ratio.quartiles[0])),
    ("time_ratio_median", |t| number(t.time_ratio.median)),
    ("time_ratio_q75", |t| number(t.time_ratio.quartiles[1])),
    ("final_distance_median_m", |t| number(t.final_distance_m.median)),
];

/// Columns of `pairs.csv`, after the two and their levels; the interval is that of the difference.
const PAIRS: &Columns<(Paired, [f64; 2])> = &[
    ("pairs", |(p, _)| p.trials().to_string()),
    ("both", |(p, _)| p.both.to_string()),
    ("only_first", |(p, _)| p.only_first.to_string()),
    ("only_second", |(p, _)| p.only_second.to_string()),
    ("neither", |(p, _)| p.neither.to_string()),
    ("difference", |(p, _)| number(p.difference())),
    ("low_95", |(_, [low, _])| number(*low)),
    ("high_95", |(_, [_, high])| number(*high)),
    ("mcnemar_mid_p", |(p, _)| number(p.mid_p())),
];
