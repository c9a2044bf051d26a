//! Whether a JPEG file is whole: decoders fill with grey what is cut off, and say nothing.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_preview_is_not_the_pictures() {
        let preview = [0xff, 0xda, 1, 2, 0xff, 0xd9];
        let cut = [&preview[..], &[0xff, 0xda, 3, 0xff, 0x00, 4]].concat();
        assert!(has_end(&preview) && !has_end(&cut));
        assert!(has_end(&[&cut[..], &[0xff, 0xd9, 0, 0]].concat()));
        assert!(!has_end(&[]) && !has_end(&[0xff]));
    }
}
