//! The figures of a render, for machines (`--json`, EXR attributes) and in plain words.

mod summary;

pub(super) use summary::{Interrupter, summary};

use super::console::duration_in_words;
use super::system_memory;
use fechner::adaptive::judge::Judgement;
use fechner::adaptive::pursuit::Pursuit;
use fechner::adaptive::settings::{LoopSettings, RivalRule, Sampling};
use fechner::adaptive::statistics::find_outliers;
use fechner::adaptive::{Rendered, StopReason, visible_share};
use fechner::output::{self, Attribute, attribute};
use fechner_perception::Plane;
use fechner_perception::csf::{self, FreshNoise};
use fechner_perception::display::{Display, Viewing};
use fechner_perception::model;
use fechner_perception::psychometric::detection_probability;
use serde::Serialize;

/// Of noise that nobody can judge yet.
const TOO_FEW: &str = "too few samples to tell what can be seen";

/// Where the picture is seen.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ObserverReport {
    display: String,
    pixels_per_degree: f64,
    white_cd_m2: f64,
    black_cd_m2: f64,
    ambient_cd_m2: f64,
    distance_m: Option<f64>,
    sensitivity: f64,
    csf_area_deg2: f64,
}

impl ObserverReport {
    fn of(viewing: &Viewing) -> Self {
        let Viewing { display, observer, .. } = viewing;
        Self {
            display: display.name.clone(),
            pixels_per_degree: display.pixels_per_degree,
            white_cd_m2: display.white_cd_m2,
            black_cd_m2: display.black_cd_m2,
            ambient_cd_m2: display.ambient_cd_m2,
            distance_m: display.distance_m,
            sensitivity: observer.sensitivity,
            csf_area_deg2: observer.csf_area_deg2,
        }
    }
}

/// What is known of a denoised picture besides its visibility. None where the samples are too few to tell.
#[derive(Clone, Debug, Serialize)]
pub(super) struct DenoisedReport {
    denoiser: String,
    /// Visibility of the noise that is left, and of what the denoiser changed, at the 99th percentile.
    variance_visibility_p99: Option<f64>,
    bias_visibility_p99: Option<f64>,
    /// Share of pixels called fine where raw noise is too strong to show that bias stays below one and a half times
    /// the target.
    unproven_fraction: Option<f64>,
    /// Squared bias over squared variance as the whole picture shows it, by octave band from 0.5 cycles a degree on.
    bias_factors: Vec<f64>,
    /// Share of pixels whose picture was moved towards the raw mean.
    blended_fraction: f64,
    /// The picture's mean luminance over that of its raw mean, which is unbiased, less 1.
    energy_change: f64,
}

impl DenoisedReport {
    fn of(settings: &LoopSettings, judgement: &Judgement) -> Option<Self> {
        let (denoiser, error) = (settings.denoiser.as_ref()?, judgement.denoised_error()?);
        let known = judgement.is_known;
        let pixels = error.visibility.values().len();
        let is_blended = |pixel: &usize| error.raw_shares.iter().any(|share| share.values()[*pixel] > 0.01);
        Some(Self {
            denoiser: denoiser.name(),
            variance_visibility_p99: known.then(|| error.variance.quantile(0.99)),
            bias_visibility_p99: known.then(|| error.bias.quantile(0.99)),
            unproven_fraction: known.then(|| error.unproven(settings.limits.visibility_or_threshold()).mean()),
            bias_factors: error.bias_factors.clone(),
            blended_fraction: (0..pixels).filter(is_blended).count() as f64 / pixels as f64,
            energy_change: energy_change(judgement),
        })
    }
}

fn energy_change(judgement: &Judgement) -> f64 {
    let raw = judgement.estimate.luminance_cd_m2.mean();
    let change = judgement.denoised.as_ref().map(|denoised| denoised.luminance_cd_m2.mean() / raw - 1.0);
    change.filter(|change| change.is_finite()).unwrap_or(0.0)
}

