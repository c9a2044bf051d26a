//! Variance of one sample, from which the counts of a plan are found.

use super::super::missed::FoundLight;
use super::over_white::OverWhite;
use super::steps::{MissedNoise, Scatter, Thresholds};
use crate::film::Film;
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::colour::ChromaticGains;
use fechner_perception::threshold::ThresholdMap;

/// Luminance variance of one sample, (cd/m²)² on the display, that shows as much as the most visible of the eye's channels.
pub(super) struct PerSample {
    /// [`super::Judgement::met_per_sample`].
    pub(super) met: Plane,
    /// [`super::Judgement::pooled_variance_per_sample`].
    pub(super) pooled: Plane,
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
        Self { pooled: met.clone(), met, of_halves }
    }

    /// Or by what lamps' rims may hide, where that is more. `picture` and `lights` are what the whole and its halves have found; what
    /// a half decides by is missed beside the other's.
    pub(super) fn or_missed(
        self,
        picture: &FoundLight,
        lights: Option<&[FoundLight; 2]>,
        missed_beside: impl Fn(&FoundLight) -> Option<MissedNoise>,
    ) -> Self {
        let or_missed = |per_sample: &Plane, light: &FoundLight| match missed_beside(light) {
            None => per_sample.clone(),
            Some(missed) => missed.or_scatter(per_sample),
        };
        let of_halves = self.of_halves.zip(lights).map(|(halves, lights)| {
            Half::BOTH.map(|half| or_missed(&halves[half.index()], &lights[half.other().index()]))
        });
        Self { pooled: or_missed(&self.met, picture), of_halves, ..self }
    }

    /// Or by what shows over white, where that is more.
    pub(super) fn or_over_white(self, over_white: Option<&OverWhite>, thresholds: &Thresholds) -> Self {
        let Some(over_white) = over_white else { return self };
        let (pooled, of_halves) = over_white.worse_per_sample(&thresholds.limits(), &self.pooled, self.of_halves);
        Self { pooled, of_halves, ..self }
    }
}
