//! Textures that loaders ask for while they read their file: everything is decoded at the end, in parallel, each
//! picture once.

mod decode;

pub(super) use decode::{Decoded, Values, decode_bytes, has_alpha, is_grey};

use super::LoadOptions;
pub(super) use super::adjust::{Adjust, Number};
use super::error::{LoadError, Place};
use super::texture_memory::{self, Alpha, Extent};
use crate::poison::Unpoisoned as _;
use crate::scene::{Encoding, Texture, TextureId, Wrap};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::hash_map::DefaultHasher;
use std::collections::{HashMap, HashSet};
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Where a picture comes from.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Picture {
    /// A file.
    File(PathBuf),
    /// Bytes inside another file; the name is for messages and tells them apart.
    Memory { name: String, bytes: Arc<Vec<u8>> },
    /// Linear texels made by a loader, as the bits of their floats.
    Texels { name: String, size: [u32; 2], bits: Arc<Vec<[u32; 4]>> },
}

/// What to do when the file is not there at all, or of a kind that is not read, and the place that names it. (A
/// damaged one is always an error.)
#[derive(Clone, Debug)]
pub(super) enum IfMissing {
    /// An error.
    Fail(Place),
    /// A note, and this texel everywhere instead.
    Replace([u8; 4], Place),
}

/// A texture that a scene file asks for.
#[derive(Clone, Debug)]
pub(super) struct Request {
    pub(super) picture: Picture,
    pub(super) encoding: Encoding,
    pub(super) wrap_u: Wrap,
    pub(super) wrap_v: Wrap,
    pub(super) nearest: bool,
    pub(super) if_missing: IfMissing,
    pub(super) adjust: Adjust,
}

impl Request {
    /// The texture that it asks for, of its decoded picture.
    fn texture(&self, picture: Decoded) -> Texture {
        Texture {
            name: self.picture.name(),
            width: picture.width,
            height: picture.height,
            texels: picture.texels,
            wrap_u: self.wrap_u,
            wrap_v: self.wrap_v,
            nearest: self.nearest,
        }
    }

    /// The same number for the same wish. Of bytes in memory only the name counts: to hash megabytes for each material
    /// that reads them would take longer than the comparison, which ends where both are the same allocation.
    fn likeness(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        match &self.picture {
            Picture::File(path) => path.hash(&mut hasher),
            Picture::Memory { name, .. } => name.hash(&mut hasher),
            Picture::Texels { name, bits, .. } => (name, bits).hash(&mut hasher),
        }
        (self.encoding, self.adjust).hash(&mut hasher);
        hasher.finish()
    }

    /// A picture that a loader made: `size` texels of linear RGBA, row 0 at the top.
    pub(super) fn texels(name: &str, size: [u32; 2], texels: &[[f32; 4]]) -> Self {
        let bits = Arc::new(texels.iter().map(|texel| texel.map(f32::to_bits)).collect());
        Self {
            picture: Picture::Texels { name: name.to_owned(), size, bits },
            encoding: Encoding::Linear,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            nearest: false,
            if_missing: IfMissing::Fail(Place::file(Path::new(name))),
            adjust: Adjust::NONE,
        }
    }
}

/// The textures asked for so far.
#[derive(Debug, Default)]
pub(super) struct Requests {
    requests: Vec<Request>,
    /// Places of requests by their likeness.
    alike: HashMap<u64, Vec<usize>>,
}

impl Requests {
    /// Notes a wish and returns the texture's future place; the same wish twice is one texture.
    pub(super) fn add(&mut self, request: Request) -> TextureId {
        let same = |other: &Request| {
            other.picture == request.picture
                && other.encoding == request.encoding
                && other.adjust == request.adjust
                && (other.wrap_u, other.wrap_v, other.nearest) == (request.wrap_u, request.wrap_v, request.nearest)
        };
        let alike = self.alike.entry(request.likeness()).or_default();
        let known = alike.iter().copied().find(|&place| same(&self.requests[place]));
        let place = known.unwrap_or_else(|| {
            alike.push(self.requests.len());
            self.requests.push(request);
            self.requests.len() - 1
        });
        TextureId(place as u32)
    }

