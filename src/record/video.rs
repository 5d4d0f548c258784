//! A run as an animated GIF: the panorama above, the room below.
//!
//! It plays at the pace of the simulation. A GIF has 256 colours; they are chosen once, from the first picture, so that colours
//! do not flicker, and of later pictures only what has changed is stored. The longer a run takes, the rarer its pictures get, so
//! that the file of a long one stays small enough to send.

use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use color_quant::NeuQuant;
use gif::{AnyExtension, DisposalMethod, Encoder, EncodingError, Extension, Frame, Repeat};
use image::imageops::FilterType;
use image::{Rgb, RgbImage};

use super::file::{self, MAKER};
use crate::draw::image::colours;
use crate::draw::raster::{RoomRaster, Sight, opaque};
use crate::episode::{Moment, Record, Recorder, Summary};
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::observation::HomeSnapshot;
use crate::panorama::Panorama;
use crate::record::path_plot::in_room;
use crate::storage::PartialFile;
use crate::world::World;

/// First bytes of such a file.
pub(super) const MAGIC: &[u8] = b"GIF89a";

/// Width of the picture, and greatest height of the room, px.
const WIDTH_PX: u32 = 720;
const ROOM_PX: u32 = 560;
/// Between panorama and room, px.
const GAP_PX: u32 = 4;
/// Time between pictures at first, s.
const PERIOD_S: f64 = 0.2;
/// Each time that this much has been written, pictures become half as frequent, bytes.
const BUDGET: u64 = 2_500_000;
/// How long the last picture stays, in hundredths of a second.
const HOLD: u16 = 250;
/// Number of the colour that stands for "as before".
const SAME: u8 = 255;

/// A growing GIF.
pub(super) struct VideoRecording<'a> {
    world: &'a World,
    path: PathBuf,
    room: RoomRaster<'a>,
    file: Option<PartialFile>,
    film: Option<Film>,
    truth: Vec<Pose>,
    estimate: Vec<Pose>,
    panorama: Option<RgbImage>,
    period_s: f64,
    /// Time of the next picture, s.
    next_s: f64,
    /// The latest moment, where it has not become a picture.
    pending: Option<(f64, RgbImage)>,
}

impl<'a> VideoRecording<'a> {
    pub(super) fn create(world: &'a World, path: &Path) -> Result<Self> {
        let file = file::create(path, MAGIC)?;
        let pixels = 4 * (WIDTH_PX as usize) * (ROOM_PX as usize);
        let room = RoomRaster::new(world, WIDTH_PX, ROOM_PX).ok_or(Error::Memory { bytes: pixels })?;
        Ok(Self {
            world,
            path: path.to_owned(),
            room,
            file: Some(file),
            film: None,
            truth: Vec::new(),
            estimate: Vec::new(),
            panorama: None,
            period_s: PERIOD_S,
            next_s: 0.0,
            pending: None,
        })
    }

    /// Panorama and room in one picture.
    fn compose(&self, sight: &Sight<'_>) -> RgbImage {
        let top = self.panorama.as_ref().map_or(0, |p| p.height() + GAP_PX);
        let mut picture = RgbImage::from_pixel(WIDTH_PX, top + self.room.height_px(), Rgb([255; 3]));
        if let Some(panorama) = &self.panorama {
            image::imageops::replace(&mut picture, panorama, 0, 0);
        }
        if let Some(room) = opaque(&self.room.draw(sight)) {
            image::imageops::replace(&mut picture, &room, 0, i64::from(top));
        }
        picture
    }

    fn show(&mut self, time_s: f64, picture: RgbImage) -> Result<()> {
        let path = &self.path;
        if let Some(file) = self.file.take() {
            self.film = Some(Film::begin(file, &picture).map_err(|e| fault(path, e))?);
        }
        let Some(film) = &mut self.film else { return Ok(()) };
        film.show(time_s, picture).map_err(|e| fault(path, e))?;
        while film.written() > BUDGET * (self.period_s / PERIOD_S) as u64 {
            self.period_s *= 2.0;
        }
        self.next_s = time_s + self.period_s;
        Ok(())
    }
}

