//! Error as it will be seen: through a fitted tone operator, on a display.
//!
//! A pixel's error is pushed through the operator by itself, with what the eye is adapted to at that pixel; how a local
//! operator would spread it to other pixels is ignored.
//!
//! Not for what an operator does before its curve: loss of acuity is a filter on light and noise alike
//! ([`crate::tone::acuity`]).

mod bent;
mod shown;

use crate::csf::ChromaticChannel;
use crate::display::Display;
use crate::opponent::{OPPONENT_OF_RGB, Opponent};
use crate::photometry::REC709_WEIGHTS;
use crate::plane::{PIXELS_PER_TASK, Plane};
use crate::tone::{FittedTone, Pixel};
use bent::variances_of_colour;
use rayon::prelude::*;
use shown::{Noise, Shown};

/// Displayed luminance of every pixel, cd/m², for a picture of scene luminance, cd/m².
#[must_use]
pub fn display_luminance(fitted: &dyn FittedTone, display: &Display, scene_luminance: &Plane) -> Plane {
    let shown = Shown { fitted, display };
    Plane::from_fn(scene_luminance.width(), scene_luminance.height(), |x, y| {
        shown.cd_m2(Pixel { x, y }, scene_luminance.get(x, y))
    })
}

/// Displayed luminance of one pixel, cd/m²: [`display_luminance`] at `pixel`, whose scene luminance is `scene_cd_m2`.
#[must_use]
pub fn display_luminance_at(fitted: &dyn FittedTone, display: &Display, pixel: Pixel, scene_cd_m2: f32) -> f32 {
    Shown { fitted, display }.cd_m2(pixel, scene_cd_m2)
}

/// How much the displayed luminance changes with scene luminance around `scene_luminance` (cd/m²): the slope of the
/// chord from 5 % below to 5 % above. Noise that is to stay without bias may not go through the operator itself,
/// which is bent. Finite everywhere: luminance counts as at least 1e-4 and at most 1e30 cd/m², NaN as the least.
#[must_use]
pub fn display_slope(fitted: &dyn FittedTone, display: &Display, scene_luminance: &Plane) -> Plane {
    let shown = Shown { fitted, display };
    Plane::from_fn(scene_luminance.width(), scene_luminance.height(), |x, y| {
        let luminance = scene_luminance.get(x, y);
        // At most what leaves the chord's ends finite; NaN is not above anything.
        let at = if luminance > 1e-4 { luminance.min(1e30) } else { 1e-4 };
        let (below, above) = (0.95 * at, 1.05 * at);
        (shown.cd_m2(Pixel { x, y }, above) - shown.cd_m2(Pixel { x, y }, below)) / (above - below)
    })
}

/// Variance of the displayed luminance, (cd/m²)², for scene luminance of mean `mean` (cd/m²) and variance `variance`
/// ((cd/m²)², of the mean).
///
/// Three-point quadrature of the operator, not its derivative: just above a clip the derivative is 0, and the noise
/// is not. Where M ≥ √3 σ the points are those of Gauss and Hermite (M and M ± √3 σ); nearer to black, where light
/// cannot go below 0, the lower point stays at 0 and the upper one moves out to M + 3σ²/M, which keeps mean and
/// variance, and the square of what M + σ shows beside M has half of the say: where few samples brought the light,
/// the variance is theirs, and σ is how far the mean is off by them, not 3σ²/M, which may be far above a clip. An
/// operator that is linear over the points gives exactly its slope² · σ².
///
/// Measured on a point lamp 6 cm below a ceiling at 16 samples a pixel (`benches/results/beyond-white.md`): visibility
/// 19.7 ± 2.0 by the thresholds of the converged picture, 14 by comparison with it; predicted by the three points alone
/// 10.8, by M + σ alone 26.2, by this rule 19.9.
///
/// Where normal noise (√3 σ ≤ M) reaches over a clip of the display, three points see too much of it or nothing at
/// all; there the operator is asked at 21 points, −4σ to 4σ.
///
/// Pixels whose mean or variance is not finite get infinity; so does every pixel when the planes differ in size.
#[must_use]
pub fn display_variance(fitted: &dyn FittedTone, display: &Display, mean: &Plane, variance: &Plane) -> Plane {
    let shown = Shown { fitted, display };
    by_pixel(mean, variance, f32::INFINITY, |pixel, mean, variance| {
        // No variance is negative: like one that is not finite it must not pass for none.
        if variance < 0.0 {
            return f32::INFINITY;
        }
        shown.pixel(pixel, Noise { mean: f64::from(mean.max(0.0)), variance: f64::from(variance) }).variance()
    })
}

