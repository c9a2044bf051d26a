//! `farm unit`: executes orders, and decides nothing.

use super::job::{Job, JobOptions};
use super::signals::Signals;
use super::{CALL_AGAIN, Threads, open_for_work};
use crate::cli::console::duration_in_words;
use crate::cli::keeper::DEFAULT_CHECKPOINT_SECONDS;
use crate::cli::numbers::parse_seconds;
use crate::cli::words::{count, listed, samples_in_words};
use anyhow::{Context, Result, bail};
use clap::Args;
use fechner::farm::frame::{FrameState, progress};
use fechner::farm::unit::{Keeping, NamedOrder, Outcome, UnitError, UnitSums, render_unit};
use fechner::farm::{Farm, UnitPlace, frame};
use fechner::integrator::PathTracer;
use fechner::json_file;
use fechner::lock::{Lock, try_lock, wait_for_lock};
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Arguments of `farm unit`.
#[derive(Debug, Args)]
pub(super) struct UnitArguments {
    /// The farm's folder.
    folder: PathBuf,
    /// Numbers of the units.
    #[arg(required = true, value_name = "N", allow_negative_numbers = true)]
    units: Vec<u64>,
    #[command(flatten)]
    keeping: KeepingArguments,
    #[command(flatten)]
    threads: Threads,
}

/// How much a kill may cost.
#[derive(Debug, Args)]
pub(super) struct KeepingArguments {
    /// Seconds of work that a kill may cost.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, allow_negative_numbers = true, default_value = DEFAULT_CHECKPOINT_SECONDS)]
    checkpoint_every: Duration,
}

/// What to do about a unit that another process renders.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum IfBusy {
    Wait,
    Skip,
}

/// How it went with a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum UnitOutcome {
    /// Rendered here and now.
    Rendered,
    /// Nothing was to be done.
    WasThere,
    /// Another process has it, or has merged it as this one looked.
    Busy,
    /// A signal ended it; its checkpoint is there.
    Left,
    /// Its order was damaged or lost; the next merge writes it again.
    HasNoOrder,
}

/// Where a unit's round is.
enum Standing {
    Open,
    Merged,
    /// It was never handed out, or is cleared away; in words.
    Unknown(String),
}

/// Renders units of one farm, and keeps the last scene that it loaded.
pub(super) struct Worker<'a> {
    pub(super) farm: &'a Farm,
    pub(super) job: &'a Job<'a>,
    pub(super) signals: &'a Signals,
    pub(super) every: Duration,
    loaded: Option<(usize, PathTracer)>,
}

/// Renders what was asked for.
pub(super) fn run(arguments: &UnitArguments) -> Result<ExitCode> {
    Worker::with(&arguments.folder, &arguments.keeping, &arguments.threads, |mut worker| {
        for &unit in &arguments.units {
            match worker.render(unit, IfBusy::Wait)? {
                UnitOutcome::Rendered | UnitOutcome::WasThere => {}
                UnitOutcome::Left | UnitOutcome::Busy => return Ok(ExitCode::from(CALL_AGAIN)),
                UnitOutcome::HasNoOrder => bail!("unit {unit} has no order: fechner farm merge writes it again"),
            }
        }
        Ok(ExitCode::SUCCESS)
    })
}

/// Plans that a finished frame took, by its figures: rounds are numbered by the plans before them.
fn plans_of_finished(farm: &Farm, frame_index: usize) -> Option<u32> {
    let figures: serde_json::Value = json_file::read(&farm.result(frame_index))?;
    figures["plans"].as_u64()?.try_into().ok()
}

