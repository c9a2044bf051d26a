//! Pattanaik, Tumblin, Yee and Greenberg's time-dependent visual model, 2000.
//!
//! For eyes that come from the dark or from the light, with a state of adaptation. Not for detail that dim light hides,
//! which it shows: no acuity is lost. Without a state the eye is adapted to the picture.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use super::fast_power::{FixedPower, powers};
use super::field::{AdaptationScope, LocalAdaptation};
use super::gamut::{fit_into_display, light};
use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::Screen;
use super::time::{AdaptationState, Goal, Kinetics, ReceptorState};
use super::words::Shown;
use super::{FittedTone, MIN_GREY_CD_M2, ToneOperator};
use crate::display::Viewing;
use crate::photometry::{luminance, scotopic_luminance};

/// Responses of rods and cones at their state of adaptation, shown so that a display's eye responds the same: dazzled
/// and blinded eyes included.
///
/// "Time-dependent visual adaptation for fast realistic image display", SIGGRAPH 2000; constants as
/// `pfstmo_pattanaik00` has them. Reference white is 5 times, black 5/32 of what the eye is adapted to; on the
/// display white is white. Without a state the eye is adapted to the geometric mean of the picture. Colour strength
/// follows the slope of the cones' response with its luminance kept, and rods see grey.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattanaik00 {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
    /// Whether the eye is adapted to the view as a whole or to each place. With [`AdaptationScope::Local`] responses
    /// are local, reference white and black those of the view.
    pub scope: AdaptationScope,
}

/// Exponent of the response.
const POWER: f64 = 0.73;
/// Light to the power of the response, and back, by tables: `powf` would be half of the operator's time.
static RAISED: LazyLock<FixedPower> = LazyLock::new(|| FixedPower::new(POWER));
static LOWERED: LazyLock<FixedPower> = LazyLock::new(|| FixedPower::new(POWER.recip()));
const WHITE_FACTOR: f64 = 5.0;
const BLACK_FACTOR: f64 = 5.0 / 32.0;
/// The half-saturation formulas are 0 / 0 at 0 cd/m².
const MIN_ADAPTATION_CD_M2: f64 = 1e-6;

/// Half-saturation luminance of cones, cd/m² (Hunt's model, as the paper has it).
fn sigma_cone(adaptation_cd_m2: f64) -> f64 {
    let light = adaptation_cd_m2.max(MIN_ADAPTATION_CD_M2);
    let k4 = (5.0 * light + 1.0).recip().powi(4);
    12.9223 * light / (k4 * light + 0.171 * (1.0 - k4).powi(2) * light.cbrt())
}

/// Half-saturation luminance of rods, cd/m². 2.5874 as published, though Hunt's formula scaled as for cones would give
/// 12.92; j with 5e5, where `pfstmo_pattanaik00` has 5e4, which differ below 0.001 cd/m².
fn sigma_rod(adaptation_cd_m2: f64) -> f64 {
    let light = adaptation_cd_m2.max(MIN_ADAPTATION_CD_M2);
    let j2 = (5e5 * light + 1.0).recip().powi(2);
    2.5874 * light / (19_000.0 * j2 * light + 0.2615 * (1.0 - j2).powi(4) * light.powf(1.0 / 6.0))
}

/// How one kind of receptor responds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Receptor {
    /// Half-saturation luminance to the power of the response.
    sigma_power: f64,
    pigment: f64,
}

impl Receptor {
    /// Share of the greatest response.
    #[inline]
    fn share(self, light_cd_m2: f32) -> f64 {
        let raised = RAISED.raise(light_cd_m2.max(0.0));
        // Infinite light and a σ of 0 at no light are the ends of the curve.
        if raised == f64::INFINITY {
            1.0
        } else if raised > 0.0 {
            raised / (raised + self.sigma_power)
        } else {
            0.0
        }
    }

    fn response(self, light_cd_m2: f64) -> f64 {
        self.pigment * self.share(light_cd_m2 as f32)
    }

