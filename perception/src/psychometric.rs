//! From visibility to the probability of seeing, by a Weibull function of Daly's slope.
//!
//! For one patch of 1°. Not for whole pictures, whose patches each have a chance of their own.

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
        }
        assert!((detection_probability(0.900_578) - 0.5).abs() < 1e-6);
        assert_eq!(detection_probability(-1.5), detection_probability(1.5));
    }
}
