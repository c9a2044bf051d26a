//! Decoding pictures into textures: PNG, JPEG, Radiance HDR, TGA, TIFF through `image`, OpenEXR through `exr_read`.
//!
//! Loaders ask for textures while they read their file; everything is decoded at the end, in parallel, each picture
//! once. 8-bit pictures stay bytes (4 a texel), all others become linear floats (16 a texel).

use super::LoadOptions;
pub(super) use super::adjust::Adjust;
use super::error::{LoadError, Place};
use super::texture_memory::{self, Alpha, Extent};
use crate::exr_read;
use crate::hdr_read::HdrHeader;
use crate::scene::{Encoding, Texels, Texture, TextureId, Wrap, texture};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Widest and highest picture that is decoded.
const LONGEST_SIDE: u32 = 16_384;
/// Most bytes that one decoded picture may take.
const MOST_BYTES: u64 = 512 << 20;

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

/// What to do when the file is not there at all. (A damaged one is always an error.)
#[derive(Clone, Debug)]
pub(super) enum IfMissing {
    /// An error that names the place which names the file.
    Fail(Place),
    /// A note, and this texel everywhere instead.
    Replace([u8; 4]),
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
    /// A picture that a loader made: `size` texels of linear RGBA, row 0 at the top.
    pub(super) fn texels(name: &str, size: [u32; 2], texels: &[[f32; 4]]) -> Self {
        let bits = Arc::new(texels.iter().map(|texel| texel.map(f32::to_bits)).collect());
        Self {
            picture: Picture::Texels { name: name.to_owned(), size, bits },
            encoding: Encoding::Linear,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            nearest: false,
            if_missing: IfMissing::Replace([128; 4]),
            adjust: Adjust::NONE,
        }
    }
}

/// The textures asked for so far.
#[derive(Debug, Default)]
pub(super) struct Requests {
    requests: Vec<Request>,
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
        let place = self.requests.iter().position(same).unwrap_or_else(|| {
            self.requests.push(request);
            self.requests.len() - 1
        });
        TextureId(place as u32)
    }

    /// Decodes everything. `notes` gets a sentence for each missing file that was replaced, and one of what was made smaller.
    /// `coverage` says which textures' alpha is how much of the surface is there.
    pub(super) fn decode(
        self,
        notes: &mut Vec<String>,
        options: &LoadOptions,
        coverage: impl Fn(TextureId) -> bool,
    ) -> Result<Vec<Texture>, LoadError> {
        let mut place_of = HashMap::new();
        let mut distinct = Vec::new();
        for request in &self.requests {
            place_of.entry((&request.picture, request.encoding, request.adjust)).or_insert_with(|| {
                distinct.push((&request.picture, request.encoding, request.adjust));
                distinct.len() - 1
            });
        }
        let halvings = match options.texture_memory {
            None => vec![0; distinct.len()],
            Some(limit) => fit(&distinct, limit, notes),
        };
        // A colour and its coverage may be read with different encodings: it is the picture that counts.
        let ids = (0..).map(TextureId);
        let covering: HashSet<&Picture> = self
            .requests
            .iter()
            .zip(ids)
            .filter(|(_, id)| coverage(*id))
            .map(|(request, _)| &request.picture)
            .collect();
        let done = AtomicUsize::new(0);
        let decoded: Vec<Result<Decoded, LoadError>> = distinct
            .par_iter()
            .zip(&halvings)
            .map(|((picture, encoding, adjust), halvings)| {
                let decoded = decode(picture, *encoding);
                if let Some(tell) = options.on_texture {
                    tell(done.fetch_add(1, Ordering::Relaxed) + 1, distinct.len());
                }
                let alpha = if covering.contains(picture) { Alpha::Coverage } else { Alpha::Independent };
                Ok(texture_memory::shrunk(adjust.apply(decoded?), *halvings, alpha))
            })
            .collect();
        let mut decoded: Vec<Option<Result<Decoded, LoadError>>> = decoded.into_iter().map(Some).collect();

        let mut textures = Vec::with_capacity(self.requests.len());
        for request in &self.requests {
            let slot = &mut decoded[place_of[&(&request.picture, request.encoding, request.adjust)]];
            let picture = match slot {
                Some(Ok(picture)) => picture.clone(),
                _ => match (slot.take(), &request.if_missing) {
                    (Some(Err(error)), IfMissing::Replace(texel)) if error.is_unreadable() => {
                        notes.push(format!("Texture not found, a plain one stands in: {error}."));
                        let plain = Decoded::plain(*texel, request.encoding);
                        *slot = Some(Ok(plain.clone()));
                        plain
                    }
                    (Some(Err(error)), IfMissing::Fail(place)) => {
                        return Err(error.referenced_from(place.clone()));
                    }
                    (Some(Err(error)), IfMissing::Replace(_)) => return Err(error),
                    (Some(Ok(_)) | None, _) => {
                        unreachable!("a failed picture ends the loop or is replaced")
                    }
                },
            };
            textures.push(Texture {
                name: request.picture.name(),
                width: picture.width,
                height: picture.height,
                texels: picture.texels,
                wrap_u: request.wrap_u,
                wrap_v: request.wrap_v,
                nearest: request.nearest,
            });
        }
        Ok(textures)
    }
}

