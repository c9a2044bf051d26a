//! The counts that one would take who knew every pixel's variance and threshold: the convex optimum.

use super::Subject;
use super::reference::Reference;
use super::truth::Truth;
use crate::adaptive::settings::DEFAULT_MAX_SAMPLES;
use crate::film::{CHANNELS, Film};
use crate::integrator::{BlockWork, PILOT_SAMPLES_PER_HALF, PILOT_SAMPLES_PER_PIXEL, SamplePlan};
use crate::sampler::{Half, hash_words, unit_f64_of_hash};
use anyhow::Result;
use fechner_perception::allocation::{Allocation, AllocationProblem, FINE_GAP, allocate};
use fechner_perception::{Plane, seen};

/// Variance of one sample of each pixel on the display, as luminance that is as visible as the most visible channel.
pub(crate) fn displayed_variance(subject: &Subject, reference: &Reference, truth: &Truth) -> Result<Plane> {
    let display = &subject.viewing.display;
    let mean = reference.luminance();
    // An operator bends: the variance is pushed through it at the size it has when uniform sampling is done.
    let spp = reference.uniform_spp as f32;
    let of_mean: [Plane; CHANNELS] = std::array::from_fn(|c| {
        let factor = &reference.low_discrepancy_factor[c];
        let variance = &reference.sample_variance[c];
        Plane::from_fn(variance.width(), variance.height(), |x, y| variance.get(x, y) * factor.get(x, y) / spp)
    });
    let tone = truth.tone.as_ref();
    let colours = seen::SceneColours {
        rgb: &reference.rgb_cd_m2(),
        chromatic_slope: &seen::display_chromatic_slope(tone, display, &mean),
    };
    let [achromatic, red_green, yellow_violet] =
        seen::display_opponent_variances(tone, display, &mean, colours, of_mean.each_ref());
    let thresholds = &truth.thresholds.achromatic;
    let gains = thresholds.chromatic_gains()?;
    let equivalent = thresholds.luminance_equivalent_variance(&gains, [&achromatic, &red_green, &yellow_violet]);
    Ok(equivalent.map(|variance| variance * spp))
}

/// Fewest samples a pixel that the bound knows, of uniform sampling and of the optimum alike: no pixel does without
/// any. A rule that has to look before it chooses has its pilot besides, which is its own affair.
const FEWEST: f64 = 1.0;

/// Samples a pixel that uniform sampling needs for v\* on this share of the picture; at least [`FEWEST`].
pub(crate) fn uniform_samples(subject: &Subject, truth: &Truth, variance: &Plane, coverage: f64) -> f64 {
    let hardest = truth.thresholds.achromatic.predicted_visibility(variance).quantile(coverage);
    (hardest / subject.visibility).powi(2).max(FEWEST)
}

/// The samples that the oracle takes for a visibility on this share of the picture, in every pixel the pilot of our own
/// loop at least: it is there to be compared with, and is traced as the loop traces.
pub(crate) fn least_samples(truth: &Truth, variance: &Plane, visibility: f64, coverage: f64) -> Result<Plane> {
    Ok(optimum(truth, variance, visibility, coverage, f64::from(PILOT_SAMPLES_PER_PIXEL))?.samples)
}

/// The fewest mean samples a pixel that any rule could take for a visibility on this share of the picture, with
/// [`FEWEST`] in every pixel: what the optimum's multipliers prove, 0.2 to 4 % below its counts.
pub(crate) fn least_mean_samples(truth: &Truth, variance: &Plane, visibility: f64, coverage: f64) -> Result<f64> {
    let pixels = variance.values().len() as f64;
    Ok(optimum(truth, variance, visibility, coverage, FEWEST)?.lower_bound / pixels)
}

/// The cheapest counts of at least `fewest` a pixel: the pixels that uniform sampling would leave above the
/// visibility are left above it.
fn optimum(truth: &Truth, variance: &Plane, visibility: f64, coverage: f64, fewest: f64) -> Result<Allocation> {
    let seen = truth.thresholds.achromatic.predicted_visibility(variance);
    let hardest = seen.quantile(coverage) as f32;
    // Far above, not infinite: the solver's multipliers stay finite.
    let tolerance = seen.map(|v| if v > hardest { 30.0 } else { 1.0 });
    Ok(allocate(&AllocationProblem {
        variance_per_sample: variance,
        thresholds: &truth.thresholds.achromatic,
        cost: &Plane::filled(variance.width(), variance.height(), 1.0),
        tolerance: Some(&tolerance),
        visibility,
        min_samples: fewest,
        max_samples: f64::from(DEFAULT_MAX_SAMPLES),
        enough_gap: FINE_GAP,
    })?)
}

/// Traces real-valued counts: where one lies between two doublings, they are mixed by chance so that the mean of 1/n is
/// right.
pub(crate) fn trace_counts(subject: &Subject, counts: &Plane, seed: u64) -> Film {
    let tracer = subject.tracer(seed);
    let mut film = Film::new(subject.size.0, subject.size.1);
    let mut plan = SamplePlan::default();
    for (pixel, &count) in counts.values().iter().enumerate() {
        for half in Half::BOTH {
            let random = unit_f64_of_hash(hash_words(hash_words(seed, pixel as u64), half.index() as u64));
            let pilots = (0.5 * f64::from(count) / f64::from(PILOT_SAMPLES_PER_HALF)).max(1.0);
            let doublings = pilots.log2().floor();
            let share = 2.0 * (1.0 - doublings.exp2() / pilots);
            let is_next = random < share;
            for level in 0..=doublings as u8 + u8::from(is_next) {
                plan.blocks.push(BlockWork::whole(pixel as u32, half, level));
            }
        }
    }
    tracer.trace(&plan, &mut film, &|_| {});
    film
}
