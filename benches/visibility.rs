//! Samples to reach visibility 1 on 99 % of the Cornell box at 512×512 and 60 pixels a degree: adaptive against uniform.
//!
//! `cargo bench --bench visibility` prints the table of `benches/README.md`. Renders are cached under `benches/cache`, so
//! that a second run only judges them; delete the folder after a change to the tracer. About twenty minutes on 2 cores.
//!
//! Truth is √2 × the local RMS (Gaussian of σ 0.25°) of the difference to a reference of another seed, as displayed,
//! through the contrast sensitivity and masking of the reference; the reference's own noise, known from its halves, is
//! subtracted as energy. It is never a pointwise |error|. The reference is the uniform render too: its own error is half
//! the difference of its halves, a realisation that needs no third render. Subtracting the reference's noise adds scatter
//! to the adaptive render's figure only, so the ratio errs against it.

use anyhow::{Context, Result};
use fechner::adaptive::settings::{AllocationRule, DEFAULT_MAX_SAMPLES, Limits, LoopSettings, Sampling};
use fechner::adaptive::{Quiet, render};
use fechner::film::opponent;
use fechner::integrator::{DEFAULT_MAX_DEPTH, PathTracer, TraceSettings};
use fechner::sampler::{Half, PixelFilter, Sequence};
use fechner::scene::load::{LoadOptions, load};
use fechner_perception::allocation::{AllocationProblem, allocate};
use fechner_perception::tone::{FittedTone, SceneGuide, operator};
use fechner_perception::{CastleCsf, Display, Plane, ThresholdInputs, ThresholdMap, Viewing, seen, threshold_map};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const SIZE: u32 = 512;

/// One cached render.
struct Run {
    /// Luminance of each half in cd/m².
    halves: [Plane; 2],
    samples: f64,
    seconds_total: f64,
    seconds_perception: f64,
}

/// What to render.
struct Arm {
    name: &'static str,
    seed: u64,
    sampling: Sampling,
    visibility: f64,
    spp: Option<u32>,
}

const REFERENCE: Arm =
    Arm { name: "uniform-2048", seed: 900, sampling: Sampling::Uniform, visibility: 0.0, spp: Some(2048) };
/// The target is below 1 because 99 % of the picture must be: one picture's local RMS scatters about its expectation.
const ADAPTIVE: Arm = Arm { name: "adaptive-0.85", seed: 2, sampling: Sampling::Adaptive, visibility: 0.85, spp: None };

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let adaptive = cached(root, &ADAPTIVE)?;
    let reference = cached(root, &REFERENCE)?;
    let judge = Judge::new(&reference)?;
    println!("Cornell box, {SIZE}x{SIZE}, display desktop (60 pixels a degree), truth against {} spp", REFERENCE.name);
    println!("| arm | mean spp | true v at 99 % | share above 1 | spp for v = 1 on 99 % | time in perception |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let uniform = judge.row("uniform", &reference, &judge.reference_energy.map(f32::sqrt));
    let adaptive = judge.row("adaptive", &adaptive, &judge.visibility(&adaptive));
    let oracle = judge.oracle()?;
    println!("| oracle | | | | {oracle:.0} | |");
    println!("\nuniform / adaptive: {:.2}, uniform / oracle: {:.2}", uniform / adaptive, uniform / oracle);
    Ok(())
}

/// Sees differences to the reference.
struct Judge<'a> {
    reference: &'a Run,
    display: Display,
    tone: Box<dyn FittedTone>,
    thresholds: ThresholdMap,
    /// v² of the reference's own noise.
    reference_energy: Plane,
}

fn mean(run: &Run) -> Plane {
    combine(&run.halves[0], &run.halves[1], |a, b| 0.5 * (a + b))
}

fn combine(a: &Plane, b: &Plane, with: impl Fn(f32, f32) -> f32 + Sync) -> Plane {
    Plane::from_fn(a.width(), a.height(), |x, y| with(a.get(x, y), b.get(x, y)))
}

impl<'a> Judge<'a> {
    fn new(reference: &'a Run) -> Result<Self> {
        let viewing = Viewing::of(Display::preset("desktop").context("a preset")?);
        let luminance = mean(reference);
        let tone = operator("constant", None).context("an operator")?.fit(&SceneGuide::of(&luminance), &viewing, None);
        let shown = seen::display_luminance(tone.as_ref(), &viewing.display, &luminance);
        let inputs = ThresholdInputs { display_luminance_cd_m2: &shown, guide_variance: None };
        let thresholds = threshold_map(&inputs, &viewing, &CastleCsf::default())?;
        let half_difference = combine(&reference.halves[0], &reference.halves[1], |a, b| 0.5 * (a - b));
        let shown = seen::display_half_difference(tone.as_ref(), &viewing.display, &luminance, &half_difference);
        let reference_energy = thresholds.measured_visibility(&shown).map(|v| v * v);
        Ok(Self { reference, display: viewing.display, tone, thresholds, reference_energy })
    }

    /// True visibility of a run's error.
    fn visibility(&self, run: &Run) -> Plane {
        let shown = |run: &Run| seen::display_luminance(self.tone.as_ref(), &self.display, &mean(run));
        let difference = combine(&shown(run), &shown(self.reference), |a, b| a - b);
        let measured = self.thresholds.measured_visibility(&difference);
        combine(&measured, &self.reference_energy, |v, reference| (v * v - reference).max(0.0).sqrt())
    }

