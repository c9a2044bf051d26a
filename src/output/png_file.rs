//! Pictures for displays: 8-bit sRGB, or 16-bit PQ for HDR displays, tagged as such.

use super::png_read::SQUARE_WITHIN;
use super::srgb_codes::SrgbCodes;
use super::{OutputError, beside::write_beside, check_size};
use fechner_perception::PIXELS_PER_TASK;
use fechner_perception::display::{Display, Eotf};
use fechner_perception::primaries::{IDENTITY, Primaries, apply};
use rayon::prelude::*;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Fast: the default takes a third of the time of a tone-mapped picture of 1920×1080.
const COMPRESSION: png::Compression = png::Compression::Fast;

/// Code points of ITU-T H.273: primaries of BT.2020, transfer of SMPTE ST 2084 (PQ), RGB, full range.
const CICP_BT2020_PQ: [u8; 4] = [9, 16, 0, 1];

/// How samples are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Codes {
    /// 8 bits of sRGB.
    Srgb8,
    /// 16 bits, big-endian, of PQ in the primaries of BT.2020.
    Pq16,
}

/// Writes samples, tagged as what they are.
fn write_samples(
    path: &Path,
    (width, height): (u32, u32),
    pixel_aspect_ratio: f64,
    color: png::ColorType,
    codes: Codes,
    bytes: &[u8],
) -> Result<(), OutputError> {
    write_beside(path, |file| {
        let mut buffered = BufWriter::new(file);
        let mut encoder = png::Encoder::new(&mut buffered, width, height);
        encoder.set_color(color);
        encoder.set_compression(COMPRESSION);
        encoder.set_pixel_dims(pixel_shape(pixel_aspect_ratio));
        match codes {
            Codes::Srgb8 => {
                encoder.set_depth(png::BitDepth::Eight);
                tag_as_srgb(&mut encoder);
            }
            Codes::Pq16 => encoder.set_depth(png::BitDepth::Sixteen),
        }
        let mut writer = encoder.write_header()?;
        if codes == Codes::Pq16 {
            writer.write_chunk(png::chunk::ChunkType(*b"cICP"), &CICP_BT2020_PQ)?;
        }
        writer.write_image_data(bytes)?;
        writer.finish()?;
        buffered.flush()
    })
}

fn tag_as_srgb<W: Write>(encoder: &mut png::Encoder<'_, W>) {
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    // For readers that know only these; the values are those that the format's standard names beside sRGB.
    encoder.set_source_gamma(png::ScaledFloat::from_scaled(45_455));
    let Primaries { red, green, blue, white } = Primaries::REC709;
    let [red, green, blue, white] = [red, green, blue, white].map(|[x, y]| (x as f32, y as f32));
    encoder.set_source_chromaticities(png::SourceChromaticities::new(white, red, green, blue));
}

/// What the display emits, as PQ codes of 16 bits in Rec.2020's primaries: big-endian, RGB after RGB. Values are
/// absolute: 0 is the display's black, 1 its white, both in cd/m². What the screen reflects of the room is not in the
/// codes, since it adds that by itself. NaN becomes black.
fn encode_pq16(rgb_linear_display: &[[f32; 3]], display: &Display) -> Vec<u8> {
    let wide = Primaries::REC709.to(&Primaries::REC2020).unwrap_or(IDENTITY);
    let mut bytes = vec![0; rgb_linear_display.len() * 6];
    bytes.par_chunks_mut(6).zip(rgb_linear_display).with_min_len(PIXELS_PER_TASK).for_each(|(bytes, rgb)| {
        let shown = apply(&wide, rgb.map(|c| if c.is_nan() { 0.0 } else { f64::from(c) }));
        for (bytes, relative) in bytes.chunks_exact_mut(2).zip(shown) {
            let code = Eotf::pq_code(display.emitted_cd_m2(relative));
            bytes.copy_from_slice(&((code * 65_535.0).round() as u16).to_be_bytes());
        }
    });
    bytes
}

