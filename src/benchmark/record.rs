//! What the benchmark found: one record a scene, arm, seed and coverage, and the summary over scenes. Plain values:
//! they are measured and averaged elsewhere.

use super::arm::Arm;
use super::curve::Curve;
use super::pictures::ShownPicture;
use super::report::html;
use super::runner::{EnergyBias, Run};
use super::summary::{GeometricMean, INTERVAL_LEVEL, geometric_mean};
use super::table::csv;
use super::{BenchSettings, COVERAGES, MAIN_COVERAGE};
use crate::json_file;
use anyhow::Result;
use fechner_perception::Plane;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// Pixels count as clearly above the target from this many times v\* on.
pub(super) const CLEARLY_ABOVE: f64 = 1.25;

/// One arm of one scene with one seed (or all of them pooled) at one coverage. `samples` and `seconds` are what the arm
/// needs to bring this share of the picture to v\*: those of the render, scaled by v² ∝ 1/n.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    /// Scene.
    pub scene: String,
    /// Arm.
    pub arm: Arm,
    /// Seed; `None` for all seeds pooled (mean over them of v², and of what each pixel's v² needs).
    pub seed: Option<u64>,
    /// Share of the picture that has to be at v\*.
    pub coverage: f64,
    /// Samples a pixel that the arm needs.
    pub samples: f64,
    /// Seconds that it needs.
    pub seconds: f64,
    /// True v at this coverage over v\* in the render itself.
    pub reached: f64,
    /// Uniform sampling's need over this arm's; `None`, as in the next two, where there is nobody to compare with, or
    /// one of the two needs nothing since nothing of its error can be seen.
    pub speedup_samples: Option<f64>,
    /// Uniform sampling's need in seconds over this arm's; `None` for the reasons of [`Self::speedup_samples`].
    pub speedup_seconds: Option<f64>,
    /// The oracle's samples over this arm's.
    pub efficiency: Option<f64>,
    /// Mean luminance over the reference's, less 1; `None` where the reference is black.
    pub energy_bias: Option<f64>,
    /// Half width of its 95 % interval.
    pub energy_bias_ci: Option<f64>,
    /// Share of pixels that ended with true v above `CLEARLY_ABOVE` v\*.
    pub overshoot_fraction: f64,
    /// Share of the time that is not tracing.
    pub overhead: f64,
    /// Share of the time that goes to the look at the finished picture, which is part of [`Self::overhead`] and which
    /// its report takes whoever chose the samples.
    pub last_look: f64,
    /// Mean LDR-FLIP to the reference.
    pub flip_mean: f64,
    /// 99th percentile of LDR-FLIP to the reference.
    pub flip_p99: f64,
    /// ColorVideoVDP.
    pub jod: f64,
    /// Relative mean squared error of the displayed picture.
    pub relmse: f64,
}

impl Record {
    /// "+0.12 ± 0.69 %", or a dash where the reference is black.
    pub(crate) fn energy_bias_in_words(&self) -> String {
        let (Some(bias), Some(margin)) = (self.energy_bias, self.energy_bias_ci) else { return "–".to_owned() };
        format!("{:+.2} ± {:.2} %", 100.0 * bias, 100.0 * margin)
    }
}

/// One arm at one coverage over all scenes.
#[derive(Clone, Debug, Serialize)]
pub struct ArmSummary {
    /// Arm.
    pub arm: Arm,
    /// Coverage.
    pub coverage: f64,
    /// Uniform's samples over the arm's; `None`, as in the next two, where no scene has such a ratio.
    pub speedup_samples: Option<GeometricMean>,
    /// Uniform's seconds over the arm's; `None` where no scene has such a ratio.
    pub speedup_seconds: Option<GeometricMean>,
    /// Oracle's samples over the arm's.
    pub efficiency: Option<GeometricMean>,
}

/// What a scene was judged against.
#[derive(Clone, Debug, Serialize)]
pub struct ReferenceOf {
    /// Scene.
    pub scene: String,
    /// Samples a pixel of its reference.
    pub spp: u32,
    /// Samples a pixel that uniform sampling was found to need for v\* on 99 %, of which `reference_factor` is a
    /// multiple.
    pub uniform_spp: f64,
}

