//! Bad scene files end in one line that says what is wrong; every file of `tests/bad` holds its own expectation.

use fechner::scene::load::{LoadOptions, load};
use std::path::Path;

fn folder(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

#[test]
fn every_bad_file_says_what_is_wrong_with_it() {
    let mut files = 0;
    for entry in std::fs::read_dir(folder("tests/bad")).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let (_, expected) = text.split_once("# expect: ").expect("a bad file says what is expected");
        let expected = expected.split(['\n', '}']).next().unwrap().trim_end_matches('"');
        let expected = if path.extension().unwrap() == "gltf" { expected } else { expected.trim() };
        let message = load(&path, &LoadOptions::default()).expect_err(&path.display().to_string()).to_string();
        assert!(message.contains(expected) && !message.contains('\n'), "{}\n  {message}\n  {expected}", path.display());
        files += 1;
    }
    assert!(files >= 15, "{files}");
}

#[test]
fn what_is_no_scene_is_named() {
    let message = |name: &str| load(&folder(name), &LoadOptions::default()).unwrap_err().to_string();
    assert!(message("tests/none.toml").ends_with("no such file"));
    assert!(message("tests").contains("is a directory"));
    assert!(message("Cargo.lock").contains(".toml, .obj, .gltf and .glb are read"));
}

#[test]
fn our_own_scenes_load_and_survive_every_cut() {
    for entry in std::fs::read_dir(folder("scenes")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") || path.ends_with("Cargo.toml") {
            continue;
        }
        if let Err(error) = load(&path, &LoadOptions::default()) {
            panic!("{error}");
        }
    }
    let bytes = std::fs::read(folder("scenes/cornell-box.toml")).unwrap();
    let place = tempfile::tempdir().unwrap();
    let cut = place.path().join("cut.toml");
    for length in (0..bytes.len()).step_by(7) {
        std::fs::write(&cut, &bytes[..length]).unwrap();
        if let Err(error) = load(&cut, &LoadOptions::default()) {
            assert!(!error.to_string().contains('\n'), "{error}");
        }
    }
}
