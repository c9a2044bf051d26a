//! Keeping the film of a render safe: checkpoints while it runs, where it starts from in `start`, and who
//! else watches it in `watch`.

mod start;
mod watch;

pub(super) use start::{CheckpointArguments, DEFAULT_CHECKPOINT_SECONDS, SeedsSoFar, Start, fit_in};
pub(super) use watch::Watch;

use super::words::count;
use fechner::adaptive::state::RenderState;
use fechner::checkpoint::{Header, write_checkpoint};
use fechner::output::OutputError;
use fechner::poison::Unpoisoned as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Writes the film's file so often that a kill never costs more than was agreed.
pub(super) struct Keeper {
    path: PathBuf,
    every: Duration,
    header: Header,
    seeds: SeedsSoFar,
    /// Samples traced since the last chance.
    traced: AtomicU64,
    history: Mutex<History>,
}

/// Intervals from which on the tracer's own batches, of seconds, come often enough.
const LONG_INTERVAL: Duration = Duration::from_secs(30);
/// Fewest samples of a batch: a tenth of a second of slow ones.
const MIN_BATCH: u64 = 1 << 12;
/// Batches take so many times what it takes to write the film, or all of the time is spent in writing it.
const WRITES_PER_BATCH: f64 = 4.0;
/// Batches in an interval, so that films are kept when it ends. Measured with the tracer's own batches: films that are
/// to be kept every second are kept every 2 to 4.
const BATCHES_AN_INTERVAL: f64 = 8.0;

/// What was written so far, and how long it took.
struct History {
    last_snapshot: Instant,
    last_chance: Instant,
    /// When what is being traced began to be.
    batch_began: Instant,
    /// Samples a second in the last batch.
    samples_a_second: Option<f64>,
    longest_wait: Duration,
    longest_write: Duration,
    writing: Duration,
    writes: u32,
    bytes: u64,
    failure: Option<OutputError>,
}

impl Keeper {
    /// One that keeps a render's film in a file, every so often.
    pub(super) fn new(path: &Path, every: Duration, header: Header, seeds: SeedsSoFar) -> Self {
        let now = Instant::now();
        Self {
            path: path.to_owned(),
            every,
            header,
            seeds,
            traced: AtomicU64::new(0),
            history: Mutex::new(History {
                last_snapshot: now,
                last_chance: now,
                batch_began: now,
                samples_a_second: None,
                longest_wait: Duration::ZERO,
                longest_write: Duration::ZERO,
                writing: Duration::ZERO,
                writes: 0,
                bytes: 0,
                failure: None,
            }),
        }
    }

    /// While a plan is traced, from any thread.
    fn samples_done(&self, samples: u64) {
        self.traced.fetch_add(samples, Ordering::Relaxed);
    }

    /// Most samples until the next chance.
    fn most_samples_a_batch(&self) -> u64 {
        if self.every >= LONG_INTERVAL {
            return u64::MAX;
        }
        let history = self.history.lock().unpoisoned();
        let seconds_of_interval = self.every.as_secs_f64() / BATCHES_AN_INTERVAL;
        let seconds = seconds_of_interval.max(WRITES_PER_BATCH * history.longest_write.as_secs_f64());
        let of_pace = |pace: f64| (pace * seconds) as u64;
        history.samples_a_second.map_or(MIN_BATCH, of_pace).max(MIN_BATCH)
    }

    /// After a look, which is no part of a batch.
    fn looked(&self) {
        self.traced.store(0, Ordering::Relaxed);
        self.history.lock().unpoisoned().batch_began = Instant::now();
    }

