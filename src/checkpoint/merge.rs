//! Adds up renders of different seeds. Not for pictures: only films keep what adding takes.

use super::file::read_header;
use super::{Checkpoint, CheckpointError, Header, Seeds, read_checkpoint};
use crate::adaptive::settings::{DEFAULT_MAX_SAMPLES, Limits, Sampling};
use crate::adaptive::state::RenderState;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Bounds the memory of machines with many threads; more than that no disk feeds.
const MAX_READ_AT_ONCE: usize = 8;

/// Why films could not be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// There are none.
    #[error("there are no films to merge")]
    NoFilms,
    /// One of them could not be used.
    #[error(transparent)]
    File(#[from] CheckpointError),
    /// Two of them hold the same samples.
    #[error(
        "{} and {} both hold samples of seed {seed}, which would count twice: render one of them with another --seed",
        .first.display(), .second.display()
    )]
    SameSeed {
        /// One file.
        first: PathBuf,
        /// The other.
        second: PathBuf,
        /// What they share.
        seed: u64,
    },
}

/// Adds the films of several files: half A to half A and B to B, in the order of their seeds, so that the order of
/// `paths` does not matter. Of a render whose halves are uneven, as with 1 sample a pixel, an odd seed's are added the
/// other way round, so that the sum of many is even. Eight films of one sample would else have 8 samples in half A,
/// none in B, and tell nothing of their noise. What was decided for the single films (plans, rungs, audits) is left
/// behind; the largest inflation stays. Sums of sums hold the same samples, and may differ in the last bits of
/// variances and first surfaces.
///
/// Beside the sum, as many films are in memory as there are threads, at most 8.
///
/// # Errors
/// [`MergeError`] for no file at all, a file that cannot be read, films of other scenes, sizes, versions or viewings
/// than the first, and films that share a seed.
pub fn merge_files(paths: &[PathBuf]) -> Result<Checkpoint, MergeError> {
    let mut files = Vec::with_capacity(paths.len());
    for path in paths {
        files.push((read_header(path)?, path.as_path()));
    }
    files.sort_by(|a, b| a.0.seeds.all.cmp(&b.0.seeds.all));
    check_seeds(&files)?;
    let (first, rest) = files.split_first().ok_or(MergeError::NoFilms)?;
    let is_sum = !rest.is_empty();
    let read_same = |file: &(Header, &Path)| {
        let film = read_same(file)?;
        Ok::<_, CheckpointError>(if is_sum { balanced(film) } else { film })
    };
    let mut sum = read_same(first)?;
    for batch in rest.chunks(rayon::current_num_threads().clamp(1, MAX_READ_AT_ONCE)) {
        let read: Vec<_> = batch.par_iter().map(&read_same).collect();
        batch.iter().zip(read).try_for_each(|(file, film)| add(&mut sum, first, file, film?))?;
    }
    if is_sum {
        sum.header.seeds.all.sort_unstable();
        sum.header.seeds.current = None;
        sum.header.earlier_visibilities.clear();
        sum.state = sum.state.undecided(DEFAULT_MAX_SAMPLES);
    }
    Ok(sum)
}

/// A render's film as it goes into a sum. By its own seed alone, so that neither order nor grouping changes which
/// samples a half has; sums stay as they are.
fn balanced(Checkpoint { header, state }: Checkpoint) -> Checkpoint {
    let is_odd = matches!((&header.seeds.all[..], header.seeds.current), ([seed], Some(_)) if seed % 2 == 1);
    let film = if is_odd && state.film.has_uneven_halves() { state.film.with_halves_swapped() } else { state.film };
    Checkpoint { header, state: RenderState { film, ..state } }
}

/// Adds what was read of a file to the sum that began with the first.
fn add(
    sum: &mut Checkpoint,
    first: &(Header, &Path),
    (header, path): &(Header, &Path),
    next: Checkpoint,
) -> Result<(), CheckpointError> {
    let different = |problem: String| CheckpointError::Different { path: path.to_path_buf(), problem };
    if let Some(problem) = header.origin.difference(&first.0.origin) {
        return Err(different(format!("{problem}, as in {}", first.1.display())));
    }
    let [own, others] = [&header.settings, &first.0.settings];
    if !own.is_seen_like(others) {
        return Err(different(format!(
            "it was rendered with {}, and {} with {}",
            own.seen_otherwise_than(others),
            first.1.display(),
            others.seen_otherwise_than(own)
        )));
    }
    sum.state.film.add(&next.state.film).map_err(|problem| different(problem.to_owned()))?;
    sum.state.inflation = sum.state.inflation.max(next.state.inflation);
    sum.state.plans = sum.state.plans.saturating_add(next.state.plans);
    sum.state.looks = sum.state.looks.saturating_add(next.state.looks);
    sum.state.seconds += next.state.seconds;
    sum.header.settings.importance = sum.header.settings.importance.or(header.settings.importance);
    if sum.header.settings.sampling != header.settings.sampling {
        // Counts of the sum were in part chosen by what was found.
        sum.header.settings.sampling = Sampling::Adaptive;
    }
    sum.header.visibility = stricter(sum.header.visibility, next.header.visibility);
    sum.header.seeds.all.extend(next.header.seeds.all);
    Ok(())
}

/// The lower of two aims as [`Header::visibility`] states them, 0 being none.
fn stricter(one: f64, other: f64) -> f64 {
    match [one, other].map(Limits::visibility_of_last_rung) {
        [Some(one), Some(other)] => one.min(other),
        [Some(only), None] | [None, Some(only)] => only,
        [None, None] => 0.0,
    }
}

/// Reads all of a file whose header was read before.
fn read_same((header, path): &(Header, &Path)) -> Result<Checkpoint, CheckpointError> {
    let checkpoint = read_checkpoint(path)?;
    if checkpoint.header == *header {
        Ok(checkpoint)
    } else {
        Err(CheckpointError::Different { path: path.to_path_buf(), problem: "it changed while it was read".to_owned() })
    }
}

fn check_seeds(files: &[(Header, &Path)]) -> Result<(), MergeError> {
    let of = |seeds: &Seeds, path: &Path| seeds.all.iter().map(|&seed| (seed, path.to_owned())).collect::<Vec<_>>();
    let mut all: Vec<(u64, PathBuf)> = files.iter().flat_map(|(header, path)| of(&header.seeds, path)).collect();
    all.sort();
    match all.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some([first, second]) => {
            Err(MergeError::SameSeed { first: first.1.clone(), second: second.1.clone(), seed: first.0 })
        }
        _ => Ok(()),
    }
}
