//! Reading whole files, with a limit and with errors that say what the path is when it is no file.

use super::error::LoadError;
use crate::poison::Unpoisoned as _;
use crate::read_file;
use std::collections::BTreeSet;
use std::fmt::Display;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// No file larger than this is read: a picture, mesh or buffer above it is more likely a slip than a scene.
const MAX_FILE_BYTES: u64 = 4 << 30;

/// Most bytes that a packed file may unpack to: a few kB can stand for gigabytes of nothing.
const MAX_UNPACKED_BYTES: u64 = 2 << 30;

/// Files that this process has read, by their canonical paths.
static READ: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Whether this process has read a file as a scene or a part of one: a mesh, a texture, an included file. Writing
/// in its place would lose it.
pub fn was_read(path: &Path) -> bool {
    let read = READ.lock().unpoisoned();
    path.canonicalize().is_ok_and(|path| read.contains(&path))
}

/// Lists all files of which [`was_read`] says so.
pub fn files_read() -> Vec<PathBuf> {
    READ.lock().unpoisoned().iter().cloned().collect()
}

/// Makes [`was_read`] count a file that belongs to a scene and is read elsewhere: the display that it names.
pub fn count_as_read(path: &Path) {
    if let Ok(path) = path.canonicalize() {
        READ.lock().unpoisoned().insert(path);
    }
}

/// The whole file.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, LoadError> {
    let metadata = read_file::check(path).map_err(|error| LoadError::unreadable(path, &error))?;
    if metadata.len() > MAX_FILE_BYTES {
        let problem = format!("{} MiB, at most {} MiB are read", metadata.len() >> 20, MAX_FILE_BYTES >> 20);
        return Err(LoadError::too_large(path, problem));
    }
    let file = std::fs::File::open(path).map_err(|error| LoadError::unreadable(path, &error))?;
    count_as_read(path);
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    // The limit holds again here, for files that grow while they are read.
    file.take(MAX_FILE_BYTES).read_to_end(&mut bytes).map_err(|error| LoadError::unreadable(path, &error))?;
    if bytes.is_empty() {
        return Err(LoadError::invalid(path, "the file is empty"));
    }
    Ok(bytes)
}

/// The whole file, unpacked if it is a gzip file.
pub(crate) fn read_unpacked(path: &Path) -> Result<Vec<u8>, LoadError> {
    let bytes = read(path)?;
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    unpacked(flate2::read::MultiGzDecoder::new(bytes.as_slice()), path, "not valid gzip")
}

/// What a decoder of a file, or of a part of it, gives; `damaged` says what it is where that cannot be unpacked.
pub(crate) fn unpacked(decoder: impl Read, path: &Path, damaged: impl Display) -> Result<Vec<u8>, LoadError> {
    let mut unpacked = Vec::new();
    // One more byte than allowed tells what ends there from what goes on.
    decoder
        .take(MAX_UNPACKED_BYTES + 1)
        .read_to_end(&mut unpacked)
        .map_err(|error| LoadError::invalid(path, format_args!("{damaged}: {error}")))?;
    if unpacked.len() as u64 > MAX_UNPACKED_BYTES {
        let problem = format!("unpacks to more than {} MiB", MAX_UNPACKED_BYTES >> 20);
        return Err(LoadError::too_large(path, problem));
    }
    Ok(unpacked)
}

/// The whole file as text: UTF-8, or UTF-16 with a byte order mark (some Windows exporters write it).
pub(crate) fn read_text(path: &Path) -> Result<String, LoadError> {
    decode_text(path, read(path)?)
}

/// Text from bytes, with a placeholder for each byte that is not UTF-8: old exporters write names and comments in other
/// encodings, and only those are lost. Lines that end as on old Macs end as everywhere.
pub(crate) fn decode_loosely(path: &Path, bytes: Vec<u8>) -> Result<String, LoadError> {
    let text = if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        decode_text(path, bytes)?
    } else {
        let text = bytes.strip_prefix(&[0xef, 0xbb, 0xbf]).unwrap_or(&bytes);
        String::from_utf8_lossy(text).into_owned()
    };
    let has_only_returns = text.contains('\r') && !text.contains('\n');
    Ok(if has_only_returns { text.replace('\r', "\n") } else { text })
}

/// Text from bytes.
pub(crate) fn decode_text(path: &Path, bytes: Vec<u8>) -> Result<String, LoadError> {
    let utf16 = |unit: fn([u8; 2]) -> u16| {
        if !bytes.len().is_multiple_of(2) {
            return Err(LoadError::invalid(path, "UTF-16 text with half a character at its end"));
        }
        let units = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        char::decode_utf16(units)
            .collect::<Result<String, _>>()
            .map_err(|_| LoadError::invalid(path, "not valid UTF-16 text"))
    };
    match bytes.get(..3) {
        Some([0xff, 0xfe, _]) => utf16(u16::from_le_bytes),
        Some([0xfe, 0xff, _]) => utf16(u16::from_be_bytes),
        Some([0xef, 0xbb, 0xbf]) => utf8(path, bytes[3..].to_vec()),
        _ => utf8(path, bytes),
    }
}

fn utf8(path: &Path, bytes: Vec<u8>) -> Result<String, LoadError> {
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = valid.iter().filter(|&&byte| byte == b'\n').count() + 1;
        LoadError::invalid_at(super::Place::line(path, line), "not UTF-8 text")
    })
}
