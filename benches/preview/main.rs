//! What a live preview costs and what it is worth: time to the first picture, samples a second beside a render that
//! nobody watches, and quality over the first seconds against uniform progressive rendering by the same tracer.
//!
//! `cargo bench --bench preview [-- first|overhead|two-threads|race SCENE --size N --seconds S --seeds N --reference
//! N]` prints the tables of `benches/results/preview.md`, or those that are named, of all scenes or those that are
//! named. Every arm but those of two threads renders on one, whose own processor time is the clock, so that others'
//! work on the machine counts only through caches; a browser's part is played by a WebSocket that takes every frame,
//! on another thread.

mod overhead;
mod race;
#[path = "../support/mod.rs"]
mod support;
mod watched;

use anyhow::{Context, Result};
use fechner::adaptive::settings::{Limits, LoopSettings, Sampling};
use fechner::checkpoint::SettingsRecord;
use fechner::film::Film;
use fechner::integrator::{BlockWork, PathTracer, SamplePlan, TraceSettings};
use fechner::preview::Job;
use fechner::sampler::Half;
use fechner::scene::Scene;
use fechner::scene::load::{LoadOptions, load};
use fechner_perception::tone::operator;
use fechner_perception::{Display, Viewing};
use overhead::{Threads, overheads};
use race::races;
use std::path::Path;
use std::sync::Arc;
use support::CpuClock;
use watched::Watched;

const SCENES: [&str; 3] = ["cornell-box", "many-lights", "textured-room"];

const TABLES: [&str; 4] = ["first", "overhead", "two-threads", "race"];

struct Arguments {
    size: u32,
    seconds: f64,
    seeds: u64,
    reference_spp: u32,
    /// Tables to print; all where none is named.
    tables: Vec<String>,
    /// Of these scenes; all where none is named.
    scenes: Vec<String>,
}

impl Arguments {
    fn read() -> Result<Self> {
        let words: Vec<String> = std::env::args().collect();
        let number = |name: &str, otherwise: f64| match words.iter().position(|word| word == name) {
            None => Ok(otherwise),
            Some(place) => words.get(place + 1).and_then(|word| word.parse().ok()).with_context(|| format!("{name} N")),
        };
        // Cargo adds words of its own, which begin with dashes.
        let is_name = |place: &usize| {
            !words[*place].starts_with('-')
                && !["--size", "--seconds", "--seeds", "--reference"].contains(&words[place - 1].as_str())
        };
        let names = (1..words.len()).filter(is_name).map(|place| words[place].clone());
        let (scenes, tables): (Vec<String>, Vec<String>) = names.partition(|name| SCENES.contains(&name.as_str()));
        if let Some(unknown) = tables.iter().find(|table| !TABLES.contains(&table.as_str())) {
            anyhow::bail!(
                "\"{unknown}\" is neither a table ({}) nor a scene ({})",
                TABLES.join(", "),
                SCENES.join(", ")
            );
        }
        Ok(Self {
            size: number("--size", 192.0)? as u32,
            seconds: number("--seconds", 10.0)?,
            seeds: number("--seeds", 3.0)? as u64,
            reference_spp: number("--reference", 1024.0)? as u32,
            tables,
            scenes,
        })
    }

    fn wants(&self, table: &str) -> bool {
        self.tables.is_empty() || self.tables.iter().any(|wanted| wanted == table)
    }
}

fn main() -> Result<()> {
    let arguments = Arguments::read()?;
    let wanted =
        SCENES.into_iter().filter(|scene| arguments.scenes.is_empty() || arguments.scenes.iter().any(|s| s == scene));
    let subjects = wanted.map(|name| Subject::load(name, arguments.size)).collect::<Result<Vec<_>>>()?;
    if arguments.wants("first") {
        first_pictures(&subjects)?;
    }
    if arguments.wants("overhead") {
        overheads(&subjects, &arguments, Threads::One)?;
    }
    if arguments.wants("two-threads") {
        overheads(&subjects, &arguments, Threads::Two)?;
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
        let defaults = SettingsRecord::new(self.viewing.clone(), self.scene.nits_per_unit, "constant");
        let record = SettingsRecord { sampling, ..defaults };
        Job {
            scene: Arc::clone(&self.scene),
            trace: self.trace_settings(seed),
            record,
            csf_area_deg2: None,
            limits,
            importance: None,
            whole: None,
        }
    }

    fn loop_settings(&self, limits: Limits) -> Result<LoopSettings> {
        let operator = operator("constant", None).context("an operator")?;
        Ok(LoopSettings {
            limits,
            ..LoopSettings::new(&self.trace_settings(0), self.viewing.clone(), self.scene.nits_per_unit, operator)
        })
    }

    fn pixels(&self) -> usize {
        self.size as usize * self.size as usize
    }
}

fn pool_of(threads: usize) -> Result<rayon::ThreadPool> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build()?)
}

/// One thread, so that its processor time is what a quiet core would take.
fn one_thread() -> Result<rayon::ThreadPool> {
    pool_of(1)
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
            let watched = Watched::start(
                one_thread()?,
                subject.job(seed, Limits::of_visibility(1.0), Sampling::Adaptive),
                false,
            )?;
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
