//! Levels of a study's axes side by side: classes of them, pairs of runs that differ in one alone, failures worth a look.

use std::collections::BTreeMap;

use super::rows::Row;
use super::spec::{Axis, Levels, Study};
use crate::statistics::{Paired, cluster_bootstrap_95};
use crate::study::row::Ending;

/// Classes that the range of a sampled axis is cut into.
const CLASSES: usize = 6;

/// An axis cut into the levels that a figure shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// Which of the study's axes.
    pub axis: usize,
    /// What figures call the axis.
    pub label: String,
    /// What they call its levels.
    pub levels: Vec<String>,
}

impl Scale {
    /// That of an axis: its listed values, or classes of its range.
    pub fn of(study: &Study, axis: usize) -> Self {
        let Axis { label, levels, .. } = &study.axes[axis];
        let levels = match levels {
            Levels::Listed(values) => values.iter().map(ToString::to_string).collect(),
            Levels::Between { low, high, log } => (0..CLASSES)
                .map(|k| {
                    let rim = |k: usize| between(*low, *high, *log, k as f64 / CLASSES as f64);
                    format!("{}\u{2013}{}", short(rim(k)), short(rim(k + 1)))
                })
                .collect(),
        };
        Self { axis, label: label.clone(), levels }
    }

    /// The level that a row belongs to; `None` where the axis is not set in it.
    pub fn level(&self, study: &Study, row: &Row) -> Option<usize> {
        match &study.axes[self.axis].levels {
            Levels::Listed(values) => values.iter().position(|v| *v == row.values[self.axis]),
            Levels::Between { low, high, log } => {
                let value = row.values[self.axis].number()?;
                let share = if *log { libm::log(value / low) / libm::log(high / low) } else { (value - low) / (high - low) };
                Some(((share * CLASSES as f64) as usize).min(CLASSES - 1))
            }
        }
    }
}

fn between(low: f64, high: f64, log: bool, share: f64) -> f64 {
    if log { low * libm::pow(high / low, share) } else { low + share * (high - low) }
}

