//! What scenes are called in results, where figures are found again by name.

use anyhow::{Result, bail};
use std::path::{Path, PathBuf};

/// A name for each scene: its file's, without the ending, and where others are called that too, its folder before it,
/// as many folders as tell them apart. Files that differ by their ending alone keep it.
///
/// # Errors
/// If a scene is named twice, be it by two spellings of its path.
pub(super) fn distinct_names(scenes: &[PathBuf]) -> Result<Vec<String>> {
    check_are_distinct(scenes)?;
    let name_of = |(place, scene): (usize, &PathBuf)| {
        let others = || scenes.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, scene)| scene);
        let is_its_own = |parts: &usize| others().all(|other| last_parts(other, *parts) != last_parts(scene, *parts));
        // Beyond its own parts a path stays as it is, while those of others grow.
        let most_parts = scenes.iter().map(|scene| scene.components().count()).max().unwrap_or(0);
        let parts = (1..=most_parts).find(is_its_own);
        parts.map_or_else(|| scene.clone(), |parts| last_parts(scene, parts)).display().to_string()
    };
    Ok(scenes.iter().enumerate().map(name_of).collect())
}

fn check_are_distinct(scenes: &[PathBuf]) -> Result<()> {
    // A file that is not there is told of when it is loaded.
    let file = |scene: &PathBuf| scene.canonicalize().unwrap_or_else(|_| scene.clone());
    let files: Vec<PathBuf> = scenes.iter().map(file).collect();
    for (place, scene) in scenes.iter().enumerate() {
        let Some(first) = files.iter().position(|file| *file == files[place]).filter(|first| *first < place) else {
            continue;
        };
        let spelling = match &scenes[first] {
            first if first.as_os_str() == scene.as_os_str() => String::new(),
            first => format!(", here and as {}", first.display()),
        };
        bail!("{}: named twice{spelling}, and results are told apart by scene: name it once", scene.display());
    }
    Ok(())
}

/// The end of a path without its ending: so many parts of it, or all.
fn last_parts(path: &Path, parts: usize) -> PathBuf {
    let path = path.with_extension("");
    let unneeded = path.components().count().saturating_sub(parts);
    path.components().skip(unneeded).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(scenes: &[&str]) -> Result<Vec<String>> {
        distinct_names(&scenes.iter().map(PathBuf::from).collect::<Vec<_>>())
    }

    #[test]
    fn scenes_that_share_a_file_name_are_told_apart() {
        let named = |scenes: &[&str]| names(scenes).expect("all differ");
        assert_eq!(named(&["scenes/box.toml", "ball.glb"]), ["box", "ball"]);
        assert_eq!(named(&["a/box.toml", "b/box.toml", "a/ball.toml"]), ["a/box", "b/box", "ball"]);
        assert_eq!(named(&["a/room/scene.xml", "b/room/scene.xml"]), ["a/room/scene", "b/room/scene"]);
        assert_eq!(named(&["x/box.toml", "y/box.toml", "z/x/box.toml"]), ["x/box", "y/box", "z/x/box"]);
        assert_eq!(named(&["box.toml", "a/box.toml"]), ["box", "a/box"]);
        assert_eq!(named(&["a/box.toml", "a/box.glb"]), ["a/box.toml", "a/box.glb"]);
        assert!(names(&["a/box.toml", "a/box.toml"]).is_err());
    }

    #[test]
    fn a_scene_is_one_by_whatever_path() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("a")).expect("made");
        std::fs::write(folder.path().join("box.toml"), "").expect("written");
        let paths = ["box.toml", "a/../box.toml"].map(|path| folder.path().join(path));
        let error = distinct_names(&paths).expect_err("one file").to_string();
        assert!(
            error.contains("a/../box.toml: named twice, here and as ") && error.ends_with("name it once"),
            "{error}"
        );
    }
}
