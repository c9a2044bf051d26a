//! A static contrast sensitivity function set in motion by the ratios of Daly's spatiovelocity function (1998).
//!
//! For patterns that cross the retina as a whole. Not for flicker in place ([`super::CastleTemporal`]) nor for noise
//! that is new in every frame ([`super::FreshNoise`]).

use super::{ContrastSensitivity, Daly98};

/// S(ρ, v, L) = S_static(ρ, L) · `S_Daly98`(ρ, v) / `S_Daly98`(ρ, 0.15), the ratio capped at 10.
///
/// At rest (0.15 deg/s, the eye's drift) it equals the static function exactly; luminance and area stay the static
/// function's.
pub struct Moving<'a> {
    /// The static contrast sensitivity function that is set in motion.
    pub base: &'a dyn ContrastSensitivity,
    /// Velocity over the retina, deg/s.
    pub retinal_velocity_deg_s: f64,
}

impl ContrastSensitivity for Moving<'_> {
    fn name(&self) -> &'static str {
        self.base.name()
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        let moving = Daly98 { retinal_velocity_deg_s: self.retinal_velocity_deg_s };
        let ratio = (moving.ln_sensitivity(freq_cpd) - Daly98::default().ln_sensitivity(freq_cpd)).exp().min(10.0);
        self.base.sensitivity(freq_cpd, luminance_cd_m2) * ratio
    }

    fn transfer(&self, freq_cpd: f64) -> f64 {
        self.base.transfer(freq_cpd)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;

    #[test]
    fn rest_is_the_static_function() {
        let base = CastleCsf::default();
        let at = |velocity, freq| Moving { base: &base, retinal_velocity_deg_s: velocity }.sensitivity(freq, 50.0);
        assert!((at(0.0, 8.0) / base.sensitivity(8.0, 50.0) - 1.0).abs() < 1e-12);
        assert!(at(10.0, 8.0) < 1e-4 * at(0.0, 8.0));
        assert!((at(3.0, 0.5) / base.sensitivity(0.5, 50.0) - 83.131_443 / 15.769_727).abs() < 1e-4);
    }
}
