//! `fechner farm`: one render by many processes that share a folder. What a frame is made of is left to
//! `fechner::farm`.

mod job;
mod merge;
mod plan;
mod signals;
mod slurm;
mod status;
mod unit;
mod work;

use super::numbers::whole;
use super::{CALL_AGAIN, threads};
use anyhow::{Context, Result};
use clap::{Args, Subcommand};
use fechner::farm::Farm;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `farm`.
#[derive(Debug, Args)]
pub(super) struct FarmArguments {
    #[command(subcommand)]
    command: FarmCommand,
}

/// What can be done with a farm's folder.
#[derive(Debug, Subcommand)]
enum FarmCommand {
    /// Make a folder with a manifest and the units of the first round.
    Plan(plan::PlanArguments),
    /// Render units: complete or not at all, from their checkpoints where there are any. SIGUSR1 writes the checkpoint,
    /// SIGTERM writes it and ends with status 75.
    Unit(unit::UnitArguments),
    /// Merge the frames whose units are all there, look at them, and hand out the next round or write the picture.
    /// Status 75 if units are missing.
    Merge(merge::MergeArguments),
    /// Render and merge until everything is done; any number of these may work on one folder.
    Work(work::WorkArguments),
    /// Say how far every frame is.
    Status(status::StatusArguments),
    /// Write scripts that run the farm on Slurm.
    Slurm(slurm::SlurmArguments),
}

/// How much of the machine a process takes.
#[derive(Debug, Args)]
struct Threads {
    /// Threads; nothing depends on it but the time.
    #[arg(long, value_name = "N", value_parser = whole(1..=1023), allow_negative_numbers = true)]
    threads: Option<u32>,
}

impl Threads {
    fn pool(&self) -> Result<rayon::ThreadPool> {
        threads::pool(self.threads, "farm")
    }
}

/// Runs one of them.
pub(super) fn run(arguments: &FarmArguments) -> Result<ExitCode> {
    match &arguments.command {
        FarmCommand::Plan(arguments) => plan::run(arguments),
        FarmCommand::Unit(arguments) => unit::run(arguments),
        FarmCommand::Merge(arguments) => merge::run(arguments),
        FarmCommand::Work(arguments) => work::run(arguments),
        FarmCommand::Status(arguments) => status::run(arguments),
        FarmCommand::Slurm(arguments) => slurm::run(arguments),
    }
}

/// Opens a farm, and goes where it was planned, since its scene's name may begin there.
fn open_for_work(folder: &Path) -> Result<Farm> {
    let farm = Farm::open(&absolute(folder)?)?;
    let directory = &farm.manifest().directory;
    std::env::set_current_dir(directory).with_context(|| {
        format!(
            "the farm was planned in {}, which cannot be entered here: mount it at the same place",
            directory.display()
        )
    })?;
    Ok(farm)
}

/// The file that is locked while a frame is merged. A plan that was interrupted has not made its folder.
fn frame_lock(farm: &Farm, frame_index: usize) -> Result<PathBuf> {
    let folder = farm.frame_folder(frame_index);
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(farm.frame_lock(frame_index))
}

fn absolute(folder: &Path) -> Result<PathBuf> {
    folder.canonicalize().with_context(|| format!("{}", folder.display()))
}