/// Colours of a picture on which there is noise.
#[derive(Clone, Copy, Debug)]
pub struct SceneColours<'a> {
    /// Linear Rec. 709 RGB of any strength, row-major: noise of luminance makes it brighter and darker.
    pub rgb: &'a [[f32; 3]],
    /// What the operator leaves of a faint tint on a grey: [`display_chromatic_slope`].
    pub chromatic_slope: &'a Plane,
}

impl SceneColours<'_> {
    /// The colour of one pixel, by its row-major index.
    ///
    /// # Panics
    /// For an index outside the picture.
    #[must_use]
    pub fn at(&self, index: usize) -> SceneColour {
        SceneColour { rgb: self.rgb[index], chromatic_slope: self.chromatic_slope.values()[index] }
    }
}

/// Variances of luminance, red–green and yellow–violet as displayed, (cd/m²)², for those of the scene, `scene`
/// ((cd/m²)², of the mean), on scene luminance `mean` (cd/m²): of each pixel as [`NoiseShown::opponent_variances`].
/// Every pixel gets infinity when the planes differ in size.
#[must_use]
pub fn display_opponent_variances(
    fitted: &dyn FittedTone,
    display: &Display,
    mean: &Plane,
    colours: SceneColours<'_>,
    scene: [&Plane; 3],
) -> [Plane; 3] {
    let (width, height) = (mean.width(), mean.height());
    let are_alike = scene.iter().chain([&colours.chromatic_slope]).all(|plane| plane.same_size(mean));
    if !are_alike || colours.rgb.len() != width * height {
        return std::array::from_fn(|_| Plane::filled(width, height, f32::INFINITY));
    }
    let shown = NoiseShown::new(fitted, display);
    let found: Vec<[f32; 3]> = (0..width * height)
        .into_par_iter()
        .with_min_len(PIXELS_PER_TASK)
        .map(|index| {
            let at = |plane: &Plane| plane.values()[index];
            let pixel = Pixel { x: index % width, y: index / width };
            shown.opponent_variances(pixel, at(mean), colours.at(index), scene.map(at))
        })
        .collect();
    std::array::from_fn(|channel| Plane::from_fn(width, height, |x, y| found[y * width + x][channel]))
}

/// The colour of one pixel of [`SceneColours`].
#[derive(Clone, Copy, Debug)]
pub struct SceneColour {
    /// Linear Rec. 709 RGB of any strength.
    pub rgb: [f32; 3],
    /// What the operator leaves of a faint tint on a grey as bright as the pixel: [`display_chromatic_slope`] there.
    pub chromatic_slope: f32,
}

/// Noise behind an operator and a display: [`display_opponent_variances`] for those who have it pixel by pixel.
pub struct NoiseShown<'a> {
    shown: Shown<'a>,
    /// Room of tints on black, red–green and yellow–violet.
    rooms_cd_m2: [f64; 2],
}

impl<'a> NoiseShown<'a> {
    /// Noise behind this operator and this display.
    #[must_use]
    pub fn new(fitted: &'a dyn FittedTone, display: &'a Display) -> Self {
        let rooms_cd_m2 = [ChromaticChannel::RedGreen, ChromaticChannel::YellowViolet]
            .map(|channel| room_of_tints(channel) * (display.white_cd_m2 - display.black_cd_m2));
        Self { shown: Shown { fitted, display }, rooms_cd_m2 }
    }

    /// A pixel's variances of luminance, red–green and yellow–violet as displayed, (cd/m²)², for those of the scene,
    /// `scene` ((cd/m²)², of the mean), on scene luminance `mean` (cd/m²): of luminance as [`display_variance`]; of
    /// colour, by most operators, the greater of two. One is what the operator leaves of tints, as far as there is
    /// room for them below the display's white, where every colour is white; nothing is taken off at black, whose
    /// tints are small by themselves. The other is what becomes of a `colour` that fits the display less, the
    /// brighter it is: red at half of white's luminance pales with each step towards it. An operator that knows the
    /// picture's colours ([`crate::tone::coloured()`]) is asked what it makes of them with noise.
    ///
    /// What is not finite, or of negative variance, gets infinity; colour also where luminance's variance is so.
    #[must_use]
    pub fn opponent_variances(&self, pixel: Pixel, mean: f32, colour: SceneColour, scene: [f32; 3]) -> [f32; 3] {
        let [luminance, red_green, yellow_violet] = scene;
        if !mean.is_finite() || !is_variance(luminance) {
            return [f32::INFINITY; 3];
        }
        let noise = Noise { mean: f64::from(mean.max(0.0)), variance: f64::from(luminance) };
        let of_scene = [red_green, yellow_violet];
        let tints = of_scene.map(|variance| colour.chromatic_slope * colour.chromatic_slope * variance);
        if let Some(luminance) = self.shown.variance_within_display(noise, colour.rgb, tints, self.rooms_cd_m2) {
            return told(scene, [luminance, tints[0], tints[1]]);
        }
        let found = if self.shown.fitted.without_colours().is_none() {
            let noisy = self.shown.pixel(pixel, noise);
            let tints = noisy.within_rooms(tints, self.rooms_cd_m2);
            let paling = noisy.variances_of_paling(colour.rgb);
            [noisy.variance(), tints[0].max(paling[0]), tints[1].max(paling[1])]
        } else {
            variances_of_colour(&self.shown, pixel, noise, colour.rgb, of_scene)
        };
        told(scene, found)
    }
}

