//! A study: what its cells and episodes are, and what each of them is set to.

use std::ops::RangeInclusive;

use serde::Serialize;

use super::design::{self, Design};
use super::settings::{self, Case};
use super::value::Value;
use crate::episode::Setup;
use crate::error::Result;
use crate::random::Seed;
use crate::storage::sha256;
use crate::world::{Draft, World};

/// Most episodes of one study.
pub const MOST_EPISODES: u64 = 100_000_000;
/// Most episodes in one chunk, the unit in which a study is run, stored and resumed.
const CHUNK_EPISODES: u64 = 20;
/// A setting that a study varies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    /// Name of the setting.
    pub setting: String,
    /// What figures call it.
    pub label: String,
    /// Its levels.
    pub levels: Levels,
}

/// What an axis can be.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Levels {
    /// These, each with all other axes' levels and with all points.
    Listed(Vec<Value>),
    /// Anything between two values, one of each point of a random or Sobol design.
    Between {
        /// Least value.
        low: f64,
        /// Greatest value.
        high: f64,
        /// Whether equal ratios are equally likely rather than equal differences.
        log: bool,
    },
}

impl Levels {
    /// The listed ones; none where any value may come.
    pub fn listed(&self) -> &[Value] {
        if let Self::Listed(values) = self { values } else { &[] }
    }

    /// By how many an axis multiplies the cells of a grid.
    fn count(&self) -> u64 {
        self.listed().len().max(1) as u64
    }
}

/// A checked study: cells (one a combination of levels) of episodes (one a seed).
///
/// The episodes of a cell have the study's seeds, the same ones in all cells: runs with one seed start at the same place and meet
/// the same draws of noise wherever the cells' settings leave those alone, so that differences between cells are differences of
/// pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Study {
    /// Name.
    pub name: String,
    /// What it is for.
    pub description: String,
    /// World as a person named it.
    #[serde(skip)]
    pub world: String,
    /// SHA-256 of the base world.
    pub world_sha256: String,
    /// Seed of random points; the episodes have their own.
    pub seed: u64,
    /// Seeds of each cell's episodes.
    pub seeds: RangeInclusive<u64>,
    /// How points are chosen.
    pub design: Design,
    /// Points of a random or Sobol design, else 1.
    pub points: u64,
    /// Settings that all cells share, in the file's order.
    pub settings: Vec<(String, Value)>,
    /// What varies, in the file's order.
    pub axes: Vec<Axis>,
    /// The setting whose levels are compared with one another, if it is one of the axes.
    pub compare: String,
    /// The file's text.
    #[serde(skip)]
    pub text: String,
    /// What settings are applied to.
    #[serde(skip)]
    pub(super) base: Setup,
}

/// A run of episodes in one cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chunk {
    /// Its number.
    pub index: u64,
    /// Its cell.
    pub cell: u64,
    /// Number of its first episode.
    pub first: u64,
    /// Seed of its first episode.
    pub seed: u64,
    /// How many episodes it has.
    pub count: u64,
}

impl Study {
    /// Names the study and everything that decides about its rows, this program's version included: rows of studies with equal
    /// hashes belong together.
    pub fn sha256(&self) -> String {
        let text = serde_json::to_string(self).unwrap_or_default();
        sha256(format!("wayhome {}\n{text}", crate::VERSION).as_bytes())
    }

    /// The same study on the world that a person named, with its settings and axes applied to another setup, of those axes whose setting
    /// `wanted` takes. Its rows are no longer those of the file: no folder tells the two apart.
    ///
    /// # Errors
    /// When the world or the setup has faults.
    pub(in crate::study) fn based_on(mut self, world: &str, base: &Setup, wanted: impl Fn(&str) -> bool) -> Result<Self> {
        self.axes.retain(|axis| wanted(&axis.setting));
        (self.world, self.world_sha256) = (world.to_owned(), Draft::open(world)?.world()?.sha256);
        self.base = base.clone();
        base.check()?;
        Ok(self)
    }

    /// What settings are applied to.
    pub(in crate::study) fn base(&self) -> &Setup {
        &self.base
    }

    /// The axis whose levels are compared; `None` where the study has no such axis, or it has one level.
    pub fn compared(&self) -> Option<usize> {
        self.axes.iter().position(|axis| axis.setting == self.compare && axis.levels.listed().len() > 1)
    }

    /// Levels of the compared axis; 1 where there is none.
    fn compared_levels(&self) -> u64 {
        self.compared().map_or(1, |k| self.axes[k].levels.count())
    }

    /// How many cells of a point lie between two that differ by one level of an axis alone. In a one-at-a-time design only the compared
    /// axis has such pairs.
    pub fn stride(&self, axis: usize) -> u64 {
        match self.design {
            Design::OneAtATime => 1,
            _ => self.axes[axis + 1..].iter().map(|axis| axis.levels.count()).product(),
        }
    }

    /// Cells of a point: combinations of the listed levels, or in a one-at-a-time design all of them but the compared ones, times
    /// these.
    pub(super) fn combinations(&self) -> u64 {
        let counts = |k: &usize| self.axes[*k].levels.count();
        match self.design {
            Design::OneAtATime => {
                let compared = self.compared();
                let others = (0..self.axes.len()).filter(|k| Some(*k) != compared);
                others.map(|k| counts(&k)).sum::<u64>().saturating_mul(self.compared_levels())
            }
            _ => (0..self.axes.len()).map(|k| counts(&k)).fold(1, u64::saturating_mul),
        }
    }