    /// Slope of the response over the natural logarithm of luminance, where the response is `share` of the greatest.
    fn slope(self, share: f64) -> f64 {
        self.pigment * POWER * share * (1.0 - share)
    }
}

/// Both kinds at one state of adaptation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Retina {
    cones: Receptor,
    rods: Receptor,
}

impl Retina {
    fn at(cones: ReceptorState, rods: ReceptorState) -> Self {
        Self {
            cones: Receptor { sigma_power: sigma_cone(cones.neural_cd_m2).powf(POWER), pigment: cones.pigment },
            rods: Receptor { sigma_power: sigma_rod(rods.neural_cd_m2).powf(POWER), pigment: rods.pigment },
        }
    }

    fn response(&self, cones_cd_m2: f64, rods_cd_m2: f64) -> f64 {
        self.cones.response(cones_cd_m2) + self.rods.response(rods_cd_m2)
    }
}

/// Responses to reference white and black.
#[derive(Clone, Copy, Debug, PartialEq)]
struct References {
    white: f64,
    black: f64,
}

/// A response in the scene as one in front of the display: (R − from) scale + to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Appearance {
    from: f64,
    scale: f64,
    to: f64,
}

impl Appearance {
    /// Compresses a range too large for the display about white (or black, where white is dimmer than the display's);
    /// shifts a smaller one so that it fits, and else leaves it.
    fn between(scene: References, display: References) -> Self {
        let scale = ((display.white - display.black) / (scene.white - scene.black).max(1e-30)).min(1.0);
        if scene.white > display.white {
            Self { from: scene.white, scale, to: display.white }
        } else if scene.black < display.black {
            Self { from: scene.black, scale, to: display.black }
        } else {
            Self { from: 0.0, scale: 1.0, to: 0.0 }
        }
    }
}

/// The cones of who looks at the display, adapted to a fifth of its white. Their few rods are left out, as in the
/// paper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct DisplayEye {
    sigma_cd_m2: f64,
    adaptation_cd_m2: f64,
}

impl DisplayEye {
    fn before(white_cd_m2: f64) -> Self {
        let adaptation_cd_m2 = white_cd_m2 / WHITE_FACTOR;
        Self { sigma_cd_m2: sigma_cone(adaptation_cd_m2), adaptation_cd_m2 }
    }

    fn references(self) -> References {
        let cones = Receptor { sigma_power: self.sigma_cd_m2.powf(POWER), pigment: 1.0 };
        References {
            white: cones.response(WHITE_FACTOR * self.adaptation_cd_m2),
            black: cones.response(BLACK_FACTOR * self.adaptation_cd_m2),
        }
    }

    /// The luminance, cd/m², that gives this response.
    fn luminance_cd_m2(self, response: f64) -> f64 {
        let response = response.clamp(0.0, 1.0 - 1e-6);
        self.sigma_cd_m2 * LOWERED.raise((response / (1.0 - response)) as f32)
    }

    /// Mean slope of the response between black and white over the natural logarithm of luminance.
    fn slope(self) -> f64 {
        let References { white, black } = self.references();
        (white - black) / (WHITE_FACTOR / BLACK_FACTOR).ln()
    }
}