/// Everything that `--json` holds.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Report {
    fechner_version: &'static str,
    scene: String,
    width: u32,
    height: u32,
    /// The first of `seeds`.
    seed: u64,
    seeds: Vec<u64>,
    sampling: &'static str,
    model: &'static str,
    csf: &'static str,
    operator: String,
    nits_per_unit: f64,
    observer: ObserverReport,
    samples_total: u64,
    spp_mean: f64,
    spp_max: u32,
    rays_total: u64,
    seconds_total: f64,
    seconds_perception: f64,
    /// Of which in finding counts.
    seconds_allocation: f64,
    /// And in denoising.
    seconds_denoising: f64,
    /// What made the picture out of the mean, and what can be seen of what it left and of what it changed.
    denoised: Option<DenoisedReport>,
    visibility_target: Option<f64>,
    /// Probability with which what is told of each place is no less than the truth, over all looks of which plans
    /// came; none where visibilities are estimates.
    confidence: Option<f64>,
    /// None here and in the figures that follow from it where the samples are too few to tell, as in a render of one
    /// a pixel.
    visibility_p99: Option<f64>,
    visibility_p999: Option<f64>,
    visibility_max: Option<f64>,
    /// Share of pixels whose predicted visibility is above the target (above 1 where there is none).
    fraction_visible: Option<f64>,
    /// Of a 1° patch at the 99th percentile.
    detection_probability_p99: Option<f64>,
    /// Expected number of 1° patches in which noise is noticed.
    patches_noticed: Option<f64>,
    /// Energy of the halves' difference through the eye's filter over the predicted energy; 1 when the prediction
    /// holds.
    measured_over_predicted: Option<f64>,
    /// Visible energy of fresh samples against the kept ones in audited tiles, over the predicted; none for small
    /// pictures.
    audit_ratio: Option<f64>,
    audit_standard_error: Option<f64>,
    audit_tiles: usize,
    /// What audits multiplied the variance by.
    variance_inflation: f64,
    /// Pixels whose halves differ by more than five standard errors of what their neighbours show: light that few
    /// samples find (fireflies).
    outlier_pixels: usize,
    /// Share of the picture's energy by which they stand out.
    outlier_energy_share: f64,
    /// Least and greatest number that thresholds are multiplied by, where a map of importance was given. All
    /// visibilities and chances here are under it.
    importance_range: Option<[f32; 2]>,
    /// Whose eye all visibilities and chances here are of: what it looks at.
    eye: String,
    /// The display, which [`Report::attributes`] takes along.
    #[serde(skip)]
    display: Option<(String, Attribute)>,
    /// The tone operator's fit, which it takes along, too.
    #[serde(skip)]
    tone: Option<(String, Attribute)>,
    nonfinite_samples: u64,
    peak_memory_bytes: Option<u64>,
    plans: u32,
    stop_reason: &'static str,
}

