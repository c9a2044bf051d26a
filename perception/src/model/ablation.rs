//! The default with a part taken out, to show what the part is worth. Not for rendering.

use super::csf_bands::still_or_moving;
use super::{ModelInputs, ThresholdModel, Tvi};
use crate::error::Error;
use crate::plane::Plane;
use crate::threshold::{ThresholdInputs, ThresholdMap, threshold_map};

/// Contrast sensitivity in bands, nothing masked: texture hides no noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Unmasked;

impl ThresholdModel for Unmasked {
    fn name(&self) -> &'static str {
        "csf-unmasked"
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        Ok(unmasked(inputs)?.allowed_standard_error_cd_m2(1.0))
    }

    fn measured_visibility(&self, inputs: &ModelInputs<'_>, half_difference: &Plane) -> Result<Plane, Error> {
        let map = unmasked(inputs)?;
        half_difference.check_size("half difference", map.width(), map.height())?;
        Ok(map.measured_visibility(half_difference))
    }
}

fn unmasked(inputs: &ModelInputs<'_>) -> Result<ThresholdMap, Error> {
    inputs.check()?;
    let guide =
        ThresholdInputs { display_luminance_cd_m2: inputs.display_luminance_cd_m2, guide_noise: inputs.guide_noise };
    Ok(threshold_map(&guide, inputs.viewing, inputs.csf)?.without_masking())
}

/// Masking without contrast sensitivity: threshold versus intensity, raised as texture raises the default's thresholds.
///
/// The curve is lowered by 0.95 log units to where contrast sensitivity puts it, so that resolution and fine noise are what
/// is left out, and not a factor that any search would take back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaskedTvi;

impl ThresholdModel for MaskedTvi {
    fn name(&self) -> &'static str {
        "tvi-masked"
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        let elevation = still_or_moving(inputs)?.masking_elevation();
        let base = Tvi { shifted: true }.allowed_standard_error_cd_m2(inputs)?;
        Ok(base.combined(&elevation, |base, elevation| base * elevation))
    }

    fn knows_motion(&self) -> bool {
        true
    }
}
