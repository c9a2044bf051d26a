//! Where a render starts: from nothing, or from the film that a checkpoint holds.

use crate::cli::claim::Claim;
use crate::cli::numbers::parse_seconds;
use crate::cli::report::sampling_name;
use crate::cli::words::rounded;
use anyhow::bail;
use clap::Args;
use fechner::adaptive::settings::{LoopSettings, Sampling};
use fechner::adaptive::state::RenderState;
use fechner::checkpoint::{
    Checkpoint, CheckpointError, Header, Origin, Seeds, SettingsRecord, read_checkpoint, read_header,
};
use fechner::film::Film;
use fechner::output;
use fechner_perception::tone::SavedTone;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What `--checkpoint-every` is where it is not given.
pub(in crate::cli) const DEFAULT_CHECKPOINT_SECONDS: &str = "60";

/// Arguments of `render` about its film's file.
#[derive(Debug, Args)]
pub(in crate::cli) struct CheckpointArguments {
    /// Keep all samples in this file while rendering, for --resume and `fechner merge`.
    #[arg(long, value_name = "FILE", help_heading = "Running")]
    pub(super) checkpoint: Option<PathBuf>,
    /// Seconds of work that a kill may cost at most.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, requires = "checkpoint", allow_negative_numbers = true, default_value = DEFAULT_CHECKPOINT_SECONDS, help_heading = "Running")]
    pub(super) checkpoint_every: Duration,
    /// Go on from the checkpoint, if it is there; limits count from the first start.
    #[arg(long, requires = "checkpoint", help_heading = "Running")]
    pub(super) resume: bool,
}

/// Where a render starts or goes on.
pub(in crate::cli) struct Start {
    pub(in crate::cli) header: Header,
    pub(in crate::cli) state: RenderState,
    /// Seeds of the film as it is, before anything is added to it.
    pub(in crate::cli) seeds: SeedsSoFar,
}

/// Whose samples a film holds: those of the render's own seed once there is one.
#[derive(Clone)]
pub(in crate::cli) struct SeedsSoFar {
    before: Seeds,
    samples_before: u64,
    own: Seeds,
}

impl SeedsSoFar {
    /// Seeds of a render that begins with nothing.
    pub(in crate::cli) fn of_one(seed: u64) -> Self {
        Self { before: Seeds::one(seed), samples_before: 0, own: Seeds::one(seed) }
    }

    /// The seeds of the film as it is now.
    pub(in crate::cli) fn of(&self, film: &Film) -> &Seeds {
        let holds_own_samples = film.total_samples() != self.samples_before;
        if holds_own_samples { &self.own } else { &self.before }
    }
}

impl CheckpointArguments {
    /// The file that is asked for.
    pub(in crate::cli) fn file(&self) -> Option<&Path> {
        self.checkpoint.as_deref()
    }

    /// Time between two of its states.
    pub(in crate::cli) fn every(&self) -> Duration {
        self.checkpoint_every
    }

    /// Whether there is to be a file.
    pub(in crate::cli) fn is_wanted(&self) -> bool {
        self.checkpoint.is_some()
    }

    /// Finds out whether the file can be written before the work is done, and refuses to write over the work of others,
    /// done or under way. The claim lasts as long as the file is written.
    pub(in crate::cli) fn claim(&self) -> anyhow::Result<Option<Claim>> {
        let Some(path) = &self.checkpoint else { return Ok(None) };
        output::check_writable(path)?;
        let claim = Claim::on(path)?;
        if path.exists() && !self.resume {
            bail!(
                "{} is there already: go on with it by --resume, name another --checkpoint, or remove it",
                path.display()
            );
        }
        Ok(Some(claim))
    }

    /// How the operator was fitted to the whole in the film that a render of this origin goes on from, seen as this one
    /// is: finding it anew takes seconds.
    pub(in crate::cli) fn kept_fit(&self, origin: &Origin, record: &SettingsRecord) -> Option<SavedTone> {
        let path = self.checkpoint.as_ref().filter(|_| self.resume)?;
        fit_in(path, origin, record)
    }

