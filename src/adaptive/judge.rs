//! The film as it will be seen: thresholds, remaining visibility, and the samples each pixel needs for more.

use super::settings::LoopSettings;
use super::statistics::SampleStatistics;
use crate::film::{Estimate, Film};
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::csf::CastleCsf;
use fechner_perception::guide::{GuideInputs, denoise};
use fechner_perception::photometry::luminance;
use fechner_perception::seen;
use fechner_perception::threshold::{ThresholdInputs, ThresholdMap, threshold_map};
use fechner_perception::tone::{FittedTone, SceneGuide};

/// What the perception model says of a film. Everything is in display cd/m² unless it says otherwise.
#[derive(Debug)]
pub struct Judgement {
    /// The picture, in scene cd/m².
    pub estimate: Estimate,
    /// The tone operator as fitted to the guide.
    pub tone: Box<dyn FittedTone>,
    /// Thresholds from the guide.
    pub thresholds: ThresholdMap,
    /// Variance of the picture's luminance in (scene cd/m²)², with what stratification makes of it.
    pub variance_of_mean: Plane,
    /// Variance of the picture as displayed, by pooled statistics and the low-discrepancy factor.
    pub display_variance: Plane,
    /// Visibility that the variance predicts.
    pub predicted: Plane,
    /// Visibility of the halves' difference: the same, measured.
    pub measured: Plane,
    /// Displayed variance of one sample as the neighbours tell it: the variance of the mean is this over the count.
    pub pooled_variance_per_sample: Plane,
    /// The same as each half decides by it.
    pub variance_per_sample: [Plane; 2],
}

/// Perception failed on a picture that the loop made: a defect of ours, with the reason.
#[derive(Debug, thiserror::Error)]
#[error("the threshold map could not be made: {0}")]
pub struct JudgeError(#[from] fechner_perception::Error);

/// Looks at the film through display and eye.
pub fn judge(film: &Film, settings: &LoopSettings) -> Result<Judgement, JudgeError> {
    let estimate = film.estimate(settings.nits_per_unit);
    let statistics = SampleStatistics::of(film);
    let guide = guide_luminance(film, &estimate);
    let tone = settings.operator.fit(&SceneGuide::of(&guide), &settings.viewing, None);
    let display = &settings.viewing.display;
    let displayed_guide = seen::display_luminance(tone.as_ref(), display, &guide);

    let nits_squared = settings.nits_per_unit * settings.nits_per_unit;
    let variance_of_mean = Plane::from_fn(film.width() as usize, film.height() as usize, |x, y| {
        (f64::from(statistics.variance_of_mean.get(x, y)) * nits_squared) as f32
    });
    let (width, height) = (film.width() as usize, film.height() as usize);
    let scene_variance = |per_sample: &Plane| {
        Plane::from_fn(width, height, |x, y| {
            let i = y * width + x;
            let share = 0.25 * (inverse_count(film, Half::A, i) + inverse_count(film, Half::B, i));
            let factor = f64::from(statistics.low_discrepancy_factor.values()[i]);
            (f64::from(per_sample.values()[i]) * nits_squared * share * factor) as f32
        })
    };
    let displayed =
        |per_sample: &Plane| seen::display_variance(tone.as_ref(), display, &guide, &scene_variance(per_sample));
    let display_variance = displayed(&statistics.pooled);
    // The noise before denoising bounds what is left of it in the guide, so masking fades in as samples come.
    let thresholds = threshold_map(
        &ThresholdInputs { display_luminance_cd_m2: &displayed_guide, guide_variance: Some(&display_variance) },
        &settings.viewing,
        &CastleCsf::new(settings.viewing.observer.csf_area_deg2)?,
    )?;
    let per_sample = |variance: &Plane| {
        Plane::from_fn(width, height, |x, y| {
            let i = y * width + x;
            let share = 0.25 * (inverse_count(film, Half::A, i) + inverse_count(film, Half::B, i));
            (f64::from(variance.values()[i]) / share) as f32
        })
    };
    let pooled_variance_per_sample = per_sample(&display_variance);
    let variance_per_sample = Half::BOTH.map(|half| per_sample(&displayed(&statistics.for_half[half.index()])));
    let displayed_difference =
        seen::display_half_difference(tone.as_ref(), display, &estimate.luminance_cd_m2, &estimate.half_difference);
    let predicted = thresholds.predicted_visibility(&display_variance);
    let measured = thresholds.measured_visibility(&displayed_difference);
    Ok(Judgement {
        estimate,
        tone,
        thresholds,
        variance_of_mean,
        display_variance,
        predicted,
        measured,
        pooled_variance_per_sample,
        variance_per_sample,
    })
}

/// Luminance of the denoised picture: what adaptation, masking and the operator are made from, so that noise neither
/// masks itself nor raises its own adaptation. Never output.
fn guide_luminance(film: &Film, estimate: &Estimate) -> Plane {
    let (width, height) = (film.width() as usize, film.height() as usize);
    let albedo: Vec<_> = film.guides().iter().map(|g| g.albedo).collect();
    let normal: Vec<_> = film.guides().iter().map(|g| g.normal).collect();
    let depth: Vec<_> = film.guides().iter().map(|g| g.depth).collect();
    let denoised = denoise(&GuideInputs {
        rgb: &estimate.rgb_cd_m2,
        variance: &estimate.variance_of_mean,
        albedo: &albedo,
        normal: &normal,
        depth: &depth,
        width,
        height,
    });
    Plane::from_fn(width, height, |x, y| luminance(denoised[y * width + x]).max(0.0))
}

fn inverse_count(film: &Film, half: Half, pixel: usize) -> f64 {
    1.0 / f64::from(film.half(half)[pixel].samples.max(1))
}
