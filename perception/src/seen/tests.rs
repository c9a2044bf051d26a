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
    let [_, red_green, _] = display_opponent_variances(fitted, display, mean, grey, [&one(0.0), variance, &one(0.0)]);
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
    let spread = |index: usize, step: usize| ((index * step % COLOURS) as f32 / COLOURS as f32 - 0.5) * 12.0_f32.sqrt();
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
        let [_, told, _] = display_opponent_variances(&*fitted, &display, &mean_cd_m2, colours, of_scene.each_ref());
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
