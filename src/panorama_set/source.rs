//! Files of a set: how they are opened, whoever made them, and pictures as panoramas.

use std::fs;
use std::io::{Seek, SeekFrom};
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageDecoder, ImageReader, Limits};

use crate::error::{Error, Result};
use crate::panorama::{Panorama, Projection};
use crate::storage::{io_error, open_within, read_piece, read_within};

/// Largest edge of a picture that is read, pixels.
pub(super) const MOST_PX: u32 = 16384;
/// Most pixels of a picture: a renderer's largest panorama.
const MOST_PIXELS: u64 = 16384 * 4096;

/// Where the bytes of a picture are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Source {
    /// In a file of their own.
    File(PathBuf),
    /// In an uncompressed archive.
    Member {
        /// The archive.
        archive: PathBuf,
        /// Name within.
        name: String,
        /// First byte.
        offset: u64,
        /// Length.
        bytes: u64,
    },
}

/// Names of what is in a folder, sorted; those that are no text are passed over.
pub(super) fn file_names(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(io_error("read folder", folder))? {
        let name = entry.map_err(io_error("read folder", folder))?.file_name();
        names.extend(name.to_str().map(str::to_owned));
    }
    names.sort();
    Ok(names)
}

/// Files with an ending in a folder of a set, else in the set's folder itself; sorted.
pub(super) fn with_ending(root: &Path, folder: &str, ending: &str) -> Result<Vec<PathBuf>> {
    for folder in [root.join(folder), root.to_owned()].into_iter().filter(|folder| folder.is_dir()) {
        let names: Vec<_> = file_names(&folder)?.into_iter().filter(|name| name.ends_with(ending)).collect();
        if !names.is_empty() {
            return Ok(names.into_iter().map(|name| folder.join(name)).collect());
        }
    }
    Ok(Vec::new())
}

impl Source {
    /// The file, or the archive that holds it.
    pub(super) fn file(&self) -> &Path {
        match self {
            Self::File(path) | Self::Member { archive: path, .. } => path,
        }
    }

    /// What messages call it.
    fn name(&self) -> PathBuf {
        match self {
            Self::File(path) => path.clone(),
            Self::Member { archive, name, .. } => archive.join(name),
        }
    }

    /// The picture, the right way up.
    pub(super) fn decode(&self, root: &Path) -> Result<DynamicImage> {
        let bytes = match self {
            Self::File(path) => read_within(root, path)?,
            Self::Member { archive, offset, bytes, .. } => {
                let (mut file, _) = open_within(root, archive)?;
                file.seek(SeekFrom::Start(*offset)).map_err(io_error("read", archive))?;
                read_piece(file, *bytes, &self.name())?
            }
        };
        let broken = |source| Error::Image { path: self.name(), source };
        let reader =
            || ImageReader::new(std::io::Cursor::new(&bytes)).with_guessed_format().map_err(io_error("read", &self.name()));
        let fault = |message: String| Error::Parse { path: self.name(), message };
        // The sides are in the header: nothing is decoded that would not be taken.
        let (width, height) = reader()?.into_dimensions().map_err(broken)?;
        if width > MOST_PX || height > MOST_PX || u64::from(width) * u64::from(height) > MOST_PIXELS {
            let allowed = format!("at most {MOST_PX} pixels a side and {MOST_PIXELS} in all");
            return Err(fault(format!("found {width} x {height} pixels, expected {allowed}")));
        }
        if is_cut_jpeg(&bytes) {
            return Err(fault("found a JPEG that is cut off, expected its end marker".into()));
        }
        let mut reader = reader()?;
        let mut limits = Limits::default();
        limits.max_alloc = Some(16 * MOST_PIXELS); // up to 16 bits a channel, and as much again while it is decoded
        reader.limits(limits);
        // A camera that was held on its side says so, and nothing else does.
        let mut decoder = reader.into_decoder().map_err(broken)?;
        let orientation = decoder.orientation().map_err(broken)?;
        let mut image = DynamicImage::from_decoder(decoder).map_err(broken)?;
        image.apply_orientation(orientation);
        Ok(image)
    }
}

/// Whether a JPEG ends before its end marker; decoders fill up what is missing with grey.
///
/// Neither marker can stand in the coded pixels, and a thumbnail with markers of its own comes before the picture's scans.
fn is_cut_jpeg(bytes: &[u8]) -> bool {
    let last = |marker: u8| bytes.windows(2).rposition(|pair| pair == [0xff, marker]);
    let (start_of_scan, end_of_image) = (last(0xda), last(0xd9));
    bytes.starts_with(&[0xff, 0xd8, 0xff]) && end_of_image < start_of_scan
}

/// The picture, with the projection that `projection` makes of its size; columns as in the file.
pub(super) fn picture(root: &Path, image: &Source, projection: impl Fn(u32, u32) -> Projection) -> Result<Panorama> {
    let rgba = image.decode(root)?.to_rgba8();
    let projection = projection(rgba.width(), rgba.height());
    Ok(Panorama { projection, rgba: rgba.into_raw(), range_m: Vec::new(), instance: Vec::new() })
}

/// The numbers of a 16-bit grey picture of the same size as `like`.
pub(super) fn numbers(root: &Path, source: &Source, like: Projection) -> Result<Vec<u16>> {
    let image = source.decode(root)?;
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
///
/// # Errors
/// When these would be more rows than a picture may have; `path` is what the error names.
pub(super) fn even_rows(taken: &Panorama, step_rad: f64, horizon: f64, path: &Path) -> Result<Panorama> {
    let (width, height) = (taken.projection.width as usize, taken.projection.height as usize);
    let pixel = taken.projection.pixel_rad();
    let above = (horizon + 0.5) * step_rad / pixel;
    let rows = ((height as f64 * step_rad / pixel).round() as usize).max(1);
    if rows > MOST_PX as usize || (rows * width) as u64 > MOST_PIXELS {
        let message = format!(
            "found rows {step_rad} rad apart, which makes {width} x {rows} pixels of equal angles; expected at most {MOST_PX} rows and {MOST_PIXELS} pixels"
        );
        return Err(Error::Parse { path: path.to_owned(), message });
    }
    let projection = Projection { height: rows as u32, horizon_row: above, ..taken.projection };
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
    Ok(Panorama { projection, rgba, range_m: Vec::new(), instance: Vec::new() })
}
