//! What handing out samples along a Z-curve gains over independent pixels, as the eye sees it.
//!
//! `cargo bench --bench sequence` prints the table of `benches/README.md`. Two renders of different seeds, uniform at 4,
//! 16 and 64 samples a pixel and adaptive at visibility 4; their difference over √2 has the energy of one render's error
//! and its frequencies, whatever they are. It is shown, filtered by the eye's contrast sensitivity with the thresholds of
//! one 256-sample render, and its root mean square over the picture is what the table calls error.

use anyhow::{Context, Result};
use fechner::adaptive::settings::{Limits, LoopSettings, Sampling};
use fechner::adaptive::{Quiet, Rendered, render};
use fechner::integrator::{PathTracer, TraceSettings};
use fechner::sampler::Sequence;
use fechner::scene::Scene;
use fechner::scene::load::{LoadOptions, load};
use fechner_perception::tone::operator;
use fechner_perception::{Display, Plane, Viewing, seen};
use std::path::Path;
use std::sync::Arc;

const SIZE: u32 = 128;
const SCENES: [&str; 3] = ["cornell-box", "many-lights", "textured-room"];

/// How long to sample.
#[derive(Clone, Copy, Debug)]
enum Effort {
    Samples(u32),
    Visibility(f64),
}

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    println!("| scene | samples a pixel | visible error, per pixel | in Z-order | worth in samples |");
    println!("| --- | --- | --- | --- | --- |");
    for name in SCENES {
        let scene = Arc::new(load(&root.join(format!("scenes/{name}.toml")), &LoadOptions::default())?);
        let judge = rendered(&scene, Sequence::PerPixel, 9, Effort::Samples(256))?;
        for effort in [Effort::Samples(4), Effort::Samples(16), Effort::Samples(64), Effort::Visibility(4.0)] {
            let [(plain, plain_spp), (ordered, ordered_spp)] = [
                visible_error(&scene, &judge, Sequence::PerPixel, effort)?,
                visible_error(&scene, &judge, Sequence::ZOrder, effort)?,
            ];
            // v² ∝ 1/n, so counts that differ are weighed in.
            let worth = (plain / ordered).powi(2) * plain_spp / ordered_spp;
            let samples = match effort {
                Effort::Samples(samples) => format!("{samples}"),
                Effort::Visibility(_) => format!("adaptive, {plain_spp:.0} and {ordered_spp:.0}"),
            };
            println!("| {name} | {samples} | {plain:.3} | {ordered:.3} | {worth:.2} |");
        }
    }
    Ok(())
}

/// Root mean square of the visibility of one render's error, and its mean samples a pixel.
fn visible_error(scene: &Arc<Scene>, judge: &Rendered, sequence: Sequence, effort: Effort) -> Result<(f64, f64)> {
    let [a, b] = [rendered(scene, sequence, 1, effort)?, rendered(scene, sequence, 2, effort)?];
    let planes = [&a, &b].map(|run| run.judgement.estimate.luminance_cd_m2.values());
    let error = Plane::from_fn(SIZE as usize, SIZE as usize, |x, y| {
        let i = y * SIZE as usize + x;
        (planes[0][i] - planes[1][i]) * std::f32::consts::FRAC_1_SQRT_2
    });
    let judgement = &judge.judgement;
    let display = Display::preset("desktop").context("a preset")?;
    let shown =
        seen::display_half_difference(judgement.tone.as_ref(), &display, &judgement.estimate.luminance_cd_m2, &error);
    let visibility = judgement.thresholds.measured_visibility(&shown);
    let energy: f64 = visibility.values().iter().map(|&v| f64::from(v) * f64::from(v)).sum();
    let samples = 0.5 * (a.film.total_samples() + b.film.total_samples()) as f64 / f64::from(SIZE * SIZE);
    Ok(((energy / f64::from(SIZE * SIZE)).sqrt(), samples))
}

fn rendered(scene: &Arc<Scene>, sequence: Sequence, seed: u64, effort: Effort) -> Result<Rendered> {
    let (sampling, visibility, mean_samples) = match effort {
        Effort::Samples(samples) => (Sampling::Uniform, 0.0, Some(samples)),
        Effort::Visibility(visibility) => (Sampling::Adaptive, visibility, None),
    };
    let viewing = Viewing::of(Display::preset("desktop").context("a preset")?);
    let operator = operator("constant", None).context("an operator")?;
    let limits = Limits { mean_samples, ..Limits::of_visibility(visibility) };
    let settings = LoopSettings { sampling, limits, ..LoopSettings::new(viewing, scene.nits_per_unit, operator) };
    let trace = TraceSettings { sequence, ..TraceSettings::new(SIZE, SIZE, seed) };
    Ok(render(&PathTracer::new(Arc::clone(scene), trace), &settings, &Quiet)?)
}
