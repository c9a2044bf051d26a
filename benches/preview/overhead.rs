//! What watching costs: the same samples with and without viewers, by the clock.

use super::race::mean_and_error;
use super::watched::{Clock, Moment, Watched};
use super::{Arguments, Subject, least, one_thread, pool_of};
use anyhow::Result;
use fechner::adaptive::settings::{Limits, LoopSettings, Sampling};
use fechner::adaptive::{Monitor, Progress, render};
use std::sync::Mutex;

/// Samples a pixel at which renders end that are compared.
const SPP: u32 = 96;

/// Who renders, and how the two of a pair are timed.
#[derive(Clone, Copy)]
pub(super) enum Threads {
    /// By their own processor time, each on a core of its own at once: the machine's pace changes within seconds, by
    /// more than watching costs.
    One,
    /// By the wall's clock, one after the other in alternating order.
    Two,
}

impl Threads {
    fn pool(self) -> Result<rayon::ThreadPool> {
        match self {
            Self::One => one_thread(),
            Self::Two => pool_of(2),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::One => "On one thread",
            Self::Two => "On two threads, even samples",
        }
    }

    /// On two threads even, as looks take the same with viewers as without, and add the machine's pace.
    fn sampling(self) -> Sampling {
        match self {
            Self::One => Sampling::Adaptive,
            Self::Two => Sampling::Uniform,
        }
    }

    /// Where the steady part begins: two threads take twice the samples in a second.
    fn steady_from_seconds(self) -> f64 {
        match self {
            Self::One => 5.0,
            Self::Two => 2.0,
        }
    }
}

/// Prints what watching costs.
pub(super) fn overheads(subjects: &[Subject], arguments: &Arguments, threads: Threads) -> Result<()> {
    let (who, pairs, steady_from) = (threads.name(), arguments.seeds, threads.steady_from_seconds());
    println!("\n{who}, what watching costs, mean ± standard error over {pairs} pairs:\n");
    println!("| scene | render, s | watched preview, s | whole overhead | after the first {steady_from} s |");
    println!("| --- |{}", " --- |".repeat(4));
    for subject in subjects {
        let pairs = (0..pairs).map(|seed| Pair::measured(subject, seed, threads)).collect::<Result<Vec<_>>>()?;
        let whole: Vec<f64> = pairs.iter().map(|pair| (pair.preview_seconds() / pair.render_seconds()).ln()).collect();
        let steady: Vec<f64> = pairs.iter().filter_map(|pair| pair.ratio_after(steady_from)).map(f64::ln).collect();
        let name = subject.name;
        let (alone, watched) =
            (least(pairs.iter().map(Pair::render_seconds)), least(pairs.iter().map(Pair::preview_seconds)));
        println!("| {name} | {alone:.2} | {watched:.2} | {} | {} |", percent(&whole), percent(&steady));
    }
    Ok(())
}

fn percent(logarithms: &[f64]) -> String {
    let (mean, error) = mean_and_error(logarithms);
    if logarithms.is_empty() {
        "ended before".to_owned()
    } else {
        format!("{:+.1} ± {:.1} %", 100.0 * mean.exp_m1(), 100.0 * error)
    }
}

/// Notes how many samples were taken when.
struct Notes {
    clock: Clock,
    counts: Mutex<Vec<(u64, f64)>>,
}

impl Monitor for Notes {
    fn looked(&self, _: &Progress) {}

    fn samples_done(&self, samples: u64) {
        let now = self.clock.seconds();
        let mut counts = self.counts.lock().expect("nobody panics");
        let before = counts.last().map_or(0, |last| last.0);
        counts.push((before + samples, now));
    }
}

/// Seconds at which so many samples were there, by the nearest counts on both sides.
fn seconds_at(counts: &[(u64, f64)], samples: u64) -> f64 {
    let above = counts.partition_point(|count| count.0 < samples).clamp(1, counts.len() - 1);
    let [(low, from), (high, to)] = [counts[above - 1], counts[above]];
    from + (to - from) * (samples as f64 - low as f64) / ((high - low) as f64).max(1.0)
}

/// A render and a watched preview that take the same samples.
struct Pair {
    /// Samples and seconds of the render.
    counts: Vec<(u64, f64)>,
    moments: Vec<Moment>,
}

impl Pair {
    fn measured(subject: &Subject, seed: u64, threads: Threads) -> Result<Self> {
        let alone = || rendered(subject, seed, threads);
        let watched = || watched(subject, seed, threads);
        let (counts, moments) = match threads {
            Threads::One => std::thread::scope(|scope| {
                let render = scope.spawn(alone);
                let moments = watched()?;
                let counts = render.join().map_err(|_| anyhow::anyhow!("the render panicked"))??;
                anyhow::Ok((counts, moments))
            })?,
            Threads::Two if seed.is_multiple_of(2) => {
                let counts = alone()?;
                (counts, watched()?)
            }
            Threads::Two => {
                let moments = watched()?;
                (alone()?, moments)
            }
        };
        let [rendered, shown] = [counts.last().map(|end| end.0), moments.last().map(|end| end.samples)];
        anyhow::ensure!(rendered == shown, "the preview took another way");
        Ok(Self { counts, moments })
    }

    fn render_seconds(&self) -> f64 {
        self.counts.last().map_or(f64::NAN, |end| end.1)
    }

    fn preview_seconds(&self) -> f64 {
        self.moments.last().map_or(f64::NAN, |end| end.seconds)
    }

    /// Seconds of the preview over those of the render from the first whole frame after so many on.
    fn ratio_after(&self, seconds: f64) -> Option<f64> {
        let from = self.moments.iter().find(|moment| moment.step == 1 && moment.seconds > seconds)?;
        let of_render = self.render_seconds() - seconds_at(&self.counts, from.samples);
        Some((self.preview_seconds() - from.seconds) / of_render)
    }
}

fn limits() -> Limits {
    Limits { mean_samples: Some(SPP), ..Limits::of_visibility(1.0) }
}

/// Samples and seconds on the way of a render that nobody watches, from the loaded scene on.
fn rendered(subject: &Subject, seed: u64, threads: Threads) -> Result<Vec<(u64, f64)>> {
    let pool = threads.pool()?;
    let notes = Notes { clock: Clock::start(&pool), counts: Mutex::default() };
    pool.install(|| {
        let settings = LoopSettings { sampling: threads.sampling(), ..subject.loop_settings(limits())? };
        let rendered = render(&subject.tracer(seed), &settings, &notes)?;
        let seconds = notes.clock.seconds();
        let mut counts = notes.counts.into_inner().expect("nobody panics");
        counts.push((rendered.film.total_samples(), seconds));
        Ok(counts)
    })
}

/// Every frame of a watched preview, up to the last.
fn watched(subject: &Subject, seed: u64, threads: Threads) -> Result<Vec<Moment>> {
    let watched = Watched::start(threads.pool()?, subject.job(seed, limits(), threads.sampling()), false)?;
    watched.until(|moment| moment.is_at_rest)
}