/// The results of a run over scenes and arms.
#[derive(Clone, Debug, Serialize)]
pub struct Results {
    /// Version of this file's layout.
    pub schema: u32,
    /// Version of the program.
    pub fechner_version: &'static str,
    /// Picture size.
    pub size: (u32, u32),
    /// v\*.
    pub visibility: f64,
    /// Display preset.
    pub display: String,
    /// Seeds of each arm.
    pub seeds: u32,
    /// Arms, in the order in which they ran.
    pub arms: Vec<Arm>,
    /// Samples of the references that were asked for, as a multiple of what uniform sampling needs.
    pub reference_factor: f64,
    /// References, one a scene.
    pub references: Vec<ReferenceOf>,
    /// Level of the intervals of `summary`.
    pub interval_level: f64,
    /// Records, one a scene, arm, seed and coverage.
    pub records: Vec<Record>,
    /// Summaries over scenes.
    pub summary: Vec<ArmSummary>,
    /// How pictures come to be good, one a scene and arm.
    pub curves: Vec<Curve>,
    #[serde(skip)]
    pub(crate) pictures: Vec<ScenePictures>,
}

/// What the report shows of a scene.
#[derive(Clone, Debug)]
pub(crate) struct ScenePictures {
    pub(crate) scene: String,
    pub(crate) arm: Arm,
    pub(crate) pictures: Vec<ShownPicture>,
}

impl Results {
    pub(crate) fn new(settings: &BenchSettings) -> Self {
        Self {
            schema: 3,
            fechner_version: env!("CARGO_PKG_VERSION"),
            size: settings.size,
            visibility: settings.visibility,
            display: settings.display.clone(),
            seeds: settings.seeds,
            arms: settings.arms.clone(),
            reference_factor: settings.reference_factor,
            references: Vec::new(),
            interval_level: INTERVAL_LEVEL,
            records: Vec::new(),
            summary: Vec::new(),
            curves: Vec::new(),
            pictures: Vec::new(),
        }
    }

    /// Adds an arm's runs of a scene: records of each, and of all of them pooled.
    pub(crate) fn add(&mut self, scene: &str, arm: Arm, runs: &[Run]) {
        for run in runs {
            self.add_pooled(scene, arm, Some(run.seed), std::slice::from_ref(run));
        }
        self.add_pooled(scene, arm, None, runs);
    }

    /// Adds the records of some runs as of one.
    fn add_pooled(&mut self, scene: &str, arm: Arm, seed: Option<u64>, runs: &[Run]) {
        let target = self.visibility * self.visibility;
        let pixels = f64::from(self.size.0) * f64::from(self.size.1);
        let mean = |of: fn(&Run) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
        // A seed whose render took few samples shows more error and needs no more for it: v² counts by what its render
        // took.
        let (Some(energy), Some(by_samples), Some(by_seconds)) = (
            mean_energy(runs, |_| 1.0),
            mean_energy(runs, |run| run.samples as f64 / pixels),
            mean_energy(runs, |run| run.seconds),
        ) else {
            return;
        };
        let above = energy.values().iter().filter(|&&v| f64::from(v) > CLEARLY_ABOVE * CLEARLY_ABOVE * target).count();
        let bias = pooled_bias(runs);
        self.records.extend(COVERAGES.map(|coverage| Record {
            scene: scene.to_owned(),
            arm,
            seed,
            coverage,
            samples: by_samples.quantile(coverage) / target,
            seconds: by_seconds.quantile(coverage) / target,
            reached: (energy.quantile(coverage) / target).sqrt(),
            speedup_samples: None,
            speedup_seconds: None,
            efficiency: None,
            energy_bias: bias.map(|bias| bias.value),
            energy_bias_ci: bias.map(|bias| 1.96 * bias.standard_error),
            overshoot_fraction: above as f64 / energy.values().len() as f64,
            overhead: mean(|run| run.seconds_perception) / mean(|run| run.seconds),
            last_look: mean(|run| run.seconds_last_look) / mean(|run| run.seconds),
            flip_mean: mean(|run| run.flip_mean),
            flip_p99: mean(|run| run.flip_p99),
            jod: mean(|run| run.jod),
            relmse: mean(|run| run.relmse),
        }));
    }

