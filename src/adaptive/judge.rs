//! The film as it will be seen: thresholds, remaining visibility, and how each pixel's samples scatter on the display.

mod noise_on_display;
mod over_white;
mod per_sample;
mod steps;

use self::noise_on_display::squared_differences;
pub use self::noise_on_display::{display_scale, variance_shares};
use self::over_white::OverWhite;
use self::per_sample::{PerSample, Sources};
pub use self::steps::Thresholds;
use self::steps::{Guide, Scatter, chromatic_gains, found_thresholds, thresholds_of_still};
use super::denoised::{DenoisedPicture, DenoisedThresholds, TimedDenoising};
use super::settings::LoopSettings;
use crate::denoise::{Denoiser, OidnError};
use crate::film::{CHANNELS, Estimate, Film};
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::denoised::DenoisedError;
use fechner_perception::guide::{GuideInputs, denoise};
use fechner_perception::seen;
use fechner_perception::threshold::ThresholdMap;
use fechner_perception::tone::FittedTone;
use fechner_perception::visibility::MeasuredError;
use std::borrow::Cow;
use std::sync::OnceLock;
use std::time::Instant;

/// What the perception model says of a film. Everything is in display cd/m² unless it says otherwise.
#[derive(Debug)]
pub struct Judgement {
    /// The raw mean, in scene cd/m².
    pub estimate: Estimate,
    /// The picture where it is denoised.
    pub denoised: Option<DenoisedPicture>,
    /// What the look took.
    pub seconds: f64,
    /// And denoising of that.
    pub seconds_denoising: f64,
    /// The tone operator as fitted to the guide.
    pub tone: Box<dyn FittedTone>,
    /// What can be seen where.
    pub thresholds: Thresholds,
    /// What [`LoopSettings::importance`] multiplies thresholds by. `thresholds` are without it; what a judgement's
    /// methods say, and `predicted`, is with it.
    pub importance: Option<Plane>,
    /// How many times the estimate the upper bound is that `predicted` holds, at least 1, where one is asked for. What
    /// the loop goes by is with it, what may be seen of thresholds and of the halves' difference is not.
    pub bound_factor: Option<Plane>,
    /// Whether the film has samples enough to tell what can be seen: [`Film::has_both_halves`].
    pub is_known: bool,
    /// Visibility that the variance predicts; infinite everywhere where it is not known.
    pub predicted: Plane,
    /// Displayed variance of one sample as the neighbours tell it, as the luminance variance that shows as much as the
    /// most visible of the eye's three channels: the variance of the mean is this over the count.
    pub pooled_variance_per_sample: Plane,
    /// The same as each half may go by it, whose own luck is not in what it may have missed; `None` where the look
    /// was for no plan, or nothing may be missed.
    pub pooled_of_halves: Option<[Plane; 2]>,
    /// The larger of that and what the other half knows of the pixel itself; `None` where the look was for no plan.
    pub variance_per_sample: Option<[Plane; 2]>,
    /// The first of these variances by what samples have met, before black where the picture is transparent: what
    /// audits compare with.
    pub met_per_sample: Plane,
    /// What can be seen of a transparent picture over white.
    over_white: Option<OverWhite>,
    /// What the halves' difference shows, once somebody asked.
    measured: OnceLock<MeasuredError>,
}

