//! What the benchmark found: one record a scene, arm, seed and coverage, and the summary over scenes.

use super::arm::Arm;
use super::curve::Curve;
use super::reference::Reference;
use super::report::html;
use super::runner::Run;
use super::summary::{GeometricMean, geometric_mean};
use super::{BenchSettings, COVERAGES, Subject};
use anyhow::Result;
use fechner_perception::Plane;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// One arm of one scene with one seed (or all of them pooled) at one coverage. `samples` and `seconds` are what the arm
/// needs to bring this share of the picture to v\*: those of the render, scaled by v² ∝ 1/n.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    /// Scene.
    pub scene: String,
    /// Arm.
    pub arm: &'static str,
    /// Seed; `None` for all seeds pooled (mean of v² over them).
    pub seed: Option<u64>,
    /// Share of the picture that has to be at v\*.
    pub coverage: f64,
    /// Samples a pixel that the arm needs.
    pub samples: f64,
    /// Seconds that it needs.
    pub seconds: f64,
    /// True v at this coverage over v\* in the render itself.
    pub reached: f64,
    /// Uniform sampling's need over this arm's.
    pub speedup_samples: f64,
    /// The same in seconds.
    pub speedup_seconds: f64,
    /// The oracle's samples over this arm's.
    pub efficiency: Option<f64>,
    /// Mean luminance over the reference's, less 1.
    pub energy_bias: f64,
    /// Half width of its 95 % interval.
    pub energy_bias_ci: f64,
    /// Share of pixels that ended with true v above 1.25 v\*.
    pub overshoot_fraction: f64,
    /// Share of the time that is not tracing.
    pub overhead: f64,
    /// Of that, the look at the finished picture, which its report takes whoever chose the samples.
    pub last_look: f64,
    /// Mean LDR-FLIP to the reference.
    pub flip_mean: f64,
    /// Its 99th percentile.
    pub flip_p99: f64,
    /// ColorVideoVDP.
    pub jod: f64,
    /// Relative mean squared error of the displayed picture.
    pub relmse: f64,
}

/// Everything over all scenes at one coverage for one arm.
#[derive(Clone, Debug, Serialize)]
pub struct ArmSummary {
    /// Arm.
    pub arm: &'static str,
    /// Coverage.
    pub coverage: f64,
    /// Uniform's samples over the arm's.
    pub speedup_samples: GeometricMean,
    /// The same in seconds.
    pub speedup_seconds: GeometricMean,
    /// Oracle's samples over the arm's.
    pub efficiency: Option<GeometricMean>,
}

/// All results.
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
    /// One a scene, arm, seed and coverage.
    pub records: Vec<Record>,
    /// Over scenes.
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
    pub(crate) arm: &'static str,
    /// Title and PNG bytes.
    pub(crate) pictures: Vec<(String, Vec<u8>)>,
}

impl Results {
    pub(crate) fn new(settings: &BenchSettings) -> Self {
        Self {
            schema: 1,
            fechner_version: env!("CARGO_PKG_VERSION"),
            size: settings.size,
            visibility: settings.visibility,
            display: settings.display.clone(),
            seeds: settings.seeds,
            records: Vec::new(),
            summary: Vec::new(),
            curves: Vec::new(),
            pictures: Vec::new(),
        }
    }

