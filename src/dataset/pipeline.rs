//! From a plan to files: render, take, encode and write, all at the same time.
//!
//! While pictures are rendered ([`Renderer::render_batch`]), those that are there go through the camera, their truth is found and
//! their files are encoded and hashed, each picture on one thread of the pool; a thread of its own writes files that are done,
//! in the frames' order. What is in memory at once does not grow with the set: the panoramas of a batch
//! ([`crate::render::most_in_memory`]), the encoded files of half of them, at most 32 frames or some 64 MiB that wait to be
//! written, the truth of one part, and the scene and home panorama of one condition. Only the plan's poses grow with the set,
//! some 50 bytes each.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use rayon::prelude::*;

use super::parts::{FileRecord, Record, SetFolder, card_record_name, record_name};
use super::plan::{Part, Plan, Stage};
use super::truth::{TrueMatch, Witness, json, tables};
use crate::error::{Error, Result};
use crate::geometry::Twist;
use crate::panorama::Panorama;
use crate::panorama_set::{
    Document, Frame, FrameTruth, Layout, Names, Shard, database_line, database_name, encode_grey, encode_instance,
    encode_range, encode_rgb, entries_csv, metadata_yaml, mirror, shard_name,
};
use crate::random::Seed;
use crate::render::{Camera, Renderer, Scene, View};
use crate::storage::{GrowingFile, free_bytes, io_error, sha256};

/// Most frames that wait to be written: fewer, and threads stand still while the file system is busy.
const QUEUE: usize = 32;
/// Most bytes that these may take, roughly.
const QUEUE_BYTES: usize = 64 << 20;
/// Bytes of a pixel in the files of a frame, roughly.
const FILE_BYTES: usize = 2;
/// Parts whose views are handed to the renderer at once.
const BATCH: usize = 32;
/// What a set may need beyond the estimate from one panorama, as pictures differ.
const RESERVE: f64 = 1.3;
/// Bytes of truth a frame, roughly.
const TRUTH_BYTES: usize = 24_000;

/// How far the work is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Frames that are there, those of earlier runs included.
    pub done: usize,
    /// Frames of this shard.
    pub all: usize,
}

/// What a run came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// Frames that this run rendered.
    pub rendered: usize,
    /// Frames that were there already.
    pub found: usize,
    /// Whether all parts of the set are there and its sums are written.
    pub complete: bool,
}

/// What goes with a set beside its frames: made of its document and the home panoramas, by name.
pub type Extras<'a> = &'a (dyn Fn(&Document, &Panorama) -> Result<Vec<(String, Vec<u8>)>> + Sync);

/// A set in the making.
pub struct Job<'a> {
    /// What it will be.
    pub plan: &'a Plan,
    /// Its folder.
    pub out: &'a Path,
    /// Which share of the parts this run makes: number, from 1, and count.
    pub shard: (usize, usize),
    /// Files to add, made of the document and the first condition's home panorama.
    pub extras: Extras<'a>,
}

/// A condition made ready.
struct Set<'a> {
    scene: Scene,
    camera: Camera,
    witness: Witness<'a>,
}

