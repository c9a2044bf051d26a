//! Decoding pictures: PNG, JPEG, Radiance HDR, TGA, TIFF, BMP, WebP through `image`, OpenEXR through `exr_read`. 8-bit pictures stay bytes
//! (4 a texel), all others become linear floats (16 a texel).

use super::Picture;
use crate::exr_read::{self, layer_and_part};
use crate::hdr_read::{HdrHeader, with_known_header};
use crate::jpeg_read;
use crate::scene::load::{LoadError, files};
use crate::scene::{Encoding, Texels, texture};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

/// Widest and highest picture that is decoded.
const LONGEST_SIDE: u32 = 16_384;
/// Most bytes that one decoded picture may take.
const MOST_BYTES: u64 = 512 << 20;

/// A decoded picture.
#[derive(Clone, Debug)]
pub(in crate::scene::load) struct Decoded {
    pub(in crate::scene::load) width: u32,
    pub(in crate::scene::load) height: u32,
    pub(in crate::scene::load) texels: Texels,
}

impl Decoded {
    pub(super) fn plain(texel: [u8; 4], encoding: Encoding) -> Self {
        Self { width: 1, height: 1, texels: Texels::Bytes(Arc::new(vec![texel]), encoding) }
    }
}

/// Width, height, and whether all channels have 8 bits.
pub(super) fn measure(bytes: &[u8], name: &Path) -> Option<(u32, u32, bool)> {
    if exr_read::is_exr(bytes) {
        let [width, height] = exr_read::size(name, bytes).ok()?;
        return Some((width, height, false));
    }
    let decoder = ImageReader::with_format(Cursor::new(bytes), format_of(bytes, name)?).into_decoder().ok()?;
    let (width, height) = decoder.dimensions();
    Some((width, height, is_eight_bit(decoder.color_type())))
}

/// Whether a file is a picture with an alpha channel, by its header.
pub(in crate::scene::load) fn has_alpha(path: &Path) -> bool {
    color_type(path).is_some_and(|color| color.has_alpha())
}

/// Whether a file is a picture that is grey by its header.
pub(in crate::scene::load) fn is_grey(path: &Path) -> bool {
    color_type(path).is_some_and(|color| !color.has_color())
}

fn color_type(path: &Path) -> Option<image::ColorType> {
    Some(ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?.color_type())
}

/// Decodes one picture.
pub(super) fn decode(picture: &Picture, encoding: Encoding) -> Result<Decoded, LoadError> {
    match picture {
        Picture::File(path) => decode_bytes(&files::read(path)?, path, encoding),
        Picture::Memory { name, bytes } => decode_bytes(bytes, Path::new(name), encoding),
        Picture::Texels { size: [width, height], bits, .. } => {
            let texels = bits.iter().map(|texel| texel.map(f32::from_bits)).collect();
            Ok(Decoded { width: *width, height: *height, texels: Texels::Floats(Arc::new(texels)) })
        }
    }
}

/// Decodes a picture that is in memory. Its kind is told from its first bytes, else from its name.
pub(in crate::scene::load) fn decode_bytes(
    bytes: &[u8],
    name: &Path,
    encoding: Encoding,
) -> Result<Decoded, LoadError> {
    if exr_read::is_exr(bytes) {
        return decode_exr(bytes, name);
    }
    let bytes = &*with_known_header(bytes);
    let wrong = |error: image::ImageError| match error {
        image::ImageError::Limits(_) => LoadError::too_large(name, format_args!("the picture is too large: {error}")),
        _ => LoadError::invalid(name, format_args!("not a readable picture: {error}")),
    };
    let Some(format) = format_of(bytes, name) else {
        return Err(LoadError::unsupported(
            name,
            "not a picture that is read: png, jpg, hdr, tga, tiff, bmp, webp, exr are",
        ));
    };

    let decoder = limited(ImageReader::with_format(Cursor::new(bytes), format)).into_decoder().map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    let eight_bit = is_eight_bit(decoder.color_type());
    // Not every decoder looks at the limits: these hold before any of them allocates.
    check_size(name, u64::from(width), u64::from(height), if eight_bit { 4 } else { 16 })?;

    if format == ImageFormat::Jpeg && !jpeg_read::has_end(bytes) {
        return Err(LoadError::invalid(name, jpeg_read::CUT_OFF));
    }
    let image = DynamicImage::from_decoder(decoder).map_err(wrong)?;
    let texels = match eight_bit {
        true => Texels::Bytes(Arc::new(image.into_rgba8().into_raw().as_chunks::<4>().0.to_vec()), encoding),
        false => {
            let header = (format == ImageFormat::Hdr).then(|| HdrHeader::of(bytes));
            Texels::Floats(Arc::new(linear_floats(image, encoding, header)))
        }
    };
    Ok(Decoded { width, height, texels })
}

/// The reader with the limits that hold for textures.
fn limited<R: std::io::BufRead + std::io::Seek>(mut reader: ImageReader<R>) -> ImageReader<R> {
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    reader
}

/// Linear texels: 16-bit integers under the sRGB curve are unfolded, floats are linear already, but for what the header of a
/// Radiance file says.
fn linear_floats(image: DynamicImage, encoding: Encoding, header: Option<HdrHeader>) -> Vec<[f32; 4]> {
    let unfold =
        encoding == Encoding::Srgb && !matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let mut texels = image.into_rgba32f().into_raw().as_chunks::<4>().0.to_vec();
    for [r, g, b, _] in &mut texels {
        [*r, *g, *b] = header.map_or([*r, *g, *b], |header| header.light([*r, *g, *b]));
        for value in [r, g, b] {
            *value = if unfold { texture::srgb_to_linear(*value) } else { finite_or_zero(*value) };
        }
    }
    texels
}

/// The format of a picture other than EXR, if it is one that is read.
fn format_of(bytes: &[u8], name: &Path) -> Option<ImageFormat> {
    use ImageFormat::{Bmp, Hdr, Jpeg, Png, Tga, Tiff, WebP};
    let known = [Png, Jpeg, Hdr, Tga, Tiff, Bmp, WebP];
    let format = image::guess_format(bytes).ok().or_else(|| ImageFormat::from_path(name).ok());
    format.filter(|format| known.contains(format))
}

fn is_eight_bit(color: image::ColorType) -> bool {
    use image::ColorType::{L8, La8, Rgb8, Rgba8};
    matches!(color, L8 | La8 | Rgb8 | Rgba8)
}

fn decode_exr(bytes: &[u8], name: &Path) -> Result<Decoded, LoadError> {
    // A picture of one channel is grey; parts prefix their names.
    let of_colour = |all: &[String]| {
        all.iter().filter(|name| ["R", "G", "B", "A", "Y"].contains(&layer_and_part(name).1)).cloned().collect()
    };
    let picture = exr_read::decode_exr_channels(name, bytes, of_colour).map_err(|error| match error {
        exr_read::ExrReadError::TooLarge { .. } => LoadError::too_large(name, error),
        _ => LoadError::invalid(name, error),
    })?;
    let (width, height) = (u64::from(picture.width), u64::from(picture.height));
    check_size(name, width, height, 16)?;
    let find = |wanted: &str| {
        picture.channel(wanted).or_else(|| {
            picture.channels.iter().find(|(n, _)| layer_and_part(n).1 == wanted).map(|(_, values)| values.as_slice())
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
