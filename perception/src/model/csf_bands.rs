//! The default model: octave bands under a contrast sensitivity function, each masked by its own contrast.
//!
//! For white noise of pixels in a still, and, given a velocity, for error that travels with what it lies on. Give no
//! velocity for noise that is new in every frame, of which motion hides nothing.

use super::{ModelInputs, ThresholdModel};
use crate::error::Error;
use crate::plane::Plane;
use crate::threshold::{ThresholdInputs, ThresholdMap, threshold_map};

/// Noise gain and masking by octave bands under a luminance-aware contrast sensitivity function: [`threshold_map`], at
/// visibility 1.
///
/// Takes in resolution, luminance, area, each band's own masking (with the guide's noise taken out) and, where a
/// velocity is given, the motion of error that travels with what it lies on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CsfBands;

impl ThresholdModel for CsfBands {
    fn name(&self) -> &'static str {
        super::DEFAULT
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        Ok(still_or_moving(inputs)?.allowed_standard_error_cd_m2(1.0))
    }

    fn knows_motion(&self) -> bool {
        true
    }

    fn measured_visibility(&self, inputs: &ModelInputs<'_>, half_difference: &Plane) -> Result<Plane, Error> {
        let map = still_or_moving(inputs)?;
        half_difference.check_size("half difference", map.width(), map.height())?;
        Ok(map.measured_visibility(half_difference))
    }
}

/// The threshold map of a still.
pub(super) fn still(inputs: &ModelInputs<'_>) -> Result<ThresholdMap, Error> {
    inputs.check()?;
    let guide =
        ThresholdInputs { display_luminance_cd_m2: inputs.display_luminance_cd_m2, guide_noise: inputs.guide_noise };
    threshold_map(&guide, inputs.viewing, inputs.csf)
}

/// The threshold map of a still, or of what moves where a velocity is given.
pub(super) fn still_or_moving(inputs: &ModelInputs<'_>) -> Result<ThresholdMap, Error> {
    let map = still(inputs)?;
    match inputs.retinal_velocity_deg_s() {
        Some(velocity) => map.with_motion(&velocity),
        None => Ok(map),
    }
}
