//! When a render is done: why it ended, when a visibility is reached, and whether uneven counts are worth it. What is
//! traced until then is left to `plan`.

use super::judge::Judgement;
use crate::film::Film;
use fechner_perception::Plane;

/// Share of pixels that may remain above the target when the loop stops.
pub const TOLERATED_SHARE: f64 = 0.001;
/// No pixel of the predicted map, which holds what the eye pools around each, may stay above this many times the
/// target.
const TOLERATED_WORST: f64 = 2.0;
/// Below this predicted saving the loop samples uniformly: its estimates err by more.
pub(super) const MIN_SAVING: f64 = 0.05;

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// Predicted visibility is at most the target on 99.9 % of the picture and nowhere above twice the
    /// target; of adaptive sampling, after an audit has agreed where one is made; none is where the last
    /// sample of a budget has reached it.
    Visibility,
    /// The time was up.
    Time,
    /// The mean number of samples was reached.
    Samples,
    /// What can still be seen is in pixels that have the most samples allowed.
    MaxSamples,
    /// The number of plans was reached.
    Plans,
    /// Another renderer's rule was satisfied.
    Rule,
    /// The monitor asked for it.
    Interrupted,
    /// The film is the sum of several, and what was asked for is not reached.
    Merged,
}

/// Whether a rung's stop is met: no more than the tolerated share of pixels is above it, and none is far above. Never
/// where too few samples tell, and never for 0, where only other limits count: a lamp that 16 samples of a pixel have
/// missed leaves no noise at all. Measured without: an even render of 4096 ends there, black, with 11 seeds of 12.
pub fn is_reached(judgement: &Judgement, rung: f64) -> bool {
    if rung <= 0.0 {
        return false;
    }
    judgement.is_known
        && visible_share(judgement, rung) <= TOLERATED_SHARE
        && f64::from(judgement.predicted.max()) <= TOLERATED_WORST * rung
}

/// Share of samples that the wanted counts save against as many everywhere as the hardest tolerated pixel needs.
pub(super) fn predicted_saving(film: &Film, judgement: &Judgement, wanted: &Plane, rung: f64) -> f64 {
    let counts = wanted.values().iter().enumerate().map(|(i, &wanted)| f64::from(wanted).max(film.samples(i).into()));
    let mean_count = counts.sum::<f64>() / wanted.values().len() as f64;
    let saving = |for_one_sample: &Plane| {
        let uniform = (for_one_sample.quantile(1.0 - TOLERATED_SHARE) / rung).powi(2);
        1.0 - mean_count / uniform
    };
    // Mostly the saving is large, and a rough look tells.
    let variance = &judgement.pooled_variance_per_sample;
    let roughly = saving(&judgement.rough_visibility_of(variance));
    if roughly > 4.0 * MIN_SAVING { roughly } else { saving(&judgement.visibility_of(variance)) }
}

/// Share of pixels whose predicted visibility is above `visibility`.
pub fn visible_share(judgement: &Judgement, visibility: f64) -> f64 {
    judgement.predicted.share_above(visibility)
}
