//! Ward Larson, Rushmeier and Piatko's histogram adjustment of 1997, with the human options of Radiance's `pcond`.
//!
//! For single pictures of great range. Not for sequences: the histogram is each picture's own, and nothing is adapted
//! over time.

use serde::{Deserialize, Serialize};

use super::acuity::AcuityFilter;
use super::gamut::{light, with_luminance};
use super::guide::{Pixel, SceneGuide};
use super::names::Effects;
use super::saved::{Fit, SavedTone};
use super::screen::{Screen, finite};
use super::statistics::filled;
use super::time::{AdaptationState, Goal};
use super::veil::Veil;
use super::{FittedTone, MIN_GREY_CD_M2, ToneOperator};
use crate::adaptation::{Mean, local_adaptation_cd_m2};
use crate::display::Display;
use crate::display::Viewing;
use crate::photometry::{luminance, scotopic_luminance};
use crate::plane::Plane;

mod adjustment;

pub use adjustment::Ceiling;
use adjustment::{Adjustment, DisplayRange, Histogram};

/// Gives each luminance of the scene as much of the display's range as the picture has of it, but never shows more
/// contrast than there is (or than can be seen, with [`Ceiling::Human`]).
///
/// "A visibility matching tone reproduction operator for high dynamic range scenes", IEEE TVCG 3(4), 1997; details as
/// Radiance's `pcond` has them. The histogram is that of foveal samples: means over a Gaussian as wide as a disc of
/// 1°, eight a degree. Luminances outside the samples' range are shown as the range's ends. With effects, as `pcond
/// -v -a -c`: glare before, acuity and colour after. It adapts to the picture and not over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WardLarson97 {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
    /// What bounds the displayed contrast.
    pub ceiling: Ceiling,
    /// What is shown of what the eye loses besides brightness.
    pub effects: Effects,
}

/// Foveal samples a degree, along each axis.
const SAMPLES_PER_DEGREE: f64 = 8.0;
/// Luminances, cd/m², between which colour fades in (`pcond`).
const SCOTOPIC_END_CD_M2: f32 = 0.005_62;
const PHOTOPIC_END_CD_M2: f32 = 5.62;

impl ToneOperator for WardLarson97 {
    fn name(&self) -> &'static str {
        "ward-larson97"
    }

    fn counts_darkness(&self) -> bool {
        true
    }

    fn optional_effects(&self) -> Effects {
        Effects { glare: true, acuity: true, colour: true }
    }

    fn fit(&self, guide: &SceneGuide<'_>, viewing: &Viewing, _state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let density = viewing.display.pixel_density();
        let clean = guide.luminance_cd_m2.map(|value| if value.is_finite() { value.max(0.0) } else { 0.0 });
        let veil = if self.effects.glare { Veil::of(&clean, density) } else { None };
        let retinal = veil.as_ref().map_or(clean.clone(), |veil| veil.over(&clean));
        // The eye does not look where nothing is.
        let retinal =
            retinal.combined(guide.luminance_cd_m2, |light, there| if there.is_nan() { f32::NAN } else { light });
        let range = DisplayRange::of(&viewing.display);
        let adjustment = Histogram::of(foveal_samples(&retinal, &viewing.display)).map_or_else(
            || Adjustment::Linear { scale: 1.0, adaptation_cd_m2: range.middle_cd_m2() },
            |histogram| histogram.adjust(range, self.ceiling),
        );
        let adaptation_cd_m2 = Goal::of(guide, density).cones_cd_m2;
        Box::new(FittedWardLarson97 {
            exposure: self.exposure,
            screen: Screen::of(&viewing.display),
            adjustment,
            veil,
            colour: self.effects.colour,
            acuity: self.effects.acuity.then(|| AcuityFilter::for_adaptation(adaptation_cd_m2, viewing)).flatten(),
        })
    }
}

