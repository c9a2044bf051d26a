//! Whether a JPEG file is whole: decoders fill with grey what is cut off, and say nothing. And what it says and is not
//! heeded.

use crate::output::{PROFILE_NOT_READ, names_srgb};
use image::codecs::jpeg::JpegDecoder;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder as _};
use std::io::Cursor;

/// What to say of a file that is not.
pub const CUT_OFF: &str =
    "the picture is cut off: a JPEG file ends in the bytes ff d9, and this one has none after its picture";

/// Whether the marker of the end stands behind the last scan.
pub fn has_end(bytes: &[u8]) -> bool {
    end_of_last_scan(bytes).is_some()
}

/// Where the marker of the end stands behind the last scan. Within a scan's codes it cannot stand (ITU-T T.81,
/// B.1.1.5).
fn end_of_last_scan(bytes: &[u8]) -> Option<usize> {
    const START_OF_SCAN: [u8; 2] = [0xff, 0xda];
    const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
    let scan = bytes.windows(2).rposition(|pair| pair == START_OF_SCAN).unwrap_or(0);
    bytes[scan..].windows(2).position(|pair| pair == END_OF_IMAGE).map(|end| scan + end)
}

/// What to say of a file that has its end and lacks some of what is before it.
pub const INCOMPLETE: &str = "the picture is not whole: its data end before its last pixel";

/// Whether a file's data reach the last pixel of the picture that was decoded from them. Decoders make up what is
/// missing and do not say so; but what they make of a whole file is the same with more data before its end, and
/// of another one it is not.
pub fn is_complete(bytes: &[u8], decoded: &DynamicImage) -> bool {
    /// Codes of many lengths, and no byte that begins a marker.
    const MORE: [u8; 64] = {
        let mut more = [0; 64];
        let mut index = 0;
        while index < more.len() {
            more[index] = (index as u8).wrapping_mul(167) & 0x7f;
            index += 1;
        }
        more
    };
    let Some(end) = end_of_last_scan(bytes) else { return false };
    let longer = [&bytes[..end], &MORE, &bytes[end..]].concat();
    let again = JpegDecoder::new(Cursor::new(longer)).and_then(DynamicImage::from_decoder);
    again.is_ok_and(|again| again == *decoded)
}

/// What a file says of its colours and its orientation and is not heeded; nothing of what is no JPEG file.
pub fn notes(bytes: &[u8]) -> Vec<String> {
    let Ok(mut decoder) = JpegDecoder::new(Cursor::new(bytes)) else { return Vec::new() };
    let mut notes = Vec::new();
    if decoder.icc_profile().ok().flatten().is_some_and(|profile| !names_srgb(&profile)) {
        notes.push(PROFILE_NOT_READ.to_owned());
    }
    match decoder.orientation() {
        Ok(Orientation::NoTransforms) | Err(_) => {}
        Ok(turned) => {
            let number = turned.to_exif();
            notes.push(format!("its EXIF orientation {number} is not heeded: it is seen as its pixels are stored"));
        }
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grey pixel, and segments of that application number.
    fn jpeg_with(marker: u8, payload: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        image::codecs::jpeg::JpegEncoder::new(&mut bytes).encode(&[128], 1, 1, image::ExtendedColorType::L8).unwrap();
        let length = (payload.len() as u16 + 2).to_be_bytes();
        let segment = [&[0xff, marker][..], &length, payload].concat();
        bytes.splice(2..2, segment);
        bytes
    }

    #[test]
    fn what_is_not_heeded_is_said() {
        let profile = |name: &str| jpeg_with(0xe2, &[b"ICC_PROFILE\0\x01\x01", name.as_bytes()].concat());
        assert_eq!(notes(&profile("Adobe RGB (1998)")), [PROFILE_NOT_READ]);
        assert!(notes(&profile("sRGB IEC61966-2.1")).is_empty());
        let turned = |orientation: u8| {
            let entry = [0x12, 0x01, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0];
            jpeg_with(0xe1, &[&b"Exif\0\0II*\0\x08\0\0\0\x01\0"[..], &entry, &[0; 4]].concat())
        };
        assert!(notes(&turned(1)).is_empty());
        assert!(notes(&turned(6))[0].contains("EXIF orientation 6"), "{:?}", notes(&turned(6)));
        assert!(notes(b"words").is_empty());
    }

    /// Regression: a picture of 128×128 pixels whose data were cut, with the end's marker behind them, was taken for
    /// whole: 90 % of it was made up.
    #[test]
    fn data_that_end_early_are_told() {
        let photo = image::RgbImage::from_fn(128, 128, |x, y| {
            let wave = |phase: u32| (128.0 + 100.0 * ((x as f32 / 9.0).sin() * ((y + phase) as f32 / 7.0).cos())) as u8;
            image::Rgb([wave(0), wave(20), wave(40)])
        });
        let grey = image::DynamicImage::ImageRgb8(photo.clone()).to_luma8();
        let encoded = |image: &dyn Fn(&mut image::codecs::jpeg::JpegEncoder<&mut Vec<u8>>)| {
            let mut bytes = Vec::new();
            image(&mut image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 90));
            bytes
        };
        let files = [
            encoded(&|encoder| encoder.encode_image(&photo).unwrap()),
            encoded(&|encoder| encoder.encode_image(&grey).unwrap()),
            progressive(&photo),
        ];
        let decoded = |bytes: &[u8]| {
            let decoder = JpegDecoder::new(Cursor::new(bytes))?;
            DynamicImage::from_decoder(decoder)
        };
        for (index, whole) in files.iter().enumerate() {
            assert!(is_complete(whole, &decoded(whole).unwrap()), "{index}");
            let scan = whole.windows(2).rposition(|pair| pair == [0xff, 0xda]).unwrap() + 14;
            let data = whole.len() - scan;
            for kept in [data / 10, data / 2, data * 9 / 10] {
                let mut cut = whole[..scan + kept].to_vec();
                while cut.last() == Some(&0xff) {
                    cut.pop();
                }
                cut.extend([0xff, 0xd9]);
                assert!(has_end(&cut));
                // Some of them are refused by the decoder itself.
                assert!(!decoded(&cut).is_ok_and(|image| is_complete(&cut, &image)), "{index}: {kept} of {data}");
            }
        }
    }

    fn progressive(image: &image::RgbImage) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, 90);
        encoder.set_progressive(true);
        let (width, height) = (image.width() as u16, image.height() as u16);
        encoder.encode(image, width, height, jpeg_encoder::ColorType::Rgb).unwrap();
        bytes
    }

    #[test]
    fn the_end_of_a_preview_is_not_the_pictures() {
        let preview = [0xff, 0xda, 1, 2, 0xff, 0xd9];
        let cut = [&preview[..], &[0xff, 0xda, 3, 0xff, 0x00, 4]].concat();
        assert!(has_end(&preview) && !has_end(&cut));
        assert!(has_end(&[&cut[..], &[0xff, 0xd9, 0, 0]].concat()));
        assert!(!has_end(&[]) && !has_end(&[0xff]));
    }
}
