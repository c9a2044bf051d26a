//! Picture files: what is in them, and how they are written.
//!
//! [`write_exr`] writes linear data of any number of channels, [`write_png`] a picture for a display. Both write beside
//! the target and rename, so that a target is either the old file, the new file or absent, never a part of one; and
//! both give equal bytes for equal pixels, so that files can be compared by their hash.
//!
//! Call [`check_target`] before a long render: it finds out whether the file can be written at all.

pub mod attribute;
mod beside;
pub mod channel;
pub mod covered;
mod exr_file;
mod exr_header;
pub mod false_colour;
mod frame_rate;
mod picture_format;
mod png_file;
mod png_read;
pub mod rendered;
mod srgb_codes;

pub use beside::{
    abandon_unfinished, check_name, folder_of, hidden_name, remove_leftovers, shortened_name, target_of, write_beside,
    write_beside_by_name,
};
pub use exr_file::write_exr;
pub use frame_rate::FRAMES_PER_SECOND;
pub(crate) use frame_rate::fraction;
pub use picture_format::PictureFormat;
pub use png_file::{DisplayedPicture, encode_srgb8, write_codes_png, write_png, write_png_for};
pub(crate) use png_read::{PROFILE_NOT_READ, names_srgb};
pub use png_read::{PngColour, PngTransfer, decode_pq, png_colour, png_pixel_aspect_ratio};

use crate::integrator::{Crop, TraceSettings};
use fechner_perception::Display;
use fechner_perception::tone::FittedTone;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Luminance of RGB (1, 1, 1) in cd/m². [`write_exr`] copies this attribute to the standard `whiteLuminance` too.
pub const NITS_PER_UNIT: &str = "nits_per_unit";
/// Set by [`write_exr`], and only when it had to change values: how many were not finite or too large for half floats.
pub const REPLACED_VALUES: &str = "replaced_values";

/// Width of a pixel over its height: [`write_exr`] puts this attribute where the format has it.
pub const PIXEL_ASPECT_RATIO: &str = "pixelAspectRatio";
/// Written by [`write_exr`] where the picture is a part of a larger one: left, top, width and height in pixels. Readers
/// here show such a part alone, not the display window around it.
pub const CROP: &str = "fechner.crop";

/// The attribute that keeps all of a display, as JSON in ASCII: readers take an attribute's text for UTF-8, the writer
/// has Latin-1.
pub fn display_attribute(display: &Display) -> Option<(String, Attribute)> {
    let text = serde_json::to_string(display).ok()?;
    let mut ascii = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_ascii() {
            ascii.push(character);
        } else {
            character.encode_utf16(&mut [0; 2]).iter().for_each(|unit| ascii += &format!("\\u{unit:04x}"));
        }
    }
    Some((attribute::DISPLAY.to_owned(), Attribute::Text(ascii)))
}

/// The fit of a tone operator as JSON of a [`fechner_perception::tone::SavedTone`]. None for one that knows places: it
/// has values for each pixel, and can be fitted to the picture again.
pub fn tone_attribute(fitted: &dyn FittedTone) -> Option<(String, Attribute)> {
    const LONGEST: usize = 1 << 16;
    let text = serde_json::to_string(&fitted.save()).ok().filter(|text| text.len() <= LONGEST)?;
    Some((attribute::TONE.to_owned(), Attribute::Text(text)))
}

/// A picture of named channels, row-major from the top left.
#[derive(Clone, Debug, Default)]
pub struct Picture<'a> {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Channels, in any order; the file holds them sorted by name, as the format asks.
    pub channels: Vec<Channel<'a>>,
    /// Where it lies, if it is a part of a larger picture.
    pub part_of: Option<PartOf>,
    /// What a reader should know: observer, seed, [`NITS_PER_UNIT`].
    pub attributes: Vec<(String, Attribute)>,
}

/// The place of a picture in a larger one, in whose window compositors put it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartOf {
    /// Top left pixel of the picture in the whole, x to the right and y down.
    pub origin: [u32; 2],
    /// Width and height of the whole in pixels.
    pub whole: [u32; 2],
}

impl PartOf {
    /// The place of a render's picture in its whole; `None` where all of it is traced.
    pub fn of(trace: &TraceSettings) -> Option<Self> {
        let part = |crop: Crop| Self { origin: [crop.x, crop.y], whole: [trace.width, trace.height] };
        trace.crop.map(part)
    }
}

/// Values of one channel.
#[derive(Clone, Debug)]
pub struct Channel<'a> {
    /// Name as other tools know it: `R`, `albedo.R`, `normal.X`, `depth.Z`, `samples.Y`.
    pub name: String,
    /// One value a pixel.
    pub values: ChannelValues<'a>,
}

