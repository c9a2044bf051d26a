//! Daly's spatiovelocity contrast sensitivity, 1998, after Kelly 1979: gratings that move over the retina.
//!
//! For ratios between velocities ([`super::Moving`], [`crate::motion`]). Not for absolute thresholds: it knows neither
//! area nor luminance, and is for about 100 cd/m², 0.15 to 80 deg/s and 0.1 to 60 cpd.

use super::{ContrastSensitivity, HIGHEST_CPD};

/// Kelly's stabilised CSF as Daly fitted it to natural viewing, for gratings that move over the retina.
///
/// Kelly, "Motion and vision II: stabilized spatiotemporal threshold surface", JOSA 69, 1979; Daly, "Engineering
/// observations from spatiovelocity and spatiotemporal visual models", SPIE 3299, 1998, with his c₀ = 1.14,
/// c₁ = 0.67, c₂ = 1.7. Valid for 0.15 to 80 deg/s and 0.1 to 60 cpd; slower is drift all the same, so velocities are
/// taken as at least 0.15 deg/s. It describes about 100 cd/m² and ignores luminance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Daly98 {
    /// Velocity over the retina, deg/s.
    pub retinal_velocity_deg_s: f64,
}

/// The eye's drift when it is still, deg/s (Daly 1998).
pub const DRIFT_DEG_S: f64 = 0.15;
/// The fastest smooth pursuit, deg/s (Daly 1998).
pub const FASTEST_PURSUIT_DEG_S: f64 = 80.0;
/// Gain of smooth pursuit: velocity of the eye over that of what it follows (Daly 1998).
pub const PURSUIT_GAIN: f64 = 0.82;

/// Kelly's surface with constants: S = k · `gain` · c₂ v (2π ρ c₁)² exp(−4π c₁ ρ / `ρ_max`).
pub(super) struct Spatiovelocity {
    pub(super) c1: f64,
    pub(super) c2: f64,
    pub(super) gain: f64,
}

const SURFACE: Spatiovelocity = Spatiovelocity { c1: 0.67, c2: 1.7, gain: 1.14 };

impl Spatiovelocity {
    pub(super) fn ln_sensitivity(&self, freq_cpd: f64, velocity_deg_s: f64) -> f64 {
        let scaled = self.c2 * velocity_deg_s;
        let k = 6.1 + 7.3 * (scaled / 3.0).log10().abs().powi(3);
        let radians = std::f64::consts::TAU * freq_cpd.clamp(1e-12, HIGHEST_CPD) * self.c1;
        (k * self.gain * scaled).ln() + 2.0 * radians.ln() - 2.0 * radians / self.highest_cpd(velocity_deg_s)
    }

    fn highest_cpd(&self, velocity_deg_s: f64) -> f64 {
        45.9 / (self.c2 * velocity_deg_s + 2.0)
    }
}

impl Daly98 {
    /// Natural logarithm of the sensitivity, finite where the sensitivity itself underflows (1e-120 and less).
    #[must_use]
    pub fn ln_sensitivity(&self, freq_cpd: f64) -> f64 {
        SURFACE.ln_sensitivity(freq_cpd, floored(self.retinal_velocity_deg_s))
    }

    /// Frequency of the greatest sensitivity, cpd: ρ_max / (2π c₁).
    #[must_use]
    pub fn peak_cpd(&self) -> f64 {
        SURFACE.highest_cpd(floored(self.retinal_velocity_deg_s)) / (std::f64::consts::TAU * SURFACE.c1)
    }
}

impl Default for Daly98 {
    /// A picture at rest, under the eye's own drift.
    fn default() -> Self {
        Self { retinal_velocity_deg_s: DRIFT_DEG_S }
    }
}

/// At least the eye's drift, and never NaN.
pub(super) fn floored(velocity_deg_s: f64) -> f64 {
    if velocity_deg_s.is_nan() { DRIFT_DEG_S } else { velocity_deg_s.abs().clamp(DRIFT_DEG_S, 1e6) }
}

impl ContrastSensitivity for Daly98 {
    fn name(&self) -> &'static str {
        "daly98"
    }

    fn sensitivity(&self, freq_cpd: f64, _luminance_cd_m2: f64) -> f64 {
        if freq_cpd > 0.0 { self.ln_sensitivity(freq_cpd).exp() } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_follow_their_closed_form() {
        for (velocity, freq, sensitivity) in [
            (0.15, 4.835_166_885, 245.435_897_1),
            (1.0, 2.946_838_196, 250.638_698_8),
            (10.0, 0.573_857_964_5, 141.141_431_1),
            (80.0, 0.079_009_429_89, 91.170_918_84),
        ] {
            let csf = Daly98 { retinal_velocity_deg_s: velocity };
            assert!((csf.peak_cpd() / freq - 1.0_f64).abs() < 1e-8);
            assert!((csf.sensitivity(freq, 100.0) / sensitivity - 1.0_f64).abs() < 1e-8);
        }
    }

    #[test]
    fn no_velocity_breaks_it() {
        for velocity in [0.0, -3.0, f64::NAN, f64::INFINITY, 1e300] {
            let csf = Daly98 { retinal_velocity_deg_s: velocity };
            assert!(csf.sensitivity(4.0, 100.0).is_finite());
            assert!(csf.ln_sensitivity(60.0).is_finite());
        }
    }
}
