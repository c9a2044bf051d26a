//! A picture with alpha over white: what covers a pixel hides light there, and noise of how much it hides is noise of
//! light.
//!
//! So a picture with alpha is judged over white as well: before black a dark object has no noise at its edges whatever
//! its alpha is. Measured of a black ball out of focus: judged before black alone it is done at 16 samples a pixel, and
//! shows 4.1 times its threshold over white, or over grey, by which thresholds rise and fall as the noise does. To
//! visibility 1 over white it takes 222, and shows 0.7 of it over any ground between.

use super::super::settings::LoopSettings;
use super::steps::{Guide, Scatter, Thresholds, found_thresholds};
use super::{JudgeError, LookFor, without_noise};
use crate::film::Film;
use fechner_perception::Plane;
use fechner_perception::tone::FittedTone;
use fechner_perception::visibility::MeasuredError;

/// What can be seen over white, without importance.
#[derive(Debug)]
pub(super) struct OverWhite {
    thresholds: Thresholds,
    visibility: Plane,
    /// Luminance variance of one sample, (cd/m²)²: pooled.
    pooled_per_sample: Plane,
    /// Luminance variance of one sample, (cd/m²)², as each half decides by it; `None` where the look is for no plan.
    per_sample_of_halves: Option<[Plane; 2]>,
    /// Half of what the halves' coverage differs by, as light of the ground, cd/m².
    ground_half_difference: Plane,
}

impl OverWhite {
    /// What is seen of a film over white. `guide_before_black`: the guide's luminance on the display, cd/m².
    /// `colour_scale`: displayed over scene variance of luminance; `None` where the colours are denoised, and alpha
    /// alone is noisy.
    pub(super) fn of(
        film: &Film,
        guide: &Guide<'_>,
        guide_before_black: &Plane,
        colour_scale: Option<&Plane>,
        tone: &dyn FittedTone,
        settings: &LoopSettings,
        look_for: LookFor,
    ) -> Result<Self, JudgeError> {
        let display = &settings.viewing.display;
        let white_cd_m2 = display.luminance_cd_m2(1.0);
        let ground_cd_m2 = white_cd_m2 - display.luminance_cd_m2(0.0);
        let no_colour = Plane::filled(guide_before_black.width(), guide_before_black.height(), 0.0);
        let over = film.over_ground(colour_scale.unwrap_or(&no_colour).values(), ground_cd_m2);
        let scatter = Scatter::of_display_light(&over);
        let displayed_guide = guide_before_black.combined(&guide_coverage(film), |light, coverage| {
            (light + (1.0 - coverage) * ground_cd_m2 as f32).min((white_cd_m2 as f32).max(light))
        });
        let noise = scatter.luminance_variance_of_mean();
        let thresholds = found_thresholds(guide, &displayed_guide, tone, &noise, settings)?;
        let pooled_per_sample = scatter.pooled_per_sample(&thresholds.in_bands, None);
        let of_mean = scatter.of_mean(&pooled_per_sample);
        let visibility = thresholds.visibility(&of_mean);
        let per_sample_of_halves = (look_for == LookFor::Plan)
            .then(|| scatter.per_sample_of_halves(&over, [scatter.scales(); 2], &thresholds.in_bands, None));
        let ground_half_difference = ground_half_difference(film, ground_cd_m2);
        Ok(Self { thresholds, visibility, pooled_per_sample, per_sample_of_halves, ground_half_difference })
    }

    /// Visibility that the variance predicts.
    pub(super) fn visibility(&self) -> &Plane {
        &self.visibility
    }

    /// Takes, of variances of one sample that show before black, as much as the worse of the one that is given and that
    /// over white. `own_allowed_cd_m2`: thresholds before black, cd/m².
    pub(super) fn worse_per_sample(&self, own_allowed_cd_m2: &Plane) -> WorsePerSample<'_> {
        let ratio = |own: f32, white: f32| (own / white) * (own / white);
        WorsePerSample { over_white: self, ratio: own_allowed_cd_m2.combined(&self.thresholds.limits(), ratio) }
    }

    /// What the halves' difference shows, before black or over white. `displayed`: half the difference before black,
    /// cd/m².
    pub(super) fn worse_error(&self, own: MeasuredError, displayed: &Plane) -> MeasuredError {
        let over_white = displayed.combined(&self.ground_half_difference, |light, ground| light + ground);
        let white = self.thresholds.in_bands.measured_error(&over_white);
        MeasuredError {
            visibility: own.visibility.combined(&white.visibility, f32::max),
            amplitude: own.amplitude.combined(&white.amplitude, f32::max),
        }
    }
}

/// What [`OverWhite::worse_per_sample`] compares.
pub(super) struct WorsePerSample<'a> {
    over_white: &'a OverWhite,
    /// Ratio of squared thresholds, before black over white.
    ratio: Plane,
}

impl WorsePerSample<'_> {
    /// The worse of a pooled variance of one sample before black and that over white, (cd/m²)² before black.
    pub(super) fn pooled(&self, own: &Plane) -> Plane {
        self.worse(own, &self.over_white.pooled_per_sample)
    }

    /// The worse of the variances that each half decides by and those over white, (cd/m²)² before black; `None` where
    /// the look was for no plan.
    pub(super) fn of_halves(&self, [own_a, own_b]: [Plane; 2]) -> Option<[Plane; 2]> {
        let [white_a, white_b] = self.over_white.per_sample_of_halves.as_ref()?;
        Some([self.worse(&own_a, white_a), self.worse(&own_b, white_b)])
    }

    fn worse(&self, own: &Plane, white: &Plane) -> Plane {
        own.combined(&white.combined(&self.ratio, |variance, ratio| variance * ratio), f32::max)
    }
}

fn ground_half_difference(film: &Film, ground_cd_m2: f64) -> Plane {
    film.plane(|pixel| {
        // Less coverage is more light.
        let uncovered = film.halves(pixel).half_difference(|half| -f64::from(half.coverage()));
        uncovered as f32 * ground_cd_m2 as f32
    })
}

/// Coverage without its noise, which would mask itself.
fn guide_coverage(film: &Film) -> Plane {
    let coverage = film.coverage();
    let variance = film.plane(|pixel| {
        let covered = f64::from(coverage[pixel]);
        (covered * (1.0 - covered) * film.variance_share(pixel)) as f32
    });
    let rgb: Vec<[f32; 3]> = coverage.iter().map(|&covered| [covered; 3]).collect();
    // Coverage is no light that falls on a surface.
    let albedo = vec![[1.0; 3]; coverage.len()];
    let found = without_noise(film, &rgb, &variance, &albedo);
    film.plane(|pixel| found[pixel][0].clamp(0.0, 1.0))
}
