//! Variance of one sample, from which the counts of a plan are found. How many samples that makes is left to `plan`.

use super::super::missed::FoundLight;
use super::super::settings::LoopSettings;
use super::over_white::OverWhite;
use super::steps::{Guide, MissedNoise, Scatter, Thresholds, chromatic_gains};
use super::{JudgeError, LookFor, check_cancelled};
use crate::film::Film;
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::threshold::ThresholdMap;
use fechner_perception::tone::FittedTone;

/// Luminance variance of one sample, (cd/m²)² on the display, that shows as much as the most visible of the eye's
/// channels.
pub(super) struct PerSample {
    /// [`super::Judgement::met_per_sample`].
    pub(super) met: Plane,
    /// [`super::Judgement::pooled_variance_per_sample`].
    pub(super) pooled: Plane,
    /// [`super::Judgement::pooled_of_halves`].
    pub(super) pooled_of_halves: Option<[Plane; 2]>,
    /// [`super::Judgement::variance_per_sample`].
    pub(super) of_halves: Option<[Plane; 2]>,
}

/// What it is found from.
pub(super) struct Sources<'a> {
    pub(super) film: &'a Film,
    pub(super) guide: &'a Guide<'a>,
    pub(super) scatter: &'a Scatter,
    pub(super) tone: &'a dyn FittedTone,
    pub(super) thresholds: &'a ThresholdMap,
    pub(super) settings: &'a LoopSettings,
    /// Multiplies every variance.
    pub(super) inflation: f64,
}

impl PerSample {
    /// Variance of a picture that stays raw: by what samples have met, and may have missed.
    pub(super) fn of_raw(sources: &Sources<'_>, look_for: LookFor) -> Result<Self, JudgeError> {
        let &Sources { film, scatter, tone, settings, .. } = sources;
        let lights = sources.lights();
        let met = Self::met(sources, (look_for == LookFor::Plan).then_some(&lights))?;
        Ok(met.or_missed(&lights, |light| scatter.missed_noise(film, light, tone, settings)))
    }

    /// Variance of a picture that is denoised, by what samples have met: what lamps' rims hide is in the
    /// denoised picture's own error.
    pub(super) fn of_denoised(sources: &Sources<'_>, look_for: LookFor) -> Result<Self, JudgeError> {
        Self::met(sources, (look_for == LookFor::Plan).then(|| sources.lights()).as_ref())
    }

    /// By what samples have met; and of the halves, where these are to decide by the light that they have found.
    fn met(sources: &Sources<'_>, lights: Option<&[FoundLight; 2]>) -> Result<Self, JudgeError> {
        let &Sources { film, guide, scatter, tone, thresholds, settings, inflation } = sources;
        let gains = chromatic_gains(thresholds, settings)?;
        check_cancelled(settings)?;
        let of_halves = lights.map(|lights| {
            let scales = scatter.scales_of_halves(film, guide, lights, tone, settings, inflation);
            scatter.per_sample_of_halves(film, scales.each_ref(), thresholds, gains.as_ref())
        });
        let met = scatter.pooled_per_sample(thresholds, gains.as_ref());
        Ok(Self { pooled: met.clone(), pooled_of_halves: None, met, of_halves })
    }

    /// Raises these variances to what lamps' rims may hide, where that is more: of what a half decides by, beside the
    /// light that the other one has found; of the whole, the mean of what each says. By the light of both, a pixel that
    /// was lucky is taken to be beyond white and done, and the others are not. Measured by the light of both: a small
    /// lamp that moves makes a picture 19 % too bright (`benches/results/energy.md`).
    fn or_missed(self, lights: &[FoundLight; 2], missed_beside: impl Fn(&FoundLight) -> Option<MissedNoise>) -> Self {
        let [Some(a), Some(b)] = lights.each_ref().map(missed_beside) else { return self };
        let of_halves = self.of_halves.map(|[of_a, of_b]| [b.or_scatter(&of_a), a.or_scatter(&of_b)]);
        let pooled_of_halves = of_halves.is_some().then(|| [&b, &a].map(|beside| beside.or_scatter(&self.met)));
        Self { pooled: a.mean(&b).or_scatter(&self.met), pooled_of_halves, of_halves, ..self }
    }

    /// Raises these variances to what shows over white, where that is more.
    pub(super) fn or_over_white(self, over_white: Option<&OverWhite>, thresholds: &Thresholds) -> Self {
        let Some(over_white) = over_white else { return self };
        let worse = over_white.worse_per_sample(&thresholds.limits());
        Self {
            pooled: worse.pooled(&self.pooled),
            pooled_of_halves: self.pooled_of_halves.map(|halves| halves.map(|half| worse.pooled(&half))),
            of_halves: self.of_halves.and_then(|halves| worse.of_halves(halves)),
            ..self
        }
    }
}

impl Sources<'_> {
    /// What each half has found.
    fn lights(&self) -> [FoundLight; 2] {
        Half::BOTH.map(|half| FoundLight::of_half(self.film, half, self.settings.nits_per_unit))
    }
}