/// Why a film could not be looked at.
#[derive(Debug, thiserror::Error)]
pub enum JudgeError {
    /// Perception failed on a picture that the loop made: a defect of ours, with the reason.
    #[error("the threshold map could not be made: {0}")]
    Perception(#[from] fechner_perception::Error),
    /// [`LoopSettings::is_cancelled`] said so.
    #[error("the look was interrupted")]
    Cancelled,
    /// The denoiser failed.
    #[error(transparent)]
    Denoiser(#[from] OidnError),
}

/// Looks at the film through display and eye. `inflation` multiplies every variance (1, unless an audit found it
/// low); of a denoised picture, the squared error that is inferred rather than witnessed.
///
/// # Errors
/// If the denoiser fails, or the perception model refuses the film's maps.
pub fn judge(film: &Film, settings: &LoopSettings, inflation: f64) -> Result<Judgement, JudgeError> {
    judge_for(LookFor::Report, film, settings, inflation)
}

/// [`judge`], with all that is asked for.
///
/// # Errors
/// As [`judge`].
pub(super) fn judge_for(
    look_for: LookFor,
    film: &Film,
    settings: &LoopSettings,
    inflation: f64,
) -> Result<Judgement, JudgeError> {
    judge_by(settings.denoiser.as_ref(), film, settings, inflation, look_for)
}

/// The same of the raw mean, which costs a tenth of a look at a denoised picture.
///
/// # Errors
/// If the perception model refuses the film's maps.
pub(super) fn judge_raw(film: &Film, settings: &LoopSettings) -> Result<Judgement, JudgeError> {
    judge_by(None, film, settings, 1.0, LookFor::Report)
}

/// What a look is for.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum LookFor {
    /// To say what is seen.
    Report,
    /// And to plan: with what each half makes of it, which makes a raw look dearer.
    Plan,
}

/// The shorter side, pixels, from which the difference of a denoised picture's halves tells what noise is left: below
/// it is judged as the raw mean. A crop of one pixel at 4 samples was called perfect, and was wrong by 32 thresholds.
const MIN_SIDE_OF_HALVES: u32 = 8;

fn judge_by(
    denoiser: Option<&Denoiser>,
    film: &Film,
    settings: &LoopSettings,
    inflation: f64,
    look_for: LookFor,
) -> Result<Judgement, JudgeError> {
    let started = Instant::now();
    let estimate = film.estimate(settings.nits_per_unit);
    let denoised = denoiser.map(|denoiser| TimedDenoising::of(denoiser, film, settings.nits_per_unit)).transpose()?;
    let raw_inflation = if denoised.is_some() { 1.0 } else { inflation };

    let guide = Guide::of(film, &estimate, denoised.as_ref(), settings);
    check_cancelled(settings)?;
    let tone = guide.tone(settings);
    let scatter = Scatter::of(film, &guide, tone.as_ref(), settings, raw_inflation);
    check_cancelled(settings)?;
    let displayed_guide = guide.displayed(tone.as_ref(), settings);
    let noise = scatter.luminance_variance_of_mean();
    let thresholds = found_thresholds(&guide, &displayed_guide, tone.as_ref(), &noise, settings)?;
    let of_still = match &denoised {
        None => None,
        Some(_) => thresholds_of_still(&displayed_guide, tone.as_ref(), &noise, settings)?,
    };
    check_cancelled(settings)?;
    let sources = Sources {
        film,
        guide: &guide,
        scatter: &scatter,
        tone: tone.as_ref(),
        thresholds: &thresholds.in_bands,
        settings,
        inflation: raw_inflation,
    };
    let per_sample = match &denoised {
        None => PerSample::of_raw(&sources, look_for)?,
        Some(_) => PerSample::of_denoised(&sources, look_for)?,
    };
    check_cancelled(settings)?;
    let over_white = if settings.is_transparent {
        let colour_scale = denoised.is_none().then(|| scatter.luminance_scale());
        Some(OverWhite::of(film, &guide, &displayed_guide, colour_scale, tone.as_ref(), settings, look_for)?)
    } else {
        None
    };
    check_cancelled(settings)?;
    let look = Look { started, film, settings, estimate, tone, scatter, thresholds, of_still, per_sample, over_white };
    look.finished(denoised, inflation)
}

/// What is found on the way to a picture's noise.
struct Look<'a> {
    started: Instant,
    film: &'a Film,
    settings: &'a LoopSettings,
    estimate: Estimate,
    tone: Box<dyn FittedTone>,
    scatter: Scatter,
    thresholds: Thresholds,
    /// Of what a denoiser leaves in every frame.
    of_still: Option<ThresholdMap>,
    per_sample: PerSample,
    over_white: Option<OverWhite>,
}

