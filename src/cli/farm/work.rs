//! `farm work`: one of any number of processes on a folder, which samples, merges and concludes as there is need.

use super::merge::{MergeWent, conclude, merge};
use super::unit::{IfBusy, KeepingArguments, UnitOutcome, Worker};
use super::{CALL_AGAIN, Threads, frame_lock};
use anyhow::{Context, Result};
use clap::Args;
use fechner::farm::frame::{FrameState, progress};
use fechner::lock::try_lock;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Arguments of `farm work`.
#[derive(Debug, Args)]
pub(super) struct WorkArguments {
    /// The farm's folder.
    folder: PathBuf,
    #[command(flatten)]
    keeping: KeepingArguments,
    #[command(flatten)]
    threads: Threads,
}

/// How long to wait where others have everything that can be done.
const PAUSE: Duration = Duration::from_millis(200);

/// Works until all frames are done. Where others merge or render, it takes what they leave.
pub(super) fn run(arguments: &WorkArguments) -> Result<ExitCode> {
    Worker::with(&arguments.folder, &arguments.keeping, &arguments.threads, |mut worker| {
        let Worker { farm, job, signals, .. } = worker;
        loop {
            let (mut all_done, mut did_something) = (true, false);
            for frame_index in 0..farm.manifest().frames.len() {
                if signals.leaves() {
                    return Ok(ExitCode::from(CALL_AGAIN));
                }
                match progress(farm, frame_index) {
                    FrameState::Done => continue,
                    FrameState::ToMerge { .. } => {
                        let path = frame_lock(farm, frame_index)?;
                        if let Some(lock) = try_lock(&path).with_context(|| path.display().to_string())? {
                            match merge(&worker, frame_index, &lock)? {
                                MergeWent::On => did_something = true,
                                MergeWent::Waits => {}
                                MergeWent::Left => return Ok(ExitCode::from(CALL_AGAIN)),
                            }
                        }
                    }
                    FrameState::Open { missing, .. } => {
                        for unit in missing {
                            match worker.render(unit, IfBusy::Skip)? {
                                UnitOutcome::Rendered => did_something = true,
                                UnitOutcome::Left => return Ok(ExitCode::from(CALL_AGAIN)),
                                UnitOutcome::WasThere | UnitOutcome::Busy | UnitOutcome::HasNoOrder => {}
                            }
                        }
                    }
                }
                all_done = false;
            }
            if all_done {
                conclude(farm, job)?;
                return Ok(ExitCode::SUCCESS);
            }
            if !did_something {
                std::thread::sleep(PAUSE);
            }
        }
    })
}
