//! The first contrast sensitivity function of image coding (Mannos and Sakrison 1974).
//!
//! For teaching and comparison. Not for thresholds: it knows frequency alone, neither luminance nor area nor motion,
//! and its scale is a gain that is given to it.

use super::{ContrastSensitivity, HIGHEST_CPD};

/// Mannos and Sakrison, "The effects of a visual fidelity criterion on the encoding of images", IEEE Trans. IT 20,
/// 1974: 2.6 (0.0192 + 0.114 f) exp(−(0.114 f)^1.1), times a gain.
///
/// It knows no luminance and no absolute scale; here its peak (0.981 at 7.894 cpd) is scaled by `gain`. For teaching
/// and comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MannosSakrison {
    /// Factor on the published function, which is at most 0.981.
    pub gain: f64,
}

impl Default for MannosSakrison {
    /// A gain of 250, about the best that eyes do.
    fn default() -> Self {
        Self { gain: 250.0 }
    }
}

impl ContrastSensitivity for MannosSakrison {
    fn name(&self) -> &'static str {
        "mannos-sakrison"
    }

    fn sensitivity(&self, freq_cpd: f64, _luminance_cd_m2: f64) -> f64 {
        let scaled = 0.114 * freq_cpd.clamp(0.0, HIGHEST_CPD);
        self.gain * 2.6 * (0.0192 + scaled) * (-scaled.powf(1.1)).exp()
    }
}
