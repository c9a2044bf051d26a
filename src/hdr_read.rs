//! What the header of a Radiance picture (.hdr) does to its values.
//!
//! Tools of Radiance leave the pixels of a picture that they brighten as bright as they made them, and say so in its
//! header: the light that was there is the value divided by all factors (Radiance's file formats, `EXPOSURE=` and
//! `COLORCORR=`). `PRIMARIES=` says of which colours that light is.

use fechner_perception::primaries::{Matrix, Primaries, apply};
use image::codecs::hdr::{HdrDecoder, HdrMetadata};
use std::borrow::Cow;

/// The factors of a header, those of its lines multiplied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HdrHeader {
    /// What red, green and blue are to be multiplied by.
    to_light: [f32; 3],
    /// To Rec.709, where the primaries are others. Their white becomes its white: that of Radiance's own is of equal
    /// energy, and means no colour.
    to_rec709: Option<Matrix>,
    /// Width of a pixel over its height; 1 where the file's is none that a pixel can have (0.01 to 100).
    pub pixel_aspect_ratio: f64,
}

impl HdrHeader {
    /// The header of a file's bytes; one that changes nothing where they are no Radiance picture.
    pub fn of(bytes: &[u8]) -> Self {
        HdrDecoder::new(bytes)
            .map_or(Self { to_light: [1.0; 3], to_rec709: None, pixel_aspect_ratio: 1.0 }, |decoder| {
                Self::from_metadata(&decoder.metadata())
            })
    }

    fn from_metadata(metadata: &HdrMetadata) -> Self {
        let exposure = metadata.exposure.unwrap_or(1.0);
        let (red, green, blue) = metadata.color_correction.unwrap_or((1.0, 1.0, 1.0));
        let divisor = |factor: f32| if is_divisor(factor) { factor } else { 1.0 };
        // PIXASPECT is height over width.
        let height_over_width = metadata.pixel_aspect_ratio.unwrap_or(1.0);
        Self {
            to_light: [red, green, blue].map(|correction| (divisor(exposure) * divisor(correction)).recip()),
            to_rec709: primaries(metadata)
                .filter(|own| !own.is_like(&Primaries::REC709))
                .and_then(|own| own.to_adapted(&Primaries::REC709)),
            pixel_aspect_ratio: if PIXASPECTS.contains(&height_over_width) {
                f64::from(height_over_width).recip()
            } else {
                1.0
            },
        }
    }

    /// The light that a pixel's value stands for.
    pub fn light(&self, [red, green, blue]: [f32; 3]) -> [f32; 3] {
        let light = [red * self.to_light[0], green * self.to_light[1], blue * self.to_light[2]];
        self.to_rec709.map_or(light, |matrix| apply(&matrix, light.map(f64::from)).map(|value| value as f32))
    }
}

/// Heights over widths that a pixel can have.
const PIXASPECTS: std::ops::RangeInclusive<f32> = 0.01..=100.0;

/// Whether values can have been multiplied by a factor.
fn is_divisor(factor: f32) -> bool {
    factor.is_finite() && factor > 0.0
}

/// The lines of a header that say what cannot be and are not looked at; none of what is no Radiance picture. `bytes`
/// are those of [`with_known_header`].
pub fn notes(bytes: &[u8]) -> Vec<String> {
    let Ok(decoder) = HdrDecoder::new(bytes) else { return Vec::new() };
    let metadata = decoder.metadata();
    let exposure = metadata.exposure.is_some_and(|factor| !is_divisor(factor));
    let correction =
        metadata.color_correction.is_some_and(|(red, green, blue)| [red, green, blue].map(is_divisor).contains(&false));
    let aspect = metadata.pixel_aspect_ratio.is_some_and(|aspect| !PIXASPECTS.contains(&aspect));
    let said = metadata.custom_attributes.iter().any(|(key, _)| key.trim() == PRIMARIES);
    let colours = said && primaries(&metadata).is_none_or(|own| own.to_adapted(&Primaries::REC709).is_none());
    let not_read = [("EXPOSURE", exposure), ("COLORCORR", correction), ("PIXASPECT", aspect), (PRIMARIES, colours)];
    let of = |name: &str| format!("its {name} says what cannot be, and is not looked at");
    not_read.iter().filter(|(_, is_wrong)| *is_wrong).map(|(name, _)| of(name)).collect()
}