impl Look<'_> {
    /// By its end. Of the denoised picture's error, if there is one, what is inferred is multiplied by the root of
    /// `inflation`.
    fn finished(self, denoised: Option<TimedDenoising>, inflation: f64) -> Result<Judgement, JudgeError> {
        let seconds_denoising = denoised.as_ref().map_or(0.0, |found| found.seconds);
        let denoised = denoised.map(|found| self.judged_picture(found, inflation)).transpose()?;
        check_cancelled(self.settings)?;
        let predicted = self.predicted(denoised.as_ref());
        let Self { started, film, settings, estimate, tone, thresholds, per_sample, over_white, .. } = self;
        let PerSample { met, pooled, pooled_of_halves, of_halves } =
            per_sample.or_over_white(over_white.as_ref(), &thresholds);
        Ok(Judgement {
            estimate,
            denoised,
            seconds: started.elapsed().as_secs_f64(),
            seconds_denoising,
            tone,
            thresholds,
            importance: settings.importance.clone(),
            bound_factor: None,
            is_known: film.has_both_halves(),
            predicted,
            pooled_variance_per_sample: pooled,
            pooled_of_halves,
            variance_per_sample: of_halves,
            met_per_sample: met,
            over_white,
            measured: OnceLock::new(),
        })
    }

    /// Visibility of the raw mean's noise before black, which costs as much as the thresholds.
    fn raw_noise(&self) -> Plane {
        self.thresholds.visibility(&self.scatter.of_mean(&self.per_sample.pooled))
    }

    /// The denoised picture and its error, of which what is inferred is multiplied by the root of `inflation`.
    fn judged_picture(&self, found: TimedDenoising, inflation: f64) -> Result<DenoisedPicture, JudgeError> {
        let thresholds = DenoisedThresholds { of_noise: &self.thresholds.in_bands, of_still: self.of_still.as_ref() };
        let mut picture = found.judged(self.film, self.settings, self.tone.as_ref(), thresholds, &self.estimate)?;
        for error in [Some(&mut picture.error), picture.error_as_noise.as_mut()].into_iter().flatten() {
            error.raise_inferred(inflation.sqrt());
        }
        if self.film.width().min(self.film.height()) < MIN_SIDE_OF_HALVES {
            picture.error = picture.error.with_noise_of_at_least(&self.raw_noise());
        }
        if let Some(over_white) = &self.over_white {
            // Alpha is not denoised.
            picture.error = picture.error.with_noise_of_at_least(over_white.visibility());
        }
        Ok(picture)
    }

    /// [`Judgement::predicted`].
    fn predicted(&self, denoised: Option<&DenoisedPicture>) -> Plane {
        let (width, height) = (self.film.width() as usize, self.film.height() as usize);
        if !self.film.has_both_halves() {
            return Plane::filled(width, height, f32::INFINITY);
        }
        let of_error = match denoised {
            Some(denoised) => denoised.error.visibility.clone(),
            None => worse_of(self.raw_noise(), self.over_white.as_ref().map(OverWhite::visibility)),
        };
        // An infinite variance, pooled with others, is NaN.
        let of_error = of_error.map(|v| if v.is_nan() { f32::INFINITY } else { v });
        per_importance(of_error, self.settings.importance.as_ref())
    }
}

/// The greater of both, where there are two.
fn worse_of(visibility: Plane, other: Option<&Plane>) -> Plane {
    match other {
        None => visibility,
        Some(other) => visibility.combined(other, f32::max),
    }
}

/// A visibility under thresholds that importance multiplies.
fn per_importance(visibility: Plane, importance: Option<&Plane>) -> Plane {
    match importance {
        None => visibility,
        Some(map) => visibility.combined(map, |visibility, factor| visibility / factor),
    }
}

/// Between the parts of a look: goes on unless the look is of no use any more.
pub(crate) fn check_cancelled(settings: &LoopSettings) -> Result<(), JudgeError> {
    let is_cancelled = settings.is_cancelled.as_ref().is_some_and(|is_cancelled| is_cancelled());
    if is_cancelled { Err(JudgeError::Cancelled) } else { Ok(()) }
}

impl Judgement {
    /// The picture that is shown: linear RGB in cd/m², row-major.
    pub fn picture(&self) -> &[[f32; 3]] {
        self.denoised.as_ref().map_or(&self.estimate.rgb_cd_m2, |denoised| &denoised.rgb_cd_m2)
    }