    /// Writes if waiting for the next chance could lose too much: the longest wait and the longest write so far are
    /// counted in, since a kill in the middle of writing leaves the file before. They count for half the interval at
    /// most: a look or an audit that once took longer must not make every batch write.
    fn chance(&self, state: &RenderState) {
        let mut history = self.history.lock().unpoisoned();
        let seconds = history.batch_began.elapsed().as_secs_f64().max(1e-6);
        history.samples_a_second = Some(self.traced.swap(0, Ordering::Relaxed) as f64 / seconds);
        history.longest_wait = history.longest_wait.max(history.last_chance.elapsed());
        let reserve = (history.longest_wait + history.longest_write).min(self.every / 2);
        if history.last_snapshot.elapsed() + reserve >= self.every {
            self.write(state, &mut history);
            if let Some(error) = &history.failure {
                say!("note: {error}; rendering goes on");
            }
        }
        history.last_chance = Instant::now();
        history.batch_began = history.last_chance;
    }

    /// Writes the last state.
    fn ended(&self, state: &RenderState) {
        self.write(state, &mut self.history.lock().unpoisoned());
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

    /// Says what keeping the film took of the `whole` time.
    ///
    /// # Errors
    /// If its last state could not be written.
    fn report(self, whole: Duration) -> anyhow::Result<()> {
        let history = self.history.into_inner().unpoisoned();
        if let Some(error) = history.failure {
            return Err(error.into());
        }
        say!(
            "Checkpoint {}: {:.1} MB, written {} in {:.2} s, {:.1} % of the time.",
            self.path.display(),
            history.bytes as f64 / 1e6,
            count(history.writes as usize, "time"),
            history.writing.as_secs_f64(),
            100.0 * history.writing.as_secs_f64() / whole.as_secs_f64()
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::console::Console;
    use fechner::adaptive::Monitor as _;
    use fechner::adaptive::settings::Limits;
    use fechner::checkpoint::{Origin, SettingsRecord, Tracing, read_checkpoint};
    use fechner::integrator::TraceSettings;
    use fechner::scene::hash::ContentHash;
    use fechner_perception::display::Viewing;
    use std::sync::Arc;

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
        Header::begun(origin, 0, SettingsRecord::new(Viewing::default(), 1.0, ""), 1.0)
    }

    /// Samples outlive a look that fails.
    #[test]
    fn what_fails_is_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let film = folder.path().join("film");
        let keeper = Keeper::new(&film, EVERY, header(), SeedsSoFar::of_one(0));
        let watch = Watch::new(Arc::default(), Console::new(None), Some(keeper), None, None);
        watch.failed(&RenderState::new(1, 1, &Limits::of_visibility(1.0)));
        read_checkpoint(&film).expect("kept");
    }

    /// Where a film is kept often, a batch is an eighth of the interval, or four times what writing takes; where it
    /// is not, the tracer's own.
    #[test]
    fn batches_are_short_where_a_film_is_kept_often() {
        let folder = tempfile::tempdir().expect("a folder");
        let of = |every: Duration| Keeper::new(&folder.path().join("film"), every, header(), SeedsSoFar::of_one(0));
        let often = of(Duration::from_secs(16));
        assert_eq!((often.most_samples_a_batch(), of(EVERY).most_samples_a_batch()), (MIN_BATCH, u64::MAX));
        let tell = |pace: f64, longest_write: Duration| {
            let mut history = often.history.lock().expect("one thread");
            (history.samples_a_second, history.longest_write) = (Some(pace), longest_write);
        };
        for (pace, write_seconds, samples) in [(1e6, 0, 2_000_000), (1e6, 3, 12_000_000), (10.0, 0, MIN_BATCH)] {
            tell(pace, Duration::from_secs(write_seconds));
            assert_eq!(often.most_samples_a_batch(), samples);
        }
        often.samples_done(1000);
        std::thread::sleep(Duration::from_millis(2));
        often.chance(&RenderState::new(1, 1, &Limits::of_visibility(1.0)));
        let pace = often.history.lock().expect("one thread").samples_a_second.expect("was measured");
        assert!(pace > 0.0 && pace <= 500_000.0, "a thousand in two milliseconds or more: {pace}");
    }

    /// What cannot be written is tried again as often as it would have been written, and not at every batch.
    #[test]
    fn a_failure_is_no_reason_to_hurry() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut keeper = Keeper::new(&folder.path().join("gone/film"), EVERY, header(), SeedsSoFar::of_one(0));
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
