//! Image files that textures show.
//!
//! A world may come from anybody, so that its images are taken from the folder of the world file and from folders below, never
//! from elsewhere: neither by `..` nor by a link. A file is read only when it is small enough, and decoded only when its sides
//! are.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use image::{DynamicImage, ImageDecoder, ImageReader, Limits};

/// Largest file, bytes.
pub(super) const MOST_BYTES: u64 = 64 << 20;
/// Longest side, pixels.
pub(super) const LONGEST_PX: u32 = 16_384;
/// Most pixels of an image.
const MOST_PX: u64 = 64 << 20;
/// What an image must be, for messages.
const ALLOWED: &str = "a PNG, JPEG or PNM image";

/// A decoded image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue and opacity, row-major, row 0 on top.
    pub rgba: Vec<u8>,
}

/// Where a world's images lie.
pub(super) enum Gallery<'a> {
    /// In a folder.
    Folder(PathBuf),
    /// In the program itself, by path.
    Builtin(&'a [(&'a str, &'a [u8])]),
}

/// Why an image cannot be had: what was found, and what is allowed.
pub(super) type Refusal = (String, String);

/// The images of one world.
#[derive(Default)]
pub(super) struct Pictures {
    pictures: BTreeMap<String, Arc<Picture>>,
    /// Bytes of the files, in the order of first use, for the world's fingerprint.
    pub files: Vec<Vec<u8>>,
}

impl Pictures {
    /// Reads the image at `path`, as written in the world, unless it is there already.
    pub fn load(&mut self, path: &str, gallery: &Gallery<'_>) -> Result<(), Refusal> {
        if !self.pictures.contains_key(path) {
            let bytes = gallery.read(path)?;
            let picture = decode(&bytes).map_err(|(found, allowed)| (format!("\"{path}\", {found}"), allowed))?;
            self.pictures.insert(path.to_owned(), Arc::new(picture));
            self.files.push(bytes);
        }
        Ok(())
    }

    /// The image at `path`; a grey pixel where it was not loaded.
    pub fn get(&self, path: &str) -> Arc<Picture> {
        let missing = || Arc::new(Picture { width: 1, height: 1, rgba: vec![128, 128, 128, 255] });
        self.pictures.get(path).map_or_else(missing, Arc::clone)
    }
}

impl Gallery<'_> {
    fn read(&self, path: &str) -> Result<Vec<u8>, Refusal> {
        match self {
            Self::Folder(folder) => read_below(folder, path),
            Self::Builtin(files) => {
                let file = files.iter().find(|(name, _)| *name == path);
                file.map(|(_, bytes)| bytes.to_vec())
                    .ok_or_else(|| (format!("\"{path}\", which is no built-in image"), ALLOWED.to_owned()))
            }
        }
    }
}

fn read_below(folder: &Path, path: &str) -> Result<Vec<u8>, Refusal> {
    let below = || {
        format!("{ALLOWED} in the world file's folder or below, by a relative path that neither \"..\" nor a link leads out of")
    };
    let outside = || (format!("\"{path}\", which is outside the world file's folder"), below());
    let relative = Path::new(path);
    let stays = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
    if path.is_empty() || !relative.components().all(stays) {
        return Err(outside());
    }
    let unreadable = |e: std::io::Error| (format!("\"{path}\", which cannot be read ({e})"), below());
    // An empty parent is the current folder.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let folder = folder.canonicalize().map_err(unreadable)?;
    let file = folder.join(relative).canonicalize().map_err(unreadable)?;
    if !file.starts_with(&folder) {
        return Err(outside());
    }
    let about = file.metadata().map_err(unreadable)?;
    if !about.is_file() {
        return Err((format!("\"{path}\", which is no file"), below()));
    }
    if about.len() > MOST_BYTES {
        return Err((format!("\"{path}\" of {} bytes", about.len()), format!("a file of at most {MOST_BYTES} bytes")));
    }
    std::fs::read(&file).map_err(unreadable)
}

