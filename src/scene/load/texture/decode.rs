//! Decoding pictures: PNG, JPEG, Radiance HDR, TGA, TIFF, BMP, WebP through `image`, OpenEXR through
//! `exr_read`. 8-bit pictures stay bytes (4 a texel), all others become linear floats (16 a texel). Which
//! texture wants what is left to [`super`].

use super::Picture;
use crate::exr_read::layers::colour_layer;
use crate::exr_read::{self, ExrImage, Window, layer_and_part, negative_light};
use crate::hdr_read::{self, HdrHeader, with_known_header};
use crate::jpeg_read;
use crate::read_file;
use crate::scene::load::{LoadError, files};
use crate::scene::{Encoding, Texels};
use fechner_perception::eotf::srgb_to_linear;
use fechner_perception::tone::gamut;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::io::{BufReader, Cursor};
use std::path::Path;
use std::sync::Arc;

/// Widest and highest picture that is decoded.
const LONGEST_SIDE: u32 = 16_384;
/// Most bytes that one decoded picture may take.
const MAX_BYTES: u64 = 512 << 20;

/// A decoded picture.
#[derive(Clone, Debug)]
pub(in crate::scene::load) struct Decoded {
    pub(in crate::scene::load) width: u32,
    pub(in crate::scene::load) height: u32,
    pub(in crate::scene::load) texels: Texels,
    /// Whether its colours are multiplied by its alpha, as those of EXR files are.
    pub(in crate::scene::load) is_premultiplied: bool,
    /// What was done to its values, a line each without a full stop, for whoever should know.
    pub(in crate::scene::load) notes: Vec<String>,
}

impl Decoded {
    pub(super) fn plain(texel: [u8; 4], encoding: Encoding) -> Self {
        let texels = Texels::Bytes(Arc::new(vec![texel]), encoding);
        Self::of_texels([1, 1], texels)
    }

    /// A picture of `size` whose colours are as they stand.
    pub(in crate::scene::load) fn of_texels([width, height]: [u32; 2], texels: Texels) -> Self {
        Self { width, height, texels, is_premultiplied: false, notes: Vec::new() }
    }

    /// The colours of what its alpha says is there: the alpha will multiply them. Light without coverage, as a glow
    /// has, stays.
    pub(super) fn without_alpha_in_colours(mut self) -> Self {
        if let (true, Texels::Floats(texels)) = (self.is_premultiplied, &mut self.texels) {
            for [rgb @ .., alpha] in Arc::make_mut(texels).iter_mut().filter(|[.., alpha]| *alpha > 0.0 && *alpha < 1.0)
            {
                *rgb = rgb.map(|value| (value / *alpha).min(f32::MAX));
            }
        }
        self.is_premultiplied = false;
        self
    }
}

/// What a picture's values are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::scene::load) enum Values {
    /// Colours of the primaries that the file names, to be brought into Rec.709: light and reflectances,
    /// which are never negative.
    Colours,
    /// Values of the primaries that the file names, to be weighed as Rec.709's: heights among them, which may be
    /// negative.
    Luminances,
    /// Numbers as they stand: normals, roughness, coverage.
    Numbers,
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
    let mut reader = ImageReader::new(BufReader::new(read_file::open(path).ok()?));
    // Where its bytes do not say what it is, as those of TGA, its name does.
    if let Ok(format) = ImageFormat::from_path(path) {
        reader.set_format(format);
    }
    Some(reader.with_guessed_format().ok()?.into_decoder().ok()?.color_type())
}

/// Decodes one picture.
pub(super) fn decode(picture: &Picture, encoding: Encoding, values: Values) -> Result<Decoded, LoadError> {
    match picture {
        Picture::File(path) => decode_bytes(&files::read(path)?, path, encoding, values),
        Picture::Memory { name, bytes } => decode_bytes(bytes, Path::new(name), encoding, values),
        Picture::Texels { size: [width, height], bits, .. } => {
            let texels = bits.iter().map(|texel| texel.map(f32::from_bits)).collect();
            let texels = Texels::Floats(Arc::new(texels));
            Ok(Decoded::of_texels([*width, *height], texels))
        }
    }
}

