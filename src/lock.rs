//! Locks between processes: the system's own, which end with their process however it ends.
//!
//! They spare double work and keep two processes from writing one film. Every file is there whole or not at all, and
//! a unit rendered twice gives the same bytes: where a file system has no locks, everybody gets them.

use std::fs::{File, TryLockError};
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

/// A lock, held until it is dropped.
#[derive(Debug)]
pub struct Lock {
    file: File,
    is_sole: bool,
}

impl Lock {
    /// Puts a word about its holder into the file, for those who find it taken.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn sign(&self, holder: &str) -> io::Result<()> {
        self.file.set_len(0)?;
        (&self.file).write_all(holder.as_bytes())
    }

    /// Whether the file that is locked is the one that has this name now: a holder before may have removed it
    /// meanwhile, and then nobody else will find this lock.
    #[cfg(unix)]
    pub fn is_at(&self, path: &Path) -> bool {
        use std::os::unix::fs::MetadataExt;
        let identity = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
        let named = path.metadata().map(identity).ok();
        named.is_some() && named == self.file.metadata().map(identity).ok()
    }

    /// Whether the file that is locked has this name now: always, where a file that is open keeps its name.
    #[cfg(not(unix))]
    pub fn is_at(&self, _: &Path) -> bool {
        true
    }

    /// Whether no other process has it; false where the file system has no locks.
    pub fn is_sole(&self) -> bool {
        self.is_sole
    }
}

/// Takes a lock, unless another process has it.
///
/// # Errors
/// If the file cannot be made, as where its folder is gone.
pub fn try_lock(path: &Path) -> io::Result<Option<Lock>> {
    let file = File::options().create(true).truncate(false).write(true).open(path)?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Ok(None),
        Ok(()) => Ok(Some(Lock { file, is_sole: true })),
        // A file system without locks.
        Err(TryLockError::Error(_)) => Ok(Some(Lock { file, is_sole: false })),
    }
}

/// Waits for a lock, unless `leaves` says that there is no more time; then there is none.
///
/// # Errors
/// As [`try_lock`].
pub fn wait_for_lock(path: &Path, leaves: &dyn Fn() -> bool) -> io::Result<Option<Lock>> {
    loop {
        match try_lock(path)? {
            None if leaves() => return Ok(None),
            None => std::thread::sleep(Duration::from_millis(100)),
            taken => return Ok(taken),
        }
    }
}