/// The variable that names the colours of a picture.
const PRIMARIES: &str = "PRIMARIES";

/// The last line of primaries, where it holds eight coordinates.
fn primaries(metadata: &HdrMetadata) -> Option<Primaries> {
    let (_, text) = metadata.custom_attributes.iter().rfind(|(key, _)| key.trim() == PRIMARIES)?;
    let numbers: Vec<f64> = text.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let &[rx, ry, gx, gy, bx, by, wx, wy] = &numbers[..] else { return None };
    Some(Primaries { red: [rx, ry], green: [gx, gy], blue: [bx, by], white: [wx, wy] })
}

/// Primaries whose red, green and blue are CIE's X, Y and Z.
const XYZ: &[u8] = b"PRIMARIES=1 0 0 1 0 0 0.3333333333 0.3333333333\n";

/// Whether a line says that pixels are CIE XYZ.
fn is_format_of_xyz(line: &[u8]) -> bool {
    line.strip_prefix(b"FORMAT=").is_some_and(|format| format.trim_ascii() == b"32-bit_rle_xyze")
}

/// Whether a picture's pixels are CIE XYZ by its header.
pub fn is_xyze(bytes: &[u8]) -> bool {
    header_bytes(bytes).is_some_and(|end| bytes[..end].split(|&byte| byte == b'\n').any(is_format_of_xyz))
}

/// The file as decoders know it: with the signature that they look for, where some programs write `#?RGBE`, with CIE
/// XYZ as colours of such primaries, and without the header's indented lines. Those are the headers of the pictures
/// that it was made from, as `pcomb` and `pcompos` keep them; what they say was done to other pixels. Radiance takes
/// variables at a line's start alone, the decoder's trims what stands before them.
pub fn with_known_header(bytes: &[u8]) -> Cow<'_, [u8]> {
    let Some(header_bytes) = header_bytes(bytes) else { return Cow::Borrowed(bytes) };
    let (header, pixels) = bytes.split_at(header_bytes);
    let is_own = |line: &&[u8]| !matches!(line, [b' ' | b'\t', ..]);
    let is_rgbe = header.strip_prefix(b"#?RGBE").is_some_and(|rest| rest.first().is_some_and(u8::is_ascii_whitespace));
    let lines = || header.split_inclusive(|&byte| byte == b'\n');
    let is_xyz = lines().any(is_format_of_xyz);
    if !is_rgbe && !is_xyz && lines().all(|line| is_own(&line)) {
        return Cow::Borrowed(bytes);
    }
    let mut known = Vec::with_capacity(bytes.len() + 4);
    for line in lines().filter(is_own) {
        match line.strip_prefix(b"#?RGBE") {
            Some(rest) if is_rgbe && known.is_empty() => known.extend([b"#?RADIANCE", rest].concat()),
            _ if is_format_of_xyz(line) => known.extend([b"FORMAT=32-bit_rle_rgbe\n", XYZ].concat()),
            _ if is_xyz && line.starts_with(b"PRIMARIES=") => {}
            _ => known.extend_from_slice(line),
        }
    }
    known.extend_from_slice(pixels);
    Cow::Owned(known)
}

