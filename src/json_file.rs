//! Values as JSON in files of their own: read where they are there and whole, and written whole or not at all.

use crate::output::{OutputError, write_beside};
use crate::read_file;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::Write as _;
use std::path::Path;

/// What is in a regular file; `None` where it is not there, or is not such a value's.
pub fn read<T: DeserializeOwned>(path: &Path) -> Option<T> {
    serde_json::from_slice(&read_file::bytes(path).ok()?).ok()
}

/// Writes a value, indented for people.
///
/// # Errors
/// A file that cannot be written, and a value that JSON has no words for.
pub fn write(path: &Path, value: &(impl Serialize + ?Sized)) -> Result<(), OutputError> {
    write_text(path, &indented(path, value)?)
}

/// Writes a value that is large and for programs alone: in a single line.
///
/// # Errors
/// As [`write()`].
pub fn write_in_a_line(path: &Path, value: &(impl Serialize + ?Sized)) -> Result<(), OutputError> {
    write_text(path, &serde_json::to_vec(value).map_err(|error| without_words(path, error))?)
}

/// What [`write()`] writes, for who needs the file's hash.
///
/// # Errors
/// For a value that JSON has no words for: it is said of the file at `path`.
pub(crate) fn indented(path: &Path, value: &(impl Serialize + ?Sized)) -> Result<Vec<u8>, OutputError> {
    serde_json::to_vec_pretty(value).map_err(|error| without_words(path, error))
}

fn write_text(path: &Path, text: &[u8]) -> Result<(), OutputError> {
    write_beside(path, |file| file.write_all(text))
}

fn without_words(path: &Path, error: serde_json::Error) -> OutputError {
    OutputError::Io { path: path.to_owned(), error: error.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_half_of_it_is_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.json");
        assert_eq!(read::<Vec<u32>>(&path), None);
        write(&path, &[1, 2]).expect("written");
        assert_eq!(read(&path), Some(vec![1, 2]));
        write_in_a_line(&path, &[1, 2]).expect("written");
        assert_eq!(std::fs::read(&path).expect("there"), b"[1,2]");
        std::fs::write(&path, "[1,").expect("written");
        assert_eq!(read::<Vec<u32>>(&path), None);
        assert_eq!(read::<Vec<u32>>(folder.path()), None);
    }

    #[cfg(unix)]
    #[test]
    fn what_has_no_words_names_its_file() {
        use std::os::unix::ffi::OsStrExt as _;
        let name = Path::new(std::ffi::OsStr::from_bytes(b"bad\xff"));
        let error = write(Path::new("a.json"), name).expect_err("not Unicode").to_string();
        assert!(error.starts_with("cannot write a.json: "), "{error}");
    }
}
