//! A run as an MCAP file with Foxglove's schemas.
//!
//! Frames follow REP-105: `map` is the room, `odom` where odometry counts from (the true start), `base_link` the robot, `camera`
//! what it looks with, and `home` the home pose, in which the estimate is. The way from `map` to `odom` is what a perfect
//! localiser would tell, so that `base_link` is where the robot truly is.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use foxglove::Encode;
use foxglove::messages::{CompressedImage, FrameTransform, FrameTransforms, Log, Pose as FoxglovePose, PoseInFrame, log};
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use schemars::JsonSchema;
use serde::Serialize;

use super::file::{self, MAKER};
use super::messages::{self, Command, Diagnostics, nanoseconds, timestamp, turn, vector};
use super::scene;
use crate::draw::image::colours_jpeg;
use crate::episode::{Belief, CollisionRecord, Moment, Record, Recorder, Summary};
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::observation::{HomeSnapshot, LandmarkId};
use crate::panorama::Panorama;
use crate::storage::PartialFile;
use crate::world::World;

/// First bytes of such a file.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Quality of panoramas: a fifth of what they take as PNG, and no difference to be seen.
const JPEG_QUALITY: u8 = 90;

/// A growing MCAP file.
pub(super) struct McapRecording<'a> {
    world: &'a World,
    /// Until the run has ended.
    tape: Option<Tape>,
    home_ids: Vec<LandmarkId>,
    bodies: Vec<Pose>,
    /// True pose at the first step.
    start: Option<Pose>,
    believed: bool,
    last_ns: u64,
}

impl<'a> McapRecording<'a> {
    pub(super) fn create(world: &'a World, path: &Path) -> Result<Self> {
        let tape = Tape::create(path)?;
        let bodies = world.body_poses();
        Ok(Self { world, tape: Some(tape), home_ids: Vec::new(), bodies, start: None, believed: false, last_ns: 0 })
    }
}

impl Recorder for McapRecording<'_> {
    fn begin(&mut self, home: &HomeSnapshot, panorama: Option<&Panorama>) -> Result<()> {
        let Some(tape) = &mut self.tape else { return Ok(()) };
        self.home_ids = home.bearings.iter().map(|b| b.id).collect();
        self.home_ids.sort_unstable();
        let camera = self.world.camera_pose(&Pose::IDENTITY);
        let fixed = [
            transform(0, "map", "home", &self.world.home, 0.0),
            transform(0, "base_link", "camera", &camera, self.world.spec.camera.height_m),
        ];
        tape.put("/tf", 0, &FrameTransforms { transforms: fixed.to_vec() })?;
        tape.put("/room", 0, &scene::room(self.world))?;
        tape.put("/home/bearings", 0, &scene::bearings(&home.bearings, |_| true, 0))?;
        if let Some(panorama) = panorama {
            tape.put("/home/panorama", 0, &picture(panorama, 0)?)?;
        }
        Ok(())
    }

    fn record(&mut self, moment: &Moment<'_>) -> Result<()> {
        let Some(tape) = &mut self.tape else { return Ok(()) };
        let step = moment.step;
        let time_ns = nanoseconds(step.time_s);
        self.last_ns = time_ns;
        for hit in CollisionRecord::list(moment.collisions, self.world) {
            let message = format!("hit {} at {:.3} s with {:.3} N s", hit.with, hit.time_s, hit.impulse_n_s);
            tape.put("/log", time_ns, &line(time_ns, log::Level::Warning, message))?;
        }
        let start = *self.start.get_or_insert(step.truth);
        let in_odom = start.to_local(&step.dead_reckoned);
        let map_to_odom = step.truth.compose(&in_odom.to_local(&Pose::IDENTITY));
        let transforms =
            vec![transform(time_ns, "map", "odom", &map_to_odom, 0.0), transform(time_ns, "odom", "base_link", &in_odom, 0.0)];
        tape.put("/tf", time_ns, &FrameTransforms { transforms })?;
        tape.put("/truth", time_ns, &in_frame(time_ns, "map", messages::pose(&step.truth, 0.0)))?;
        tape.put("/odometry", time_ns, &messages::odometry(time_ns, "odom", &in_odom, step.odometry))?;
        if let Some(estimate) = &step.estimate {
            tape.put("/estimate", time_ns, &messages::estimate(time_ns, estimate))?;
            let pose = messages::pose(&estimate.pose, 0.0);
            tape.put("/estimate/pose", time_ns, &in_frame(time_ns, "home", pose))?;
        }
        // An estimate that is gone is taken off the scene once.
        if step.estimate.is_some() || self.believed {
            tape.put("/estimate/ellipse", time_ns, &scene::ellipse(step.estimate.as_ref(), time_ns))?;
        }
        let ever = self.believed || step.estimate.is_some();
        let belief = match (step.estimate.is_some(), ever) {
            _ if step.seen.is_none() => None,
            (true, _) => Some(Belief::Homing),
            (false, true) => Some(Belief::Lost),
            (false, false) => Some(Belief::Searching),
        };
        self.believed = ever;
        if step.seen.is_some() {
            let is_home = |b: &crate::observation::Bearing| self.home_ids.binary_search(&b.id).is_ok();
            tape.put("/bearings", time_ns, &scene::bearings(moment.bearings, is_home, time_ns))?;
        }
        if let Some(panorama) = moment.panorama {
            tape.put("/panorama", time_ns, &picture(panorama, time_ns)?)?;
        }
        if let Some(update) = scene::moved(self.world, &self.bodies, moment.bodies, time_ns) {
            tape.put("/room", time_ns, &update)?;
            self.bodies.copy_from_slice(moment.bodies);
        }
        let command = Command { v_m_s: step.command.v, omega_rad_s: step.command.omega };
        tape.put_json("/command", time_ns, &command)?;
        tape.put_json("/diagnostics", time_ns, &Diagnostics::new(step, &self.world.home, belief))
    }

    fn finish(&mut self, _record: &Record, summary: &Summary) -> Result<()> {
        let Some(mut tape) = self.tape.take() else { return Ok(()) };
        let distance_cm = 100.0 * summary.final_distance_m;
        let mut message = format!("{}: {distance_cm:.1} cm from home", summary.outcome.name());
        if let Some(failure) = &summary.failure {
            message = format!("{message}; {failure}");
        }
        tape.put("/log", self.last_ns, &line(self.last_ns, log::Level::Info, message))?;
        let facts = [
            ("world", summary.world.clone()),
            ("world_sha256", summary.world_sha256.clone()),
            ("seed", summary.seed.to_string()),
            ("method", summary.setup.method.to_string()),
            ("version", summary.version.to_owned()),
        ];
        tape.note("run", facts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())?;
        tape.complete()
    }
}

