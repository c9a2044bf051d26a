//! What leaving faint light to chance saves (`--prune tvi`), and what it costs in noise.
//!
//! `cargo bench --bench prune [-- SCENE...]` prints the table of `benches/results/transport.md` in a minute. Even
//! samples with and without, the same seed, one thread, alternating; noise is the mean over the picture of a sample's
//! variance over its squared mean, both of luminance. Worth is how many times as much is seen in a processor second:
//! seconds times noise without it, over the same with it.

#[path = "support/mod.rs"]
mod support;

use anyhow::Result;
use fechner::film::{Film, opponent};
use fechner::integrator::{BlockWork, PathTracer, Pruning, SamplePlan, TraceSettings};
use fechner::sampler::Half;
use std::sync::Arc;
use support::{CpuClock, scenes_asked_for};

const SIZE: u32 = 96;
const SCENES: [&str; 5] = ["cornell-box", "dark-window", "many-lights", "product", "textured-room"];
/// Doublings after the pilot: 128 samples a pixel in all.
const LEVELS: u8 = 4;
const ROUNDS: u32 = 3;

/// What a picture took, and what it is worth.
struct Outcome {
    seconds: f64,
    rays: f64,
    noise: f64,
    mean: f64,
}

fn main() -> Result<()> {
    println!("| scene | rays a sample | with pruning | processor time | noise | worth | mean |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for (name, scene) in scenes_asked_for(&SCENES)? {
        let pruning = Pruning { nits_per_unit: scene.nits_per_unit };
        let tracers = [None, Some(pruning)].map(|prune| {
            PathTracer::new(Arc::clone(&scene), TraceSettings { prune, ..TraceSettings::new(SIZE, SIZE, 1) })
        });
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let rounds: Vec<[Outcome; 2]> =
            (0..ROUNDS).map(|_| tracers.each_ref().map(|tracer| pool.install(|| traced(tracer)))).collect();
        let best = |arm: usize| rounds.iter().map(|round| round[arm].seconds).fold(f64::INFINITY, f64::min);
        let [all, pruned] = &rounds[0];
        let (seconds, noise) = (best(1) / best(0), pruned.noise / all.noise);
        println!(
            "| {name} | {:.2} | {:.2} | {seconds:.3} | {noise:.3} | {:.3} | {:.4} |",
            all.rays,
            pruned.rays,
            1.0 / (seconds * noise),
            pruned.mean / all.mean
        );
    }
    Ok(())
}

fn traced(tracer: &PathTracer) -> Outcome {
    let of_level =
        |level: u8| (0..SIZE * SIZE).flat_map(move |pixel| Half::BOTH.map(|half| BlockWork::whole(pixel, half, level)));
    let plan = SamplePlan { blocks: (0..LEVELS).flat_map(of_level).collect() };
    let mut film = Film::new(SIZE, SIZE);
    let clock = CpuClock::of_process();
    tracer.trace(&plan, &mut film, &|_| {});
    let seconds = clock.seconds();
    let pixels = f64::from(SIZE * SIZE);
    let relative = |half: &fechner::film::HalfPixel| {
        let mean = opponent(half.mean)[0];
        if mean > 0.0 { half.sample_variance(0) / (mean * mean) } else { 0.0 }
    };
    let over_picture = |of: &dyn Fn(&fechner::film::HalfPixel) -> f64| {
        Half::BOTH.iter().flat_map(|&half| film.half(half)).map(of).sum::<f64>() / (2.0 * pixels)
    };
    Outcome {
        seconds,
        rays: film.rays as f64 / plan.samples() as f64,
        noise: over_picture(&relative),
        mean: over_picture(&|half| opponent(half.mean)[0]),
    }
}
