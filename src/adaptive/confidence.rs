//! An upper bound on what can be seen of each place, which holds however often one looks.
//!
//! A look's estimate is below the truth about as often as above it, and the more often one looks the likelier one look
//! finds it low. So the k-th look of which a plan comes adds as many standard errors of the estimate as a normal
//! variable stays below with probability 1 − α/(k(k+1)). These chances sum to α: a place is wrongly called invisible at
//! any of these looks with a chance of α at most (a union bound). That is said of each place, not of the whole picture:
//! of all places up to α may be told too low, and those within a window of the eye go together.
//!
//! v² is a mean over the eye's window, and each pixel of it has an observation of its own: the squared difference of
//! its halves, in luminance and in two opponent colours. Their mean has no bias, where the energy that pooled variances
//! tell, which are held to what halves may differ by, is some 3 % low. By how much they miss what was told of them is
//! the scatter of that mean, heavy tails among it; and a window of some hundred pixels or more makes it nearly normal.
//!
//! No bound holds for tails of any weight (Bahadur and Savage 1956): of a lognormal with a coefficient of variation
//! of 2 it fails three times as often as it says. Light that is expected beside lamps is an expectation, not bounded;
//! paths that were never sampled are in no bound. Not for models that pool nothing, for what a denoiser changed, for
//! pictures over other pictures, nor for samples whose errors depend on their neighbours' (Z-order).

use super::judge::{JudgeError, Judgement, variance_shares};
use super::settings::LoopSettings;
use super::state::RenderState;
use crate::student::t_half_width;
use fechner_perception::Plane;

/// Standard errors that a look adds to stay on the safe side with probability `confidence` over all looks,
/// `earlier_looks` before it.
pub(super) fn standard_errors(confidence: f64, earlier_looks: u32) -> f64 {
    let look = f64::from(earlier_looks) + 1.0;
    // Of two sides one is allowed; of as many pixels as a window holds t is as good as normal.
    t_half_width(1.0 - 2.0 * (1.0 - confidence) / (look * (look + 1.0)), f64::INFINITY)
}

/// A bound is at most so many times the estimate: more would say no more.
const MAX_FACTOR: f32 = 1e3;

/// How many times the predicted visibility the bound is, at least 1; of the channel whose bound is the highest. `None`
/// where no window pools, or the picture is denoised.
///
/// # Errors
/// If the perception model refuses the judgement's maps, which would be a defect of ours.
pub(super) fn factor_of_bound(
    judgement: &Judgement,
    state: &RenderState,
    settings: &LoopSettings,
    standard_errors: f64,
) -> Result<Option<Plane>, JudgeError> {
    if judgement.thresholds.per_pixel.is_some() || judgement.denoised.is_some() {
        return Ok(None);
    }
    let thresholds = &judgement.thresholds.in_bands;
    // What nobody can say counts as none, as it does for the pixels around it.
    let energy_of =
        |variance: &Plane| judgement.energy_of(variance).map(|energy| if energy.is_finite() { energy } else { 0.0 });
    let shares = variance_shares(&state.film);
    let told = energy_of(&judgement.pooled_variance_per_sample.combined(&shares, |sample, share| sample * share));
    let pooled = thresholds.pooled(&told);
    // Audits know of noise that halves do not show.
    let inflation = state.inflation as f32;
    let factor_of = |found: Plane| {
        let found = energy_of(&found.map(|squared| inflation * squared));
        let missed = found.combined(&told, |found, told| found - told);
        // Cubes of f32 end at 1e38.
        let unit = missed.map(f32::abs).max().max(f32::MIN_POSITIVE);
        let scatter = thresholds.pooled_scatter(&missed.map(|missed| missed / unit));
        let margin = scatter.variance.combined(&scatter.third_moment, |variance, third_moment| {
            unit * margin(f64::from(variance), f64::from(third_moment), standard_errors) as f32
        });
        let bound = thresholds.pooled(&found).combined(&margin, |found, margin| found + margin);
        bound.combined(&pooled, |bound, told| {
            let times = (bound / told).sqrt();
            // Not where nothing is told: that is NaN or infinite.
            if told > 0.0 && times >= 1.0 { times.min(MAX_FACTOR) } else { 1.0 }
        })
    };
    let factors = judgement.found_by_channel(&state.film, settings)?.into_iter().map(factor_of);
    Ok(factors.reduce(|one, other| one.combined(&other, f32::max)))
}

