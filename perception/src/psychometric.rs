//! From visibility to the probability of seeing.

/// Slope of the psychometric function (Daly's value, default of HDR-VDP 1).
pub const SLOPE: f64 = 3.5;

/// Probability that an error of visibility `v` (threshold units) is seen in a patch of 1°:
/// 1 − exp(−|v|^3.5), the Weibull psychometric function.
///
/// No further summation inside the patch belongs here: the contrast sensitivity for 1 deg² already holds it.
///
/// ```
/// use fechner_perception::psychometric::detection_probability;
/// assert!((detection_probability(1.0) - 0.632).abs() < 1e-3);
/// ```
#[must_use]
pub fn detection_probability(v: f64) -> f64 {
    -(-v.abs().powf(SLOPE)).exp_m1()
}

/// The visibility at which an error is seen with probability `probability`: the inverse of
/// [`detection_probability`]. Values outside [0, 1) give 0 or infinity.
#[must_use]
pub fn visibility_at_probability(probability: f64) -> f64 {
    (-(-probability.clamp(0.0, 1.0)).ln_1p()).powf(SLOPE.recip())
}

/// Probability that at least one of several independent patches is noticed: 1 − Π(1 − p), which for this function is
/// 1 − exp(−Σ|v|^3.5).
#[must_use]
pub fn probability_of_any(visibilities: impl IntoIterator<Item = f64>) -> f64 {
    -(-visibilities.into_iter().map(|v| v.abs().powf(SLOPE)).sum::<f64>()).exp_m1()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_values() {
        for (v, expected) in [
            (0.25, 0.007_782_061_74),
            (0.5, 0.084_594_687_81),
            (1.0, 0.632_120_558_8),
            (1.5, 0.983_973_536_3),
            (2.0, 0.999_987_795_5),
        ] {
            assert!((detection_probability(v) / expected - 1.0).abs() < 1e-9, "v = {v}");
            assert!((visibility_at_probability(expected) / v - 1.0).abs() < 1e-6, "v = {v}");
        }
        assert!((detection_probability(0.900_578) - 0.5).abs() < 1e-6);
        assert_eq!(detection_probability(-1.5), detection_probability(1.5));
    }

    #[test]
    fn probability_summation_is_minkowski_pooling() {
        let parts = [0.4, 0.9, 0.2];
        let product: f64 = parts.iter().map(|&v| 1.0 - detection_probability(v)).product();
        assert!((probability_of_any(parts) - (1.0 - product)).abs() < 1e-12);
    }
}