impl Recorder for VideoRecording<'_> {
    fn begin(&mut self, _home: &HomeSnapshot, panorama: Option<&Panorama>) -> Result<()> {
        // So that the picture has room for one from the first frame on.
        self.panorama = panorama.and_then(strip);
        Ok(())
    }

    fn record(&mut self, moment: &Moment<'_>) -> Result<()> {
        let step = moment.step;
        self.truth.push(step.truth);
        let nowhere = Pose { x: f64::NAN, ..Pose::IDENTITY };
        self.estimate.push(step.estimate.as_ref().map_or(nowhere, |e| self.world.home.compose(&e.pose)));
        let due = step.time_s >= self.next_s - 1e-9;
        if due && let Some(panorama) = moment.panorama {
            self.panorama = strip(panorama);
        }
        // Those that are not due are drawn as well once the robot only comes to rest: the last of them ends the film.
        if !due && step.seen.is_some() {
            return Ok(());
        }
        let covariance = step.estimate.as_ref().map(|e| in_room(&self.world.home, e));
        let sight = Sight { truth: &self.truth, estimate: &self.estimate, covariance, bodies: moment.bodies };
        let picture = self.compose(&sight);
        if !due {
            self.pending = Some((step.time_s, picture));
            return Ok(());
        }
        self.pending = None;
        self.show(step.time_s, picture)
    }

    fn finish(&mut self, _record: &Record, _summary: &Summary) -> Result<()> {
        if let Some((time_s, picture)) = self.pending.take() {
            self.show(time_s, picture)?;
        }
        let Some(film) = self.film.take() else { return Ok(()) };
        film.finish().map_err(|e| fault(&self.path, e))?.complete()
    }
}

/// A panorama as wide as the film.
fn strip(panorama: &Panorama) -> Option<RgbImage> {
    let (width, height) = (panorama.projection.width, panorama.projection.height);
    let image = colours(panorama)?;
    let height = (f64::from(height) * f64::from(WIDTH_PX) / f64::from(width)).round().clamp(1.0, f64::from(ROOM_PX)) as u32;
    Some(image::imageops::resize(&image, WIDTH_PX, height, FilterType::Triangle))
}

fn fault(path: &Path, error: EncodingError) -> Error {
    let source = match error {
        EncodingError::Io(source) => source,
        other => std::io::Error::other(other.to_string()),
    };
    Error::Io { action: "write", path: path.to_owned(), source }
}

/// The pictures one after the other.
struct Film {
    encoder: Encoder<PartialFile>,
    palette: Palette,
    size: (u16, u16),
    /// The last picture shown, and its numbers in the palette.
    last: Option<(RgbImage, Vec<u8>)>,
    /// A picture whose duration is not known yet: since when it is shown, and what has changed with it.
    waiting: Option<(f64, Vec<u8>)>,
    /// Time that the frames so far take, in hundredths of a second.
    shown: u64,
}

impl Film {
    fn begin(file: PartialFile, first: &RgbImage) -> std::result::Result<Self, EncodingError> {
        let palette = Palette::of(first);
        let size = (first.width() as u16, first.height() as u16);
        let mut encoder = Encoder::new(file, size.0, size.1, &palette.bytes())?;
        encoder.set_repeat(Repeat::Infinite)?;
        encoder.write_raw_extension(AnyExtension(Extension::Comment as u8), &[MAKER.as_bytes()])?;
        Ok(Self { encoder, palette, size, last: None, waiting: None, shown: 0 })
    }

    fn written(&self) -> u64 {
        self.encoder.get_ref().written()
    }

    fn show(&mut self, time_s: f64, picture: RgbImage) -> std::result::Result<(), EncodingError> {
        let (numbers, changes) = match &self.last {
            None => {
                let numbers: Vec<u8> = picture.pixels().map(|p| self.palette.nearest(p.0)).collect();
                (numbers.clone(), numbers)
            }
            Some((before, known)) => {
                let mut numbers = known.clone();
                let mut changes = vec![SAME; known.len()];
                for (k, (now, before)) in picture.pixels().zip(before.pixels()).enumerate().filter(|(_, (a, b))| a != b) {
                    let number = self.palette.nearest(now.0);
                    if number != numbers[k] {
                        (numbers[k], changes[k]) = (number, number);
                    }
                    debug_assert!(now != before);
                }
                (numbers, changes)
            }
        };
        self.last = Some((picture, numbers));
        self.write_waiting(Some(time_s))?;
        self.waiting = Some((time_s, changes));
        Ok(())
    }

    /// Writes the picture that was shown until `until_s`, or that is the last one.
    fn write_waiting(&mut self, until_s: Option<f64>) -> std::result::Result<(), EncodingError> {
        let Some((_, changes)) = self.waiting.take() else { return Ok(()) };
        // From the time since the start, so that roundings do not add up.
        let delay = until_s.map_or(HOLD, |until_s| {
            let end = (until_s * 100.0).round() as u64;
            end.saturating_sub(self.shown).clamp(2, u64::from(u16::MAX)) as u16
        });
        self.shown += u64::from(delay);
        let (width, height) = self.size;
        self.encoder.write_frame(&Frame {
            delay,
            dispose: DisposalMethod::Keep,
            transparent: Some(SAME),
            width,
            height,
            buffer: changes.into(),
            ..Frame::default()
        })
    }

