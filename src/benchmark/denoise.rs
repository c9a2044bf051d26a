//! Denoised pictures: what the law says of them against what is true, and what samples cost to a quality.
//!
//! [`denoising`] renders the reference of each scene, then (1) judges uniform renders that are denoised and compares
//! tile by tile with what can truly be seen of their error, and (2) spends growing budgets by three rules and reads off
//! where the denoised pictures reach a quality by metrics that none of them optimises (`race.rs`). Not for animation.

use super::keep::kept_or_made;
use super::metrics::Metrics;
use super::name::distinct_names;
use super::race::{Race, RaceMean, RacePoint, RaceRule, compare_with_uniform, means};
use super::reference::Reference;
use super::truth::Truth;
use super::{BenchSettings, Subject, check_inputs, make_folders};
use crate::adaptive::settings::{DENOISED_PILOT_SAMPLES_PER_PIXEL, LoopSettings, RivalRule, Sampling};
use crate::adaptive::{Quiet, Rendered, render};
use crate::denoise::{Denoiser, DenoiserKind, denoise_film};
use crate::integrator::PILOT_SAMPLES_PER_PIXEL;
use crate::json_file;
use anyhow::Result;
use fechner_perception::Plane;
use fechner_perception::denoised::VISIBLY_WRONG;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::time::Instant;

/// Side of a tile, pixels.
const TILE: usize = 16;
/// Budgets, mean samples a pixel.
const BUDGETS: [u32; 7] = [4, 8, 16, 32, 64, 128, 256];
/// What a rule that ends by its own threshold may take, as a multiple of the budget that the threshold is made for:
/// scenes that need more for it than others are to end by the rule all the same.
const ROOM_OF_A_RIVAL: u32 = 8;
/// Cycles' measure of a single sample's noise, about: what 16 samples a pixel leave is 0.1, and it falls as the root of
/// the count.
const RELATIVE_NOISE_OF_ONE_SAMPLE: f64 = 0.4;
/// The visibility that our rule is told to aim at in a race: so low that it is the budget that ends it.
const OUT_OF_REACH: f64 = 0.01;
/// Budgets whose pictures the law is held against.
const JUDGED: [u32; 4] = [4, 16, 64, 256];

/// What to run beyond [`BenchSettings`].
#[derive(Clone, Debug)]
pub struct DenoisingSettings {
    /// Scenes, size, display, seeds, folder; `visibility` and `reference_factor` make the reference.
    pub bench: BenchSettings,
    /// Denoisers.
    pub denoisers: Vec<DenoiserKind>,
    /// Visibility for which tiles are called fine.
    pub target: f64,
    /// Whether to spend budgets by the three rules.
    pub with_races: bool,
}

/// The law against the truth for one picture.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Calibration {
    /// Scene.
    pub scene: String,
    /// Denoiser.
    pub denoiser: String,
    /// Samples a pixel, uniform.
    pub spp: u32,
    /// Seed.
    pub seed: u64,
    /// Spearman's rank correlation of predicted and true visibility over tiles; `None` where all tiles are alike.
    pub rank_correlation: Option<f64>,
    /// Root of the ratio of predicted to true energy over the picture; `None`, as in the next, where nothing is truly
    /// wrong.
    pub predicted_over_true: Option<f64>,
    /// Root of the ratio of energy that the variance alone predicts to true energy over the picture; `None`
    /// where nothing is truly wrong.
    pub variance_over_true: Option<f64>,
    /// Share of tiles called fine, and proven, whose true visibility is above 1.5 times the target.
    pub wrong_share: f64,
    /// Share of tiles called fine without proof whose true visibility is above 1.5 times the target.
    pub wrong_unproven_share: f64,
    /// Share of all tiles that are called fine.
    pub fine_share: f64,
    /// Share of all tiles called fine and unproven.
    pub unproven_share: f64,
    /// Share of all tiles whose true visibility is above 1.5 times the target.
    pub truly_wrong_share: f64,
    /// Squared bias over squared variance by band.
    pub bias_factors: Vec<f64>,
    /// ColorVideoVDP of the raw picture, JOD.
    pub jod_raw: f64,
    /// ColorVideoVDP of the denoised picture, JOD.
    pub jod: f64,
    /// Mean FLIP of the raw picture.
    pub flip_raw: f64,
    /// Mean FLIP of the denoised picture.
    pub flip: f64,
    /// Seconds of denoising the mean and both halves over those of tracing.
    pub overhead: f64,
}

