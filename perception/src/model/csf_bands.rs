//! The default.

use super::{ModelInputs, ThresholdModel};
use crate::error::Error;
use crate::plane::Plane;
use crate::threshold::{ThresholdInputs, threshold_map};

/// Noise gain and masking by octave bands under a luminance-aware contrast sensitivity function: [`threshold_map`], at
/// visibility 1.
///
/// Takes in resolution, luminance, area, each band's own masking (with the guide's noise taken out) and, where a
/// velocity is given, the motion of error that travels with what it lies on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CsfBands;

impl ThresholdModel for CsfBands {
    fn name(&self) -> &'static str {
        "csf-bands"
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        inputs.check()?;
        let guide = ThresholdInputs {
            display_luminance_cd_m2: inputs.display_luminance_cd_m2,
            guide_variance: inputs.guide_variance,
        };
        let mut map = threshold_map(&guide, inputs.viewing, inputs.csf)?;
        if let Some(velocity) = inputs.retinal_velocity_deg_s() {
            map = map.with_motion(&velocity)?;
        }
        Ok(map.allowed_standard_error_cd_m2(1.0))
    }
}
