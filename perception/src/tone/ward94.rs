//! Ward's contrast-based scale factor, 1994.
//!
//! For what is just visible at one adaptation. Not for scenes of more range than the display's: it is one scale, and
//! what is too bright is clipped. It knows no rods: colour and acuity are not lost in the dark.

use serde::{Deserialize, Serialize};

use super::field::{AdaptationScope, LocalAdaptation};
use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::finite;
use super::time::{AdaptationState, Goal};
use super::words::Shown;
use super::{FittedTone, ToneOperator};
use crate::display::Viewing;

/// Scales so that what is just visible in the scene is just visible on the display.
///
/// Ward, "A contrast-based scalefactor for luminance display", Graphics Gems IV, 1994: thresholds after Blackwell,
/// ΔL = 0.0594 (1.219 + `L_a`^0.4)^2.5; the display's adaptation is half its white, the scene's the geometric mean of
/// its pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ward94 {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
    /// Whether the eye is adapted to the view as a whole or to each place.
    pub scope: AdaptationScope,
}

impl ToneOperator for Ward94 {
    fn name(&self) -> &'static str {
        "ward94"
    }

    fn sees_adaptation(&self) -> bool {
        true
    }

    fn knows_places(&self) -> bool {
        true
    }

    fn fit(&self, guide: &SceneGuide<'_>, viewing: &Viewing, state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let density = viewing.display.pixel_density();
        let adaptation_cd_m2 =
            state.map_or_else(|| Goal::of(guide, density).cones_cd_m2, |state| state.cones.neural_cd_m2);
        Box::new(FittedWard94 {
            exposure: self.exposure,
            white_cd_m2: viewing.display.white_cd_m2.max(f64::MIN_POSITIVE),
            adaptation_cd_m2,
            local: LocalAdaptation::of(guide, self.scope, &viewing.display),
        })
    }
}

/// Display cd/m² for each cd/m² of the scene.
pub(super) fn scale_factor(scene_adaptation_cd_m2: f64, display_adaptation_cd_m2: f64) -> f64 {
    ((1.219 + display_adaptation_cd_m2.powf(0.4)) / (1.219 + scene_adaptation_cd_m2.powf(0.4))).powf(2.5)
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedWard94 {
    exposure: f64,
    white_cd_m2: f64,
    adaptation_cd_m2: f64,
    local: LocalAdaptation,
}

impl FittedWard94 {
    fn relative_per_cd_m2(&self, adaptation_cd_m2: f64) -> f64 {
        self.exposure * scale_factor(adaptation_cd_m2, self.white_cd_m2 / 2.0) / self.white_cd_m2
    }
}

impl FittedTone for FittedWard94 {
    fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let adaptation = self.local.at(pixel).map_or(self.adaptation_cd_m2, |local| local.cones_cd_m2);
        finite(f64::from(scene_cd_m2.max(0.0)) * self.relative_per_cd_m2(adaptation))
    }

    fn describe(&self) -> String {
        let white = Shown(self.relative_per_cd_m2(self.adaptation_cd_m2).recip());
        format!("ward94: white at {white} cd/m² of the scene")
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::Ward94(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::Display;
    use crate::plane::Plane;
    use crate::test_golden::check;

    #[test]
    fn golden_scale_factors() {
        check("ward94_m_Lda50", 1e-6, |row| scale_factor(row[0], 50.0));
        assert!((scale_factor(1e4, 50.0) / 0.008_180_311 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_fit_uses_half_the_white() {
        let viewing = Viewing::of(Display { white_cd_m2: 100.0, ..Display::default() });
        let guide = Plane::filled(4, 4, 10.0);
        let ward94 = Ward94 { exposure: 1.0, scope: AdaptationScope::World };
        let fitted = ward94.fit(&SceneGuide::of(&guide), &viewing, None);
        assert!((fitted.relative_luminance(10.0) - 0.328_084_7).abs() < 1e-5);
    }

    #[test]
    fn local_adaptation_lifts_the_shadow_and_not_the_light() {
        let viewing = Viewing::of(Display { pixels_per_degree: 20.0, ..Display::default() });
        let guide = Plane::from_fn(120, 20, |x, _| if x < 60 { 1.0 } else { 1000.0 });
        let at = |scope, x, scene| {
            let fitted = Ward94 { exposure: 1.0, scope }.fit(&SceneGuide::of(&guide), &viewing, None);
            fitted.relative_luminance_at(Pixel { x, y: 10 }, scene)
        };
        assert!(at(AdaptationScope::Local, 5, 1.0) > 2.0 * at(AdaptationScope::World, 5, 1.0));
        assert!(at(AdaptationScope::Local, 110, 1000.0) < 0.5 * at(AdaptationScope::World, 110, 1000.0));
    }
}