/// The results of a run over scenes and denoisers.
#[derive(Clone, Debug, Default, Serialize)]
pub struct DenoisingResults {
    /// Calibrations, one a scene, denoiser, count and seed.
    pub calibrations: Vec<Calibration>,
    /// Races, one a scene, denoiser and rule.
    pub races: Vec<Race>,
    /// Means of the races, one a rule and quality.
    pub race_means: Vec<RaceMean>,
}

/// Runs every scene.
///
/// # Errors
/// Scenes that do not load, denoisers that are not installed, folders that cannot be written.
pub fn denoising(settings: &DenoisingSettings, say: &dyn Fn(&str)) -> Result<DenoisingResults> {
    let names = distinct_names(&settings.bench.scenes)?;
    let denoisers = settings.denoisers.iter().map(|&kind| Denoiser::open(kind)).collect::<Result<Vec<_>, _>>()?;
    check_inputs(&settings.bench.scenes, &settings.bench.display)?;
    make_folders(&settings.bench)?;
    let mut results = DenoisingResults::default();
    for (path, name) in settings.bench.scenes.iter().zip(names) {
        let subject = Subject::load(path, name, &settings.bench)?;
        let reference = Reference::cached(&subject, &settings.bench, say)?;
        let truth = Truth::new(&subject, &reference)?;
        let scene = SceneBench { settings, subject: &subject, truth: &truth };
        for denoiser in &denoisers {
            for spp in JUDGED {
                for seed in 0..u64::from(settings.bench.seeds) {
                    let file = scene.file(denoiser, "law", spp, seed);
                    results.calibrations.push(kept_or_made(&file, || scene.calibration(denoiser, spp, seed))?);
                }
            }
            if settings.with_races {
                let mut races =
                    RaceRule::ALL.into_iter().map(|rule| scene.race(denoiser, rule)).collect::<Result<Vec<_>>>()?;
                compare_with_uniform(&mut races);
                results.races.extend(races);
            }
        }
        say(&format!("{}: done", subject.name));
    }
    if settings.with_races {
        results.race_means = means(&results.races);
    }
    json_file::write(&settings.bench.output.join("denoise.json"), &results)?;
    Ok(results)
}

/// One scene and what is true of it.
struct SceneBench<'a> {
    settings: &'a DenoisingSettings,
    subject: &'a Subject,
    truth: &'a Truth,
}

