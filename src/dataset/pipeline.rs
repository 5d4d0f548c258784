//! From a plan to files: render, take, encode and write, all at the same time.
//!
//! While pictures are rendered ([`Renderer::render_batch`]), those that are there go through the camera, their truth is found and
//! their files are encoded and hashed, each picture on one thread of the pool; a thread of its own writes files that are done,
//! in the frames' order. What is in memory at once does not grow with the set: the panoramas of a batch
//! ([`crate::render::most_in_memory`]), the encoded files of half of them, at most 32 frames or some 64 MiB that wait to be
//! written, the truth of one part, and the scene and home panorama of one condition. Only the plan's poses grow with the set,
//! some 50 bytes each.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::mpsc::{Receiver, sync_channel};

use rayon::prelude::*;

use super::parts::{FileRecord, Record, SetFolder, is_whole};
use super::plan::{Part, Plan, Stage};
use super::truth::{TrueMatch, Witness, json, tables};
use crate::error::{Error, Result, go_on};
use crate::geometry::Twist;
use crate::panorama::Panorama;
use crate::panorama_set::{
    Document, Frame, FrameTruth, Layout, encode_grey, encode_instance, encode_range, encode_rgb, mirror,
};
use crate::random::Seed;
use crate::render::{Camera, Renderer, Scene, View};
use crate::storage::{GrowingFile, check_room, io_error, sha256};

/// Most frames that wait to be written: fewer, and threads stand still while the file system is busy.
const QUEUE: usize = 32;
/// Most bytes that these may take, roughly.
const QUEUE_BYTES: usize = 64 << 20;
/// Bytes of a pixel in the files of a frame, roughly.
const FILE_BYTES: usize = 2;
/// Parts whose views are handed to the renderer at once.
pub(super) const BATCH: usize = 32;
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

/// What goes with a set beside its frames: made of its layout, its document and the first condition's home panorama, by name.
pub type Extras<'a> = &'a (dyn Fn(&dyn Layout, &Document, &Panorama) -> Result<Vec<(String, Vec<u8>)>> + Sync);

/// A set in the making.
pub struct Job<'a> {
    /// What it will be.
    pub plan: &'a Plan,
    /// Its folder.
    pub out: &'a Path,
    /// Which share of the parts this run makes: number, from 1, and count.
    pub shard: (usize, usize),
    /// Files to add.
    pub extras: Extras<'a>,
}

/// A condition made ready.
pub(super) struct Set<'a> {
    scene: Scene,
    camera: Camera,
    pub(super) witness: Witness<'a>,
}

