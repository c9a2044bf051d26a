//! Samples (paths) per second of the path tracer, against Mitsuba 3 `llvm_ad_rgb` on the same scenes.
//!
//! `cargo bench --bench paths` writes the scenes to `benches/cache/paths` and renders them, 16 samples a pixel and at
//! most 8 scattering events, with one thread and with two. Mitsuba joins where `python3` (or
//! `FECHNER_MITSUBA_PYTHON`) has it: rounds of both alternate and the best of each counts. `-- cornell` or `-- cave`
//! measures one scene alone.
//!
//! Seconds are CPU seconds of all threads of each program, so that other work on the machine does not count; only the
//! speed-up of two threads is taken from the clock on the wall, and means something on a quiet machine alone.

#[path = "support/mod.rs"]
mod support;

use anyhow::Result;
use fechner::film::Film;
use fechner::integrator::{BlockWork, PathTracer, SamplePlan, TraceSettings};
use fechner::sampler::{Half, PixelFilter};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use support::peer::{MAX_DEPTH, Mitsuba, write_scene};
use support::{CpuClock, cornell_box, textured_cave};

const SIZE: u32 = 256;
const SAMPLES: u32 = 16;
const ROUNDS: u32 = 5;

/// Best seconds of some rounds.
#[derive(Clone, Copy)]
struct Best {
    cpu: f64,
    wall: f64,
}

impl Best {
    const NONE: Self = Self { cpu: f64::INFINITY, wall: f64::INFINITY };

    fn keep(&mut self, cpu: f64, wall: f64) {
        *self = Self { cpu: self.cpu.min(cpu), wall: self.wall.min(wall) };
    }

    /// Millions of samples in a CPU second.
    fn rate(self) -> f64 {
        f64::from(SIZE * SIZE * SAMPLES) / self.cpu / 1e6
    }
}

fn main() -> Result<()> {
    let only: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    println!("| scene | threads | rays a sample | fechner M/CPU-s | Mitsuba M/CPU-s | ratio | fechner wall s |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for (name, scene) in [("cornell", cornell_box()?), ("cave", textured_cave())] {
        if only.is_empty() || only.iter().any(|word| word == name) {
            bench_scene(name, scene)?;
        }
    }
    Ok(())
}

fn bench_scene(name: &str, scene: fechner::scene::Scene) -> Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/cache/paths").join(name);
    write_scene(&scene, &folder)?;
    let mut mitsuba = Mitsuba::start(&folder, SIZE)?;
    let settings =
        TraceSettings { max_depth: MAX_DEPTH, filter: PixelFilter::Box, ..TraceSettings::new(SIZE, SIZE, 1) };
    let tracer = PathTracer::new(Arc::new(scene), settings);
    let plan = SamplePlan {
        blocks: (0..SIZE * SIZE).flat_map(|pixel| Half::BOTH.map(|half| BlockWork::whole(pixel, half, 0))).collect(),
    };
    assert_eq!(plan.samples(), u64::from(SIZE * SIZE * SAMPLES));
    let mut wall_of_one = f64::NAN;
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let (mut ours, mut theirs, mut rays) = (Best::NONE, Best::NONE, 0.0);
        for round in 0..ROUNDS {
            let (cpu, wall) = (CpuClock::of_process(), Instant::now());
            let film = pool.install(|| {
                let mut film = Film::new(SIZE, SIZE);
                tracer.trace(&plan, &mut film, &|_| {});
                film
            });
            ours.keep(cpu.seconds(), wall.elapsed().as_secs_f64());
            rays = film.rays as f64 / plan.samples() as f64;
            if let Some(mitsuba) = &mut mitsuba {
                let render = mitsuba.render(SAMPLES, round, threads)?;
                if round > 0 {
                    theirs.keep(render.cpu_seconds, render.wall_seconds);
                }
            }
        }
        let speed_up = if threads == 1 {
            wall_of_one = ours.wall;
            String::new()
        } else {
            format!(" ({:.2}× one thread)", wall_of_one / ours.wall)
        };
        let peer = if mitsuba.is_some() {
            format!("{:.3} | **{:.2}**", theirs.rate(), ours.rate() / theirs.rate())
        } else {
            "| ".to_owned()
        };
        println!("| {name} | {threads} | {rays:.2} | {:.3} | {peer} | {:.2}{speed_up} |", ours.rate(), ours.wall);
    }
    Ok(())
}
