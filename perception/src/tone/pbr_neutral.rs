//! The Khronos group's PBR Neutral, 2024.
//!
//! For surfaces whose colours are to be recognised. Not for what an eye would see: it knows neither adaptation nor the
//! display's luminance, and what becomes of luminance depends on the colour.

use serde::{Deserialize, Serialize};

use super::constant::{Exposure, exposure_of};
use super::gamut::light;
use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::finite;
use super::time::AdaptationState;
use super::tint::tint_slope;
use super::words::Shown;
use super::{FittedTone, ToneOperator};
use crate::display::Viewing;
use crate::photometry::luminance;

/// Shows base colours as they are and compresses highlights above 0.8, after the exposure of
/// [`Constant`](super::Constant).
///
/// Khronos PBR Neutral Tone Mapper, specification of May 2024: `F_90` 0.04 is subtracted from all channels (less of it
/// near black), `K_s` = 0.8 − 0.04, `K_d` = 0.15.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PbrNeutral {
    /// Multiplies the scene: 2^stops.
    pub exposure: f64,
}

const REFLECTION: f32 = 0.04;
const COMPRESSION_START: f32 = 0.8 - REFLECTION;
const DESATURATION: f32 = 0.15;

/// The specified curve, for linear Rec. 709 RGB.
fn compressed(rgb: [f32; 3]) -> [f32; 3] {
    let least = rgb.into_iter().fold(f32::INFINITY, f32::min);
    let offset = if least <= 2.0 * REFLECTION { least - least * least / (4.0 * REFLECTION) } else { REFLECTION };
    let base = rgb.map(|channel| channel - offset);
    let peak = base.into_iter().fold(0.0, f32::max);
    if peak <= COMPRESSION_START {
        return base;
    }
    let room = 1.0 - COMPRESSION_START;
    let shown_peak = 1.0 - room * room / (peak + room - COMPRESSION_START);
    let kept = (DESATURATION * (peak - shown_peak) + 1.0).recip();
    base.map(|channel| shown_peak + kept * (channel * (shown_peak / peak) - shown_peak))
}

impl ToneOperator for PbrNeutral {
    fn name(&self) -> &'static str {
        "pbr-neutral"
    }

    fn fit(&self, guide: &SceneGuide<'_>, _viewing: &Viewing, _state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let relative_per_cd_m2 = self.exposure * exposure_of(guide.luminance_cd_m2, Exposure::Automatic);
        Box::new(FittedPbrNeutral { relative_per_cd_m2 })
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedPbrNeutral {
    relative_per_cd_m2: f64,
}

impl FittedTone for FittedPbrNeutral {
    fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        luminance(self.map_rgb_at(pixel, [scene_cd_m2.clamp(0.0, f32::MAX); 3]))
    }

    fn map_rgb_at(&self, _pixel: Pixel, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        // Beyond 1e6 the curve is white to the last bit.
        let exposed = light(rgb_cd_m2).map(|c| finite(f64::from(c) * self.relative_per_cd_m2).min(1e6));
        compressed(exposed).map(|channel| channel.clamp(0.0, 1.0))
    }

    fn chromatic_slope_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        tint_slope(self, pixel, scene_cd_m2)
    }

    fn keeps_luminance(&self) -> bool {
        false
    }

    fn describe(&self) -> String {
        format!("pbr-neutral: 1 at {} cd/m² of the scene", Shown(self.relative_per_cd_m2.recip()))
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::PbrNeutral(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: [f32; 3], expected: [f32; 3]) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?} for {expected:?}");
    }

    /// The specification's notes: base colours between 0.08 and 0.8 lose exactly 0.04; hue stays; the curve is smooth.
    #[test]
    fn what_the_specification_promises() {
        close(compressed([0.5, 0.3, 0.1]), [0.46, 0.26, 0.06]);
        close(compressed([0.04; 3]), [0.01; 3]);
        close(compressed([0.8; 3]), [0.76; 3]);
        let bright = compressed([9.0, 3.0, 3.0]);
        assert!(bright[1] == bright[2] && bright[0] <= 1.0 && bright[1] > 0.3, "{bright:?}");
        let at = |x: f32| compressed([x; 3])[0];
        for knee in [0.08, 0.8] {
            let (below, above) = (at(knee) - at(knee - 0.001), at(knee + 0.001) - at(knee));
            assert!((below / above - 1.0).abs() < 0.02, "{knee}: {below} {above}");
        }
    }
}
