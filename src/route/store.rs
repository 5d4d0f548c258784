//! Where routes are kept: by trait, with a file and memory to begin with, and the file's format.
//!
//! # The format
//!
//! | part | holds |
//! |---|---|
//! | `wayhome route 2\n` | the version |
//! | one line of JSON | the [`RouteSheet`], the numbers of nodes and snapshots, and the form: `full` or `small` |
//! | path | a node each: x and y less those of the node before in half millimetres, heading less the one before in 0.1 mrad; 16 bits each, signed |
//! | snapshots | each: node (32 bits), number of features (16 bits), features |
//! | a feature | track (32 bits), azimuth (16 bits, a turn is 65536), tangent of elevation (signed 16 bits, 1 is 8192), scale (8 bits, logarithmic), brightness and looseness (8 bits), descriptor (128 bytes; 16 in the small form) |
//! | SHA-256 | 32 bytes, of all that comes before |
//!
//! All numbers are little-endian. In the small form a descriptor keeps of each of its 128 numbers whether it is above the mean of the
//! descriptor, and a track 16 bits.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use crate::error::{Error, Result};
use crate::geometry::{Pose, wrap};
use crate::storage::{io_error, sha256, write_atomically};
use crate::vision::view::ViewFeature;

use super::chart::{KeptFeature, Route, RouteSheet, Snapshot};

/// Begins each file, with the version after it.
pub const HEAD: &str = "wayhome route ";
/// The version that is written, and the one that is read.
pub const VERSION: u32 = 2;

/// How much of a feature's looks a file keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Form {
    /// Descriptors of 128 bytes.
    #[default]
    Full,
    /// Descriptors of 128 bits.
    Small,
}

/// Where a route is kept.
pub trait SnapshotStore {
    /// Keeps a route in place of the one that was there, and tells its size in bytes.
    ///
    /// # Errors
    /// When it cannot be kept.
    fn keep(&mut self, route: &Route) -> Result<usize>;

    /// The route that is kept.
    ///
    /// # Errors
    /// When there is none, or it is damaged.
    fn recall(&self) -> Result<Route>;
}

/// A file.
#[derive(Debug, Clone)]
pub struct FileStore {
    /// Its path.
    pub path: PathBuf,
    /// What is kept.
    pub form: Form,
}

impl SnapshotStore for FileStore {
    fn keep(&mut self, route: &Route) -> Result<usize> {
        let bytes = to_bytes(route, self.form);
        write_atomically(&self.path, &bytes)?;
        Ok(bytes.len())
    }

    fn recall(&self) -> Result<Route> {
        from_bytes(&std::fs::read(&self.path).map_err(io_error("read", &self.path))?, &self.path)
    }
}

/// Memory: what a file would hold.
#[derive(Debug, Clone, Default)]
pub struct MemoryStore {
    bytes: Vec<u8>,
    /// What is kept.
    pub form: Form,
}

impl SnapshotStore for MemoryStore {
    fn keep(&mut self, route: &Route) -> Result<usize> {
        self.bytes = to_bytes(route, self.form);
        Ok(self.bytes.len())
    }

    fn recall(&self) -> Result<Route> {
        from_bytes(&self.bytes, Path::new("memory"))
    }
}

/// Steps of x and y, m, and of heading, rad.
const STEP: (f64, f64) = (5e-4, 1e-4);
/// Azimuths in a turn, and tangents in 1.
const ANGLE: (f64, f64) = (65536.0, 8192.0);
/// Least scale, rad, and the step of its logarithm.
const SCALE: (f64, f64) = (5e-4, 0.03);
/// Step of looseness above 1.
const LOOSENESS: f64 = 0.03;

/// The line of JSON.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    form: Form,
    nodes: usize,
    snapshots: usize,
    route: RouteSheet,
}

/// A route as a file has it.
#[must_use]
pub fn to_bytes(route: &Route, form: Form) -> Vec<u8> {
    let header = Header { form, nodes: route.path.len(), snapshots: route.snapshots.len(), route: route.sheet.clone() };
    let mut bytes = format!("{HEAD}{VERSION}\n{}\n", serde_json::to_string(&header).unwrap_or_default()).into_bytes();
    let mut last = Pose::IDENTITY;
    for pose in &route.path {
        let steps = [(pose.x - last.x) / STEP.0, (pose.y - last.y) / STEP.0, wrap(pose.heading - last.heading) / STEP.1];
        let steps = steps.map(|step| step.round().clamp(-32768.0, 32767.0) as i16);
        last = moved(&last, steps);
        bytes.extend(steps.into_iter().flat_map(i16::to_le_bytes));
    }
    for snapshot in &route.snapshots {
        bytes.extend((snapshot.node as u32).to_le_bytes());
        bytes.extend((snapshot.features.len() as u16).to_le_bytes());
        for kept in &snapshot.features {
            let feature = &kept.feature;
            match form {
                Form::Full => bytes.extend(kept.track.to_le_bytes()),
                Form::Small => bytes.extend((kept.track as u16).to_le_bytes()),
            }
            let turn = (wrap(feature.azimuth_rad) / std::f64::consts::TAU * ANGLE.0).round() as i64;
            bytes.extend((turn.rem_euclid(65536) as u16).to_le_bytes());
            bytes.extend(((feature.tan * ANGLE.1).round().clamp(-32768.0, 32767.0) as i16).to_le_bytes());
            bytes.push((libm::log(feature.scale_rad / SCALE.0) / SCALE.1).round().clamp(0.0, 255.0) as u8);
            let looseness = ((feature.looseness - 1.0) / LOOSENESS).round().clamp(0.0, 127.0) as u8;
            bytes.push(u8::from(feature.is_bright) << 7 | looseness);
            match form {
                Form::Full => bytes.extend(feature.descriptor),
                Form::Small => bytes.extend(outline(&feature.descriptor).to_le_bytes()),
            }
        }
    }
    let digest = sha256(&bytes);
    bytes.extend((0..32).filter_map(|k| u8::from_str_radix(&digest[2 * k..2 * k + 2], 16).ok()));
    bytes
}

