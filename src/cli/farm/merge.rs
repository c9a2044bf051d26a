//! `farm merge`: what is there into films, and what comes next.

use super::job::{Job, JobOptions};
use super::{CALL_AGAIN, Threads, open_for_work};
use anyhow::{Context, Result, bail};
use clap::Args;
use fechner::adaptive::{Ended, Quiet, Rendered};
use fechner::farm::Farm;
use fechner::farm::frame::{FrameJob, Merged, Progress, finish, merge_frame, progress};
use fechner::farm::lock::{try_lock, wait_for_lock};
use fechner::output;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `farm merge`.
#[derive(Debug, Args)]
pub(super) struct MergeArguments {
    /// The farm's folder.
    folder: PathBuf,
    /// Only these frames; several processes may merge a frame each.
    #[arg(long = "frame", value_name = "N")]
    frames: Vec<u32>,
    #[command(flatten)]
    threads: Threads,
}

/// Merges all frames that can be merged.
pub(super) fn run(arguments: &MergeArguments) -> Result<ExitCode> {
    let farm = open_for_work(&arguments.folder)?;
    let indices = chosen(&farm, &arguments.frames)?;
    arguments.threads.pool()?.install(|| {
        let options = JobOptions::of(&farm)?;
        let job = options.job()?;
        let mut waits = false;
        for frame_index in indices {
            if let Progress::Open { missing, .. } = progress(&farm, frame_index) {
                say_missing(&farm, frame_index, &missing);
                waits = true;
                continue;
            }
            let lock = wait_for_lock(&farm.frame_lock(frame_index), &|| false)?;
            waits |= !merge(&farm, &job, frame_index)?;
            drop(lock);
        }
        conclude(&farm, &job)?;
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
    let units: Vec<String> = missing.iter().map(u64::to_string).collect();
    eprintln!("frame {}: waits for units {}", farm.frame(frame_index).frame, units.join(", "));
}

/// Merges a frame whose lock is held; false if units are missing after all.
pub(super) fn merge(farm: &Farm, job: &Job<'_>, frame_index: usize) -> Result<bool> {
    if progress(farm, frame_index) == Progress::Done {
        return Ok(true);
    }
    let number = farm.frame(frame_index).frame;
    let frame = job.planned_frame(farm, frame_index)?;
    let tracer = frame.tracer();
    let frame_job = FrameJob { tracer: &tracer, settings: frame.settings(), header: frame.header().clone() };
    match merge_frame(farm, frame_index, &frame_job, &Quiet)? {
        Merged::Waiting { missing, refused } => {
            for error in refused {
                eprintln!("note: refused: {error}");
            }
            say_missing(farm, frame_index, &missing);
            Ok(false)
        }
        Merged::Planned(record) => {
            eprintln!(
                "frame {number}: round {} has {} units, {:.2} million samples",
                record.round,
                record.units.len(),
                record.samples as f64 / 1e6
            );
            Ok(true)
        }
        Merged::Ended(ended) => {
            let Ended { state, last_look } = *ended;
            let Some(look) = last_look else { bail!("frame {number} ended without a look") };
            let kept = farm.manifest().keeps_films.then(|| state.clone());
            let rendered = Rendered::new(state, look.judgement, look.stop_reason);
            let report = job.write(farm, number, &frame, rendered)?;
            let text = serde_json::to_vec_pretty(&report).context("the report could not be put into words")?;
            finish(farm, frame_index, kept.as_ref().map(|state| (frame.header(), state)), &text)?;
            Ok(true)
        }
    }
}

/// Makes what needs all frames, once, when all are done; where another process is at it, leaves it to that.
pub(super) fn conclude(farm: &Farm, job: &Job<'_>) -> Result<()> {
    let is_done = |frame_index| progress(farm, frame_index) == Progress::Done;
    let marker = farm.folder().join("concluded");
    if marker.exists() || !(0..farm.manifest().frames.len()).all(is_done) {
        return Ok(());
    }
    let Some(lock) = try_lock(&farm.folder().join("lock"))? else { return Ok(()) };
    if job.conclude()? {
        output::write_beside(&marker, |_| Ok(()))?;
    }
    drop(lock);
    Ok(())
}