/// Decodes a picture that is in memory. Its kind is told from its first bytes, else from its name.
pub(in crate::scene::load) fn decode_bytes(
    bytes: &[u8],
    name: &Path,
    encoding: Encoding,
    values: Values,
) -> Result<Decoded, LoadError> {
    if exr_read::is_exr(bytes) {
        return decode_exr(bytes, name, values);
    }
    let bytes = &*with_known_header(bytes);
    let wrong = |error: image::ImageError| match error {
        image::ImageError::Limits(_) => LoadError::too_large(name, format_args!("the picture is too large: {error}")),
        image::ImageError::Unsupported(_) => {
            LoadError::unsupported(name, format_args!("a picture of a kind that is not read: {error}"))
        }
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
    if format == ImageFormat::Jpeg && !jpeg_read::is_complete(bytes, &image) {
        return Err(LoadError::invalid(name, jpeg_read::INCOMPLETE));
    }
    let mut notes = Vec::new();
    let texels = match eight_bit {
        true => Texels::Bytes(Arc::new(image.into_rgba8().into_raw().as_chunks::<4>().0.to_vec()), encoding),
        false => {
            let header = (format == ImageFormat::Hdr).then(|| HdrHeader::of(bytes));
            notes.extend(hdr_read::notes(bytes));
            let mut texels = linear_floats(image, encoding, header, &mut notes);
            if values == Values::Colours {
                notes.extend(negative_light(texels.iter().map(|[rgb @ .., _]| rgb)));
                texels.iter_mut().for_each(|[rgb @ .., _]| *rgb = gamut::light(*rgb));
            }
            Texels::Floats(Arc::new(texels))
        }
    };
    Ok(Decoded { notes, ..Decoded::of_texels([width, height], texels) })
}

/// The reader with the limits that hold for textures.
fn limited<R: std::io::BufRead + std::io::Seek>(mut reader: ImageReader<R>) -> ImageReader<R> {
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    reader
}

/// Linear texels: 16-bit integers under the sRGB curve are unfolded, floats are linear already, but for what the
/// header of a Radiance file says.
fn linear_floats(
    image: DynamicImage,
    encoding: Encoding,
    header: Option<HdrHeader>,
    notes: &mut Vec<String>,
) -> Vec<[f32; 4]> {
    let unfold =
        encoding == Encoding::Srgb && !matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let mut texels = image.into_rgba32f().into_raw().as_chunks::<4>().0.to_vec();
    for [r, g, b, _] in &mut texels {
        [*r, *g, *b] = header.map_or([*r, *g, *b], |header| header.light([*r, *g, *b]));
        if unfold {
            [*r, *g, *b] = [*r, *g, *b].map(srgb_to_linear);
        }
    }
    make_finite(&mut [texels.as_flattened_mut()], notes);
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

fn decode_exr(bytes: &[u8], name: &Path, values: Values) -> Result<Decoded, LoadError> {
    let mut image = exr_read::decode_exr_channels(name, bytes, used_channels).map_err(|error| match error {
        exr_read::ExrReadError::TooLarge { .. } => LoadError::too_large(name, error),
        _ => LoadError::invalid(name, error),
    })?;
    let (width, height) = (image.width, image.height);
    check_size(name, u64::from(width), u64::from(height), 16)?;
    // All of the data is the texture, whatever part of it is to be shown: so pbrt and Mitsuba take it.
    image.display_window = Window { origin: image.data_window_origin, width, height };
    image.is_display_window_left_out = false;
    let mut notes = Vec::new();
    notes.extend(colour_layer(&image.names()).and_then(|layer| layer.guess()));
    let mut channels: Vec<&mut [f32]> = image.channels.iter_mut().map(|(_, values)| values.as_mut_slice()).collect();
    make_finite(&mut channels, &mut notes);
    add_missing_primaries(&mut image, &mut notes);

    let coloured = if values == Values::Numbers { None } else { image.scene_picture(channel) };
    let mut rgb = match coloured {
        Some(picture) => {
            notes.extend(picture.notes);
            picture.rgb
        }
        None => plain_rgb(&image)
            .ok_or_else(|| LoadError::unsupported(name, "the picture has neither a channel R nor a channel Y"))?,
    };
    if values == Values::Colours {
        notes.extend(negative_light(&rgb));
        rgb.iter_mut().for_each(|rgb| *rgb = gamut::light(*rgb));
    }
    let alpha = channel(&image, "A");
    let texel = |(i, [r, g, b]): (usize, [f32; 3])| [r, g, b, alpha.map_or(1.0, |alpha| alpha[i])];
    let texels = Texels::Floats(Arc::new(rgb.into_iter().enumerate().map(texel).collect()));
    Ok(Decoded { is_premultiplied: alpha.is_some(), notes, ..Decoded::of_texels([width, height], texels) })
}

/// The channels of an EXR file that a texture is made of: R, G, B and A of the picture's layer; where no layer has all
/// colours, of any; else luminance, chroma and CIE XYZ.
fn used_channels(all: &[String]) -> Vec<String> {
    let names: Vec<&str> = all.iter().map(String::as_str).collect();
    let layer = colour_layer(&names).map(|layer| layer.name);
    let chosen = |parts: &[&str]| -> Vec<String> {
        let is_chosen = |name: &&String| {
            let (own_layer, own_part) = layer_and_part(name);
            layer.is_none_or(|layer| layer == own_layer) && parts.iter().any(|part| own_part.eq_ignore_ascii_case(part))
        };
        all.iter().filter(is_chosen).cloned().collect()
    };
    match all.iter().any(|name| layer_and_part(name).1.eq_ignore_ascii_case("R")) {
        true => chosen(&["R", "G", "B", "A"]),
        false => chosen(&["Y", "RY", "BY", "X", "Z", "A"]),
    }
}

/// A channel of the picture's layer by its last name; where no layer has all colours, that of the layer
/// without a name before others.
fn channel<'a>(image: &'a ExrImage, wanted: &str) -> Option<&'a [f32]> {
    match colour_layer(&image.names()) {
        Some(layer) => image.part(layer.name, wanted),
        None => image.part("", wanted).or_else(|| {
            let is_wanted = |name: &str| layer_and_part(name).1.eq_ignore_ascii_case(wanted);
            image.channels.iter().find(|(name, _)| is_wanted(name)).map(|(_, values)| values.as_slice())
        }),
    }
}

