//! Threshold versus intensity alone, by Ward Larson, Rushmeier and Piatko's curve (1997).
//!
//! For comparison. Not for noise of pixels: it is about large spots, in daylight 7 to 9 times too lenient unless
//! lowered, and knows neither resolution nor texture nor motion.

use super::{ModelInputs, PerLuminance, ThresholdModel, Z_95};
use crate::adaptation::adapted;
use crate::error::Error;
use crate::plane::Plane;
use crate::tvi::{ThresholdBase, base_threshold_cd_m2};

/// The first idea: a pixel may err by what a large spot must differ from its background to be seen.
///
/// T = TVI(`L_a`), stop at 1.96 σ ≤ T. The curve is Ward Larson et al.'s (1997), lowered by 0.95 log units if
/// `shifted`. A large uniform spot is not pixel noise: in daylight the raw curve is 7 to 9 times more lenient than
/// contrast sensitivity, and it knows neither resolution nor texture nor motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tvi {
    /// Whether the curve is lowered by 0.95 log units, to where contrast sensitivity puts it.
    pub shifted: bool,
}

impl ThresholdModel for Tvi {
    fn name(&self) -> &'static str {
        "tvi"
    }

    fn knows_csf(&self) -> bool {
        false
    }

    fn allowed_standard_error_cd_m2(&self, inputs: &ModelInputs<'_>) -> Result<Plane, Error> {
        inputs.check()?;
        let base = if self.shifted { ThresholdBase::TviShifted } else { ThresholdBase::TviRaw };
        let gain = inputs.viewing.observer.sensitivity;
        let table = PerLuminance::new(|luminance| base_threshold_cd_m2(luminance, base) / (Z_95 * gain));
        Ok(adapted(inputs.display_luminance_cd_m2, inputs.viewing).map(|adaptation| table.at(adaptation)))
    }
}
