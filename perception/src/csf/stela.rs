//! stelaCSF's sustained achromatic channel (Mantiuk, Ashraf and Chapiro 2022).
//!
//! For comparison with castleCSF, its successor: static gratings in the fovea. Not for motion, flicker or colour.

use super::ContrastSensitivity;
use super::castle::{Summation, Sustained};

/// Mantiuk, Ashraf and Chapiro, "stelaCSF: a unified model of contrast sensitivity as the function of spatio-temporal
/// frequency, eccentricity, luminance and area", 2022: the achromatic predecessor of [`super::CastleCsf`], sustained
/// channel, foveal and static.
///
/// Constants as published to six digits; the truncation below the peak, "about 0" there, is 0 here, which is good to
/// 2e-5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StelaCsf {
    /// Area of the grating, deg².
    pub area_deg2: f64,
}

impl Default for StelaCsf {
    /// 1 deg²: a foveal patch.
    fn default() -> Self {
        Self { area_deg2: 1.0 }
    }
}

const SUSTAINED: Sustained = Sustained {
    peak: [44.4763, 0.713_964, 0.277_857, 7.548_66e-7, 8.502_17e9],
    peak_freq: [1.559_09, 103.604, 0.251_815],
    log2_bandwidth: 0.177_674,
    truncation: 0.0,
    summation: Summation { area_0_deg2: 270.0, freq_0_cpd: 0.65 },
};

impl ContrastSensitivity for StelaCsf {
    fn name(&self) -> &'static str {
        "stela"
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        SUSTAINED.sensitivity(freq_cpd, luminance_cd_m2, self.area_deg2.clamp(1e-6, 1e9))
    }
}
