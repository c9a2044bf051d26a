//! Ward's contrast-based scale factor.

use super::statistics::SceneStatistics;
use super::{FittedTone, Scale, SceneGuide, ToneOperator};
use crate::display::Display;

/// Scales so that what is just visible in the scene is just visible on the display.
///
/// Ward, "A contrast-based scalefactor for luminance display", Graphics Gems IV, 1994: thresholds after Blackwell,
/// ΔL = 0.0594 (1.219 + `L_a`^0.4)^2.5; the display's adaptation is half its white, the scene's the geometric mean of
/// its pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ward94 {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
}

impl ToneOperator for Ward94 {
    fn name(&self) -> &'static str {
        "ward94"
    }

    fn fit(&self, guide: &SceneGuide<'_>, display: &Display) -> Box<dyn FittedTone> {
        let display_adaptation = display.white_cd_m2 / 2.0;
        let scene_adaptation =
            SceneStatistics::of(guide.luminance_cd_m2).log_average(0.0, 1.0).unwrap_or(display_adaptation);
        let factor = scale_factor(scene_adaptation, display_adaptation);
        Box::new(Scale {
            operator: self.name(),
            relative_per_cd_m2: self.exposure * factor / display.white_cd_m2.max(f64::MIN_POSITIVE),
        })
    }
}

/// Display cd/m² for each cd/m² of the scene.
fn scale_factor(scene_adaptation_cd_m2: f64, display_adaptation_cd_m2: f64) -> f64 {
    ((1.219 + display_adaptation_cd_m2.powf(0.4)) / (1.219 + scene_adaptation_cd_m2.powf(0.4))).powf(2.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;

    #[test]
    fn golden_scale_factors() {
        for (scene, expected) in [
            (0.01, 39.609_147_54),
            (0.1, 26.525_836_53),
            (1.0, 12.026_045_44),
            (10.0, 3.280_847_339),
            (50.0, 1.0),
            (100.0, 0.567_197_577_4),
            (1000.0, 0.073_293_226_57),
        ] {
            assert!((scale_factor(scene, 50.0) / expected - 1.0).abs() < 1e-6, "{scene}");
        }
    }

    #[test]
    fn the_fit_uses_half_the_white() {
        let display = Display { white_cd_m2: 100.0, ..Display::default() };
        let guide = Plane::filled(4, 4, 10.0);
        let fitted = Ward94 { exposure: 1.0 }.fit(&SceneGuide { luminance_cd_m2: &guide }, &display);
        assert!((fitted.relative_luminance(10.0) - 0.328_084_7).abs() < 1e-5);
    }
}
