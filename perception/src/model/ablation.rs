//! The default with a part taken out, to show what the part is worth. Not for rendering.

use super::csf_bands::{still, still_or_moving};
use super::{ModelInputs, ThresholdModel, Tvi};
use crate::error::Error;
use crate::plane::Plane;

/// Contrast sensitivity in bands, nothing masked: texture hides no noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Unmasked;

impl ThresholdModel for Unmasked {
    fn name(&self) -> &'static str {
        "csf-unmasked"
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        Ok(still(inputs)?.without_masking().allowed_standard_error_cd_m2(1.0))
    }

    fn measured_visibility(&self, inputs: &ModelInputs<'_>, half_difference: &Plane) -> Result<Plane, Error> {
        let map = still(inputs)?.without_masking();
        half_difference.check_size("half difference", map.width(), map.height())?;
        Ok(map.measured_visibility(half_difference))
    }
}

/// Masking without contrast sensitivity: threshold versus intensity, raised as texture raises the default's thresholds.
///
/// The curve is lowered by 0.95 log units to where contrast sensitivity puts it, so that resolution and fine noise
/// are what is left out, and not a factor that any search would take back.
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
