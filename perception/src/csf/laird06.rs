//! Daly's spatiovelocity surface, fitted anew by Laird et al. 2006.
//!
//! For ratios between velocities of things that the eye is free to follow. Not for absolute thresholds: it knows
//! neither area nor luminance, and is for about 100 cd/m².

use super::ContrastSensitivity;
use super::daly98::{Spatiovelocity, floored};

/// Laird, Rosen, Pelz, Montag and Daly, "Spatio-velocity CSF as a function of retinal velocity using unstabilized
/// stimuli", 2006: [`super::Daly98`] with constants (0.6329, 0.8404, 0.7986) for gratings the eye is free to follow,
/// and one more factor c₁.
///
/// About half as sensitive as Daly's. Constants from the code of FovVideoVDP. Ignores luminance, which was about 100
/// cd/m².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laird06 {
    /// Velocity over the retina, deg/s.
    pub retinal_velocity_deg_s: f64,
}

const SURFACE: Spatiovelocity = Spatiovelocity { c1: 0.8404, c2: 0.7986, gain: 0.6329 * 0.8404 };

impl Default for Laird06 {
    /// A picture at rest, under the eye's own drift.
    fn default() -> Self {
        Self { retinal_velocity_deg_s: super::DRIFT_DEG_S }
    }
}

impl ContrastSensitivity for Laird06 {
    fn name(&self) -> &'static str {
        "laird06"
    }

    fn sensitivity(&self, freq_cpd: f64, _luminance_cd_m2: f64) -> f64 {
        if freq_cpd > 0.0 { SURFACE.ln_sensitivity(freq_cpd, floored(self.retinal_velocity_deg_s)).exp() } else { 0.0 }
    }
}
