//! Renders an arm, judges it, and keeps what was found, so that no render is made twice. Means over scenes are left to
//! `summary`.

use super::arm::Arm;
use super::curve::{Curve, course};
use super::keep::{keep_pixels, kept_or_made, kept_pixels};
use super::knob::nearest;
use super::metrics::Metrics;
use super::oracle::{displayed_variance, least_samples, trace_counts, uniform_samples};
use super::pictures::{are_there, read_pictures, write_pictures};
use super::record::ScenePictures;
use super::reference::Reference;
use super::truth::Truth;
use super::{BenchSettings, MAIN_COVERAGE, Subject};
use crate::adaptive::statistics::picture_variance;
use crate::adaptive::{Quiet, Rendered, render};
use crate::film::Film;
use crate::json_file;
use anyhow::{Context, Result};
use fechner_perception::Plane;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arms whose pictures stand in the report.
const PICTURED: [Arm; 4] = [Arm::Uniform, Arm::Relative, Arm::AsAsked, Arm::Oracle];

/// Arms whose course stands in the report.
const CURVED: [Arm; 3] = [Arm::Uniform, Arm::Relative, Arm::AsAsked];

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
    /// Seconds of the look at the finished picture, part of [`Self::seconds_perception`], which its report takes
    /// whoever chose the samples.
    pub(crate) seconds_last_look: f64,
    /// Energy bias against the reference; `None` where that is black.
    pub(crate) energy_bias: Option<EnergyBias>,
    pub(crate) flip_mean: f64,
    pub(crate) flip_p99: f64,
    pub(crate) jod: f64,
    pub(crate) relmse: f64,
    pub(crate) audit_ratio: Option<f64>,
    /// v² of its error, written beside the record.
    #[serde(skip)]
    pub(crate) squared_visibility: Option<Plane>,
}

/// Mean luminance over the reference's, less 1.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct EnergyBias {
    pub(crate) value: f64,
    pub(crate) standard_error: f64,
    /// The reference's part of that, which is the same for all seeds.
    pub(crate) reference_error: f64,
}

/// A run and what its pictures are made of.
struct Judged {
    run: Run,
    film: Film,
    /// As displayed: linear RGB, 0..1.
    picture: Vec<[f32; 3]>,
}

/// A film and what making it took.
struct Made {
    film: Film,
    seconds: f64,
    seconds_perception: f64,
    seconds_last_look: f64,
    audit_ratio: Option<f64>,
}