    /// The state to start from: `fresh`, or what the file holds if it fits `header`.
    pub(in crate::cli) fn start(
        &self,
        header: Header,
        fresh: RenderState,
        settings: &LoopSettings,
    ) -> anyhow::Result<Start> {
        let Some(path) = self.checkpoint.as_ref().filter(|_| self.resume) else {
            return Ok(begun(header, fresh));
        };
        if !path.exists() {
            say!("note: {} is not there yet: starting from the beginning", path.display());
            return Ok(begun(header, fresh));
        }
        let Checkpoint { header: found, state } = read_checkpoint(path)?;
        let different = |problem| CheckpointError::Different { path: path.clone(), problem };
        if let Some(problem) = found.origin.difference(&header.origin) {
            return Err(different(problem).into());
        }
        let [seed] = header.seeds.all[..] else { bail!("a render has one seed") };
        let own = found.seeds.continued_by(seed).map_err(different)?;
        if let Some(problem) = spread_otherwise(found.settings.sampling, header.settings.sampling, &state.film) {
            return Err(different(problem).into());
        }
        let mut earlier_visibilities = Vec::new();
        let state = if found.settings != header.settings {
            say!("note: the film was sampled by other settings: its samples are kept, its ladder begins anew");
            // Other eyes: what audits found of these samples' visible energy does not hold for them.
            RenderState { inflation: 1.0, ..state.begun_anew(&settings.limits) }
        } else if found.seeds.current.is_none() {
            state.begun_anew(&settings.limits)
        } else {
            earlier_visibilities = with_aim(found.earlier_visibilities, found.visibility);
            if let Some(&aside) = earlier_visibilities.iter().find(|&&aim| !settings.ladder_passes_through(aim)) {
                note_other_way(aside, settings);
            }
            state
        };
        let seeds = SeedsSoFar { before: found.seeds, samples_before: state.film.total_samples(), own: own.clone() };
        Ok(Start { header: Header { seeds: own, earlier_visibilities, ..header }, state, seeds })
    }
}

/// What keeps a film whose samples were spread by one rule from going on by another: its counts stay, and would be
/// called the other's. By sight any film goes on.
fn spread_otherwise(found: Sampling, asked: Sampling, film: &Film) -> Option<String> {
    let [its, this] = [found, asked].map(sampling_name);
    let counts = (0..film.pixel_count()).map(|pixel| film.samples(pixel));
    let (least, most) = (counts.clone().min()?, counts.max()?);
    (asked != Sampling::Adaptive && its != this && least < most).then(|| {
        format!(
            "its pixels have {least} to {most} samples by --sampling {its}, which --sampling {this} did not choose: go on by \
             {its}, or begin another --checkpoint"
        )
    })
}

/// How the operator is fitted in a film of this origin that is seen as `record` says. What is wrong with the
/// file is for others to say.
pub(in crate::cli) fn fit_in(film: &Path, origin: &Origin, record: &SettingsRecord) -> Option<SavedTone> {
    let found = read_header(film).ok()?;
    let of_same = SettingsRecord { fitted: None, ..found.settings.clone() };
    let is_same = found.origin.difference(origin).is_none() && of_same.is_seen_like(record);
    found.settings.fitted.filter(|_| is_same)
}

/// From the beginning.
fn begun(header: Header, state: RenderState) -> Start {
    let seeds = SeedsSoFar {
        before: header.seeds.clone(),
        samples_before: state.film.total_samples(),
        own: header.seeds.clone(),
    };
    Start { header, state, seeds }
}

/// All aims of a film, each once: one that left the ladder stays beside it, wherever it goes from there.
fn with_aim(mut earlier: Vec<f64>, last: f64) -> Vec<f64> {
    if !earlier.contains(&last) {
        earlier.push(last);
    }
    earlier
}

/// Says where going on may not give what one go would: rungs that only one of the two passes leave other counts.
fn note_other_way(aimed_at: f64, settings: &LoopSettings) {
    say!(
        "note: the film aimed at visibility {}, which a render to {} does not pass: the picture may not have the bytes of one in one go",
        rounded(aimed_at),
        rounded(settings.limits.last_rung())
    );
}
