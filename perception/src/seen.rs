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
mod tests {
    use super::*;
    use crate::display::Viewing;
    use crate::tone::{SceneGuide, coloured, gamut, operator};

    fn absolute(display: &Display) -> Box<dyn FittedTone> {
        let guide = Plane::filled(1, 1, 1.0);
        let viewing = Viewing::of(display.clone());
        operator("absolute", None).unwrap().fit(&SceneGuide::of(&guide), &viewing, None)
    }

    /// Variance of red–green as displayed, where luminance has no noise.
    fn chromatic_variance(fitted: &dyn FittedTone, display: &Display, mean: &Plane, variance: &Plane) -> Plane {
        let slope = display_chromatic_slope(fitted, display, mean);
        let grey = SceneColours { rgb: &[[1.0; 3]], chromatic_slope: &slope };
        let [_, red_green, _] =
            display_opponent_variances(fitted, display, mean, grey, [&one(0.0), variance, &one(0.0)]);
        red_green
    }

    fn one(value: f32) -> Plane {
        Plane::filled(1, 1, value)
    }

    /// An operator of which nobody knows that it multiplies by one number.
    #[derive(Debug)]
    struct Unknown(Box<dyn FittedTone>);

    impl FittedTone for Unknown {
        fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
            self.0.relative_luminance_at(pixel, scene_cd_m2)
        }

        fn describe(&self) -> String {
            self.0.describe()
        }