    fn finish(mut self) -> std::result::Result<PartialFile, EncodingError> {
        self.write_waiting(None)?;
        let mut file = self.encoder.into_inner()?;
        file.flush()?;
        Ok(file)
    }
}

/// At most 255 colours, and which of them is nearest to any other.
struct Palette {
    colours: Vec<[u8; 3]>,
    known: HashMap<[u8; 3], u8>,
}

/// Colours that are always there: what comes into the room during a run.
const DRAWN: [[u8; 3]; 12] = [
    [255, 255, 255],
    [251, 250, 247],
    [26, 26, 26],
    [138, 138, 137],
    [74, 74, 74],
    [213, 94, 0],
    [232, 172, 124],
    [243, 219, 198],
    [192, 20, 60],
    [242, 179, 107],
    [166, 92, 15],
    [141, 180, 214],
];

impl Palette {
    fn of(picture: &RgbImage) -> Self {
        // Every colour as often as the root of its count, or paper and floor would leave none for the panorama.
        let mut counts: HashMap<[u8; 3], u32> = HashMap::new();
        for pixel in picture.pixels() {
            *counts.entry(pixel.0).or_default() += 1;
        }
        let mut counts: Vec<_> = counts.into_iter().collect();
        counts.sort_unstable();
        let mut colours = DRAWN.to_vec();
        let free = usize::from(SAME) - DRAWN.len();
        if counts.len() <= free {
            colours.extend(counts.iter().map(|(colour, _)| colour));
            return Self { colours, known: HashMap::new() };
        }
        let often = |count: u32| f64::from(count).sqrt().ceil() as usize;
        let weighted = counts.iter().flat_map(|&([r, g, b], count)| std::iter::repeat_n([r, g, b, 255], often(count)));
        let sample: Vec<u8> = weighted.flatten().collect();
        let chosen = NeuQuant::new(3, free, &sample).color_map_rgb();
        colours.extend(chosen.chunks_exact(3).map(|c| [c[0], c[1], c[2]]));
        colours.truncate(usize::from(SAME));
        Self { colours, known: HashMap::new() }
    }

    /// The colours in the order of their numbers, and one that stands for none.
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.colours.concat();
        bytes.resize(3 * 256, 0);
        bytes
    }

    fn nearest(&mut self, colour: [u8; 3]) -> u8 {
        let Self { colours, known } = self;
        *known.entry(colour).or_insert_with(|| {
            let distance = |other: &[u8; 3]| -> u32 { (0..3).map(|k| u32::from(colour[k].abs_diff(other[k])).pow(2)).sum() };
            (0_u8..).zip(colours.iter()).min_by_key(|(_, other)| distance(other)).map_or(0, |(number, _)| number)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decodes what was filmed and holds every frame against what was shown.
    #[test]
    fn a_film_shows_what_was_shown_for_as_long() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.gif");
        let picture = |k: u32| {
            let mut picture = RgbImage::from_fn(64, 40, |x, y| Rgb([(32 * (x / 8)) as u8, (48 * (y / 8)) as u8, 90]));
            (0..8).for_each(|d| picture.put_pixel(10 + k * 7 + d, 12 + d, Rgb([213, 94, 0])));
            picture
        };
        let mut film = Film::begin(file::create(&path, MAGIC).unwrap(), &picture(0)).unwrap();
        for (k, time_s) in [(0, 0.0), (1, 0.2), (2, 0.4), (3, 1.2)] {
            film.show(time_s, picture(k)).unwrap();
        }
        film.finish().unwrap().complete().unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(std::fs::File::open(&path).unwrap()).unwrap();
        let mut canvas = vec![0_u8; 64 * 40 * 3];
        let mut delays = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            for (pixel, new) in canvas.chunks_exact_mut(3).zip(frame.buffer.chunks_exact(4)).filter(|(_, new)| new[3] > 0) {
                pixel.copy_from_slice(&new[..3]);
            }
            let wanted = picture(delays.len() as u32);
            assert!(canvas == *wanted.as_raw(), "frame {}: so few colours are all kept", delays.len());
            assert_eq!(canvas[3 * (12 * 64 + 10 + 7 * delays.len())..][..3], [213, 94, 0], "exactly what is drawn");
            delays.push(frame.delay);
        }
        assert_eq!(delays, [20, 20, 80, HOLD]);
    }
}