impl Report {
    /// `seeds`: all whose samples are in the film, at least one.
    pub(super) fn new(scene: &str, seeds: &[u64], settings: &LoopSettings, rendered: &Rendered) -> Self {
        let film = &rendered.film;
        let pixels = film.pixel_count() as u64;
        let judgement = &rendered.judgement;
        let target = settings.limits.visibility;
        let predicted = judgement.is_known.then_some(&judgement.predicted);
        let quantile = |share: f64| predicted.map(|predicted| predicted.quantile(share));
        let samples_total = film.total_samples();
        let outliers = find_outliers(film);
        Self {
            fechner_version: env!("CARGO_PKG_VERSION"),
            scene: scene.to_owned(),
            width: film.width(),
            height: film.height(),
            seed: seeds[0],
            seeds: seeds.to_vec(),
            sampling: sampling_name(settings.sampling),
            model: settings.model.as_ref().map_or(model::DEFAULT, |model| model.name()),
            csf: if settings.frames.is_some() { FreshNoise::NAME } else { csf::DEFAULT },
            operator: judgement.tone.describe(),
            nits_per_unit: settings.nits_per_unit,
            observer: ObserverReport::of(&settings.viewing),
            samples_total,
            spp_mean: samples_total as f64 / pixels as f64,
            spp_max: (0..pixels as usize).map(|i| film.samples(i)).max().unwrap_or(0),
            rays_total: film.rays,
            seconds_total: rendered.seconds.total,
            seconds_perception: rendered.seconds.perception,
            seconds_allocation: rendered.seconds.allocation,
            seconds_denoising: rendered.seconds.denoising,
            denoised: DenoisedReport::of(settings, judgement),
            visibility_target: target,
            confidence: settings.limits.confidence,
            visibility_p99: quantile(0.99),
            visibility_p999: quantile(0.999),
            visibility_max: quantile(1.0),
            fraction_visible: predicted.map(|_| visible_share(judgement, settings.limits.visibility_or_threshold())),
            detection_probability_p99: quantile(0.99).map(detection_probability),
            patches_noticed: predicted.map(|predicted| patches_noticed(predicted, &settings.viewing.display)),
            measured_over_predicted: predicted
                .map(|_| energy(&judgement.measured_error().visibility) / energy(&judgement.estimated())),
            audit_ratio: rendered.audit.filter(|audit| !audit.had_nothing_to_find()).map(|audit| audit.ratio),
            audit_standard_error: rendered.audit.map(|audit| audit.standard_error),
            audit_tiles: rendered.audit.map_or(0, |audit| audit.tiles),
            variance_inflation: rendered.inflation,
            outlier_pixels: outliers.pixels,
            outlier_energy_share: outliers.energy_share,
            importance_range: settings.importance.as_ref().map(range),
            eye: eye_in_words(settings),
            display: output::display_attribute(&settings.viewing.display),
            tone: output::tone_attribute(judgement.tone.as_ref()),
            nonfinite_samples: film.nonfinite_samples,
            peak_memory_bytes: system_memory::peak_bytes(),
            plans: rendered.plans,
            stop_reason: stop_reason_name(rendered.stop_reason),
        }
    }

    /// What a frame among many took.
    pub(super) fn in_a_line(&self) -> String {
        let visibility = self
            .visibility_p99
            .map_or_else(|| TOO_FEW.to_owned(), |p99| format!("visibility {p99:.2} at the 99th percentile"));
        format!(
            "{:.1} spp in {}, {visibility}; ended by {}",
            self.spp_mean,
            duration_in_words(self.seconds_total),
            self.stop_reason
        )
    }

    /// What an EXR file should say of itself.
    pub(super) fn attributes(&self) -> Vec<(String, Attribute)> {
        let text = |s: &str| Attribute::Text(s.to_owned());
        let number = |x: f64| Attribute::Float(x as f32);
        let mut attributes = vec![
            (attribute::SCENE, text(&self.scene)),
            ("fechner.seed", text(&self.seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(", "))),
            ("fechner.sampling", text(self.sampling)),
            (attribute::MODEL, text(self.model)),
            (attribute::CSF, text(self.csf)),
            ("fechner.eye", text(&self.eye)),
            (attribute::OPERATOR, text(&self.operator)),
            (attribute::OBSERVER_DISPLAY, text(&self.observer.display)),
            (attribute::OBSERVER_PIXELS_PER_DEGREE, number(self.observer.pixels_per_degree)),
            (attribute::OBSERVER_WHITE_CD_M2, number(self.observer.white_cd_m2)),
            (attribute::OBSERVER_BLACK_CD_M2, number(self.observer.black_cd_m2)),
            (attribute::OBSERVER_AMBIENT_CD_M2, number(self.observer.ambient_cd_m2)),
            ("fechner.observer.sensitivity", number(self.observer.sensitivity)),
            ("fechner.observer.csf_area_deg2", number(self.observer.csf_area_deg2)),
            ("fechner.plans", Attribute::Integer(self.plans.try_into().unwrap_or(i32::MAX))),
            ("fechner.stop_reason", text(self.stop_reason)),
        ];
        if let Some(target) = self.visibility_target {
            attributes.push(("fechner.visibility_target", number(target)));
        }
        if let Some(confidence) = self.confidence {
            attributes.push(("fechner.confidence", number(confidence)));
        }
        if let Some(denoised) = &self.denoised {
            attributes.push(("fechner.denoiser", text(&denoised.denoiser)));
            attributes.extend(denoised.unproven_fraction.map(|share| ("fechner.unproven_fraction", number(share))));
        }
        if let Some([least, greatest]) = self.importance_range {
            attributes.push(("fechner.importance", text(&format!("thresholds times {least} to {greatest}"))));
        }
        let named = attributes.into_iter().map(|(name, value)| (name.to_owned(), value));
        named.chain(self.display.clone()).chain(self.tone.clone()).collect()
    }
}