impl SceneBench<'_> {
    fn loop_settings(&self, denoiser: &Denoiser, spp: u32) -> Result<LoopSettings> {
        let mut settings = self.subject.loop_settings()?;
        settings.limits.visibility = Some(self.settings.target);
        settings.limits.mean_samples = Some(spp);
        settings.limits.pilot_samples = DENOISED_PILOT_SAMPLES_PER_PIXEL;
        settings.denoiser = Some(denoiser.clone());
        Ok(settings)
    }

    fn measured(&self, rgb_cd_m2: &[[f32; 3]]) -> Result<Metrics> {
        self.truth.measure(&self.truth.displayed(rgb_cd_m2))
    }

    /// An even render that is denoised and judged by one look, at its end.
    fn judged_at_end(&self, denoiser: &Denoiser, spp: u32, seed: u64) -> Result<Rendered> {
        let mut settings = self.loop_settings(denoiser, spp)?;
        settings.sampling = Sampling::Uniform;
        settings.limits.visibility = None;
        settings.limits.pilot_samples = spp;
        Ok(render(&self.subject.tracer(seed), &settings, &Quiet)?)
    }

    fn calibration(&self, denoiser: &Denoiser, spp: u32, seed: u64) -> Result<Calibration> {
        let rendered = self.judged_at_end(denoiser, spp, seed)?;
        let found = &rendered.judgement;
        let picture = found.denoised.as_ref().ok_or_else(|| anyhow::anyhow!("the picture was denoised"))?;
        let true_energy = self.truth.squared_visibility(&self.truth.displayed(&picture.rgb_cd_m2));
        let predicted = found.predicted.map(|v| v * v);
        let tiles = JudgedTiles {
            predictions: tiles(&predicted).into_iter().map(f64::sqrt).collect(),
            truths: tiles(&true_energy).into_iter().map(f64::sqrt).collect(),
            unproven: tiles(&picture.error.unproven(self.settings.target)),
            target: self.settings.target,
        };
        let mean_square = |plane: &Plane| plane.map(|v| v * v).mean();
        let over_true = |energy: f64| Some((energy / true_energy.mean()).sqrt()).filter(|ratio| ratio.is_finite());
        let seconds_tracing = rendered.seconds.total - rendered.seconds.perception;
        let (raw, denoised) = (self.measured(&found.estimate.rgb_cd_m2)?, self.measured(&picture.rgb_cd_m2)?);
        Ok(Calibration {
            scene: self.subject.name.clone(),
            denoiser: denoiser.name(),
            spp,
            seed,
            rank_correlation: rank_correlation(&tiles.predictions, &tiles.truths),
            predicted_over_true: over_true(predicted.mean()),
            variance_over_true: over_true(mean_square(&picture.error.variance)),
            wrong_share: tiles.share(|i| tiles.is_fine(i) && !tiles.is_unproven(i) && tiles.is_wrong(i)),
            wrong_unproven_share: tiles.share(|i| tiles.is_unproven(i) && tiles.is_wrong(i)),
            fine_share: tiles.share(|i| tiles.is_fine(i)),
            unproven_share: tiles.share(|i| tiles.is_unproven(i)),
            truly_wrong_share: tiles.share(|i| tiles.is_wrong(i)),
            bias_factors: picture.error.bias_factors.clone(),
            jod_raw: raw.jod,
            jod: denoised.jod,
            flip_raw: raw.flip_mean,
            flip: denoised.flip_mean,
            overhead: self.seconds_denoising(denoiser, &rendered)? / seconds_tracing,
        })
    }

    /// What it takes to denoise the mean and both halves, by the clock.
    fn seconds_denoising(&self, denoiser: &Denoiser, rendered: &Rendered) -> Result<f64> {
        let started = Instant::now();
        denoise_film(denoiser, &rendered.film, self.subject.scene.nits_per_unit)?;
        Ok(started.elapsed().as_secs_f64())
    }

    fn race(&self, denoiser: &Denoiser, rule: RaceRule) -> Result<Race> {
        let mut points = Vec::new();
        for spp in BUDGETS {
            let lap = |seed: u64| {
                let file = self.file(denoiser, rule.name(), spp, seed);
                kept_or_made(&file, || self.lap(denoiser, rule, spp, seed))
            };
            let laps = (0..u64::from(self.settings.bench.seeds)).map(lap).collect::<Result<Vec<_>>>()?;
            points.push(RacePoint::mean(&laps));
        }
        Ok(Race { scene: self.subject.name.clone(), denoiser: denoiser.name(), rule, points, needs: Vec::new() })
    }

    /// One render of a race.
    fn lap(&self, denoiser: &Denoiser, rule: RaceRule, spp: u32, seed: u64) -> Result<RacePoint> {
        let mut settings = self.loop_settings(denoiser, spp)?;
        match rule {
            RaceRule::Uniform => {
                settings.sampling = Sampling::Uniform;
                settings.limits.visibility = None;
                settings.limits.pilot_samples = spp;
            }
            RaceRule::Relative => {
                let threshold = RELATIVE_NOISE_OF_ONE_SAMPLE / f64::from(spp).sqrt();
                settings.sampling = Sampling::Rival(RivalRule::Relative { threshold });
                settings.limits.mean_samples = Some(ROOM_OF_A_RIVAL * spp);
                settings.limits.pilot_samples = PILOT_SAMPLES_PER_PIXEL;
            }
            RaceRule::Visible => settings.limits.visibility = Some(OUT_OF_REACH),
        }
        let rendered = render(&self.subject.tracer(seed), &settings, &Quiet)?;
        let metrics = self.measured(rendered.judgement.picture())?;
        Ok(RacePoint {
            samples: rendered.film.total_samples() as f64 / self.subject.pixels(),
            jod: metrics.jod,
            flip_mean: metrics.flip_mean,
            seconds: rendered.seconds.total,
        })
    }

    /// Where a render is kept, by all that it depends on.
    fn file(&self, denoiser: &Denoiser, what: &str, spp: u32, seed: u64) -> PathBuf {
        let key = self.subject.key(self.settings.bench.reference_factor);
        let text = format!("{key}|{}|{}", self.settings.target, denoiser.name());
        let key = &blake3::hash(text.as_bytes()).to_hex()[..16];
        let name = format!("{}-{key}-denoised-{what}-{spp}-{seed}.json", self.subject.file_name());
        self.settings.bench.output.join("runs").join(name)
    }
}

