//! The right to write a film's file, which one process has at a time: of two that write one file, the one that writes
//! last would throw away what the other sampled. Not for pictures, which are renamed into place.

use super::targets::location;
use anyhow::{Context, Result, bail};
use fechner::lock::{Lock, try_lock};
use fechner::output::hidden_name;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Held until it is dropped or the process ends, however it ends.
pub(super) struct Claim {
    /// Beside the film and not the film itself, which is replaced by every write.
    path: PathBuf,
    _lock: Lock,
}

impl Claim {
    /// Claims the film at this path, there or not.
    ///
    /// # Errors
    /// If another process has it.
    pub(super) fn on(film: &Path) -> Result<Self> {
        let path = lock_beside(film);
        loop {
            let lock = try_lock(&path)
                .with_context(|| format!("{}: cannot be locked by {}", film.display(), path.display()))?;
            let Some(lock) = lock else {
                let owner = std::fs::read_to_string(&path).unwrap_or_default();
                let owner = if owner.is_empty() { "of another user" } else { &owner };
                bail!("{}: process {owner} writes this film: wait for its end, or name another file", film.display());
            };
            if lock.is_at(&path) {
                // Only for the message above.
                let _ = lock.sign(&std::process::id().to_string());
                return Ok(Self { path, _lock: lock });
            }
        }
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // One that stays is taken over by the next process.
        let _ = std::fs::remove_file(&self.path);
    }
}

fn lock_beside(film: &Path) -> PathBuf {
    let film = location(film);
    film.with_file_name(hidden_name(film.file_name().unwrap_or(OsStr::new("film")), ".lock"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time_has_a_film() {
        let folder = tempfile::tempdir().expect("a folder");
        let film = folder.path().join("a.film");
        let claim = Claim::on(&film).expect("free");
        let refused = Claim::on(&folder.path().join("./a.film")).err().expect("taken").to_string();
        assert!(refused.contains(&format!("process {}", std::process::id())), "{refused}");
        assert!(Claim::on(&folder.path().join("b.film")).is_ok());
        drop(claim);
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0, "nothing is left");
        assert!(Claim::on(&folder.path().join("a".repeat(255))).is_ok(), "the longest name");
        // As a killed process leaves it.
        std::fs::write(lock_beside(&film), "1").expect("written");
        assert!(Claim::on(&film).is_ok());
    }
}
