//! Reads EXR files that anybody may have made or damaged.
//!
//! The header is read first and its claims are checked against the file's length and a limit on memory; only then are
//! pixels read. The `exr` crate alone believes the header and asks for as much memory as it says, which ends the
//! program.

use crate::output::{Attribute, CROP, FRAMES_PER_SECOND, PartOf};
use crate::read_file;
use ::exr::image::read::any_channels::ReadAnyChannels;
use ::exr::meta::attribute::Text;
use ::exr::meta::header::Header;
use ::exr::prelude::{FlatSamples, ReadChannels, ReadLayers, Vec2};
use fechner_perception::primaries::Primaries;
use std::io::Cursor;
use std::path::{Path, PathBuf};

mod attributes;
mod checks;
mod colour;
mod dwa;
pub mod layers;
mod subsampled;
mod wanted;
mod window;

use attributes::{add_missing, attributes, part_of, primaries};
use checks::{check_memory, guarded, read_headers};
pub(crate) use colour::make_finite;
pub use colour::{ScenePicture, negative_light};
use wanted::Wanted;
pub use window::Window;

/// Bytes of memory that the pixels read of a picture may take at most, those of an EXR file as 32-bit floats: 1 GiB, a
/// 4K frame with 30 channels.
pub const MEMORY_LIMIT_BYTES: u64 = 1 << 30;

/// Memory that a pixel of the display window takes, as linear RGB.
const BYTES_PER_SHOWN_PIXEL: u64 = 12;

/// An EXR file in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrImage {
    /// Width of the data window in pixels.
    pub width: u32,
    /// Height of the data window in pixels.
    pub height: u32,
    /// Place of the data window's top left pixel, x to the right and y down.
    pub data_window_origin: (i32, i32),
    /// Channels by name, row-major from the top left, whole numbers and halves as floats. A channel of a named part has
    /// the part's name before its own: `beauty.R`; a file of one part keeps its names.
    pub channels: Vec<(String, Vec<f32>)>,
    /// How the file stores each of `channels`.
    pub types: Vec<SampleType>,
    /// Names of channels that were not asked for and are not among `channels`.
    pub unread: Vec<String>,
    /// Attributes of the part that lays the picture out, and those of others that it lacks, sorted by name. Other types
    /// than text and numbers are given as text.
    pub attributes: Vec<(String, Attribute)>,
    /// Parts that were left out because nothing of them lies in the data window.
    pub parts_left_out: Vec<String>,
    /// Lines at the bottom that could not be read: an odd rest of lines in a block of subsampled channels.
    pub lines_left_out: u32,
    /// What is to be shown; may be smaller or larger than the data. Of a part that this renderer wrote ([`CROP`]) it is
    /// the data: the file's own display window is that of the whole picture, most of which is not there.
    pub display_window: Window,
    /// Place of this picture in the whole, where this renderer wrote it as a part.
    pub part_of: Option<PartOf>,
    /// Whether the file's display window has no pixels or too many for memory, and the data window stands for it.
    pub is_display_window_left_out: bool,
    /// Width of a pixel over its height; 1 where the file's is none that a pixel can have (0.01 to 100).
    pub pixel_aspect_ratio: f64,
    /// Primaries and white of R, G and B, where the file says them: as chromaticities, by a `colorInteropID`, or as an
    /// ACES container. Channels are as in the file: see [`ExrImage::scene_picture`].
    pub chromaticities: Option<Primaries>,
}

/// How a file stores a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleType {
    /// 16-bit float.
    Half,
    /// 32-bit float.
    Float,
    /// 32-bit unsigned integer.
    Uint,
}

impl std::fmt::Display for SampleType {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Half => "half",
            Self::Float => "float",
            Self::Uint => "uint",
        })
    }
}