/// The files of a home panorama, whose columns run anti-clockwise in every layout.
pub(super) fn home_pictures(home: &Panorama, stem: &str) -> Result<Vec<(String, Vec<u8>)>> {
    let [rgb, range, instance] = ["rgb", "range", "instance"].map(|channel| format!("{stem}.{channel}.png"));
    let pictures = [encode_rgb(home, &rgb)?, encode_range(home, &range)?, encode_instance(home, &instance)?];
    Ok([rgb, range, instance].into_iter().zip(pictures).collect())
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
        crate::table::Table::check_parquet()?;
        let plan = self.plan;
        let document = plan.document(renderer.info());
        SetFolder::check(self.out, &document)?;
        let base = Scene::new(&plan.world)?;
        let mut first = Some(self.prepare(&plan.stages[0], &base, renderer)?);
        let mine: Vec<Part> = plan.parts.iter().filter(|p| p.number % self.shard.1 == self.shard.0 - 1).copied().collect();
        let pending: Vec<Part> = mine.iter().filter(|p| !is_whole(self.out, **p)).copied().collect();
        let frames = |parts: &[Part]| parts.iter().map(|p| p.count).sum::<usize>();
        let (all, missing) = (frames(&mine), frames(&pending));
        if let Some(set) = &first {
            self.check_room(set.witness.home(), missing)?;
        }
        let folder = SetFolder::claim(self.out, document, self.shard)?;
        let mut progress = Progress { done: all - missing, all };
        go_on(watch(progress))?;
        let mut rest = Record::default();
        for (k, stage) in plan.stages.iter().enumerate() {
            let set = first.take().map_or_else(|| self.prepare(stage, &base, renderer), Ok)?;
            let home = set.witness.home();
            let mut beside = home_pictures(home, &format!("home/{}", stage.staged.condition.name()))?;
            if k == 0 {
                beside.extend((self.extras)(plan.request().layout.layout(), &folder.document, home)?);
            }
            for (name, bytes) in beside {
                rest.files.push(folder.write(&name, &bytes)?);
            }
            let parts: Vec<Part> = pending.iter().filter(|p| p.stage == k).copied().collect();
            for parts in parts.chunks(BATCH) {
                self.make(&folder, &set, parts, &[], renderer, &mut progress, watch)?;
            }
        }
        let complete = plan.parts.iter().all(|part| folder.is_done(*part));
        if complete {
            let lists = plan.request().layout.layout().lists(&folder.document, &|stage| plan.stage_frames(stage).collect());
            for (name, text) in std::iter::once(("left-out.csv".to_owned(), plan.left_out_csv())).chain(lists) {
                rest.files.push(folder.write(&name, text.as_bytes())?);
            }
            folder.finish(&rest)?;
        }
        Ok(Outcome { rendered: missing, found: all - missing, complete })
    }

    /// Packs the scene of a condition and takes its home panorama.
    pub(super) fn prepare<'s>(&self, stage: &'s Stage, base: &Scene, renderer: &mut dyn Renderer) -> Result<Set<'s>> {
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
    pub(super) fn check_room(&self, home: &Panorama, frames: usize) -> Result<()> {
        let frame_bytes =
            encode_rgb(home, "home")?.len() + encode_range(home, "home")?.len() + encode_instance(home, "home")?.len();
        let needed = (RESERVE * (frame_bytes + TRUTH_BYTES) as f64 * frames as f64) as u64;
        // The nearest folder above that is there already.
        let there = self.out.ancestors().find(|p| p.is_dir()).unwrap_or(Path::new("."));
        let there = if there.as_os_str().is_empty() { Path::new(".") } else { there };
        let whose = format!("{frames} frames of about {} kB", frame_bytes / 1000);
        check_room(there, needed, &format!("{}, for {whose}", self.out.display()))
    }

    /// Makes some parts of one condition. Files that were written `beside` go into the record of the first of them.
    #[allow(clippy::too_many_arguments, reason = "what a run has at hand, each of its own kind")]
    pub(super) fn make(
        &self,
        folder: &SetFolder,
        set: &Set<'_>,
        parts: &[Part],
        beside: &[FileRecord],
        renderer: &mut dyn Renderer,
        progress: &mut Progress,
        watch: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> Result<()> {
        let plan = self.plan;
        let frames: Vec<Frame> = parts.iter().flat_map(|p| plan.part_frames(*p)).collect();
        let bodies = plan.stages[parts[0].stage].staged.world.body_poses();
        let views: Vec<View<'_>> =
            frames.iter().map(|f| View { projection: plan.projection, robot: f.robot, bodies: &bodies }).collect();
        let queue = (QUEUE_BYTES / (FILE_BYTES * plan.projection.pixels())).clamp(2, QUEUE);
        let (sender, receiver) = sync_channel::<Encoded>(queue);
        std::thread::scope(|scope| {
            let writing = scope.spawn(move || self.write_parts(folder, parts, beside, &receiver));
            let rendered = renderer.render_batch(&set.scene, &views, &mut |first, panoramas| {
                go_on(watch(*progress))?;
                let numbered = panoramas.par_iter_mut().zip(&frames[first..]).with_max_len(1);
                let encoded: Vec<Encoded> = numbered
                    .map_init(
                        || set.camera.clone(),
                        |camera, (panorama, frame)| {
                            camera.develop(panorama, self.noise(&format!("frame {}", frame.number)));
                            self.encode(&folder.document, &set.witness, frame, panorama)
                        },
                    )
                    .collect::<Result<_>>()?;
                progress.done += panoramas.len();
                // The receiver is gone only when writing has failed, which the writing thread tells.
                let send = |frame| sender.send(frame).map_err(|_| Error::Threads("the writing thread ended".into()));
                encoded.into_iter().try_for_each(send)
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
        go_on(watch(*progress))
    }

    /// The files of a frame. The panorama is left with its columns as the layout has them.
    fn encode(&self, set: &Document, witness: &Witness<'_>, frame: &Frame, panorama: &mut Panorama) -> Result<Encoded> {
        let layout = self.plan.request().layout.layout();
        let names = layout.names(frame, set);
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
        // An archive is hashed as a whole while it is written.
        let alone = layout.archive(&frame.condition, 0).is_none();
        let hashed = |(name, bytes): (String, Vec<u8>)| {
            let sum = if alone { sha256(&bytes) } else { String::new() };
            (name, bytes, sum)
        };
        Ok(Encoded { files: files.into_iter().map(hashed).collect(), truth, matches })
    }

    /// Writes parts as their frames come in. Ends without a fault where frames stop coming; a part that was begun is then given up.
    fn write_parts(&self, folder: &SetFolder, parts: &[Part], beside: &[FileRecord], frames: &Receiver<Encoded>) -> Result<()> {
        for (k, part) in parts.iter().enumerate() {
            let condition = self.plan.stages[part.stage].staged.condition.name();
            let mut record = Record { files: if k == 0 { beside.to_vec() } else { Vec::new() } };
            let mut held = Vec::with_capacity(part.count);
            let mut archive = None;
            if let Some(name) = self.plan.request().layout.layout().archive(&condition, part.number) {
                let path = folder.ready(&name)?;
                archive = Some((name, tar::Builder::new(GrowingFile::create(&path)?), path));
            }
            for _ in 0..part.count {
                let Ok(frame) = frames.recv() else { return Ok(()) };
                for (name, bytes, sum) in frame.files {
                    match &mut archive {
                        Some((_, tar, path)) => append(tar, &name, &bytes).map_err(io_error("write", path))?,
                        None => record.files.push(folder.write_hashed(name, &bytes, sum)?),
                    }
                }
                held.push((frame.truth, frame.matches));
            }
            if let Some((name, tar, path)) = archive {
                let (sha256, bytes) = tar.into_inner().map_err(io_error("write", &path))?.complete()?;
                record.files.push(FileRecord { path: name, bytes, sha256 });
            }
            let notes = [("command", folder.document.command.clone()), ("version", folder.document.version.clone())];
            for (name, bytes) in tables(&held, &notes)? {
                let (stem, ending) = name.split_once('.').unwrap_or((name, "bin"));
                record.files.push(folder.write(&format!("truth/{stem}-{:06}.{ending}", part.number), &bytes)?);
            }
            folder.commit(*part, &record)?;
        }
        Ok(())
    }
}

/// A frame that waits to be written.
struct Encoded {
    /// Name, bytes and SHA-256 of each file.
    files: Vec<(String, Vec<u8>, String)>,
    truth: FrameTruth,
    matches: Vec<TrueMatch>,
}

/// Appends a member without time or owner, so that the same frames are the same bytes.
fn append(tar: &mut tar::Builder<GrowingFile>, name: &str, bytes: &[u8]) -> std::io::Result<()> {
    let mut header = tar::Header::new_ustar();
    header.set_size(bytes.len() as u64);
    header.set_mode(0o644);
    header.set_mtime(0);
    header.set_path(name)?;
    header.set_cksum();
    tar.append(&header, bytes)
}