/// How often each picture must be halved to keep to `limit` bytes, with a note of what that does.
fn fit(pictures: &[(&Picture, Encoding, Adjust)], limit: u64, notes: &mut Vec<String>) -> Vec<u32> {
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
        Picture::File(path) => measure(&super::files::read(path).ok()?, path)?,
        Picture::Memory { name, bytes } => measure(bytes, Path::new(name))?,
        Picture::Texels { size: [width, height], .. } => (*width, *height, false),
    };
    let bytes_per_texel = if eight_bit && adjust == Adjust::NONE { 4 } else { 16 };
    Some(Extent { width, height, bytes_per_texel })
}

/// Width, height, and whether all channels have 8 bits.
fn measure(bytes: &[u8], name: &Path) -> Option<(u32, u32, bool)> {
    if exr_read::is_exr(bytes) {
        let [width, height] = exr_read::size(name, bytes).ok()?;
        return Some((width, height, false));
    }
    let decoder = ImageReader::with_format(Cursor::new(bytes), format_of(bytes, name)?).into_decoder().ok()?;
    let (width, height) = decoder.dimensions();
    Some((width, height, is_eight_bit(decoder.color_type())))
}

impl Picture {
    fn name(&self) -> String {
        match self {
            Self::File(path) => path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
            Self::Memory { name, .. } | Self::Texels { name, .. } => name.clone(),
        }
    }
}

/// A decoded picture.
#[derive(Clone, Debug)]
pub(super) struct Decoded {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) texels: Texels,
}

impl Decoded {
    fn plain(texel: [u8; 4], encoding: Encoding) -> Self {
        Self { width: 1, height: 1, texels: Texels::Bytes(Arc::new(vec![texel]), encoding) }
    }
}

/// Whether a file is a picture with an alpha channel, by its header.
pub(super) fn has_alpha(path: &Path) -> bool {
    color_type(path).is_some_and(|color| color.has_alpha())
}

/// Whether a file is a picture that is grey by its header.
pub(super) fn is_grey(path: &Path) -> bool {
    color_type(path).is_some_and(|color| !color.has_color())
}

fn color_type(path: &Path) -> Option<image::ColorType> {
    Some(ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?.color_type())
}

/// Decodes one picture.
fn decode(picture: &Picture, encoding: Encoding) -> Result<Decoded, LoadError> {
    match picture {
        Picture::File(path) => decode_bytes(&super::files::read(path)?, path, encoding),
        Picture::Memory { name, bytes } => decode_bytes(bytes, Path::new(name), encoding),
        Picture::Texels { size: [width, height], bits, .. } => {
            let texels = bits.iter().map(|texel| texel.map(f32::from_bits)).collect();
            Ok(Decoded { width: *width, height: *height, texels: Texels::Floats(Arc::new(texels)) })
        }
    }
}