    /// Number of cells.
    pub fn cells(&self) -> u64 {
        self.points * self.combinations()
    }

    /// Episodes of a cell.
    pub fn episodes_per_cell(&self) -> u64 {
        self.seeds.end() - self.seeds.start() + 1
    }

    /// Number of episodes.
    pub fn episodes(&self) -> u64 {
        self.cells() * self.episodes_per_cell()
    }

    /// Number of chunks.
    pub fn chunks(&self) -> u64 {
        self.cells() * self.episodes_per_cell().div_ceil(CHUNK_EPISODES)
    }

    /// The chunk of a number below [`Study::chunks`].
    pub fn chunk(&self, index: u64) -> Chunk {
        let (per_cell, episodes) = (self.episodes_per_cell().div_ceil(CHUNK_EPISODES), self.episodes_per_cell());
        let (cell, before) = (index / per_cell, index % per_cell * CHUNK_EPISODES);
        let count = CHUNK_EPISODES.min(episodes - before);
        Chunk { index, cell, first: cell * episodes + before, seed: self.seeds.start() + before, count }
    }

    /// Number of the chunk that an episode is in.
    pub fn chunk_of(&self, episode: u64) -> u64 {
        let per_cell = self.episodes_per_cell();
        episode / per_cell * per_cell.div_ceil(CHUNK_EPISODES) + episode % per_cell / CHUNK_EPISODES
    }

    /// Cell and seed of an episode.
    pub fn place(&self, episode: u64) -> (u64, u64) {
        (episode / self.episodes_per_cell(), self.seeds.start() + episode % self.episodes_per_cell())
    }

    /// The axes' values in a cell. The last axis changes fastest, the point slowest; in a one-at-a-time design the compared axis
    /// changes fastest, and all but it and the one whose turn it is are [`Value::Unset`].
    pub fn values(&self, cell: u64) -> Vec<Value> {
        if self.design == Design::OneAtATime {
            return self.values_in_turn(cell);
        }
        let sampled = self.axes.iter().filter(|axis| axis.levels.listed().is_empty()).count();
        let point = design::point(self.design, Seed(self.seed), cell / self.combinations(), sampled);
        let mut place = cell % self.combinations();
        let mut coordinate = point.iter().rev();
        let mut values: Vec<Value> = self
            .axes
            .iter()
            .rev()
            .map(|axis| match &axis.levels {
                Levels::Listed(values) => {
                    let value = &values[(place % values.len() as u64) as usize];
                    place /= values.len() as u64;
                    value.clone()
                }
                Levels::Between { low, high, log } => {
                    let share = coordinate.next().copied().unwrap_or_default();
                    Value::Real(if *log { low * libm::pow(high / low, share) } else { low + share * (high - low) })
                }
            })
            .collect();
        values.reverse();
        values
    }

    fn values_in_turn(&self, cell: u64) -> Vec<Value> {
        let (compared, levels) = (self.compared(), self.compared_levels());
        // Levels that still come before the one whose turn it is; `None` once it has come.
        let mut before = Some((cell / levels) as usize);
        let turn = |(k, axis): (usize, &Axis)| {
            let values = axis.levels.listed();
            if Some(k) == compared {
                return values[(cell % levels) as usize].clone();
            }
            let place = before.take();
            before = place.filter(|place| *place >= values.len()).map(|place| place - values.len());
            place.and_then(|place| values.get(place)).cloned().unwrap_or(Value::Unset)
        };
        self.axes.iter().enumerate().map(turn).collect()
    }

    /// Whether each seed has a world of its own: a `world` such as `office:seed`.
    pub fn draws_worlds(&self) -> bool {
        let drawn = |value: &Value| matches!(value, Value::Text(text) if settings::is_drawn(text));
        let set = self.settings.iter().any(|(name, value)| name == "world" && drawn(value));
        let levels = |axis: &Axis| axis.setting == "world" && axis.levels.listed().iter().any(drawn);
        set || settings::is_drawn(&self.world) || self.axes.iter().any(levels)
    }

    /// World and setup of a cell's episode with this seed. The seed makes no difference unless the study
    /// [draws worlds](Self::draws_worlds).
    ///
    /// # Errors
    /// When its settings do not go together.
    pub fn case(&self, values: &[Value], seed: u64) -> Result<(World, Setup)> {
        let mut settings: Vec<(&str, &Value)> = self.settings.iter().map(|(name, value)| (name.as_str(), value)).collect();
        settings.extend(self.axes.iter().zip(values).map(|(axis, value)| (axis.setting.as_str(), value)));
        settings.retain(|(_, value)| **value != Value::Unset);
        settings.sort_by_key(|(name, _)| settings::rank(name)); // stable: of two of one rank the later one holds
        let mut case = Case { draft: settings::open(&self.world, seed)?, setup: self.base.clone(), seed };
        for (name, value) in settings {
            settings::apply(&mut case, name, value)?;
        }
        Ok((case.draft.world()?, case.setup))
    }
}
