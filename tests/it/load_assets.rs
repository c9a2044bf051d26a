//! Scenes that others made: all sound ones load, all damaged ones end in one line. Skipped where they are not at hand.

use fechner::scene::load::{LoadOptions, load};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The folder of other people's scenes: FECHNER_ASSETS, else beside the project.
pub(crate) fn assets() -> Option<PathBuf> {
    let folder = std::env::var_os("FECHNER_ASSETS")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: {} is not there", folder.display());
    None
}

fn files_below(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() { files_below(&path, found) } else { found.push(path) }
    }
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|extension| extensions.iter().any(|known| extension.eq_ignore_ascii_case(known)))
}

#[test]
fn every_sound_scene_loads() {
    let Some(folder) = assets() else { return };
    let mut files = Vec::new();
    files_below(&folder, &mut files);
    files.retain(|path| {
        has_extension(path, &["gltf", "glb", "obj", "pbrt", "xml"]) && !path.starts_with(folder.join("faults"))
    });
    let mut failures = Vec::new();
    for path in &files {
        let start = Instant::now();
        match load(path, &LoadOptions::default()) {
            Ok(scene) => {
                let triangles: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
                if start.elapsed() > Duration::from_millis(200) || !path.starts_with(folder.join("scenes-mitsuba")) {
                    println!("{} ms, {triangles} triangles: {}", start.elapsed().as_millis(), path.display());
                    scene.notes.iter().for_each(|note| println!("    {note}"));
                }
            }
            Err(error) => failures.push(error.to_string()),
        }
    }
    println!("{} files, {} failures", files.len(), failures.len());
    failures.iter().for_each(|failure| println!("    {failure}"));
    // Points and lines alone are sound files without anything to render.
    failures.retain(|failure| !failure.contains("nothing to render"));
    // "3.1+e2" is no number in any reader's book but its author's.
    failures.retain(|failure| !failure.contains("number_formats.obj:11: expected"));
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn damaged_scenes_end_in_one_line() {
    let Some(folder) = assets() else { return };
    let mut files = Vec::new();
    files_below(&folder.join("faults"), &mut files);
    for path in files {
        match load(&path, &LoadOptions::default()) {
            Ok(scene) => println!("loads: {} ({} notes)", path.display(), scene.notes.len()),
            Err(error) => {
                let message = error.to_string();
                println!("{message}");
                assert!(!message.contains('\n'), "{message}");
            }
        }
    }
}