/// Length of a Radiance picture's header with the empty line that ends it.
fn header_bytes(bytes: &[u8]) -> Option<usize> {
    let end = || bytes.windows(2).position(|pair| pair == b"\n\n");
    bytes.starts_with(b"#?").then(end).flatten().map(|end| end + 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture that `pcomb` made of one that had been brightened: its own pixels are as bright as they are, whatever
    /// lines of what it was made from say.
    #[test]
    fn lines_of_what_it_was_made_from_say_nothing_of_it() {
        let picture = |header: &str| [header.as_bytes(), b"\n\n-Y 1 +X 1\n\x80\x80\n\n"].concat();
        let light = |header: &str| HdrHeader::of(&with_known_header(&picture(header))).light([1.0; 3]);
        let own = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=4";
        let made = "#?RADIANCE\na.hdr:\n\t#?RADIANCE\n\tFORMAT=32-bit_rle_xyze\n\tEXPOSURE=2.0\n  COLORCORR=2 2 2\n\
                    pcomb a.hdr\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=4";
        assert_eq!((light(own), light(made)), ([0.25; 3], [0.25; 3]));
        assert_eq!(with_known_header(&picture(own)), Cow::Borrowed(&picture(own)[..]));
        let of_other_name = own.replace("RADIANCE", "RGBE");
        assert_eq!(*with_known_header(&picture(&of_other_name)), picture(own));
        assert_eq!(*with_known_header(b"#?RGBE"), *b"#?RGBE");
        assert_eq!(*with_known_header(b"words\n\n\tmore"), *b"words\n\n\tmore");
    }

    #[test]
    fn factors_of_all_lines_are_divided_by() {
        let picture = |lines: &str| {
            let mut bytes = format!("#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n").into_bytes();
            bytes.extend([128, 128, 128, 128]);
            HdrHeader::of(&bytes)
        };
        assert_eq!(picture("EXPOSURE=8\n").light([0.5; 3]), [0.0625; 3]);
        let twice = picture("EXPOSURE=2\nEXPOSURE= 4\nCOLORCORR=1 0.5 2\nPIXASPECT=0.5\n");
        assert_eq!(twice.light([1.0; 3]), [0.125, 0.25, 0.0625]);
        assert_eq!(twice.pixel_aspect_ratio, 2.0);
        let wide = picture("PRIMARIES=0.708 0.292 0.17 0.797 0.131 0.046 0.3127 0.329\n");
        let [red, green, blue] = wide.light([1.0, 0.0, 0.0]);
        assert!((red - 1.6605).abs() < 1e-3 && (green + 0.1246).abs() < 1e-3 && (blue + 0.0182).abs() < 1e-3);
        let own = picture("PRIMARIES= 0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n").light([0.5; 3]);
        assert!(own.iter().all(|value| (value - 0.5).abs() < 1e-6), "{own:?}");
        for useless in
            ["", "EXPOSURE=0\n", "EXPOSURE=-3\nPIXASPECT=0\n", "PRIMARIES=1 2 3\n", "PRIMARIES=0 0 0 0 0 0 0 0\n"]
        {
            assert_eq!(picture(useless).light([1.0; 3]), [1.0; 3], "{useless}");
            assert_eq!(picture(useless).pixel_aspect_ratio, 1.0, "{useless}");
        }
        assert_eq!(HdrHeader::of(b"words").light([3.0; 3]), [3.0; 3]);
    }

    #[test]
    fn lines_that_say_what_cannot_be_are_told() {
        let said = |lines: &str| {
            notes(format!("#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x01\x01\x01\x01").as_bytes())
                .join("; ")
        };
        for (name, values) in [
            ("EXPOSURE", &["nan", "inf", "0", "-4"][..]),
            ("COLORCORR", &["nan 1 1", "1 0 1"]),
            ("PIXASPECT", &["0", "-1", "nan"]),
            ("PRIMARIES", &["0 0 0 0 0 0 0 0", "1 2 3", "nan 0 0 1 0 0 0.3 0.3"]),
        ] {
            for value in values {
                let expected = format!("its {name} says what cannot be, and is not looked at");
                assert_eq!(said(&format!("{name}={value}\n")), expected, "{value}");
            }
        }
        let sound =
            "EXPOSURE=4\nCOLORCORR=1 2 1\nPIXASPECT=2\nPRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n";
        assert_eq!((said(sound), notes(b"words")), (String::new(), Vec::new()));
    }
}
