//! What image viewers do: scale, and clip each channel for itself.
//!
//! For comparison with such viewers. Not for bright colours, which change hue where a channel clips, and not for what
//! an eye would see: adaptation is ignored.

use serde::{Deserialize, Serialize};

use super::constant::{Exposure, exposure_of};
use super::gamut::light;
use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::finite;
use super::time::AdaptationState;
use super::words::Shown;
use super::{FittedTone, ToneOperator};
use crate::display::Viewing;

/// The exposure of [`Constant`](super::Constant), channels clipped: the "linear" of many viewers and engines. Bright
/// colours change hue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
}

/// The scene as a display of IEC 61966-2-1 would show it, whose white is 80 cd/m²; channels clipped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Srgb {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
}

/// White of the reference display of IEC 61966-2-1, cd/m².
const SRGB_WHITE_CD_M2: f64 = 80.0;

impl ToneOperator for Linear {
    fn name(&self) -> &'static str {
        "linear"
    }

    fn fit(&self, guide: &SceneGuide<'_>, _viewing: &Viewing, _state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let relative_per_cd_m2 = self.exposure * exposure_of(guide.luminance_cd_m2, Exposure::Automatic);
        Box::new(FittedClip { operator: self.name().to_owned(), relative_per_cd_m2 })
    }
}

impl ToneOperator for Srgb {
    fn name(&self) -> &'static str {
        "srgb"
    }

    fn fit(
        &self,
        _guide: &SceneGuide<'_>,
        _viewing: &Viewing,
        _state: Option<&AdaptationState>,
    ) -> Box<dyn FittedTone> {
        let relative_per_cd_m2 = self.exposure / SRGB_WHITE_CD_M2;
        Box::new(FittedClip { operator: self.name().to_owned(), relative_per_cd_m2 })
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedClip {
    operator: String,
    relative_per_cd_m2: f64,
}

impl FittedTone for FittedClip {
    fn relative_luminance_at(&self, _pixel: Pixel, scene_cd_m2: f32) -> f32 {
        finite(f64::from(scene_cd_m2.max(0.0)) * self.relative_per_cd_m2)
    }

    fn map_rgb_at(&self, pixel: Pixel, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        light(rgb_cd_m2).map(|channel| self.relative_luminance_at(pixel, channel).min(1.0))
    }

    fn keeps_luminance(&self) -> bool {
        false
    }

    fn describe(&self) -> String {
        format!("{}: clips at {} cd/m² of the scene", self.operator, Shown(self.relative_per_cd_m2.recip()))
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::Clip(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;

    #[test]
    fn srgb_white_is_80_and_channels_clip_alone() {
        let guide = Plane::filled(2, 2, 3.0);
        let fit = Srgb { exposure: 1.0 }.fit(&SceneGuide::of(&guide), &Viewing::default(), None);
        assert_eq!(fit.map_rgb([160.0, 40.0, 0.0]), [1.0, 0.5, 0.0]);
        let linear = Linear { exposure: 1.0 }.fit(&SceneGuide::of(&guide), &Viewing::default(), None);
        assert!((linear.relative_luminance(3.0) - 0.18).abs() < 1e-6);
    }
}