        fn save(&self) -> crate::tone::SavedTone {
            self.0.save()
        }
    }

    /// From noise that few samples bring to normal noise, up to white, of greys and of colours that reach it earlier:
    /// what is told at once is what all points tell, and most of it is told at once.
    #[test]
    fn noise_within_the_display_is_told_as_by_all_points() {
        let display = Display { white_cd_m2: 200.0, black_cd_m2: 0.2, ..Display::default() };
        let constant = || {
            let guide = Plane::filled(1, 1, 20.0);
            operator("constant", None).unwrap().fit(&SceneGuide::of(&guide), &Viewing::of(display.clone()), None)
        };
        let (known, unknown) = (constant(), Unknown(constant()));
        let white_cd_m2 = known.relative_per_cd_m2().unwrap().recip() as f32;
        let (at_once, by_points) = (NoiseShown::new(&*known, &display), NoiseShown::new(&unknown, &display));
        let pixel = Pixel { x: 0, y: 0 };
        let (mut told_at_once, mut all) = (0, 0);
        for mean in [0.0025, 0.025, 0.2, 0.5, 0.75, 0.95, 1.15].map(|share| share * white_cd_m2) {
            for deviation in [0.02, 0.2, 0.5, 0.7, 1.5] {
                for rgb in [[1.0; 3], [1.0, 0.2, 0.1], [0.1, 0.2, 4.0]] {
                    for tints in [0.0, 1e-4, 0.1].map(|share| share * white_cd_m2 * white_cd_m2) {
                        let slope = display_chromatic_slope(&*known, &display, &one(mean)).get(0, 0);
                        let colour = SceneColour { rgb, chromatic_slope: slope };
                        let luminance = (deviation * mean) * (deviation * mean);
                        let scene = [luminance, tints, 0.5 * tints];
                        let noise = Noise { mean: f64::from(mean), variance: f64::from(luminance) };
                        let is_at_once = at_once
                            .shown
                            .variance_within_display(
                                noise,
                                rgb,
                                [tints, 0.5 * tints].map(|tint| slope * slope * tint),
                                at_once.rooms_cd_m2,
                            )
                            .is_some();
                        told_at_once += usize::from(is_at_once);
                        all += 1;
                        let [one, other] =
                            [&at_once, &by_points].map(|shown| shown.opponent_variances(pixel, mean, colour, scene));
                        for (one, other) in one.into_iter().zip(other) {
                            let least = one.max(other).max(1e-6);
                            assert!(
                                (one - other).abs() < 1e-3 * least,
                                "{mean}, {deviation}, {rgb:?}, {tints}: {one}, {other}"
                            );
                        }
                    }
                }
            }
        }
        assert!(3 * told_at_once > all, "{told_at_once} of {all}");
    }

    #[test]
    fn a_linear_operator_keeps_the_variance() {
        let display = Display::default();
        let guide = Plane::filled(1, 1, 10.0);
        let ward94 = operator("ward94", None).unwrap();
        let fitted = ward94.fit(&SceneGuide::of(&guide), &Viewing::of(display.clone()), None);
        let slope = fitted.relative_luminance(1.0) * 199.8;
        // The last two have σ near and above the mean.
        for (mean, variance) in [(10.0, 4.0), (10.0, 30.0), (2.0, 4.0), (0.5, 1.0)] {
            let found = display_variance(&*fitted, &display, &one(mean), &one(variance)).get(0, 0);
            let expected = slope * slope * variance;
            assert!((found / expected - 1.0).abs() < 1e-4, "{mean} {variance}: {found}");
        }
    }

    /// One sample in 200 brings all light, and 16 are taken: what each pixel's own variance makes of it, on the mean of
    /// all, is what the means of pixels show, or half of that where the three points reach above white. Regression: the
    /// three points alone said that nothing shows there.
    #[test]
    fn light_that_few_samples_bring_shows_at_a_clip() {
        let display = Display::default();
        let fitted = absolute(&display);
        let white = display.white_cd_m2 as f32;
        let shown =
            |scene: f32| f64::from(Shown { fitted: &*fitted, display: &display }.cd_m2(Pixel { x: 0, y: 0 }, scene));
        for (brightest, least) in [(0.03, 0.99), (0.5, 0.49), (50.0, 0.49)] {
            // Of a mean with one such sample; one pixel in 12.5 has one.
            let (bright, share) = (brightest * white, 0.08);
            let mean = share * bright.min(white);
            let truth = f64::from(share) * (shown(bright) - shown(mean)).powi(2);
            let variance = (bright - mean).powi(2);
            let told = f64::from(share * display_variance(&*fitted, &display, &one(mean), &one(variance)).get(0, 0));
            assert!((least..1.01).contains(&(told / truth)), "{brightest}: {told} for {truth}");
        }
    }

    #[test]
    fn noise_above_a_clip_is_not_lost() {
        let display = Display::default();
        let fitted = absolute(&display);
        // Mean 10 above white, σ 20: the derivative at the mean is 0, the noise dips far below white.
        let found = display_variance(&*fitted, &display, &one(210.0), &one(400.0)).get(0, 0);
        assert!(found > 50.0, "{found}");
        let far_above = display_variance(&*fitted, &display, &one(2000.0), &one(400.0)).get(0, 0);
        assert_eq!(far_above, 0.0);
    }

    /// Variance of a normal variable that is cut at black and white, by a fine sum.
    fn variance_below(mean: f64, deviation: f64, white: f64) -> f64 {
        let (mut weights, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for step in -4000..=4000 {
            let z = f64::from(step) / 500.0;
            let (weight, shown) = ((-0.5 * z * z).exp(), (mean + z * deviation).clamp(0.2, white));
            weights += weight;
            sum += weight * shown;
            squares += weight * shown * shown;
        }
        squares / weights - (sum / weights).powi(2)
    }

    /// Means from far below the clip at 200 cd/m² to above it, where three points give 0 from 1.8 σ on; and at black,
    /// 0.2 cd/m².
    #[test]
    fn noise_at_a_clip_has_the_variance_that_it_shows() {
        let display = Display::default();
        let fitted = absolute(&display);
        for (mean, deviation) in [
            (150.0, 20.0),
            (180.0, 20.0),
            (195.0, 5.0),
            (200.0, 5.0),
            (205.0, 5.0),
            (209.0, 5.0),
            (220.0, 10.0),
            (240.0, 20.0),
            (0.18, 0.01),
            (0.2, 0.02),
            (0.21, 0.02),
        ] {
            let variance = (deviation * deviation) as f32;
            let found = f64::from(display_variance(&*fitted, &display, &one(mean as f32), &one(variance)).get(0, 0));
            let expected = variance_below(mean, deviation, 200.0);
            assert!(
                (found / expected).sqrt() < 1.05 && (found / expected).sqrt() > 0.95,
                "{mean} ± {deviation}: {found}, not {expected}"
            );
        }
    }

    /// Red for green on noisy grey, below, about and above white, by what the operator makes of 20,000 such colours.
    #[test]
    fn tints_have_the_room_that_white_leaves() {
        const COLOURS: usize = 20_000;
        let display = Display::default();
        let fitted = absolute(&display);
        let pixel = Pixel { x: 0, y: 0 };
        let red_for_green = [1.0, -REC709_WEIGHTS[0] / REC709_WEIGHTS[1], 0.0];
        let signal = crate::opponent::opponent(red_for_green).red_green;
        // An even spread over three standard deviations to each side has the variance of 3; steps far apart so that
        // both are independent.
        let spread =
            |index: usize, step: usize| ((index * step % COLOURS) as f32 / COLOURS as f32 - 0.5) * 12.0_f32.sqrt();
        for (mean, deviation, tint) in
            [(100.0, 5.0, 10.0), (150.0, 20.0, 20.0), (190.0, 10.0, 40.0), (200.0, 10.0, 20.0), (240.0, 10.0, 20.0)]
        {
            let (mut sum, mut squares) = (0.0, 0.0);
            for index in 0..COLOURS {
                let grey = mean + deviation * spread(index, 7_919);
                let rgb = red_for_green.map(|part| grey + tint * spread(index, 1_237) * part);
                let shown = f64::from(display_opponent(&*fitted, &display, pixel, rgb).red_green);
                sum += shown;
                squares += shown * shown;
            }
            let count = COLOURS as f64;
            let truth = squares / count - (sum / count).powi(2);
            let slope = display_chromatic_slope(&*fitted, &display, &one(mean));
            let scene = [deviation * deviation, (tint * signal).powi(2), 0.0].map(one);
            let grey = SceneColours { rgb: &[[1.0; 3]], chromatic_slope: &slope };
            let [_, told, _] = display_opponent_variances(&*fitted, &display, &one(mean), grey, scene.each_ref());
            let ratio = f64::from(told.get(0, 0)).sqrt() / truth.sqrt().max(1e-6);
            assert!((0.9..1.8).contains(&ratio) || truth < 1e-6 && told.get(0, 0) < 1e-6, "{mean}: {ratio}");
        }
    }

    /// A colour pales as it brightens, and noise of its luminance is noise of its colour, by 2001 such luminances.
    /// Regression: with what the operator leaves of tints alone, the last three cases were predicted as 0.54, 0.39 and
    /// 0.19 of it.
    #[test]
    fn noise_of_luminance_pales_colours() {
        let display = Display::default();
        let fitted = absolute(&display);
        // Of what is squeezed already some noise is predicted that is hidden: at most twice and a half.
        for (colour, mean, deviation, most) in [
            ([0.6, 0.06, 0.05], 30.0, 2.0, 1.05),
            ([0.6, 0.06, 0.05], 110.0, 8.0, 2.5),
            ([0.9, 0.6, 0.4], 100.0, 8.0, 1.05),
            ([0.9, 0.6, 0.4], 150.0, 10.0, 1.5),
            ([0.9, 0.6, 0.4], 180.0, 8.0, 1.5),
            ([0.7, 0.6, 0.5], 180.0, 8.0, 1.5),
        ] {
            let luminance = crate::photometry::luminance(colour);
            let (mut weights, mut sum, mut squares) = (0.0, 0.0, 0.0);
            for step in -1000..=1000 {
                let deviations = f64::from(step) / 250.0;
                let scene = (mean + deviations * deviation) as f32;
                let rgb = colour.map(|channel| channel * scene / luminance);
                let shown = f64::from(display_opponent(&*fitted, &display, Pixel { x: 0, y: 0 }, rgb).red_green);
                let weight = (-0.5 * deviations * deviations).exp();
                weights += weight;
                sum += weight * shown;
                squares += weight * shown * shown;
            }
            let truth = (squares / weights - (sum / weights).powi(2)).sqrt();
            let mean_cd_m2 = one(mean as f32);
            let slope = display_chromatic_slope(&*fitted, &display, &mean_cd_m2);
            let of_scene = [1.0, crate::opponent::opponent(colour.map(|channel| channel / luminance)).red_green, 0.0]
                .map(|signal: f32| one((deviation as f32 * signal).powi(2)));
            let colours = SceneColours { rgb: &[colour], chromatic_slope: &slope };
            let [_, told, _] =
                display_opponent_variances(&*fitted, &display, &mean_cd_m2, colours, of_scene.each_ref());
            let ratio = f64::from(told.get(0, 0)).sqrt() / truth;
            assert!((0.9..most).contains(&ratio), "{colour:?} at {mean} ± {deviation}: {ratio}");
        }
    }

    /// What a colour's noise is, in a test.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum NoiseOf {
        /// More and less of the colour.
        Colour(f64),
        /// Grey light over it.
        Grey(f64),
        /// Red for green.
        Tint(f64),
    }

    /// Noise of a colour whose channels are bent or clipped each by itself, against 2001 lights. Regression: judged by
    /// tints of greys, noise of a blue beyond its clip was predicted as 7 times what is seen, and that of a blue whose
    /// luminance is beyond white as nothing.
    #[test]
    fn noise_of_colours_is_told_where_channels_are_bent_alone() {
        let display = Display::default();
        let (guide, pixel) = (one(30.0), Pixel { x: 0, y: 0 });
        let (blue, red) = ([0.02, 0.03, 0.9], [0.6, 0.06, 0.05]);
        for (name, colour, mean, noise) in [
            ("srgb", blue, 30.0, NoiseOf::Colour(3.0)),
            ("srgb", blue, 200.0, NoiseOf::Colour(20.0)),
            ("srgb", [0.6, 0.5, 0.4], 60.0, NoiseOf::Colour(6.0)),
            ("linear", blue, 200.0, NoiseOf::Colour(20.0)),
            ("agx", blue, 30.0, NoiseOf::Colour(3.0)),
            ("agx", red, 200.0, NoiseOf::Colour(20.0)),
            ("pbr-neutral", blue, 60.0, NoiseOf::Colour(6.0)),
            ("srgb", red, 100.0, NoiseOf::Grey(3.0)),
            ("srgb", blue, 60.0, NoiseOf::Grey(2.0)),
            ("agx", red, 60.0, NoiseOf::Grey(3.0)),
            ("pbr-neutral", red, 60.0, NoiseOf::Grey(3.0)),
            ("srgb", [0.6, 0.5, 0.4], 40.0, NoiseOf::Tint(3.0)),
            ("srgb", [0.9, 0.5, 0.5], 50.0, NoiseOf::Tint(0.5)),
            ("agx", [0.6, 0.5, 0.4], 40.0, NoiseOf::Tint(3.0)),
            ("pbr-neutral", [0.4, 0.5, 0.4], 20.0, NoiseOf::Tint(1.0)),
        ] {
            let fitted = operator(name, None).unwrap().fit(&SceneGuide::of(&guide), &Viewing::default(), None);
            let hue = gamut::hue(colour).unwrap();
            // A unit of red and green without luminance or blue and yellow, by the definition of the signals.
            let tint = crate::primaries::inverse(&OPPONENT_OF_RGB).unwrap().map(|row| row[1] as f32);
            let (direction, deviation) = match noise {
                NoiseOf::Colour(deviation) => (hue, deviation),
                NoiseOf::Grey(deviation) => ([1.0; 3], deviation),
                NoiseOf::Tint(deviation) => (tint, deviation),
            };
            let signals = |light: &Opponent| [light.achromatic, light.red_green, light.yellow_violet].map(f64::from);
            let (mut weights, mut sums, mut squares) = (0.0, [0.0; 3], [0.0; 3]);
            for step in -1000..=1000 {
                let deviations = f64::from(step) / 250.0;
                let weight = (-0.5 * deviations * deviations).exp();
                let light = std::array::from_fn(|c| hue[c] * mean + direction[c] * (deviations * deviation) as f32);
                let shown = signals(&display_opponent(&*fitted, &display, pixel, light));
                weights += weight;
                for signal in 0..3 {
                    sums[signal] += weight * shown[signal];
                    squares[signal] += weight * shown[signal] * shown[signal];
                }
            }
            let mean_cd_m2 = one(mean);
            let coloured = coloured(fitted, 1, &[colour]);
            let slope = display_chromatic_slope(&*coloured, &display, &mean_cd_m2);
            let of_scene =
                signals(&crate::opponent::opponent(direction)).map(|signal| one((deviation * signal).powi(2) as f32));
            let colours = SceneColours { rgb: &[colour], chromatic_slope: &slope };
            let told = display_opponent_variances(&*coloured, &display, &mean_cd_m2, colours, of_scene.each_ref());
            for signal in 0..3 {
                let truth = (squares[signal] / weights - (sums[signal] / weights).powi(2)).sqrt();
                let told = f64::from(told[signal].get(0, 0)).sqrt();
                // What tints do to luminance, and to each other, is not predicted.
                let is_of_tint = matches!(noise, NoiseOf::Tint(_)) && signal != 1;
                // Where one channel is clipped now and then three points are up to 0.27 off.
                let is_right = (told / truth.max(1e-3) - 1.0).abs() < 0.3 || truth.max(told) < 0.02;
                assert!(is_right || is_of_tint, "{name} {colour:?} {mean} {noise:?} {signal}: {told} for {truth}");
            }
        }
    }

    #[test]
    fn a_negative_variance_does_not_pass_for_none() {
        let display = Display::default();
        let fitted = absolute(&display);
        let of = |variance: f32| {
            [display_variance, chromatic_variance]
                .map(|shown| shown(&*fitted, &display, &one(50.0), &one(variance)).get(0, 0))
        };
        assert_eq!((of(-1e-3), of(f32::NAN)), ([f32::INFINITY; 2], [f32::INFINITY; 2]));
        assert!(of(0.0) == [0.0; 2] && of(-0.0) == [0.0; 2]);
    }

    #[test]
    fn slopes_are_finite() {
        let display = Display::default();
        let fitted = absolute(&display);
        for light in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 0.0] {
            let slope = display_slope(&*fitted, &display, &one(light)).get(0, 0);
            assert!(slope.is_finite(), "{light}: {slope}");
        }
    }

    #[test]
    fn half_difference_clips_like_the_picture() {
        let display = Display::default();
        let fitted = absolute(&display);
        let found = display_half_difference(&*fitted, &display, &one(100.0), &one(3.0)).get(0, 0);
        assert!((found - 3.0).abs() < 1e-3);
        let clipped = display_half_difference(&*fitted, &display, &one(200.0), &one(10.0)).get(0, 0);
        assert!((clipped - 5.0).abs() < 1e-3, "{clipped}");
    }

    #[test]
    fn broken_input_is_infinitely_visible_or_left_out() {
        let display = Display::default();
        let fitted = absolute(&display);
        assert!(display_variance(&*fitted, &display, &one(f32::NAN), &one(1.0)).get(0, 0).is_infinite());
        assert!(display_variance(&*fitted, &display, &one(1.0), &Plane::filled(2, 1, 1.0)).get(0, 0).is_infinite());
        assert!(display_variance(&*fitted, &display, &one(0.0), &one(1.0)).get(0, 0).is_finite());
        assert!(display_variance(&*fitted, &display, &one(1e-30), &one(1e30)).get(0, 0).is_finite());
    }
}
