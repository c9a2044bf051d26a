//! Whatever bytes stand in Mitsuba's .serialized file, loading a scene that uses it ends in a scene or in one clear
//! error.
#![no_main]

use fechner::scene::load::{LoadOptions, load};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let folder = tempfile::tempdir().expect("a folder for the files");
    let path = folder.path().join("scene.xml");
    let scene = "<scene version=\"3.0.0\"><shape type=\"serialized\"><string name=\"filename\" value=\"mesh.serialized\"/>\
                 </shape></scene>";
    std::fs::write(&path, scene).expect("the file is written");
    std::fs::write(folder.path().join("mesh.serialized"), data).expect("the file is written");
    if let Err(error) = load(&path, &LoadOptions::default()) {
        assert!(!error.to_string().is_empty());
    }
});
