//! AgX, Troy Sobotka's film-like operator as Blender 4 ships it.
//!
//! For pictures that are to look filmed. Not for what an eye would see: it knows neither adaptation nor the display's
//! luminance, and bends each channel by itself, so that what becomes of luminance depends on the colour.

use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

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
use crate::primaries::{IDENTITY, Matrix, Primaries, apply, inverse, product};

/// Film-like: colours move towards white as they brighten, over 16.5 stops, after the exposure of
/// [`Constant`](super::Constant).
///
/// Troy Sobotka's AgX as Blender 4 ships it (Eary Chow's base for Rec. 2020): inset primaries, log₂ from −10 to +6.5
/// stops about 0.18, a sigmoid of slope 2.4 and powers 1.5, a power of 2.4, 40 % of the per-channel hue shift,
/// outset. Its guard rails for colours outside Rec. 2020 are left out: what comes in is Rec. 709.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agx {
    /// Multiplies the scene: 2^stops.
    pub exposure: f64,
}

const INSET: Matrix = [
    [0.856_627_153_315_983, 0.095_121_240_538_158_8, 0.048_251_606_145_858_3],
    [0.137_318_972_929_847, 0.761_241_990_602_591, 0.101_439_036_467_562],
    [0.111_898_212_999_95, 0.076_799_418_603_190_3, 0.811_302_368_396_859],
];
/// What the outset is the inverse of.
const OUTSET_INVERSE: Matrix = [
    [0.899_796_955_911_611, 0.087_199_619_202_835_1, 0.013_003_424_885_555],
    [0.111_420_988_957_48, 0.875_575_586_156_966, 0.013_003_424_885_554_8],
    [0.111_420_988_957_48, 0.087_199_619_202_834_9, 0.801_379_391_839_686],
];
const MIDDLE_GREY: f64 = 0.18;
const MIN_STOPS: f64 = -10.0;
const MAX_STOPS: f64 = 6.5;
const SLOPE: f64 = 2.4;
const POWER: f64 = 1.5;
const GAMMA: f64 = 2.4;
/// Share of the hue that the curve on each channel leaves.
const HUE_SHIFT: f64 = 0.4;

/// The sigmoid through (10 / 16.5, 0.18^(1/2.4)), for 0..1.
struct Sigmoid {
    pivot_x: f64,
    pivot_y: f64,
    toe: f64,
    shoulder: f64,
}

impl Sigmoid {
    fn new() -> Self {
        let pivot_x = -MIN_STOPS / (MAX_STOPS - MIN_STOPS);
        let pivot_y = MIDDLE_GREY.powf(GAMMA.recip());
        // The scale with which the curve's end reaches 0 or 1.
        let scale =
            |x: f64, y: f64| ((SLOPE * x).powf(-POWER) * ((SLOPE * x / y).powf(POWER) - 1.0)).powf(-POWER.recip());
        Self { pivot_x, pivot_y, toe: scale(pivot_x, pivot_y), shoulder: scale(1.0 - pivot_x, 1.0 - pivot_y) }
    }

    fn at(&self, x: f64) -> f64 {
        let scale = if x < self.pivot_x { -self.toe } else { self.shoulder };
        let term = SLOPE * (x - self.pivot_x) / scale;
        scale * term / (1.0 + term.powf(POWER)).powf(POWER.recip()) + self.pivot_y
    }
}

/// Display light of a channel for 0..1 of its stops, at equal steps, between which a straight line is off by 2e-7 at
/// most. Three powers for each channel instead make looks at noise twice as long.
static CURVE: LazyLock<[f64; STEPS + 1]> = LazyLock::new(|| {
    let sigmoid = Sigmoid::new();
    std::array::from_fn(|step| sigmoid.at(step as f64 / STEPS as f64).clamp(0.0, 1.0).powf(GAMMA))
});
const STEPS: usize = 4096;

