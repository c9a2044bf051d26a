//! Rods and cones scaled each by its own thresholds: the frame of Ferwerda and others' and of Durand and Dorsey's
//! operators.

use serde::{Deserialize, Serialize};

use super::FittedTone;
use super::acuity::AcuityFilter;
use super::field::{Adapted, LocalAdaptation};
use super::gamut::{fit_into_display, light};
use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::finite;
use super::time::{AdaptationState, Goal};
use super::words::Shown;
use crate::display::PixelDensity;
use crate::photometry::scotopic_luminance;
use crate::tvi;

/// How much the rods count, by what the cones are adapted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum RodWeight {
    /// (0.8 − log₁₀ L) / 3.3 within 0..1: from the scotopic to the photopic end of mesopic vision. The paper says only
    /// that it goes from 1 to 0; the ramp is `RenderPark`'s.
    LogRamp,
    /// (σ − L/4) / (σ + L), σ = 100 cd/m², not below 0 (Walraven and Valeton).
    WalravenValeton,
}

impl RodWeight {
    pub(super) fn at(self, adaptation_cd_m2: f64) -> f64 {
        match self {
            Self::LogRamp => ((0.8 - adaptation_cd_m2.max(1e-10).log10()) / 3.3).clamp(0.0, 1.0),
            Self::WalravenValeton => {
                const SIGMA: f64 = 100.0;
                ((SIGMA - adaptation_cd_m2 / 4.0) / (SIGMA + adaptation_cd_m2)).max(0.0)
            }
        }
    }
}

/// Display cd/m² for each cd/m² of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct DuplexLaw {
    pub(super) cone_scale: f64,
    pub(super) rod_scale: f64,
    pub(super) rod_weight: f64,
}

impl DuplexLaw {
    /// What is at threshold to a receptor in the scene is at threshold to the cones that look at the display.
    pub(super) fn between(scene: Adapted, display_adaptation_cd_m2: f64, weight: RodWeight) -> Self {
        let shown = tvi::photopic(display_adaptation_cd_m2);
        Self {
            cone_scale: shown / tvi::photopic(scene.cones_cd_m2),
            rod_scale: shown / tvi::scotopic(scene.rods_cd_m2),
            rod_weight: weight.at(scene.cones_cd_m2),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedDuplex {
    pub(super) operator: String,
    pub(super) exposure: f64,
    pub(super) white_cd_m2: f64,
    pub(super) weight: RodWeight,
    /// Colour of what the rods see, of luminance 1.
    pub(super) rod_tint: [f32; 3],
    pub(super) world: Adapted,
    pub(super) law: DuplexLaw,
    pub(super) local: LocalAdaptation,
    pub(super) acuity: Option<AcuityFilter>,
}

/// What cones and rods are adapted to: the state of the eye, or the picture.
pub(super) fn adapted(guide: &SceneGuide<'_>, density: PixelDensity, state: Option<&AdaptationState>) -> Adapted {
    match state {
        Some(state) => Adapted { cones_cd_m2: state.cones.neural_cd_m2, rods_cd_m2: state.rods.neural_cd_m2 },
        None => {
            let goal = Goal::of(guide, density);
            Adapted { cones_cd_m2: goal.cones_cd_m2, rods_cd_m2: goal.rods_cd_m2 }
        }
    }
}

impl FittedDuplex {
    fn law_at(&self, pixel: Pixel) -> DuplexLaw {
        self.local.at(pixel).map_or(self.law, |local| DuplexLaw::between(local, self.white_cd_m2 / 2.0, self.weight))
    }
}

impl FittedTone for FittedDuplex {
    fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let law = self.law_at(pixel);
        let scale = law.cone_scale + law.rod_weight * law.rod_scale;
        finite(self.exposure * scale * f64::from(scene_cd_m2.max(0.0)) / self.white_cd_m2)
    }

    fn map_rgb_at(&self, pixel: Pixel, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        let rgb = light(rgb_cd_m2);
        let law = self.law_at(pixel);
        let cones = finite(self.exposure * law.cone_scale / self.white_cd_m2);
        let rods = finite(self.exposure * law.rod_weight * law.rod_scale / self.white_cd_m2) * scotopic_luminance(rgb);
        let mut shown = rgb;
        for (channel, tint) in shown.iter_mut().zip(self.rod_tint) {
            *channel = (*channel * cones + rods * tint).min(1e30);
        }
        fit_into_display(shown)
    }

    /// Rods see no colour.
    fn chromatic_slope_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let cones = finite(self.exposure * self.law_at(pixel).cone_scale / self.white_cd_m2);
        cones / self.relative_luminance_at(pixel, scene_cd_m2).max(1.0)
    }

    fn describe(&self) -> String {
        format!(
            "{}: cones × {}, rods × {} × {:.3}, for an adaptation of {} and {} cd/m²",
            self.operator,
            Shown(self.law.cone_scale),
            Shown(self.law.rod_scale),
            self.law.rod_weight,
            Shown(self.world.cones_cd_m2),
            Shown(self.world.rods_cd_m2)
        )
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::Duplex(self.clone()))
    }

    fn acuity(&self) -> Option<AcuityFilter> {
        self.acuity
    }
}
