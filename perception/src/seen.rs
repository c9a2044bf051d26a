//! Error as it will be seen: through a fitted tone operator, on a display.
//!
//! A pixel's error is pushed through the operator by itself, with what the eye is adapted to at that pixel; how a local
//! operator would spread it to other pixels is ignored.

use crate::display::Display;
use crate::plane::Plane;
use crate::tone::{FittedTone, Pixel};

/// What the display shows, cd/m², for scene luminance in cd/m².
#[must_use]
pub fn display_luminance(fitted: &dyn FittedTone, display: &Display, scene_luminance: &Plane) -> Plane {
    let shown = Shown { fitted, display };
    Plane::from_fn(scene_luminance.width(), scene_luminance.height(), |x, y| {
        shown.cd_m2(Pixel { x, y }, scene_luminance.get(x, y))
    })
}

/// The same for one pixel.
#[must_use]
pub fn display_luminance_at(fitted: &dyn FittedTone, display: &Display, pixel: Pixel, scene_cd_m2: f32) -> f32 {
    Shown { fitted, display }.cd_m2(pixel, scene_cd_m2)
}

/// How much the displayed luminance changes with scene luminance around `scene_luminance` (cd/m²): the slope of the chord
/// from 5 % below to 5 % above. Noise that is to stay without bias may not go through the operator itself, which is bent.
/// Finite everywhere: luminance counts as at least 1e-4 and at most 1e30 cd/m², NaN as the least.
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
/// Three-point quadrature of the operator, not its derivative: just above a clip the derivative is 0, and the noise is
/// not. Where M ≥ √3 σ the points are those of Gauss and Hermite (M and M ± √3 σ); nearer to black, where light cannot
/// go below 0, the lower point stays at 0 and the upper one moves out to M + 3σ²/M, which keeps mean and variance, and the
/// square of what M + σ shows beside M has half of the say: where few samples brought the light, the variance is theirs, and
/// σ is how far the mean is off by them, not 3σ²/M, which may be far above a clip. An operator that is linear over the
/// points gives exactly its slope² · σ².
///
/// Of a point lamp 6 cm below a ceiling 16 samples a pixel leave noise of visibility 19.7 ± 2.0 by the thresholds of the
/// converged picture, 14 by its comparison: by the three points alone it was told as 10.8, by M + σ alone as 26.2, and is
/// as 19.9 (`benches/results/sampling.md`).
///
/// Where normal noise (√3 σ ≤ M) reaches over a clip of the display, three points see too much of it or nothing at all; there the
/// operator is asked at 21 points, −4σ to 4σ.
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
        shown.variance(pixel, f64::from(mean.max(0.0)), f64::from(variance))
    })
}

/// Variance of a chromatic signal as displayed, (cd/m²)², for one of variance `variance` ((cd/m²)², of the mean) on scene
/// luminance `mean` (cd/m²), by what the operator leaves of a faint tint on a grey
/// ([`FittedTone::chromatic_slope_at`]). What a display's clip of single channels hides is not taken off.
///
/// Pixels that are not finite, or of negative variance, get infinity; so does every pixel when the planes differ in size.
#[must_use]
pub fn display_chromatic_variance(fitted: &dyn FittedTone, display: &Display, mean: &Plane, variance: &Plane) -> Plane {
    let shown = Shown { fitted, display };
    by_pixel(mean, variance, f32::INFINITY, |pixel, mean, variance| {
        if variance < 0.0 { f32::INFINITY } else { shown.chromatic_slope(pixel, mean).powi(2) * variance }
    })
}

/// How much a chromatic signal as displayed is of that of the scene: see [`display_chromatic_variance`].
#[must_use]
pub fn display_chromatic_slope(fitted: &dyn FittedTone, display: &Display, scene_luminance: &Plane) -> Plane {
    let shown = Shown { fitted, display };
    Plane::from_fn(scene_luminance.width(), scene_luminance.height(), |x, y| {
        shown.chromatic_slope(Pixel { x, y }, scene_luminance.get(x, y))
    })
}

/// Half the difference that the two halves make on the display, cd/m²: (tone(M + D) − tone(M − D)) / 2 for the mean M and
/// the half difference D = (A − B) / 2, both scene cd/m².
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

/// `of` two planes' values at each pixel; `else_value` where they, or what becomes of them, are not finite. Planes of different
/// sizes give infinity.
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

/// Standard deviations from the mean beyond which normal noise is let go: 4 lose 0.1 % of the variance.
const FARTHEST: f64 = 4.0;

/// A display behind an operator.
struct Shown<'a> {
    fitted: &'a dyn FittedTone,
    display: &'a Display,
}