impl ExrImage {
    /// The values of a channel, if it is there.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(n, _)| n == name).map(|(_, values)| values.as_slice())
    }

    /// Frames a second of the sequence that it is of, if it says so.
    pub fn frames_per_second(&self) -> Option<f64> {
        let Some(Attribute::Float(rate)) = self.attribute(FRAMES_PER_SECOND) else { return None };
        Some(f64::from(*rate)).filter(|rate| rate.is_finite() && *rate > 0.0)
    }

    /// An attribute, if it is there.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value)
    }
}

/// Why an EXR file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ExrReadError {
    /// The operating system refused.
    #[error("cannot read {}: {error}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// The file is damaged or no EXR file.
    #[error("cannot read {}: damaged or no EXR file ({problem})", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// The file may be sound, but has something that is not read here.
    #[error("cannot read {}: {feature}", .path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What it has, and what would be right.
        feature: String,
    },
    /// The pixels would take more than [`MEMORY_LIMIT_BYTES`].
    #[error(
        "cannot read {}: {width}×{height} pixels of {channels} channel{} need {} MiB, more than the {} MiB allowed; save it smaller, or with fewer layers",
        .path.display(), if *.channels == 1 { "" } else { "s" }, .bytes >> 20, MEMORY_LIMIT_BYTES >> 20
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Width that the header claims.
        width: u64,
        /// Height that the header claims.
        height: u64,
        /// Channels that were to be read, of all parts.
        channels: u64,
        /// Memory that would be needed.
        bytes: u64,
    },
}

/// Reads every channel of a file's parts.
///
/// # Errors
/// Where the file cannot be read, is damaged or needs too much memory.
pub fn read_exr(path: &Path) -> Result<ExrImage, ExrReadError> {
    read_exr_channels(path, |all| all.to_vec())
}

/// Reads those channels of a file's parts that `choose` chooses among the names of all. Only they take memory.
///
/// # Errors
/// As of [`read_exr`].
pub fn read_exr_channels(path: &Path, choose: impl FnOnce(&[String]) -> Vec<String>) -> Result<ExrImage, ExrReadError> {
    let io = |error| ExrReadError::Io { path: path.to_owned(), error };
    decode_exr_channels(path, &read_file::bytes(path).map_err(io)?, choose)
}

/// The layer and the last part of a channel's name, which a dot parts: `beauty.R` is R of beauty, `R` is R of
/// the layer without a name.
pub fn layer_and_part(channel: &str) -> (&str, &str) {
    channel.rsplit_once('.').unwrap_or(("", channel))
}

/// Whether these are the first bytes of an EXR file.
pub fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// Reads every channel of the parts of a file that is in memory; `path` is for messages.
///
/// # Errors
/// As of [`read_exr`].
pub fn decode_exr(path: &Path, file: &[u8]) -> Result<ExrImage, ExrReadError> {
    decode_exr_channels(path, file, |all| all.to_vec())
}

/// [`read_exr_channels`] of a file that is in memory; `path` is for messages.
///
/// # Errors
/// As of [`read_exr`].
pub fn decode_exr_channels(
    path: &Path,
    file: &[u8],
    choose: impl FnOnce(&[String]) -> Vec<String>,
) -> Result<ExrImage, ExrReadError> {
    if let Some(image) = subsampled::read(path, file)? {
        return Ok(image);
    }
    let headers = read_headers(path, file)?;
    let wanted = Wanted::of(&headers, choose);
    check_memory(path, &headers, &wanted)?;
    dwa::check(path, file, &headers)?;
    let image = guarded(path, || {
        ReadAnyChannels { read_samples: wanted.clone() }.all_layers().all_attributes().from_buffered(Cursor::new(file))
    })?;
    let mut result = image_without_channels(layout(&headers));
    add_missing(&mut result.attributes, &headers);
    let window = result.data_window();
    for layer in image.layer_data {
        let part = layer.attributes.layer_name.as_ref().map(Text::to_string).unwrap_or_default();
        let Vec2(x, y) = layer.attributes.layer_position;
        let own_window = Window { origin: (x, y), width: layer.size.0 as u32, height: layer.size.1 as u32 };
        if !own_window.meets(&window) {
            result.parts_left_out.push(part);
            continue;
        }
        for channel in layer.channel_data.list {
            let name = wanted.full_name(&part, &channel.name.to_string());
            let (values, kind) = match channel.sample_data {
                Some(FlatSamples::F32(values)) => (values, SampleType::Float),
                Some(FlatSamples::F16(values)) => (values.iter().map(|v| v.to_f32()).collect(), SampleType::Half),
                Some(FlatSamples::U32(values)) => (values.iter().map(|&v| v as f32).collect(), SampleType::Uint),
                None => {
                    result.unread.push(name);
                    continue;
                }
            };
            result.channels.push((name, own_window.put_into(&window, values, 0.0)));
            result.types.push(kind);
        }
    }
    Ok(result)
}