/// Writes linear display RGB, where 1 is the display's white, as an 8-bit PNG tagged sRGB.
///
/// Values are clamped to [0, 1] and NaN becomes black. Rounding is dithered by up to one step, the same in all three
/// channels so that greys stay grey, by a hash of the pixel's place so that equal pixels give equal files.
///
/// # Errors
/// If the file cannot be written.
pub fn write_png(path: &Path, width: u32, height: u32, rgb_linear_display: &[[f32; 3]]) -> Result<(), OutputError> {
    check_size(path, width, height, &[("the picture", rgb_linear_display.len())])?;
    let bytes = encode_srgb8(width, rgb_linear_display);
    write_samples(path, (width, height), 1.0, png::ColorType::Rgb, Codes::Srgb8, &bytes)
}

/// Writes 8-bit sRGB codes, RGB after RGB, as they are.
///
/// # Errors
/// If the file cannot be written.
pub fn write_codes_png(path: &Path, width: u32, height: u32, rgb8: &[u8]) -> Result<(), OutputError> {
    check_size(path, width, height, &[("the picture", rgb8.len() / 3)])?;
    write_samples(path, (width, height), 1.0, png::ColorType::Rgb, Codes::Srgb8, rgb8)
}

/// A picture for a display.
#[derive(Clone, Copy, Debug)]
pub struct DisplayedPicture<'a> {
    /// Columns and rows.
    pub size: (u32, u32),
    /// Linear display RGB, row by row: 0 is the display's black and 1 its white.
    pub rgb_linear_display: &'a [[f32; 3]],
    /// How much of each pixel is covered, 0 to 1, by which the colours are not multiplied.
    pub alpha: Option<&'a [f32]>,
    /// Width of a pixel over its height.
    pub pixel_aspect_ratio: f64,
}

impl<'a> DisplayedPicture<'a> {
    /// One of square pixels that are all covered.
    pub fn opaque(size: (u32, u32), rgb_linear_display: &'a [[f32; 3]]) -> Self {
        Self { size, rgb_linear_display, alpha: None, pixel_aspect_ratio: 1.0 }
    }
}

/// Writes a picture as the display wants it: as 16-bit PQ codes of Rec.2020, with the cICP chunk (PNG, third edition)
/// that says so, for one of SMPTE ST 2084; as [`write_png`] does for all others, which colour management brings to
/// them. Pixels that are not square are said in the chunk pHYs.
///
/// # Errors
/// If the file cannot be written.
pub fn write_png_for(path: &Path, picture: &DisplayedPicture<'_>, display: &Display) -> Result<(), OutputError> {
    let DisplayedPicture { size: (width, height), rgb_linear_display, alpha, pixel_aspect_ratio } = *picture;
    let counts = [Some(("the picture", rgb_linear_display.len())), alpha.map(|alpha| ("alpha", alpha.len()))];
    check_size(path, width, height, &counts.into_iter().flatten().collect::<Vec<_>>())?;
    let color = if alpha.is_some() { png::ColorType::Rgba } else { png::ColorType::Rgb };
    if display.eotf == Eotf::Pq {
        let code = |alpha: f32, bytes: &mut Vec<u8>| bytes.extend(((alpha * 65_535.0 + 0.5) as u16).to_be_bytes());
        let bytes = with_alpha(encode_pq16(rgb_linear_display, display), 6, alpha, code);
        return write_samples(path, (width, height), pixel_aspect_ratio, color, Codes::Pq16, &bytes);
    }
    let code = |alpha: f32, bytes: &mut Vec<u8>| bytes.push((alpha * 255.0 + 0.5) as u8);
    let bytes = with_alpha(encode_srgb8(width, rgb_linear_display), 3, alpha, code);
    write_samples(path, (width, height), pixel_aspect_ratio, color, Codes::Srgb8, &bytes)
}

