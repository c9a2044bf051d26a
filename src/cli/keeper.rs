//! Keeping the film of a render safe: checkpoints while it runs, and a clean end when a signal asks for it.

use super::claim::Claim;
use super::console::Console;
use super::numbers::parse_seconds;
use super::report::Interrupter;
use super::tev::Showing;
use super::words::rounded;
use anyhow::bail;
use clap::Args;
use fechner::adaptive::judge::Judgement;
use fechner::adaptive::settings::LoopSettings;
use fechner::adaptive::state::RenderState;
use fechner::adaptive::{Directive, Monitor, Progress, StopReason};
use fechner::checkpoint::{
    Checkpoint, CheckpointError, Header, Origin, Seeds, SettingsRecord, read_checkpoint, read_header, write_checkpoint,
};
use fechner::film::Film;
use fechner::output::{self, OutputError};
use fechner::preview::Audience;
use fechner_perception::tone::SavedTone;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Arguments of `render` about its film's file.
#[derive(Debug, Args)]
pub(super) struct CheckpointArguments {
    /// Keep all samples in this file while rendering, for --resume and `fechner merge`.
    #[arg(long, value_name = "FILE", help_heading = "Running")]
    checkpoint: Option<PathBuf>,
    /// Seconds of work that a kill may cost at most [default: 60].
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, requires = "checkpoint", allow_negative_numbers = true, help_heading = "Running")]
    checkpoint_every: Option<Duration>,
    /// Go on from the checkpoint, if it is there; limits count from the first start.
    #[arg(long, requires = "checkpoint", help_heading = "Running")]
    resume: bool,
}

/// Where a render starts or goes on.
pub(super) struct Start {
    pub(super) header: Header,
    pub(super) state: RenderState,
    /// Of the film as it is, before anything is added to it.
    pub(super) seeds: SeedsSoFar,
}

/// Whose samples a film holds: those of the render's own seed once there is one.
#[derive(Clone)]
pub(super) struct SeedsSoFar {
    before: Seeds,
    rays_before: u64,
    own: Seeds,
}

impl SeedsSoFar {
    /// Of a render that begins with nothing.
    pub(super) fn of_one(seed: u64) -> Self {
        Self { before: Seeds::one(seed), rays_before: 0, own: Seeds::one(seed) }
    }

    /// The seeds of the film as it is now.
    pub(super) fn of(&self, film: &Film) -> &Seeds {
        if film.rays == self.rays_before { &self.before } else { &self.own }
    }
}

impl CheckpointArguments {
    /// The file that is asked for.
    pub(super) fn file(&self) -> Option<&Path> {
        self.checkpoint.as_deref()
    }

    /// Whether there is to be a file.
    pub(super) fn is_wanted(&self) -> bool {
        self.checkpoint.is_some()
    }

