//! The arms of the benchmark, and how one of them is rendered.

use super::metrics::{Metrics, measure};
use super::oracle::{displayed_variance, optimal_samples, trace_counts, uniform_samples};
use super::pictures::{read_pictures, write_pictures};
use super::record::ScenePictures;
use super::reference::{Reference, read_plane, write_plane};
use super::truth::Truth;
use super::{BenchSettings, Subject};
use crate::adaptive::settings::{AllocationRule, LoopSettings, RivalRule, Sampling};
use crate::adaptive::{Quiet, Rendered, render};
use crate::film::Film;
use anyhow::{Context, Result};
use fechner_perception::{Plane, model};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::time::Instant;

/// A way to spend samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Arm {
    /// The same everywhere, as many as converged variances ask for.
    Uniform,
    /// The same everywhere, in the time that the default arm took.
    UniformEqualTime,
    /// Cycles' rule, its threshold searched.
    Relative,
    /// Relative standard error, its threshold searched.
    Variance,
    /// Tungsten's budget, its size searched.
    Budget,
    /// Threshold versus intensity alone drives the loop, its target searched.
    Tvi,
    /// Ramasubramanian 1999 drives the loop, its target searched.
    Ramasubramanian,
    /// Yee 2001 drives the loop, its target searched.
    Yee,
    /// Bolin and Meyer 1998 drives the loop, its target searched.
    BolinMeyer,
    /// Ablation: contrast sensitivity in bands, but each pixel by itself; its target searched.
    NoPooling,
    /// Ablation: each pixel's count by its own threshold, not the convex optimum.
    LocalRule,
    /// The loop as it is, asked for v\* and not tuned.
    Default,
    /// Converged variance, thresholds of the reference, convex optimum.
    Oracle,
}

impl Arm {
    /// Every arm.
    pub const ALL: [Arm; 13] = [
        Arm::Uniform,
        Arm::Relative,
        Arm::Variance,
        Arm::Budget,
        Arm::Tvi,
        Arm::Ramasubramanian,
        Arm::Yee,
        Arm::BolinMeyer,
        Arm::NoPooling,
        Arm::LocalRule,
        Arm::Default,
        Arm::UniformEqualTime,
        Arm::Oracle,
    ];
    /// Those of the quick suite.
    pub const QUICK: [Arm; 6] =
        [Arm::Uniform, Arm::Relative, Arm::Tvi, Arm::Default, Arm::UniformEqualTime, Arm::Oracle];

    /// What files and tables call it.
    pub fn name(self) -> &'static str {
        match self {
            Arm::Uniform => "uniform",
            Arm::UniformEqualTime => "uniform-equal-time",
            Arm::Relative => "relative",
            Arm::Variance => "variance",
            Arm::Budget => "budget",
            Arm::Tvi => "tvi",
            Arm::Ramasubramanian => "ramasubramanian",
            Arm::Yee => "yee",
            Arm::BolinMeyer => "bolin-meyer",
            Arm::NoPooling => "no-pooling",
            Arm::LocalRule => "local-rule",
            Arm::Default => "default",
            Arm::Oracle => "oracle",
        }
    }

    /// Where the search of the arm's knob begins, in the knob's unit; `None` for arms without one.
    fn first_knob(self, subject: &Subject, uniform_spp: f64) -> Option<f64> {
        match self {
            Arm::Relative => Some(0.01 * subject.visibility),
            Arm::Variance => Some(0.02 * subject.visibility),
            // Error goes as the root of the budget.
            Arm::Budget => Some((0.5 * uniform_spp).sqrt().recip()),
            Arm::Tvi | Arm::Ramasubramanian | Arm::Yee | Arm::BolinMeyer | Arm::NoPooling => Some(subject.visibility),
            _ => None,
        }
    }

    fn settings(self, subject: &Subject, knob: f64, uniform_spp: f64) -> Result<LoopSettings> {
        let mut settings = subject.loop_settings()?;
        // An arm that needs more than this has lost anyway.
        let most = (4.0 * uniform_spp).ceil() as u32;
        let by_model = |settings: &mut LoopSettings, name: &str| -> Result<()> {
            settings.model = Some(model::by_name(name).context("a model")?);
            settings.limits.visibility = knob;
            settings.limits.mean_samples = Some(most);
            Ok(())
        };
        match self {
            Arm::Relative => settings.sampling = Sampling::Rival(RivalRule::Relative { threshold: knob }),
            Arm::Variance => settings.sampling = Sampling::Rival(RivalRule::Variance { threshold: knob }),
            Arm::Budget => {
                settings.sampling = Sampling::Rival(RivalRule::Budget);
                settings.limits.mean_samples = Some((1.0 / (knob * knob)).clamp(16.0, f64::from(most)).ceil() as u32);
            }
            Arm::Tvi | Arm::Ramasubramanian | Arm::Yee | Arm::BolinMeyer => by_model(&mut settings, self.name())?,
            Arm::NoPooling => by_model(&mut settings, "csf-bands")?,
            Arm::LocalRule => settings.allocation = AllocationRule::Local,
            Arm::Uniform | Arm::UniformEqualTime => {
                settings.sampling = Sampling::Uniform;
                settings.limits.visibility = 0.0;
                settings.limits.mean_samples = Some(knob.ceil() as u32);
            }
            Arm::Default | Arm::Oracle => {}
        }
        if matches!(settings.sampling, Sampling::Rival(RivalRule::Relative { .. } | RivalRule::Variance { .. })) {
            settings.limits.mean_samples = Some(most);
            settings.limits.max_samples = most.saturating_mul(64);
        }
        Ok(settings)
    }
}

