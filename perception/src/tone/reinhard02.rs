//! Reinhard, Stark, Shirley and Ferwerda's photographic operator, 2002.
//!
//! For pictures of which no unit is known, since only ratios count. Not for what an eye would see: a moonlit scene is
//! shown as bright as a sunlit one.

use serde::{Deserialize, Serialize};

use super::constant::KEY;
use super::field::{AdaptationScope, FrozenPlane};
use super::guide::{Pixel, SceneGuide};
use super::saved::{Fit, SavedTone};
use super::screen::finite;
use super::statistics::log_average_of_lit;
use super::time::AdaptationState;
use super::words::Shown;
use super::{FittedTone, ToneOperator};
use crate::display::Viewing;
use crate::filter::gaussian_blur;
use crate::plane::Plane;

/// The picture's geometric mean becomes middle grey, and L (1 + L / `L_white`²) / (1 + L) brings the brightest pixel
/// to white.
///
/// "Photographic tone reproduction for digital images", SIGGRAPH 2002: key 0.18, equation 4. With
/// [`AdaptationScope::Local`] equation 9, dodging and burning: each pixel is divided by the mean of the largest
/// surround of even luminance (eight scales in steps of 1.6, φ = 8, ε = 0.05). It knows no unit: only ratios count,
/// and pixels below 1e-10 of the brightest, fireflies aside, are no part of the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reinhard02 {
    /// Multiplies the scene: 2^stops.
    pub exposure: f64,
    /// One curve for all, or one for each surround.
    pub scope: AdaptationScope,
}

impl ToneOperator for Reinhard02 {
    fn name(&self) -> &'static str {
        "reinhard02"
    }

    fn knows_places(&self) -> bool {
        true
    }

    fn fit(&self, guide: &SceneGuide<'_>, _viewing: &Viewing, _state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let plane = guide.luminance_cd_m2;
        let greatest = plane.values().iter().copied().filter(|value| value.is_finite()).fold(0.0, f32::max);
        let scale = self.exposure * log_average_of_lit(plane).map_or(1.0, |average| KEY / average);
        let surround = match self.scope {
            AdaptationScope::World => None,
            AdaptationScope::Local => Some(FrozenPlane::of(surround(plane, scale))),
        };
        // A picture whose brightest pixel is not bright keeps the plain curve: `white` below 1 would lift it.
        Box::new(FittedReinhard02 { scale, white: (scale * f64::from(greatest)).max(1.0), surround })
    }
}

