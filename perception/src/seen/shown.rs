//! One pixel's noise through operator and display: the operator asked at three points, or at 21 where it clips.

use crate::display::Display;
use crate::opponent::{Opponent, opponent};
use crate::photometry::luminance;
use crate::tone::{FittedTone, Pixel};
use std::sync::LazyLock;

/// Standard deviations from the mean beyond which normal noise is let go: 4 lose 0.1 % of the variance.
const FARTHEST: f64 = 4.0;

/// Points of normal noise on either side of the mean.
const STEPS: usize = 10;

/// Deviations of normal noise and what they weigh: the midpoint rule. Made once for all pixels: exponentials for each
/// would be a twelfth of the time that noise on the display takes.
static NORMAL_POINTS: LazyLock<[(f64, f64); 2 * STEPS + 1]> = LazyLock::new(|| {
    std::array::from_fn(|step| {
        let deviations = FARTHEST * (step as f64 - STEPS as f64) / STEPS as f64;
        (deviations, (-0.5 * deviations * deviations).exp())
    })
});

/// Display light that is white: an operator that clips by itself may round.
const WHITE: f32 = 1.0 - 1e-6;

/// A display behind an operator.
pub(super) struct Shown<'a> {
    pub(super) fitted: &'a dyn FittedTone,
    pub(super) display: &'a Display,
}

impl Shown<'_> {
    pub(super) fn cd_m2(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        self.emitted_cd_m2(self.fitted.relative_luminance_at(pixel, scene_cd_m2.max(0.0)))
    }

    /// In single precision, as the planes have it.
    fn emitted_cd_m2(&self, relative: f32) -> f32 {
        self.display.luminance_cd_m2(f64::from(relative)) as f32
    }

    pub(super) fn chromatic_slope(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        self.span_cd_m2() * self.fitted.chromatic_slope_at(pixel, scene_cd_m2)
    }

    pub(super) fn opponent(&self, pixel: Pixel, rgb_cd_m2: [f32; 3]) -> Opponent {
        let span_cd_m2 = self.span_cd_m2();
        opponent(self.fitted.map_rgb_at(pixel, rgb_cd_m2).map(|channel| span_cd_m2 * channel))
    }

    fn span_cd_m2(&self) -> f32 {
        (self.display.white_cd_m2 - self.display.black_cd_m2) as f32
    }

    /// A pixel with noisy light, grey.
    pub(super) fn pixel(&self, pixel: Pixel, noise: Noise) -> NoisyPixel<'_> {
        let points = Points::of(noise, |scene| self.relative(pixel, scene));
        NoisyPixel { shown: self, pixel, noise, hue: None, points }
    }

    /// A pixel with noisy light of a colour, `hue` at a luminance of 1 cd/m², that the operator shows as something else
    /// than a grey of its luminance; and what its three points show.
    pub(super) fn coloured_pixel(
        &self,
        pixel: Pixel,
        noise: Noise,
        hue: [f32; 3],
    ) -> (NoisyPixel<'_>, Option<Points<Opponent>>) {
        let shown = Points::of(noise, |scene| self.opponent(pixel, hue.map(|channel| channel * scene as f32)));
        let points = shown.map(|points| points.map(|shown| shown.achromatic / self.span_cd_m2()));
        (NoisyPixel { shown: self, pixel, noise, hue: Some(hue), points }, shown)
    }

    /// Variances of luminance, red–green and yellow–violet as displayed, (cd/m²)², where grey light comes and goes
    /// over a colour.
    pub(super) fn variances_along_grey(&self, pixel: Pixel, noise: Noise, hue: [f32; 3]) -> [f32; 3] {
        let light = |scene: f64| {
            let grey = scene - noise.mean;
            self.opponent(pixel, hue.map(|channel| (noise.mean * f64::from(channel) + grey).max(0.0) as f32))
        };
        Points::of(noise, light).map_or([0.0; 3], |shown| variances_of_opponent(&shown, noise))
    }

    /// Variance of the displayed luminance, (cd/m²)², where the operator multiplies by one number and nothing of the
    /// noise reaches what the display cannot show, on a colour of which no channel does: the slope's square times the
    /// scene's, of which all that [`NoisyPixel`] asks at three points and more comes to the same. `None` elsewhere.
    /// `tints`: variances of both chromatic signals, of which none may reach beyond its room, `rooms_cd_m2` of black.
    pub(super) fn variance_within_display(
        &self,
        noise: Noise,
        rgb: [f32; 3],
        tints: [f32; 2],
        rooms_cd_m2: [f64; 2],
    ) -> Option<f32> {
        let scale = self.fitted.relative_per_cd_m2()?;
        let Noise { mean, variance } = noise;
        let is_normal = noise.is_normal();
        let reach = if is_normal { FARTHEST * noise.deviation() } else { 3.0 * variance / mean };
        let brightest = scale * (mean + reach);
        let strength = luminance(rgb);
        let largest = if strength > 0.0 { rgb.into_iter().fold(0.0, f32::max) / strength } else { 1.0 };
        let fits = |signal: usize| f64::from(tints[signal]) <= ((1.0 - brightest) * rooms_cd_m2[signal]).powi(2);
        let is_within =
            brightest < f64::from(WHITE) && brightest * f64::from(largest) <= 1.0 && (!is_normal || fits(0) && fits(1));
        let slope = f64::from(self.span_cd_m2()) * scale;
        is_within.then_some((slope * slope * variance) as f32)
    }

    fn relative(&self, pixel: Pixel, scene_cd_m2: f64) -> f32 {
        self.fitted.relative_luminance_at(pixel, scene_cd_m2.max(0.0) as f32)
    }
}