/// Arms whose pictures stand in the report.
const PICTURED: [Arm; 4] = [Arm::Uniform, Arm::Relative, Arm::Default, Arm::Oracle];

/// One render, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    pub(crate) seed: u64,
    /// Setting of the arm's knob, for arms that have one.
    pub(crate) knob: Option<f64>,
    pub(crate) samples: u64,
    pub(crate) seconds: f64,
    /// Time in perception, planning and audits.
    pub(crate) seconds_perception: f64,
    /// Mean luminance over the reference's, less 1, and its standard error.
    pub(crate) energy_bias: f64,
    pub(crate) energy_bias_standard_error: f64,
    pub(crate) flip_mean: f64,
    pub(crate) flip_p99: f64,
    pub(crate) jod: f64,
    pub(crate) relmse: f64,
    pub(crate) audit_ratio: Option<f64>,
    /// v² of its error, written beside the record.
    #[serde(skip)]
    pub(crate) squared_visibility: Option<Plane>,
}

/// A film and what making it took.
struct Made {
    film: Film,
    variance_of_mean: Vec<f32>,
    seconds: f64,
    seconds_perception: f64,
    audit_ratio: Option<f64>,
}

impl From<Rendered> for Made {
    fn from(rendered: Rendered) -> Self {
        Self {
            variance_of_mean: rendered.judgement.variance_of_mean.values().to_vec(),
            film: rendered.film,
            seconds: rendered.seconds_total,
            seconds_perception: rendered.seconds_perception,
            audit_ratio: rendered.audit.map(|audit| audit.ratio),
        }
    }
}

/// Renders arms of one scene.
pub(crate) struct ArmRunner<'a> {
    subject: &'a Subject,
    reference: &'a Reference,
    truth: &'a Truth,
    settings: &'a BenchSettings,
    variance: Option<Plane>,
    /// Seconds and samples of the default arm's runs, for the arm of equal time.
    default_runs: Vec<Run>,
}

impl<'a> ArmRunner<'a> {
    pub(crate) fn new(
        subject: &'a Subject,
        reference: &'a Reference,
        truth: &'a Truth,
        settings: &'a BenchSettings,
    ) -> Self {
        Self { subject, reference, truth, settings, variance: None, default_runs: Vec::new() }
    }

    /// The arm's runs, those that are there read back.
    pub(crate) fn runs(&mut self, arm: Arm, say: &dyn Fn(&str)) -> Result<Vec<Run>> {
        let mut runs: Vec<Run> = Vec::new();
        let mut knob = None;
        for seed in 0..u64::from(self.settings.seeds) {
            let file = self.file(arm, seed);
            let run = match self.read(&file) {
                Some(run) => run,
                None => {
                    if seed == 0 {
                        knob = self.searched_knob(arm)?;
                    }
                    let run = self.run(arm, seed, knob)?;
                    self.write(&file, &run)?;
                    run
                }
            };
            knob = run.knob.or(knob);
            runs.push(run);
        }
        if arm == Arm::Default {
            self.default_runs.clone_from(&runs);
        }
        say(&format!("{}: {} done", self.subject.name, arm.name()));
        Ok(runs)
    }

    /// The knob at which 99 % of the picture is at v\* (within 12 %), found with the first seed: error-like knobs scale the
    /// error they leave.
    fn searched_knob(&mut self, arm: Arm) -> Result<Option<f64>> {
        let Some(mut knob) = arm.first_knob(self.subject, self.reference.uniform_spp) else { return Ok(None) };
        for _ in 0..3 {
            let run = self.run(arm, 0, Some(knob))?;
            let energy = run.squared_visibility.as_ref().context("a fresh run")?;
            let reached = quantile(energy, 0.99).sqrt() / self.subject.visibility;
            let step = reached.clamp(0.1, 10.0);
            if (0.89..1.12).contains(&step) {
                break;
            }
            knob /= step;
        }
        Ok(Some(knob))
    }