    fn find(&self, scene: &str, arm: Arm, seed: Option<u64>, coverage: f64) -> Option<&Record> {
        self.records.iter().find(|r| r.scene == scene && r.arm == arm && r.seed == seed && r.coverage == coverage)
    }

    /// Ratios to uniform sampling and to the oracle, and their means over scenes.
    pub(crate) fn summarise(&mut self) {
        for i in 0..self.records.len() {
            let r = &self.records[i];
            let uniform = self.find(&r.scene, Arm::Uniform, r.seed, r.coverage);
            let oracle = self.find(&r.scene, Arm::Oracle, r.seed, r.coverage);
            let speedup_samples = uniform.and_then(|uniform| ratio(uniform.samples, r.samples));
            let speedup_seconds = uniform.and_then(|uniform| ratio(uniform.seconds, r.seconds));
            let efficiency = oracle.and_then(|oracle| ratio(oracle.samples, r.samples));
            self.records[i] = Record { speedup_samples, speedup_seconds, efficiency, ..r.clone() };
        }
        let mut arms: Vec<Arm> = Vec::new();
        for record in &self.records {
            if !arms.contains(&record.arm) {
                arms.push(record.arm);
            }
        }
        self.summary = COVERAGES
            .into_iter()
            .flat_map(|coverage| arms.iter().map(move |&arm| (coverage, arm)))
            .map(|(coverage, arm)| ArmSummary {
                arm,
                coverage,
                speedup_samples: self.mean_of(arm, coverage, |r| r.speedup_samples),
                speedup_seconds: self.mean_of(arm, coverage, |r| r.speedup_seconds),
                efficiency: self.mean_of(arm, coverage, |r| r.efficiency),
            })
            .collect();
    }

    /// Mean over the scenes that have such a figure.
    fn mean_of(&self, arm: Arm, coverage: f64, of: fn(&Record) -> Option<f64>) -> Option<GeometricMean> {
        let mine = || self.records.iter().filter(|r| r.arm == arm && r.coverage == coverage);
        let of_seeds = |scene: &str| mine().filter(|r| r.seed.is_some() && r.scene == scene).filter_map(of).collect();
        let by_scene = mine().filter(|r| r.seed.is_none()).filter_map(|r| Some((of(r)?, of_seeds(&r.scene))));
        let (pooled, by_seed): (Vec<f64>, Vec<Vec<f64>>) = by_scene.unzip();
        (!pooled.is_empty()).then(|| geometric_mean(&pooled, &by_seed))
    }

    /// Records of a scene, all seeds pooled, at [`MAIN_COVERAGE`].
    pub(super) fn pooled(&self, scene: &str) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(move |r| r.scene == scene && r.seed.is_none() && r.coverage == MAIN_COVERAGE)
    }

    /// The pooled figures of a scene, one line an arm.
    pub(crate) fn scene_lines(&self, scene: &str) -> String {
        let mut text = String::new();
        for r in self.pooled(scene) {
            let _ = writeln!(
                text,
                "{scene}: {:<20} {:>8.1} spp for v* on 99 % (rendered at {:.2} v*), JOD {:.2}, FLIP {:.4}, bias {}",
                r.arm.name(),
                r.samples,
                r.reached,
                r.jod,
                r.flip_mean,
                r.energy_bias_in_words()
            );
        }
        text
    }

    /// Writes `results.json`, `results.csv` and `report.html`.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        json_file::write(&folder.join("results.json"), self)?;
        for (name, text) in [("results.csv", csv(&self.records)), ("report.html", html(self))] {
            let path = folder.join(name);
            crate::output::write_beside(&path, |file| std::io::Write::write_all(file, text.as_bytes()))?;
        }
        Ok(())
    }
}

/// How much larger one need is than another; `None` where one of them is nothing.
fn ratio(of: f64, to: f64) -> Option<f64> {
    Some(of / to).filter(|ratio| ratio.is_finite() && *ratio > 0.0)
}

