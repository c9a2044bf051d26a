//! Whatever stands in a film's file, reading it ends in a film that can be judged or in one clear error.
#![no_main]

use fechner::checkpoint::{decode_checkpoint, seal};
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|data: &[u8]| {
    let path = Path::new("fuzzed.film");
    let _ = decode_checkpoint(path, data);
    // Behind the checksum, which no fuzzer guesses.
    if let Ok(checkpoint) = decode_checkpoint(path, &seal(data)) {
        let film = &checkpoint.state.film;
        assert!(film.check().is_ok());
        let pixels = film.width() as usize * film.height() as usize;
        assert_eq!(film.estimate(checkpoint.header.settings.nits_per_unit).rgb_cd_m2.len(), pixels);
        assert!(checkpoint.state.untraced_blocks().all(|block| (block.pixel as usize) < pixels));
    }
});