    /// What can be seen of the denoised picture's error, by importance as `predicted` is. `None` for raw pictures.
    pub fn denoised_error(&self) -> Option<Cow<'_, DenoisedError>> {
        let error = &self.denoised.as_ref()?.error;
        Some(match &self.importance {
            None => Cow::Borrowed(error),
            Some(map) => Cow::Owned(error.with_thresholds_times(map)),
        })
    }

    /// What is predicted, as an estimate and no bound.
    pub fn estimated(&self) -> Cow<'_, Plane> {
        match &self.bound_factor {
            None => Cow::Borrowed(&self.predicted),
            Some(factor) => Cow::Owned(self.predicted.combined(factor, |bound, factor| bound / factor)),
        }
    }

    /// Visibility of a picture whose displayed luminance has this variance, (cd/m²)², as far as `predicted` is bounded.
    pub fn visibility_of(&self, display_variance: &Plane) -> Plane {
        self.bounded(self.per_importance(self.thresholds.visibility(display_variance)))
    }

    /// The same with each pixel's noise judged where it is, before the bands smear it: what the allocation's
    /// constraints say. One blur in the place of twenty.
    pub fn rough_visibility_of(&self, display_variance: &Plane) -> Plane {
        self.thresholds.in_bands.pooled(&self.energy_of(display_variance)).map(f32::sqrt)
    }

    /// Squared visibility of each pixel's noise for itself, as if nothing around it had any.
    pub fn energy_of(&self, display_variance: &Plane) -> Plane {
        let [energy] = self.energies_of([display_variance]);
        energy
    }

    /// The same of several.
    pub(super) fn energies_of<const N: usize>(&self, display_variances: [&Plane; N]) -> [Plane; N] {
        let allowed = self.decisive_standard_error_cd_m2();
        display_variances.map(|plane| plane.combined(&allowed, |variance, allowed| variance / (allowed * allowed)))
    }

    /// Standard error of a pixel, cd/m² on the display, that is at visibility 1 by the model that drives the loop.
    pub fn allowed_standard_error_cd_m2(&self) -> Plane {
        let allowed = self.thresholds.limits();
        match &self.importance {
            None => allowed,
            Some(map) => allowed.combined(map, |allowed, factor| allowed * factor),
        }
    }

    /// The same standard error, cd/m², less what a bound asks for: what counts are found by.
    pub(super) fn decisive_standard_error_cd_m2(&self) -> Plane {
        let allowed = self.allowed_standard_error_cd_m2();
        match &self.bound_factor {
            None => allowed,
            Some(factor) => allowed.combined(factor, |allowed, factor| allowed / factor),
        }
    }

    fn per_importance(&self, visibility: Plane) -> Plane {
        per_importance(visibility, self.importance.as_ref())
    }

    fn bounded(&self, visibility: Plane) -> Plane {
        match &self.bound_factor {
            None => visibility,
            Some(factor) => visibility.combined(factor, |visibility, factor| visibility * factor),
        }
    }

    /// Makes upper bounds of what is predicted: so many times as visible, at least 1.
    pub(super) fn raise(&mut self, factor: Plane) {
        self.predicted = self.predicted.combined(&factor, |visibility, factor| visibility * factor);
        self.bound_factor = Some(factor);
    }

    /// Squared half of what the halves differ by on the display, (cd/m²)², by channel: each as the luminance variance
    /// that shows as much.
    ///
    /// # Errors
    /// If the perception model refuses the judgement's maps, which would be a defect of ours.
    pub(super) fn found_by_channel(&self, film: &Film, settings: &LoopSettings) -> Result<Vec<Plane>, JudgeError> {
        let thresholds = &self.thresholds.in_bands;
        let squared = squared_differences(film, self.predicted.width(), self.tone.as_ref(), settings);
        let Some(gains) = chromatic_gains(thresholds, settings)? else {
            let [luminance, ..] = squared;
            return Ok(vec![luminance]);
        };
        let none = Plane::filled(self.predicted.width(), self.predicted.height(), 0.0);
        let alone = |channel: usize| {
            let planes = std::array::from_fn(|c| if c == channel { &squared[c] } else { &none });
            thresholds.luminance_equivalent_variance(&gains, planes)
        };
        Ok((0..CHANNELS).map(alone).collect())
    }

    /// What can be seen of the halves' luminance difference: the same as predicted, measured; of the denoised halves
    /// where the picture is denoised.
    pub fn measured_error(&self) -> &MeasuredError {
        self.measured.get_or_init(|| {
            let raw = || {
                seen::display_half_difference(
                    self.tone.as_ref(),
                    &self.thresholds.in_bands.viewing().display,
                    &self.estimate.luminance_cd_m2,
                    &self.estimate.half_difference,
                )
            };
            let displayed = self.denoised.as_ref().map_or_else(raw, |denoised| denoised.half_difference.clone());
            let MeasuredError { visibility, amplitude } = match &self.over_white {
                Some(over_white) => {
                    over_white.worse_error(self.thresholds.in_bands.measured_error(&displayed), &displayed)
                }
                None => self.thresholds.in_bands.measured_error(&displayed),
            };
            MeasuredError { visibility: self.per_importance(visibility), amplitude: self.per_importance(amplitude) }
        })
    }
}

/// Luminance of a half, cd/m²; of the other one where it has no samples.
pub(super) fn half_luminance(film: &Film, half: Half, nits_per_unit: f64) -> Plane {
    film.plane(|pixel| (nits_per_unit * film.halves(pixel).half_or_other(half).luminance()) as f32)
}

/// The denoised picture, cd/m²: what adaptation, masking and the operator are made from, so that noise neither
/// masks itself nor raises its own adaptation. Never output.
pub(crate) fn guide_rgb(film: &Film, estimate: &Estimate) -> Vec<[f32; 3]> {
    let albedo: Vec<_> = film.features().iter().map(|guide| guide.albedo).collect();
    without_noise(film, &estimate.rgb_cd_m2, &estimate.variance_of_mean, &albedo)
}

/// A picture of what the film's first surfaces show, without its noise. `albedo`: what to divide by before.
fn without_noise(film: &Film, rgb: &[[f32; 3]], variance: &Plane, albedo: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let guides = film.features();
    denoise(&GuideInputs {
        rgb,
        variance,
        albedo,
        normal: &guides.iter().map(|guide| guide.normal).collect::<Vec<_>>(),
        depth: &guides.iter().map(|guide| guide.depth).collect::<Vec<_>>(),
        width: film.width() as usize,
        height: film.height() as usize,
    })
}

#[cfg(test)]
mod tests;
