//! Whatever bytes stand in a .pbrt file, loading it ends in a scene or in one clear error.
#![no_main]

use fechner::scene::load::{LoadOptions, load};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let folder = tempfile::tempdir().expect("a folder for the file");
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, data).expect("the file is written");
    if let Err(error) = load(&path, &LoadOptions::default()) {
        assert!(!error.to_string().is_empty());
    }
});