/// The mean of the largest surround that is even, in units of the scaled picture.
fn surround(luminance_cd_m2: &Plane, scale: f64) -> Plane {
    const SCALES: i32 = 8;
    const PHI: f32 = 8.0;
    const EPSILON: f32 = 0.05;
    let scaled = luminance_cd_m2.map(|value| match value {
        value if value.is_finite() => finite(scale * f64::from(value)),
        // Where nothing is, the surround is the average.
        value if value.is_nan() => KEY as f32,
        _ => 0.0,
    });
    // A profile of exp(−r² / (0.35 s)²) has σ = 0.35 s / √2.
    let at = |step: i32| gaussian_blur(&scaled, 0.35 * 1.6_f64.powi(step) / 2.0_f64.sqrt());
    let mut center = at(0);
    let mut chosen = center.clone();
    let mut open = Plane::filled(center.width(), center.height(), 1.0);
    for step in 0..SCALES {
        let wider = at(step + 1);
        let size = 1.6_f32.powi(step);
        let pixels = chosen.values_mut().iter_mut().zip(open.values_mut());
        for ((chosen, open), (&center, &wider)) in pixels.zip(center.values().iter().zip(wider.values())) {
            let response = (center - wider) / (2.0_f32.powf(PHI) * KEY as f32 / (size * size) + center);
            if *open > 0.0 {
                *chosen = center;
                if response.abs() >= EPSILON {
                    *open = 0.0;
                }
            }
        }
        center = wider;
    }
    chosen
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedReinhard02 {
    scale: f64,
    white: f64,
    surround: Option<FrozenPlane>,
}

impl FittedTone for FittedReinhard02 {
    fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let light = self.scale * f64::from(scene_cd_m2.clamp(0.0, f32::MAX).max(0.0));
        finite(match self.surround.as_ref().and_then(|surround| surround.at(pixel)) {
            Some(surround) => light / (1.0 + surround),
            None => light * (1.0 + light / (self.white * self.white)) / (1.0 + light),
        })
    }

    fn describe(&self) -> String {
        let [grey, white] = [KEY, self.white].map(|relative| Shown(relative / self.scale));
        format!("reinhard02: middle grey at {grey}, white at {white} cd/m² of the scene")
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::Reinhard02(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(guide: &Plane, scope: AdaptationScope) -> Box<dyn FittedTone> {
        Reinhard02 { exposure: 1.0, scope }.fit(&SceneGuide::of(guide), &Viewing::default(), None)
    }

    #[test]
    fn the_mean_is_grey_and_the_brightest_is_white() {
        let guide = Plane::from_fn(101, 1, |x, _| 10.0_f32.powf((x as f32 - 50.0) / 25.0));
        let fit = fit(&guide, AdaptationScope::World);
        assert!((fit.relative_luminance(1.0) - 0.18 / 1.18).abs() < 1e-3);
        assert!((fit.relative_luminance(100.0) - 1.0).abs() < 1e-5);
    }

    /// Moonlight and sunlight of one scene make one picture.
    #[test]
    fn a_unit_changes_nothing() {
        let guide = Plane::from_fn(101, 1, |x, _| if x < 30 { 0.0 } else { 10.0_f32.powf((x as f32 - 50.0) / 25.0) });
        let shown = |unit: f32| {
            let guide = guide.map(|value| unit * value);
            [AdaptationScope::World, AdaptationScope::Local]
                .map(|scope| fit(&guide, scope).relative_luminance_at(Pixel { x: 60, y: 0 }, unit * 3.0))
        };
        let expected = shown(1.0);
        for unit in [1e-6, 1e-4, 1e5] {
            let found = shown(unit);
            assert!(found.iter().zip(expected).all(|(a, b)| (a / b - 1.0).abs() < 1e-3), "{unit}: {found:?}");
        }
    }

    /// A spike is no reason to take the rest for darkness, and neither are a few.
    #[test]
    fn a_huge_pixel_leaves_the_others_as_they_are() {
        let scene = |spikes: usize, spike: f32| {
            let mut guide = Plane::from_fn(64, 64, |x, y| 1.0 + ((x + y) % 50) as f32);
            guide.values_mut()[200..200 + spikes].fill(spike);
            guide
        };
        for scope in [AdaptationScope::World, AdaptationScope::Local] {
            let shown = |guide: &Plane| fit(guide, scope).relative_luminance_at(Pixel { x: 60, y: 60 }, 20.0);
            // White is far away already.
            let expected = shown(&scene(1, 1e5));
            for spikes in [1, 4] {
                for spike in [1e9, 1e12, 1e30] {
                    let found = shown(&scene(spikes, spike));
                    // They are part of the geometric mean.
                    assert!((found / expected - 1.0).abs() < 0.07, "{spikes} of {spike}: {found}, not {expected}");
                }
            }
        }
    }

    #[test]
    fn dodging_keeps_detail_that_the_plain_curve_flattens() {
        let guide = Plane::from_fn(128, 128, |x, y| {
            let base = if x < 64 { 1.0 } else { 300.0 };
            base * if (x / 4 + y / 4) % 2 == 0 { 1.0 } else { 1.3 }
        });
        let contrast = |scope| {
            let fit = fit(&guide, scope);
            let at = |y| fit.relative_luminance_at(Pixel { x: 97, y }, guide.get(97, y));
            (at(65) / at(61)).max(at(61) / at(65))
        };
        let (local, world) = (contrast(AdaptationScope::Local), contrast(AdaptationScope::World));
        assert!(local > 1.02 * world, "{local} {world}");
    }
}
