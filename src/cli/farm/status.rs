//! `farm status`: how far everything is, for people and schedulers. It changes no result.

use super::absolute;
use crate::cli::words::{count, samples_in_words};
use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use fechner::farm::Farm;
use fechner::farm::frame::{FrameState, progress};
use fechner::lock::try_lock;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `farm status`.
#[derive(Debug, Args)]
pub(super) struct StatusArguments {
    /// The farm's folder.
    folder: PathBuf,
    /// As JSON.
    #[arg(long, conflicts_with = "list")]
    json: bool,
    /// Only numbers, one a line: of units that are missing, or of frames that are not done.
    #[arg(long, value_enum)]
    list: Option<List>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum List {
    Units,
    Frames,
}

/// How far a frame is.
#[derive(Debug, Serialize)]
struct FrameStatus {
    frame: u32,
    state: State,
    /// Number of the open round: plans traced before it.
    round: Option<u32>,
    /// Units of the open round.
    units: usize,
    /// Samples of these.
    samples: u64,
    /// Numbers of those that are missing.
    missing: Vec<u64>,
    /// Number of missing units that a process has now.
    running: usize,
    /// Whether its picture is there: that of a frame that is done may have been lost.
    has_picture: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum State {
    /// Units are missing.
    Open,
    /// Can be merged.
    Merge,
    Done,
}

#[derive(Debug, Serialize)]
struct Status {
    /// Frames, and what needs them all.
    done: bool,
    frames: Vec<FrameStatus>,
}

/// Says it on standard output.
pub(super) fn run(arguments: &StatusArguments) -> Result<ExitCode> {
    let farm = Farm::open(&absolute(&arguments.folder)?)?;
    let frames: Vec<FrameStatus> =
        (0..farm.manifest().frames.len()).map(|frame_index| of_frame(&farm, frame_index)).collect();
    let are_done = frames.iter().all(|frame| frame.state == State::Done && frame.has_picture);
    let status = Status { done: are_done && farm.concluded().exists(), frames };
    if arguments.json {
        answer!("{}", serde_json::to_string_pretty(&status).context("the status could not be put into words")?);
    } else {
        match arguments.list {
            Some(List::Units) => status.frames.iter().flat_map(|f| &f.missing).for_each(|unit| answer!("{unit}")),
            Some(List::Frames) => {
                status.frames.iter().filter(|f| f.state != State::Done).for_each(|f| answer!("{}", f.frame));
            }
            None => say(&status),
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn of_frame(farm: &Farm, frame_index: usize) -> FrameStatus {
    let (state, round, missing) = match progress(farm, frame_index) {
        FrameState::Done => (State::Done, None, Vec::new()),
        FrameState::ToMerge { round } => (State::Merge, round, Vec::new()),
        FrameState::Open { round, missing } => (State::Open, Some(round), missing),
    };
    let is_running = |unit: &&u64| {
        let lock = farm.unit_file(**unit, "lock");
        lock.exists() && try_lock(&lock).is_ok_and(|lock| lock.is_none())
    };
    FrameStatus {
        frame: farm.frame(frame_index).frame,
        state,
        units: round.as_ref().map_or(0, |round| round.units.len()),
        samples: round.as_ref().map_or(0, |round| round.samples),
        round: round.map(|round| round.round),
        running: missing.iter().filter(is_running).count(),
        has_picture: farm.has_picture(frame_index),
        missing,
    }
}

fn say(status: &Status) {
    for frame in &status.frames {
        let number = frame.frame;
        match (frame.state, frame.round) {
            (State::Done, _) if frame.has_picture => answer!("frame {number}: done"),
            (State::Done, _) => {
                answer!("frame {number}: done, but its picture is gone or empty: fechner farm work says what to do")
            }
            (State::Merge, None) => answer!("frame {number}: to be merged"),
            (State::Merge, Some(round)) => answer!("frame {number}: round {round} is to be merged"),
            (State::Open, _) => answer!(
                "frame {number}: round {} has {} of {}, {} being rendered, {} in all",
                frame.round.unwrap_or(0),
                frame.units - frame.missing.len(),
                count(frame.units, "unit"),
                frame.running,
                samples_in_words(frame.samples)
            ),
        }
    }
    let done = status.frames.iter().filter(|frame| frame.state == State::Done).count();
    answer!("{done} of {} done", count(status.frames.len(), "frame"));
    let have_pictures = status.frames.iter().all(|frame| frame.has_picture);
    if done == status.frames.len() && have_pictures && !status.done {
        answer!("what needs all frames is not made yet: fechner farm merge makes it");
    }
}
