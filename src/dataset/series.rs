//! Sets over many worlds: as many poses in each, and one world in memory at a time.
//!
//! The parts of a set are known by arithmetic, before any world is opened: all worlds have as many random places, give or take one, each
//! of them free under all conditions. A world is opened when one of its parts is missing, planned as a set of its own
//! whose numbers go on where the one before it ended, and dropped when its parts are there. What a run of one world guarantees holds
//! as well: the bytes follow from the command, not from threads, shards or interruptions.

use std::ops::{ControlFlow, Range};
use std::path::Path;

use sha2::{Digest, Sha256};

use super::parts::{FileRecord, Record, SetFolder, is_whole};
use super::pipeline::{BATCH, Extras, Job, Outcome, Progress, home_pictures};
use super::plan::{Headings, Numbering, PART_FRAMES, Part, Places, Plan, Request, invalid};
use crate::error::{Error, Result};
use crate::panorama::Projection;
use crate::panorama_set::{Document, Frame, LayoutKind, MOST_PLACES, SeriesDocument, WorldRef};
use crate::render::{Renderer, RendererInfo, Scene};
use crate::storage::{io_error, json};
use crate::world::{WorldName, WorldSource};

/// Poses that were left out of a set over many worlds: none.
const LEFT_OUT: &str = "condition,spot,row,column,x_m,y_m,heading_rad,in_the_way\n";

/// All of a set over many worlds before any of it is rendered.
#[derive(Debug, Clone)]
pub struct Series {
    source: WorldSource,
    given: String,
    request: Request,
    /// Random places in all worlds together.
    places: usize,
    /// That of all panoramas: the first world's.
    projection: Projection,
}

/// A set over many worlds in the making; see [`Job`].
pub struct SeriesJob<'a> {
    /// What it will be.
    pub series: &'a Series,
    /// Its folder.
    pub out: &'a Path,
    /// Which share of the parts this run makes: number, from 1, and count.
    pub shard: (usize, usize),
    /// Files to add.
    pub extras: Extras<'a>,
}

impl Series {
    /// Lays out a set over the worlds that `given` names; see [`WorldSource::parse`]. The request's places are random ones, so many in
    /// all worlds together.
    ///
    /// # Errors
    /// When there are no such worlds, more of them than places, other places are asked for, or the layout has no room for several worlds.
    pub fn new(given: &str, request: Request) -> Result<Self> {
        let source = WorldSource::parse(given)?;
        let Places::Random(places) = request.places else {
            return Err(invalid("places of a set over several worlds", "no random ones", "random places"));
        };
        if !(source.len()..=MOST_PLACES).contains(&places) {
            let found = format!("{places} for {} worlds", source.len());
            return Err(invalid("--count", found, format!("{} to {MOST_PLACES}: at least one a world", source.len())));
        }
        if !request.layout.layout().holds_worlds() {
            let able: Vec<&str> =
                LayoutKind::written().filter(|kind| kind.layout().holds_worlds()).map(LayoutKind::name).collect();
            let found = format!("{} for several worlds", request.layout.name());
            return Err(invalid("--layout", found, able.join(", ")));
        }
        let first = source.open(0)?;
        let projection = request.layout.layout().projection(
            request.size_px.map_or_else(|| first.projection(), |(width, height)| first.projection_of_size(width, height)),
        );
        let series = Self { source, given: given.to_owned(), request, places, projection };
        if series.spots(series.worlds()) > MOST_PLACES {
            let found = format!("{places} places with {} headings", series.headings());
            return Err(invalid("poses of the set", found, format!("1 to {MOST_PLACES} poses")));
        }
        Ok(series)
    }

    /// How many worlds.
    #[must_use]
    pub fn worlds(&self) -> usize {
        self.source.len()
    }

