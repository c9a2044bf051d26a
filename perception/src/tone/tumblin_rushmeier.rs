//! Tumblin and Rushmeier's brightness-preserving operator.

use super::statistics::SceneStatistics;
use super::{FittedTone, SceneGuide, ToneOperator};
use crate::display::Display;

/// Makes brightness on the display equal to brightness in the scene, by Stevens and Stevens' power laws.
///
/// Tumblin and Rushmeier, "Tone reproduction for realistic images", IEEE CG&A 13(6), 1993. Adaptation of the scene is
/// the geometric mean of its pixels, not a pixel's own (a local exponent reverses contrast at edges); that of the
/// display is white / √(white / black). The display's black is subtracted, since the display adds it again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TumblinRushmeier {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
}

/// One lambert in cd/m².
const LAMBERT_CD_M2: f64 = 1e4 / std::f64::consts::PI;
/// Below 1.6e-4 cd/m² the law's exponent turns negative and the picture into its negative.
const LEAST_ADAPTATION_CD_M2: f64 = 1e-3;

impl ToneOperator for TumblinRushmeier {
    fn name(&self) -> &'static str {
        "tumblin-rushmeier"
    }

    fn fit(&self, guide: &SceneGuide<'_>, display: &Display) -> Box<dyn FittedTone> {
        let black_cd_m2 = display.luminance_cd_m2(0.0);
        let white_cd_m2 = display.luminance_cd_m2(1.0);
        // A display without any black has no contrast to take the root of; 10 000:1 is as good as eyes need.
        let display_adaptation = (white_cd_m2 * black_cd_m2.max(white_cd_m2 * 1e-4)).sqrt();
        let scene_adaptation =
            SceneStatistics::of(guide.luminance_cd_m2).log_average(0.0, 1.0).unwrap_or(display_adaptation);
        Box::new(Fitted {
            law: BrightnessMatch::between(scene_adaptation, display_adaptation),
            scene_adaptation_cd_m2: scene_adaptation,
            black_cd_m2,
            span_cd_m2: (white_cd_m2 - black_cd_m2).max(f64::MIN_POSITIVE),
            exposure: self.exposure,
        })
    }
}

/// `L_d` = gain · `L_w`^exponent, both in lamberts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct BrightnessMatch {
    exponent: f64,
    gain: f64,
}

impl BrightnessMatch {
    fn between(scene_adaptation_cd_m2: f64, display_adaptation_cd_m2: f64) -> Self {
        let laws = |adaptation_cd_m2: f64| {
            let log = (adaptation_cd_m2.max(LEAST_ADAPTATION_CD_M2) / LAMBERT_CD_M2).log10();
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

#[derive(Clone, Copy, Debug, PartialEq)]
struct Fitted {
    law: BrightnessMatch,
    scene_adaptation_cd_m2: f64,
    black_cd_m2: f64,
    span_cd_m2: f64,
    exposure: f64,
}

impl FittedTone for Fitted {
    fn relative_luminance(&self, scene_cd_m2: f32) -> f32 {
        let shown = self.exposure * self.law.display_cd_m2(f64::from(scene_cd_m2)) - self.black_cd_m2;
        (shown / self.span_cd_m2).clamp(0.0, f64::from(f32::MAX)) as f32
    }

    fn describe(&self) -> String {
        format!(
            "tumblin-rushmeier: exponent {:.4} for a scene adaptation of {:.4} cd/m²",
            self.law.exponent, self.scene_adaptation_cd_m2
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_values() {
        for (adaptation, scene, expected) in [
            (1.0, 0.1, 2.760_540_998),
            (1.0, 1.0, 14.856_123_34),
            (1.0, 5.0, 48.171_544_1),
            (10.0, 1.0, 2.571_555_426),
            (25.0, 25.0, 25.0),
            (25.0, 125.0, 125.0),
            (100.0, 100.0, 31.281_514_72),
            (100.0, 500.0, 188.478_384_4),
            (1000.0, 1000.0, 45.391_957_66),
            (1000.0, 5000.0, 372.818_145_6),
        ] {
            let found = BrightnessMatch::between(adaptation, 25.0).display_cd_m2(scene);
            assert!((found / expected - 1.0_f64).abs() < 1e-6, "{adaptation} {scene}: {found}");
        }
        for (adaptation, expected) in [(0.01, 0.345_932_392_7), (1000.0, 1.308_379_648), (10_000.0, 1.500_869_1)] {
            let found = BrightnessMatch::between(adaptation, 25.0).exponent;
            assert!((found / expected - 1.0_f64).abs() < 1e-6, "{adaptation}: {found}");
        }
    }

    #[test]
    fn starlight_does_not_turn_into_a_negative() {
        assert!(BrightnessMatch::between(1e-5, 25.0).exponent > 0.0);
    }
}
