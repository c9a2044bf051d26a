//! What adaptive sampling saves: arms on the same tracer, judged against a reference and an oracle.
//!
//! [`run`] renders every arm of every scene with several seeds and writes `results.json`, `results.csv` and
//! `report.html`. Truth is √2 × the local RMS (Gaussian of σ 0.25°) of the error through the eye's filters, in all
//! three opponent channels, the reference's own noise taken out; it is never a pointwise difference and never what an
//! arm itself predicts. Finished renders are kept in the output folder, so that a run that was broken off goes on.
//!
//! Not for timing the tracer: see `benches/`.

mod animation;
mod arm;
mod curve;
mod denoise;
mod flicker;
mod keep;
mod knob;
mod metrics;
mod name;
mod oracle;
mod pictures;
mod plot;
mod quote;
mod race;
mod reached;
mod record;
mod reference;
mod report;
mod runner;
mod summary;
mod table;
mod truth;

pub use animation::{AnimationResults, AnimationRow, AnimationSettings, animation};
pub use arm::Arm;
pub use curve::{Curve, CurvePoint};
pub use denoise::{Calibration, DenoisingResults, DenoisingSettings, denoising};
pub use metrics::{Metrics, measure};
pub use race::{Need, Quality, Race, RaceMean, RacePoint, RaceRule};
pub use reached::Reached;
pub use record::{ArmSummary, Record, ReferenceOf, Results};
pub use reference::trace_up_to;
pub use summary::{GeometricMean, INTERVAL_LEVEL, intervals_in_words, mean_ratio};

use crate::adaptive::settings::{Limits, LoopSettings};
use crate::integrator::{PathTracer, TraceSettings};
use crate::scene::Scene;
use crate::scene::load::{LoadOptions, load};
use anyhow::{Context, Result};
use fechner_perception::display::{Display, Viewing};
use fechner_perception::tone::{self, ToneOperator, ToneSettings};
use name::distinct_names;
use oracle::{displayed_variance, least_mean_samples, uniform_samples};
use reference::Reference;
use runner::ArmRunner;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use truth::Truth;

/// What to run.
#[derive(Clone, Debug)]
pub struct BenchSettings {
    /// Scene files.
    pub scenes: Vec<PathBuf>,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Visibility v\* that every arm has to reach.
    pub visibility: f64,
    /// Arms, the uniform one first.
    pub arms: Vec<Arm>,
    /// Renders of each arm.
    pub seeds: u32,
    /// Samples of the reference, as a multiple of what uniform sampling needs for v\* on 99 %.
    pub reference_factor: f64,
    /// Display preset.
    pub display: String,
    /// Folder of results; made if need be.
    pub output: PathBuf,
}

/// The share of the picture that has to be below v\* wherever a single one is asked for: where arms are searched and
/// references end, and in tables, whose headings say it.
pub(crate) const MAIN_COVERAGE: f64 = 0.99;
/// Shares of the picture that have to be below v\*.
pub const COVERAGES: [f64; 3] = [0.95, MAIN_COVERAGE, 0.999];

/// How a display preset is looked at.
fn viewing(display: &str) -> Result<Viewing> {
    Ok(Viewing::of(Display::named(display)?))
}

/// The operator that shows a scene, as the scene asks for it.
fn tone_operator(scene: &Scene) -> Result<Box<dyn ToneOperator>> {
    let name = scene.viewing.operator.as_deref().unwrap_or(tone::DEFAULT_OPERATOR);
    let exposure_stops = scene.viewing.exposure_stops.unwrap_or_default();
    Ok(tone::operator_named(name, &ToneSettings { exposure_stops, ..ToneSettings::default() })?)
}

/// One scene, ready to be rendered by any arm.
pub(crate) struct Subject {
    /// No other scene's of the same run: the file's name without its ending, with folders before it where others have
    /// that name.
    pub(crate) name: String,
    pub(crate) scene: Arc<Scene>,
    pub(crate) size: (u32, u32),
    pub(crate) viewing: Viewing,
    pub(crate) visibility: f64,
}

impl Subject {
    fn load(path: &Path, name: String, settings: &BenchSettings) -> Result<Self> {
        let viewing = viewing(&settings.display)?;
        let scene = load(path, &LoadOptions::default())?;
        Ok(Self { name, scene: Arc::new(scene), size: settings.size, viewing, visibility: settings.visibility })
    }

    /// How names of files about this scene begin.
    pub(crate) fn file_name(&self) -> String {
        self.name.replace(['/', '\\'], "-")
    }

