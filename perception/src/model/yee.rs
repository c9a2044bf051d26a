//! Yee, Pattanaik and Greenberg's Aleph map of 2001: a threshold of luminance raised by motion over the retina.
//!
//! For error that travels with what it lies on, in comparison with the literature. Not for noise that is new in every
//! frame, of which motion hides nothing, nor where texture should mask: it has no masking.

use super::pyramid::{BANDS, band_frequency_cpd, contrast_weighted};
use super::{ModelInputs, PerLuminance, ThresholdModel};
use crate::csf::{DRIFT_DEG_S, Daly98};
use crate::error::Error;
use crate::plane::Plane;
use crate::tvi::ThresholdBase;

/// "Spatiotemporal sensitivity and visual attention for efficient rendering of dynamic environments", ACM TOG 20(1),
/// 2001: the Aleph map, ℵ = TVI(`L_a`) · Σ `R_i` `f_i` with `R_i` the share of band i in the local contrast and `f_i`
/// = `S_max`(v) / S(`ρ_i`, v) above the peak of Daly's 1998 spatiovelocity CSF, 1 below; v is the velocity over the
/// retina, given that the eye follows what attracts it.
///
/// Changed: used as a pixel's tolerance instead of an irradiance cache's; `f_i` is capped (it reaches 1e9 at 10
/// deg/s); the base is `L_a` over the CSF's peak unless `raw_tvi` is set; elevations are computed in logs. The paper
/// has no masking and neither has this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yee {
    /// Whether thresholds start from the published TVI curve, not from `L_a` over the peak of contrast sensitivity.
    pub raw_tvi: bool,
    /// How many times a band's threshold may be raised at most; below 1 counts as 1.
    pub most_elevation: f64,
}

impl Default for Yee {
    fn default() -> Self {
        Self { raw_tvi: false, most_elevation: 20.0 }
    }
}

impl Yee {
    /// How many times motion raises the threshold of a frequency, `f_i`: 1 up to the peak of Daly's function, at most
    /// [`Self::most_elevation`].
    #[must_use]
    pub fn elevation(&self, freq_cpd: f64, retinal_velocity_deg_s: f64) -> f64 {
        let csf = Daly98 { retinal_velocity_deg_s };
        let peak_cpd = csf.peak_cpd();
        if freq_cpd <= peak_cpd {
            return 1.0;
        }
        (csf.ln_sensitivity(peak_cpd) - csf.ln_sensitivity(freq_cpd)).min(self.most_elevation.max(1.0).ln()).exp()
    }
}

impl ThresholdModel for Yee {
    fn name(&self) -> &'static str {
        "yee"
    }

    fn knows_motion(&self) -> bool {
        true
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        inputs.check()?;
        let ppd = inputs.viewing.display.pixel_density().mean();
        // A velocity is a positive number over many decades, like a luminance: 0.1 deg/s and up.
        let elevations: Vec<PerLuminance> = (0..BANDS)
            .map(|band| PerLuminance::new(|velocity| self.elevation(band_frequency_cpd(band, ppd), velocity)))
            .collect();
        let velocity = inputs.retinal_velocity_deg_s();
        let base = if self.raw_tvi { ThresholdBase::TviRaw } else { ThresholdBase::CsfPeak(inputs.csf) };
        Ok(contrast_weighted(
            inputs,
            base,
            |elevation| elevation.max(1.0),
            |x, y, _, band, _| {
                let retinal = velocity.as_ref().map_or(DRIFT_DEG_S as f32, |velocity| velocity.row(y)[x]);
                elevations[band].at(retinal)
            },
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_elevations() {
        let uncapped = Yee { most_elevation: 1e12, ..Yee::default() };
        for (velocity, freq, expected) in
            [(0.15, 8.0, 1.353), (0.15, 16.0, 9.252), (1.0, 8.0, 4.188), (1.0, 16.0, 238.7), (10.0, 2.0, 11.86)]
        {
            let found = uncapped.elevation(freq, velocity);
            assert!((found / expected - 1.0_f64).abs() < 1e-3, "{velocity} {freq}: {found}");
        }
        assert_eq!(uncapped.elevation(1.0, 0.15), 1.0);
        assert!((Yee::default().elevation(8.0, 10.0) - 20.0).abs() < 1e-9);
    }
}