/// Samples of `bytes_a_pixel` with those of an alpha behind each.
fn with_alpha(
    colors: Vec<u8>,
    bytes_a_pixel: usize,
    alpha: Option<&[f32]>,
    code: impl Fn(f32, &mut Vec<u8>),
) -> Vec<u8> {
    let Some(alpha) = alpha else { return colors };
    let mut bytes = Vec::with_capacity(colors.len() / 3 * 4);
    for (rgb, &alpha) in colors.chunks_exact(bytes_a_pixel).zip(alpha) {
        bytes.extend_from_slice(rgb);
        code(alpha.clamp(0.0, 1.0), &mut bytes);
    }
    bytes
}

/// A pHYs chunk that says the shape of pixels and not their size; none for square ones.
fn pixel_shape(pixel_aspect_ratio: f64) -> Option<png::PixelDimensions> {
    /// Columns in a unit, so that the rows have five digits.
    const COLUMNS: f64 = 1e5;
    let yppu = (COLUMNS * pixel_aspect_ratio).round() as u32;
    let is_square = (pixel_aspect_ratio - 1.0).abs() < SQUARE_WITHIN;
    (!is_square && yppu > 0).then_some(png::PixelDimensions {
        xppu: COLUMNS as u32,
        yppu,
        unit: png::Unit::Unspecified,
    })
}

/// The bytes of [`write_png`]: sRGB-encoded, dithered, RGB after RGB, row after row.
pub fn encode_srgb8(width: u32, rgb_linear_display: &[[f32; 3]]) -> Vec<u8> {
    let width = width.max(1) as usize;
    let codes = SrgbCodes::new();
    let mut bytes = vec![0; rgb_linear_display.len() * 3];
    bytes.par_chunks_mut(3 * width).zip(rgb_linear_display.par_chunks(width)).enumerate().for_each(
        |(y, (bytes, row))| {
            for (x, (bytes, rgb)) in bytes.as_chunks_mut::<3>().0.iter_mut().zip(row).enumerate() {
                let offset = dither(x as u32, y as u32);
                *bytes = rgb.map(|value| codes.code(value, offset));
            }
        },
    );
    bytes
}