    /// Adds an arm's runs of a scene: a record each, and one for all of them pooled.
    pub(crate) fn add(&mut self, subject: &Subject, reference: &Reference, arm: Arm, runs: &[Run]) {
        let pixels = subject.pixels();
        let planes: Vec<&Plane> = runs.iter().filter_map(|run| run.squared_visibility.as_ref()).collect();
        let mean = |of: fn(&Run) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
        let mut pooled = Run {
            seed: 0,
            knob: None,
            samples: mean(|r| r.samples as f64) as u64,
            seconds: mean(|r| r.seconds),
            seconds_perception: mean(|r| r.seconds_perception),
            seconds_last_look: mean(|r| r.seconds_last_look),
            energy_bias: mean(|r| r.energy_bias),
            energy_bias_standard_error: pooled_bias_error(runs),
            energy_bias_reference_error: mean(|r| r.energy_bias_reference_error),
            flip_mean: mean(|r| r.flip_mean),
            flip_p99: mean(|r| r.flip_p99),
            jod: mean(|r| r.jod),
            relmse: mean(|r| r.relmse),
            audit_ratio: None,
            squared_visibility: None,
        };
        pooled.squared_visibility = Some(Plane::from_fn(reference.width, reference.height, |x, y| {
            planes.iter().map(|plane| plane.get(x, y)).sum::<f32>() / planes.len() as f32
        }));
        let all = runs.iter().map(|run| (Some(run.seed), run)).chain(std::iter::once((None, &pooled)));
        for (seed, run) in all {
            let Some(energy) = &run.squared_visibility else { continue };
            let target = subject.visibility * subject.visibility;
            let above = energy.values().iter().filter(|&&v| f64::from(v) > 1.5625 * target).count();
            for coverage in COVERAGES {
                let scale = energy.quantile(coverage) / target;
                self.records.push(Record {
                    scene: subject.name.clone(),
                    arm: arm.name(),
                    seed,
                    coverage,
                    samples: run.samples as f64 / pixels * scale,
                    seconds: run.seconds * scale,
                    reached: scale.sqrt(),
                    speedup_samples: 0.0,
                    speedup_seconds: 0.0,
                    efficiency: None,
                    energy_bias: run.energy_bias,
                    energy_bias_ci: 1.96 * run.energy_bias_standard_error,
                    overshoot_fraction: above as f64 / energy.values().len() as f64,
                    overhead: run.seconds_perception / run.seconds,
                    last_look: run.seconds_last_look / run.seconds,
                    flip_mean: run.flip_mean,
                    flip_p99: run.flip_p99,
                    jod: run.jod,
                    relmse: run.relmse,
                });
            }
        }
    }

    fn find(&self, scene: &str, arm: Arm, seed: Option<u64>, coverage: f64) -> Option<&Record> {
        self.records
            .iter()
            .find(|r| r.scene == scene && r.arm == arm.name() && r.seed == seed && r.coverage == coverage)
    }