/// The node after `last`.
fn moved(last: &Pose, [x, y, heading]: [i16; 3]) -> Pose {
    let [x, y] = [x, y].map(|step| f64::from(step) * STEP.0);
    Pose::new(last.x + x, last.y + y, last.heading + f64::from(heading) * STEP.1)
}

/// Reads a route; `source` names it in messages.
///
/// # Errors
/// When it is no route, of another version, cut off, or was changed.
pub fn from_bytes(bytes: &[u8], source: &Path) -> Result<Route> {
    let fault = |message: String| Error::Parse { path: source.to_owned(), message };
    let line = |from: usize| {
        let end = bytes.get(from..).and_then(|rest| rest.iter().take(65536).position(|b| *b == b'\n'));
        end.map(|length| (&bytes[from..from + length], from + length + 1))
    };
    let no_route =
        || fault(format!("found no line that begins with `{}`, expected a route of `wayhome route teach`", HEAD.trim_end()));
    let (first, rest) = line(0).ok_or_else(no_route)?;
    let version = std::str::from_utf8(first).ok().and_then(|text| text.strip_prefix(HEAD)).ok_or_else(no_route)?;
    if version != VERSION.to_string() {
        return Err(fault(format!("found version {version} of the format, expected {VERSION}: teach the route again")));
    }
    let cut = || fault(format!("found {} bytes, expected more: the file is cut off", bytes.len()));
    let (header, body) = line(rest).ok_or_else(cut)?;
    let header: Header = serde_json::from_slice(header).map_err(|e| fault(format!("line 2: {e}")))?;
    let split = bytes.len().checked_sub(32).filter(|end| *end >= body).ok_or_else(cut)?;
    let (held, digest) = bytes.split_at(split);
    let mut reader = Reader { bytes: &held[body..] };
    let route = read(&mut reader, header);
    let is_whole = sha256(held) == digest.iter().map(|b| format!("{b:02x}")).collect::<String>();
    match route {
        Some(route) if is_whole && reader.bytes.is_empty() => Ok(route),
        None if !is_whole => Err(cut()),
        _ => Err(fault("found contents that their checksum does not fit: the file was changed".into())),
    }
}

struct Reader<'b> {
    bytes: &'b [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.bytes.split_first_chunk::<N>()?;
        self.bytes = rest;
        Some(*head)
    }
}

fn read(reader: &mut Reader<'_>, header: Header) -> Option<Route> {
    let mut path: Vec<Pose> = Vec::new();
    let mut last = Pose::IDENTITY;
    for _ in 0..header.nodes {
        let mut step = || reader.take().map(i16::from_le_bytes);
        last = moved(&last, [step()?, step()?, step()?]);
        path.push(last);
    }
    let mut snapshots = Vec::new();
    for _ in 0..header.snapshots {
        let node = u32::from_le_bytes(reader.take()?) as usize;
        let count = u16::from_le_bytes(reader.take()?);
        let features = (0..count).map(|_| read_feature(reader, header.form)).collect::<Option<_>>()?;
        snapshots.push(Snapshot { node: (node < path.len()).then_some(node)?, features });
    }
    (!snapshots.is_empty()).then_some(Route { sheet: header.route, path, snapshots })
}

fn read_feature(reader: &mut Reader<'_>, form: Form) -> Option<KeptFeature> {
    let track = match form {
        Form::Full => u32::from_le_bytes(reader.take()?),
        Form::Small => u32::from(u16::from_le_bytes(reader.take()?)),
    };
    let azimuth = f64::from(u16::from_le_bytes(reader.take()?)) / ANGLE.0 * std::f64::consts::TAU;
    let tan = f64::from(i16::from_le_bytes(reader.take()?)) / ANGLE.1;
    let [scale, shape] = reader.take()?;
    let feature = ViewFeature {
        azimuth_rad: wrap(azimuth),
        tan,
        scale_rad: SCALE.0 * libm::exp(f64::from(scale) * SCALE.1),
        looseness: 1.0 + f64::from(shape & 127) * LOOSENESS,
        is_bright: shape >> 7 == 1,
        strength: 0.0,
        descriptor: [0; 128],
    };
    Some(KeptFeature {
        track,
        feature: match form {
            Form::Full => ViewFeature { descriptor: reader.take()?, ..feature },
            Form::Small => ViewFeature { descriptor: of_outline(u128::from_le_bytes(reader.take()?)), ..feature },
        },
    })
}

