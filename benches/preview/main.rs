//! What a live preview costs and what it is worth: time to the first picture, samples a second beside a render that nobody
//! watches, and quality over the first seconds against uniform progressive rendering by the same tracer.
//!
//! `cargo bench --bench preview [-- first|overhead|race --size N --seconds S --seeds N --reference N]` prints the tables of
//! `benches/README.md`, or those that are named. Every arm renders on one thread, whose own processor time is the clock, so that
//! others' work on the machine counts only through caches; a browser's part is played by a WebSocket that takes every frame, on
//! another thread.

mod race;
#[path = "../support/mod.rs"]
mod support;
mod watched;

use anyhow::{Context, Result};
use fechner::adaptive::settings::{AllocationRule, Limits, LoopSettings, Sampling};
use fechner::adaptive::state::RenderState;
use fechner::adaptive::{Directive, Monitor, Progress, render};
use fechner::checkpoint::SettingsRecord;
use fechner::film::Film;
use fechner::integrator::{BlockWork, PathTracer, SamplePlan, TraceSettings};
use fechner::preview::Job;
use fechner::sampler::Half;
use fechner::scene::Scene;
use fechner::scene::load::{LoadOptions, load};
use fechner_perception::tone::operator;
use fechner_perception::{Display, Viewing};
use race::{mean_and_error, races};
use std::path::Path;
use std::sync::{Arc, Mutex};
use support::CpuClock;
use watched::{Moment, Watched};

const SCENES: [&str; 3] = ["cornell-box", "many-lights", "textured-room"];
/// Samples a pixel at which renders end that are compared by the clock.
const OVERHEAD_SPP: u32 = 96;

struct Arguments {
    size: u32,
    seconds: f64,
    seeds: u64,
    reference_spp: u32,
    /// Tables to print; all where none is named.
    tables: Vec<String>,
}

impl Arguments {
    fn read() -> Result<Self> {
        let words: Vec<String> = std::env::args().collect();
        let number = |name: &str, otherwise: f64| match words.iter().position(|word| word == name) {
            None => Ok(otherwise),
            Some(place) => words.get(place + 1).and_then(|word| word.parse().ok()).with_context(|| format!("{name} N")),
        };
        Ok(Self {
            size: number("--size", 192.0)? as u32,
            seconds: number("--seconds", 10.0)?,
            seeds: number("--seeds", 3.0)? as u64,
            reference_spp: number("--reference", 1024.0)? as u32,
            tables: words
                .iter()
                .filter(|word| ["first", "overhead", "race"].contains(&word.as_str()))
                .cloned()
                .collect(),
        })
    }

    fn wants(&self, table: &str) -> bool {
        self.tables.is_empty() || self.tables.iter().any(|wanted| wanted == table)
    }
}

fn main() -> Result<()> {
    let arguments = Arguments::read()?;
    let subjects = SCENES.map(|name| Subject::load(name, arguments.size)).into_iter().collect::<Result<Vec<_>>>()?;
    if arguments.wants("first") {
        first_pictures(&subjects)?;
    }
    if arguments.wants("overhead") {
        overheads(&subjects, &arguments)?;
    }
    if arguments.wants("race") {
        races(&subjects, &arguments)?;
    }
    Ok(())
}

/// A scene of the suite, at a size.
struct Subject {
    name: &'static str,
    scene: Arc<Scene>,
    size: u32,
    viewing: Viewing,
}

impl Subject {
    fn load(name: &'static str, size: u32) -> Result<Self> {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        let scene = Arc::new(load(&file, &LoadOptions::default())?);
        Ok(Self { name, scene, size, viewing: Viewing::of(Display::preset("desktop").context("a preset")?) })
    }

    fn trace_settings(&self, seed: u64) -> TraceSettings {
        TraceSettings::new(self.size, self.size, seed)
    }

    fn tracer(&self, seed: u64) -> PathTracer {
        PathTracer::new(Arc::clone(&self.scene), self.trace_settings(seed))
    }