    fn run(&mut self, arm: Arm, seed: u64, knob: Option<f64>) -> Result<Run> {
        let made = self.make(arm, seed, knob)?;
        let nits = self.subject.scene.nits_per_unit;
        let estimate = made.film.estimate(nits);
        let picture = self.truth.displayed(&estimate.rgb_cd_m2);
        let metrics: Metrics = measure(self.subject, self.truth, &picture)?;
        let mean = |plane: &Plane| plane.values().iter().map(|&v| f64::from(v)).sum::<f64>();
        let truth = mean(&self.reference.luminance());
        // The reference's own error, from its halves' scatter, belongs to the interval.
        let [a, b] = self.reference.halves.each_ref();
        let own: f64 = a.iter().zip(b).map(|(a, b)| half_difference(*a, *b).powi(2)).sum();
        let variance: f64 = made.variance_of_mean.iter().map(|&v| f64::from(v)).sum::<f64>() + own;
        let squared_visibility = self.truth.squared_visibility(&picture);
        if seed == 0 && PICTURED.contains(&arm) {
            write_pictures(&self.file(arm, seed), self.subject, &made.film, &picture, &squared_visibility)?;
        }
        Ok(Run {
            seed,
            knob,
            samples: made.film.total_samples(),
            seconds: made.seconds,
            seconds_perception: made.seconds_perception,
            energy_bias: mean(&estimate.luminance_cd_m2) / truth - 1.0,
            energy_bias_standard_error: variance.sqrt() / truth,
            flip_mean: metrics.flip_mean,
            flip_p99: metrics.flip_p99,
            jod: metrics.jod,
            relmse: metrics.relmse,
            audit_ratio: made.audit_ratio,
            squared_visibility: Some(squared_visibility),
        })
    }

    fn make(&mut self, arm: Arm, seed: u64, knob: Option<f64>) -> Result<Made> {
        let spp = match arm {
            Arm::Oracle => return self.make_oracle(seed),
            Arm::Uniform => {
                let variance = self.variance()?.clone();
                uniform_samples(self.subject, self.truth, &variance, 0.99).max(16.0)
            }
            Arm::UniformEqualTime => self.equal_time_spp(seed)?,
            _ => knob.unwrap_or(0.0),
        };
        let settings = arm.settings(self.subject, spp, self.reference.uniform_spp)?;
        Ok(render(&self.subject.tracer(seed + 1), &settings, &Quiet)?.into())
    }

    fn make_oracle(&mut self, seed: u64) -> Result<Made> {
        let variance = self.variance()?.clone();
        let counts = optimal_samples(self.subject, self.truth, &variance)?;
        let started = Instant::now();
        let film = trace_counts(self.subject, &counts, seed + 1);
        Ok(Made {
            variance_of_mean: film.estimate(self.subject.scene.nits_per_unit).variance_of_mean.values().to_vec(),
            film,
            seconds: started.elapsed().as_secs_f64(),
            seconds_perception: 0.0,
            audit_ratio: None,
        })
    }

    /// Samples a pixel that uniform sampling takes in the time of the default arm's run with this seed.
    fn equal_time_spp(&self, seed: u64) -> Result<f64> {
        let run = self.default_runs.get(seed as usize).context("the default arm comes before uniform-equal-time")?;
        // By the share of time outside of the tracer, which the machine's other work changes less than seconds.
        let tracing = 1.0 - run.seconds_perception / run.seconds;
        Ok((run.samples as f64 / self.subject.pixels() / tracing).max(16.0))
    }

    /// What the report shows of the arm.
    pub(crate) fn pictures(&self, arm: Arm) -> ScenePictures {
        let pictures = read_pictures(&self.file(arm, 0));
        ScenePictures { scene: self.subject.name.clone(), arm: arm.name(), pictures }
    }

    fn variance(&mut self) -> Result<&Plane> {
        if self.variance.is_none() {
            self.variance = Some(displayed_variance(self.subject, self.reference, self.truth)?);
        }
        self.variance.as_ref().context("just made")
    }

    fn file(&self, arm: Arm, seed: u64) -> PathBuf {
        let key = self.subject.key(self.settings.reference_factor);
        let version = env!("CARGO_PKG_VERSION");
        let name = format!("{}-{key:016x}-{version}-{}-{seed}.json", self.subject.name, arm.name());
        self.settings.output.join("runs").join(name)
    }

    fn read(&self, file: &std::path::Path) -> Option<Run> {
        let mut run: Run = serde_json::from_slice(&std::fs::read(file).ok()?).ok()?;
        let plane = read_plane(&file.with_extension("f32"), self.reference.width, self.reference.height)?;
        run.squared_visibility = Some(plane);
        Some(run)
    }

    fn write(&self, file: &std::path::Path, run: &Run) -> Result<()> {
        if let Some(plane) = &run.squared_visibility {
            write_plane(&file.with_extension("f32"), plane)?;
        }
        let text = serde_json::to_string_pretty(run)?;
        crate::output::write_beside(file, |file| std::io::Write::write_all(file, text.as_bytes()))?;
        Ok(())
    }
}

/// Half the difference of two colours' luminance.
fn half_difference(a: [f32; 3], b: [f32; 3]) -> f64 {
    use fechner_perception::photometry::luminance;
    0.5 * f64::from(luminance(a) - luminance(b))
}

/// The value that this share of a plane's pixels stays below.
pub(crate) fn quantile(plane: &Plane, share: f64) -> f64 {
    let mut values = plane.values().to_vec();
    let rank = (share * (values.len() - 1) as f64).round() as usize;
    let (_, &mut value, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    f64::from(value)
}