impl ToneOperator for Agx {
    fn name(&self) -> &'static str {
        "agx"
    }

    fn fit(&self, guide: &SceneGuide<'_>, _viewing: &Viewing, _state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        Box::new(FittedAgx::new(self.exposure * exposure_of(guide.luminance_cd_m2, Exposure::Automatic)))
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FittedAgx {
    relative_per_cd_m2: f64,
    into: Matrix,
    out: Matrix,
}

impl FittedAgx {
    fn new(relative_per_cd_m2: f64) -> Self {
        let wide = Primaries::REC709.to(&Primaries::REC2020).unwrap_or(IDENTITY);
        let narrow = inverse(&wide).unwrap_or(IDENTITY);
        let outset = inverse(&OUTSET_INVERSE).unwrap_or(IDENTITY);
        Self { relative_per_cd_m2, into: product(&INSET, &wide), out: product(&narrow, &outset) }
    }

    fn picture(&self, exposed: [f64; 3]) -> [f64; 3] {
        let inset = apply(&self.into, exposed);
        let shown = inset.map(channel);
        apply(&self.out, towards_hue(shown, inset))
    }
}

/// Display light of a channel.
fn channel(light: f64) -> f64 {
    let stops = (light.max(1e-10) / MIDDLE_GREY).log2().clamp(MIN_STOPS, MAX_STOPS);
    let place = (stops - MIN_STOPS) / (MAX_STOPS - MIN_STOPS) * STEPS as f64;
    let step = (place as usize).min(STEPS - 1);
    let [from, to] = [CURVE[step], CURVE[step + 1]];
    from + (place - step as f64) * (to - from)
}

/// `shown` with most of the hue of `scene`.
fn towards_hue(shown: [f64; 3], scene: [f64; 3]) -> [f64; 3] {
    let (Some(from), Some(hue)) = (hue(scene), hue(shown)) else { return shown };
    let turn = within_turn(hue - from + 9.0) - 3.0;
    let hue = within_turn(from + HUE_SHIFT * turn);
    let (greatest, least) = (shown[0].max(shown[1]).max(shown[2]), shown[0].min(shown[1]).min(shown[2]));
    // The standard hexagon: a channel is full within one sixth of its corner and gone beyond two.
    [5.0_f64, 3.0, 1.0].map(|corner| {
        let k = within_turn(corner + hue);
        greatest - (greatest - least) * k.min(4.0 - k).clamp(0.0, 1.0)
    })
}

/// Sixths of a turn, few of them, brought to 0..6.
fn within_turn(mut sixths: f64) -> f64 {
    while sixths >= 6.0 {
        sixths -= 6.0;
    }
    while sixths < 0.0 {
        sixths += 6.0;
    }
    sixths
}

/// Hue of the hexagon in sixths of a turn, red at 0; `None` for greys.
fn hue([r, g, b]: [f64; 3]) -> Option<f64> {
    let (greatest, least) = (r.max(g).max(b), r.min(g).min(b));
    let range = greatest - least;
    if range <= 1e-12 {
        return None;
    }
    Some(if greatest == r {
        within_turn((g - b) / range)
    } else if greatest == g {
        (b - r) / range + 2.0
    } else {
        (r - g) / range + 4.0
    })
}

impl FittedTone for FittedAgx {
    fn relative_luminance_at(&self, _pixel: Pixel, scene_cd_m2: f32) -> f32 {
        finite(channel(f64::from(scene_cd_m2.max(0.0)) * self.relative_per_cd_m2))
    }

    fn map_rgb_at(&self, _pixel: Pixel, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        let rgb = light(rgb_cd_m2);
        if luminance(rgb) <= 0.0 {
            return [0.0; 3];
        }
        self.picture(rgb.map(|c| f64::from(c) * self.relative_per_cd_m2)).map(|c| finite(c).min(1.0))
    }

    fn chromatic_slope_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        tint_slope(self, pixel, scene_cd_m2)
    }

    fn keeps_luminance(&self) -> bool {
        false
    }

    fn describe(&self) -> String {
        format!("agx: middle grey at {} cd/m² of the scene", Shown(MIDDLE_GREY / self.relative_per_cd_m2))
    }

    fn save(&self) -> SavedTone {
        SavedTone(Fit::Agx(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_definition_holds_at_its_points() {
        for (scene, expected) in [(0.18, 0.18), (0.18 * 6.5_f64.exp2(), 1.0), (0.18 * (-10.0_f64).exp2(), 0.0)] {
            assert!((channel(scene) - expected).abs() < 3e-7, "{scene}: {}", channel(scene));
        }
        // The slope at the pivot is what the definition asks for.
        let (sigmoid, step) = (Sigmoid::new(), 1e-5);
        let x = sigmoid.pivot_x;
        let slope = (sigmoid.at(x + step) - sigmoid.at(x - step)) / (2.0 * step);
        assert!((slope / SLOPE - 1.0).abs() < 1e-3, "{slope}");
        let furthest = (0..=100_000).map(|part| f64::from(part) / 1e5).fold(0.0, |furthest: f64, x| {
            let light = MIDDLE_GREY * (MIN_STOPS + x * (MAX_STOPS - MIN_STOPS)).exp2();
            furthest.max((channel(light) - sigmoid.at(x).clamp(0.0, 1.0).powf(GAMMA)).abs())
        });
        assert!(furthest < 3e-7, "{furthest}");
    }

    #[test]
    fn greys_stay_grey_and_bright_colours_pale() {
        let fit = FittedAgx::new(1.0);
        for light in [0.01, 0.18, 1.0, 10.0] {
            let [r, g, b] = fit.map_rgb([light; 3]);
            assert!((r - g).abs() < 1e-4 && (g - b).abs() < 1e-4, "{r} {g} {b}");
            assert!((g - fit.relative_luminance(light)).abs() < 1e-4);
        }
        let saturation = |light: f32| {
            let [r, _, b] = fit.map_rgb([0.1 * light, 0.1 * light, light]);
            (b - r) / b
        };
        assert!(saturation(0.2) > 0.5 && saturation(30.0) < 0.3, "{} {}", saturation(0.2), saturation(30.0));
    }

    #[test]
    fn hue_survives_the_way_through_the_hexagon() {
        for rgb in [[0.9, 0.2, 0.1], [0.2, 0.7, 0.3], [0.1, 0.4, 0.8], [0.5, 0.1, 0.6]] {
            let same = towards_hue(rgb, rgb);
            assert!(same.iter().zip(rgb).all(|(a, b)| (a - b).abs() < 1e-12), "{same:?}");
        }
    }
}
