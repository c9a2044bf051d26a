//! The format: 16 bytes that name it and its version, header and state in postcard's encoding, and the BLAKE3 hash of all
//! before it. What was cut, changed or made by another program is refused before anything in it is believed.

use super::{Checkpoint, Header};
use crate::adaptive::state::RenderState;
use crate::integrator::BlockWork;
use crate::output::{OutputError, write_beside};
use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// As in PNG, a byte that no text has and line ends that careless transfers change.
const MAGIC: [u8; 12] = *b"fech film\r\n\x1a";
/// Raised whenever the bytes after it mean something else.
const FORMAT: u32 = 3;
const PREAMBLE_BYTES: usize = MAGIC.len() + 4;
const HASH_BYTES: usize = blake3::OUT_LEN;
/// More than any header takes.
const HEADER_LIMIT: u64 = 1 << 20;

/// Why a film's file could not be used.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The operating system refused.
    #[error("cannot read {}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Something else.
    #[error(
        "cannot read {}: it is not a film's file, such as fechner render --checkpoint FILE writes", .path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The film of an earlier or later program.
    #[error("cannot read {}: its format is version {found}, and this program reads version {FORMAT}", .path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// Cut or changed.
    #[error("cannot read {}: it is damaged ({problem}); take another copy of it, or render anew", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: &'static str,
    },
    /// Sound, but not of this render.
    #[error("{} does not fit: {problem}", .path.display())]
    Different {
        /// The file.
        path: PathBuf,
        /// What differs, and what would be right.
        problem: String,
    },
}

/// Writes beside `path` and renames, so that a kill at any moment leaves the old file or the new one. Returns its length.
///
/// # Errors
/// As [`write_beside`].
pub fn write_checkpoint(path: &Path, header: &Header, state: &RenderState) -> Result<u64, OutputError> {
    let mut length = 0;
    write_beside(path, |file| {
        // Whole megabytes for the hasher and the system: postcard writes field by field.
        let sealing = Sealing { file, hasher: blake3::Hasher::new(), failed: None };
        let mut buffered = BufWriter::with_capacity(1 << 20, sealing);
        buffered.write_all(&preamble())?;
        if let Err(error) = postcard::to_io(&(header, state), &mut buffered).map(|_| ()) {
            return Err(buffered.get_mut().failed.take().unwrap_or_else(|| io::Error::other(error)));
        }
        let Sealing { file, hasher, .. } = buffered.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.write_all(hasher.finalize().as_bytes())?;
        length = hasher.count() + HASH_BYTES as u64;
        Ok(())
    })?;
    Ok(length)
}

