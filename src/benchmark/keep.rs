//! What was found, kept in the folder of results, so that a run that was broken off goes on: figures as JSON, pixels
//! under a seal.

use crate::json_file;
use crate::sealed::{Kind, SealedError};
use anyhow::Result;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

static PIXELS: Kind = Kind {
    magic: *b"fech px32\r\n\x1a",
    version: 1,
    what: "a file of pixels that fechner bench keeps",
    remedy: "no other program should write to it",
};

/// What [`keep_pixels`] wrote; `None` unless it is there, whole and of so many values. What is there and refused is
/// told of, since it is made anew.
pub(super) fn kept_pixels(file: &Path, count: usize, say: &dyn Fn(&str)) -> Option<Vec<f32>> {
    let read = || -> Result<Vec<f32>, SealedError> {
        let values: Vec<f32> = PIXELS.decode(file, &PIXELS.read(file)?)?;
        if values.len() == count { Ok(values) } else { Err(PIXELS.damaged(file, "it is of another size")) }
    };
    match read() {
        Ok(values) => Some(values),
        Err(SealedError::Io { error, .. }) if error.kind() == std::io::ErrorKind::NotFound => None,
        Err(error) => {
            say(&format!("note: refused: {error}; it is made anew"));
            None
        }
    }
}

/// Writes values of pixels.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn keep_pixels(file: &Path, values: &[f32]) -> Result<()> {
    PIXELS.write(file, &values)?;
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
    if let Some(value) = json_file::read(file) {
        return Ok(value);
    }
    let value = make()?;
    json_file::write(file, &value)?;
    Ok(value)
}