/// What the eye looks at.
fn eye_in_words(settings: &LoopSettings) -> String {
    match (settings.gazes.as_slice(), &settings.pursuit) {
        ([], None) => "anywhere".to_owned(),
        ([], Some(Pursuit::Salient(_))) => "what stands out, which it follows".to_owned(),
        ([], Some(_)) => "what moves, which it follows".to_owned(),
        ([gaze], _) => format!("pixel {:.0},{:.0}", gaze.x_px, gaze.y_px),
        (gazes, _) => format!("{} places", gazes.len()),
    }
}

/// As `--sampling` has it.
pub(super) fn sampling_name(sampling: Sampling) -> &'static str {
    match sampling {
        Sampling::Adaptive => "adaptive",
        Sampling::Uniform => "uniform",
        Sampling::Rival(RivalRule::Relative { .. }) => "relative",
        Sampling::Rival(RivalRule::Variance { .. }) => "variance",
        Sampling::Rival(RivalRule::Budget) => "budget",
    }
}

fn stop_reason_name(reason: StopReason) -> &'static str {
    match reason {
        StopReason::Visibility => "visibility",
        StopReason::Time => "time",
        StopReason::Samples => "spp",
        StopReason::MaxSamples => "max-spp",
        StopReason::Plans => "plans",
        StopReason::Rule => "rule",
        StopReason::Interrupted => "interrupted",
        StopReason::Merged => "merged",
    }
}

/// Least and greatest value of a map.
fn range(map: &Plane) -> [f32; 2] {
    let values = || map.values().iter().copied();
    [values().fold(f32::INFINITY, f32::min), values().fold(0.0, f32::max)]
}

/// Sum of squares.
fn energy(visibility: &Plane) -> f64 {
    visibility.values().iter().map(|&v| f64::from(v) * f64::from(v)).sum()
}

/// 1° × 1° patches in the picture.
fn patch_count(visibility: &Plane, display: &Display) -> f64 {
    let density = display.pixel_density();
    visibility.values().len() as f64 / (density.horizontal * density.vertical)
}

fn patches_noticed(visibility: &Plane, display: &Display) -> f64 {
    let mean = visibility.values().iter().map(|&v| detection_probability(f64::from(v))).sum::<f64>()
        / visibility.values().len() as f64;
    mean * patch_count(visibility, display)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two degrees by one: pixels twice as wide as high.
    #[test]
    fn patches_are_square_degrees_whatever_the_pixels_are() {
        let oblong = Display { pixels_per_degree: 60.0, pixel_aspect_ratio: 2.0, ..Display::default() };
        let unseen = Plane::filled(120, 120, 0.0);
        assert_eq!(patch_count(&unseen, &oblong), 2.0);
        assert_eq!(patch_count(&unseen, &Display { pixel_aspect_ratio: 1.0, ..oblong }), 4.0);
    }
}