impl Job<'_> {
    /// Makes what is missing of the set. `watch` is called when the first scene is packed, then now and then; it stops the work with
    /// `Break`.
    ///
    /// # Errors
    /// When the folder holds something else, there is not enough room on its disk, the renderer fails, a file cannot be written, or
    /// `watch` breaks. What is there then is whole, and the same job goes on where this one was.
    pub fn run(
        &self,
        renderer: &mut dyn Renderer,
        watch: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> Result<Outcome> {
        let plan = self.plan;
        let document = plan.document(renderer.info());
        SetFolder::check(self.out, &document)?;
        let base = Scene::new(&plan.world)?;
        let first = self.prepare(&plan.stages[0], &base, renderer)?;
        let mine = |part: &&Part| part.number % self.shard.1 == self.shard.0 - 1;
        let record_there = |part: &&Part| super::parts::is_whole(self.out, &record_name(part.number));
        let missing: usize = plan.parts.iter().filter(mine).filter(|p| !record_there(p)).map(|p| p.count).sum();
        self.check_room(first.witness.home(), missing)?;
        let folder = SetFolder::claim(self.out, &document, self.shard)?;
        let pending: Vec<Part> = plan.parts.iter().filter(mine).filter(|p| !folder.is_done(**p)).copied().collect();
        let all: usize = plan.parts.iter().filter(mine).map(|p| p.count).sum();
        let found = all - pending.iter().map(|p| p.count).sum::<usize>();
        let mut progress = Progress { done: found, all };
        if watch(progress).is_break() {
            return Err(Error::Interrupted);
        }
        let mut ready = Some(first);
        let mut homes = Record::default();
        for (k, stage) in plan.stages.iter().enumerate() {
            let set = match ready.take() {
                Some(set) => set,
                None => self.prepare(stage, &base, renderer)?,
            };
            homes.files.extend(write_home(&folder, stage, set.witness.home())?);
            if k == 0 {
                for (name, bytes) in (self.extras)(&document, set.witness.home())? {
                    homes.files.push(folder.write(&name, &bytes)?);
                }
            }
            let parts: Vec<Part> = pending.iter().filter(|p| p.stage == k).copied().collect();
            for parts in parts.chunks(BATCH) {
                self.make(&folder, &document, &set, parts, renderer, &mut progress, watch)?;
            }
        }
        let complete = plan.parts.iter().all(|part| folder.is_done(*part));
        if complete {
            homes.files.extend(self.write_lists(&folder, &document)?);
            folder.commit(&card_record_name(), &homes)?;
            folder.finish(plan.parts.len())?;
        }
        Ok(Outcome { rendered: all - found, found, complete })
    }

    /// Packs the scene of a condition and takes its home panorama.
    fn prepare<'s>(&self, stage: &'s Stage, base: &Scene, renderer: &mut dyn Renderer) -> Result<Set<'s>> {
        let staged = &stage.staged;
        let scene = if staged.world == self.plan.world { base.clone() } else { Scene::new(&staged.world)? };
        let scene = scene.under(staged.light, staged.optics.exposure);
        let mut camera = Camera::new(staged.optics);
        let (mut home, bodies) = (Panorama::empty(), staged.world.body_poses());
        let view = View { projection: self.plan.projection, robot: staged.world.home, bodies: &bodies };
        let noise = self.noise(&format!("home {}", staged.condition.given()));
        camera.take(renderer, &scene, &view, Twist::default(), noise, &mut home)?;
        Ok(Set { scene, camera, witness: Witness::new(&staged.world, home) })
    }

    fn noise(&self, frame: &str) -> Seed {
        Seed(self.plan.request().seed).derive("dataset/camera").derive(frame)
    }

    /// Refuses a set for which there is no room.
    fn check_room(&self, home: &Panorama, frames: usize) -> Result<()> {
        let frame_bytes =
            encode_rgb(home, "home")?.len() + encode_range(home, "home")?.len() + encode_instance(home, "home")?.len();
        let needed = (RESERVE * (frame_bytes + TRUTH_BYTES) as f64 * frames as f64) as u64;
        // The nearest folder above that is there already.
        let there = self.out.ancestors().find(|p| p.is_dir()).unwrap_or(Path::new("."));
        let there = if there.as_os_str().is_empty() { Path::new(".") } else { there };
        match free_bytes(there) {
            Some(free) if needed > free => Err(Error::Invalid {
                what: format!("room on the disk of {}", self.out.display()),
                found: format!("{} MB free", free / 1_000_000),
                allowed: format!("{} MB, which {frames} frames of about {} kB take", needed / 1_000_000, frame_bytes / 1000),
            }),
            _ => Ok(()),
        }
    }

    /// Makes some parts of one condition.
    #[allow(clippy::too_many_arguments, reason = "all of them are what a run is about")]
    fn make(
        &self,
        folder: &SetFolder,
        document: &Document,
        set: &Set<'_>,
        parts: &[Part],
        renderer: &mut dyn Renderer,
        progress: &mut Progress,
        watch: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> Result<()> {
        let plan = self.plan;
        let frames: Vec<Frame> = parts.iter().flat_map(|p| plan.part_frames(*p)).collect();
        let bodies = plan.stages[parts[0].stage].staged.world.body_poses();
        let views: Vec<View<'_>> =
            frames.iter().map(|f| View { projection: plan.projection, robot: f.robot, bodies: &bodies }).collect();
        let layout = plan.request().layout;
        let queue = (QUEUE_BYTES / (FILE_BYTES * plan.projection.pixels())).clamp(2, QUEUE);
        let (sender, receiver) = sync_channel::<Encoded>(queue);
        let writer = Writer { folder, document, layout };
        std::thread::scope(|scope| {
            let writing = scope.spawn(move || writer.write_parts(parts, &condition_names(plan, parts), &receiver));
            let rendered = renderer.render_batch(&set.scene, &views, &mut |first, panoramas| {
                if watch(*progress).is_break() {
                    return Err(Error::Interrupted);
                }
                let numbered = panoramas.par_iter_mut().zip(&frames[first..]).with_max_len(1);
                let noise = |frame: &Frame| self.noise(&format!("frame {}", frame.number));
                let encoded: Vec<Encoded> = numbered
                    .map_init(
                        || set.camera.clone(),
                        |camera, (panorama, frame)| {
                            camera.develop(panorama, noise(frame));
                            encode(&set.witness, frame, layout.names(frame, document), layout, panorama)
                        },
                    )
                    .collect::<Result<_>>()?;
                progress.done += panoramas.len();
                send(&sender, encoded)
            });
            drop(sender);
            let written = writing.join().unwrap_or_else(|_| Err(Error::Threads("the writing thread failed".into())));
            // Where writing failed, rendering was stopped by that alone.
            match (rendered, written) {
                (Err(error @ Error::Interrupted), _) | (Err(error), Ok(())) | (_, Err(error)) => Err(error),
                (Ok(()), Ok(())) => Ok(()),
            }
        })?;
        // Told once more when the last files are in their places.
        if watch(*progress).is_break() { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// Lists that a layout has beside its pictures, and that of the poses left out.
    fn write_lists(&self, folder: &SetFolder, document: &Document) -> Result<Vec<FileRecord>> {
        let mut files = vec![folder.write("left-out.csv", self.plan.left_out_csv().as_bytes())?];
        match document.layout {
            Layout::ImageDatabase => {
                for (k, stage) in self.plan.stages.iter().enumerate() {
                    let name = stage.staged.condition.name();
                    if document.conditions[k].frames == 0 {
                        continue;
                    }
                    let table = entries_csv(&self.plan.stage_frames(k).collect::<Vec<_>>(), document);
                    let file = |file: &str| format!("{name}/{file}");
                    files.push(folder.write(&file(crate::panorama_set::ENTRIES), table.as_bytes())?);
                    files.push(folder.write(&file(crate::panorama_set::METADATA), metadata_yaml(document).as_bytes())?);
                }
            }
            Layout::Moeller => files.push(folder.write(&database_name(document), database_line(document).as_bytes())?),
            _ => {}
        }
        Ok(files)
    }
}

fn condition_names(plan: &Plan, parts: &[Part]) -> Vec<String> {
    parts.iter().map(|p| plan.stages[p.stage].staged.condition.name()).collect()
}

fn send(sender: &SyncSender<Encoded>, frames: Vec<Encoded>) -> Result<()> {
    // The receiver is gone only when writing has failed, which the writing thread tells.
    let sent = |frame| sender.send(frame).map_err(|_| Error::Threads("the writing thread ended".into()));
    frames.into_iter().try_for_each(sent)
}

/// A frame that waits to be written.
struct Encoded {
    files: Vec<(String, Vec<u8>, String)>,
    truth: FrameTruth,
    matches: Vec<TrueMatch>,
}

/// The files of a frame. The panorama is left with its columns as the layout has them.
fn encode(witness: &Witness<'_>, frame: &Frame, names: Names, layout: Layout, panorama: &mut Panorama) -> Result<Encoded> {
    let truth = witness.frame(frame, panorama);
    let matches = witness.matches(frame, panorama);
    if layout.is_clockwise() {
        mirror(panorama);
    }
    let image = if layout.is_grey() { encode_grey(panorama) } else { encode_rgb(panorama, &names.image)? };
    let range = encode_range(panorama, &names.range)?;
    let instance = encode_instance(panorama, &names.instance)?;
    let mut files = vec![(names.image, image), (names.range, range), (names.instance, instance)];
    if let Some(name) = names.truth {
        files.push((name, json(&truth)?));
    }
    // Archives are hashed as a whole while they are written.
    let alone = layout != Layout::Webdataset;
    let hashed = |(name, bytes): (String, Vec<u8>)| {
        let sum = if alone { sha256(&bytes) } else { String::new() };
        (name, bytes, sum)
    };
    Ok(Encoded { files: files.into_iter().map(hashed).collect(), truth, matches })
}

/// Writes a home panorama: colours, range and instances, columns anti-clockwise in every layout.
fn write_home(folder: &SetFolder, stage: &Stage, home: &Panorama) -> Result<Vec<FileRecord>> {
    let name = |channel: &str| format!("home/{}.{channel}.png", stage.staged.condition.name());
    let (rgb, range, instance) = (name("rgb"), name("range"), name("instance"));
    let bytes = [encode_rgb(home, &rgb)?, encode_range(home, &range)?, encode_instance(home, &instance)?];
    [rgb, range, instance].iter().zip(bytes).map(|(name, bytes)| folder.write(name, &bytes)).collect()
}

/// What the writing thread knows.
struct Writer<'a> {
    folder: &'a SetFolder,
    document: &'a Document,
    layout: Layout,
}

impl Writer<'_> {
    /// Writes parts as their frames come in. Ends without a fault where frames stop coming; a part that was begun is then given up.
    fn write_parts(&self, parts: &[Part], conditions: &[String], frames: &Receiver<Encoded>) -> Result<()> {
        for (part, condition) in parts.iter().zip(conditions) {
            let mut record = Record::default();
            let mut held = Vec::with_capacity(part.count);
            let mut archive = None;
            if self.layout == Layout::Webdataset {
                let name = shard_name(condition, part.number);
                archive = Some((name.clone(), Shard::new(GrowingFile::create(&self.folder.ready(&name)?)?)));
            }
            for _ in 0..part.count {
                let Ok(frame) = frames.recv() else { return Ok(()) };
                match &mut archive {
                    Some((name, shard)) => {
                        let broken = |e| io_error("write", &self.folder.path().join(&*name))(e);
                        for (member, bytes, _) in &frame.files {
                            shard.append(member, bytes).map_err(broken)?;
                        }
                    }
                    None => {
                        for (name, bytes, sha256) in frame.files {
                            let path = self.folder.ready(&name)?;
                            crate::storage::write_atomically(&path, &bytes)?;
                            record.files.push(FileRecord { path: name, bytes: bytes.len() as u64, sha256 });
                        }
                    }
                }
                held.push((frame.truth, frame.matches));
            }
            if let Some((path, shard)) = archive {
                let mut file = shard.into_inner().map_err(io_error("write", &self.folder.path().join(&path)))?;
                file.flush().map_err(io_error("write", &self.folder.path().join(&path)))?;
                let (sha256, bytes) = file.complete()?;
                record.files.push(FileRecord { path, bytes, sha256 });
            }
            let notes = [("command", self.document.command.clone()), ("version", self.document.version.clone())];
            for (name, bytes) in tables(&held, &notes)? {
                let (stem, ending) = name.split_once('.').unwrap_or((name, "bin"));
                record.files.push(self.folder.write(&format!("truth/{stem}-{:06}.{ending}", part.number), &bytes)?);
            }
            self.folder.commit(&record_name(part.number), &record)?;
        }
        Ok(())
    }
}
