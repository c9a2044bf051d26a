//! What the raw halves tell of a denoised picture's bias in one band.

use crate::bands::{RINGS, for_each_ring};
use crate::error_filters::ErrorFilters;
use crate::fft::Spectrum;
use crate::plane::Plane;
use crate::threshold::{POOLING_SIGMA_DEG, ThresholdMap};

/// Squared bias over squared variance before anything is known of a picture. Measured from 16 samples a pixel on: true
/// error 1.00 to 1.18 times what the halves' difference shows (by a run of `fechner bench --suite denoise` whose table
/// is not kept).
const USUAL_FACTOR: f64 = 0.2;
/// Standard deviation of the factor between pictures.
const FACTOR_DEVIATION: f64 = 0.4;
/// Standard errors above what the factor says from which a place's own witness begins to count, and from which it
/// counts alone. Far out, since products of two normal values have long tails. Measured at 3 and 5: raw noise of
/// visibility 20 alone is taken for a bias of 1.8.
const BELIEVED_FROM: f32 = 5.0;
const BELIEVED_FULLY: f32 = 8.0;
/// Half the width of the window over which a band is pooled, in its own periods: a narrower one holds so few
/// independent values that neither noise nor witness means much. At least the eye's window.
const WINDOW_CYCLES: f64 = 0.5;
/// Fourth over squared second moment of a normal variable.
const NORMAL_KURTOSIS: f32 = 3.0;

/// Pooled energies of one band, squared threshold units.
pub(super) struct BandEvidence {
    /// Energy of the denoised halves' difference.
    pub(super) variance: Plane,
    /// Energy of the residual, less what noise puts into it: unbiased for the bias's, may be negative.
    pub(super) witness: Plane,
    /// Variance of `witness` from the raw noise.
    pub(super) witness_variance: Plane,
    /// Energy of the noise in the residual, which is nearly the raw mean's.
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
        // rA · rB of two normal halves, each of twice the mean's variance s², has the variance 4 s⁴. The fourth power
        // of the half difference keeps rare, large noise where it is, so that a firefly calls itself uncertain.
        let fourth = map.blurred(&noise.map(|energy| energy * energy), sigma_deg / std::f64::consts::SQRT_2);
        let pooled = |energy: &Plane| map.blurred(energy, sigma_deg);
        let mut witness_variance = fourth.map(|fourth| 4.0 / NORMAL_KURTOSIS * correlated * fourth);
        repeat_at_borders(&mut witness_variance, sigma_deg * density.horizontal, sigma_deg * density.vertical);
        Self {
            variance: pooled(&left_noise.enlarged(|value| value * value)),
            witness: pooled(&residual.enlarged_with(&residual_noise, |all, noise| all * all - noise * noise)),
            witness_variance,
            raw_noise: pooled(&noise),
            window_pixels: window_deg2 * pixels_a_deg2,
        }
    }
}

/// Multiplies the variance of pooled values by what mirrored borders repeat in the window: half as many independent
/// values make twice the variance at an edge, four times at a corner.
///
/// Along one axis the window g, at distance d from a mirror, weighs what is inside with g(u − d) + g(u + d), u > 0.
/// The square's integral is that of g(u − d)² over the whole axis and of 2 g(u − d) g(u + d) over half of it: ∫ g² ·
/// (1 + exp(−d²/σ²)) for a Gaussian. Measured on raw noise of visibility 4.0 alone, pixels where it is taken for a
/// bias above 1: without this 0.42 % at edges and 2.0 % at corners, with it 0.12 and 0.32 %.
fn repeat_at_borders(variance: &mut Plane, sigma_x_px: f64, sigma_y_px: f64) {
    let repetition = |index: usize, len: usize, sigma_px: f64| {
        let by_border = |pixels_between: usize| 1.0 + (-((pixels_between as f64 + 0.5) / sigma_px).powi(2)).exp();
        (by_border(index) * by_border(len - 1 - index)) as f32
    };
    let (width, height) = (variance.width(), variance.height());
    let across: Vec<f32> = (0..width).map(|x| repetition(x, width, sigma_x_px)).collect();
    variance.for_each_row_mut(|y, row| {
        let down = repetition(y, height, sigma_y_px);
        row.iter_mut().zip(&across).for_each(|(value, across)| *value *= across * down);
    });
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;
    use crate::display::{Display, Viewing};
    use crate::test_noise::normal;
    use crate::threshold::{ThresholdInputs, threshold_map};

    /// The witness of noise without bias scatters as much as it says, at borders and corners too, where the window
    /// holds the same values twice or four times.
    #[test]
    fn the_witness_knows_its_noise_at_borders() {
        const SIDE: usize = 64;
        const BAND: usize = 3;
        let viewing = Viewing::of(Display::preset("strict").expect("a preset"));
        let grey = Plane::filled(SIDE, SIDE, 100.0);
        let map = threshold_map(&ThresholdInputs::clean(&grey), &viewing, &CastleCsf::default()).unwrap();
        let mut filters = ErrorFilters::new(&map);
        let last = SIDE - 1;
        let middle: Vec<(usize, usize)> = [20, 32, 43].iter().flat_map(|&x| [20, 32, 43].map(|y| (x, y))).collect();
        let edges: Vec<(usize, usize)> =
            [20, 32, 43].iter().flat_map(|&along| [(along, 0), (along, last), (0, along), (last, along)]).collect();
        let corners = vec![(0, 0), (last, 0), (0, last), (last, last)];
        // Squared witnesses and what is said of them, by place.
        let mut sums = [(0.0, 0.0); 3];
        let mut state = 1;
        for _ in 0..200 {
            let mut noise = || {
                let values = (0..SIDE * SIDE).map(|_| normal(&mut state)).collect();
                Plane::from_values(SIDE, SIDE, values).unwrap()
            };
            let (sum, difference) = (noise(), noise());
            let spectra = [&Plane::filled(SIDE, SIDE, 0.0), &sum, &difference].map(|plane| filters.spectrum(plane));
            let evidence = BandEvidence::gather(&map, &mut filters, &spectra, BAND);
            for (sums, places) in sums.iter_mut().zip([&middle, &edges, &corners]) {
                for &(x, y) in places {
                    sums.0 += f64::from(evidence.witness.get(x, y)).powi(2);
                    sums.1 += f64::from(evidence.witness_variance.get(x, y));
                }
            }
        }
        let [middle, edges, corners] = sums.map(|(found, said)| found / said);
        for ratio in [edges / middle, corners / middle] {
            assert!((0.7..1.4).contains(&ratio), "variance over what is said of it: {middle}, {edges}, {corners}");
        }
    }
}