/// A number in [0, 1) that looks random from pixel to pixel and is always the same at the same pixel.
fn dither(x: u32, y: u32) -> f32 {
    let mut h = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77).rotate_left(13);
    h = (h ^ (h >> 16)).wrapping_mul(0x21f0_aaad);
    h = (h ^ (h >> 15)).wrapping_mul(0x735a_2d97);
    h ^= h >> 15;
    (h >> 8) as f32 / (1u32 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::super::png_read::{PngTransfer, decode_pq, png_colour, png_pixel_aspect_ratio};
    use super::*;
    use fechner_perception::eotf::srgb_to_linear;

    fn chunk_names(bytes: &[u8]) -> Vec<String> {
        let mut names = Vec::new();
        let mut at = 8;
        while at + 8 <= bytes.len() {
            let length = u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
            names.push(String::from_utf8_lossy(&bytes[at + 4..at + 8]).into_owned());
            at += length + 12;
        }
        names
    }

    #[test]
    fn the_file_is_tagged_srgb_and_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let pixels = [[0.0, 0.5, 1.0], [1.0, 0.0, 0.214_041_14]];
        write_png(&path, 2, 1, &pixels).unwrap();
        assert_eq!(png_colour(&std::fs::read(&path).unwrap()).transfer, PngTransfer::Srgb);
        let names = chunk_names(&std::fs::read(&path).unwrap());
        for name in ["sRGB", "gAMA", "cHRM"] {
            assert!(names.iter().any(|n| n == name), "{name} is missing from {names:?}");
        }
        let image = image::open(&path).unwrap().into_rgb8();
        assert_eq!(image.dimensions(), (2, 1));
        let [r, g, b] = image.get_pixel(0, 0).0;
        assert_eq!((r, b), (0, 255));
        assert!((187..=188).contains(&g), "linear 0.5 is 187.5 in sRGB, read {g}");
        assert!((127..=128).contains(&image.get_pixel(1, 0).0[2]));
    }

    /// In the display's gamut, down to its black; and the room, whose light the screen adds by itself, changes no code.
    #[test]
    fn pq_codes_come_back_as_light() {
        let dark_room = Display::preset("hdr-1000").unwrap();
        let display = Display { ambient_cd_m2: 2.0, ..dark_room.clone() };
        let light = [[0.0; 3], [1.0; 3], [0.5, 0.02, 0.1], [1.0, 0.0, 0.0], [0.001, 0.3, 0.9]];
        let codes: Vec<[f32; 3]> = encode_pq16(&light, &display)
            .chunks_exact(6)
            .map(|bytes| [0, 2, 4].map(|at| f32::from(u16::from_be_bytes([bytes[at], bytes[at + 1]])) / 65_535.0))
            .collect();
        assert_eq!(encode_pq16(&light, &dark_room), encode_pq16(&light, &display));
        for (found, light) in
            decode_pq(&codes, &Primaries::REC2020, &display).iter().flatten().zip(light.iter().flatten())
        {
            assert!((found - light).abs() < 1e-3, "{light} came back as {found}");
        }
    }

    #[test]
    fn an_hdr_picture_says_what_its_codes_mean() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let display = Display::preset("hdr-1000").unwrap();
        let light = [[1.0; 3], [0.0, f32::NAN, 0.0], [0.1, 0.0, 0.0]];
        write_png_for(&path, &DisplayedPicture::opaque((3, 1), &light), &display).unwrap();
        let colour = png_colour(&std::fs::read(&path).unwrap());
        assert_eq!((colour.transfer, colour.primaries), (PngTransfer::Pq, Some(Primaries::REC2020)));
        let names = chunk_names(&std::fs::read(&path).unwrap());
        let place = |name: &str| names.iter().position(|n| n == name);
        assert!(place("cICP") > place("IHDR") && place("cICP") < place("IDAT"), "{names:?}");
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let tag = reader.info().coding_independent_code_points.unwrap();
        assert_eq!((tag.color_primaries, tag.transfer_function, tag.is_video_full_range_image), (9, 16, true));
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        let code = |index: usize| f64::from(u16::from_be_bytes([bytes[2 * index], bytes[2 * index + 1]])) / 65_535.0;
        // ST 2084: 1000 cd/m² is code 0.7518; the black of the display is 0.005 cd/m².
        assert!((code(0) - 0.751_827).abs() < 1e-4, "{}", code(0));
        assert!((Eotf::Pq.decode(code(3), 1.0) - 0.005).abs() < 1e-4, "{}", code(3));
        // Red of Rec.709 is orange in Rec.2020's primaries.
        assert!(code(6) > code(7) && code(7) > code(8) && code(8) > code(5));
    }

    /// Somebody's transparent HDR picture has the same light where it covers, and says so.
    #[test]
    fn an_hdr_picture_keeps_its_codes_beside_an_alpha() {
        let folder = tempfile::tempdir().unwrap();
        let display = Display::preset("hdr-1000").unwrap();
        let light = [[1.0, 0.5, 0.02], [0.0; 3]];
        let read = |name: &str| {
            let file = std::io::BufReader::new(std::fs::File::open(folder.path().join(name)).unwrap());
            let mut reader = png::Decoder::new(file).read_info().unwrap();
            let tag = reader.info().coding_independent_code_points.map(|tag| tag.transfer_function);
            let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut bytes).unwrap();
            (tag, bytes)
        };
        let opaque = DisplayedPicture::opaque((2, 1), &light);
        let covering = DisplayedPicture { alpha: Some(&[1.0, 0.0]), ..opaque };
        write_png_for(&folder.path().join("a.png"), &opaque, &display).unwrap();
        write_png_for(&folder.path().join("b.png"), &covering, &display).unwrap();
        let ((_, opaque), (tag, bytes)) = (read("a.png"), read("b.png"));
        assert_eq!((tag, bytes.len()), (Some(16), 16));
        assert_eq!((&bytes[..6], &bytes[6..8]), (&opaque[..6], &[255, 255][..]));
        assert_eq!((&bytes[8..14], &bytes[14..]), (&opaque[6..], &[0, 0][..]));
    }

    /// Pixels twice as wide as high stay so, in sRGB and in PQ, with alpha and without; whole pixels a metre that
    /// differ by rounding are square.
    #[test]
    fn the_shape_of_pixels_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let read = |display: &str, alpha: Option<&[f32]>, pixel_aspect_ratio: f64| {
            let shown = DisplayedPicture { alpha, pixel_aspect_ratio, ..DisplayedPicture::opaque((1, 1), &[[0.5; 3]]) };
            write_png_for(&path, &shown, &Display::preset(display).unwrap()).unwrap();
            png_pixel_aspect_ratio(&std::fs::read(&path).unwrap())
        };
        for display in ["desktop", "hdr-1000"] {
            for alpha in [None, Some(&[0.5][..])] {
                for ratio in [1.0, 2.0, 0.5, 1.422_22] {
                    assert!((read(display, alpha, ratio) - ratio).abs() < 1e-5, "{display}, {alpha:?}, {ratio}");
                }
            }
        }
        read("desktop", None, 1.0);
        assert!(!chunk_names(&std::fs::read(&path).unwrap()).iter().any(|name| name == "pHYs"));
        let of_metres = |xppu: u32, yppu: u32| {
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
            encoder.set_pixel_dims(Some(png::PixelDimensions { xppu, yppu, unit: png::Unit::Meter }));
            let mut writer = encoder.write_header().unwrap();
            writer.write_image_data(&[7]).unwrap();
            writer.finish().unwrap();
            png_pixel_aspect_ratio(&bytes)
        };
        for ((x, y), meant) in
            [((2835, 2835), 1.0), ((2835, 2834), 1.0), ((2000, 4000), 2.0), ((0, 4000), 1.0), ((1, 5000), 1.0)]
        {
            assert_eq!(of_metres(x, y), meant, "{x} and {y} a metre");
        }
    }

    #[test]
    fn extremes_are_clamped_and_one_pixel_is_enough() {
        assert_eq!(encode_srgb8(1, &[[f32::NAN, -1.0, f32::NEG_INFINITY]]), [0, 0, 0]);
        assert_eq!(encode_srgb8(1, &[[f32::INFINITY, 7.0, 1.0]]), [255, 255, 255]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_png(&path, 1, 1, &[[1.0; 3]]).unwrap();
        assert_eq!(image::open(&path).unwrap().into_rgb8().into_raw(), [255, 255, 255]);
    }

    #[test]
    fn dither_keeps_the_mean_and_greys_grey() {
        let (width, height) = (128, 128);
        for step in [10.25_f32, 100.5, 200.8] {
            let code = step / 255.0;
            let bytes = encode_srgb8(width, &vec![[srgb_to_linear(code); 3]; (width * height) as usize]);
            assert!(bytes.chunks(3).all(|p| p[0] == p[1] && p[1] == p[2]));
            let mean = bytes.iter().map(|&b| f64::from(b)).sum::<f64>() / bytes.len() as f64;
            // 16384 draws of a step with a spread of at most 0.5: 4 sigma is 0.016.
            assert!((mean - f64::from(step)).abs() < 0.016, "step {step} came out as {mean}");
        }
    }

    #[test]
    fn equal_pixels_give_equal_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let pixels: Vec<[f32; 3]> = (0..35).map(|i| [i as f32 / 35.0, 0.3, 0.01 * i as f32]).collect();
        let write = |name: &str| {
            let path = folder.path().join(name);
            write_png(&path, 7, 5, &pixels).unwrap();
            std::fs::read(path).unwrap()
        };
        assert_eq!(write("a.png"), write("b.png"));
    }

    #[test]
    fn a_picture_of_the_wrong_size_is_refused_and_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        assert!(write_png(&path, 2, 2, &[[0.0; 3]]).unwrap_err().to_string().contains("2×2 = 4 pixels"));
        assert!(write_png(&path, 0, 2, &[]).unwrap_err().to_string().contains("no pixels"));
        assert!(!path.exists());
    }
}