    /// The place of the same picture with its values raised to a power, as a texture of its own.
    pub(super) fn raised(&mut self, texture: TextureId, exponent: f32) -> TextureId {
        let mut request = self.requests[texture.0 as usize].clone();
        request.adjust.exponent_bits = (f32::from_bits(request.adjust.exponent_bits) * exponent).to_bits();
        self.add(request)
    }

    /// Whether a texture is a file with an alpha channel, by its header.
    pub(super) fn has_alpha(&self, texture: TextureId) -> bool {
        matches!(&self.requests[texture.0 as usize].picture, Picture::File(path) if has_alpha(path))
    }

    /// Mean linear colour of a texture, for what has no place for a picture: which is decoded for it.
    pub(super) fn mean_color(&self, texture: TextureId) -> Result<Vec3, LoadError> {
        Ok(self.decoded(texture)?.mean_color())
    }

    /// The largest linear colour value of a texture, which is decoded for it.
    pub(super) fn brightest(&self, texture: TextureId) -> Result<f32, LoadError> {
        Ok(self.decoded(texture)?.brightest())
    }

    fn decoded(&self, texture: TextureId) -> Result<Texture, LoadError> {
        let request = &self.requests[texture.0 as usize];
        let decoded = decode::decode(&request.picture, request.encoding, request.adjust.values(request.encoding));
        let mut slot = Slot::from(decoded.map(|picture| request.adjust.apply(picture)));
        // That a picture is not there is said where all are decoded.
        Ok(request.texture(slot.take_for(request, &mut Vec::new())?))
    }

    /// Decodes everything. `notes` gets a sentence for each missing file that was replaced, and one of what was made
    /// smaller. `coverage` are the textures whose alpha is how much of the surface is there.
    pub(super) fn decode(
        self,
        notes: &mut Vec<String>,
        options: &LoadOptions,
        coverage: &HashSet<TextureId>,
    ) -> Result<Vec<Texture>, LoadError> {
        let Distinct { wanted, place_of } = self.distinct();
        let halvings = match options.texture_memory {
            None => vec![0; wanted.len()],
            Some(limit) => fit(&wanted, limit, notes),
        };
        let decoded = decode_all(&wanted, &halvings, &self.covering(coverage), options.on_texture);
        add_notes_of(&wanted, &decoded, notes);
        let mut slots: Vec<Slot> = decoded.into_iter().map(Slot::from).collect();
        let places = self.requests.iter().zip(place_of);
        places.map(|(request, place)| Ok(request.texture(slots[place].take_for(request, notes)?))).collect()
    }

    /// What is to be decoded, each thing once, in the order of the requests.
    fn distinct(&self) -> Distinct<'_> {
        let mut known = HashMap::new();
        let mut wanted = Vec::new();
        let place_of = self.requests.iter().map(|request| {
            let key = (&request.picture, request.encoding, request.adjust);
            *known.entry(key).or_insert_with(|| {
                wanted.push(key);
                wanted.len() - 1
            })
        });
        let place_of = place_of.collect();
        Distinct { wanted, place_of }
    }

    /// The pictures whose alpha is coverage in any of their uses: a colour and its coverage may be read with different
    /// encodings.
    fn covering(&self, coverage: &HashSet<TextureId>) -> HashSet<&Picture> {
        let ids = (0..).map(TextureId);
        let covers = self.requests.iter().zip(ids).filter(|(_, id)| coverage.contains(id));
        covers.map(|(request, _)| &request.picture).collect()
    }
}

/// A picture as it is decoded.
type Wanted<'a> = (&'a Picture, Encoding, Adjust);

/// What requests come to once none is done twice.
struct Distinct<'a> {
    wanted: Vec<Wanted<'a>>,
    /// Place of each request in `wanted`.
    place_of: Vec<usize>,
}

/// Decodes in parallel, and makes each picture smaller as soon as it is there.
fn decode_all(
    wanted: &[Wanted],
    halvings: &[u32],
    covering: &HashSet<&Picture>,
    on_texture: Option<fn(usize, usize)>,
) -> Vec<Result<Decoded, LoadError>> {
    let done = Mutex::new(0);
    let decode_one = |((picture, encoding, adjust), halvings): (&Wanted, &u32)| {
        let decoded = decode::decode(picture, *encoding, adjust.values(*encoding));
        if let Some(tell) = on_texture {
            // Told as it is counted: what is told last is the last.
            let mut done = done.lock().unpoisoned();
            *done += 1;
            tell(*done, wanted.len());
        }
        let (alpha, decoded) = match covering.contains(picture) {
            true => (Alpha::Coverage, decoded?.without_alpha_in_colours()),
            false => (Alpha::Independent, decoded?),
        };
        Ok(texture_memory::shrunk(adjust.apply(decoded), *halvings, alpha))
    };
    wanted.par_iter().zip(halvings).map(decode_one).collect()
}

