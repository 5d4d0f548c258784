//! Which figures a study has, and its tables.

use serde::Serialize;

use super::curves::{Curve, Unit, curves};
use super::heat::{Cell, heat};
use crate::storage::{csv_with, decimal};
use crate::study::row::Ending;
use crate::study::statistics::Paired;
use crate::study::sweep::duels::{Duel, Scale, compared, duels};
use crate::study::sweep::{Levels, Row, Study};
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
        let compared = compared(study);
        let others = (0..study.axes.len()).filter(|axis| Some(*axis) != compared).map(|axis| Scale::of(study, axis)).collect();
        Self { study, rows, compared: compared.map(|axis| Scale::of(study, axis)), others, duels: duels(study, rows) }
    }

    /// Names of the compared levels; one without a name where nothing is compared.
    pub fn names(&self) -> Vec<String> {
        self.compared.as_ref().map_or_else(|| vec![String::new()], |scale| scale.levels.clone())
    }

    /// The rows at these levels of these scales.
    fn at<'s>(&'s self, places: &'s [(&'s Scale, usize)]) -> impl Iterator<Item = &'s Row> + Clone {
        self.rows.iter().filter(move |row| places.iter().all(|(scale, level)| scale.level(self.study, row) == *level))
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
            figures.push(Figure {
                name: file_name("success-by", &[setting]),
                section: Section::Curves,
                svg: curves("Runs that come home, 95 % Wilson", scale, Unit::Percent, &success),
            });
            let ratio = curve(|t| {
                let [low, high] = t.time_ratio.quartiles;
                Some([low?, t.time_ratio.median?, high?])
            });
            figures.push(Figure {
                name: file_name("time-ratio-by", &[setting]),
                section: Section::Curves,
                svg: curves("Time over straight-line time, quartiles", scale, Unit::Ratio, &ratio),
            });
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
        let mut scales: Vec<&Scale> = self.others.iter().take(2).collect();
        scales.extend(&self.compared);
        let rows: Vec<_> = combinations(&scales)
            .into_iter()
            .map(|levels| {
                let places: Vec<(&Scale, usize)> = scales.iter().copied().zip(levels).collect();
                (labels(&places), CellRow::of(&Tally::of(self.at(&places).map(|row| &row.run))))
            })
            .collect();
        csv_with(&self.settings(&scales), &rows)
    }

    /// One row for every two of the compared ones and cell, and one for all cells together.
    pub fn pairs_csv(&self) -> String {
        let scales: Vec<&Scale> = self.others.iter().take(2).collect();
        let names = self.names();
        let mut rows = Vec::new();
        for duel in &self.duels {
            let mut add = |levels: Vec<String>, pairs: Paired, interval: [f64; 2]| {
                let two = duel.levels.iter().map(|level| names[*level].clone());
                rows.push((two.chain(levels).collect(), PairRow::of(&pairs, interval)));
            };
            let bootstrap = duel.success.map_or([-1.0, 1.0], |(_, interval)| interval);
            add(vec!["all".to_owned(); scales.len()], duel.all, bootstrap);
            for levels in combinations(&scales) {
                let places: Vec<(&Scale, usize)> = scales.iter().copied().zip(levels).collect();
                let pairs = self.pairs_at(duel, &places);
                add(labels(&places), pairs, pairs.difference_95());
            }
        }
        csv_with(&[&["first", "second"], &self.settings(&scales)[..]].concat(), &rows)
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
        self.study.axes.iter().any(|axis| matches!(axis.levels, Levels::Between { .. }))
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
fn combinations(scales: &[&Scale]) -> Vec<Vec<usize>> {
    scales.iter().fold(vec![Vec::new()], |known, scale| {
        let longer = |levels: Vec<usize>| (0..scale.levels.len()).map(move |level| [&levels[..], &[level]].concat());
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

/// What figures call the levels.
fn labels(places: &[(&Scale, usize)]) -> Vec<String> {
    places.iter().map(|(scale, level)| scale.levels[*level].clone()).collect()
}

/// A row of `cells.csv`, after its levels.
#[derive(Serialize)]
struct CellRow {
    runs: usize,
    home: usize,
    #[serde(serialize_with = "decimal")]
    home_share: f64,
    #[serde(serialize_with = "decimal")]
    home_share_low_95: f64,
    #[serde(serialize_with = "decimal")]
    home_share_high_95: f64,
    wrong_claims: usize,
    timeout: usize,
    lost: usize,
    stuck: usize,
    failed: usize,
    panic: usize,
    error: usize,
    collided: usize,
    #[serde(serialize_with = "decimal")]
    time_ratio_q25: Option<f64>,
    #[serde(serialize_with = "decimal")]
    time_ratio_median: Option<f64>,
    #[serde(serialize_with = "decimal")]
    time_ratio_q75: Option<f64>,
    #[serde(serialize_with = "decimal")]
    final_distance_median_m: Option<f64>,
}

impl CellRow {
    fn of(t: &Tally) -> Self {
        let ([low, high], [q25, q75], counts) = (t.home_share_95, t.time_ratio.quartiles, t.outcomes);
        Self {
            runs: t.runs,
            home: t.home,
            home_share: t.home_share,
            home_share_low_95: low,
            home_share_high_95: high,
            wrong_claims: t.wrong_claims,
            timeout: counts.timeout,
            lost: counts.lost,
            stuck: counts.stuck,
            failed: counts.failed,
            panic: counts.panic,
            error: counts.error,
            collided: t.runs_with_collisions,
            time_ratio_q25: q25,
            time_ratio_median: t.time_ratio.median,
            time_ratio_q75: q75,
            final_distance_median_m: t.final_distance_m.median,
        }
    }
}

/// A row of `pairs.csv`, after the two and their levels.
#[derive(Serialize)]
struct PairRow {
    pairs: usize,
    both: usize,
    only_first: usize,
    only_second: usize,
    neither: usize,
    #[serde(serialize_with = "decimal")]
    difference: f64,
    #[serde(serialize_with = "decimal")]
    low_95: f64,
    #[serde(serialize_with = "decimal")]
    high_95: f64,
    #[serde(serialize_with = "decimal")]
    mcnemar_mid_p: f64,
}

impl PairRow {
    fn of(pairs: &Paired, [low_95, high_95]: [f64; 2]) -> Self {
        let Paired { both, only_first, only_second, neither } = *pairs;
        let (difference, mcnemar_mid_p) = (pairs.difference(), pairs.mid_p());
        Self { pairs: pairs.trials(), both, only_first, only_second, neither, difference, low_95, high_95, mcnemar_mid_p }
    }
}