/// Mean over runs of their v² times a weight; `None` where none has it.
fn mean_energy(runs: &[Run], weight: impl Fn(&Run) -> f64) -> Option<Plane> {
    let weighted = |run: &Run| {
        let weight = weight(run) as f32;
        Some(run.squared_visibility.as_ref()?.map(|v| v * weight))
    };
    let planes: Vec<Plane> = runs.iter().filter_map(weighted).collect();
    let sum = planes.iter().skip(1).fold(planes.first()?.clone(), |sum, plane| sum.combined(plane, |a, b| a + b));
    Some(sum.map(|v| v / planes.len() as f32))
}

/// Mean energy bias of several seeds: each seed's own error averages out, the reference's is in all of them.
fn pooled_bias(runs: &[Run]) -> Option<EnergyBias> {
    let biases = runs.iter().map(|run| run.energy_bias).collect::<Option<Vec<EnergyBias>>>()?;
    let seeds = biases.len() as f64;
    let own = |bias: &EnergyBias| (bias.standard_error.powi(2) - bias.reference_error.powi(2)).max(0.0);
    let own_variance = biases.iter().map(own).sum::<f64>() / (seeds * seeds);
    let reference_error = biases.iter().map(|bias| bias.reference_error).sum::<f64>() / seeds;
    Some(EnergyBias {
        value: biases.iter().map(|bias| bias.value).sum::<f64>() / seeds,
        standard_error: own_variance.sqrt().hypot(reference_error),
        reference_error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(size: (u32, u32)) -> Results {
        Results::new(&BenchSettings {
            scenes: Vec::new(),
            size,
            visibility: 1.0,
            arms: Vec::new(),
            seeds: 1,
            reference_factor: 1.0,
            display: "desktop".into(),
            output: "".into(),
        })
    }

    /// A render of 2×1 pixels with this v².
    fn run(seed: u64, samples: u64, squared_visibility: f32) -> Run {
        Run {
            seed,
            knob: None,
            samples,
            seconds: 1.0,
            seconds_perception: 0.0,
            seconds_last_look: 0.0,
            energy_bias: Some(EnergyBias { value: 0.0, standard_error: 5.0, reference_error: 3.0 }),
            flip_mean: 0.0,
            flip_p99: 0.0,
            jod: 10.0,
            relmse: 0.0,
            audit_ratio: None,
            squared_visibility: Some(Plane::filled(2, 1, squared_visibility)),
        }
    }

    /// More seeds bring the interval down to what the reference leaves, and no further.
    #[test]
    fn the_references_error_is_in_every_seed() {
        let error = |seeds: u64| {
            let runs: Vec<Run> = (0..seeds).map(|seed| run(seed, 1, 1.0)).collect();
            pooled_bias(&runs).expect("known").standard_error
        };
        assert!((error(1) - 5.0).abs() < 1e-12);
        assert!((error(4) - 13f64.sqrt()).abs() < 1e-12);
        assert!((error(10_000) - 3.0).abs() < 1e-3);
    }

    /// Two renders that each need 100 samples a pixel, one from 10 and one from 1000.
    #[test]
    fn seeds_of_one_need_have_that_need_together() {
        let mut results = results((2, 1));
        results.add("box", Arm::Relative, &[run(0, 20, 10.0), run(1, 2000, 0.1)]);
        for record in &results.records {
            assert!((record.samples - 100.0).abs() < 1e-3, "{record:?}");
        }
    }

    /// Where nothing can be seen of an error there are no ratios, and means are of the other scenes.
    #[test]
    fn scenes_without_noise_have_no_ratios() {
        let mut results = results((2, 1));
        for (scene, energies) in [("flat", [0.0, 0.0]), ("half", [0.0, 1.0]), ("box", [2.0, 1.0])] {
            for (arm, energy) in [Arm::Uniform, Arm::AsAsked].into_iter().zip(energies) {
                results.add(scene, arm, &[Run { energy_bias: None, ..run(0, 32, energy) }]);
            }
        }
        results.summarise();
        let of = |scene: &str| results.records.iter().rfind(|r| r.scene == scene).and_then(|r| r.speedup_samples);
        assert_eq!((of("flat"), of("half"), of("box")), (None, None, Some(2.0)));
        assert!(results.summary.iter().all(|s| s.efficiency.is_none()), "no oracle");
        assert_eq!(results.summary[1].speedup_samples.map(|mean| (mean.value, mean.least)), Some((2.0, 2.0)));
    }
}
