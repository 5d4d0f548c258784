//! The folder in which a study's rows gather.
//!
//! `study.toml` and `study.json` say which study it is, `parts/` has a Parquet file a finished chunk, and `rows.parquet` is there
//! once all chunks are. Files appear whole, under names that do not depend on who made them, so any number of processes on any
//! number of machines may fill one folder, or folders that are merged later.

use std::collections::BTreeSet;
use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::episode::{Record, Recorder, Summary};
use crate::error::{Error, Result};
use crate::record::run::RunFiles;
use crate::storage::{MARKER, PARTIAL, files, io_error, json, remove, write_atomically};
use crate::study::sweep::merge::{Identity, merge};
use crate::study::sweep::{Chunk, Row, Store, Study, rows};
use crate::table::Table;
use crate::world::World;

/// Content of the folder's marker.
const VERB: &str = "sweep";
const STUDY: &str = "study.toml";
const RECORD: &str = "study.json";
const ROWS: &str = "rows.parquet";
const PARTS: &str = "parts";
const FAILURES: &str = "failures";
/// Where `sweep report` writes its page unless told otherwise.
const REPORT: &str = "report";
/// Beginning of the names of files that tell how fast it went.
const RATE: &str = "rate-";

/// `study.json`.
#[derive(Debug, Serialize, Deserialize)]
struct StudyRecord {
    #[serde(flatten)]
    identity: Identity,
    /// Where the study was read from.
    source: PathBuf,
    seeds: [u64; 2],
    cells: u64,
    episodes: u64,
    world_sha256: String,
}

/// How fast a process went. It is kept apart from the rows, which are the same whoever makes them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Worker threads.
    pub threads: usize,
    /// Episodes that were run.
    pub episodes: u64,
    /// Wall-clock time, s.
    pub wall_s: f64,
    /// Episodes a minute.
    pub episodes_per_minute: f64,
}

/// A study's folder.
#[derive(Debug)]
pub struct StudyFolder {
    path: PathBuf,
    study: Study,
    source: PathBuf,
    keep_failures: bool,
}

impl StudyFolder {
    /// Opens or creates the folder for the rows of `study`, which was read from `source`. With `keep_failures` the full record of
    /// every run that did not end at home is kept, too.
    ///
    /// # Errors
    /// When the folder cannot be created or read, or holds anything but rows of this study made by this version.
    pub fn create(path: &Path, study: Study, source: &Path, keep_failures: bool) -> Result<Self> {
        Table::check_parquet()?;
        let held = if path.is_dir() { files(path)? } else { Vec::new() };
        let ours = |name: &String| [MARKER, STUDY, RECORD, ROWS, PARTS, FAILURES, REPORT].contains(&name.as_str());
        let known = |name: &String| ours(name) || name.starts_with(RATE) || name.ends_with(PARTIAL);
        let foreign = held.iter().find(|name| !known(name));
        if let Some(name) = foreign {
            return Err(Error::OutputTaken { path: path.to_owned(), found: format!("`{name}`") });
        }
        let identity = Identity::of(&study);
        let parts = path.join(PARTS);
        if path.join(RECORD).is_file() {
            if let Some(difference) = read_record(path)?.identity.difference(&identity) {
                return Err(Error::OutputTaken { path: path.to_owned(), found: format!("rows of {difference}") });
            }
        } else {
            fs::create_dir_all(&parts).map_err(io_error("create folder", &parts))?;
            let record = StudyRecord {
                identity,
                source: source.to_owned(),
                seeds: [*study.seeds.start(), *study.seeds.end()],
                cells: study.cells(),
                episodes: study.episodes(),
                world_sha256: study.world_sha256.clone(),
            };
            write_atomically(&path.join(MARKER), format!("{VERB}\n").as_bytes())?;
            write_atomically(&path.join(STUDY), study.text.as_bytes())?;
            write_atomically(&path.join(RECORD), json(&record).as_bytes())?;
        }
        Ok(Self { path: path.to_owned(), study, source: source.to_owned(), keep_failures })
    }

    /// Opens a folder that a study was run in, and reads its study.
    ///
    /// # Errors
    /// When it is none, or the study's world or this program has changed since.
    pub fn open(path: &Path) -> Result<Self> {
        if !path.join(RECORD).is_file() {
            return Err(Error::Unfit {
                what: "folder of a study".into(),
                found: format!("{}, which has no {RECORD}", path.display()),
                needed: "a folder that `wayhome sweep` made".into(),
            });
        }
        let record = read_record(path)?;
        let file = path.join(STUDY);
        let text = fs::read_to_string(&file).map_err(io_error("read", &file))?;
        let [first, last] = record.seeds;
        let study = Study::from_toml(&text, &record.source, Some(RangeInclusive::new(first, last)))?;
        if let Some(difference) = record.identity.difference(&Identity::of(&study)) {
            return Err(Error::Parse {
                path: path.join(RECORD),
                message: format!("the rows are of {difference}: the study's world or this program has changed since"),
            });
        }
        Ok(Self { path: path.to_owned(), study, source: record.source, keep_failures: false })
    }

    /// The study.
    pub fn study(&self) -> &Study {
        &self.study
    }