/// The part whose data window all others are put into: the largest of those with a picture, the first of equals.
/// Renderers crop what they can, and overscan what is filtered later.
fn layout(headers: &[Header]) -> &Header {
    let has = |header: &Header, names: &[&str]| {
        let has_one = |name: &&str| {
            let is_it = |own: &str| layer_and_part(own).1.eq_ignore_ascii_case(name);
            header.channels.list.iter().any(|channel| is_it(&channel.name.to_string()))
        };
        names.iter().all(has_one)
    };
    let area = |header: &Header| header.layer_size.0.saturating_mul(header.layer_size.1);
    let rank = |header: &Header| (has(header, &["R", "G", "B"]), has(header, &["Y"]), area(header));
    // Of equals `max_by_key` takes the last.
    headers.iter().rev().max_by_key(|header| rank(header)).unwrap_or(&headers[0])
}

fn image_without_channels(first: &Header) -> ExrImage {
    let window = first.shared_attributes.display_window;
    // A display window that no memory could hold is no reason to refuse the data.
    let data = first.layer_size.0.saturating_mul(first.layer_size.1);
    let shown = window.size.0.saturating_mul(window.size.1);
    let is_sound = shown > 0
        && shown <= data.saturating_mul(64).max(1 << 24)
        && (shown as u64).saturating_mul(BYTES_PER_SHOWN_PIXEL) <= MEMORY_LIMIT_BYTES;
    let is_part = first.own_attributes.other.keys().any(|name| *name == *CROP);
    let origin = (first.own_attributes.layer_position.0, first.own_attributes.layer_position.1);
    let (width, height) = (first.layer_size.0 as u32, first.layer_size.1 as u32);
    ExrImage {
        width,
        height,
        data_window_origin: origin,
        channels: Vec::new(),
        types: Vec::new(),
        unread: Vec::new(),
        attributes: attributes(first),
        parts_left_out: Vec::new(),
        lines_left_out: 0,
        part_of: if is_part { part_of(first) } else { None },
        is_display_window_left_out: !is_sound && !is_part,
        display_window: if is_sound && !is_part {
            let origin = (window.position.0, window.position.1);
            Window { origin, width: window.size.0 as u32, height: window.size.1 as u32 }
        } else {
            Window { origin, width, height }
        },
        pixel_aspect_ratio: Some(f64::from(first.shared_attributes.pixel_aspect))
            .filter(|ratio| (0.01..=100.0).contains(ratio))
            .unwrap_or(1.0),
        chromaticities: primaries(first),
    }
}

/// Width and height of the picture of a file that is in memory.
///
/// # Errors
/// Where its headers are damaged, or it would need too much memory.
pub fn size(path: &Path, file: &[u8]) -> Result<[u32; 2], ExrReadError> {
    let headers = read_headers(path, file)?;
    // Its sides were checked against the limit of memory.
    let Vec2(width, height) = layout(&headers).layer_size;
    Ok([width as u32, height as u32])
}

#[cfg(test)]
mod tests;
