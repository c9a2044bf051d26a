//! Writes and reads the format of checkpoints: header and state as a sealed file. What it may be continued or merged
//! with is left to the callers.

use super::{Checkpoint, Header};
use crate::adaptive::audit::MAX_INFLATION;
use crate::adaptive::state::{RenderState, Seconds, can_be_seconds};
use crate::output::OutputError;
use crate::sealed::{Kind, SealedError};
use fechner_perception::csf::FrameTiming;
use std::path::{Path, PathBuf};

static FILM: Kind = Kind {
    magic: *b"fech film\r\n\x1a",
    version: 10,
    what: "a film's file, such as fechner render --checkpoint FILE writes",
    remedy: "take another copy of it, or render anew",
};
/// More than any header takes.
const HEADER_LIMIT: u64 = 1 << 20;

/// Why a film's file could not be used.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file is not a whole film.
    #[error(transparent)]
    Sealed(#[from] SealedError),
    /// Sound, but not of this render.
    #[error("{} does not fit: {problem}", .path.display())]
    Different {
        /// The file.
        path: PathBuf,
        /// What differs, and what would be right.
        problem: String,
    },
}

/// Writes beside `path` and renames, so that a kill at any moment leaves the old file or the new one. Returns its
/// length.
///
/// # Errors
/// As [`crate::output::write_beside`], and for what [`read_checkpoint`] would refuse: who reads it would
/// begin anew, again and again.
pub fn write_checkpoint(path: &Path, header: &Header, state: &RenderState) -> Result<u64, OutputError> {
    check(header, state).map_err(|problem| OutputError::Unreadable { path: path.to_owned(), problem })?;
    FILM.write(path, &(header, state))
}

/// A file around a payload, sound by its hash whatever the payload says: for tests of what comes after the hash.
pub fn seal(payload: &[u8]) -> Vec<u8> {
    FILM.seal(payload)
}

/// Whether these are the first bytes of a film's file.
pub fn is_checkpoint(bytes: &[u8]) -> bool {
    FILM.begins(bytes)
}

/// Reads a film's file.
///
/// # Errors
/// [`CheckpointError`] for everything that is not a whole film.
pub fn read_checkpoint(path: &Path) -> Result<Checkpoint, CheckpointError> {
    decode_checkpoint(path, &FILM.read(path)?)
}

/// Reads only what was rendered and for whom. Damage further on goes unnoticed.
///
/// # Errors
/// [`CheckpointError`] for what is no film of this version.
pub fn read_header(path: &Path) -> Result<Header, CheckpointError> {
    Ok(FILM.read_beginning(path, HEADER_LIMIT)?)
}

/// Reads a film's file that is in memory; `path` is for messages.
///
/// # Errors
/// [`CheckpointError`] for everything that is not a whole film.
pub fn decode_checkpoint(path: &Path, file: &[u8]) -> Result<Checkpoint, CheckpointError> {
    let (header, state) = FILM.decode::<(Header, RenderState)>(path, file)?;
    check(&header, &state).map_err(|problem| FILM.damaged(path, problem))?;
    Ok(Checkpoint { header, state })
}

/// Finds what no render writes: what is read must be safe to go on from, whoever made the file.
fn check(header: &Header, state: &RenderState) -> Result<(), &'static str> {
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
    let is_sound = |timing: FrameTiming| FrameTiming::nearest(timing.frames_per_second, timing.persistence) == timing;
    if !settings.frames.is_none_or(is_sound)
        || !settings.gazes.iter().all(|gaze| gaze.is_within(state.film.width(), state.film.height()))
    {
        return Err("nobody can see a shot by its settings");
    }
    let is_rung = |visibility: f64| visibility >= 0.0;
    let exposure = state.exposure.map_or(0.0, |exposure| exposure.scene_unit_over_white);
    let Seconds { total, perception, allocation, denoising } = state.seconds;
    if !is_rung(header.visibility)
        || !header.earlier_visibilities.iter().all(|&visibility| is_rung(visibility))
        || !state.finished_rung.is_none_or(is_rung)
        || !state.left_rung.is_none_or(is_rung)
        || !(1.0..=MAX_INFLATION).contains(&state.inflation)
        || !exposure.is_finite()
        || ![total, perception, allocation, denoising].into_iter().all(can_be_seconds)
    {
        return Err("its figures make no sense");
    }
    let pixels = state.film.pixel_count() as u32;
    if state.traced_blocks > state.pending.front().map_or(0, |plan| plan.blocks.len())
        || !state.pending.iter().flat_map(|plan| &plan.blocks).all(|block| block.is_sound(pixels))
        || !state.until_look.as_ref().is_none_or(|until_look| until_look.is_sound(pixels))
    {
        return Err("its plans make no sense");
    }
    Ok(())
}

fn is_positive(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}