    /// Where the study was read from.
    pub fn source(&self) -> &Path {
        &self.source
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Numbers of the chunks whose rows are there.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn done(&self) -> Result<BTreeSet<u64>> {
        let parts = self.path.join(PARTS);
        if !parts.is_dir() {
            return Ok(BTreeSet::new());
        }
        Ok(files(&parts)?.iter().filter_map(|name| name.strip_suffix(".parquet")?.parse().ok()).collect())
    }

    /// All rows that are there, in order.
    ///
    /// # Errors
    /// When a part cannot be read or belongs to another study.
    pub fn parts(&self) -> Result<Vec<Row>> {
        let mut all = Vec::new();
        for chunk in self.done()? {
            all.extend(self.read(&self.part(chunk))?);
        }
        Ok(all)
    }

    /// The row of one episode.
    ///
    /// # Errors
    /// When the study has no such episode, or its row is not there.
    pub fn row(&self, episode: u64) -> Result<Row> {
        let episodes = self.study.episodes();
        let invalid = |found: String, allowed: String| Error::Invalid { what: "row".into(), found, allowed };
        if episode >= episodes {
            return Err(invalid(episode.to_string(), format!("0 to {}", episodes - 1)));
        }
        let chunk = self.study.chunk_of(episode);
        let rows = if self.done()?.contains(&chunk) { self.read(&self.part(chunk))? } else { Vec::new() };
        let missing = || Error::Unfit {
            what: format!("rows in {}", self.path.display()),
            found: format!("none of episode {episode}, which is not run yet"),
            needed: "its row".into(),
        };
        rows.into_iter().find(|row| row.episode == episode).ok_or_else(missing)
    }

    fn read(&self, path: &Path) -> Result<Vec<Row>> {
        let bytes = fs::read(path).map_err(io_error("read", path))?;
        let unfit = |message: String| Error::Parse { path: path.to_owned(), message };
        let identity = Identity::from_notes(&Table::notes_of_parquet(&bytes).map_err(unfit)?);
        let identity = identity.ok_or_else(|| unfit("no notes of a study".into()))?;
        if let Some(difference) = identity.difference(&Identity::of(&self.study)) {
            return Err(unfit(format!("rows of {difference}")));
        }
        rows::from_table(&self.study, &Table::from_parquet(bytes).map_err(unfit)?).map_err(unfit)
    }

    /// The rows of all episodes in order.
    ///
    /// # Errors
    /// As [`Self::parts`], and when some are missing.
    pub fn rows(&self) -> Result<Vec<Row>> {
        merge(&self.study, self.parts()?).map_err(|message| Error::Parse { path: self.path.clone(), message })
    }

    /// Writes `rows.parquet` if all chunks are there, and tells whether they are.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn complete(&self) -> Result<bool> {
        if (self.done()?.len() as u64) < self.study.chunks() {
            return Ok(false);
        }
        write_atomically(&self.path.join(ROWS), &self.parquet(&self.rows()?)?)?;
        let parts = self.path.join(PARTS);
        for partial in files(&parts)?.iter().filter(|name| name.ends_with(PARTIAL)) {
            remove(&parts.join(partial))?; // of a process that was killed
        }
        Ok(true)
    }

    /// Takes over the rows of another folder, which must be of the same study.
    ///
    /// # Errors
    /// When it is of another study or version, or its rows cannot be read.
    pub fn take(&self, other: &Path) -> Result<()> {
        let record = read_record(other)?;
        if let Some(difference) = record.identity.difference(&Identity::of(&self.study)) {
            return Err(Error::Unfit {
                what: format!("shard {}", other.display()),
                found: format!("rows of {difference}"),
                needed: "shards of one study, made by one version".into(),
            });
        }
        let from = Self { path: other.to_owned(), study: self.study.clone(), source: record.source, keep_failures: false };
        for index in from.done()? {
            let (chunk, rows) = (self.study.chunk(index), self.read(&from.part(index))?);
            if self.part(index).is_file() && self.read(&self.part(index))? != rows {
                let message = format!("other rows than in {}", self.part(index).display());
                return Err(Error::Parse { path: from.part(index), message });
            }
            self.keep(&chunk, &rows)?;
        }
        Ok(())
    }

    /// Notes how fast shard `shard` of `of` went, beside what it did before.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn note_rate(&self, [shard, of]: [u64; 2], rate: Rate) -> Result<()> {
        let path = self.path.join(format!("{RATE}{shard}-of-{of}.json"));
        let mut rates: Vec<Rate> = fs::read(&path).ok().and_then(|b| serde_json::from_slice(&b).ok()).unwrap_or_default();
        rates.push(rate);
        write_atomically(&path, json(&rates).as_bytes())
    }

    /// All rates that were noted.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn rates(&self) -> Result<Vec<Rate>> {
        let read = |name: &String| serde_json::from_slice::<Vec<Rate>>(&fs::read(self.path.join(name)).ok()?).ok();
        Ok(files(&self.path)?.iter().filter(|name| name.starts_with(RATE)).filter_map(read).flatten().collect())
    }

    fn part(&self, chunk: u64) -> PathBuf {
        self.path.join(PARTS).join(format!("{chunk:08}.parquet"))
    }

    fn parquet(&self, rows: &[Row]) -> Result<Vec<u8>> {
        let unfit = |message| Error::Parse { path: self.path.clone(), message };
        rows::table(&self.study, rows).to_parquet(&Identity::of(&self.study).notes()).map_err(unfit)
    }
}

impl Store for StudyFolder {
    fn keep(&self, chunk: &Chunk, rows: &[Row]) -> Result<()> {
        write_atomically(&self.part(chunk.index), &self.parquet(rows)?)
    }

    fn keep_failure(&self, row: &Row, world: &World, record: &Record, summary: &Summary) -> Result<()> {
        if !self.keep_failures {
            return Ok(());
        }
        let path = self.path.join(FAILURES).join(format!("{:08}", row.episode));
        RunFiles::open(&path, "sweep --keep-failures", world)?.finish(record, summary)
    }
}

fn read_record(path: &Path) -> Result<StudyRecord> {
    let file = path.join(RECORD);
    let text = fs::read(&file).map_err(io_error("read", &file))?;
    serde_json::from_slice(&text).map_err(|e| Error::Parse { path: file, message: e.to_string() })
}
