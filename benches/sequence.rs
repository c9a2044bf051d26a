//! What handing out samples along a Z-curve gains over independent pixels, as the eye sees it.
//!
//! `cargo bench --bench sequence [-- SCENE...]` prints the table of `benches/results/sampling.md` in minutes of one
//! core. Two renders of different seeds, uniform at 4, 16 and 64 samples a pixel and adaptive at visibility 4; their
//! difference over √2 has the energy of one render's error and its frequencies, whatever they are. It is shown,
//! filtered by the eye's contrast sensitivity with the thresholds of one 256-sample render, and its root mean square
//! over the picture is what the table calls error. Both sequences have the same pairs of seeds; worth is the
//! geometric mean over the pairs, with its 95 % interval by Student's t.

#[path = "support/mod.rs"]
mod support;

use anyhow::{Context, Result};
use fechner::adaptive::settings::{Limits, LoopSettings, Sampling, THRESHOLD};
use fechner::adaptive::{Quiet, Rendered, render};
use fechner::integrator::{PathTracer, TraceSettings};
use fechner::sampler::Sequence;
use fechner::scene::Scene;
use fechner_perception::tone::operator;
use fechner_perception::{Display, Plane, Viewing, seen};
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::sync::Arc;
use support::scenes_asked_for;

const SIZE: u32 = 96;
const SCENES: [&str; 2] = ["cornell-box", "textured-room"];
const PAIRS: u64 = 5;

/// How long to sample.
#[derive(Clone, Copy, Debug)]
enum Effort {
    Samples(u32),
    Visibility(f64),
}

fn main() -> Result<()> {
    println!("| scene | samples a pixel | visible error, per pixel | in Z-order | worth in samples |");
    println!("| --- | --- | --- | --- | --- |");
    for (name, scene) in scenes_asked_for(&SCENES)? {
        let judge = rendered(&scene, Sequence::PerPixel, 0, Effort::Samples(256))?;
        for effort in [Effort::Samples(4), Effort::Samples(16), Effort::Samples(64), Effort::Visibility(4.0)] {
            let mut pairs = Vec::new();
            for pair in 0..PAIRS {
                let error = |sequence| visible_error(&scene, &judge, sequence, pair, effort);
                pairs.push([error(Sequence::PerPixel)?, error(Sequence::ZOrder)?]);
            }
            print_row(name, effort, &pairs);
        }
    }
    Ok(())
}

/// What is left to see of a render, and what it took.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    /// Root mean square of the visibility of its error.
    error: f64,
    /// Mean samples a pixel.
    samples: f64,
}

fn print_row(scene: &str, effort: Effort, pairs: &[[Outcome; 2]]) {
    let mean = |value: &dyn Fn(&[Outcome; 2]) -> f64| pairs.iter().map(value).sum::<f64>() / pairs.len() as f64;
    // v² ∝ 1/n, so counts that differ are weighed in.
    let ln_worth = |[plain, ordered]: &[Outcome; 2]| {
        2.0 * (plain.error / ordered.error).ln() + (plain.samples / ordered.samples).ln()
    };
    let middle = mean(&ln_worth);
    let count = pairs.len() as f64;
    let variance = mean(&|pair| (ln_worth(pair) - middle).powi(2)) * count / (count - 1.0);
    let quantile = StudentsT::new(0.0, 1.0, count - 1.0).map_or(f64::NAN, |t| t.inverse_cdf(0.975));
    let half_width = quantile * (variance / count).sqrt();
    let [plain, ordered] = [0, 1].map(|arm| mean(&|pair| pair[arm].error));
    let samples = match effort {
        Effort::Samples(samples) => format!("{samples}"),
        Effort::Visibility(_) => {
            let [plain, ordered] = [0, 1].map(|arm| mean(&|pair| pair[arm].samples));
            format!("adaptive, {plain:.1} and {ordered:.1}")
        }
    };
    println!(
        "| {scene} | {samples} | {plain:.3} | {ordered:.3} | {:.3} ({:.3} to {:.3}) |",
        middle.exp(),
        (middle - half_width).exp(),
        (middle + half_width).exp()
    );
}

/// What one render of a sequence leaves to see, from the difference of a pair.
fn visible_error(
    scene: &Arc<Scene>,
    judge: &Rendered,
    sequence: Sequence,
    pair: u64,
    effort: Effort,
) -> Result<Outcome> {
    let seed = 1 + 2 * pair;
    let [a, b] = [rendered(scene, sequence, seed, effort)?, rendered(scene, sequence, seed + 1, effort)?];
    let planes = [&a, &b].map(|run| run.judgement.estimate.luminance_cd_m2.values());
    let error = Plane::from_fn(SIZE as usize, SIZE as usize, |x, y| {
        let i = y * SIZE as usize + x;
        (planes[0][i] - planes[1][i]) * std::f32::consts::FRAC_1_SQRT_2
    });
    let judgement = &judge.judgement;
    let display = Display::preset("desktop").context("a preset")?;
    let shown =
        seen::display_half_difference(judgement.tone.as_ref(), &display, &judgement.estimate.luminance_cd_m2, &error);
    let visibility = judgement.thresholds.in_bands.measured_visibility(&shown);
    let energy: f64 = visibility.values().iter().map(|&v| f64::from(v) * f64::from(v)).sum();
    let samples = 0.5 * (a.film.total_samples() + b.film.total_samples()) as f64 / f64::from(SIZE * SIZE);
    Ok(Outcome { error: (energy / f64::from(SIZE * SIZE)).sqrt(), samples })
}

fn rendered(scene: &Arc<Scene>, sequence: Sequence, seed: u64, effort: Effort) -> Result<Rendered> {
    let (sampling, visibility, mean_samples) = match effort {
        Effort::Samples(samples) => (Sampling::Uniform, None, Some(samples)),
        Effort::Visibility(visibility) => (Sampling::Adaptive, Some(visibility), None),
    };
    let viewing = Viewing::of(Display::preset("desktop").context("a preset")?);
    let operator = operator("constant", None).context("an operator")?;
    let limits = Limits { visibility, mean_samples, ..Limits::of_visibility(THRESHOLD) };
    let trace = TraceSettings { sequence, ..TraceSettings::new(SIZE, SIZE, seed) };
    let settings =
        LoopSettings { sampling, limits, ..LoopSettings::new(&trace, viewing, scene.nits_per_unit, operator) };
    Ok(render(&PathTracer::new(Arc::clone(scene), trace), &settings, &Quiet)?)
}
