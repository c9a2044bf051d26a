//! What the display makes of the noise of samples. What the eye sees of it is left to the thresholds.

use super::super::settings::LoopSettings;
use super::super::statistics::{DifferenceOnDisplay, MAX_FACTOR, by_channel};
use crate::film::{CHANNELS, Film, Halves};
use fechner_perception::opponent::Opponent;
use fechner_perception::seen::{self, NoiseShown, SceneColours};
use fechner_perception::tone::{FittedTone, Pixel, SceneLight};
use fechner_perception::{PIXELS_PER_TASK, Plane};
use rayon::prelude::*;

/// Variance of each pixel's mean over that of one sample: [`Film::variance_share`].
pub fn variance_shares(film: &Film) -> Plane {
    film.plane(|pixel| film.variance_share(pixel) as f32)
}

/// What the display makes of noise.
pub(super) struct NoiseOnDisplay<'a> {
    /// [`variance_shares`].
    pub(super) shares: &'a Plane,
    /// Scene colours of the guide.
    pub(super) colours: SceneColours<'a>,
    pub(super) tone: &'a dyn FittedTone,
    pub(super) settings: &'a LoopSettings,
    /// Multiplies every variance.
    pub(super) inflation: f64,
}

impl NoiseOnDisplay<'_> {
    /// Displayed over scene variance by channel about a luminance, cd/m². `variance`: of one sample of a pixel
    /// by channel, in scene units.
    pub(super) fn scales(
        &self,
        light: &Plane,
        variance: impl Fn(usize) -> [f64; CHANNELS] + Sync,
    ) -> [Plane; CHANNELS] {
        let nits_squared = self.nits_squared();
        self.of_displayed(light, variance, |scene, shown| {
            match f64::from(shown) / f64::from(scene) * nits_squared {
                _ if scene == 0.0 => 0.0,
                scale if scale.is_finite() => scale as f32,
                // Nobody can say how it looks, least of all that it cannot be seen.
                _ => f32::INFINITY,
            }
        })
    }

    fn nits_squared(&self) -> f64 {
        self.settings.nits_per_unit * self.settings.nits_per_unit * self.inflation
    }

    /// `of` the mean's variance in the scene and as displayed, (cd/m²)², of each pixel by channel. Arguments as of
    /// [`Self::scales`].
    fn of_displayed(
        &self,
        light: &Plane,
        variance: impl Fn(usize) -> [f64; CHANNELS] + Sync,
        of: impl Fn(f32, f32) -> f32 + Sync,
    ) -> [Plane; CHANNELS] {
        let shown = NoiseShown::new(self.tone, &self.settings.viewing.display);
        let nits_squared = self.nits_squared();
        let width = light.width();
        planes_of(width, light.values().len(), |index| {
            let share = f64::from(self.shares.values()[index]);
            let scene = variance(index).map(|variance| (variance * share * nits_squared) as f32);
            let pixel = Pixel { x: index % width, y: index / width };
            let shown = shown.opponent_variances(pixel, light.values()[index], self.colours.at(index), scene);
            std::array::from_fn(|c| of(scene[c], shown[c]))
        })
    }
}

/// Planes of what is found for each of so many pixels, by channel.
fn planes_of(width: usize, pixels: usize, of: impl Fn(usize) -> [f32; CHANNELS] + Sync) -> [Plane; CHANNELS] {
    let found: Vec<_> = (0..pixels).into_par_iter().with_min_len(PIXELS_PER_TASK).map(&of).collect();
    by_channel(|c| Plane::from_fn(width, pixels / width.max(1), |x, y| found[y * width + x][c]))
}

/// Displayed variance over scene variance of each pixel, by channel, at the size that its variance has now: what
/// the display makes of a pixel's own noise, before any pooling. From scene units. `rgb_cd_m2`: the picture
/// whose luminance `light` is.
pub fn display_scale(
    film: &Film,
    light: &SceneLight,
    rgb_cd_m2: &[[f32; 3]],
    tone: &dyn FittedTone,
    settings: &LoopSettings,
) -> [Plane; CHANNELS] {
    let luminance = light.luminance_cd_m2();
    let chromatic_slope = &seen::display_chromatic_slope(tone, &settings.viewing.display, luminance);
    let colours = SceneColours { rgb: rgb_cd_m2, chromatic_slope };
    NoiseOnDisplay { shares: &variance_shares(film), colours, tone, settings, inflation: 1.0 }
        .scales(luminance, |pixel| film.halves(pixel).sample_variances())
}

/// Most times of what scatter says that halves may differ by, where the operator knows the picture's colours: how noise
/// of single channels goes together no variances tell. Measured of a red wall two stops over by `pbr-neutral`, asked
/// for 1: it ends at 1.56 with the others' most, at 1.47 with 2 and at 1.23 with this.
const MAX_FACTOR_OF_COLOURS: f32 = 4.0;

/// What the halves differ by as displayed, by channel, and what independent samples about the guide's luminance would.
/// `guide`: that, cd/m². `colours`: of the guide.
///
/// Means of a half scatter by more than the picture's, whose noise this is to correct: above a clip they reach below it
/// more often, so that what is taken off is rather too little.
pub(super) fn difference_on_display(
    film: &Film,
    guide: &Plane,
    colours: SceneColours<'_>,
    tone: &dyn FittedTone,
    settings: &LoopSettings,
) -> DifferenceOnDisplay {
    // A half's variance, which is twice the mean's; of a half without samples nothing differs.
    let of_halves = film.plane(|pixel| match film.halves(pixel) {
        Halves::Both(_) => 2.0 * film.variance_share(pixel) as f32,
        Halves::Only(_) => 0.0,
    });
    let noise = NoiseOnDisplay { shares: &of_halves, colours, tone, settings, inflation: 1.0 };
    let (squared, expected) = rayon::join(
        || squared_differences(film, guide.width(), tone, settings),
        || noise.of_displayed(guide, |pixel| film.halves(pixel).sample_variances(), |_, displayed| 0.5 * displayed),
    );
    let most_factor = if tone.without_colours().is_none() { MAX_FACTOR } else { MAX_FACTOR_OF_COLOURS };
    DifferenceOnDisplay { squared, expected, most_factor }
}

/// Square of half of what the halves differ by as displayed, by channel, (cd/m²)²; 0 where one of them has no samples.
pub(super) fn squared_differences(
    film: &Film,
    width: usize,
    tone: &dyn FittedTone,
    settings: &LoopSettings,
) -> [Plane; CHANNELS] {
    planes_of(width, film.pixel_count(), |index| {
        let Halves::Both(both) = film.halves(index) else { return [0.0; CHANNELS] };
        let pixel = Pixel { x: index % width, y: index / width };
        let [a, b] = both.map(|half| {
            let rgb_cd_m2 = half.mean.map(|channel| (settings.nits_per_unit * channel) as f32);
            seen::display_opponent(tone, &settings.viewing.display, pixel, rgb_cd_m2)
        });
        let half = |of: fn(&Opponent) -> f32| 0.5 * (of(&a) - of(&b));
        [half(|shown| shown.achromatic), half(|shown| shown.red_green), half(|shown| shown.yellow_violet)]
            .map(|difference| difference * difference)
    })
}