    /// Ratios to uniform sampling and to the oracle, and their means over scenes.
    pub(crate) fn summarise(&mut self) {
        for i in 0..self.records.len() {
            let r = &self.records[i];
            let uniform = self.find(&r.scene, Arm::Uniform, r.seed, r.coverage).map(|u| (u.samples, u.seconds));
            let oracle = self.find(&r.scene, Arm::Oracle, r.seed, r.coverage).map(|o| o.samples);
            let (samples, seconds) = (r.samples, r.seconds);
            let record = &mut self.records[i];
            if let Some(uniform) = uniform {
                record.speedup_samples = uniform.0 / samples;
                record.speedup_seconds = uniform.1 / seconds;
            }
            record.efficiency = oracle.map(|oracle| oracle / samples);
        }
        let mut arms: Vec<&'static str> = Vec::new();
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
                speedup_samples: self.mean_of(arm, coverage, |r| Some(r.speedup_samples)).unwrap_or_else(nothing),
                speedup_seconds: self.mean_of(arm, coverage, |r| Some(r.speedup_seconds)).unwrap_or_else(nothing),
                efficiency: self.mean_of(arm, coverage, |r| r.efficiency),
            })
            .collect();
    }

    fn mean_of(&self, arm: &str, coverage: f64, of: fn(&Record) -> Option<f64>) -> Option<GeometricMean> {
        let mine = || self.records.iter().filter(|r| r.arm == arm && r.coverage == coverage);
        let pooled: Vec<f64> = mine().filter(|r| r.seed.is_none()).filter_map(of).collect();
        let scenes = mine().filter(|r| r.seed.is_none()).map(|r| &r.scene);
        let by_seed: Vec<Vec<f64>> = scenes
            .map(|scene| mine().filter(|r| r.seed.is_some() && r.scene == *scene).filter_map(of).collect())
            .collect();
        (!pooled.is_empty()).then(|| geometric_mean(&pooled, &by_seed))
    }

    /// The pooled figures of a scene at 99 %, one line an arm.
    pub(crate) fn scene_lines(&self, scene: &str) -> String {
        let mut text = String::new();
        for r in self.records.iter().filter(|r| r.scene == scene && r.seed.is_none() && r.coverage == 0.99) {
            let _ = writeln!(
                text,
                "{scene}: {:<20} {:>8.1} spp for v* on 99 % (rendered at {:.2} v*), JOD {:.2}, FLIP {:.4}, bias {:+.2} ± {:.2} %",
                r.arm,
                r.samples,
                r.reached,
                r.jod,
                r.flip_mean,
                100.0 * r.energy_bias,
                100.0 * r.energy_bias_ci
            );
        }
        text
    }

    /// Writes `results.json`, `results.csv` and `report.html`.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        let json = serde_json::to_string_pretty(self)?;
        for (name, text) in [("results.json", json), ("results.csv", self.csv()), ("report.html", html(self))] {
            let path = folder.join(name);
            crate::output::write_beside(&path, |file| std::io::Write::write_all(file, text.as_bytes()))?;
        }
        Ok(())
    }

    fn csv(&self) -> String {
        let mut text = String::from(
            "scene,arm,seed,coverage,samples,seconds,reached,speedup_samples,speedup_seconds,efficiency,energy_bias,\
             energy_bias_ci,overshoot_fraction,overhead,last_look,flip_mean,flip_p99,jod,relmse\n",
        );
        for r in &self.records {
            let seed = r.seed.map_or_else(|| "all".to_owned(), |seed| seed.to_string());
            let efficiency = r.efficiency.map_or_else(String::new, |e| e.to_string());
            let _ = writeln!(
                text,
                "{},{},{seed},{},{},{},{},{},{},{efficiency},{},{},{},{},{},{},{},{},{}",
                r.scene,
                r.arm,
                r.coverage,
                r.samples,
                r.seconds,
                r.reached,
                r.speedup_samples,
                r.speedup_seconds,
                r.energy_bias,
                r.energy_bias_ci,
                r.overshoot_fraction,
                r.overhead,
                r.last_look,
                r.flip_mean,
                r.flip_p99,
                r.jod,
                r.relmse
            );
        }
        text
    }
}

/// Standard error of the mean energy bias of several seeds: each seed's own error averages out, the reference's is in all of them.
fn pooled_bias_error(runs: &[Run]) -> f64 {
    let of_runs = runs.len().max(1) as f64;
    let own = |run: &Run| (run.energy_bias_standard_error.powi(2) - run.energy_bias_reference_error.powi(2)).max(0.0);
    let own_variance = runs.iter().map(own).sum::<f64>() / (of_runs * of_runs);
    let of_reference = runs.iter().map(|run| run.energy_bias_reference_error).sum::<f64>() / of_runs;
    own_variance.sqrt().hypot(of_reference)
}

fn nothing() -> GeometricMean {
    GeometricMean { value: f64::NAN, low: None, high: None, least: f64::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// More seeds bring the interval down to what the reference leaves, and no further.
    #[test]
    fn the_references_error_is_in_every_seed() {
        let run = |seed: u64| Run {
            seed,
            knob: None,
            samples: 1,
            seconds: 1.0,
            seconds_perception: 0.0,
            seconds_last_look: 0.0,
            energy_bias: 0.0,
            energy_bias_standard_error: 5.0,
            energy_bias_reference_error: 3.0,
            flip_mean: 0.0,
            flip_p99: 0.0,
            jod: 10.0,
            relmse: 0.0,
            audit_ratio: None,
            squared_visibility: None,
        };
        let error = |seeds: u64| pooled_bias_error(&(0..seeds).map(run).collect::<Vec<_>>());
        assert!((error(1) - 5.0).abs() < 1e-12);
        assert!((error(4) - 13f64.sqrt()).abs() < 1e-12);
        assert!((error(10_000) - 3.0).abs() < 1e-3);
    }
}
