//! The files that a command writes.

use anyhow::bail;
use std::path::{Path, PathBuf};

/// Refuses one file for two purposes, each given with the option or words that name it: what is written later would take the place of
/// what was written before.
pub(super) fn check_distinct(files: &[(&str, Option<&Path>)]) -> anyhow::Result<()> {
    let named: Vec<(&str, &Path)> = files.iter().filter_map(|&(what, path)| Some((what, path?))).collect();
    for (place, (what, path)) in named.iter().enumerate() {
        if let Some((other, _)) = named[..place].iter().find(|(_, other)| location(other) == location(path)) {
            bail!("{}: {other} and {what} name the same file; give each its own", path.display());
        }
    }
    Ok(())
}

/// Where a file is or will be, whichever way its folder is spelled.
fn location(path: &Path) -> PathBuf {
    let in_its_folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(in_its_folder).unwrap_or_else(|| path.to_owned())
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
}
