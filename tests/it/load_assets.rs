//! Scenes that others made: all sound ones load, all damaged ones end in one line. Skipped where they are not at hand.

use fechner::scene::load::{LoadOptions, load};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The folder of other people's scenes: FECHNER_ASSETS, where it must be, else beside the project.
pub(crate) fn assets() -> Option<PathBuf> {
    let named = std::env::var_os("FECHNER_ASSETS").map(PathBuf::from);
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets");
    let folder = named.clone().unwrap_or_else(beside);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(named.is_none(), "{} is not there", folder.display());
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

const SCENES: [&str; 5] = ["gltf", "glb", "obj", "pbrt", "xml"];

/// Sound files of points, lines or nothing at all.
const NOTHING_TO_RENDER: [&str; 15] = [
    "Mesh_PrimitiveMode_00.gltf",
    "Mesh_PrimitiveMode_01.gltf",
    "Mesh_PrimitiveMode_02.gltf",
    "Mesh_PrimitiveMode_03.gltf",
    "Mesh_PrimitiveMode_07.gltf",
    "Mesh_PrimitiveMode_08.gltf",
    "Mesh_PrimitiveMode_09.gltf",
    "Mesh_PrimitiveMode_10.gltf",
    "assimp-OBJ/point_cloud.obj",
    "assimp-OBJ/testline.obj",
    "assimp-OBJ/testpoints.obj",
    "tinyobjloader-models/issue-356-leading-spaces-newmtl.obj",
    "tinyobjloader-models/line-prim.obj",
    "tinyobjloader-models/points-prim.obj",
    "trimesh-models/face_in_group_name.obj",
];

/// Whether a sound file is known to end in this error.
fn is_expected(path: &Path, error: &str) -> bool {
    // "3.1+e2" is no number in any reader's book but its author's.
    let is_odd = path.ends_with("number_formats.obj") && error.contains("number_formats.obj:11: expected");
    let is_empty = error.contains("nothing to render") && NOTHING_TO_RENDER.iter().any(|name| path.ends_with(name));
    is_odd || is_empty
}

#[test]
fn every_sound_scene_loads() {
    let Some(folder) = assets() else { return };
    let mut files = Vec::new();
    files_below(&folder, &mut files);
    files.retain(|path| has_extension(path, &SCENES) && !path.starts_with(folder.join("faults")));
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
            Err(error) => {
                let error = error.to_string();
                println!("    {error}");
                if !is_expected(path, &error) {
                    failures.push(error);
                }
            }
        }
    }
    println!("{} files, {} failures", files.len(), failures.len());
    assert!(files.len() >= 190, "{} files", files.len());
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn damaged_scenes_end_in_one_line() {
    let Some(folder) = assets() else { return };
    let mut files = Vec::new();
    files_below(&folder.join("faults"), &mut files);
    // What no reader takes by its name is refused unread.
    files.retain(|path| has_extension(path, &SCENES));
    let mut refused = 0;
    for path in files {
        match load(&path, &LoadOptions::default()) {
            Ok(scene) => println!("loads: {} ({} notes)", path.display(), scene.notes.len()),
            Err(error) => {
                refused += 1;
                let message = error.to_string();
                println!("{message}");
                assert!(!message.contains('\n'), "{message}");
            }
        }
    }
    assert!(refused >= 9, "{refused} refused");
}
