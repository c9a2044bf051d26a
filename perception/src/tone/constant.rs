//! One exposure for the whole picture, found automatically.

use super::statistics::SceneStatistics;
use super::{FittedTone, Scale, SceneGuide, ToneOperator};
use crate::display::Display;

/// Multiplies by one number, as a camera's exposure does.
///
/// The geometric mean of the middle 94 % of the pixels becomes middle grey (0.18), unless that would clip more than
/// one pixel in twenty, when the 95 % point becomes white. Neither fireflies nor a small lamp in view move it, and a
/// night scene is not lifted until its windows burn out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
}

/// Linear light of middle grey.
const KEY: f64 = 0.18;
/// Share of the pixels left out at each end before averaging.
const TRIM: f64 = 0.03;
/// Share of the pixels that must not clip.
const UNCLIPPED: f64 = 0.95;

impl ToneOperator for Constant {
    fn name(&self) -> &'static str {
        "constant"
    }

    fn fit(&self, guide: &SceneGuide<'_>, _display: &Display) -> Box<dyn FittedTone> {
        let statistics = SceneStatistics::of(guide.luminance_cd_m2);
        let key_scale = statistics.log_average(TRIM, 1.0 - TRIM).map_or(1.0, |average| KEY / average);
        let clip_scale = statistics.quantile(UNCLIPPED).map_or(1.0, f64::recip);
        Box::new(Scale { operator: self.name(), relative_per_cd_m2: self.exposure * key_scale.min(clip_scale) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;

    fn relative_of_ten(guide: &Plane) -> f32 {
        let fitted = Constant { exposure: 1.0 }.fit(&SceneGuide { luminance_cd_m2: guide }, &Display::default());
        fitted.relative_luminance(10.0)
    }

    #[test]
    fn an_even_picture_becomes_middle_grey() {
        assert!((relative_of_ten(&Plane::filled(16, 16, 10.0)) - 0.18).abs() < 1e-6);
    }

    #[test]
    fn a_lamp_and_fireflies_do_not_darken_the_picture() {
        let mut lamp = Plane::filled(100, 100, 10.0);
        lamp.values_mut()[..200].fill(20_000.0);
        lamp.values_mut()[5000] = 1e9;
        assert!((relative_of_ten(&lamp) - 0.18).abs() < 1e-6);
    }

    #[test]
    fn a_night_scene_keeps_its_windows() {
        let mut night = Plane::filled(100, 100, 0.01);
        night.values_mut()[..1000].fill(100.0);
        let fitted = Constant { exposure: 1.0 }.fit(&SceneGuide { luminance_cd_m2: &night }, &Display::default());
        assert!((fitted.relative_luminance(100.0) - 1.0).abs() < 1e-6);
    }
}
