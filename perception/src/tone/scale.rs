//! Fits that multiply by one number.

use serde::{Deserialize, Serialize};

use super::FittedTone;
use super::guide::Pixel;
use super::saved::{Fit, SavedTone};
use super::screen::finite;
use super::words::Shown;

/// A fit that multiplies scene luminance by one number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Scale {
    pub(super) operator: String,
    pub(super) relative_per_cd_m2: f64,
}

impl FittedTone for Scale {
    fn relative_luminance_at(&self, _pixel: Pixel, scene_cd_m2: f32) -> f32 {
        // `max` turns NaN into 0.
        finite(f64::from(scene_cd_m2.max(0.0)) * self.relative_per_cd_m2)
    }

    fn relative_per_cd_m2(&self) -> Option<f64> {
        Some(self.relative_per_cd_m2)
    }

    fn describe(&self) -> String {
        format!("{}: white at {} cd/m² of the scene", self.operator, Shown(self.relative_per_cd_m2.recip()))
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::Scale(self.clone()))
    }
}
