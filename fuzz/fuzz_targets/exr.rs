//! Whatever bytes stand in an .exr file, reading it ends in a picture or in one clear error.
#![no_main]

use fechner::exr_read::decode_exr;
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|data: &[u8]| {
    if let Ok(picture) = decode_exr(Path::new("fuzzed.exr"), data) {
        let pixels = picture.width as usize * picture.height as usize;
        assert!(picture.channels.iter().all(|(_, values)| values.len() == pixels));
    }
});
