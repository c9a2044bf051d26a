//! Files that are read whole, of whatever path a user names: nothing that has no end, and nothing that waits for a
//! writer.

use std::fs::{File, Metadata};
use std::io::{self, Read as _};
use std::path::Path;

/// Opens a regular file.
///
/// # Errors
/// What the system says, and of everything that is no regular file what it is.
pub fn open(path: &Path) -> io::Result<File> {
    check(path)?;
    File::open(path)
}

/// Reads a file's bytes.
///
/// # Errors
/// As [`open`].
pub fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads a file's text, which is UTF-8.
///
/// # Errors
/// As [`open`], and where it is no such text.
pub fn text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    match open(path)?.read_to_string(&mut text) {
        Ok(_) => Ok(text),
        Err(error) if error.kind() == io::ErrorKind::InvalidData => {
            Err(io::Error::new(io::ErrorKind::InvalidData, "is not text in UTF-8"))
        }
        Err(error) => Err(error),
    }
}

/// What the system knows of a regular file. Asked before it is opened: opening a pipe would wait for a writer for ever.
///
/// # Errors
/// As [`open`].
pub fn check(path: &Path) -> io::Result<Metadata> {
    let metadata = std::fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory, not a file"));
    }
    if !metadata.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "is not a regular file"));
    }
    Ok(metadata)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_read_and_folders_are_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a");
        std::fs::write(&file, "words").expect("written");
        assert_eq!(text(&file).expect("readable"), "words");
        assert_eq!(bytes(&file).expect("readable"), b"words");
        assert_eq!(bytes(folder.path()).expect_err("a folder").to_string(), "is a directory, not a file");
        assert_eq!(bytes(&file.join("b")).map_err(|error| error.kind()), Err(io::ErrorKind::NotADirectory));
    }

    #[cfg(unix)]
    #[test]
    fn what_has_no_end_is_not_opened() {
        let said = |path: &str| open(Path::new(path)).expect_err("no file").to_string();
        assert_eq!(said("/dev/zero"), "is not a regular file");
    }
}
