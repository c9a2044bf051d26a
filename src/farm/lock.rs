//! Locks between processes: the system's own, which end with their process however it ends.
//!
//! They spare double work. Nothing is wrong without them, since every file is written at once and a unit rendered twice
//! gives the same bytes: where a file system has no locks, everybody gets them.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;
use std::time::Duration;

/// A lock, held until it is dropped.
#[derive(Debug)]
pub struct Lock {
    _file: File,
    is_sole: bool,
}

impl Lock {
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
        Ok(()) => Ok(Some(Lock { _file: file, is_sole: true })),
        // A file system without locks.
        Err(TryLockError::Error(_)) => Ok(Some(Lock { _file: file, is_sole: false })),
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
