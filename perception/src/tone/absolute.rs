//! Shows the scene's own luminances.

use serde::{Deserialize, Serialize};

use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::Screen;
use super::time::AdaptationState;
use super::{FittedTone, ToneOperator};
use crate::display::Viewing;

/// Every scene luminance is shown as itself as far as the display reaches; what it cannot help showing (black and
/// ambient light) is subtracted first.
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
        Box::new(FittedAbsolute { exposure: self.exposure, screen: Screen::of(&viewing.display) })
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
