//! Variance of one sample, from which the counts of a plan are found.

use super::super::missed::FoundLight;
use super::over_white::OverWhite;
use super::steps::{MissedNoise, Scatter, Thresholds};
use crate::film::Film;
use fechner_perception::Plane;
use fechner_perception::colour::ChromaticGains;
use fechner_perception::threshold::ThresholdMap;

/// Luminance variance of one sample, (cd/m²)² on the display, that shows as much as the most visible of the eye's channels.
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

impl PerSample {
    /// By what samples have met. `luminance_scales` are what the halves decide by ([`Scatter::luminance_scales_of_halves`]), where they do.
    pub(super) fn met(
        scatter: &Scatter,
        film: &Film,
        luminance_scales: Option<&[Plane; 2]>,
        thresholds: &ThresholdMap,
        gains: Option<&ChromaticGains>,
    ) -> Self {
        let met = scatter.pooled_per_sample(thresholds, gains);
        let of_halves =
            luminance_scales.map(|scales| scatter.per_sample_of_halves(film, scales.each_ref(), thresholds, gains));
        Self { pooled: met.clone(), pooled_of_halves: None, met, of_halves }
    }

    /// Or by what lamps' rims may hide, where that is more: of what a half decides by, beside the light that the other one has found; of the
    /// whole, the mean of what each says. By the light of both a pixel that was lucky was called beyond white and done, and the others not: a
    /// small lamp that moves made a picture 19 % too bright (`benches/results/sampling.md`, energy).
    pub(super) fn or_missed(
        self,
        lights: &[FoundLight; 2],
        missed_beside: impl Fn(&FoundLight) -> Option<MissedNoise>,
    ) -> Self {
        let [Some(a), Some(b)] = lights.each_ref().map(missed_beside) else { return self };
        let of_halves = self.of_halves.map(|[of_a, of_b]| [b.or_scatter(&of_a), a.or_scatter(&of_b)]);
        let pooled_of_halves = of_halves.is_some().then(|| [&b, &a].map(|beside| beside.or_scatter(&self.met)));
        Self { pooled: a.mean(&b).or_scatter(&self.met), pooled_of_halves, of_halves, ..self }
    }

    /// Or by what shows over white, where that is more.
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