/// Says what was done to the values of pictures, once of those that are decoded in several ways.
fn add_notes_of(wanted: &[Wanted], decoded: &[Result<Decoded, LoadError>], notes: &mut Vec<String>) {
    for ((picture, ..), decoded) in wanted.iter().zip(decoded) {
        for note in decoded.iter().flat_map(|decoded| &decoded.notes) {
            let note = format!("Texture {}: {note}.", picture.name());
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
}

/// What decoding a picture came to, for all who asked for it.
enum Slot {
    Picture(Decoded),
    /// Told to the first who asks, whose word it is whether a plain picture stands in.
    Failed(LoadError),
}

impl From<Result<Decoded, LoadError>> for Slot {
    fn from(decoded: Result<Decoded, LoadError>) -> Self {
        decoded.map_or_else(Self::Failed, Self::Picture)
    }
}

impl Slot {
    /// The picture for a request, or the plain one that it names where the file is not there, with a note.
    fn take_for(&mut self, request: &Request, notes: &mut Vec<String>) -> Result<Decoded, LoadError> {
        let error = match self {
            Self::Picture(picture) => return Ok(picture.clone()),
            Self::Failed(error) => error,
        };
        match &request.if_missing {
            IfMissing::Replace(texel, place) if error.is_unreadable() || error.is_unsupported() => {
                let how = if error.is_unreadable() { "found" } else { "read" };
                let error = error.clone().referenced_from(place.clone());
                notes.push(format!("Texture not {how}, a plain one stands in: {error}."));
                let plain = Decoded::plain(*texel, request.encoding);
                *self = Self::Picture(plain.clone());
                Ok(plain)
            }
            IfMissing::Replace(_, place) | IfMissing::Fail(place) => Err(error.clone().referenced_from(place.clone())),
        }
    }
}

/// How often each picture must be halved to keep to `limit` bytes, with a note of what that does.
fn fit(pictures: &[Wanted], limit: u64, notes: &mut Vec<String>) -> Vec<u32> {
    let nothing = Extent { width: 0, height: 0, bytes_per_texel: 0 };
    // What cannot be measured is not decoded either: its error comes then.
    let extents: Vec<Extent> =
        pictures.iter().map(|(picture, _, adjust)| extent(picture, *adjust).unwrap_or(nothing)).collect();
    let halvings = texture_memory::halvings(&extents, limit);
    let smaller: Vec<String> = (pictures.iter().zip(&extents).zip(&halvings))
        .filter(|(_, halvings)| **halvings > 0)
        .map(|(((picture, ..), Extent { width, height, .. }), &halvings)| {
            let (new_width, new_height) =
                (texture_memory::halved(*width, halvings), texture_memory::halved(*height, halvings));
            format!("{} from {width} x {height} to {new_width} x {new_height}", picture.name())
        })
        .collect();
    if !smaller.is_empty() {
        let megabytes = limit as f64 / 1e6;
        notes.push(format!("To keep textures within {megabytes} MB, some are smaller: {}.", smaller.join(", ")));
    }
    halvings
}

/// What a picture will take once it is decoded, by its header.
fn extent(picture: &Picture, adjust: Adjust) -> Option<Extent> {
    let (width, height, eight_bit) = match picture {
        Picture::File(path) => decode::measure(&super::files::read(path).ok()?, path)?,
        Picture::Memory { name, bytes } => decode::measure(bytes, Path::new(name))?,
        Picture::Texels { size: [width, height], .. } => (*width, *height, false),
    };
    let bytes_per_texel = if eight_bit && adjust == Adjust::NONE { 4 } else { 16 };
    Some(Extent { width, height, bytes_per_texel })
}

impl Picture {
    fn name(&self) -> String {
        match self {
            Self::File(path) => path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
            Self::Memory { name, .. } | Self::Texels { name, .. } => name.clone(),
        }
    }
}
