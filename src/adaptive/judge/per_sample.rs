//! Variance of one sample, from which the counts of a plan are found.

use super::Purpose;
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
    /// [`super::Judgement::variance_per_sample`].
    pub(super) of_halves: Option<[Plane; 2]>,
}

impl PerSample {
    /// By what samples have met.
    pub(super) fn met(
        scatter: &Scatter,
        film: &Film,
        thresholds: &ThresholdMap,
        gains: Option<&ChromaticGains>,
        purpose: Purpose,
    ) -> Self {
        let met = scatter.pooled_per_sample(thresholds, gains);
        let of_halves = (purpose == Purpose::Plan).then(|| scatter.per_sample_of_halves(film, thresholds, gains));
        Self { pooled: met.clone(), met, of_halves }
    }

    /// Or by what lamps' rims may hide, where that is more.
    pub(super) fn or_missed(self, missed: Option<MissedNoise>) -> Self {
        let Some(missed) = missed else { return self };
        let of_halves = self.of_halves.map(|halves| halves.each_ref().map(|half| missed.or_scatter(half)));
        Self { pooled: missed.or_scatter(&self.met), of_halves, ..self }
    }

    /// Or by what shows over white, where that is more.
    pub(super) fn or_over_white(self, over_white: Option<&OverWhite>, thresholds: &Thresholds) -> Self {
        let Some(over_white) = over_white else { return self };
        let (pooled, of_halves) = over_white.worse_per_sample(&thresholds.limits(), &self.pooled, self.of_halves);
        Self { pooled, of_halves, ..self }
    }
}
