//! What the raw halves tell of a denoised picture's bias in one band.

use crate::bands::{RINGS, for_each_ring};
use crate::fft::Spectrum;
use crate::plane::Plane;
use crate::threshold::{POOLING_SIGMA_DEG, ThresholdMap};
use crate::visibility::ErrorFilters;

/// Squared bias over squared variance before anything is known of a picture: true error was 1.00 to 1.18 times what the
/// halves' difference shows from 16 samples a pixel on (`fechner bench --suite denoise`, benches/results/denoising.md).
const USUAL_FACTOR: f64 = 0.2;
/// Its standard deviation between pictures.
const FACTOR_DEVIATION: f64 = 0.4;
/// Standard errors above what the factor says from which a place's own witness begins to count, and from which it counts alone.
/// Products of two normal values have long tails: at 3 and 5, raw noise of visibility 20 alone was taken for a bias of 1.8.
const BELIEVED_FROM: f32 = 5.0;
const BELIEVED_FULLY: f32 = 8.0;
/// Half the width of the window over which a band is pooled, in its own periods: a narrower one holds so few independent
/// values that neither noise nor witness means much. At least the eye's window.
const WINDOW_CYCLES: f64 = 0.5;
/// Fourth over squared second moment of a normal variable.
const NORMAL_KURTOSIS: f32 = 3.0;

/// Pooled energies of one band, squared threshold units.
pub(super) struct BandEvidence {
    /// Of the denoised halves' difference.
    pub(super) variance: Plane,
    /// Of the residual, less what noise puts into it: unbiased for the bias's, may be negative.
    pub(super) witness: Plane,
    /// Variance of `witness` from the raw noise.
    pub(super) witness_variance: Plane,
    /// Of the noise in the residual, which is nearly the raw mean's.
    pub(super) raw_noise: Plane,
    /// Pixels that the pooling window holds: neighbours within it are no independent witnesses.
    window_pixels: f64,
}

/// The bias of one band.
pub(super) struct BandBias {
    /// Energy, at least 0.
    pub(super) energy: Plane,
    /// Variance of that energy where it is not proven.
    pub(super) uncertainty: Plane,
    /// How far a place's own witness is believed, 0 to 1.
    pub(super) proof: Plane,
    /// Squared bias over squared variance of the whole band.
    pub(super) factor: f64,
}

impl BandEvidence {
    /// Filters and pools. `spectra`: of half difference, residual and residual half difference.
    pub(super) fn gather(
        map: &ThresholdMap,
        filters: &mut ErrorFilters<'_>,
        spectra: &[Spectrum; 3],
        band: usize,
    ) -> Self {
        let density = map.viewing.display.pixel_density();
        let [left_noise, residual, residual_noise] =
            spectra.each_ref().map(|spectrum| filters.response(spectrum, band));
        let noise = residual_noise.enlarged(|value| value * value);
        let pixels_a_deg2 = density.horizontal * density.vertical;
        let sigma_deg = POOLING_SIGMA_DEG.max(WINDOW_CYCLES / map.bands.center_cpd(band));
        // ∫ g² of the window is 1 over this area.
        let window_deg2 = 4.0 * std::f64::consts::PI * sigma_deg * sigma_deg;
        let correlated = (correlation_area_px(map, filters, band) / pixels_a_deg2 / window_deg2).min(1.0) as f32;
        // rA · rB of two normal halves, each of twice the mean's variance s², has the variance 4 s⁴. The fourth power of
        // the half difference keeps rare, large noise where it is, so that a firefly calls itself uncertain.
        let fourth = map.blurred(&noise.map(|energy| energy * energy), sigma_deg / std::f64::consts::SQRT_2);
        let pooled = |energy: &Plane| map.blurred(energy, sigma_deg);
        Self {
            variance: pooled(&left_noise.enlarged(|value| value * value)),
            witness: pooled(&residual.enlarged_with(&residual_noise, |all, noise| all * all - noise * noise)),
            witness_variance: fourth.map(|fourth| 4.0 / NORMAL_KURTOSIS * correlated * fourth),
            raw_noise: pooled(&noise),
            window_pixels: window_deg2 * pixels_a_deg2,
        }
    }
}

/// Area over which white noise through a band's filter is correlated, pixels: ∫ρ² = mean(H⁴) / mean(H²)².
fn correlation_area_px(map: &ThresholdMap, filters: &ErrorFilters<'_>, band: usize) -> f64 {
    let gain = filters.gain(band, map.levels.len() / 2);
    let (mut second, mut fourth) = (0.0, 0.0);
    for_each_ring(map.viewing.display.pixel_density(), RINGS, |freq_cpd, weight| {
        let square = f64::from(gain.at(freq_cpd as f32)).powi(2);
        second += weight * square;
        fourth += weight * square * square;
    });
    if second > 0.0 { fourth / (second * second) } else { f64::INFINITY }
}

/// Bias from the witness where it stands out of its noise or is precise, from the band's factor elsewhere.
pub(super) fn bias_energy(evidence: &BandEvidence) -> BandBias {
    let factor = factor(evidence);
    let expected = evidence.variance.map(|variance| factor as f32 * variance);
    let excess = evidence.witness.combined(&expected, |witness, expected| witness - expected);
    let proof = excess.combined(&evidence.witness_variance, |excess, variance| {
        let errors = if variance > 0.0 { excess / variance.sqrt() } else { excess.signum() * f32::INFINITY };
        let proof = (errors - BELIEVED_FROM) / (BELIEVED_FULLY - BELIEVED_FROM);
        if proof.is_nan() { 0.0 } else { proof.clamp(0.0, 1.0) }
    });
    // A place's bias scatters about what the factor says by about as much: a witness more precise than that is better.
    let precision = expected.combined(&evidence.witness_variance, |expected, variance| {
        let scatter = expected * expected;
        if scatter > 0.0 { scatter / (scatter + variance) } else { 0.0 }
    });
    let trust = precision.combined(&proof, f32::max);
    let gained = excess.combined(&trust, |excess, trust| excess * trust);
    BandBias {
        energy: expected.combined(&gained, |expected, gained| (expected + gained).max(0.0)),
        uncertainty: evidence.witness_variance.combined(&trust, |variance, trust| variance * (1.0 - trust)),
        proof,
        factor,
    }
}

/// Regression of the witness on the variance through 0, weighed by the witness's precision and drawn towards the usual
/// factor as if that were one more measurement.
fn factor(evidence: &BandEvidence) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    let values =
        evidence.variance.values().iter().zip(evidence.witness.values()).zip(evidence.witness_variance.values());
    for ((&variance, &witness), &noise) in values {
        // A place's bias scatters about the factor by about as much as it is itself.
        let weight = 1.0 / (f64::from(noise) + f64::from(variance).powi(2) + f64::MIN_POSITIVE);
        product += weight * f64::from(variance) * f64::from(witness);
        square += weight * f64::from(variance).powi(2);
    }
    let (product, square) = (product / evidence.window_pixels, square / evidence.window_pixels);
    let prior = 1.0 / (FACTOR_DEVIATION * FACTOR_DEVIATION);
    ((product + prior * USUAL_FACTOR) / (square + prior)).max(0.0)
}