/// Decodes a picture that is in memory. Its kind is told from its first bytes, else from its name.
pub(super) fn decode_bytes(bytes: &[u8], name: &Path, encoding: Encoding) -> Result<Decoded, LoadError> {
    if exr_read::is_exr(bytes) {
        return decode_exr(bytes, name);
    }
    let wrong = |error: image::ImageError| match error {
        image::ImageError::Limits(_) => LoadError::too_large(name, format_args!("the picture is too large: {error}")),
        _ => LoadError::invalid(name, format_args!("not a readable picture: {error}")),
    };
    let Some(format) = format_of(bytes, name) else {
        return Err(LoadError::unsupported(name, "not a picture that is read: png, jpg, hdr, tga, tiff, exr are"));
    };

    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    let eight_bit = is_eight_bit(decoder.color_type());
    // Not every decoder looks at the limits: these hold before any of them allocates.
    check_size(name, u64::from(width), u64::from(height), if eight_bit { 4 } else { 16 })?;

    let image = DynamicImage::from_decoder(decoder).map_err(wrong)?;
    let header = (format == ImageFormat::Hdr).then(|| HdrHeader::of(bytes));
    let texels = if eight_bit {
        let bytes = image.into_rgba8().into_raw();
        Texels::Bytes(Arc::new(bytes.as_chunks::<4>().0.to_vec()), encoding)
    } else {
        // 16-bit integers under the sRGB curve are unfolded here, floats are linear already.
        let unfold = encoding == Encoding::Srgb
            && !matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
        let mut texels = image.into_rgba32f().into_raw().as_chunks::<4>().0.to_vec();
        for [r, g, b, _] in &mut texels {
            [*r, *g, *b] = header.map_or([*r, *g, *b], |header| header.light([*r, *g, *b]));
            for value in [r, g, b] {
                *value = if unfold { texture::srgb_to_linear(*value) } else { finite_or_zero(*value) };
            }
        }
        Texels::Floats(Arc::new(texels))
    };
    Ok(Decoded { width, height, texels })
}

/// The format of a picture other than EXR, if it is one that is read.
fn format_of(bytes: &[u8], name: &Path) -> Option<ImageFormat> {
    let known = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Hdr, ImageFormat::Tga, ImageFormat::Tiff];
    let format = image::guess_format(bytes).ok().or_else(|| ImageFormat::from_path(name).ok());
    format.filter(|format| known.contains(format))
}

fn is_eight_bit(color: image::ColorType) -> bool {
    use image::ColorType::{L8, La8, Rgb8, Rgba8};
    matches!(color, L8 | La8 | Rgb8 | Rgba8)
}

fn decode_exr(bytes: &[u8], name: &Path) -> Result<Decoded, LoadError> {
    let picture = exr_read::decode_exr(name, bytes).map_err(|error| match error {
        exr_read::ExrReadError::TooLarge { .. } => LoadError::too_large(name, error),
        _ => LoadError::invalid(name, error),
    })?;
    let (width, height) = (u64::from(picture.width), u64::from(picture.height));
    check_size(name, width, height, 16)?;
    // A picture of one channel is grey; parts prefix their names.
    let find = |wanted: &str| {
        let suffix = format!(".{wanted}");
        picture.channel(wanted).or_else(|| {
            picture.channels.iter().find(|(n, _)| n.ends_with(&suffix)).map(|(_, values)| values.as_slice())
        })
    };
    let (Some(red), alpha) = (find("R").or_else(|| find("Y")), find("A")) else {
        return Err(LoadError::unsupported(name, "the picture has neither a channel R nor a channel Y"));
    };
    let (green, blue) = (find("G").unwrap_or(red), find("B").unwrap_or(red));
    let texels =
        (0..red.len()).map(|i| [red[i], green[i], blue[i], alpha.map_or(1.0, |a| a[i])].map(finite_or_zero)).collect();
    Ok(Decoded { width: picture.width, height: picture.height, texels: Texels::Floats(Arc::new(texels)) })
}

fn check_size(name: &Path, width: u64, height: u64, bytes_per_texel: u64) -> Result<(), LoadError> {
    if width == 0 || height == 0 {
        return Err(LoadError::invalid(name, format_args!("the picture is empty ({width} x {height} pixels)")));
    }
    let side = u64::from(LONGEST_SIDE);
    if width > side || height > side || width * height * bytes_per_texel > MOST_BYTES {
        let limit = MOST_BYTES / bytes_per_texel / 1_000_000;
        return Err(LoadError::too_large(
            name,
            format_args!(
                "the picture has {width} x {height} pixels; at most {side} a side and {limit} million are read"
            ),
        ));
    }
    Ok(())
}

/// A picture's value as radiance: NaN and infinities would poison every path that meets them.
fn finite_or_zero(value: f32) -> f32 {
    if value.is_finite() { value } else { 0.0 }
}
