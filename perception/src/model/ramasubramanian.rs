//! Ramasubramanian, Pattanaik and Greenberg's threshold map of 1999: a threshold of luminance raised by spatial
//! frequency and masking.
//!
//! For comparison with the literature. Not for guides with noise in them, which masks itself here, nor beside edges,
//! from which it leaks into the flat; it ignores motion.

use super::pyramid::{BANDS, band_frequency_cpd, contrast_weighted};
use super::{ModelInputs, PerLuminance, ThresholdModel};
use crate::csf::peak_sensitivity;
use crate::error::Error;
use crate::masking::threshold_elevation;
use crate::plane::Plane;
use crate::tvi::ThresholdBase;

/// "A perceptually based physical error metric for realistic image synthesis", SIGGRAPH 1999: T = TVI(`L_a`) · F,
/// where F = Σ (`C_i`/ΣC) · (`S_max`/S(`ρ_i`)) · mask(`C_i` S(`ρ_i`)) raises the threshold where the picture's
/// contrast lies off the peak of contrast sensitivity and where it masks; a pixel stops at 1.96 σ ≤ T.
///
/// Changed: the base is `L_a` over the CSF's peak instead of the TVI curve unless `raw_tvi` is set (TVI says 5.6 %
/// where gratings are seen at 0.7 %, and F multiplies that), F is kept within 1 and 10 (else a textured pixel may err
/// by 79 % of its background), the bands carry their measured frequencies, and the CSF is the one given, at the
/// pixel's own adaptation for masking and at 100 cd/m² for F's frequency part. Contrast-weighted, F leaks from an
/// edge into the flat beside it; [`super::CsfBands`] does not.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ramasubramanian {
    /// Whether thresholds start from the published TVI curve, not from `L_a` over the peak of contrast sensitivity.
    pub raw_tvi: bool,
}

/// Bounds of F.
const FACTOR: std::ops::RangeInclusive<f32> = 1.0..=10.0;

impl ThresholdModel for Ramasubramanian {
    fn name(&self) -> &'static str {
        "ramasubramanian"
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        inputs.check()?;
        let ppd = inputs.viewing.display.pixel_density().mean();
        let gain = inputs.viewing.observer.sensitivity;
        let peak = peak_sensitivity(inputs.csf, 100.0);
        let elevations: Vec<f32> = (0..BANDS)
            .map(|band| {
                let sensitivity = inputs.csf.sensitivity(band_frequency_cpd(band, ppd), 100.0);
                (peak / sensitivity.max(1e-9)).min(1e6) as f32
            })
            .collect();
        let sensitivities: Vec<PerLuminance> = (0..BANDS)
            .map(|band| {
                PerLuminance::new(|luminance| gain * inputs.csf.sensitivity(band_frequency_cpd(band, ppd), luminance))
            })
            .collect();
        let factor = |elevation: f32| elevation.clamp(*FACTOR.start(), *FACTOR.end());
        let base = if self.raw_tvi { ThresholdBase::TviRaw } else { ThresholdBase::CsfPeak(inputs.csf) };
        Ok(contrast_weighted(inputs, base, factor, |_, _, adaptation, band, contrast| {
            let mask = f64::from(contrast * sensitivities[band].at(adaptation));
            elevations[band] * threshold_elevation(mask) as f32
        }))
    }
}
