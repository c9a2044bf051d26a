//! What watching costs: the same samples with and without viewers, by the clock.

use super::race::mean_and_error;
use super::watched::{Moment, Watched};
use super::{Arguments, Subject, least, one_thread};
use crate::support::CpuClock;
use anyhow::Result;
use fechner::adaptive::settings::{Limits, LoopSettings, Sampling};
use fechner::adaptive::state::RenderState;
use fechner::adaptive::{Directive, Monitor, Progress, Quiet, render};
use std::sync::Mutex;
use std::time::Instant;

/// Samples a pixel at which renders end that are compared.
const SPP: u32 = 96;
/// The same on two threads: short, as the machine's pace changes between the two of a pair.
const SPP_ON_TWO_THREADS: u32 = 48;

/// Notes when the film had how many samples.
struct Notes {
    clock: CpuClock,
    counts: Mutex<Vec<(u64, f64)>>,
}

impl Monitor for Notes {
    fn looked(&self, _: &Progress) {}

    fn samples_done(&self, _: u64) {}

    fn most_samples_a_batch(&self) -> u64 {
        1 << 15
    }

    fn between_batches(&self, state: &RenderState) -> Directive {
        let now = self.clock.seconds();
        self.counts.lock().expect("nobody panics").push((state.film.total_samples(), now));
        Directive::GoOn
    }
}

/// Seconds at which so many samples were there, by the nearest counts on both sides.
fn seconds_at(counts: &[(u64, f64)], samples: u64) -> f64 {
    let above = counts.partition_point(|count| count.0 < samples).clamp(1, counts.len() - 1);
    let [(low, from), (high, to)] = [counts[above - 1], counts[above]];
    from + (to - from) * (samples as f64 - low as f64) / ((high - low) as f64).max(1.0)
}

pub(super) fn overheads(subjects: &[Subject], arguments: &Arguments) -> Result<()> {
    println!("\nWhat watching costs, mean ± standard error over {} pairs:\n", arguments.seeds);
    println!("| scene | render, s | watched preview, s | whole overhead | after the first 5 s |");
    println!("| --- |{}", " --- |".repeat(4));
    for subject in subjects {
        let (mut alone, mut watched, mut whole, mut steady) = (vec![], vec![], vec![], vec![]);
        for seed in 0..arguments.seeds {
            let pair = Pair::measured(subject, seed)?;
            let (render_seconds, preview_seconds) = (pair.render_seconds(), pair.preview_seconds());
            alone.push(render_seconds);
            watched.push(preview_seconds);
            whole.push((preview_seconds / render_seconds).ln());
            steady.extend(pair.ratio_after(5.0).map(f64::ln));
        }
        let (name, alone, watched) = (subject.name, least(alone), least(watched));
        println!("| {name} | {alone:.2} | {watched:.2} | {} | {} |", percent(&whole), percent(&steady));
    }
    Ok(())
}

/// A render and a watched preview that take the same samples.
struct Pair {
    /// Samples and seconds of the render.
    counts: Vec<(u64, f64)>,
    moments: Vec<Moment>,
}

impl Pair {
    /// Both at once, each on a core of its own: the machine's pace changes within seconds, by more than watching costs.
    fn measured(subject: &Subject, seed: u64) -> Result<Self> {
        let limits = Limits { mean_samples: Some(SPP), ..Limits::of_visibility(1.0) };
        let pair = std::thread::scope(|scope| {
            let render = scope.spawn(|| rendered(subject, seed, limits));
            let preview = Watched::start(one_thread()?, subject.job(seed, limits, Sampling::Adaptive), false)?;
            let moments = preview.until(|moment| moment.is_at_rest)?;
            let counts = render.join().map_err(|_| anyhow::anyhow!("the render panicked"))??;
            anyhow::Ok(Self { counts, moments })
        })?;
        let [rendered, shown] = [pair.counts.last().map(|end| end.0), pair.moments.last().map(|end| end.samples)];
        anyhow::ensure!(rendered == shown, "the preview took another way");
        Ok(pair)
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

/// Samples and seconds on the way of a render that nobody watches.
fn rendered(subject: &Subject, seed: u64, limits: Limits) -> Result<Vec<(u64, f64)>> {
    one_thread()?.install(|| {
        let notes = Notes { clock: CpuClock::of_thread(), counts: Mutex::default() };
        let settings = subject.loop_settings(limits)?;
        let rendered = render(&subject.tracer(seed), &settings, &notes)?;
        let seconds = notes.clock.seconds();
        let mut counts = notes.counts.into_inner().expect("nobody panics");
        counts.push((rendered.film.total_samples(), seconds));
        Ok(counts)
    })
}

fn percent(logarithms: &[f64]) -> String {
    let (mean, error) = mean_and_error(logarithms);
    if logarithms.is_empty() {
        "ended before".to_owned()
    } else {
        format!("{:+.1} ± {:.1} %", 100.0 * mean.exp_m1(), 100.0 * error)
    }
}

/// Even samples on all of two threads, by the wall's clock: nobody watching, and somebody who takes every frame.
pub(super) fn overheads_on_two_threads(subjects: &[Subject], arguments: &Arguments) -> Result<()> {
    println!("\nOn two threads, mean ± standard error over {} pairs in alternating order:\n", arguments.seeds);
    println!("| scene | render, s | watched preview, s | overhead |");
    println!("| --- |{}", " --- |".repeat(3));
    let limits = Limits { mean_samples: Some(SPP_ON_TWO_THREADS), ..Limits::of_visibility(1.0) };
    for subject in subjects {
        let (mut alone, mut watched) = (vec![], vec![]);
        for seed in 0..arguments.seeds {
            if seed % 2 == 0 {
                alone.push(alone_on_two_threads(subject, seed, limits)?);
            }
            watched.push(watched_on_two_threads(subject, seed, limits)?);
            if seed % 2 == 1 {
                alone.push(alone_on_two_threads(subject, seed, limits)?);
            }
        }
        let ratios: Vec<f64> = watched.iter().zip(&alone).map(|(watched, alone)| (watched / alone).ln()).collect();
        let (name, alone, watched) = (subject.name, least(alone), least(watched));
        println!("| {name} | {alone:.2} | {watched:.2} | {} |", percent(&ratios));
    }
    Ok(())
}

fn two_threads() -> Result<rayon::ThreadPool> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(2).build()?)
}

/// Seconds from the loaded scene to the last sample.
fn alone_on_two_threads(subject: &Subject, seed: u64, limits: Limits) -> Result<f64> {
    two_threads()?.install(|| {
        let begun = Instant::now();
        let settings = LoopSettings { sampling: Sampling::Uniform, ..subject.loop_settings(limits)? };
        render(&subject.tracer(seed), &settings, &Quiet)?;
        Ok(begun.elapsed().as_secs_f64())
    })
}

/// Seconds from the loaded scene to the last frame.
fn watched_on_two_threads(subject: &Subject, seed: u64, limits: Limits) -> Result<f64> {
    let watched = Watched::start(two_threads()?, subject.job(seed, limits, Sampling::Uniform), false)?;
    let moments = watched.until(|moment| moment.is_at_rest)?;
    Ok(moments.last().map_or(f64::NAN, |end| end.seconds))
}