/// A pixel's scene luminance.
#[derive(Clone, Copy)]
pub(super) struct Noise {
    /// Mean of the light, cd/m², at least 0.
    pub(super) mean: f64,
    /// Variance of that mean, (cd/m²)², at least 0.
    pub(super) variance: f64,
}

impl Noise {
    /// Distance of the outer points of Gauss and Hermite from the mean, cd/m².
    fn gauss(self) -> f64 {
        (3.0 * self.variance).sqrt()
    }

    /// Whether these points are light.
    fn is_normal(self) -> bool {
        self.mean >= self.gauss()
    }

    fn deviation(self) -> f64 {
        self.variance.sqrt()
    }
}

/// Three points that have the mean and the variance of noisy light, and what the operator makes of them.
#[derive(Clone, Copy)]
pub(super) struct Points<T> {
    /// Distances of the outer points from the mean, cd/m². At M = √3 σ both kinds of points agree.
    below: f64,
    above: f64,
    /// Below, at and above the mean.
    shown: [T; 3],
    /// At a standard deviation above it, where few samples bring the light.
    of_few: Option<T>,
}

impl<T: Copy> Points<T> {
    /// `None` without noise; or without light on average and yet noise, which only a broken input has.
    fn of(noise: Noise, shown: impl Fn(f64) -> T) -> Option<Self> {
        let Noise { mean, variance } = noise;
        let gauss = noise.gauss();
        let (below, above) = if noise.is_normal() { (gauss, gauss) } else { (mean, (3.0 * variance / mean).min(1e30)) };
        let has_points = below > 0.0 && above.is_finite();
        has_points.then(|| Self {
            below,
            above,
            of_few: (!noise.is_normal()).then(|| shown(mean + noise.deviation())),
            shown: [mean - below, mean, mean + above].map(shown),
        })
    }

    fn map<U>(self, to: impl Fn(T) -> U) -> Points<U> {
        let Self { below, above, shown, of_few } = self;
        Points { below, above, of_few: of_few.map(&to), shown: shown.map(to) }
    }