    /// Mean samples a pixel of the convex optimum at visibility 1 with the variance that the reference's halves show, pooled
    /// over a Gaussian of 0.25°. A rule that uses variance finer than that could do better, by as much as it varies there.
    fn oracle(&self) -> Result<f64> {
        let halves = &self.reference.halves;
        let half_difference = combine(&halves[0], &halves[1], |a, b| 0.5 * (a - b));
        let luminance = mean(self.reference);
        let shown = seen::display_half_difference(self.tone.as_ref(), &self.display, &luminance, &half_difference);
        let samples = (self.reference.samples / f64::from(SIZE * SIZE)) as f32;
        let variance_per_sample = self.thresholds.pooled(&shown.map(|d| d * d * samples));
        let allocation = allocate(&AllocationProblem {
            variance_per_sample: &variance_per_sample,
            thresholds: &self.thresholds,
            cost: &Plane::filled(SIZE as usize, SIZE as usize, 1.0),
            tolerance: None,
            visibility: 1.0,
            min_samples: 16.0,
            max_samples: f64::from(DEFAULT_MAX_SAMPLES),
        })?;
        Ok(allocation.cost / f64::from(SIZE * SIZE))
    }

    /// Prints a run and returns the mean samples a pixel with which 99 % of it would be at visibility 1: v² ∝ 1/n.
    fn row(&self, name: &str, run: &Run, visibility: &Plane) -> f64 {
        let mut values = visibility.values().to_vec();
        values.sort_by(f32::total_cmp);
        let p99 = f64::from(values[(0.99 * values.len() as f64) as usize]);
        let above = values.iter().filter(|&&v| v > 1.0).count() as f64 / values.len() as f64;
        let spp = run.samples / f64::from(SIZE * SIZE);
        let needed = spp * p99 * p99;
        let share = 100.0 * run.seconds_perception / run.seconds_total;
        println!("| {name} | {spp:.0} | {p99:.3} | {:.2} % | {needed:.0} | {share:.1} % |", 100.0 * above);
        needed
    }
}

/// Renders an arm, or reads it back.
fn cached(root: &Path, arm: &Arm) -> Result<Run> {
    let folder = root.join("benches/cache");
    std::fs::create_dir_all(&folder)?;
    let file: PathBuf = folder.join(format!("cornell-{SIZE}-{}.f32", arm.name));
    if let Ok(bytes) = std::fs::read(&file) {
        return from_bytes(&bytes).with_context(|| format!("{} is no cached render: delete it", file.display()));
    }
    eprintln!("rendering {}", arm.name);
    let scene = load(&root.join("scenes/cornell-box.toml"), &LoadOptions::default())?;
    let nits_per_unit = scene.nits_per_unit;
    let settings = LoopSettings {
        sampling: arm.sampling,
        allocation: AllocationRule::Convex,
        model: None,
        limits: Limits {
            visibility: arm.visibility,
            time: None,
            mean_samples: arm.spp,
            max_samples: DEFAULT_MAX_SAMPLES,
            plans: None,
        },
        viewing: Viewing::of(Display::preset("desktop").context("a preset")?),
        nits_per_unit,
        operator: operator("constant", None).context("an operator")?,
    };
    let trace = TraceSettings {
        width: SIZE,
        height: SIZE,
        seed: arm.seed,
        max_depth: DEFAULT_MAX_DEPTH,
        clamp: None,
        filter: PixelFilter::Gaussian,
        sequence: Sequence::PerPixel,
        crop: None,
    };
    let rendered = render(&PathTracer::new(Arc::new(scene), trace), &settings, &Quiet)?;
    let halves = Half::BOTH.map(|half| {
        let values = rendered.film.half(half).iter().map(|p| (opponent(p.mean)[0] * nits_per_unit) as f32).collect();
        Plane::from_values(SIZE as usize, SIZE as usize, values)
    });
    let [a, b] = halves;
    let run = Run {
        halves: [a?, b?],
        samples: rendered.film.total_samples() as f64,
        seconds_total: rendered.seconds_total,
        seconds_perception: rendered.seconds_perception,
    };
    std::fs::write(&file, to_bytes(&run))?;
    Ok(run)
}

fn to_bytes(run: &Run) -> Vec<u8> {
    let figures = [run.samples, run.seconds_total, run.seconds_perception];
    let mut bytes: Vec<u8> = figures.iter().flat_map(|f| f.to_le_bytes()).collect();
    bytes.extend(run.halves.iter().flat_map(|h| h.values()).flat_map(|v| v.to_le_bytes()));
    bytes
}

fn from_bytes(bytes: &[u8]) -> Result<Run> {
    let pixels = (SIZE * SIZE) as usize;
    anyhow::ensure!(bytes.len() == 24 + 8 * pixels, "its length is {}", bytes.len());
    let figure = |i: usize| f64::from_le_bytes(std::array::from_fn(|k| bytes[8 * i + k]));
    let half = |h: usize| {
        let values = bytes[24 + 4 * pixels * h..24 + 4 * pixels * (h + 1)]
            .chunks_exact(4)
            .map(|c| f32::from_le_bytes([c[0], c[1], c[2], c[3]]))
            .collect();
        Plane::from_values(SIZE as usize, SIZE as usize, values)
    };
    Ok(Run {
        halves: [half(0)?, half(1)?],
        samples: figure(0),
        seconds_total: figure(1),
        seconds_perception: figure(2),
    })
}
