//! Whatever bytes stand in an .ies file, loading a scene that has such a lamp ends in a scene or in one clear error.
#![no_main]

use fechner::scene::load::{LoadOptions, load};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let folder = tempfile::tempdir().expect("a folder for the files");
    let path = folder.path().join("scene.toml");
    let scene = "[materials.m]\ntype = \"mirror\"\n[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"m\"\n\
                 [[lights]]\ntype = \"photometric\"\nfile = \"lamp.ies\"\nposition = [0, 3, 0]\n";
    std::fs::write(&path, scene).expect("the file is written");
    std::fs::write(folder.path().join("lamp.ies"), data).expect("the file is written");
    if let Err(error) = load(&path, &LoadOptions::default()) {
        assert!(!error.to_string().is_empty());
    }
});