impl Shown<'_> {
    fn cd_m2(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let relative = self.fitted.relative_luminance_at(pixel, scene_cd_m2.max(0.0));
        self.display.luminance_cd_m2(f64::from(relative)) as f32
    }

    fn chromatic_slope(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let span_cd_m2 = (self.display.white_cd_m2 - self.display.black_cd_m2) as f32;
        span_cd_m2 * self.fitted.chromatic_slope_at(pixel, scene_cd_m2)
    }

    fn variance(&self, pixel: Pixel, mean: f64, variance: f64) -> f32 {
        if variance <= 0.0 {
            return 0.0;
        }
        // Distances of the outer points from the mean. At M = √3 σ both pairs agree.
        let gauss = (3.0 * variance).sqrt();
        let (below, above) = if mean >= gauss { (gauss, gauss) } else { (mean, (3.0 * variance / mean).min(1e30)) };
        if below <= 0.0 || !above.is_finite() {
            // No light on average, yet noise: only a broken input has that. Take the noise as it stands.
            let swing = f64::from(self.cd_m2(pixel, gauss as f32) - self.cd_m2(pixel, 0.0));
            return (swing * swing / 3.0) as f32;
        }
        let light = |scene: f64| self.fitted.relative_luminance_at(pixel, scene as f32);
        let lights = [light(mean - below), light(mean), light(mean + above)];
        if mean >= gauss && self.clip_is_in_reach(pixel, lights, mean, variance.sqrt()) {
            return self.clipped_variance(pixel, mean, variance.sqrt());
        }
        let weight_below = variance / (below * (below + above));
        let weight_above = variance / (above * (below + above));
        let [low, center, high] = lights.map(|relative| self.display.luminance_cd_m2(f64::from(relative)));
        // As the planes have it: in single precision.
        let [low, center, high] = [low, center, high].map(|cd_m2| f64::from(cd_m2 as f32));
        let (low, high) = (low - center, high - center);
        let offset = weight_below * low + weight_above * high;
        let spread = (weight_below * low * low + weight_above * high * high - offset * offset).max(0.0);
        if mean >= gauss {
            return spread as f32;
        }
        let swing = f64::from(self.cd_m2(pixel, (mean + variance.sqrt()) as f32)) - center;
        (0.5 * (spread + swing * swing)) as f32
    }

    /// Whether normal noise about `mean` reaches over a clip of the display. `lights`: at √3 σ below the mean, there, and above.
    fn clip_is_in_reach(&self, pixel: Pixel, lights: [f32; 3], mean: f64, deviation: f64) -> bool {
        // An operator that clips by itself may round.
        const WHITE: f32 = 1.0 - 1e-6;
        let [low, center, high] = lights;
        let at = |scene: f64| self.fitted.relative_luminance_at(pixel, scene.max(0.0) as f32);
        if low >= WHITE {
            // As bright as it gets: only the noise's tail may say otherwise. Without asking for most of them.
            at(mean - FARTHEST * deviation) < WHITE
        } else if high <= 0.0 {
            at(mean + FARTHEST * deviation) > 0.0
        } else {
            // On goes the operator as it went from the mean: near enough, and two questions less for every pixel.
            let further = (FARTHEST / 3.0_f64.sqrt()) as f32;
            center + further * (high - center) >= WHITE || low <= 0.0 && mean > 1.001 * 3.0_f64.sqrt() * deviation
        }
    }

    /// Variance as displayed of normal noise about `mean`, by the midpoint rule; no light is below 0.
    fn clipped_variance(&self, pixel: Pixel, mean: f64, deviation: f64) -> f32 {
        const STEPS: i32 = 10;
        let (mut weights, mut sum, mut squares) = (0.0, 0.0, 0.0);
        let center = f64::from(self.cd_m2(pixel, mean as f32));
        for step in -STEPS..=STEPS {
            let deviations = FARTHEST * f64::from(step) / f64::from(STEPS);
            let weight = (-0.5 * deviations * deviations).exp();
            let shown = f64::from(self.cd_m2(pixel, (mean + deviations * deviation) as f32)) - center;
            weights += weight;
            sum += weight * shown;
            squares += weight * shown * shown;
        }
        (squares / weights - (sum / weights).powi(2)).max(0.0) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::Viewing;
    use crate::tone::{SceneGuide, operator};

    fn absolute(display: &Display) -> Box<dyn FittedTone> {
        let guide = Plane::filled(1, 1, 1.0);
        let viewing = Viewing::of(display.clone());
        operator("absolute", None).unwrap().fit(&SceneGuide::of(&guide), &viewing, None)
    }

    fn one(value: f32) -> Plane {
        Plane::filled(1, 1, value)
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

    /// One sample in 200 brings all light, and 16 are taken: what each pixel's own variance makes of it, on the mean of all, is what the means of
    /// pixels show, or half of that where the three points reach above white, which alone said nothing.
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

    /// Means from far below the clip at 200 cd/m² to above it, where three points give 0 from 1.8 σ on; and at black, 0.2 cd/m².
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

    #[test]
    fn a_negative_variance_does_not_pass_for_none() {
        let display = Display::default();
        let fitted = absolute(&display);
        let of = |variance: f32| {
            [display_variance, display_chromatic_variance]
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
