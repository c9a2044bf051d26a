//! Checks the files that a command reads and writes, before it does either: that none is another, and that names can be
//! written.

use anyhow::bail;
use fechner::output::{check_name, folder_of, target_of};
use fechner::scene::load::was_read;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A file, where there is one, with the option or words that name it.
pub(super) type Named<'a> = (&'a str, Option<&'a Path>);

/// Refuses to write in the place of what is read, or one file for two purposes: a reference or a scene is lost by that.
/// Refuses names that no file can have as well, of frames to come too.
pub(super) fn check_kept(read: &[Named], written: &[Named]) -> anyhow::Result<()> {
    written.iter().filter_map(|&(_, path)| path).try_for_each(check_name)?;
    check_distinct(written)?;
    let sources: HashMap<PathBuf, &str> =
        read.iter().filter_map(|&(what, path)| Some((location(path?), what))).collect();
    for (option, path) in written.iter().filter_map(|&(option, path)| Some((option, path?))) {
        if let Some(what) = sources.get(&location(path)) {
            bail!("{}: {option} would replace {what} that is read; choose another name", path.display());
        }
    }
    Ok(())
}

/// Refuses to write in the place of a file that the scene is made of: its meshes, pictures and included files, which
/// are known once it is loaded.
pub(super) fn check_scene_kept(written: &[Named]) -> anyhow::Result<()> {
    for (option, path) in written.iter().filter_map(|&(option, path)| Some((option, path?))) {
        if was_read(path) {
            bail!("{}: {option} would replace a file that the scene is made of; choose another name", path.display());
        }
    }
    Ok(())
}

/// The file of `--display`, which may be a preset's name.
pub(super) fn display_file(display: Option<&str>) -> Named<'_> {
    ("the display", display.filter(|name| name.ends_with(".toml")).map(Path::new))
}

/// Refuses one file for two purposes, each given with the option or words that name it: what is written later would
/// take the place of what was written before.
pub(super) fn check_distinct(files: &[Named]) -> anyhow::Result<()> {
    let mut purposes = HashMap::new();
    for (what, path) in files.iter().filter_map(|&(what, path)| Some((what, path?))) {
        if let Some(other) = purposes.insert(location(path), what) {
            bail!("{}: {other} and {what} name the same file; give each its own", path.display());
        }
    }
    Ok(())
}

/// Where a file is or will be, whichever way its folder is spelled and whatever links lead there.
pub(super) fn location(path: &Path) -> PathBuf {
    let target = target_of(path).unwrap_or_else(|_| path.to_owned());
    let in_its_folder = || Some(folder_of(&target).canonicalize().ok()?.join(target.file_name()?));
    target.canonicalize().ok().or_else(in_its_folder).unwrap_or(target)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_file_has_one_purpose() {
        let folder = tempfile::tempdir().expect("a folder");
        let [a, again, b] = ["a.png", "./a.png", "b.png"].map(|name| folder.path().join(name));
        assert!(check_distinct(&[("-o", Some(&a)), ("--json", Some(&b)), ("--checkpoint", None)]).is_ok());
        std::fs::write(&a, "").expect("written");
        for path in [&a, &again] {
            let refused = check_distinct(&[("-o", Some(&a)), ("--json", None), ("--checkpoint", Some(path))]);
            let message = refused.expect_err("one file").to_string();
            assert!(message.contains("-o and --checkpoint") && message.contains("a.png"), "{message}");
        }
    }

    /// Links are one file before anything is at their end, too. Regression: two links were two files, and a
    /// picture took the film's place.
    #[cfg(unix)]
    #[test]
    fn links_to_one_file_are_one_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let [film, picture, end] = ["film", "picture", "end"].map(|name| folder.path().join(name));
        for link in [&film, &picture] {
            std::os::unix::fs::symlink("end", link).expect("a link");
        }
        for path in [&picture, &end] {
            assert!(check_distinct(&[("-o", Some(path)), ("--checkpoint", Some(&film))]).is_err());
        }
        assert_eq!(location(&film), location(&end));
    }

    #[test]
    fn what_is_read_is_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let [scene, again, other] = ["s.toml", "./s.toml", "b.png"].map(|name| folder.path().join(name));
        std::fs::write(&scene, "").expect("written");
        let read = [("the scene", Some(scene.as_path())), ("a copy", Some(&scene)), ("nothing", None)];
        assert!(check_kept(&read, &[("-o", Some(&other))]).is_ok());
        let refused = check_kept(&read[..1], &[("-o", Some(&other)), ("--json", Some(&again))]);
        let message = refused.expect_err("the scene").to_string();
        assert!(message.contains("--json would replace the scene that is read"), "{message}");
        assert_eq!(display_file(Some("desktop")).1, None);
        let long = folder.path().join("w".repeat(256));
        assert!(check_kept(&[], &[("-o", Some(&other)), ("a frame's record", Some(&long))]).is_err());
    }
}