/// Values of a channel and how the file stores them.
#[derive(Clone, Debug)]
pub enum ChannelValues<'a> {
    /// Stored as 32-bit floats. Infinities become the largest finite value, NaN becomes 0.
    F32(Cow<'a, [f32]>),
    /// Stored as half floats, clamped to ±65504. NaN becomes 0.
    F16(Cow<'a, [f32]>),
    /// Stored as 32-bit unsigned integers.
    U32(Cow<'a, [u32]>),
}

impl ChannelValues<'_> {
    /// How many values there are.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(values) | Self::F16(values) => values.len(),
            Self::U32(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl<'a> Picture<'a> {
    /// A picture without channels.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// Adds a channel of 32-bit floats.
    pub fn push_f32(&mut self, name: &str, values: impl Into<Cow<'a, [f32]>>) {
        self.channels.push(Channel { name: name.to_owned(), values: ChannelValues::F32(values.into()) });
    }

    /// Adds a channel of half floats.
    pub fn push_f16(&mut self, name: &str, values: impl Into<Cow<'a, [f32]>>) {
        self.channels.push(Channel { name: name.to_owned(), values: ChannelValues::F16(values.into()) });
    }

    /// Adds a channel of 32-bit unsigned integers.
    pub fn push_u32(&mut self, name: &str, values: impl Into<Cow<'a, [u32]>>) {
        self.channels.push(Channel { name: name.to_owned(), values: ChannelValues::U32(values.into()) });
    }

    /// Adds an attribute.
    pub fn push_attribute(&mut self, name: &str, value: Attribute) {
        self.attributes.push((name.to_owned(), value));
    }
}

/// A named fact about a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Text in ASCII: a few signs (², ×, –) have a plain one instead, all other characters become `?`, since the format
    /// does not say what its bytes mean.
    Text(String),
    /// A number.
    Float(f32),
    /// A whole number.
    Integer(i32),
}

impl std::fmt::Display for Attribute {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Float(number) => number.fmt(f),
            Self::Integer(number) => number.fmt(f),
        }
    }
}

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The folder to write into is not there.
    #[error("cannot write {}: the folder {} does not exist; create it first", .path.display(), .folder.display())]
    MissingFolder {
        /// The file asked for.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
    /// The target is a folder, a device or a pipe.
    #[error("cannot write {}: it is {found}; name an ordinary file", .path.display())]
    NotAFile {
        /// The target asked for.
        path: PathBuf,
        /// What it is.
        found: &'static str,
    },
    /// The system takes no such name.
    #[error("cannot write {}: the system takes no name like this one, of {bytes} bytes; choose a shorter one", .path.display())]
    LongName {
        /// The file asked for.
        path: PathBuf,
        /// Length of its name.
        bytes: usize,
    },
    /// The name's ending says nothing about the format.
    #[error("cannot write {}: {}; end the name in .png or .exr", .path.display(), extension_problem(.path))]
    UnknownExtension {
        /// The file asked for.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("cannot write {}: {error}", .path.display())]
    Io {
        /// The file asked for.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// Nobody could read it again; a mistake of the caller.
    #[error("cannot write {}: {problem}, and it would be refused as damaged", .path.display())]
    Unreadable {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong with what it would hold.
        problem: &'static str,
    },
    /// The picture itself makes no sense; a mistake of the caller.
    #[error("cannot write {}: {problem}", .path.display())]
    BadPicture {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong with the picture.
        problem: String,
    },
}

fn extension_problem(path: &Path) -> String {
    match path.extension() {
        Some(extension) => format!("\".{}\" is no picture format that can be written", extension.to_string_lossy()),
        None => "its name has no ending that tells the format".to_owned(),
    }
}

/// Tells whether `path` can be written, before the work is done: known ending, existing folder that lets files be made,
/// and nothing but a file in its place. Leaves nothing behind.
///
/// # Errors
/// Says why not.
pub fn check_target(path: &Path) -> Result<PictureFormat, OutputError> {
    let format = PictureFormat::of(path)?;
    beside::create_beside(path)?;
    Ok(format)
}

/// Tells whether any file can be written at `path`, whatever its ending. Leaves nothing behind.
///
/// # Errors
/// Says why not.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    beside::create_beside(path).map(|_| ())
}

/// Checks that a picture of this size exists and that its arrays fit it.
fn check_size(path: &Path, width: u32, height: u32, arrays: &[(&str, usize)]) -> Result<(), OutputError> {
    let bad = |problem: String| OutputError::BadPicture { path: path.to_owned(), problem };
    if width == 0 || height == 0 {
        return Err(bad(format!("a picture of {width}×{height} pixels has no pixels")));
    }
    let pixels = width as usize * height as usize;
    for &(name, len) in arrays {
        if len != pixels {
            return Err(bad(format!("{name} has {len} values for {width}×{height} = {pixels} pixels")));
        }
    }
    Ok(())
}
