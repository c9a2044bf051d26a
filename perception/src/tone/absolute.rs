//! Shows the scene's own luminances.

use serde::{Deserialize, Serialize};

use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::Screen;
use super::time::AdaptationState;
use super::{FittedTone, ToneOperator};
use crate::display::Viewing;

/// Every scene luminance is emitted as itself as far as the display reaches: L is (L − black) / (white − black) of its light.
/// What the screen reflects of the room comes on top and is not subtracted, as it would from a print beside it.
///
/// For pictures that are display-referred already, for judging what a scene would look like through a window, and, with
/// an exposure in stops, as a fixed exposure that looks at no picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Absolute {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
}

impl ToneOperator for Absolute {
    fn name(&self) -> &'static str {
        "absolute"
    }

    fn fit(&self, _guide: &SceneGuide<'_>, viewing: &Viewing, _state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        Box::new(FittedAbsolute { exposure: self.exposure, screen: Screen::emitting(&viewing.display) })
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedAbsolute {
    exposure: f64,
    screen: Screen,
}

impl FittedTone for FittedAbsolute {
    fn relative_luminance_at(&self, _pixel: Pixel, scene_cd_m2: f32) -> f32 {
        self.screen.relative(self.exposure * f64::from(scene_cd_m2.max(0.0)))
    }

    fn describe(&self) -> String {
        format!("absolute: {} cd/m² shown for each cd/m² of the scene", self.exposure)
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::Absolute(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::Display;
    use crate::plane::Plane;

    #[test]
    fn what_the_display_emits_is_shown_as_it_is() {
        for ambient_cd_m2 in [0.0, 5.0] {
            let display = Display { ambient_cd_m2, ..Display::default() };
            let guide = Plane::filled(1, 1, 1.0);
            let fit = Absolute { exposure: 1.0 }.fit(&SceneGuide::of(&guide), &Viewing::of(display.clone()), None);
            for relative in [0.0, 0.002, 0.5, 1.0] {
                let found = fit.relative_luminance(display.emitted_cd_m2(relative) as f32);
                assert!((f64::from(found) - relative).abs() < 1e-6, "{relative} came out as {found}");
            }
        }
    }
}
