//! Which figures a study has, and its tables.

use super::curves::{Curve, Unit, curves};
use super::heat::{Cell, heat};
use crate::study::statistics::Paired;
use crate::study::sweep::tally::{Duel, OTHERS, Scale, Tally, compared, duels};
use crate::study::sweep::{Levels, Row, Study};

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
        Tally::of(self.at(&places))
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
            let success = curve(|t| (t.runs > 0).then(|| [t.home_share_95[0], t.share(), t.home_share_95[1]]));
            figures.push(Figure {
                name: file_name("success-by", &[setting]),
                section: Section::Curves,
                svg: curves("Runs that come home, 95 % Wilson", scale, Unit::Percent, &success),
            });
            let ratio = curve(|t| if let [Some(a), Some(b), Some(c)] = t.time_ratio { Some([a, b, c]) } else { None });
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
        let mut text: Vec<String> = scales.iter().map(|scale| quoted(&self.study.axes[scale.axis].setting)).collect();
        text.extend(
            ["runs", "home", "home_share", "home_share_low_95", "home_share_high_95", "wrong_claims"].map(str::to_owned),
        );
        text.extend(OTHERS.map(str::to_owned));
        let tail = ["collided", "time_ratio_q25", "time_ratio_median", "time_ratio_q75", "final_distance_median_m"];
        text.extend(tail.map(str::to_owned));
        let mut text = text.join(",") + "\n";
        let number = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
        for levels in combinations(&scales) {
            let places: Vec<(&Scale, usize)> = scales.iter().copied().zip(levels).collect();
            let t = Tally::of(self.at(&places));
            let mut cells: Vec<String> = places.iter().map(|(scale, level)| quoted(&scale.levels[*level])).collect();
            cells.extend([t.runs, t.home].map(|n| n.to_string()));
            cells.extend([t.share(), t.home_share_95[0], t.home_share_95[1]].map(|v| v.to_string()));
            cells.push(t.wrong_claims.to_string());
            cells.extend(t.others.map(|n| n.to_string()));
            cells.push(t.collided.to_string());
            cells.extend(t.time_ratio.map(number));
            cells.push(number(t.final_distance_m));
            text += &(cells.join(",") + "\n");
        }
        text
    }

    /// One row for every two of the compared ones and cell, and one for all cells together.
    pub fn pairs_csv(&self) -> String {
        let scales: Vec<&Scale> = self.others.iter().take(2).collect();
        let mut head: Vec<String> = ["first", "second"].map(str::to_owned).to_vec();
        head.extend(scales.iter().map(|scale| quoted(&self.study.axes[scale.axis].setting)));
        let counts = ["pairs", "both", "only_first", "only_second", "neither"];
        head.extend(counts.iter().chain(&["difference", "low_95", "high_95", "mcnemar_mid_p"]).map(|s| (*s).to_owned()));
        let mut text = head.join(",") + "\n";
        let names = self.names();
        for duel in &self.duels {
            let mut add = |levels: Vec<String>, pairs: Paired, [low, high]: [f64; 2]| {
                let mut cells: Vec<String> = duel.levels.iter().map(|level| quoted(&names[*level])).collect();
                cells.extend(levels);
                let counts = [pairs.trials(), pairs.both, pairs.only_first, pairs.only_second, pairs.neither];
                cells.extend(counts.map(|n| n.to_string()));
                cells.extend([pairs.difference(), low, high, pairs.mid_p()].map(|v| v.to_string()));
                text += &(cells.join(",") + "\n");
            };
            let bootstrap = duel.success.map_or([-1.0, 1.0], |(_, interval)| interval);
            add(vec!["all".to_owned(); scales.len()], duel.all, bootstrap);
            for levels in combinations(&scales) {
                let places: Vec<(&Scale, usize)> = scales.iter().copied().zip(levels).collect();
                let pairs = self.pairs_at(duel, &places);
                let labels = places.iter().map(|(scale, level)| quoted(&scale.levels[*level])).collect();
                add(labels, pairs, pairs.difference_95());
            }
        }
        text
    }

    /// All rows that came to nothing, panics and errors, with their reasons, and how often each came.
    pub fn broken(&self) -> Vec<(String, usize)> {
        let mut counts: std::collections::BTreeMap<&str, usize> = std::collections::BTreeMap::new();
        for row in self.rows.iter().filter(|row| OTHERS[3..].contains(&row.outcome.as_str())) {
            *counts.entry(&row.reason).or_default() += 1;
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
        colour: tally.share(),
        number: format!("{:.0}", 100.0 * tally.share()),
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

/// A cell of CSV (RFC 4180).
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}