fn transform(time_ns: u64, parent: &str, child: &str, at: &Pose, z: f64) -> FrameTransform {
    FrameTransform {
        timestamp: Some(timestamp(time_ns)),
        parent_frame_id: parent.to_owned(),
        child_frame_id: child.to_owned(),
        translation: Some(vector(at.x, at.y, z)),
        rotation: Some(turn(at.heading)),
    }
}

fn in_frame(time_ns: u64, frame: &str, pose: FoxglovePose) -> PoseInFrame {
    PoseInFrame { timestamp: Some(timestamp(time_ns)), frame_id: frame.to_owned(), pose: Some(pose) }
}

fn line(time_ns: u64, level: log::Level, message: String) -> Log {
    Log { timestamp: Some(timestamp(time_ns)), level: level as i32, message, name: MAKER.to_owned(), ..Log::default() }
}

/// A panorama as JPEG.
fn picture(panorama: &Panorama, time_ns: u64) -> Result<CompressedImage> {
    let data = colours_jpeg(panorama, JPEG_QUALITY, u32::MAX, "panorama")?;
    Ok(CompressedImage {
        timestamp: Some(timestamp(time_ns)),
        frame_id: "camera".to_owned(),
        data: data.into(),
        format: "jpeg".to_owned(),
    })
}

/// The file with its channels; each is opened with its first message.
struct Tape {
    path: PathBuf,
    writer: Writer<PartialFile>,
    /// Channel and number of the next message, by topic.
    channels: BTreeMap<&'static str, (u16, u32)>,
    buffer: Vec<u8>,
}

impl Tape {
    fn create(path: &Path) -> Result<Self> {
        let file = file::create(path, MAGIC)?;
        let writer = WriteOptions::new().library(MAKER).create(file).map_err(|e| fault(path, e))?;
        Ok(Self { path: path.to_owned(), writer, channels: BTreeMap::new(), buffer: Vec::new() })
    }

    /// A message with a schema of Foxglove's.
    fn put<M: Encode>(&mut self, topic: &'static str, time_ns: u64, message: &M) -> Result<()> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        message.encode(&mut buffer).map_err(|e| Error::Io {
            action: "write",
            path: self.path.clone(),
            source: io::Error::other(e.to_string()),
        })?;
        self.write(topic, time_ns, buffer, &M::get_message_encoding(), || {
            M::get_schema().map(|s| (s.name, s.encoding, s.data.into_owned()))
        })
    }

    /// A message with a schema of the project's own.
    fn put_json<M: Serialize + JsonSchema>(&mut self, topic: &'static str, time_ns: u64, message: &M) -> Result<()> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        serde_json::to_writer(&mut buffer, message).map_err(|e| fault(&self.path, McapError::Io(e.into())))?;
        self.write(topic, time_ns, buffer, "json", || {
            let schema = serde_json::to_vec(&schemars::schema_for!(M)).ok()?;
            Some((format!("{MAKER}.{}", M::schema_name()), "jsonschema".to_owned(), schema))
        })
    }

    fn write(
        &mut self,
        topic: &'static str,
        time_ns: u64,
        data: Vec<u8>,
        encoding: &str,
        schema: impl FnOnce() -> Option<(String, String, Vec<u8>)>,
    ) -> Result<()> {
        let written = match self.channels.get(topic) {
            Some(known) => Ok(*known),
            None => schema()
                .map_or(Ok(0), |(name, encoding, data)| self.writer.add_schema(&name, &encoding, &data))
                .and_then(|schema| self.writer.add_channel(schema, topic, encoding, &BTreeMap::new()))
                .map(|channel| (channel, 0)),
        }
        .and_then(|(channel_id, sequence)| {
            self.channels.insert(topic, (channel_id, sequence + 1));
            let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
            self.writer.write_to_known_channel(&header, &data)
        });
        self.buffer = data;
        written.map_err(|e| fault(&self.path, e))
    }

    /// Facts about the whole run.
    fn note(&mut self, name: &str, metadata: BTreeMap<String, String>) -> Result<()> {
        let note = mcap::records::Metadata { name: name.to_owned(), metadata };
        self.writer.write_metadata(&note).map_err(|e| fault(&self.path, e))
    }

    fn complete(mut self) -> Result<()> {
        self.writer.finish().map_err(|e| fault(&self.path, e))?;
        self.writer.into_inner().complete()
    }
}

fn fault(path: &Path, error: McapError) -> Error {
    let source = match error {
        McapError::Io(source) => source,
        other => io::Error::other(other),
    };
    Error::Io { action: "write", path: path.to_owned(), source }
}
