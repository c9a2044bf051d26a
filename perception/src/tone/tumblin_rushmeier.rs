//! Tumblin and Rushmeier's brightness-preserving operator, 1993.
//!
//! For daylight and lamplight as bright as they seem. Not for thresholds, which it does not keep, and not for night:
//! the law's exponent would turn negative, so adaptation is held at 0.001 cd/m².

use serde::{Deserialize, Serialize};

use super::field::{AdaptationScope, LocalAdaptation};
use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::Screen;
use super::time::{AdaptationState, Goal};
use super::words::Shown;
use super::{FittedTone, ToneOperator};
use crate::display::Viewing;

/// Makes brightness on the display equal to brightness in the scene, by Stevens and Stevens' power laws.
///
/// Tumblin and Rushmeier, "Tone reproduction for realistic images", IEEE CG&A 13(6), 1993. Adaptation of the scene is
/// the geometric mean of its pixels (a pixel's own would reverse contrast at edges, as [`AdaptationScope::Local`]
/// does in part); that of the display is white / √(white / black). The display's black is subtracted, since the
/// display adds it again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TumblinRushmeier {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
    /// Whether the eye is adapted to the view as a whole or to each place.
    pub scope: AdaptationScope,
}

/// One lambert in cd/m².
const LAMBERT_CD_M2: f64 = 1e4 / std::f64::consts::PI;
/// Below 1.6e-4 cd/m² the law's exponent turns negative and the picture into its negative.
const MIN_ADAPTATION_CD_M2: f64 = 1e-3;

impl ToneOperator for TumblinRushmeier {
    fn name(&self) -> &'static str {
        "tumblin-rushmeier"
    }

    fn sees_adaptation(&self) -> bool {
        true
    }

    fn knows_places(&self) -> bool {
        true
    }

    fn fit(&self, guide: &SceneGuide<'_>, viewing: &Viewing, state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let density = viewing.display.pixel_density();
        let screen = Screen::of(&viewing.display);
        // A display without any black has no contrast to take the root of; 10 000:1 is as good as eyes need.
        let white_cd_m2 = screen.white_cd_m2();
        let display_adaptation = (white_cd_m2 * screen.black_cd_m2.max(white_cd_m2 * 1e-4)).sqrt();
        let scene_adaptation_cd_m2 =
            state.map_or_else(|| Goal::of(guide, density).cones_cd_m2, |state| state.cones.neural_cd_m2);
        Box::new(FittedTumblinRushmeier {
            law: BrightnessMatch::between(scene_adaptation_cd_m2, display_adaptation),
            scene_adaptation_cd_m2,
            display_adaptation_cd_m2: display_adaptation,
            local: LocalAdaptation::of(guide, self.scope, &viewing.display),
            screen,
            exposure: self.exposure,
        })
    }
}

/// `L_d` = gain · `L_w`^exponent, both in lamberts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct BrightnessMatch {
    exponent: f64,
    gain: f64,
}

impl BrightnessMatch {
    fn between(scene_adaptation_cd_m2: f64, display_adaptation_cd_m2: f64) -> Self {
        let laws = |adaptation_cd_m2: f64| {
            let log = (adaptation_cd_m2.max(MIN_ADAPTATION_CD_M2) / LAMBERT_CD_M2).log10();
            (0.4 * log + 2.92, -0.4 * log * log - 2.584 * log + 2.0208)
        };
        let (scene_slope, scene_offset) = laws(scene_adaptation_cd_m2);
        let (display_slope, display_offset) = laws(display_adaptation_cd_m2);
        Self {
            exponent: scene_slope / display_slope,
            gain: 10.0_f64.powf((scene_offset - display_offset) / display_slope),
        }
    }

    fn display_cd_m2(self, scene_cd_m2: f64) -> f64 {
        if scene_cd_m2 > 0.0 {
            LAMBERT_CD_M2 * self.gain * (scene_cd_m2 / LAMBERT_CD_M2).powf(self.exponent)
        } else {
            0.0
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedTumblinRushmeier {
    law: BrightnessMatch,
    scene_adaptation_cd_m2: f64,
    display_adaptation_cd_m2: f64,
    local: LocalAdaptation,
    screen: Screen,
    exposure: f64,
}

impl FittedTone for FittedTumblinRushmeier {
    fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let law = self
            .local
            .at(pixel)
            .map_or(self.law, |local| BrightnessMatch::between(local.cones_cd_m2, self.display_adaptation_cd_m2));
        self.screen.relative(self.exposure * law.display_cd_m2(f64::from(scene_cd_m2)))
    }

    fn describe(&self) -> String {
        format!(
            "tumblin-rushmeier: exponent {:.4} for a scene adaptation of {} cd/m²",
            self.law.exponent,
            Shown(self.scene_adaptation_cd_m2)
        )
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::TumblinRushmeier(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_golden::check;

    #[test]
    fn golden_values() {
        let before_25_cd_m2 = |row: &[f64]| BrightnessMatch::between(row[0], 25.0);
        check("tr_Lda25", 1e-6, |row| before_25_cd_m2(row).display_cd_m2(row[1]));
        check("tr_exponent_Lda25", 1e-6, |row| before_25_cd_m2(row).exponent);
        check("lambert_cd_m2", 1e-6, |_| LAMBERT_CD_M2);
    }

    #[test]
    fn starlight_does_not_turn_into_a_negative() {
        assert!(BrightnessMatch::between(1e-5, 25.0).exponent > 0.0);
    }
}