    /// Variance of something that is shown, by these points alone. `noise`: of which they are.
    fn spread(&self, noise: Noise, of: impl Fn(T) -> f32) -> f64 {
        let Self { below, above, .. } = *self;
        let outer = [below, above].map(|distance| noise.variance / (distance * (below + above)));
        let weights = [outer[0], 1.0 - outer[0] - outer[1], outer[1]];
        let shown = self.shown.map(|shown| f64::from(of(shown)));
        variance_of([0, 1, 2].map(|point| (weights[point], shown[point])))
    }

    /// Variance of something that is shown, of which half is what a standard deviation shows where few samples bring
    /// the light: see [`super::display_variance`].
    fn variance(&self, noise: Noise, of: impl Fn(T) -> f32) -> f64 {
        let spread = self.spread(noise, &of);
        match self.of_few {
            None => spread,
            Some(of_few) => {
                let swing = f64::from(of(of_few)) - f64::from(of(self.shown[1]));
                0.5 * (spread + swing * swing)
            }
        }
    }
}

/// Variance of values, each behind what it weighs.
fn variance_of<const POINTS: usize>(weighted: [(f64, f64); POINTS]) -> f64 {
    let total: f64 = weighted.iter().map(|(weight, _)| weight).sum();
    let mean = weighted.iter().map(|(weight, value)| weight * value).sum::<f64>() / total;
    weighted.iter().map(|(weight, value)| weight * (value - mean) * (value - mean)).sum::<f64>() / total
}

/// Variances of luminance, red–green and yellow–violet, (cd/m²)², of a colour whose light is noisy.
pub(super) fn variances_of_opponent(shown: &Points<Opponent>, noise: Noise) -> [f32; 3] {
    OPPONENT_SIGNALS.map(|signal| shown.variance(noise, signal) as f32)
}

const OPPONENT_SIGNALS: [fn(Opponent) -> f32; 3] =
    [|shown| shown.achromatic, |shown| shown.red_green, |shown| shown.yellow_violet];

/// A pixel with noisy light behind operator and display.
pub(super) struct NoisyPixel<'a> {
    shown: &'a Shown<'a>,
    pixel: Pixel,
    noise: Noise,
    /// At a luminance of 1 cd/m²; a grey's where there is none.
    hue: Option<[f32; 3]>,
    points: Option<Points<f32>>,
}