    pub(crate) fn tracer(&self, seed: u64) -> PathTracer {
        PathTracer::new(Arc::clone(&self.scene), self.trace_settings(seed))
    }

    /// How every arm traces.
    fn trace_settings(&self, seed: u64) -> TraceSettings {
        TraceSettings::new(self.size.0, self.size.1, seed)
    }

    /// Settings of the default loop, to be changed by an arm.
    pub(crate) fn loop_settings(&self) -> Result<LoopSettings> {
        let operator = tone_operator(&self.scene)?;
        Ok(LoopSettings {
            limits: Limits::of_visibility(self.visibility),
            ..LoopSettings::new(&self.trace_settings(0), self.viewing.clone(), self.scene.nits_per_unit, operator)
        })
    }

    pub(crate) fn pixels(&self) -> f64 {
        f64::from(self.size.0) * f64::from(self.size.1)
    }
}

/// What converged variances say that a scene needs, before anything is tried: what no rule can beat.
#[derive(Clone, Debug)]
pub struct Bound {
    /// Scene.
    pub scene: String,
    /// Share of the picture that has to be at v\*.
    pub coverage: f64,
    /// Samples a pixel of uniform sampling, one at least.
    pub uniform: f64,
    /// Mean samples a pixel of the cheapest counts of one at least: never more than uniform sampling's.
    pub optimum: f64,
}

/// Bounds of every scene and coverage; renders nothing but the references.
///
/// # Errors
/// As [`run`].
pub fn bounds(settings: &BenchSettings, say: &dyn Fn(&str)) -> Result<Vec<Bound>> {
    let names = distinct_names(&settings.scenes)?;
    check_inputs(&settings.scenes, &settings.display)?;
    make_folders(settings)?;
    let mut bounds = Vec::new();
    for (path, name) in settings.scenes.iter().zip(names) {
        let subject = Subject::load(path, name, settings)?;
        let reference = Reference::cached(&subject, settings, say)?;
        let truth = Truth::new(&subject, &reference)?;
        let variance = displayed_variance(&subject, &reference, &truth)?;
        for coverage in COVERAGES {
            bounds.push(Bound {
                scene: subject.name.clone(),
                coverage,
                uniform: uniform_samples(&subject, &truth, &variance, coverage),
                optimum: least_mean_samples(&truth, &variance, subject.visibility, coverage)?,
            });
        }
    }
    Ok(bounds)
}

/// Loads every scene, and finds the display: what is missing or broken is told of before anything is written, and
/// before hours are spent on what comes before it. [`animation()`] leaves this to its caller, who may call it once a
/// denoiser.
///
/// # Errors
/// Scenes that do not load, or ask for a tone operator that there is not, and displays that there are not.
pub fn check_inputs(scenes: &[PathBuf], display: &str) -> Result<()> {
    viewing(display)?;
    for path in scenes {
        tone_operator(&load(path, &LoadOptions::default())?).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

fn make_folders(settings: &BenchSettings) -> Result<()> {
    for folder in ["runs", "references"] {
        let folder = settings.output.join(folder);
        std::fs::create_dir_all(&folder).with_context(|| format!("{}", folder.display()))?;
    }
    Ok(())
}

/// Runs every arm of every scene and writes the results.
///
/// # Errors
/// Scenes that do not load, and folders that cannot be written.
pub fn run(settings: &BenchSettings, say: &dyn Fn(&str)) -> Result<Results> {
    let names = distinct_names(&settings.scenes)?;
    check_inputs(&settings.scenes, &settings.display)?;
    make_folders(settings)?;
    let mut results = Results::new(settings);
    for (path, name) in settings.scenes.iter().zip(names) {
        let subject = Subject::load(path, name, settings)?;
        let reference = Reference::cached(&subject, settings, say)?;
        results.references.push(ReferenceOf {
            scene: subject.name.clone(),
            spp: reference.spp,
            uniform_spp: reference.uniform_spp,
        });
        let truth = Truth::new(&subject, &reference)?;
        let mut runner = ArmRunner::new(&subject, &reference, &truth, settings);
        for &arm in &settings.arms {
            let runs = runner.runs(arm, say)?;
            results.add(&subject.name, arm, &runs);
            results.pictures.push(runner.pictures(arm));
            results.curves.extend(runner.curve(arm, &runs)?);
        }
        say(&results.scene_lines(&subject.name));
        results.summarise();
        results.write(&settings.output)?;
    }
    Ok(results)
}