/// What a mean is raised by to an upper bound of so many standard errors. A mean that is skewed to the right is low
/// when its variance is: N. J. Johnson's correction (1978, "Modified t tests and confidence intervals for
/// asymmetrical populations").
fn margin(variance: f64, third_moment: f64, standard_errors: f64) -> f64 {
    if variance <= 0.0 {
        return 0.0;
    }
    let of_skew = (1.0 + 2.0 * standard_errors * standard_errors) / 6.0 * third_moment / variance;
    standard_errors * variance.sqrt() + of_skew.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::judge::judge;
    use super::super::test_films::settings;
    use super::*;
    use crate::film::{Film, film_of_samples};
    use crate::integrator::PathSample;
    use crate::sampler::{hash_words, unit_f64_of_hash};
    use glam::Vec3;

    const SIDE: u32 = 64;
    const CONFIDENCE: f64 = 0.95;

    /// What samples of a pixel are drawn from: a share of display white, and its variance.
    struct Noise {
        name: &'static str,
        /// Of two numbers in [0, 1).
        draw: fn(f64, f64) -> f64,
        variance: f64,
    }

    /// A standard normal variable of two in [0, 1).
    fn normal(u: f64, v: f64) -> f64 {
        (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// Even noise, a lognormal of coefficient of variation 2, and fireflies of a tenth of the light that one sample
    /// in 200 finds.
    const NOISES: [Noise; 3] = [
        Noise { name: "even", draw: |u, _| 0.2 + 0.2 * u, variance: 0.04 / 12.0 },
        // exp(σ²) = 5.
        Noise { name: "lognormal", draw: |u, v| 0.02 * (1.268_636 * normal(u, v) - 0.804_719).exp(), variance: 0.0016 },
        Noise {
            name: "fireflies",
            draw: |u, _| if u < 0.005 { 0.8 } else { 0.036 },
            variance: 0.005 * 0.995 * 0.764 * 0.764,
        },
    ];

    fn film_of(noise: &Noise, seed: u64, samples_a_half: u32) -> Film {
        film_of_samples([SIDE; 2], [samples_a_half; 2], |pixel, half, index| {
            let key = hash_words(seed, u64::from(pixel) << 32 | u64::from(index) << 1 | half.index() as u64);
            let [u, v] = [1, 2].map(|which| unit_f64_of_hash(hash_words(key, which)));
            PathSample::of_wall(Vec3::splat((noise.draw)(u, v) as f32))
        })
    }

    /// Shares of places of which an estimate, or a bound, was below the truth at any of some looks at a render.
    fn shares_below_the_truth(noise: &Noise, looks: &[u32], seed: u64) -> [f64; 2] {
        let settings = settings();
        let places = (SIDE * SIDE) as usize;
        let mut is_below = vec![[false; 2]; places];
        for (earlier, &samples_a_half) in looks.iter().enumerate() {
            let film = film_of(noise, seed, samples_a_half);
            let judgement = judge(&film, &settings, 1.0).expect("judges");
            let nits = settings.nits_per_unit;
            let variance = noise.variance * nits * nits / f64::from(2 * samples_a_half);
            let truth = judgement.visibility_of(&Plane::filled(SIDE as usize, SIDE as usize, variance as f32));
            let state = RenderState::of_film(film, 16);
            let factor = factor_of_bound(&judgement, &state, &settings, standard_errors(CONFIDENCE, earlier as u32));
            let factor = factor.expect("judges").expect("a window pools");
            for (place, is_below) in is_below.iter_mut().enumerate() {
                let [predicted, factor, truth] = [&judgement.predicted, &factor, &truth].map(|p| p.values()[place]);
                is_below[0] |= predicted < truth;
                is_below[1] |= predicted * factor < truth;
            }
        }
        [0, 1].map(|which| is_below.iter().filter(|below| below[which]).count() as f64 / places as f64)
    }

    /// The mean of some shares and its standard error.
    fn mean_of(shares: impl ExactSizeIterator<Item = f64> + Clone) -> [f64; 2] {
        let count = shares.len() as f64;
        let mean = shares.clone().sum::<f64>() / count;
        let variance = shares.map(|share| (share - mean).powi(2)).sum::<f64>() / (count - 1.0);
        [mean, (variance / count).sqrt()]
    }

    /// Of so many renders, by noise: the shares of estimates and of bounds, each with its standard error.
    fn table(seeds: u64, looks: &[u32]) -> Vec<[[f64; 2]; 2]> {
        let of_noise = |noise: &Noise| {
            let shares: Vec<_> = (0..seeds).map(|seed| shares_below_the_truth(noise, looks, seed)).collect();
            let found = [0, 1].map(|which| mean_of(shares.iter().map(|share| share[which])));
            let [estimates, bounds] =
                found.map(|[mean, error]| format!("{:.2} ± {:.2} %", 100.0 * mean, 100.0 * error));
            println!("{}, {looks:?} samples a half: estimates {estimates}, bounds {bounds}", noise.name);
            found
        };
        NOISES.iter().map(of_noise).collect()
    }

    #[test]
    fn chances_of_all_looks_sum_to_what_is_left_of_confidence() {
        for (earlier, expected) in [(0, 1.962_34), (1, 2.398_01), (9, 3.327_23)] {
            let found = standard_errors(CONFIDENCE, earlier);
            assert!((found - expected).abs() < 1e-4, "{found} for {expected}");
        }
    }

    /// Within three standard errors of 40 renders; the chances of three looks sum to 3.75 %. A lognormal's tails are
    /// heavier than any bound, and fail in 16 ± 3 % without the correction for skew.
    #[test]
    fn bounds_hold_over_looks_where_estimates_do_not() {
        const ALLOWED: f64 = 0.75 * (1.0 - CONFIDENCE);
        let [even, lognormal, fireflies] = table(40, &[8, 16, 32]).try_into().expect("three kinds of noise");
        for [[estimates, _], _] in [even, lognormal, fireflies] {
            assert!(estimates > 0.5, "{estimates}");
        }
        for [_, [bounds, error]] in [even, fireflies] {
            assert!(bounds < ALLOWED + 3.0 * error, "{bounds} ± {error}, {ALLOWED} allowed");
        }
        assert!(lognormal[1][0] < 0.13, "{lognormal:?}");
    }

    /// What a mean of 100 squared normal numbers is raised by: Johnson's correction is a tenth of two standard errors.
    #[test]
    fn skew_widens_the_margin() {
        let (variance, third_moment) = (2.0 / 100.0, 8.0 / 10_000.0);
        let without = margin(variance, 0.0, 2.0);
        assert!((without - 2.0 * variance.sqrt()).abs() < 1e-12);
        assert!((margin(variance, third_moment, 2.0) / without - 1.212).abs() < 1e-3);
        assert_eq!(margin(variance, -third_moment, 2.0), without);
        assert_eq!(margin(0.0, 0.0, 2.0), 0.0);
    }

    fn bound_of(film: Film, settings: &LoopSettings, inflation: f64) -> Plane {
        let judgement = judge(&film, settings, inflation).expect("judges");
        let state = RenderState { inflation, ..RenderState::of_film(film, 16) };
        factor_of_bound(&judgement, &state, settings, 2.0).expect("judges").expect("a window pools")
    }

    /// An audit that found noise too weak raises the estimate and what is added to it.
    #[test]
    fn audits_raise_bounds_as_estimates() {
        let of = |inflation: f64| bound_of(film_of(&NOISES[0], 3, 8), &settings(), inflation);
        let (plain, inflated) = (of(1.0), of(2.0));
        let worst =
            plain.values().iter().zip(inflated.values()).fold(0.0, |most: f32, (a, b)| most.max((a / b - 1.0).abs()));
        assert!(worst < 0.02, "{worst}");
    }

    /// Where colours scatter and luminance does not, the bound is of colours.
    #[test]
    fn colours_have_bounds_of_their_own() {
        let of = |tint: f32| {
            let film = film_of_samples([SIDE; 2], [8; 2], |pixel, half, index| {
                let random =
                    unit_f64_of_hash(hash_words(u64::from(pixel) << 8 | u64::from(index), half.index() as u64));
                // Red for green, of one luminance.
                let red = tint * (random as f32 - 0.5);
                PathSample::of_wall(Vec3::new(0.3 + red, 0.3 - red * 0.212_6 / 0.715_2, 0.3))
            });
            bound_of(film, &settings(), 1.0).mean()
        };
        let bound = of(0.2);
        assert!((1.005..1.1).contains(&bound), "{bound}");
    }

    /// Without noise, of one pixel, and where nobody can say: at least 1, and a number.
    #[test]
    fn bounds_are_at_least_estimates() {
        let flat = Noise { name: "none", draw: |_, _| 0.2, variance: 0.0 };
        assert_eq!(bound_of(film_of(&flat, 1, 8), &settings(), 1.0).max(), 1.0);
        let pixel = |value: f32| {
            film_of_samples([1, 1], [2; 2], |_, half, index| {
                PathSample::of_wall(Vec3::splat(value * (1.0 + half.index() as f32 + index as f32)))
            })
        };
        for value in [0.0, 0.1, 1e12] {
            let bound = bound_of(pixel(value), &settings(), 1.0).get(0, 0);
            assert!((1.0..=MAX_FACTOR).contains(&bound), "{value}: {bound}");
        }
    }

    /// The table of `benches/results/sampling.md`: minutes.
    #[test]
    #[ignore = "minutes"]
    fn bounds_in_numbers() {
        for looks in [&[8][..], &[8, 16, 32, 64, 128]] {
            table(200, looks);
        }
    }
}
