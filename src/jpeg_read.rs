//! Whether a JPEG file is whole: decoders fill with grey what is cut off, and say nothing. And what it says and is not heeded.

use crate::output::{PROFILE_NOT_READ, names_srgb};
use image::ImageDecoder as _;
use image::codecs::jpeg::JpegDecoder;
use image::metadata::Orientation;
use std::io::Cursor;

/// What to say of a file that is not.
pub const CUT_OFF: &str =
    "the picture is cut off: a JPEG file ends in the bytes ff d9, and this one has none after its picture";

/// Whether the marker of the end stands behind the last scan. Within a scan's codes it cannot stand (ITU-T T.81, B.1.1.5).
pub fn has_end(bytes: &[u8]) -> bool {
    const START_OF_SCAN: [u8; 2] = [0xff, 0xda];
    const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
    let scan = bytes.windows(2).rposition(|pair| pair == START_OF_SCAN).unwrap_or(0);
    bytes[scan..].windows(2).any(|pair| pair == END_OF_IMAGE)
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

    #[test]
    fn the_end_of_a_preview_is_not_the_pictures() {
        let preview = [0xff, 0xda, 1, 2, 0xff, 0xd9];
        let cut = [&preview[..], &[0xff, 0xda, 3, 0xff, 0x00, 4]].concat();
        assert!(has_end(&preview) && !has_end(&cut));
        assert!(has_end(&[&cut[..], &[0xff, 0xd9, 0, 0]].concat()));
        assert!(!has_end(&[]) && !has_end(&[0xff]));
    }
}
