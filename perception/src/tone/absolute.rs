//! Shows the scene's own luminances.

use super::{FittedTone, SceneGuide, ToneOperator};
use crate::display::Display;

/// Every scene luminance is shown as itself as far as the display reaches; what it cannot help showing (black and
/// ambient light) is subtracted first.
///
/// For pictures that are display-referred already, and for judging what a scene would look like through a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Absolute {
    /// Multiplies the result.
    pub exposure: f64,
}

impl ToneOperator for Absolute {
    fn name(&self) -> &'static str {
        "absolute"
    }

    fn fit(&self, _guide: &SceneGuide<'_>, display: &Display) -> Box<dyn FittedTone> {
        let black_cd_m2 = display.luminance_cd_m2(0.0);
        let span_cd_m2 = (display.luminance_cd_m2(1.0) - black_cd_m2).max(f64::MIN_POSITIVE);
        Box::new(Fitted { exposure: self.exposure, black_cd_m2, span_cd_m2 })
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Fitted {
    exposure: f64,
    black_cd_m2: f64,
    span_cd_m2: f64,
}

impl FittedTone for Fitted {
    fn relative_luminance(&self, scene_cd_m2: f32) -> f32 {
        // `max` turns NaN into 0.
        let shown = self.exposure * f64::from(scene_cd_m2.max(0.0)) - self.black_cd_m2;
        (shown / self.span_cd_m2).clamp(0.0, f64::from(f32::MAX)) as f32
    }

    fn describe(&self) -> String {
        format!("absolute: {} cd/m² shown for each cd/m² of the scene", self.exposure)
    }
}
