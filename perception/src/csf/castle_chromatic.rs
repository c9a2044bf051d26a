//! castleCSF's two chromatic mechanisms, red–green and yellow–violet (Ashraf et al. 2024).
//!
//! For static gratings without luminance contrast in the fovea. Not for fine red–green patterns: sensitivity falls
//! slowly there (50 at 16 cpd and 100 cd/m², against 152 at 1 cpd), an extrapolation beyond the data.

use super::castle::{Summation, in_domain};
use super::{ContrastSensitivity, check_area_deg2};
use crate::error::Error;

/// The two opponent channels of castleCSF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChromaticChannel {
    /// Red against green: L − M.
    RedGreen,
    /// Yellow against violet: S − (L + M).
    YellowViolet,
}

/// castleCSF for isoluminant gratings: sensitivity to opponent contrast, the opponent signal's amplitude over L + M.
///
/// Ashraf et al. 2024 (see [`super::CastleCsf`]), sustained channel, foveal and static. Low-pass but for the area term.
#[derive(Clone, Debug, PartialEq)]
pub struct CastleChromatic {
    channel: ChromaticChannel,
    area_deg2: f64,
}

struct Parameters {
    /// `S_max` = p₁ (1 + p₂/L)^−p₃.
    peak: [f64; 3],
    peak_cpd: f64,
    log2_bandwidth: f64,
    summation: Summation,
}

const RED_GREEN: Parameters = Parameters {
    peak: [681.434, 38.0038, 0.480_386],
    peak_cpd: 0.017_836_4,
    log2_bandwidth: 2.421_04,
    summation: Summation { area_0_deg2: 2816.44, freq_0_cpd: 0.071_105_8 },
};
const YELLOW_VIOLET: Parameters = Parameters {
    peak: [166.683, 62.8974, 0.411_93],
    peak_cpd: 0.004_257_53,
    log2_bandwidth: 2.681_97,
    summation: Summation { area_0_deg2: 2.827_89e7, freq_0_cpd: 0.000_635_093 },
};

impl CastleChromatic {
    /// castleCSF of one chromatic channel, for gratings that cover `area_deg2` square degrees.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless the area lies between 0.001 and 10 000 deg².
    pub fn new(channel: ChromaticChannel, area_deg2: f64) -> Result<Self, Error> {
        check_area_deg2("csf_area_deg2", area_deg2)?;
        Ok(Self { channel, area_deg2 })
    }
}

impl ContrastSensitivity for CastleChromatic {
    fn name(&self) -> &'static str {
        match self.channel {
            ChromaticChannel::RedGreen => "castle-rg",
            ChromaticChannel::YellowViolet => "castle-yv",
        }
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        if freq_cpd <= 0.0 {
            return 0.0;
        }
        let parameters = match self.channel {
            ChromaticChannel::RedGreen => &RED_GREEN,
            ChromaticChannel::YellowViolet => &YELLOW_VIOLET,
        };
        let luminance = in_domain(luminance_cd_m2);
        let peak = parameters.peak[0] * (1.0 + parameters.peak[1] / luminance).powf(-parameters.peak[2]);
        let decades_above = (freq_cpd / parameters.peak_cpd).log10().max(0.0);
        let log_parabola = 10.0_f64.powf(-decades_above * decades_above / parameters.log2_bandwidth.exp2());
        peak * log_parabola * parameters.summation.extent_deg(freq_cpd, self.area_deg2) * freq_cpd
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;

    #[test]
    fn colour_is_seen_at_low_frequencies_only() {
        for channel in [ChromaticChannel::RedGreen, ChromaticChannel::YellowViolet] {
            let csf = CastleChromatic::new(channel, 1.0).unwrap();
            let at = |freq: f64| csf.sensitivity(freq, 100.0);
            let achromatic = CastleCsf::default();
            let slope = |at: &dyn Fn(f64) -> f64| at(0.5) / at(8.0);
            let luminance_slope = slope(&|freq| achromatic.sensitivity(freq, 100.0));
            assert!(slope(&at) > 3.0 * luminance_slope, "{channel:?}: {} {luminance_slope}", slope(&at));
            assert!(at(0.0) == 0.0 && at(1e9).is_finite());
            assert!(csf.sensitivity(1.0, 1.0) < at(1.0));
        }
    }
}