/// A picture of R and one of G and B has none of the third; R alone is grey.
fn add_missing_primaries(image: &mut ExrImage, notes: &mut Vec<String>) {
    let has = |name| channel(image, name).is_some();
    let missing = match ["R", "G", "B"].map(has) {
        [true, true, false] => "B",
        [true, false, true] => "G",
        _ => return,
    };
    notes.push(format!("no channel {missing}: it is taken as 0"));
    let nothing = vec![0.0; image.width as usize * image.height as usize];
    image.channels.push((missing.to_owned(), nothing));
}

/// R, G and B as they stand; the only channel as grey.
fn plain_rgb(image: &ExrImage) -> Option<Vec<[f32; 3]>> {
    let red = channel(image, "R").or_else(|| channel(image, "Y"))?;
    let (green, blue) = (channel(image, "G").unwrap_or(red), channel(image, "B").unwrap_or(red));
    Some((0..red.len()).map(|i| [red[i], green[i], blue[i]]).collect())
}

fn check_size(name: &Path, width: u64, height: u64, bytes_per_texel: u64) -> Result<(), LoadError> {
    if width == 0 || height == 0 {
        return Err(LoadError::invalid(name, format_args!("the picture is empty ({width} x {height} pixels)")));
    }
    let side = u64::from(LONGEST_SIDE);
    if width > side || height > side || width * height * bytes_per_texel > MAX_BYTES {
        let limit = MAX_BYTES / bytes_per_texel / 1_000_000;
        return Err(LoadError::too_large(
            name,
            format_args!(
                "the picture has {width} x {height} pixels; at most {side} a side and {limit} million are read"
            ),
        ));
    }
    Ok(())
}

/// As [`exr_read::make_finite`], with a note.
fn make_finite(channels: &mut [&mut [f32]], notes: &mut Vec<String>) {
    notes.extend(exr_read::make_finite(channels).map(|replaced| replaced.to_string()));
}
