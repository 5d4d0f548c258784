//! Picture files as panoramas.

use std::fs;
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;

use image::{DynamicImage, ImageReader, Limits};

use super::entry::Source;
use crate::error::{Error, Result};
use crate::panorama::{Panorama, Projection};
use crate::storage::io_error;

/// Largest edge of a picture that is read, pixels.
const MOST_PX: u32 = 16384;

impl Source {
    /// What messages call it.
    pub(super) fn name(&self) -> PathBuf {
        match self {
            Self::File(path) => path.clone(),
            Self::Member { archive, name, .. } => archive.join(name),
        }
    }

    pub(super) fn read(&self) -> Result<Vec<u8>> {
        match self {
            Self::File(path) => fs::read(path).map_err(io_error("read", path)),
            Self::Member { archive, offset, bytes, .. } => {
                let mut held = Vec::new();
                fs::File::open(archive)
                    .and_then(|mut file| {
                        file.seek(SeekFrom::Start(*offset))?;
                        file.take(*bytes).read_to_end(&mut held)
                    })
                    .map_err(io_error("read", archive))?;
                if (held.len() as u64) < *bytes {
                    let message = format!("found {} of {bytes} bytes, the archive is cut off", held.len());
                    return Err(Error::Parse { path: self.name(), message });
                }
                Ok(held)
            }
        }
    }

    fn decode(&self) -> Result<DynamicImage> {
        let bytes = self.read()?;
        let broken = |source| Error::Image { path: self.name(), source };
        let mut reader =
            ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format().map_err(io_error("read", &self.name()))?;
        let mut limits = Limits::default();
        limits.max_image_width = Some(MOST_PX);
        limits.max_image_height = Some(MOST_PX);
        reader.limits(limits);
        reader.decode().map_err(broken)
    }
}

/// The picture, with the projection that `projection` makes of its size; columns as in the file.
pub(super) fn picture(image: &Source, projection: impl Fn(u32, u32) -> Projection) -> Result<Panorama> {
    let rgba = image.decode()?.to_rgba8();
    let projection = projection(rgba.width(), rgba.height());
    Ok(Panorama { projection, rgba: rgba.into_raw(), range_m: Vec::new(), instance: Vec::new() })
}

/// The numbers of a 16-bit grey picture of the same size as `like`.
pub(super) fn numbers(source: &Source, like: Projection) -> Result<Vec<u16>> {
    let image = source.decode()?;
    let fault = |found: String| Error::Parse {
        path: source.name(),
        message: format!("found {found}, expected 16-bit grey of {} x {} pixels", like.width, like.height),
    };
    if (image.width(), image.height()) != (like.width, like.height) {
        return Err(fault(format!("{} x {} pixels", image.width(), image.height())));
    }
    match image {
        DynamicImage::ImageLuma16(grey) => Ok(grey.into_raw()),
        other => Err(fault(format!("{:?}", other.color()))),
    }
}

/// Reverses the sense of the columns: column c goes to (width - c) mod width, so that column 0 stays.
pub fn mirror(panorama: &mut Panorama) {
    let width = panorama.projection.width as usize;
    fn rows<T>(values: &mut [T], width: usize) {
        if width > 1 {
            values.chunks_exact_mut(width).for_each(|row| row[1..].reverse());
        }
    }
    rows(bytemuck::cast_slice_mut::<u8, [u8; 4]>(&mut panorama.rgba), width);
    rows(&mut panorama.range_m, width);
    rows(&mut panorama.instance, width);
}

/// Makes rows that are even in elevation by `step_rad` with the horizon on row `horizon` as far apart as columns are.
pub(super) fn even_rows(taken: &Panorama, step_rad: f64, horizon: f64) -> Panorama {
    let (width, height) = (taken.projection.width as usize, taken.projection.height as usize);
    let pixel = taken.projection.pixel_rad();
    let above = (horizon + 0.5) * step_rad / pixel;
    let rows = ((height as f64 * step_rad / pixel).round() as usize).max(1);
    let mut projection = super::layout::equal_angle(taken.projection.width, rows as u32);
    projection.horizon_row = above;
    let mut rgba = Vec::with_capacity(4 * width * rows);
    for row in 0..rows {
        let up = above - 0.5 - row as f64;
        let from = (horizon - up * pixel / step_rad).clamp(0.0, height as f64 - 1.0);
        let upper = (from as usize).min(height.saturating_sub(2));
        let share = from - upper as f64;
        let lower = (upper + 1).min(height - 1);
        for k in 0..4 * width {
            let [a, b] = [upper, lower].map(|row| f64::from(taken.rgba[4 * row * width + k]));
            rgba.push((a + share * (b - a)).round() as u8);
        }
    }
    Panorama { projection, rgba, range_m: Vec::new(), instance: Vec::new() }
}