    /// Finds out whether the file can be written before the work is done, and refuses to write over the work of others, done or under
    /// way. The claim lasts as long as the file is written.
    pub(super) fn claim(&self) -> anyhow::Result<Option<Claim>> {
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

    /// How the operator was fitted to the whole in the film that a render of this origin goes on from, seen as this one is: finding it anew takes
    /// seconds.
    pub(super) fn kept_fit(&self, origin: &Origin, record: &SettingsRecord) -> Option<SavedTone> {
        let path = self.checkpoint.as_ref().filter(|_| self.resume)?;
        fit_in(path, origin, record)
    }

    /// The state to start from: `fresh`, or what the file holds if it fits `header`.
    pub(super) fn start(&self, header: Header, fresh: RenderState, settings: &LoopSettings) -> anyhow::Result<Start> {
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
        let seeds = SeedsSoFar { before: found.seeds, rays_before: state.film.rays, own: own.clone() };
        Ok(Start { header: Header { seeds: own, earlier_visibilities, ..header }, state, seeds })
    }
}

/// How the operator is fitted in a film of this origin that is seen as `record` says. What is wrong with the file is for others to say.
pub(super) fn fit_in(film: &Path, origin: &Origin, record: &SettingsRecord) -> Option<SavedTone> {
    let found = read_header(film).ok()?;
    let of_same = SettingsRecord { fitted: None, ..found.settings.clone() };
    let is_same = found.origin.difference(origin).is_none() && of_same.is_seen_like(record);
    found.settings.fitted.filter(|_| is_same)
}

/// From the beginning.
fn begun(header: Header, state: RenderState) -> Start {
    let seeds = SeedsSoFar { before: header.seeds.clone(), rays_before: state.film.rays, own: header.seeds.clone() };
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

/// Writes the film's file so often that a kill never costs more than was agreed.
pub(super) struct Keeper {
    path: PathBuf,
    every: Duration,
    header: Header,
    seeds: SeedsSoFar,
    history: Mutex<History>,
}

/// What was written so far, and how long it took.
struct History {
    last_snapshot: Instant,
    last_chance: Instant,
    longest_wait: Duration,
    longest_write: Duration,
    writing: Duration,
    writes: u32,
    bytes: u64,
    failure: Option<OutputError>,
}

impl Keeper {
    pub(super) fn new(arguments: &CheckpointArguments, header: Header, seeds: SeedsSoFar) -> Self {
        let now = Instant::now();
        Self {
            path: arguments.checkpoint.clone().unwrap_or_default(),
            every: arguments.checkpoint_every.unwrap_or(Duration::from_secs(60)),
            header,
            seeds,
            history: Mutex::new(History {
                last_snapshot: now,
                last_chance: now,
                longest_wait: Duration::ZERO,
                longest_write: Duration::ZERO,
                writing: Duration::ZERO,
                writes: 0,
                bytes: 0,
                failure: None,
            }),
        }
    }

    /// Writes if waiting for the next chance could lose too much: the longest wait and the longest write so far are
    /// counted in, since a kill in the middle of writing leaves the file before. They count for half the interval at
    /// most: a look or an audit that once took longer must not make every batch write.
    fn chance(&self, state: &RenderState) {
        let mut history = self.history.lock().unwrap_or_else(PoisonError::into_inner);
        history.longest_wait = history.longest_wait.max(history.last_chance.elapsed());
        let reserve = (history.longest_wait + history.longest_write).min(self.every / 2);
        if history.last_snapshot.elapsed() + reserve >= self.every {
            self.write(state, &mut history);
            if let Some(error) = &history.failure {
                say!("note: {error}; rendering goes on");
            }
        }
        history.last_chance = Instant::now();
    }

    /// Writes the last state.
    fn ended(&self, state: &RenderState) {
        self.write(state, &mut self.history.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// A file that cannot be written must not end a render of hours: it is told at once and again at the end.
    fn write(&self, state: &RenderState, history: &mut History) {
        let snapshot = Instant::now();
        let header = Header { seeds: self.seeds.of(&state.film).clone(), ..self.header.clone() };
        // Tried again when it is time to, written or not: a folder that is gone is gone for the next batch as well.
        history.last_snapshot = snapshot;
        match write_checkpoint(&self.path, &header, state) {
            Ok(bytes) => {
                history.failure = None;
                history.bytes = bytes;
                history.writes += 1;
            }
            Err(error) => history.failure = Some(error),
        }
        history.longest_write = history.longest_write.max(snapshot.elapsed());
        history.writing += snapshot.elapsed();
    }
}

/// Console, keeper, viewers, tev and signals together.
pub(super) struct Watch<'a> {
    console: Console,
    keeper: Option<Keeper>,
    audience: Option<Audience<'a>>,
    tev: Option<Showing>,
    stop: Arc<AtomicBool>,
    started: Instant,
}

impl<'a> Watch<'a> {
    /// `stop`: what signals set, of [`super::signals::listen`].
    pub(super) fn new(
        stop: Arc<AtomicBool>,
        console: Console,
        keeper: Option<Keeper>,
        audience: Option<Audience<'a>>,
        tev: Option<Showing>,
    ) -> Self {
        Self { console, keeper, audience, tev, stop, started: Instant::now() }
    }

    /// Whether a signal asked for the end.
    fn is_asked_to_end(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Who ended a render that was interrupted.
    pub(super) fn interrupter(&self) -> Interrupter {
        if self.is_asked_to_end() { Interrupter::Signal } else { Interrupter::Viewer }
    }

    /// Removes the progress bar.
    pub(super) fn finish(&self) {
        self.console.finish();
    }

    /// Says what keeping the film took.
    ///
    /// # Errors
    /// If its last state could not be written.
    pub(super) fn report(self) -> anyhow::Result<()> {
        let Some(Keeper { path, history, .. }) = self.keeper else { return Ok(()) };
        let history = history.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(error) = history.failure {
            return Err(error.into());
        }
        say!(
            "Checkpoint {}: {:.1} MB, written {} times in {:.2} s, {:.1} % of the time.",
            path.display(),
            history.bytes as f64 / 1e6,
            history.writes,
            history.writing.as_secs_f64(),
            100.0 * history.writing.as_secs_f64() / self.started.elapsed().as_secs_f64()
        );
        Ok(())
    }
}

impl Monitor for Watch<'_> {
    fn looked(&self, progress: &Progress) {
        self.console.looked(progress);
        if let Some(audience) = &self.audience {
            audience.looked(progress);
        }
    }

    fn judged(&self, state: &RenderState, judgement: &Judgement) {
        if let Some(audience) = &self.audience {
            audience.judged(state, judgement);
        }
        if let Some(tev) = &self.tev {
            tev.judged(judgement);
        }
    }

    fn samples_done(&self, samples: u64) {
        self.console.samples_done(samples);
        if let Some(audience) = &self.audience {
            audience.samples_done(samples);
        }
    }

    fn most_samples_a_batch(&self) -> u64 {
        self.audience.as_ref().map_or(u64::MAX, Audience::most_samples_a_batch)
    }

    fn between_batches(&self, state: &RenderState) -> Directive {
        if self.is_asked_to_end() {
            return Directive::Stop;
        }
        if let Some(keeper) = &self.keeper {
            keeper.chance(state);
        }
        if let Some(tev) = &self.tev {
            tev.between_batches(state);
        }
        self.audience.as_ref().map_or(Directive::GoOn, |audience| audience.between_batches(state))
    }

    fn ended(&self, state: &RenderState, reason: StopReason) {
        if let Some(audience) = &self.audience {
            audience.ended(state, reason);
        }
        if let Some(tev) = &self.tev {
            tev.ended(state);
        }
        if let Some(keeper) = &self.keeper {
            keeper.ended(state);
        }
    }

    fn failed(&self, state: &RenderState) {
        if let Some(keeper) = &self.keeper {
            keeper.ended(state);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner::adaptive::settings::{AllocationRule, Limits, Sampling};
    use fechner::checkpoint::Tracing;
    use fechner::integrator::TraceSettings;
    use fechner::scene::hash::ContentHash;
    use fechner_perception::display::Viewing;

    const EVERY: Duration = Duration::from_secs(60);

    fn header() -> Header {
        let origin = Origin {
            program: String::new(),
            scene_name: String::new(),
            scene: ContentHash::of_bytes(b""),
            width: 1,
            height: 1,
            tracing: Tracing::of(&TraceSettings::new(1, 1, 0)),
        };
        let settings = SettingsRecord {
            sampling: Sampling::Uniform,
            allocation: AllocationRule::default(),
            model: String::new(),
            viewing: Viewing::default(),
            nits_per_unit: 1.0,
            operator: String::new(),
            exposure_stops: None,
            fitted: None,
            frames: None,
            gazes: Vec::new(),
            importance: None,
            denoiser: None,
        };
        Header::begun(origin, 0, settings, 1.0)
    }

    /// Samples outlive a look that fails.
    #[test]
    fn what_fails_is_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let film = folder.path().join("film");
        let arguments =
            CheckpointArguments { checkpoint: Some(film.clone()), checkpoint_every: Some(EVERY), resume: false };
        let keeper = Keeper::new(&arguments, header(), SeedsSoFar::of_one(0));
        let watch = Watch::new(Arc::default(), Console::new(None), Some(keeper), None, None);
        watch.failed(&RenderState::new(1, 1, &Limits::of_visibility(1.0)));
        read_checkpoint(&film).expect("kept");
    }

    /// What cannot be written is tried again as often as it would have been written, and not at every batch.
    #[test]
    fn a_failure_is_no_reason_to_hurry() {
        let folder = tempfile::tempdir().expect("a folder");
        let arguments = CheckpointArguments {
            checkpoint: Some(folder.path().join("gone/film")),
            checkpoint_every: Some(EVERY),
            resume: false,
        };
        let mut keeper = Keeper::new(&arguments, header(), SeedsSoFar::of_one(0));
        let state = RenderState::new(1, 1, &Limits::of_visibility(1.0));
        let tried_at = |keeper: &Keeper| keeper.history.lock().expect("one thread").last_snapshot;
        // Whether it was tried.
        let fails = |keeper: &Keeper| {
            keeper.chance(&state);
            keeper.history.lock().expect("one thread").failure.take().is_some()
        };
        let began = tried_at(&keeper);
        assert!(!fails(&keeper), "it is not time to");
        keeper.every = Duration::ZERO;
        assert!(fails(&keeper), "it is time to, and the folder is not there");
        keeper.every = EVERY;
        assert!(tried_at(&keeper) > began, "a minute begins anew");
        assert!(!fails(&keeper), "it is tried again at once");
    }
}