/// A number with two significant digits or so.
fn short(value: f64) -> String {
    let decimals = if value.abs() >= 10.0 {
        0
    } else if value.abs() >= 1.0 {
        1
    } else {
        2
    };
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Two levels of the compared axis, seed by seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Duel {
    /// The levels.
    pub levels: [usize; 2],
    /// Of all cells together.
    pub all: Paired,
    /// Difference of the shares that came home, and its 95 % interval by a bootstrap over seeds.
    pub success: Option<(f64, [f64; 2])>,
    /// Mean difference of the time ratios where both came home, and its interval by the same bootstrap.
    pub time_ratio: Option<(f64, [f64; 2])>,
    /// Pairs and those in which both came home, by seed: (difference of successes, pairs), (difference of time ratios, pairs).
    pairs: Vec<(u64, u64, bool, bool)>,
}

/// Compares every two levels of the compared axis: all runs that differ in nothing else are a pair.
pub fn duels(study: &Study, rows: &[Row]) -> Vec<Duel> {
    let Some(axis) = study.compared() else { return Vec::new() };
    let (scale, stride) = (Scale::of(study, axis), study.stride(axis));
    // Cell without its level on the axis, and seed.
    let mut pairs: BTreeMap<(u64, u64), Vec<Option<&Row>>> = BTreeMap::new();
    for row in rows {
        let Some(level) = scale.level(study, row) else { continue };
        let key = (row.cell - level as u64 * stride, row.run.seed);
        pairs.entry(key).or_insert_with(|| vec![None; scale.levels.len()])[level] = Some(row);
    }
    let count = scale.levels.len();
    let levels = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
    levels.map(|levels| Duel::new(levels, &pairs)).collect()
}

impl Duel {
    fn new(levels: [usize; 2], pairs: &BTreeMap<(u64, u64), Vec<Option<&Row>>>) -> Self {
        let mut all = Paired::default();
        // Of each seed the sum of the differences, and how many there are.
        type Clusters = BTreeMap<u64, (f64, usize)>;
        let (mut successes, mut ratios) = (Clusters::new(), Clusters::new());
        let mut kept = Vec::new();
        for (&(cell, seed), rows) in pairs {
            let (Some(a), Some(b)) = (rows[levels[0]], rows[levels[1]]) else { continue };
            all.add(a.run.is_home(), b.run.is_home());
            kept.push((cell, seed, a.run.is_home(), b.run.is_home()));
            let success = successes.entry(seed).or_default();
            *success = (success.0 + f64::from(i8::from(a.run.is_home()) - i8::from(b.run.is_home())), success.1 + 1);
            if let (Some(x), Some(y)) = (a.run.time_ratio, b.run.time_ratio) {
                let ratio = ratios.entry(seed).or_default();
                *ratio = (ratio.0 + x - y, ratio.1 + 1);
            }
        }
        let bootstrap = |clusters: Clusters| cluster_bootstrap_95(&clusters.into_values().collect::<Vec<_>>());
        Self { levels, all, success: bootstrap(successes), time_ratio: bootstrap(ratios), pairs: kept }
    }

    /// The pairs whose first one's cell (that of the compared axis' first level) `choose` takes.
    pub fn within(&self, choose: impl Fn(u64) -> bool) -> Paired {
        let mut some = Paired::default();
        for &(cell, _, a, b) in &self.pairs {
            if choose(cell) {
                some.add(a, b);
            }
        }
        some
    }
}

/// Failures worth a look, at most `most`: of each level of the compared axis and each outcome the first ones, in turn, none of a
/// cell where all runs end alike before those where they do not.
pub fn failures<'a>(study: &Study, rows: &'a [Row], most: usize) -> Vec<&'a Row> {
    let scale = study.compared().map(|axis| Scale::of(study, axis));
    let mut home_in_cell: BTreeMap<u64, usize> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.run.is_home()) {
        *home_in_cell.entry(row.cell).or_default() += 1;
    }
    let mut kinds: BTreeMap<(usize, usize), Vec<&Row>> = BTreeMap::new();
    for row in rows {
        let level = scale.as_ref().and_then(|scale| scale.level(study, row)).unwrap_or_default();
        // A run without a result has no path to show.
        let shown = [Ending::Lost, Ending::Timeout, Ending::Stuck];
        if let Some(outcome) = shown.iter().position(|outcome| *outcome == row.run.outcome) {
            kinds.entry((outcome, level)).or_default().push(row);
        }
    }
    for rows in kinds.values_mut() {
        // The rarer a failure in its cell, the more there is to learn from it.
        rows.sort_by_key(|row| (std::cmp::Reverse(home_in_cell.get(&row.cell).copied().unwrap_or_default()), row.episode));
    }
    let mut chosen = Vec::new();
    for turn in 0.. {
        let before = chosen.len();
        chosen.extend(kinds.values().filter_map(|rows| rows.get(turn)).take(most - before));
        if chosen.len() == before || chosen.len() == most {
            break;
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::sweep::rows::without_result;
    use crate::study::tally::Tally;
    use std::path::Path;
    use std::sync::Arc;

    const STUDY: &str = "name = \"t\"\nworld = \"lab\"\nseeds = \"1..4\"\ndesign = \"random\"\npoints = 2\n\
        [[axes]]\nsetting = \"method\"\nvalues = [\"alv\", \"ibvs\", \"weber\"]\n\
        [[axes]]\nsetting = \"floor_friction\"\nfrom = 0.1\nto = 0.7\n\
        [[axes]]\nsetting = \"hidden_share\"\nvalues = [0.0, 0.5]\n";

    /// A study's rows, home where `home` says so of cell, method and seed.
    fn made(home: impl Fn(&str, u64) -> bool) -> (Study, Vec<Row>) {
        let study = Study::from_toml(STUDY, Path::new("t.toml"), None).unwrap();
        let rows = (0..study.episodes()).map(|episode| {
            let (cell, seed) = study.place(episode);
            let values: Arc<[_]> = study.values(cell).into();
            let outcome = if home(values[0].text().unwrap(), seed) { Ending::Home } else { Ending::Lost };
            without_result(episode, (cell, seed), &values, outcome, String::new())
        });
        (study.clone(), rows.collect())
    }

    #[test]
    fn pairs_differ_in_the_compared_setting_alone() {
        let (study, rows) = made(|method, seed| method == "alv" || (method == "ibvs" && seed < 4));
        assert_eq!((study.cells(), study.episodes()), (12, 48));
        let duels = duels(&study, &rows);
        assert_eq!(duels.len(), 3);
        let [alv_ibvs, alv_weber, _] = &duels[..] else { panic!() };
        // Two points and two shares, three of four seeds each.
        assert_eq!(alv_ibvs.all, Paired { both: 12, only_first: 4, only_second: 0, neither: 0 });
        assert_eq!(alv_weber.all, Paired { both: 0, only_first: 16, only_second: 0, neither: 0 });
        assert_eq!(alv_weber.success, Some((1.0, [1.0, 1.0])));
        let (difference, [low, high]) = alv_ibvs.success.unwrap();
        assert!(difference == 0.25 && low == 0.0 && high > 0.4, "one seed of four decides: {low} to {high}");
        assert_eq!(alv_ibvs.within(|cell| cell == 0).trials(), 4);
        assert_eq!(alv_ibvs.time_ratio, None);
    }

    #[test]
    fn levels_and_tallies_cover_all_rows() {
        let (study, rows) = made(|_, seed| seed % 2 == 0);
        for axis in 0..3 {
            let scale = Scale::of(&study, axis);
            let counts = (0..scale.levels.len())
                .map(|level| Tally::of(rows.iter().filter(|row| scale.level(&study, row) == Some(level)).map(|row| &row.run)))
                .collect::<Vec<_>>();
            assert_eq!(counts.iter().map(|t| t.runs).sum::<usize>(), 48);
            assert!(counts.iter().all(|t| t.runs == 2 * t.home && t.runs == t.home + t.outcomes.lost));
        }
        assert_eq!(Scale::of(&study, 1).levels[0], "0.1\u{2013}0.2");
        assert_eq!(failures(&study, &rows, 7).len(), 7);
        assert_eq!([short(0.05), short(12.3), short(1.25), short(10.0)], ["0.05", "12", "1.2", "10"]);
    }
}