    /// Frames in all.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.spots(self.worlds()) * self.request.conditions.len()
    }

    /// Parts in all.
    #[must_use]
    pub fn parts(&self) -> usize {
        self.first_part(self.worlds())
    }

    fn headings(&self) -> usize {
        match &self.request.headings {
            Headings::Own => 1,
            Headings::Fixed(headings) => headings.len(),
            Headings::Random(count) => *count,
        }
    }

    /// Places of the worlds before world `k`.
    fn places_before(&self, k: usize) -> usize {
        // In 128 bits: the product of two numbers of ten million each is not far from the end of 64.
        (k as u128 * self.places as u128 / self.worlds() as u128) as usize
    }

    /// Spots of the worlds before world `k`.
    fn spots(&self, k: usize) -> usize {
        self.places_before(k) * self.headings()
    }

    /// Parts of the worlds before world `k`.
    fn first_part(&self, k: usize) -> usize {
        let few = self.places / self.worlds();
        let richer = self.places_before(k) - k * few;
        let parts = |places: usize| (places * self.headings()).div_ceil(PART_FRAMES) * self.request.conditions.len();
        (k - richer) * parts(few) + richer * parts(few + 1)
    }

    fn part_numbers(&self, k: usize) -> Range<usize> {
        self.first_part(k)..self.first_part(k + 1)
    }

    /// Part `number` of the set, which is one of world `k`.
    fn part(&self, k: usize, number: usize) -> Part {
        let spots = self.spots(k + 1) - self.spots(k);
        let each = spots.div_ceil(PART_FRAMES);
        let local = number - self.first_part(k);
        let first = local % each * PART_FRAMES;
        Part { number, stage: local / each, first, count: PART_FRAMES.min(spots - first) }
    }

    /// The plan of world `k`, which is opened for it.
    ///
    /// # Errors
    /// When there is no such world, it has faults, or the robot finds no place in it.
    pub fn plan(&self, k: usize) -> Result<Plan> {
        let world = self.source.open(k)?;
        let WorldName { group, argument } =
            self.source.get(k).unwrap_or(WorldName { group: String::new(), argument: String::new() });
        let numbering = Numbering {
            world: Some(WorldRef { world: argument, kind: group }),
            first_spot: self.spots(k),
            all_spots: self.spots(self.worlds()),
            first_part: self.first_part(k),
        };
        let places = Places::Random(self.places_before(k + 1) - self.places_before(k));
        let mut plan = Plan::numbered(&world, Request { places, ..self.request.clone() }, Some(numbering))?;
        plan.projection = self.projection;
        Ok(plan)
    }

    /// What the set is, for its `dataset.json`. `first` is the plan of the first world.
    fn document(&self, first: &Plan, renderer: &RendererInfo) -> Result<Document> {
        let mut document = first.document(renderer);
        let spots = self.spots(self.worlds());
        for condition in &mut document.conditions {
            condition.frames = spots;
        }
        document.frames = self.frames();
        document.parts = self.parts();
        (document.world, document.world_sha256) = (self.given.clone(), self.sha256()?);
        document.series = Some(SeriesDocument { count: self.worlds(), poses: spots });
        Ok(document)
    }

    /// SHA-256 of all worlds' names and of the files of those that have one.
    fn sha256(&self) -> Result<String> {
        let mut hash = Sha256::new();
        for WorldName { argument, .. } in self.source.iter() {
            let path = Path::new(&argument);
            hash.update(argument.as_bytes());
            if path.is_file() {
                hash.update(std::fs::read(path).map_err(io_error("read", path))?);
            }
            hash.update([0]);
        }
        Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
    }
}