    fn job(&self, seed: u64, limits: Limits, sampling: Sampling) -> Job {
        let record = SettingsRecord {
            sampling,
            allocation: AllocationRule::Convex,
            model: "csf-bands".to_owned(),
            viewing: self.viewing.clone(),
            nits_per_unit: self.scene.nits_per_unit,
            operator: "constant".to_owned(),
            exposure_stops: None,
            importance: None,
            denoiser: None,
        };
        Job { scene: Arc::clone(&self.scene), trace: self.trace_settings(seed), record, limits, importance: None }
    }

    fn loop_settings(&self, limits: Limits) -> Result<LoopSettings> {
        let operator = operator("constant", None).context("an operator")?;
        Ok(LoopSettings { limits, ..LoopSettings::new(self.viewing.clone(), self.scene.nits_per_unit, operator) })
    }

    fn pixels(&self) -> usize {
        self.size as usize * self.size as usize
    }
}

/// One thread, so that its processor time is what a quiet core would take.
fn one_thread() -> Result<rayon::ThreadPool> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(1).build()?)
}

/// Every pixel once.
fn one_sample_each(film: &Film, taken: u32) -> SamplePlan {
    let half = if taken.is_multiple_of(2) { Half::A } else { Half::B };
    let one = |pixel| BlockWork { samples: 1, ..BlockWork::rest(pixel, half, taken / 2) };
    SamplePlan { blocks: (0..film.width() * film.height()).map(one).collect() }
}

/// The least of several measurements: noise only adds.
fn least(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::INFINITY, f64::min)
}

fn first_pictures(subjects: &[Subject]) -> Result<()> {
    println!(
        "| scene | trees, ms | one uniform pass, ms | first picture, ms (of a pass) | every pixel shown, ms (of a pass) |"
    );
    println!("| --- | --- | --- | --- | --- |");
    for subject in subjects {
        let (mut trees, mut pass, mut first, mut whole) = (vec![], vec![], vec![], vec![]);
        for seed in 0..5 {
            let [tree, traced] = one_thread()?.install(|| {
                let clock = CpuClock::of_thread();
                let tracer = subject.tracer(seed);
                let tree = clock.seconds();
                let mut film = Film::new(subject.size, subject.size);
                tracer.trace(&one_sample_each(&film, 0), &mut film, &|_| {});
                [tree, clock.seconds() - tree]
            });
            trees.push(tree);
            pass.push(traced);
            let watched = Watched::start(subject, seed, Limits::of_visibility(1.0), Sampling::Adaptive, false)?;
            let pixels = subject.pixels() as u64;
            let moments = watched.until(|moment| moment.samples >= 2 * pixels)?;
            first.push(moments[0].seconds - tree);
            whole.extend(moments.last().map(|moment| moment.seconds - tree));
        }
        let [trees, pass, first, whole] = [trees, pass, first, whole].map(|times| 1e3 * least(times));
        let (name, first_ratio, whole_ratio) = (subject.name, first / pass, whole / pass);
        println!("| {name} | {trees:.1} | {pass:.0} | {first:.1} ({first_ratio:.2}) | {whole:.0} ({whole_ratio:.2}) |");
    }
    Ok(())
}

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

fn overheads(subjects: &[Subject], arguments: &Arguments) -> Result<()> {
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
        let percent = |logarithms: &[f64]| {
            let (mean, error) = mean_and_error(logarithms);
            if logarithms.is_empty() {
                "ended before".to_owned()
            } else {
                format!("{:+.1} ± {:.1} %", 100.0 * mean.exp_m1(), 100.0 * error)
            }
        };
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
        let limits = Limits { mean_samples: Some(OVERHEAD_SPP), ..Limits::of_visibility(1.0) };
        let pair = std::thread::scope(|scope| {
            let render = scope.spawn(|| rendered(subject, seed, limits));
            let preview = Watched::start(subject, seed, limits, Sampling::Adaptive, false)?;
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
