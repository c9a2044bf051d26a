//! Barten's short formula of 1989: sensitivity by frequency and luminance in closed form.
//!
//! For ratios of sensitivities, and to compare with perceptualdiff and OpenImageIO. Not for absolute thresholds, which
//! lie 2 to 3 times higher for 1°, and not where area, motion or colour matter: it knows none.

use super::{ContrastSensitivity, HIGHEST_CPD};

/// Barten, "The square root integral (SQRI)", 1989, in the form that perceptualdiff and OpenImageIO use: a u exp(−b u)
/// √(1 + 0.06 exp(b u)) with a = 440 (1 + 0.7/L)^−0.2 and b = 0.3 (1 + 100/L)^0.15.
///
/// Knows no area and is 2 to 3 times above thresholds measured for 1°: for ratios and for comparison with those
/// programs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Barten89;

impl ContrastSensitivity for Barten89 {
    fn name(&self) -> &'static str {
        "barten89"
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        if freq_cpd <= 0.0 {
            return 0.0;
        }
        let freq_cpd = freq_cpd.min(HIGHEST_CPD);
        let luminance = luminance_cd_m2.clamp(1e-4, 1e6);
        let a = 440.0 * (1.0 + 0.7 / luminance).powf(-0.2);
        let decay = 0.3 * (1.0 + 100.0 / luminance).powf(0.15) * freq_cpd;
        // exp(−d) √(1 + 0.06 exp(d)) without the overflow of exp(d).
        a * freq_cpd * ((-2.0 * decay).exp() + 0.06 * (-decay).exp()).sqrt()
    }
}
