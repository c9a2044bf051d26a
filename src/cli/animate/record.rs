//! What is written beside a frame's picture: its figures, and by what a later run knows that it need not be made again.

use anyhow::{Context, Result};
use fechner::json_file;
use fechner::read_file;
use fechner::scene::hash::ContentHash;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The figures of one frame, and which picture they are of.
#[derive(Serialize, Deserialize)]
pub(super) struct FrameRecord {
    /// Everything that the picture depends on, as a name.
    pub(super) key: String,
    /// The picture's file, in the same folder.
    pub(super) picture: String,
    /// Hash of all bytes of the picture's file.
    pub(super) picture_hash: ContentHash,
    pub(super) frame: u32,
    pub(super) seconds_of_shot: f64,
    pub(super) report: serde_json::Value,
}

impl FrameRecord {
    /// The record's file, of the frame whose picture is in that file.
    pub(super) fn file(picture: &Path) -> PathBuf {
        picture.with_extension("json")
    }

    /// What is said of a picture by that name, if both files are there.
    pub(super) fn of_picture(picture: &Path) -> Option<Self> {
        let record: Self = json_file::read(&Self::file(picture))?;
        (picture.is_file() && record.picture == name(picture)).then_some(record)
    }

    /// The picture that the record beside a picture that is there tells of instead: the same frame in another format.
    pub(super) fn of_another_picture(picture: &Path) -> Option<String> {
        let record: Self = json_file::read(&Self::file(picture))?;
        (picture.is_file() && record.picture != name(picture)).then_some(record.picture)
    }

    /// Whether a picture was made from all that this key names, and its file has not been changed since.
    pub(super) fn holds(&self, key: &str, picture: &Path) -> bool {
        self.key == key && hash_of_file(picture).is_ok_and(|hash| hash == self.picture_hash)
    }

    /// Takes a picture's record away, so that the picture counts for nothing until it has a new one.
    pub(super) fn remove(picture: &Path) -> Result<()> {
        let file = Self::file(picture);
        match std::fs::remove_file(&file) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(error).with_context(|| format!("{}: cannot be replaced", file.display()))
            }
            _ => Ok(()),
        }
    }
}

/// A file's name without its folder.
pub(super) fn name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Hash of all bytes of a file.
pub(super) fn hash_of_file(file: &Path) -> Result<ContentHash> {
    let bytes = read_file::bytes(file).with_context(|| format!("{}", file.display()))?;
    Ok(ContentHash::of_bytes(&bytes))
}