impl SeriesJob<'_> {
    /// Makes what is missing of the set, as [`Job::run`] does.
    ///
    /// # Errors
    /// As there, and when a world cannot be opened.
    pub fn run(
        &self,
        renderer: &mut dyn Renderer,
        watch: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> Result<Outcome> {
        crate::table::Table::check_parquet()?;
        let series = self.series;
        let plan = series.plan(0)?;
        let document = series.document(&plan, renderer.info())?;
        SetFolder::check(self.out, &document)?;
        let all = || (0..series.worlds()).flat_map(|k| series.part_numbers(k).map(move |n| (k, series.part(k, n))));
        let mine = || all().filter(|(_, part)| part.number % self.shard.1 == self.shard.0 - 1);
        let pending: Vec<(usize, Part)> = mine().filter(|(_, part)| !is_whole(self.out, *part)).collect();
        let (all_frames, missing) =
            (mine().map(|(_, p)| p.count).sum::<usize>(), pending.iter().map(|(_, p)| p.count).sum::<usize>());
        let job = Job { plan: &plan, out: self.out, shard: self.shard, extras: self.extras };
        let example = job.prepare(&plan.stages[0], &Scene::new(&plan.world)?, renderer)?;
        job.check_room(example.witness.home(), missing)?;
        let folder = SetFolder::claim(self.out, document, self.shard)?;
        let mut rest = Record::default();
        for (name, bytes) in (self.extras)(series.request.layout.layout(), &folder.document, example.witness.home())? {
            rest.files.push(folder.write(&name, &bytes)?);
        }
        drop(example);
        let mut progress = Progress { done: all_frames - missing, all: all_frames };
        if watch(progress).is_break() {
            return Err(Error::Interrupted);
        }
        for parts in pending.chunk_by(|a, b| a.0 == b.0) {
            let k = parts[0].0;
            let parts: Vec<Part> = parts.iter().map(|(_, part)| *part).collect();
            self.make_world(&folder, k, &parts, renderer, &mut progress, watch)?;
        }
        let complete = all().all(|(_, part)| folder.is_done(part));
        if complete {
            let mut lists = vec![("left-out.csv".to_owned(), LEFT_OUT.to_owned())];
            lists.extend(self.lists(&folder.document)?);
            for (name, text) in lists {
                rest.files.push(folder.write(&name, text.as_bytes())?);
            }
            folder.finish(&rest)?;
        }
        Ok(Outcome { rendered: missing, found: all_frames - missing, complete })
    }

    /// Makes some parts of world `k`.
    fn make_world(
        &self,
        folder: &SetFolder,
        k: usize,
        parts: &[Part],
        renderer: &mut dyn Renderer,
        progress: &mut Progress,
        watch: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> Result<()> {
        let plan = self.series.plan(k)?;
        let job = Job { plan: &plan, out: self.out, shard: self.shard, extras: self.extras };
        let base = Scene::new(&plan.world)?;
        for parts in parts.chunk_by(|a, b| a.stage == b.stage) {
            let stage = &plan.stages[parts[0].stage];
            let set = job.prepare(stage, &base, renderer)?;
            // With the first part of a condition go its home panorama and, once, what is told of the world.
            let mut beside: Vec<FileRecord> = Vec::new();
            if parts[0].first == 0 {
                let condition = stage.staged.condition.name();
                let mut files = home_pictures(set.witness.home(), &format!("home/{condition}/{k:06}"))?;
                if let Some(about) = plan.world_document().filter(|_| parts[0].stage == 0) {
                    files.push((format!("worlds/{k:06}.json"), json(&about).into_bytes()));
                }
                for (name, bytes) in files {
                    beside.push(folder.write(&name, &bytes)?);
                }
            }
            for (n, parts) in parts.chunks(BATCH).enumerate() {
                let beside = if n == 0 { &beside[..] } else { &[] };
                job.make(folder, &set, parts, beside, renderer, progress, watch)?;
            }
        }
        Ok(())
    }

    /// What the layout keeps beside the pictures. Each world is opened once more, where the layout has such lists at all.
    fn lists(&self, document: &Document) -> Result<Vec<(String, String)>> {
        let layout = self.series.request.layout.layout();
        if layout.lists(document, &|_| Vec::new()).is_empty() {
            return Ok(Vec::new());
        }
        let mut frames: Vec<Vec<Frame>> = vec![Vec::new(); document.conditions.len()];
        for k in 0..self.series.worlds() {
            let plan = self.series.plan(k)?;
            for (stage, frames) in frames.iter_mut().enumerate() {
                frames.extend(plan.stage_frames(stage));
            }
        }
        Ok(layout.lists(document, &|stage| frames[stage].clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::conditions::Condition;

    #[test]
    fn parts_are_those_of_the_plans() {
        let request = |count: usize| Request {
            places: Places::Random(count),
            headings: Headings::Random(3),
            conditions: vec![Condition::original(), "night+moved".parse().unwrap()],
            size_px: Some((64, 8)),
            layout: LayoutKind::Folder,
            seed: 2,
            licence: String::new(),
            command: String::new(),
        };
        for count in [4, 150, 263] {
            let series = Series::new("bare:1..3,office:5", request(count)).unwrap();
            let mut number = 0;
            for k in 0..4 {
                let plan = series.plan(k).unwrap();
                let parts: Vec<Part> = series.part_numbers(k).map(|n| series.part(k, n)).collect();
                assert_eq!(parts, plan.parts);
                assert!(plan.parts.iter().all(|p| p.number >= number));
                number += plan.parts.len();
                let frames: Vec<Frame> = plan.stage_frames(1).collect();
                assert_eq!((frames[0].spot, frames.len()), (series.spots(k), series.spots(k + 1) - series.spots(k)));
                assert_eq!(frames[0].number, 3 * count + frames[0].spot);
                assert_eq!(plan.left_out(), 0, "furniture that is moved stands on no place");
            }
            assert_eq!((number, series.frames()), (series.parts(), 2 * 3 * count));
        }
        assert!(Series::new("bare:1..9", request(8)).unwrap_err().to_string().contains("8 for 9 worlds"));
    }
}
