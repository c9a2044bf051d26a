//! castleCSF's sustained achromatic channel (Ashraf et al. 2024): the function that everything uses unless told
//! otherwise.
//!
//! For static gratings in the fovea, from 0.001 to 10 000 cd/m² and up to 64 cpd. Not for flicker and drift
//! ([`super::CastleTemporal`]), nor for colour ([`super::CastleChromatic`]); away from the gaze [`crate::eccentricity`]
//! takes off.

use super::{ContrastSensitivity, check_area_deg2};
use crate::error::Error;

/// castleCSF: achromatic, sustained channel, foveal and static.
///
/// Ashraf, Mantiuk, Chapiro and Wuerger, "castleCSF — a contrast sensitivity function of color, area, spatiotemporal
/// frequency, luminance and eccentricity", Journal of Vision 24(4), 2024. Constants from the authors' published code
/// (gfxdisp/castleCSF, f4b0b72). The transient channel is left out: its peak frequency crosses zero at
/// 0.0113 cd/m², where it would answer to static patterns.
///
/// Declared domain: 0.001 to 10 000 cd/m², up to 64 cpd; luminances outside are moved to its edge.
#[derive(Clone, Debug, PartialEq)]
pub struct CastleCsf {
    area_deg2: f64,
}

impl CastleCsf {
    /// castleCSF for gratings that cover `area_deg2` square degrees.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless the area lies between 0.001 and 10 000 deg².
    pub fn new(area_deg2: f64) -> Result<Self, Error> {
        check_area_deg2("csf_area_deg2", area_deg2)?;
        Ok(Self { area_deg2 })
    }

    /// Area of the gratings, deg².
    #[must_use]
    pub fn area_deg2(&self) -> f64 {
        self.area_deg2
    }
}

impl Default for CastleCsf {
    /// 1 deg²: a foveal patch.
    fn default() -> Self {
        Self { area_deg2: 1.0 }
    }
}

/// Luminances that castleCSF is declared between, and their decades.
const DOMAIN_CD_M2: [f64; 2] = [1e-3, 1e4];
pub(super) const DOMAIN_DECADES: [i32; 2] = [-3, 4];

/// The luminance, or the edge of castleCSF's domain that it lies beyond.
pub(super) fn in_domain(luminance_cd_m2: f64) -> f64 {
    luminance_cd_m2.clamp(DOMAIN_CD_M2[0], DOMAIN_CD_M2[1])
}

/// Spatial summation (Rovamo et al. 1993): area counts up to a critical area that shrinks with frequency.
pub(super) struct Summation {
    /// The critical area of coarse gratings.
    pub(super) area_0_deg2: f64,
    /// Above it the critical area shrinks.
    pub(super) freq_0_cpd: f64,
}

impl Summation {
    /// Root of the area that counts, in degrees: sensitivity to so many cycles a degree grows by it.
    pub(super) fn extent_deg(&self, freq_cpd: f64, area_deg2: f64) -> f64 {
        let critical_area_deg2 = self.area_0_deg2 / (1.0 + (freq_cpd / self.freq_0_cpd).powi(2));
        (critical_area_deg2 / (1.0 + critical_area_deg2 / area_deg2)).sqrt()
    }
}

impl ContrastSensitivity for CastleCsf {
    fn name(&self) -> &'static str {
        "castle"
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        SUSTAINED.sensitivity(freq_cpd, luminance_cd_m2, self.area_deg2)
    }
}

const SUSTAINED: Sustained = Sustained {
    peak: [56.4947, 7.547_26, 0.144_532, 5.583_41e-7, 9.668_62e9],
    peak_freq: [1.781_19, 91.571_8, 0.256_682],
    log2_bandwidth: 0.000_213_047,
    truncation: 0.100_207,
    summation: Summation { area_0_deg2: 157.103, freq_0_cpd: 0.702_338 },
};

/// Constants of the sustained achromatic channel that stelaCSF and castleCSF share the form of.
pub(super) struct Sustained {
    /// p₁ to p₅ of `S_max`(L) = p₁ (1 + p₂/L)^−p₃ (1 − (1 + p₄/L)^−p₅).
    pub(super) peak: [f64; 5],
    /// q₁ to q₃ of `f_max`(L) = q₁ (1 + q₂/L)^−q₃.
    pub(super) peak_freq: [f64; 3],
    pub(super) log2_bandwidth: f64,
    /// How far sensitivity falls at most below the peak's frequency, before area counts.
    pub(super) truncation: f64,
    pub(super) summation: Summation,
}

impl Sustained {
    pub(super) fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64, area_deg2: f64) -> f64 {
        if freq_cpd <= 0.0 {
            return 0.0;
        }
        let luminance = in_domain(luminance_cd_m2);
        let [p1, p2, p3, p4, p5] = self.peak;
        let rise = p1 * (1.0 + p2 / luminance).powf(-p3);
        // (1 + p₄/L)^−p₅ with p₄ ≈ 6e-7 and p₅ ≈ 1e10: a plain power would lose p₄/L beside 1.
        let fall = -p5 * (p4 / luminance).ln_1p();
        let [q1, q2, q3] = self.peak_freq;
        let peak_freq_cpd = q1 * (1.0 + q2 / luminance).powf(-q3);
        let decades_off = (freq_cpd / peak_freq_cpd).log10();
        let mut log_parabola = 10.0_f64.powf(-decades_off * decades_off / self.log2_bandwidth.exp2());
        if freq_cpd < peak_freq_cpd {
            log_parabola = log_parabola.max(1.0 - self.truncation);
        }
        let cycles_summed = self.summation.extent_deg(freq_cpd, area_deg2) * freq_cpd;
        rise * -fall.exp_m1() * log_parabola * cycles_summed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_values() {
        let csf = CastleCsf::default();
        for (luminance, freq, expected) in [
            (0.1, 0.5, 13.588_307_52),
            (0.1, 8.0, 1.802_453_948),
            (1.0, 2.0, 39.632_571_77),
            (1.0, 16.0, 2.389_335_938),
            (10.0, 0.5, 23.321_231_17),
            (10.0, 8.0, 45.590_911_47),
            (100.0, 0.5, 25.031_127_75),
            (100.0, 2.0, 104.992_111_8),
            (100.0, 8.0, 98.562_824_32),
            (100.0, 16.0, 38.199_733_79),
            (1000.0, 16.0, 51.154_743_99),
        ] {
            let found = csf.sensitivity(freq, luminance);
            assert!((found / expected - 1.0_f64).abs() < 1e-6, "S({freq}, {luminance}) = {found}, not {expected}");
        }
    }

    #[test]
    fn no_input_gives_nan() {
        let csf = CastleCsf::default();
        for freq in [0.0, 1e-300, 0.5, 64.0, 1e6] {
            for luminance in [0.0, 1e-300, 1e-4, 100.0, 1e8] {
                let found = csf.sensitivity(freq, luminance);
                assert!(found.is_finite() && found >= 0.0, "S({freq}, {luminance}) = {found}");
            }
        }
    }
}
