//! Whatever bytes stand in a picture (told by its first byte: PNG, JPEG, Radiance, TGA or EXR), reading it as
//! surroundings ends in texels or in one clear error.
#![no_main]

use fechner::scene::load::environment;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((kind, bytes)) = data.split_first() else { return };
    let extension = ["png", "jpg", "hdr", "tga", "exr"][usize::from(*kind) % 5];
    let folder = tempfile::tempdir().expect("a folder for the file");
    let path = folder.path().join("picture").with_extension(extension);
    std::fs::write(&path, bytes).expect("the file is written");
    if let Err(error) = environment::from_file(&path, 1.0, 0.0, &mut Vec::new()) {
        assert!(!error.to_string().is_empty());
    }
});
