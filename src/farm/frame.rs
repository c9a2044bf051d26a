//! One frame's way through its rounds: merge, look, hand out the next one or end.

use super::folder::Farm;
use super::round::{RoundRecord, clear_after, clear_before, hand_out, open_round, orders};
use super::unit::{Keeping, NamedOrder, Outcome, UnitError, UnitSums, most_samples_a_batch};
use crate::adaptive::judge::JudgeError;
use crate::adaptive::settings::LoopSettings;
use crate::adaptive::state::RenderState;
use crate::adaptive::{Ended, Monitor, Next, beginning, decide};
use crate::checkpoint::{CheckpointError, Header, read_checkpoint, write_checkpoint};
use crate::integrator::PathTracer;
use crate::json_file;
use crate::output::OutputError;
use crate::sealed::SealedError;
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// How far a frame is, as its files say.
#[derive(Clone, Debug, PartialEq)]
pub enum FrameState {
    /// Units of a round are missing.
    Open {
        /// The round.
        round: RoundRecord,
        /// Numbers of the units that are missing, ascending.
        missing: Vec<u64>,
    },
    /// All there is to wait for is there, or orders have to be written again.
    ToMerge {
        /// Its last round; `None` where the merge begins with the first.
        round: Option<RoundRecord>,
    },
    /// Its picture is there.
    Done,
}

/// How far a frame is. Reads names, not films.
pub fn progress(farm: &Farm, frame_index: usize) -> FrameState {
    if farm.result(frame_index).exists() {
        return FrameState::Done;
    }
    let Some(round) = open_round(farm, frame_index) else {
        // Rounds go when the result is there: it may have come between the two looks.
        let is_done = farm.result(frame_index).exists();
        return if is_done { FrameState::Done } else { FrameState::ToMerge { round: None } };
    };
    if round.round > 0 && !farm.film(frame_index).exists() {
        // The film is lost, and the frame begins anew: nobody needs this round's units.
        return FrameState::ToMerge { round: Some(round) };
    }
    let is_missing = |unit: &u64| !farm.unit_file(*unit, "sums").exists();
    let missing: Vec<u64> = round.units.iter().map(|unit| unit.unit).filter(is_missing).collect();
    let can_be_rendered = |unit: &u64| farm.unit_file(*unit, "order").exists();
    if missing.iter().all(can_be_rendered) && !missing.is_empty() {
        FrameState::Open { round, missing }
    } else {
        FrameState::ToMerge { round: Some(round) }
    }
}

/// What a frame's film is traced and judged by.
pub struct FrameJob<'a> {
    /// Tracer of the frame's scene, by the frame's seed.
    pub tracer: &'a PathTracer,
    /// When it is done.
    pub settings: &'a LoopSettings,
    /// What its film's file says of it.
    pub header: Header,
}