/// A bit for each number of a descriptor: whether it is above the mean of them all.
fn outline(descriptor: &[u8; 128]) -> u128 {
    let sum: u32 = descriptor.iter().map(|entry| u32::from(*entry)).sum();
    let above = |entry: u8| u128::from(u32::from(entry) * 128 > sum);
    descriptor.iter().enumerate().fold(0, |bits, (k, entry)| bits | above(*entry) << k)
}

/// Mean of a descriptor's numbers above its mean, and of those below, and the norm of them all.
const LEVELS: (f64, f64, f64) = (62.0, 18.0, 512.0);

/// What an outline tells of a descriptor: two levels, to the usual norm.
fn of_outline(bits: u128) -> [u8; 128] {
    let ones = f64::from(bits.count_ones());
    let norm = (ones * LEVELS.0 * LEVELS.0 + (128.0 - ones) * LEVELS.1 * LEVELS.1).sqrt().max(1.0);
    let [high, low] = [LEVELS.0, LEVELS.1].map(|level| (LEVELS.2 * level / norm).round().min(255.0) as u8);
    std::array::from_fn(|k| if bits >> k & 1 == 1 { high } else { low })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::Projection;
    use crate::route::rule::SnapshotRule;

    fn route() -> Route {
        let feature = |k: u32| KeptFeature {
            track: k,
            feature: ViewFeature {
                azimuth_rad: wrap(0.7 * f64::from(k)),
                tan: 0.1 * f64::from(k) - 0.4,
                scale_rad: 0.01 * f64::from(k + 1),
                looseness: 1.3,
                is_bright: k.is_multiple_of(2),
                strength: 0.0,
                descriptor: std::array::from_fn(|i| (37 * i as u32 + 11 * k) as u8),
            },
        };
        let sheet = RouteSheet {
            world: "lab".into(),
            world_sha256: "0".repeat(64),
            projection: Projection::new(720, 90),
            camera_offset_m: [0.05, 0.0],
            rule: SnapshotRule::Waypoints,
        };
        let path = (0..40).map(|k| Pose::new(0.1 * f64::from(k), 0.02 * f64::from(k), 0.1 * f64::from(k))).collect();
        let snapshot = |node| Snapshot { node, features: (0..9).map(feature).collect() };
        Route { sheet, path, snapshots: vec![snapshot(0), snapshot(39)] }
    }

    /// What is read back is what was kept, to the rounding of the format, which does not add up along the path; and is kept again as the
    /// same bytes.
    #[test]
    fn a_route_comes_back() {
        let route = route();
        let mut store = MemoryStore::default();
        store.keep(&route).unwrap();
        let back = store.recall().unwrap();
        assert_eq!((&back.sheet, back.snapshots.len(), back.path.len()), (&route.sheet, 2, 40));
        for (a, b) in route.path.iter().zip(&back.path) {
            assert!((a.position() - b.position()).norm() < 5e-4 && wrap(a.heading - b.heading).abs() < 1e-4);
        }
        let (a, b) = (&route.snapshots[1].features[7], &back.snapshots[1].features[7]);
        assert!(
            wrap(a.feature.azimuth_rad - b.feature.azimuth_rad).abs() < 5e-5 && (a.feature.tan - b.feature.tan).abs() < 1e-4
        );
        assert!((a.feature.scale_rad / b.feature.scale_rad - 1.0).abs() < 0.02 && a.track == b.track);
        assert_eq!(a.feature.descriptor, b.feature.descriptor);
        assert_eq!(to_bytes(&back, Form::Full), to_bytes(&route, Form::Full));
        assert!(to_bytes(&route, Form::Small).len() < to_bytes(&route, Form::Full).len() / 2);
    }

    #[test]
    fn a_file_of_another_version_cut_or_changed_is_named() {
        let bytes = to_bytes(&route(), Form::Full);
        let told = |bytes: &[u8]| from_bytes(bytes, Path::new("r.bin")).unwrap_err().to_string();
        assert!(told(b"seed,outcome\n1,home\n").contains("expected a route"));
        let text = String::from_utf8_lossy(&bytes[..16]).into_owned();
        assert_eq!(text, format!("{HEAD}{VERSION}\n"));
        let mut older = bytes.clone();
        older[14] = b'1';
        assert!(told(&older).contains("found version 1"), "{}", told(&older));
        for length in [20, 300, bytes.len() - 40, bytes.len() - 1] {
            assert!(told(&bytes[..length]).contains("cut off"), "{length}: {}", told(&bytes[..length]));
        }
        let mut changed = bytes.clone();
        let middle = changed.len() / 2;
        changed[middle] ^= 4;
        assert!(told(&changed).contains("changed"), "{}", told(&changed));
    }
}
