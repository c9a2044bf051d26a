//! Whatever bytes stand in an .mtl file, loading a mesh that uses it ends in a scene or in one clear error.
#![no_main]

use fechner::scene::load::{LoadOptions, load};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let folder = tempfile::tempdir().expect("a folder for the files");
    let path = folder.path().join("scene.obj");
    let mesh = "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";
    std::fs::write(&path, mesh).expect("the file is written");
    std::fs::write(folder.path().join("scene.mtl"), data).expect("the file is written");
    if let Err(error) = load(&path, &LoadOptions::default()) {
        assert!(!error.to_string().is_empty());
    }
});