/// What is predicted of the tiles of a picture, and what is true.
struct JudgedTiles {
    /// Predicted visibility.
    predictions: Vec<f64>,
    /// True visibility.
    truths: Vec<f64>,
    /// How much of each tile is unproven, from 0 to 1.
    unproven: Vec<f64>,
    /// Visibility up to which tiles are called fine.
    target: f64,
}

impl JudgedTiles {
    fn is_fine(&self, tile: usize) -> bool {
        self.predictions[tile] <= self.target
    }

    fn is_unproven(&self, tile: usize) -> bool {
        self.is_fine(tile) && self.unproven[tile] > 0.5
    }

    fn is_wrong(&self, tile: usize) -> bool {
        self.truths[tile] > f64::from(VISIBLY_WRONG) * self.target
    }

    /// Of how many of all tiles this holds.
    fn share(&self, holds: impl Fn(usize) -> bool) -> f64 {
        (0..self.truths.len()).filter(|&tile| holds(tile)).count() as f64 / self.truths.len() as f64
    }
}

/// Mean of each whole tile, row by row.
fn tiles(plane: &Plane) -> Vec<f64> {
    let (columns, rows) = (plane.width() / TILE, plane.height() / TILE);
    let mean = |index: usize| {
        let (left, top) = (index % columns * TILE, index / columns * TILE);
        let values = (top..top + TILE).flat_map(|y| (left..left + TILE).map(move |x| (x, y)));
        values.map(|(x, y)| f64::from(plane.get(x, y))).sum::<f64>() / (TILE * TILE) as f64
    };
    (0..columns * rows).map(mean).collect()
}

/// Spearman's rank correlation; `None` where one of the two is the same everywhere, and no rank correlates.
fn rank_correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let (a, b) = (ranks(a), ranks(b));
    let mean = (a.len() as f64 - 1.0) / 2.0;
    let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - mean) * (y - mean)).sum::<f64>();
    Some(product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt()).filter(|correlation| correlation.is_finite())
}

/// Each value's place in ascending order; equal values have the mean of their places.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for equal in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let mean = first as f64 + (equal.len() as f64 - 1.0) / 2.0;
        equal.iter().for_each(|&index| ranks[index] = mean);
        first += equal.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_agree_or_disagree() {
        let values = [3.0, 1.0, 2.0, 10.0];
        let correlation = |other: [f64; 4]| rank_correlation(&values, &other).expect("values differ");
        assert!((correlation(values.map(|v| v * v)) - 1.0).abs() < 1e-12);
        assert!((correlation(values.map(|v| -v)) + 1.0).abs() < 1e-12);
    }

    /// Equal values share a rank; otherwise these would seem to agree by the order in which they are listed.
    #[test]
    fn ties_have_no_order() {
        assert_eq!(ranks(&[7.0, 1.0, 7.0, 0.0]), [2.5, 1.0, 2.5, 0.0]);
        assert_eq!(rank_correlation(&[1.0; 4], &[1.0, 2.0, 3.0, 4.0]), None);
        let (a, b) = ([0.0, 0.0, 1.0, 1.0], [0.0, 1.0, 0.0, 1.0]);
        assert_eq!(rank_correlation(&a, &b), Some(0.0));
    }

    #[test]
    fn tiles_are_means() {
        let plane = Plane::from_fn(40, 16, |x, _| if x < 16 { 1.0 } else { 3.0 });
        assert_eq!(tiles(&plane), [1.0, 3.0]);
    }
}
