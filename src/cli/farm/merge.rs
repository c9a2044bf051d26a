//! `farm merge`: adds what is there into films, and finds what comes next. Rounds that are too small for units are
//! traced here.

use super::job::Job;
use super::unit::{KeepingArguments, Worker};
use super::{CALL_AGAIN, Threads, frame_lock};
use crate::cli::words::{count, listed, samples_in_words};
use anyhow::{Context, Result, bail};
use clap::Args;
use fechner::adaptive::{Ended, Quiet, Rendered};
use fechner::farm::Farm;
use fechner::farm::frame::{FrameJob, FrameState, Merged, finish, merge_frame, progress};
use fechner::farm::unit::Keeping;
use fechner::lock::{Lock, try_lock, wait_for_lock};
use fechner::output;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `farm merge`.
#[derive(Debug, Args)]
pub(super) struct MergeArguments {
    /// The farm's folder.
    folder: PathBuf,
    /// Only these frames; several processes may merge a frame each.
    #[arg(long = "frame", value_name = "N", allow_negative_numbers = true)]
    frames: Vec<u32>,
    #[command(flatten)]
    keeping: KeepingArguments,
    #[command(flatten)]
    threads: Threads,
}

/// How it went with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MergeWent {
    /// The next round is handed out, or the picture is there.
    On,
    /// Units are missing after all.
    Waits,
    /// A signal ended it; its film is there.
    Left,
}

/// Merges all frames that can be merged.
pub(super) fn run(arguments: &MergeArguments) -> Result<ExitCode> {
    Worker::with(&arguments.folder, &arguments.keeping, &arguments.threads, |worker| {
        let Worker { farm, job, signals, .. } = worker;
        let mut waits = false;
        for frame_index in chosen(farm, &arguments.frames)? {
            if signals.leaves() {
                return Ok(ExitCode::from(CALL_AGAIN));
            }
            if let FrameState::Open { missing, .. } = progress(farm, frame_index) {
                say_missing(farm, frame_index, &missing);
                waits = true;
                continue;
            }
            let path = frame_lock(farm, frame_index)?;
            let lock = wait_for_lock(&path, &|| signals.leaves()).with_context(|| path.display().to_string())?;
            let Some(lock) = lock else { return Ok(ExitCode::from(CALL_AGAIN)) };
            match merge(&worker, frame_index, &lock)? {
                MergeWent::On => {}
                MergeWent::Waits => waits = true,
                MergeWent::Left => return Ok(ExitCode::from(CALL_AGAIN)),
            }
        }
        if signals.leaves() {
            return Ok(ExitCode::from(CALL_AGAIN));
        }
        conclude(farm, job)?;
        Ok(if waits { ExitCode::from(CALL_AGAIN) } else { ExitCode::SUCCESS })
    })
}

fn chosen(farm: &Farm, frames: &[u32]) -> Result<Vec<usize>> {
    let entries = &farm.manifest().frames;
    let index = |number: &u32| {
        let found = entries.iter().position(|entry| entry.frame == *number);
        found.with_context(|| format!("{} has no frame {number}", farm.folder().display()))
    };
    if frames.is_empty() { Ok((0..entries.len()).collect()) } else { frames.iter().map(index).collect() }
}

fn say_missing(farm: &Farm, frame_index: usize, missing: &[u64]) {
    say!("frame {}: waits for units {}", farm.frame(frame_index).frame, listed(missing));
}

/// Merges a frame whose lock is held.
pub(super) fn merge(worker: &Worker<'_>, frame_index: usize, lock: &Lock) -> Result<MergeWent> {
    let Worker { farm, job, signals, every, .. } = *worker;
    if progress(farm, frame_index) == FrameState::Done {
        return Ok(MergeWent::On);
    }
    let number = farm.frame(frame_index).frame;
    if lock.is_sole() {
        // Of merges that were killed as they wrote.
        for path in [farm.film(frame_index), farm.finished_film(frame_index), farm.picture(frame_index)] {
            output::remove_leftovers(&path);
        }
    }
    let frame = job.planned_frame(farm, frame_index)?;
    let tracer = frame.tracer();
    let frame_job = FrameJob { tracer: &tracer, settings: frame.settings(), header: frame.header().clone() };
    let keeping = Keeping { every, wish: &|| signals.wish() };
    match merge_frame(farm, frame_index, &frame_job, &keeping, &Quiet)? {
        Merged::Waiting { missing, refused } => {
            for error in refused {
                say!("note: refused: {error}");
            }
            say_missing(farm, frame_index, &missing);
            Ok(MergeWent::Waits)
        }
        Merged::Planned(record) => {
            say!(
                "frame {number}: round {} has {}, {}",
                record.round,
                count(record.units.len(), "unit"),
                samples_in_words(record.samples)
            );
            Ok(MergeWent::On)
        }
        Merged::Left => {
            say!("frame {number}: left by a signal; its film is there");
            Ok(MergeWent::Left)
        }
        Merged::Ended(ended) => {
            let Ended { state, last_look } = *ended;
            let Some(look) = last_look else { bail!("frame {number} ended without a look") };
            let kept = farm.manifest().keeps_films.then(|| state.clone());
            let rendered = Rendered::new(state, look.judgement, look.stop_reason);
            let report = frame.write(farm, frame_index, rendered)?;
            finish(farm, frame_index, kept.as_ref().map(|state| (frame.header(), state)), &report)?;
            Ok(MergeWent::On)
        }
    }
}

/// Makes what needs all frames, once, when all are done; where another process is at it, leaves it to that.
pub(super) fn conclude(farm: &Farm, job: &Job<'_>) -> Result<()> {
    let indices = 0..farm.manifest().frames.len();
    if !indices.clone().all(|frame_index| progress(farm, frame_index) == FrameState::Done) {
        return Ok(());
    }
    for frame_index in indices {
        if !farm.has_picture(frame_index) {
            let (picture, result) = (farm.picture(frame_index), farm.result(frame_index));
            bail!(
                "{} is gone or empty, though its frame is done: remove {}, and it is rendered again",
                picture.display(),
                result.display()
            );
        }
    }
    if farm.concluded().exists() {
        return Ok(());
    }
    let path = farm.folder().join("lock");
    let Some(lock) = try_lock(&path).with_context(|| path.display().to_string())? else { return Ok(()) };
    if !job.conclude()? && job.is_whole(farm) {
        bail!(
            "a picture in {} is not the one that the farm made: remove it and its frame's result.json, and it is rendered again",
            farm.pictures().display()
        );
    }
    output::write_beside(&farm.concluded(), |_| Ok(()))?;
    drop(lock);
    Ok(())
}
