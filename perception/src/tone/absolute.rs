//! Shows the scene's own luminances, as far as the display reaches.
//!
//! For pictures that are display-referred already, and to see a scene as through a window. Not for scenes that are much
//! brighter or darker than the display: what it cannot reach is clipped.

use serde::{Deserialize, Serialize};

use super::gamut::fit_into_display;
use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::{Screen, finite};
use super::time::AdaptationState;
use super::{FittedTone, ToneOperator};
use crate::display::Viewing;

/// All scene light is emitted as itself as far as the display reaches, each channel for itself: L is (L − black) /
/// (white − black) of its light. A colour that the display's black greys too much, or that is too bright, keeps its
/// luminance and is mixed with grey. What the screen reflects of the room comes on top and is not subtracted, as it
/// would from a print beside it.
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

    /// Channel by channel, as the display's black is added to each: light that a display has shown comes back as it
    /// was.
    fn map_rgb_at(&self, _pixel: Pixel, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        fit_into_display(rgb_cd_m2.map(|channel| self.screen.channel(self.exposure * f64::from(channel))))
    }

    fn chromatic_slope_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        match self.relative_luminance_at(pixel, scene_cd_m2) {
            // Less than the display's black.
            0.0 => 0.0,
            relative => finite(self.exposure / self.screen.span_cd_m2) / relative.max(1.0),
        }
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
    use crate::photometry::luminance;
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
            for rgb in [[0.02, 0.001, 0.001], [1.0, 0.0, 0.0], [0.3, 0.9, 0.0], [1.0; 3]] {
                let found = fit.map_rgb(rgb.map(|relative| display.emitted_cd_m2(f64::from(relative)) as f32));
                let close = found.iter().zip(rgb).all(|(found, relative)| (found - relative).abs() < 1e-6);
                assert!(close, "{rgb:?} came out as {found:?}");
            }
        }
    }

    /// What the display cannot show of a colour is grey, and no luminance.
    #[test]
    fn a_pure_colour_keeps_its_luminance() {
        let display = Display { black_cd_m2: 1.0, white_cd_m2: 100.0, ..Display::default() };
        let guide = Plane::filled(1, 1, 1.0);
        let fit = Absolute { exposure: 1.0 }.fit(&SceneGuide::of(&guide), &Viewing::of(display), None);
        for rgb in [[20.0, 0.0, 0.0], [0.0, 30.0, 3.0], [-10.0, 40.0, 0.0], [200.0, 0.0, 0.0]] {
            let (found, expected) = (luminance(fit.map_rgb(rgb)), fit.relative_luminance(luminance(rgb)));
            assert!((found - expected).abs() < 1e-6, "{rgb:?}: {found} for {expected}");
        }
    }
}