fn preamble() -> Vec<u8> {
    [&MAGIC[..], &FORMAT.to_le_bytes()].concat()
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

/// A file around a payload, sound by its hash whatever the payload says: for tests of what comes after the hash.
pub fn seal(payload: &[u8]) -> Vec<u8> {
    let mut file = preamble();
    file.extend_from_slice(payload);
    let hash = blake3::hash(&file);
    file.extend_from_slice(hash.as_bytes());
    file
}

/// Whether these are the first bytes of a film's file.
pub fn is_checkpoint(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Reads a film's file.
///
/// # Errors
/// [`CheckpointError`] for everything that is not a whole film.
pub fn read_checkpoint(path: &Path) -> Result<Checkpoint, CheckpointError> {
    let io = |source| CheckpointError::Io { path: path.to_owned(), source };
    let mut file = open(path)?;
    let mut bytes = Vec::new();
    (&mut file).take(PREAMBLE_BYTES as u64).read_to_end(&mut bytes).map_err(io)?;
    // A foreign file of a terabyte is refused by its first bytes.
    after_preamble(path, &bytes)?;
    file.read_to_end(&mut bytes).map_err(io)?;
    decode_checkpoint(path, &bytes)
}

/// Reads only what was rendered and for whom. Damage further on goes unnoticed.
pub(super) fn read_header(path: &Path) -> Result<Header, CheckpointError> {
    let mut bytes = Vec::new();
    let read = open(path)?.take(HEADER_LIMIT).read_to_end(&mut bytes);
    read.map_err(|source| CheckpointError::Io { path: path.to_owned(), source })?;
    match postcard::take_from_bytes(after_preamble(path, &bytes)?) {
        Ok((header, _)) => Ok(header),
        Err(_) => Err(CheckpointError::Damaged { path: path.to_owned(), problem: "its header cannot be read" }),
    }
}

fn open(path: &Path) -> Result<File, CheckpointError> {
    let file = File::open(path).and_then(|file| match file.metadata()?.is_dir() {
        true => Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")),
        false => Ok(file),
    });
    file.map_err(|source| CheckpointError::Io { path: path.to_owned(), source })
}

/// What follows the file's name and version.
fn after_preamble<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a [u8], CheckpointError> {
    let Some(rest) = bytes.strip_prefix(&MAGIC) else {
        return Err(CheckpointError::Foreign { path: path.to_owned() });
    };
    let Some((version, rest)) = rest.split_first_chunk() else {
        return Err(CheckpointError::Damaged { path: path.to_owned(), problem: "it ends after its name" });
    };
    match u32::from_le_bytes(*version) {
        FORMAT => Ok(rest),
        found => Err(CheckpointError::Version { path: path.to_owned(), found }),
    }
}

/// Reads a film's file that is in memory; `path` is for messages.
///
/// # Errors
/// [`CheckpointError`] for everything that is not a whole film.
pub fn decode_checkpoint(path: &Path, file: &[u8]) -> Result<Checkpoint, CheckpointError> {
    let damaged = |problem| CheckpointError::Damaged { path: path.to_owned(), problem };
    let rest = after_preamble(path, file)?;
    let Some((payload, hash)) = rest.split_last_chunk::<HASH_BYTES>() else {
        return Err(damaged("it ends too early"));
    };
    if blake3::hash(&file[..file.len() - HASH_BYTES]) != *hash {
        return Err(damaged("its checksum does not fit: it was cut or changed"));
    }
    let ((header, state), left) = postcard::take_from_bytes::<(Header, RenderState)>(payload)
        .map_err(|_| damaged("what it holds cannot be read"))?;
    if !left.is_empty() {
        return Err(damaged("it goes on after its end"));
    }
    let checkpoint = Checkpoint { header, state };
    checkpoint.check().map_err(damaged)?;
    Ok(checkpoint)
}

impl Checkpoint {
    /// Finds what no render writes: what is read must be safe to go on from, whoever made the file.
    fn check(&self) -> Result<(), &'static str> {
        let Self { header, state } = self;
        state.film.check()?;
        if (header.origin.width, header.origin.height) != (state.film.width(), state.film.height()) {
            return Err("its film is not of its size");
        }
        let seeds = &header.seeds;
        let is_ascending = seeds.all.windows(2).all(|pair| pair[0] < pair[1]);
        if seeds.all.is_empty() || !is_ascending || seeds.current.is_some_and(|seed| !seeds.all.contains(&seed)) {
            return Err("its seeds make no sense");
        }
        let settings = &header.settings;
        let stops = settings.exposure_stops.unwrap_or(0.0);
        if settings.viewing.check().is_err() || !is_positive(settings.nits_per_unit) || !stops.is_finite() {
            return Err("nobody can see by its settings");
        }
        let is_rung = |visibility: f64| visibility >= 0.0;
        let exposure = state.exposure.map_or(0.0, |exposure| exposure.scene_unit_over_white);
        let seconds = [state.seconds_total, state.seconds_perception, state.seconds_allocation];
        if !is_rung(header.visibility)
            || !state.finished_rung.is_none_or(is_rung)
            || !(1.0..=1e6).contains(&state.inflation)
            || !exposure.is_finite()
            || !seconds.iter().all(|s| (0.0..1e12).contains(s))
        {
            return Err("its figures make no sense");
        }
        let pixels = state.film.width() * state.film.height();
        let is_whole = |block: &BlockWork| {
            block.pixel < pixels
                && block.level <= 27
                && u64::from(block.first) + u64::from(block.samples)
                    <= u64::from(BlockWork::whole(0, block.half, block.level).samples)
        };
        if state.traced_blocks > state.pending.front().map_or(0, |plan| plan.blocks.len())
            || !state.pending.iter().flat_map(|plan| &plan.blocks).all(is_whole)
        {
            return Err("its plans make no sense");
        }
        Ok(())
    }
}

fn is_positive(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}