impl ToneOperator for Pattanaik00 {
    fn name(&self) -> &'static str {
        "pattanaik00"
    }

    fn sees_adaptation(&self) -> bool {
        true
    }

    fn always_loses_colour(&self) -> bool {
        true
    }

    fn sees_rods(&self) -> bool {
        true
    }

    fn knows_places(&self) -> bool {
        true
    }

    fn fit(&self, guide: &SceneGuide<'_>, viewing: &Viewing, state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let density = viewing.display.pixel_density();
        let adapted = || AdaptationState::adapted_to(Goal::of(guide, density), &self.kinetics());
        let state = state.copied().unwrap_or_else(adapted);
        let local = LocalAdaptation::of(guide, self.scope, &viewing.display);
        Box::new(FittedPattanaik00::new(state, local, viewing, self.exposure))
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedPattanaik00 {
    state: AdaptationState,
    retina: Retina,
    local: LocalAdaptation,
    appearance: Appearance,
    display_eye: DisplayEye,
    display_slope: f64,
    screen: Screen,
    exposure: f64,
}

impl FittedPattanaik00 {
    fn new(state: AdaptationState, local: LocalAdaptation, viewing: &Viewing, exposure: f64) -> Self {
        let screen = Screen::of(&viewing.display);
        let retina = Retina::at(state.cones, state.rods);
        let display_eye = DisplayEye::before(screen.white_cd_m2());
        let (cones, rods) = (state.cones.neural_cd_m2, state.rods.neural_cd_m2);
        let scene = References {
            white: retina.response(WHITE_FACTOR * cones, WHITE_FACTOR * rods),
            black: retina.response(BLACK_FACTOR * cones, BLACK_FACTOR * rods),
        };
        Self {
            state,
            retina,
            local,
            appearance: Appearance::between(scene, display_eye.references()),
            display_eye,
            display_slope: display_eye.slope(),
            screen,
            exposure,
        }
    }

    fn retina_at(&self, pixel: Pixel) -> Retina {
        self.local.at(pixel).map_or(self.retina, |local| {
            let goal = Goal { cones_cd_m2: local.cones_cd_m2, rods_cd_m2: local.rods_cd_m2 };
            let state = AdaptationState::adapted_to(goal, &Kinetics::PATTANAIK_2000);
            Retina::at(state.cones, state.rods)
        })
    }

    /// Exponent of the ratios of a colour's channels, where the cones' response is `share` of the greatest.
    fn strength(&self, cones: Receptor, share: f64) -> f32 {
        (cones.slope(share) / self.display_slope) as f32
    }

    /// Display luminance, cd/m², for a response in the scene.
    fn shown_cd_m2(&self, response: f64) -> f64 {
        let Appearance { from, scale, to } = self.appearance;
        self.exposure * self.display_eye.luminance_cd_m2((response - from) * scale + to)
    }
}

impl FittedTone for FittedPattanaik00 {
    fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let light = f64::from(scene_cd_m2.max(0.0));
        self.screen.relative(self.shown_cd_m2(self.retina_at(pixel).response(light, light)))
    }

    fn map_rgb_at(&self, pixel: Pixel, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        let rgb = light(rgb_cd_m2);
        let scene = luminance(rgb);
        let retina = self.retina_at(pixel);
        let cone_share_of_most = retina.cones.share(scene);
        let cones = retina.cones.pigment * cone_share_of_most;
        let rods = retina.rods.response(f64::from(scotopic_luminance(rgb)));
        let shown = self.screen.relative(self.shown_cd_m2(cones + rods));
        if scene <= 0.0 || cones + rods <= 0.0 {
            return [shown.min(1.0); 3];
        }
        let coloured = powers(rgb.map(|channel| channel / scene), self.strength(retina.cones, cone_share_of_most));
        let brightness = luminance(coloured).max(f32::MIN_POSITIVE);
        let cone_share = (cones / (cones + rods)) as f32;
        fit_into_display(
            coloured.map(|channel| (shown * (cone_share * channel / brightness + (1.0 - cone_share))).min(1e30)),
        )
    }

    fn chromatic_slope_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let light = scene_cd_m2.max(MIN_GREY_CD_M2);
        let retina = self.retina_at(pixel);
        let share = retina.cones.share(light);
        let (cones, rods) = (retina.cones.pigment * share, retina.rods.response(f64::from(light)));
        if cones <= 0.0 {
            return 0.0;
        }
        let shown = self.screen.relative(self.shown_cd_m2(cones + rods)).min(1.0);
        (cones / (cones + rods)) as f32 * self.strength(retina.cones, share) * shown / light
    }

    fn describe(&self) -> String {
        format!(
            "pattanaik00: cones adapted to {} cd/m² with {:.3} of their pigment, rods to {} with {}",
            Shown(self.state.cones.neural_cd_m2),
            self.state.cones.pigment,
            Shown(self.state.rods.neural_cd_m2),
            Shown(self.state.rods.pigment)
        )
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::Pattanaik00(Box::new(self.clone())))
    }
}

#[cfg(test)]
mod tests;