impl From<Rendered> for Made {
    fn from(rendered: Rendered) -> Self {
        Self {
            film: rendered.film,
            seconds: rendered.seconds.total,
            seconds_perception: rendered.seconds.perception,
            seconds_last_look: rendered.judgement.seconds,
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
    /// Runs of the loop as asked, for the arm of equal time.
    runs_as_asked: Vec<Run>,
}

impl<'a> ArmRunner<'a> {
    pub(crate) fn new(
        subject: &'a Subject,
        reference: &'a Reference,
        truth: &'a Truth,
        settings: &'a BenchSettings,
    ) -> Self {
        Self { subject, reference, truth, settings, variance: None, runs_as_asked: Vec::new() }
    }

    /// The arm's runs, those that are there read back.
    pub(crate) fn runs(&mut self, arm: Arm, say: &dyn Fn(&str)) -> Result<Vec<Run>> {
        let mut runs: Vec<Run> = Vec::new();
        let mut knob = None;
        for seed in 0..u64::from(self.settings.seeds) {
            let file = self.file(arm, seed);
            let shows_pictures = seed == 0 && PICTURED.contains(&arm);
            let kept = self.read(&file, say).filter(|_| !shows_pictures || are_there(&file));
            let run = match kept {
                Some(run) => run,
                None => {
                    let run = if seed == 0 { self.first_run(arm)? } else { self.judged(arm, seed, knob)?.run };
                    self.write(&file, &run)?;
                    run
                }
            };
            knob = run.knob.or(knob);
            runs.push(run);
        }
        if arm == Arm::AsAsked {
            self.runs_as_asked.clone_from(&runs);
        }
        say(&format!("{}: {} done", self.subject.name, arm.name()));
        Ok(runs)
    }

    /// The run of the first seed, its pictures written for the report. An arm with a knob is rendered up to four times
    /// for 99 % of the picture at v\*.
    fn first_run(&mut self, arm: Arm) -> Result<Run> {
        let uniform_spp = match arm {
            Arm::Uniform => uniform_samples(self.subject, self.truth, &self.variance()?.clone(), MAIN_COVERAGE),
            _ => self.reference.uniform_spp,
        };
        let judged = match arm.first_knob(self.subject, uniform_spp) {
            None => self.judged(arm, 0, None)?,
            Some(knob) if !arm.is_searched() => self.judged(arm, 0, Some(knob))?,
            Some(first) => nearest(first, |knob| {
                let judged = self.judged(arm, 0, Some(knob))?;
                let energy = judged.run.squared_visibility.as_ref().context("a fresh run")?;
                let reached = energy.quantile(MAIN_COVERAGE).sqrt() / self.subject.visibility;
                Ok((judged, reached))
            })?,
        };
        if PICTURED.contains(&arm) {
            self.write_pictures(arm, &judged)?;
        }
        Ok(judged.run)
    }

    fn write_pictures(&self, arm: Arm, judged: &Judged) -> Result<()> {
        let Judged { run, film, picture } = judged;
        let energy = run.squared_visibility.as_ref().context("a fresh run")?;
        write_pictures(&self.file(arm, run.seed), self.subject, film, picture, energy)
    }

    fn judged(&mut self, arm: Arm, seed: u64, knob: Option<f64>) -> Result<Judged> {
        let made = self.make(arm, seed, knob)?;
        let estimate = made.film.estimate(self.subject.scene.nits_per_unit);
        let picture = self.truth.displayed(&estimate.rgb_cd_m2);
        let metrics: Metrics = self.truth.measure(&picture)?;
        let run = Run {
            seed,
            knob,
            samples: made.film.total_samples(),
            seconds: made.seconds,
            seconds_perception: made.seconds_perception,
            seconds_last_look: made.seconds_last_look,
            energy_bias: self.energy_bias(&made.film, &estimate.luminance_cd_m2),
            flip_mean: metrics.flip_mean,
            flip_p99: metrics.flip_p99,
            jod: metrics.jod,
            relmse: metrics.relmse,
            audit_ratio: made.audit_ratio,
            squared_visibility: Some(self.truth.squared_visibility(&picture)),
        };
        Ok(Judged { run, film: made.film, picture })
    }

    fn energy_bias(&self, film: &Film, luminance_cd_m2: &Plane) -> Option<EnergyBias> {
        let sum = |plane: &Plane| plane.values().iter().map(|&v| f64::from(v)).sum::<f64>();
        let truth = sum(&self.reference.luminance());
        // The reference's own error, from its halves' scatter, belongs to the interval.
        let [a, b] = self.reference.halves.each_ref();
        let own: f64 = a.iter().zip(b).map(|(a, b)| half_difference(*a, *b).powi(2)).sum();
        let variance = sum(&picture_variance(film, self.subject.scene.nits_per_unit)) + own;
        (truth > 0.0).then(|| EnergyBias {
            value: sum(luminance_cd_m2) / truth - 1.0,
            standard_error: variance.sqrt() / truth,
            reference_error: own.sqrt() / truth,
        })
    }

    fn make(&mut self, arm: Arm, seed: u64, knob: Option<f64>) -> Result<Made> {
        let knob = match arm {
            Arm::Oracle => return self.make_oracle(seed, knob.unwrap_or(self.subject.visibility)),
            Arm::UniformEqualTime => self.equal_time_spp(seed)?.sqrt().recip(),
            Arm::ToThreshold => self.spp_as_asked(seed)?.sqrt().recip(),
            _ => knob.unwrap_or(self.subject.visibility),
        };
        let settings = arm.settings(self.subject, knob, self.reference.uniform_spp)?;
        Ok(render(&self.subject.tracer(seed + 1), &settings, &Quiet)?.into())
    }

    fn make_oracle(&mut self, seed: u64, visibility: f64) -> Result<Made> {
        let variance = self.variance()?.clone();
        let counts = least_samples(self.truth, &variance, visibility, MAIN_COVERAGE)?;
        let started = Instant::now();
        let film = trace_counts(self.subject, &counts, seed + 1);
        let seconds = started.elapsed().as_secs_f64();
        Ok(Made { film, seconds, seconds_perception: 0.0, seconds_last_look: 0.0, audit_ratio: None })
    }

    /// Samples a pixel that uniform sampling takes in the time of the loop's run as asked with this seed.
    fn equal_time_spp(&self, seed: u64) -> Result<f64> {
        let run = self.run_as_asked(seed)?;
        // By the share of time outside of the tracer, which the machine's other work changes less than seconds.
        let tracing = 1.0 - run.seconds_perception / run.seconds;
        Ok((self.spp_as_asked(seed)? / tracing).max(16.0))
    }

    /// Samples a pixel of the loop's run as asked with this seed.
    fn spp_as_asked(&self, seed: u64) -> Result<f64> {
        Ok(self.run_as_asked(seed)?.samples as f64 / self.subject.pixels())
    }

    fn run_as_asked(&self, seed: u64) -> Result<&Run> {
        self.runs_as_asked.get(seed as usize).context("the arm as-asked comes before those of as much time or samples")
    }

    /// How the arm's picture comes to be good, for arms that have a curve: the first seed rendered once more.
    pub(crate) fn curve(&mut self, arm: Arm, runs: &[Run]) -> Result<Option<Curve>> {
        let Some(first) = runs.first().filter(|_| CURVED.contains(&arm)) else { return Ok(None) };
        let file = self.file(arm, 0).with_extension("curve.json");
        let points = kept_or_made(&file, || {
            let knob = first.knob.unwrap_or(self.subject.visibility);
            let settings = arm.settings(self.subject, knob, self.reference.uniform_spp)?;
            course(self.subject, self.truth, &settings, first.seed + 1)
        })?;
        Ok(Some(Curve { scene: self.subject.name.clone(), arm, points }))
    }

    /// What the report shows of the arm.
    pub(crate) fn pictures(&self, arm: Arm) -> ScenePictures {
        let pictures = read_pictures(&self.file(arm, 0));
        ScenePictures { scene: self.subject.name.clone(), arm, pictures }
    }

    fn variance(&mut self) -> Result<&Plane> {
        if self.variance.is_none() {
            self.variance = Some(displayed_variance(self.subject, self.reference, self.truth)?);
        }
        self.variance.as_ref().context("just made")
    }

    fn file(&self, arm: Arm, seed: u64) -> PathBuf {
        let key = self.subject.key(self.settings.reference_factor);
        let name = format!("{}-{key}-{}-{seed}.json", self.subject.file_name(), arm.name());
        self.settings.output.join("runs").join(name)
    }

    fn read(&self, file: &Path, say: &dyn Fn(&str)) -> Option<Run> {
        let mut run: Run = json_file::read(file)?;
        let Reference { width, height, .. } = *self.reference;
        let values = kept_pixels(&file.with_extension("f32"), width * height, say)?;
        run.squared_visibility = Plane::from_values(width, height, values).ok();
        Some(run)
    }

    fn write(&self, file: &Path, run: &Run) -> Result<()> {
        if let Some(plane) = &run.squared_visibility {
            keep_pixels(&file.with_extension("f32"), plane.values())?;
        }
        Ok(json_file::write(file, run)?)
    }
}

/// Half the difference of two colours' luminance.
fn half_difference(a: [f32; 3], b: [f32; 3]) -> f64 {
    use fechner_perception::photometry::luminance;
    0.5 * f64::from(luminance(a) - luminance(b))
}
