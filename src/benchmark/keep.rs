//! What was found, kept as JSON in the folder of results, so that a run that was broken off goes on.

use anyhow::Result;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// What [`keep`] wrote; `None` unless it is there and whole.
pub(super) fn kept<T: DeserializeOwned>(file: &Path) -> Option<T> {
    serde_json::from_slice(&std::fs::read(file).ok()?).ok()
}

/// Writes a value as JSON.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn keep<T: Serialize + ?Sized>(file: &Path, value: &T) -> Result<()> {
    let text = serde_json::to_string_pretty(value)?;
    crate::output::write_beside(file, |file| std::io::Write::write_all(file, text.as_bytes()))?;
    Ok(())
}

/// What is kept, or made now and kept.
///
/// # Errors
/// What cannot be made, or a file that cannot be written.
pub(super) fn kept_or_made<T: Serialize + DeserializeOwned>(
    file: &Path,
    make: impl FnOnce() -> Result<T>,
) -> Result<T> {
    if let Some(value) = kept(file) {
        return Ok(value);
    }
    let value = make()?;
    keep(file, &value)?;
    Ok(value)
}
