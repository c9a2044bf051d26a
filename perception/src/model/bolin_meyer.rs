//! Bolin and Meyer.

use super::{ModelInputs, PerLuminance, ThresholdModel};
use crate::adaptation::adapted;
use crate::error::Error;
use crate::filter::gaussian_blur;
use crate::masking::threshold_elevation;
use crate::plane::Plane;

/// After "A perceptually based adaptive sampling algorithm", SIGGRAPH 1998: the picture in Haar bands, each with its own
/// contrast sensitivity and masked by its own contrast; samples go where the error of a band could be seen.
///
/// The paper's text was not at hand; this keeps its frame (Haar bands, per-band sensitivity, masking by what the band holds)
/// and judges the band energy of white pixel noise, of which level i of a Haar transform holds 3/4^i, by this crate's
/// definition of visibility. Its bounds are our standard errors; its colour channels are left to
/// [`crate::threshold::chromatic_threshold_map`]. Unlike [`super::CsfBands`] it trusts the guide's contrast as it
/// stands: no noise is taken out and no edge is kept from masking what lies beside it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BolinMeyer;

const LEVELS: usize = 6;

impl ThresholdModel for BolinMeyer {
    fn name(&self) -> &'static str {
        "bolin-meyer"
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        inputs.check()?;
        let ppd = inputs.viewing.display.pixel_density().mean();
        let gain = inputs.viewing.observer.sensitivity;
        let adaptation = adapted(inputs.display_luminance_cd_m2, inputs.viewing);
        let mut noise_gain = Plane::filled(adaptation.width(), adaptation.height(), 0.0);
        let mut finer = inputs.display_luminance_cd_m2.clone();
        for level in 1..=LEVELS {
            let side = (1_usize << level) as f64;
            // A box of side s has the variance of a Gaussian of σ = √((s² − 1) / 12).
            let coarser = gaussian_blur(inputs.display_luminance_cd_m2, ((side * side - 1.0) / 12.0).sqrt());
            let detail = finer.combined(&coarser, |finer, coarser| (finer - coarser).powi(2));
            // √2 times the RMS over the block: the amplitude of a grating.
            let contrast = gaussian_blur(&detail, 0.5 * side)
                .combined(&adaptation, |energy, adaptation| (2.0 * energy.max(0.0)).sqrt() / adaptation);
            // A Haar detail of side s passes 1/(2s) to 1/s cycles a pixel; its middle is 0.75/s.
            let sensitivity =
                PerLuminance::new(|luminance| gain * inputs.csf.sensitivity(0.75 * ppd / side, luminance));
            let share = 3.0 * 0.25_f32.powi(level as i32);
            noise_gain.for_each_row_mut(|y, row| {
                for (value, (contrast, adaptation)) in row.iter_mut().zip(contrast.row(y).iter().zip(adaptation.row(y)))
                {
                    let sensitivity = sensitivity.at(*adaptation);
                    let elevation = threshold_elevation(f64::from(contrast * sensitivity)) as f32;
                    let visible = sensitivity / elevation / adaptation;
                    *value += share * visible * visible;
                }
            });
            finer = coarser;
        }
        Ok(noise_gain.map(|gain| (2.0 * gain).sqrt().recip().min(f32::MAX)))
    }
}