fn foveal_samples(luminance_cd_m2: &Plane, display: &Display) -> Vec<f64> {
    let Ok(foveal) = local_adaptation_cd_m2(&filled(luminance_cd_m2), display, Mean::Arithmetic) else {
        return Vec::new();
    };
    let density = display.pixel_density();
    // From the middle of the first cell, so that no border is preferred.
    let places = |length: usize, pixels_per_degree: f64| {
        let stride = ((pixels_per_degree / SAMPLES_PER_DEGREE).round() as usize).max(1);
        (stride.min(length) / 2..length).step_by(stride)
    };
    let rows = || places(foveal.height(), density.vertical);
    let columns = || places(foveal.width(), density.horizontal);
    let all = || rows().flat_map(|y| columns().map(move |x| (x, y)));
    let of = |(x, y): (usize, usize)| f64::from(foveal.get(x, y));
    let there: Vec<f64> = all().filter(|&(x, y)| !luminance_cd_m2.get(x, y).is_nan()).map(of).collect();
    if there.is_empty() { all().map(of).collect() } else { there }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedWardLarson97 {
    exposure: f64,
    screen: Screen,
    adjustment: Adjustment,
    veil: Option<Veil>,
    colour: bool,
    acuity: Option<AcuityFilter>,
}

impl FittedWardLarson97 {
    /// Light on the retina for light of the scene.
    fn retinal(&self, pixel: Pixel, scene: f32) -> f32 {
        self.veil.as_ref().map_or(scene, |veil| Veil::own_share() * scene + veil.at(pixel))
    }

    fn shown(&self, retinal_cd_m2: f32) -> f32 {
        let shown_cd_m2 = self.adjustment.display_cd_m2(f64::from(retinal_cd_m2));
        finite(self.exposure * f64::from(self.screen.relative(shown_cd_m2)))
    }
}

/// Share of a colour that is left in mesopic light.
fn kept_colour(retinal_cd_m2: f32) -> f32 {
    ((retinal_cd_m2 - SCOTOPIC_END_CD_M2) / (PHOTOPIC_END_CD_M2 - SCOTOPIC_END_CD_M2)).clamp(0.0, 1.0)
}

/// Colour lost as the luminance of a pixel falls through the mesopic range.
fn faded(rgb: [f32; 3]) -> [f32; 3] {
    let kept = kept_colour(luminance(rgb));
    let rods = scotopic_luminance(rgb);
    rgb.map(|channel| kept * channel + (1.0 - kept) * rods)
}

impl FittedTone for FittedWardLarson97 {
    fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        self.shown(self.retinal(pixel, scene_cd_m2.max(0.0)))
    }

    fn map_rgb_at(&self, pixel: Pixel, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        let veiled = light(rgb_cd_m2).map(|channel| self.retinal(pixel, channel));
        let seen = if self.colour { faded(veiled) } else { veiled };
        let retinal = luminance(seen);
        with_luminance(seen, retinal, self.shown(retinal))
    }

    fn chromatic_slope_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let retinal = self.retinal(pixel, scene_cd_m2.max(MIN_GREY_CD_M2));
        let kept = if self.colour { kept_colour(retinal) } else { 1.0 };
        let own_share = if self.veil.is_some() { Veil::own_share() } else { 1.0 };
        own_share * kept * self.shown(retinal).min(1.0) / retinal
    }

    fn describe(&self) -> String {
        format!("ward-larson97: {}", self.adjustment)
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::WardLarson97(Box::new(self.clone())))
    }

    fn acuity(&self) -> Option<AcuityFilter> {
        self.acuity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Plane {
        // Five decades, evenly, with a texture.
        Plane::from_fn(320, 160, |x, y| 10.0_f32.powf(x as f32 / 64.0 - 2.0) * (1.0 + 0.2 * ((y / 8) % 2) as f32))
    }

    fn fit(effects: Effects) -> Box<dyn FittedTone> {
        fit_to(&picture(), effects)
    }

    fn fit_to(picture: &Plane, effects: Effects) -> Box<dyn FittedTone> {
        let operator = WardLarson97 { exposure: 1.0, ceiling: Ceiling::Human, effects };
        operator.fit(&SceneGuide::of(picture), &Viewing::default(), None)
    }

    #[test]
    fn a_wide_picture_fills_the_display() {
        let fit = fit(Effects::default());
        assert!(fit.relative_luminance(0.01) < 0.01 && fit.relative_luminance(1000.0) > 0.8, "{}", fit.describe());
    }

    #[test]
    fn effects_do_what_they_say() {
        let all = Effects { glare: true, acuity: true, colour: true };
        let plain = fit(Effects::default());
        let veiled = fit(Effects { glare: true, ..Effects::default() });
        let dark = Pixel { x: 300, y: 5 };
        // Black beside the bright end is no longer black.
        assert!(veiled.relative_luminance_at(dark, 0.0) > plain.relative_luminance_at(dark, 0.0));
        // Rods give a dim red its grey. In a picture of 1e-5 to 1 cd/m², so that 0.005 is not the display's black.
        let dim = picture().map(|value| 1e-3 * value);
        let faded = fit_to(&dim, Effects { colour: true, ..Effects::default() });
        let red = [0.015, 0.0025, 0.001];
        let spread = |rgb: [f32; 3]| (rgb[0] - rgb[2]) / rgb[0].max(1e-6);
        let (faded, plain_red) = (faded.map_rgb(red), fit_to(&dim, Effects::default()).map_rgb(red));
        assert!(spread(plain_red) > 0.5 && spread(faded) < 0.5 * spread(plain_red), "{faded:?} {plain_red:?}");
        assert!(plain.acuity().is_none());
        let night = picture().map(|value| 1e-3 * value);
        let operator = WardLarson97 { exposure: 1.0, ceiling: Ceiling::Human, effects: all };
        assert!(operator.fit(&SceneGuide::of(&night), &Viewing::default(), None).acuity().is_some());
    }
}