impl NoisyPixel<'_> {
    /// Variance of the displayed luminance, (cd/m²)²: see [`super::display_variance`].
    pub(super) fn variance(&self) -> f32 {
        if self.noise.variance <= 0.0 {
            return 0.0;
        }
        let Some(points) = &self.points else {
            // Take the noise as it stands.
            let swing = self.cd_m2(self.noise.gauss()) - self.cd_m2(0.0);
            return (swing * swing / 3.0) as f32;
        };
        if self.noise.is_normal() && self.clip_is_in_reach(points.shown) {
            return self.clipped_variance();
        }
        points.variance(self.noise, |relative| self.shown.emitted_cd_m2(relative)) as f32
    }

    /// How much of the variances of both chromatic signals, `unbounded` (cd/m²)², fits the display: at most the
    /// square of the room that each luminance leaves for a tint. `rooms_cd_m2`: of black. Nothing is taken off where
    /// few samples bring the light: of a caustic at 2.5 times white most pixels are below white. Measured there:
    /// three points, which say that one in five is below, leave a third of what shows.
    pub(super) fn within_rooms(&self, unbounded: [f32; 2], rooms_cd_m2: [f64; 2]) -> [f32; 2] {
        let fits = |relative: f32| -> [f64; 2] {
            let share = f64::from((1.0 - relative).max(0.0));
            std::array::from_fn(|signal| f64::from(unbounded[signal]).min((share * rooms_cd_m2[signal]).powi(2)))
        };
        let at_one = |relative: f32| fits(relative).map(|variance| variance as f32);
        let is_bright = match &self.points {
            Some(points) => self.noise.is_normal() && at_one(points.shown[2]) != unbounded,
            None => self.noise.variance <= 0.0,
        };
        if !is_bright || !self.shown.fitted.keeps_luminance() {
            return unbounded;
        }
        if self.points.is_none() {
            return at_one(self.relative(self.noise.mean));
        }
        if self.is_all_white() {
            return [0.0; 2];
        }
        let (mut weights, mut sums) = (0.0, [0.0; 2]);
        for (scene, weight) in self.normal_points() {
            weights += weight;
            sums.iter_mut().zip(fits(self.relative(scene))).for_each(|(sum, fits)| *sum += weight * fits);
        }
        sums.map(|sum| (sum / weights) as f32)
    }

    /// Variances of red–green and yellow–violet as displayed, (cd/m²)², where noise of luminance brightens and
    /// darkens a colour, linear Rec. 709 RGB of any strength, that the display then shows paler and less so. 0 where
    /// the colour fits the display at all points, or is white at all of them.
    pub(super) fn variances_of_paling(&self, rgb: [f32; 3]) -> [f32; 2] {
        let strength = luminance(rgb);
        let (Some(points), true) = (&self.points, strength > 0.0 && strength.is_finite()) else { return [0.0; 2] };
        let largest = rgb.into_iter().fold(0.0, f32::max) / strength;
        let is_white = self.shown.fitted.keeps_luminance() && points.shown[0] >= 1.0;
        if points.shown[2] * largest <= 1.0 || is_white {
            return [0.0; 2];
        }
        let (_, shown) = self.shown.coloured_pixel(self.pixel, self.noise, rgb.map(|channel| channel / strength));
        let [_, red_green, yellow_violet] = OPPONENT_SIGNALS;
        shown.map_or([0.0; 2], |shown| [red_green, yellow_violet].map(|signal| shown.spread(self.noise, signal) as f32))
    }

    /// Whether normal noise reaches over a clip of the display. `relative`: below, at and above the mean.
    fn clip_is_in_reach(&self, [low, center, high]: [f32; 3]) -> bool {
        let Noise { mean, .. } = self.noise;
        let deviation = self.noise.deviation();
        if low >= WHITE {
            // As bright as it gets: only the noise's tail may say otherwise. Without asking for most of them.
            self.relative(mean - FARTHEST * deviation) < WHITE
        } else if high <= 0.0 {
            self.relative(mean + FARTHEST * deviation) > 0.0
        } else {
            // On goes the operator as it went from the mean: near enough, and two questions less for every pixel.
            let further = (FARTHEST / 3.0_f64.sqrt()) as f32;
            center + further * (high - center) >= WHITE || low <= 0.0 && mean > 1.001 * self.noise.gauss()
        }
    }

    /// Variance as displayed of normal noise.
    fn clipped_variance(&self) -> f32 {
        variance_of(self.normal_points().map(|(scene, weight)| (weight, self.cd_m2(scene)))) as f32
    }

    /// Luminances of normal noise, cd/m², and what they weigh. No light is below 0, which who asks has to see to.
    fn normal_points(&self) -> [(f64, f64); 2 * STEPS + 1] {
        let (mean, deviation) = (self.noise.mean, self.noise.deviation());
        NORMAL_POINTS.map(|(deviations, weight)| (mean + deviations * deviation, weight))
    }

    /// Whether normal noise leaves nothing below white.
    fn is_all_white(&self) -> bool {
        self.relative(self.noise.mean - FARTHEST * self.noise.deviation()) >= 1.0
    }

    fn relative(&self, scene_cd_m2: f64) -> f32 {
        match self.hue {
            None => self.shown.relative(self.pixel, scene_cd_m2),
            Some(hue) => {
                let shown = self.shown.opponent(self.pixel, hue.map(|channel| channel * scene_cd_m2.max(0.0) as f32));
                shown.achromatic / self.shown.span_cd_m2()
            }
        }
    }

    fn cd_m2(&self, scene_cd_m2: f64) -> f64 {
        f64::from(self.shown.emitted_cd_m2(self.relative(scene_cd_m2)))
    }
}