/// The image in a file's bytes.
pub(super) fn decode(bytes: &[u8]) -> Result<Picture, Refusal> {
    let damaged = |e: &dyn std::fmt::Display| (format!("which cannot be decoded ({e})"), ALLOWED.to_owned());
    let reader = || -> Result<_, Refusal> {
        let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| damaged(&e))?;
        let mut limits = Limits::default();
        limits.max_alloc = Some(8 * MOST_PX); // up to 16 bits a channel
        reader.limits(limits);
        Ok(reader)
    };
    // The sides are in the header: nothing is decoded that would not be taken.
    let (width, height) = declared_size(bytes).map_or_else(|| reader()?.into_dimensions().map_err(|e| damaged(&e)), Ok)?;
    let sides = 1..=LONGEST_PX;
    if !sides.contains(&width) || !sides.contains(&height) || u64::from(width) * u64::from(height) > MOST_PX {
        let allowed = format!("1 to {LONGEST_PX} pixels a side, {MOST_PX} in all");
        return Err((format!("which is {width} x {height} pixels"), allowed));
    }
    let mut decoder = reader()?.into_decoder().map_err(|e| damaged(&e))?;
    // A camera that was held on its side says so in its EXIF data.
    let orientation = decoder.orientation().map_err(|e| damaged(&e))?;
    let mut image = DynamicImage::from_decoder(decoder).map_err(|e| damaged(&e))?;
    image.apply_orientation(orientation);
    let rgba = image.to_rgba8();
    Ok(Picture { width: rgba.width(), height: rgba.height(), rgba: rgba.into_raw() })
}

/// Sides that a PNG's header declares. The decoder refuses a side of 0 without saying what it found.
fn declared_size(bytes: &[u8]) -> Option<(u32, u32)> {
    let header = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n")?;
    let number = |at: usize| header.get(at..at + 4)?.try_into().ok().map(u32::from_be_bytes);
    (header.get(4..8)? == b"IHDR").then_some(())?;
    Some((number(8)?, number(12)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(bytes: &[u8]) -> String {
        decode(bytes).unwrap_err().0
    }

    fn png_header(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
        bytes.extend(width.to_be_bytes());
        bytes.extend(height.to_be_bytes());
        bytes.extend([8, 2, 0, 0, 0, 0, 0, 0, 0]);
        bytes
    }

    #[test]
    fn sides_are_checked_before_anything_is_decoded() {
        assert!(refusal(&png_header(0, 0)).contains("0 x 0 pixels"));
        assert!(refusal(&png_header(100_000, 4)).contains("100000 x 4 pixels"));
        assert!(refusal(b"P6\n100000 2\n255\n").contains("100000 x 2 pixels"));
        assert!(refusal(&png_header(16_384, 16_384)).contains("16384 x 16384"));
    }

    #[test]
    fn damage_is_told() {
        for bytes in [
            &b""[..],
            b"not an image",
            b"\x89PNG\r\n\x1a\n",
            b"\xff\xd8\xff\xe0 cut off",
            b"P6\n2 2\n255\nab",
            b"P6\n0 0\n255\n",
        ] {
            assert!(refusal(bytes).contains("cannot be decoded") || refusal(bytes).contains("0 x 0"), "{}", refusal(bytes));
        }
    }

    /// A JPEG of 16 x 8 pixels, left half dark and right half light, with this EXIF orientation.
    fn jpeg(orientation: u8) -> Vec<u8> {
        let pixels: Vec<u8> = (0..8 * 16).map(|k| if k % 16 < 8 { 0 } else { 255 }).collect();
        let mut bytes = Vec::new();
        let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100);
        image::ImageEncoder::write_image(encoder, &pixels, 16, 8, image::ExtendedColorType::L8).unwrap();
        // One entry of a TIFF directory: tag 0x0112, a short.
        let mut exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec();
        exif.extend([orientation, 0, 0, 0, 0, 0, 0, 0]);
        let mut segment = vec![0xff, 0xe1];
        segment.extend((exif.len() as u16 + 2).to_be_bytes());
        segment.extend(exif);
        bytes.splice(2..2, segment);
        bytes
    }

    #[test]
    fn an_image_stands_as_its_camera_was_held() {
        let upright = decode(&jpeg(1)).unwrap();
        assert_eq!((upright.width, upright.height), (16, 8));
        assert!(upright.rgba[0] < 30 && upright.rgba[4 * 15] > 220);
        // Turned a quarter to the right: what was left is on top.
        let turned = decode(&jpeg(6)).unwrap();
        assert_eq!((turned.width, turned.height), (8, 16));
        assert!(turned.rgba[0] < 30 && turned.rgba[4 * 7] < 30 && turned.rgba[4 * 8 * 15] > 220);
    }

    #[test]
    fn colours_come_through() {
        let picture = decode(b"P6\n1 2\n255\nabcdef").unwrap();
        assert_eq!((picture.width, picture.height), (1, 2));
        assert_eq!(picture.rgba, b"abc\xffdef\xff");
    }
}