impl<'a> Worker<'a> {
    /// Calls `work` with a worker of the farm in a folder, in a pool of so many threads.
    pub(super) fn with(
        folder: &Path,
        keeping: &KeepingArguments,
        threads: &Threads,
        work: impl FnOnce(Worker<'_>) -> Result<ExitCode> + Send,
    ) -> Result<ExitCode> {
        let farm = open_for_work(folder)?;
        let signals = Signals::listen()?;
        let every = keeping.checkpoint_every;
        threads.pool()?.install(|| {
            let options = JobOptions::of(&farm)?;
            let job = options.job()?;
            work(Worker { farm: &farm, job: &job, signals: &signals, every, loaded: None })
        })
    }

    /// Renders a unit, unless its result is there.
    pub(super) fn render(&mut self, unit: u64, if_busy: IfBusy) -> Result<UnitOutcome> {
        match self.standing(unit) {
            Standing::Open => {}
            Standing::Merged => {
                say!("unit {unit}: is merged");
                return Ok(UnitOutcome::WasThere);
            }
            Standing::Unknown(_) if if_busy == IfBusy::Skip => return Ok(UnitOutcome::Busy),
            Standing::Unknown(problem) => bail!("unit {unit} is not planned: {problem}"),
        }
        let lock = match self.lock(unit, if_busy) {
            Ok(Some(lock)) => lock,
            Ok(None) => return Ok(if self.signals.leaves() { UnitOutcome::Left } else { UnitOutcome::Busy }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                say!("unit {unit}: was merged meanwhile");
                return Ok(UnitOutcome::WasThere);
            }
            Err(error) => return Err(error).with_context(|| format!("the lock of unit {unit}")),
        };
        let went = self.render_locked(unit);
        drop(lock);
        match went {
            // Another process had it as well, and its result was merged.
            Err(error) => match self.standing(unit) {
                Standing::Merged => Ok(UnitOutcome::WasThere),
                Standing::Unknown(_) if if_busy == IfBusy::Skip => Ok(UnitOutcome::Busy),
                Standing::Open | Standing::Unknown(_) => Err(error),
            },
            went => went,
        }
    }

    fn lock(&self, unit: u64, if_busy: IfBusy) -> io::Result<Option<Lock>> {
        let path = self.farm.unit_file(unit, "lock");
        match if_busy {
            IfBusy::Skip => try_lock(&path),
            IfBusy::Wait => wait_for_lock(&path, &|| self.signals.leaves()),
        }
    }

    fn standing(&self, unit: u64) -> Standing {
        let place = self.farm.place(unit);
        let number = self.farm.frame(place.frame_index).frame;
        let round = match progress(self.farm, place.frame_index) {
            FrameState::Done => return self.standing_when_done(place),
            FrameState::Open { round, .. } => Some(round),
            FrameState::ToMerge { round } => round,
        };
        let Some(round) = round else {
            return Standing::Unknown(format!("frame {number} has no round yet; fechner farm merge makes one"));
        };
        if round.round > place.round {
            Standing::Merged
        } else if round.units.iter().any(|planned| planned.unit == unit) {
            Standing::Open
        } else {
            let planned: Vec<u64> = round.units.iter().map(|planned| planned.unit).collect();
            let (round, planned) = (round.round, listed(&planned));
            Standing::Unknown(format!("frame {number} is in round {round}, whose units are {planned}"))
        }
    }

    /// Where a round of a finished frame is: merged, if the frame came so far.
    fn standing_when_done(&self, place: UnitPlace) -> Standing {
        match plans_of_finished(self.farm, place.frame_index) {
            Some(plans) if place.round >= plans => {
                let number = self.farm.frame(place.frame_index).frame;
                Standing::Unknown(format!("frame {number} is done, after {}", count(plans as usize, "plan")))
            }
            _ => Standing::Merged,
        }
    }

    fn render_locked(&mut self, unit: u64) -> Result<UnitOutcome> {
        let order = match NamedOrder::read(self.farm, unit) {
            Ok(order) => order,
            Err(error) => {
                self.refuse(&self.farm.unit_file(unit, "order"), &error);
                return Ok(UnitOutcome::HasNoOrder);
            }
        };
        if self.is_rendered(&order) {
            say!("unit {unit}: is there");
            return Ok(UnitOutcome::WasThere);
        }
        let begun = self.begun(&order);
        self.execute(&order, begun)
    }

    /// Whether a unit's result is there; one that is refused is put aside.
    fn is_rendered(&self, order: &NamedOrder) -> bool {
        let sums = self.farm.unit_file(order.order.unit, "sums");
        match UnitSums::read(&sums, order) {
            Ok(_) => return true,
            Err(error) if error.is_missing() => {}
            Err(error) => self.refuse(&sums, &error),
        }
        false
    }

    /// The sums of a unit's checkpoint, if there is one; one that is refused is put aside.
    fn begun(&self, order: &NamedOrder) -> Option<UnitSums> {
        let partial = self.farm.unit_file(order.order.unit, "partial");
        match UnitSums::read_beginning(&partial, order) {
            Ok(begun) => return Some(begun),
            Err(error) if error.is_missing() => {}
            Err(error) => self.refuse(&partial, &error),
        }
        None
    }

    /// Traces what is not begun of an order.
    fn execute(&mut self, order: &NamedOrder, begun: Option<UnitSums>) -> Result<UnitOutcome> {
        let unit = order.order.unit;
        let there = begun.as_ref().map_or(0, |begun| begun.sums.len());
        if there > 0 {
            say!("unit {unit}: goes on from its checkpoint, {there} of {}", count(order.order.blocks.len(), "block"));
        }
        let started = Instant::now();
        let Self { farm, signals, every, .. } = *self;
        let tracer = self.tracer(farm.place(unit).frame_index)?;
        let loaded = started.elapsed();
        let keeping = Keeping { every, wish: &|| signals.wish() };
        match render_unit(farm, order, begun, tracer, &keeping)? {
            Outcome::Left => {
                say!("unit {unit}: left by a signal; its checkpoint is there");
                Ok(UnitOutcome::Left)
            }
            Outcome::Finished => {
                say!(
                    "unit {unit}: frame {}, {} in {}, {} of it to load the scene",
                    order.order.frame,
                    samples_in_words(order.order.samples()),
                    duration_in_words(started.elapsed().as_secs_f64()),
                    duration_in_words(loaded.as_secs_f64())
                );
                Ok(UnitOutcome::Rendered)
            }
        }
    }

    fn refuse(&self, path: &std::path::Path, error: &UnitError) {
        say!("note: refused: {error}");
        frame::set_aside(path);
    }

    /// The frame's tracer: the last one, if it is of this frame.
    fn tracer(&mut self, frame_index: usize) -> Result<&PathTracer> {
        if self.loaded.as_ref().is_none_or(|(loaded, _)| *loaded != frame_index) {
            self.loaded = None;
            self.loaded = Some((frame_index, self.job.tracer(self.farm, frame_index)?));
        }
        self.loaded.as_ref().map(|(_, tracer)| tracer).context("a scene was loaded")
    }
}