/// Whether this can be one: finite and not negative.
fn is_variance(variance: f32) -> bool {
    variance.is_finite() && variance >= 0.0
}

/// Displayed variances, infinite where those of the scene are none.
fn told(scene: [f32; 3], displayed: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(
        |c| if is_variance(scene[c]) && displayed[c].is_finite() { displayed[c] } else { f32::INFINITY },
    )
}

/// Opponent signals, cd/m², of a colour (linear Rec. 709 RGB in scene cd/m²) as displayed at `pixel`: what the display
/// shows more than where it shows nothing.
#[must_use]
pub fn display_opponent(fitted: &dyn FittedTone, display: &Display, pixel: Pixel, rgb_cd_m2: [f32; 3]) -> Opponent {
    Shown { fitted, display }.opponent(pixel, rgb_cd_m2)
}

/// How far a chromatic signal can go from a grey that is 1 below white, where white is 1: of red and green, or of
/// violet and yellow, the one that fits better.
fn room_of_tints(channel: ChromaticChannel) -> f64 {
    let weights = REC709_WEIGHTS.map(f64::from);
    // The first has its luminance taken from green: where green is the one that rises, so much more of it fits.
    let (row, raised) = match channel {
        ChromaticChannel::RedGreen => (OPPONENT_OF_RGB[1], 0),
        ChromaticChannel::YellowViolet => (OPPONENT_OF_RGB[2], 2),
    };
    let green_for_raised = weights[raised] / weights[1];
    (row[raised] - green_for_raised * row[1]).abs() / green_for_raised
}

/// Chromatic signal as displayed over that of the scene, where that is faint, at every pixel
/// ([`FittedTone::chromatic_slope_at`]). What a display's clip of single channels hides is not taken off.
#[must_use]
pub fn display_chromatic_slope(fitted: &dyn FittedTone, display: &Display, scene_luminance: &Plane) -> Plane {
    let shown = Shown { fitted, display };
    Plane::from_fn(scene_luminance.width(), scene_luminance.height(), |x, y| {
        shown.chromatic_slope(Pixel { x, y }, scene_luminance.get(x, y))
    })
}

/// Half the difference that the two halves make on the display, cd/m²: (tone(M + D) − tone(M − D)) / 2 for the mean M
/// and the half difference D = (A − B) / 2, both scene cd/m².
///
/// Pixels that are not finite give 0 (they are counted and left out upstream); planes of different sizes give infinity.
#[must_use]
pub fn display_half_difference(
    fitted: &dyn FittedTone,
    display: &Display,
    mean: &Plane,
    half_difference: &Plane,
) -> Plane {
    let shown = Shown { fitted, display };
    by_pixel(mean, half_difference, 0.0, |pixel, mean, difference| {
        0.5 * (shown.cd_m2(pixel, mean + difference) - shown.cd_m2(pixel, mean - difference))
    })
}

/// `of` two planes' values at each pixel; `else_value` where they, or what becomes of them, are not finite. Planes of
/// different sizes give infinity.
fn by_pixel(first: &Plane, second: &Plane, else_value: f32, of: impl Fn(Pixel, f32, f32) -> f32 + Sync) -> Plane {
    if !first.same_size(second) {
        return Plane::filled(first.width(), first.height(), f32::INFINITY);
    }
    let mut result = Plane::filled(first.width(), first.height(), else_value);
    result.for_each_row_mut(|y, row| {
        for (x, (value, (&a, &b))) in row.iter_mut().zip(first.row(y).iter().zip(second.row(y))).enumerate() {
            if a.is_finite() && b.is_finite() {
                let found = of(Pixel { x, y }, a, b);
                *value = if found.is_finite() { found } else { else_value };
            }
        }
    });
    result
}

#[cfg(test)]
mod tests;