/// Why a frame could not be merged.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// Its film could not be read.
    #[error(transparent)]
    Film(#[from] CheckpointError),
    /// Something could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Its film could not be judged.
    #[error(transparent)]
    Judge(#[from] JudgeError),
}

/// What came of a merge.
#[derive(Debug)]
pub enum Merged {
    /// Nothing yet: units are missing.
    Waiting {
        /// Their numbers.
        missing: Vec<u64>,
        /// What was there and was refused; renamed, so that it is rendered again.
        refused: Vec<UnitError>,
    },
    /// The next round is handed out.
    Planned(RoundRecord),
    /// A signal ended it; its film is there.
    Left,
    /// The frame needs no more: its picture is to be made, then [`finish`].
    Ended(Box<Ended>),
}

/// Merges a frame's open round if all its units are there, and hands out the next. Rounds too small for units are
/// traced here. Call it with the frame's lock. Killed at any moment, it does the same when it is called again. A film
/// that is damaged is put aside, and the frame begins anew.
///
/// # Errors
/// [`FrameError`] if the film's file cannot be read, or something cannot be written.
pub fn merge_frame(
    farm: &Farm,
    frame_index: usize,
    job: &FrameJob<'_>,
    keeping: &Keeping<'_>,
    monitor: &dyn Monitor,
) -> Result<Merged, FrameError> {
    let mut state = state_so_far(farm, frame_index, job)?;
    let units: Vec<(NamedOrder, Vec<u8>)> = orders(farm, frame_index, &state).collect();
    let trace = |state: &mut RenderState| trace_here(farm, frame_index, job, keeping, state);
    if units.is_empty() {
        if trace(&mut state)? == Outcome::Left {
            return Ok(Merged::Left);
        }
    } else if let Err(Lacking { missing, refused }) = enter(farm, &units, &mut state) {
        drop(units);
        if !refused.is_empty() {
            // Others were entered.
            state = state_so_far(farm, frame_index, job)?;
        }
        clear_after(farm, frame_index, state.plans);
        hand_out(farm, frame_index, &state)?;
        return Ok(Merged::Waiting { missing, refused });
    }
    loop {
        state = match decide(job.tracer, job.settings, state, monitor)? {
            Next::Planned(state) => *state,
            Next::Ended(ended) => return Ok(Merged::Ended(ended)),
        };
        if orders(farm, frame_index, &state).next().is_some() {
            break;
        }
        if trace(&mut state)? == Outcome::Left {
            return Ok(Merged::Left);
        }
    }
    write_checkpoint(&farm.film(frame_index), &job.header, &state)?;
    clear_after(farm, frame_index, state.plans);
    let record = hand_out(farm, frame_index, &state)?;
    clear_before(farm, frame_index, record.round);
    Ok(Merged::Planned(record))
}

/// Marks a frame as done by its figures, after its picture is written, and `kept` beside it, its film. Clears
/// everything away that only a render under way needs.
///
/// # Errors
/// If something cannot be written.
pub fn finish(
    farm: &Farm,
    frame_index: usize,
    kept: Option<(&Header, &RenderState)>,
    result: &impl Serialize,
) -> Result<(), OutputError> {
    if let Some((header, state)) = kept {
        write_checkpoint(&farm.finished_film(frame_index), header, state)?;
    }
    json_file::write(&farm.result(frame_index), result)?;
    clear_before(farm, frame_index, u32::MAX);
    std::fs::remove_file(farm.film(frame_index)).ok();
    Ok(())
}

/// The film that rounds so far made, or an empty one where there is none that can be used.
fn state_so_far(farm: &Farm, frame_index: usize, job: &FrameJob<'_>) -> Result<RenderState, FrameError> {
    let path = farm.film(frame_index);
    let refused = match read_checkpoint(&path) {
        Ok(checkpoint) if checkpoint.header == job.header => return Ok(checkpoint.state),
        Ok(_) => Some(CheckpointError::Different { path: path.clone(), problem: "it is of another farm".to_owned() }),
        Err(CheckpointError::Sealed(SealedError::Io { error, .. })) if error.kind() == std::io::ErrorKind::NotFound => {
            None
        }
        Err(error @ CheckpointError::Sealed(SealedError::Io { .. })) => return Err(error.into()),
        Err(error) => Some(error),
    };
    if let Some(error) = refused {
        crate::say!("note: refused: {error}; the frame begins anew");
        set_aside(&path);
    }
    let area = job.tracer.settings().film_area();
    Ok(RenderState::new(area.width, area.height, &job.settings.limits))
}

/// What keeps a round from being merged.
struct Lacking {
    /// Numbers of units that are missing, among them those that were refused.
    missing: Vec<u64>,
    refused: Vec<UnitError>,
}

/// Enters the sums of all units into the film in the plan's order, as a render in one process does. Nothing is entered
/// where one is missing; where one is refused, others are.
fn enter(farm: &Farm, units: &[(NamedOrder, Vec<u8>)], state: &mut RenderState) -> Result<(), Lacking> {
    let files: Vec<_> = units.iter().map(|(named, _)| (named, farm.unit_file(named.order.unit, "sums"))).collect();
    let are_missing = files.iter().filter(|(_, path)| !path.exists());
    let mut missing: Vec<u64> = are_missing.map(|(named, _)| named.order.unit).collect();
    let mut refused = Vec::new();
    if !missing.is_empty() {
        return Err(Lacking { missing, refused });
    }
    let read = |(order, path): &(&NamedOrder, std::path::PathBuf)| UnitSums::read(path, order);
    let mut next = files.first().map(read);
    for (i, (named, path)) in files.iter().enumerate() {
        // One file is decoded while the other is entered.
        let (sums, following) = (next.take(), files.get(i + 1));
        let enter_one = || match sums {
            Some(Ok(sums)) => {
                for (block, sum) in named.order.blocks.iter().zip(&sums.sums) {
                    state.film.merge_block(*block, sum);
                }
                state.seconds.total += sums.seconds;
            }
            Some(Err(error)) => {
                set_aside(path);
                missing.push(named.order.unit);
                refused.push(error);
            }
            None => {}
        };
        ((), next) = rayon::join(enter_one, || following.map(read));
    }
    if !refused.is_empty() {
        return Err(Lacking { missing, refused });
    }
    while !state.pending.is_empty() {
        state.close_plan();
    }
    Ok(())
}

/// Takes a refused file out of the way, and keeps it for whoever wants to know.
pub fn set_aside(path: &Path) {
    let mut aside = path.as_os_str().to_owned();
    aside.push(".refused");
    if std::fs::rename(path, &aside).is_err() {
        std::fs::remove_file(path).ok();
    }
}

/// Traces what is planned, and writes the film as often as it is asked for. It may be left between two batches: what is
/// not traced then is still no unit's.
fn trace_here(
    farm: &Farm,
    frame_index: usize,
    job: &FrameJob<'_>,
    keeping: &Keeping<'_>,
    state: &mut RenderState,
) -> Result<Outcome, FrameError> {
    let (started, seconds_before) = (Instant::now(), state.seconds.total);
    let write = |state: &RenderState| write_checkpoint(&farm.film(frame_index), &job.header, state);
    let mut last_kept = started;
    while let Some(plan) = state.pending.front() {
        let rest = &plan.blocks[state.traced_blocks..];
        if rest.is_empty() {
            state.close_plan();
            continue;
        }
        let batch = beginning(rest, most_samples_a_batch());
        state.traced_blocks += job.tracer.trace_batch(batch, &mut state.film, &|_| {});
        state.seconds.total = seconds_before + started.elapsed().as_secs_f64();
        if let ControlFlow::Break(outcome) = keeping.after_batch(&mut last_kept, || write(state))? {
            return Ok(outcome);
        }
    }
    Ok(Outcome::Finished)
}
