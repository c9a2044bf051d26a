//! Files that are believed whole or not at all: 16 bytes that name their kind and its version, a value in postcard's
//! encoding, and the BLAKE3 hash of all before it. What was cut, changed or made by another program is refused before
//! anything in it is believed.
//!
//! Not for files that people or other programs read.

use crate::output::{OutputError, write_beside};
use crate::read_file;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// A kind of file.
#[derive(Debug, PartialEq, Eq)]
pub struct Kind {
    /// First bytes of a file of this kind: as in PNG, a byte that no text has and line ends that careless transfers
    /// change.
    pub magic: [u8; 12],
    /// Raised whenever the bytes after it mean something else.
    pub version: u32,
    /// What it is and who writes it, for messages: "a film's file, such as ... writes".
    pub what: &'static str,
    /// What to do when it is damaged.
    pub remedy: &'static str,
}

const HASH_BYTES: usize = blake3::OUT_LEN;

/// Why a file was not believed.
#[derive(Debug, thiserror::Error)]
pub enum SealedError {
    /// The operating system refused.
    #[error("cannot read {}: {error}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// Something else.
    #[error("cannot read {}: it is not {}", .path.display(), .kind.what)]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it should be.
        kind: &'static Kind,
    },
    /// The file is of an earlier or later program's version.
    #[error(
        "cannot read {}: its format is version {found}, and this program reads version {}", .path.display(), .kind.version
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// What it should be.
        kind: &'static Kind,
        /// Its version.
        found: u32,
    },
    /// Cut or changed.
    #[error("cannot read {}: it is damaged ({problem}); {}", .path.display(), .kind.remedy)]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What it should be.
        kind: &'static Kind,
        /// What is wrong.
        problem: &'static str,
    },
}

impl Kind {
    /// Writes beside `path` and renames, so that a kill at any moment leaves the old file or the new one. Returns its
    /// length in bytes.
    ///
    /// # Errors
    /// As [`write_beside`].
    pub fn write<T: Serialize>(&self, path: &Path, value: &T) -> Result<u64, OutputError> {
        let mut length = 0;
        write_beside(path, |file| {
            // Whole megabytes for the hasher and the system: postcard writes field by field.
            let sealing = Sealing { file, hasher: blake3::Hasher::new(), failed: None };
            let mut buffered = BufWriter::with_capacity(1 << 20, sealing);
            buffered.write_all(&self.preamble())?;
            if let Err(error) = postcard::to_io(value, &mut buffered).map(|_| ()) {
                return Err(buffered.get_mut().failed.take().unwrap_or_else(|| io::Error::other(error)));
            }
            let Sealing { file, hasher, .. } = buffered.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.write_all(hasher.finalize().as_bytes())?;
            length = hasher.count() + HASH_BYTES as u64;
            Ok(())
        })?;
        Ok(length)
    }

    /// The bytes of a file around a payload, sound by its hash whatever the payload says.
    pub fn seal(&self, payload: &[u8]) -> Vec<u8> {
        let mut file = self.preamble();
        file.extend_from_slice(payload);
        let hash = blake3::hash(&file);
        file.extend_from_slice(hash.as_bytes());
        file
    }

    /// Whether these are the first bytes of such a file.
    pub fn begins(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(&self.magic)
    }

    /// Reads all bytes of a file. One of another kind is refused by its first bytes, however long it is.
    ///
    /// # Errors
    /// [`SealedError`] for what is not of this kind and version; what follows is not looked at.
    pub fn read(&'static self, path: &Path) -> Result<Vec<u8>, SealedError> {
        let io = |error| SealedError::Io { path: path.to_owned(), error };
        let mut file = open(path)?;
        let mut bytes = Vec::new();
        (&mut file).take(self.preamble().len() as u64).read_to_end(&mut bytes).map_err(io)?;
        self.after_preamble(path, &bytes)?;
        file.read_to_end(&mut bytes).map_err(io)?;
        Ok(bytes)
    }

    /// The value in a file that is in memory; `path` is for messages.
    ///
    /// # Errors
    /// [`SealedError`] for everything that is not a whole file of this kind.
    pub fn decode<T: DeserializeOwned>(&'static self, path: &Path, file: &[u8]) -> Result<T, SealedError> {
        let rest = self.after_preamble(path, file)?;
        let Some((payload, hash)) = rest.split_last_chunk::<HASH_BYTES>() else {
            return Err(self.damaged(path, "it ends too early"));
        };
        if blake3::hash(&file[..file.len() - HASH_BYTES]) != *hash {
            return Err(self.damaged(path, "its checksum does not fit: it was cut or changed"));
        }
        let (value, left) =
            postcard::take_from_bytes(payload).map_err(|_| self.damaged(path, "what it holds cannot be read"))?;
        if left.is_empty() { Ok(value) } else { Err(self.damaged(path, "it goes on after its end")) }
    }

    /// The first value in a file, from its first `limit` bytes at most. Damage further on goes unnoticed.
    ///
    /// # Errors
    /// [`SealedError`] where it cannot be read.
    pub fn read_beginning<T: DeserializeOwned>(&'static self, path: &Path, limit: u64) -> Result<T, SealedError> {
        let mut bytes = Vec::new();
        let read = open(path)?.take(limit).read_to_end(&mut bytes);
        read.map_err(|error| SealedError::Io { path: path.to_owned(), error })?;
        match postcard::take_from_bytes(self.after_preamble(path, &bytes)?) {
            Ok((value, _)) => Ok(value),
            Err(_) => Err(self.damaged(path, "its header cannot be read")),
        }
    }

    /// A file of this kind that says what cannot be.
    pub fn damaged(&'static self, path: &Path, problem: &'static str) -> SealedError {
        SealedError::Damaged { path: path.to_owned(), kind: self, problem }
    }

    fn preamble(&self) -> Vec<u8> {
        [&self.magic[..], &self.version.to_le_bytes()].concat()
    }

    /// What follows the file's name and version.
    fn after_preamble<'a>(&'static self, path: &Path, bytes: &'a [u8]) -> Result<&'a [u8], SealedError> {
        let Some(rest) = bytes.strip_prefix(&self.magic) else {
            return Err(SealedError::Foreign { path: path.to_owned(), kind: self });
        };
        let Some((version, rest)) = rest.split_first_chunk() else {
            return Err(self.damaged(path, "it ends after its name"));
        };
        let found = u32::from_le_bytes(*version);
        if found == self.version {
            Ok(rest)
        } else {
            Err(SealedError::Version { path: path.to_owned(), kind: self, found })
        }
    }
}

/// Hashes what it writes, and keeps what the system said where that failed, since postcard forgets it.
struct Sealing<'a> {
    file: &'a mut File,
    hasher: blake3::Hasher,
    failed: Option<io::Error>,
}

impl Write for Sealing<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write_all(bytes).map_err(|error| {
            let kind = error.kind();
            self.failed = Some(error);
            io::Error::from(kind)
        })?;
        self.hasher.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

fn open(path: &Path) -> Result<File, SealedError> {
    read_file::open(path).map_err(|error| SealedError::Io { path: path.to_owned(), error })
}
