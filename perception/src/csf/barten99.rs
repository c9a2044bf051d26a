//! Barten's physical model of contrast sensitivity, 1999: optics, photon noise, neural noise and lateral inhibition.
//!
//! For static gratings of any area and luminance in the fovea. Not for motion, flicker or colour, which it does not
//! know.

use super::ContrastSensitivity;

/// Barten, "Contrast sensitivity of the human eye and its effects on image quality", SPIE Press, 1999: foveal and
/// static, from the eye's optics, photon noise, neural noise and lateral inhibition.
///
/// k = 3, T = 0.1 s, `X_max` = 12°, `N_max` = 15 cycles, η = 0.03, Φ₀ = 3e-8 s deg², u₀ = 7 cpd, σ₀ = 0.5′, `C_ab` =
/// 0.08′/mm, p = 1.2274e6 (white of a CRT).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Barten99 {
    /// Side of the square field, degrees.
    pub field_deg: f64,
}

impl Default for Barten99 {
    /// 1° × 1°.
    fn default() -> Self {
        Self { field_deg: 1.0 }
    }
}

impl ContrastSensitivity for Barten99 {
    fn name(&self) -> &'static str {
        "barten99"
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        const PHOTON_CONVERSION: f64 = 1.2274e6;
        if freq_cpd <= 0.0 {
            return 0.0;
        }
        let luminance = luminance_cd_m2.clamp(1e-4, 1e6);
        let field = self.field_deg.clamp(1e-3, 1e3);
        let pupil_mm = 5.0 - 3.0 * (0.4 * (luminance * field * field / 1600.0).log10()).tanh();
        // Stiles–Crawford: light through the pupil's rim counts less.
        let trolands = std::f64::consts::PI * pupil_mm * pupil_mm / 4.0
            * luminance
            * (1.0 - (pupil_mm / 9.7).powi(2) + (pupil_mm / 12.4).powi(4));
        let sigma_deg = (0.5_f64.powi(2) + (0.08 * pupil_mm).powi(2)).sqrt() / 60.0;
        sensitivity_of(freq_cpd, field, sigma_deg, trolands, PHOTON_CONVERSION)
    }
}

fn sensitivity_of(freq_cpd: f64, field_deg: f64, sigma_deg: f64, trolands: f64, photon_conversion: f64) -> f64 {
    const SIGNAL_TO_NOISE: f64 = 3.0;
    const INTEGRATION_S: f64 = 0.1;
    const MAX_FIELD_DEG: f64 = 12.0;
    const MAX_CYCLES: f64 = 15.0;
    const QUANTUM_EFFICIENCY: f64 = 0.03;
    const NEURAL_NOISE: f64 = 3e-8;
    const INHIBITION_CPD: f64 = 7.0;
    let optics = (-2.0 * (std::f64::consts::PI * sigma_deg * freq_cpd).powi(2)).exp();
    let window = field_deg.powi(-2) + MAX_FIELD_DEG.powi(-2) + (freq_cpd / MAX_CYCLES).powi(2);
    let photon_noise = (QUANTUM_EFFICIENCY * photon_conversion * trolands).recip();
    let neural_noise = NEURAL_NOISE / -(-(freq_cpd / INHIBITION_CPD).powi(2)).exp_m1();
    optics / SIGNAL_TO_NOISE / (2.0 / INTEGRATION_S * window * (photon_noise + neural_noise)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_golden::check;

    /// The value that the colour-science library publishes for the same parameters.
    #[test]
    fn agrees_with_another_implementation() {
        let found = sensitivity_of(4.0, 60.0, 0.008_791_157_173_230_634, 66.082_316_060_529_92, 1.2274e6);
        check("csf_barten99_colour_default_u4", 1e-6, |_| found);
    }
}
