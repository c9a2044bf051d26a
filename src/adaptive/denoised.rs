//! The film's denoised picture as it will be seen, what the perception crate says of its noise and of its bias, and where it
//! gets samples.

use super::judge::{JudgeError, Judgement};
use super::plan::{doubling_plan, plan_up_to};
use super::settings::LoopSettings;
use crate::denoise::{DenoisedFilm, Denoiser, denoise_film};
use crate::film::{Estimate, Film, opponent};
use crate::integrator::SamplePlan;
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::csf::ChromaticChannel;
use fechner_perception::denoised::{ChromaticPicture, DenoisedDifferences, DenoisedError, blended, chromatic_error};
use fechner_perception::photometry::luminance;
use fechner_perception::seen;
use fechner_perception::threshold::ThresholdMap;
use fechner_perception::tone::FittedTone;
use rayon::prelude::*;
use std::time::Instant;

/// A denoised picture, judged.
#[derive(Debug)]
pub struct DenoisedPicture {
    /// Linear RGB in cd/m²: denoised, and moved towards the raw mean where that is proven better.
    pub rgb_cd_m2: Vec<[f32; 3]>,
    /// Its luminance.
    pub luminance_cd_m2: Plane,
    /// Half the difference of the denoised halves' luminance as displayed, cd/m².
    pub half_difference: Plane,
    /// What can be seen of its error, without importance.
    pub error: DenoisedError,
}

/// The film's picture and halves, denoised, and how long it took.
pub(super) struct TimedDenoising {
    pub(super) film: DenoisedFilm,
    pub(super) luminance: Plane,
    pub(super) seconds: f64,
}

impl TimedDenoising {
    pub(super) fn of(denoiser: &Denoiser, film: &Film, nits_per_unit: f64) -> Result<Self, JudgeError> {
        let started = Instant::now();
        let denoised = denoise_film(denoiser, film, nits_per_unit)?;
        let luminance = luminance_plane(&denoised.rgb_cd_m2, film.width() as usize);
        Ok(Self { film: denoised, luminance, seconds: started.elapsed().as_secs_f64() })
    }

    /// Looks at it. `thresholds` are the picture's own, `estimate` is the raw mean.
    pub(super) fn judged(
        self,
        film: &Film,
        settings: &LoopSettings,
        tone: &dyn FittedTone,
        thresholds: &ThresholdMap,
        estimate: &Estimate,
    ) -> Result<DenoisedPicture, JudgeError> {
        let width = film.width() as usize;
        let display = &settings.viewing.display;
        let [a, b] = self.film.halves_rgb_cd_m2.each_ref().map(|half| luminance_plane(half, width));
        let [raw_a, raw_b] = Half::BOTH.map(|half| raw_luminance(film, half, settings.nits_per_unit));
        let half_of = |a: &Plane, b: &Plane| a.combined(b, |a, b| 0.5 * (a - b));
        let half_difference = half_of(&a, &b);
        let displayed = seen::display_half_difference(tone, display, &self.luminance, &half_difference);
        // Through the operator itself the raw noise would be bent and bear false witness.
        let slope = seen::display_slope(tone, display, &self.luminance);
        let shown = |scene: &Plane| scene.combined(&slope, |scene, slope| scene * slope);
        let residual = self.luminance.combined(&estimate.luminance_cd_m2, |denoised, raw| denoised - raw);
        let raw_half_difference = half_of(&raw_a, &raw_b);
        let residual_half_difference = half_difference.combined(&raw_half_difference, |denoised, raw| denoised - raw);
        let error = thresholds.denoised_error(&DenoisedDifferences {
            half_difference: &displayed,
            residual: &shown(&residual),
            residual_half_difference: &shown(&residual_half_difference),
        });
        let chromatic = self.chromatic_errors(film, settings, tone, estimate)?;
        let rgb_cd_m2 = blended_rgb(thresholds, &error, self.film.rgb_cd_m2, &estimate.rgb_cd_m2);
        let luminance_cd_m2 = luminance_plane(&rgb_cd_m2, width);
        let error = chromatic.iter().fold(error, DenoisedError::with_channel);
        Ok(DenoisedPicture { rgb_cd_m2, luminance_cd_m2, half_difference: displayed, error })
    }

    /// What can be seen of the error in both chromatic channels; nothing by a model of luminance alone.
    fn chromatic_errors(
        &self,
        film: &Film,
        settings: &LoopSettings,
        tone: &dyn FittedTone,
        estimate: &Estimate,
    ) -> Result<Vec<DenoisedError>, JudgeError> {
        if settings.model.is_some() {
            return Ok(Vec::new());
        }
        let display = &settings.viewing.display;
        let displayed = seen::display_luminance(tone, display, &self.luminance);
        let slope = seen::display_chromatic_slope(tone, display, &self.luminance);
        let width = film.width() as usize;
        let half_of = |[a, b]: [Plane; 2]| a.combined(&b, |a, b| 0.5 * (a - b));
        let of_channel = |(c, channel)| {
            let shown = |signal: &(dyn Fn(usize) -> f64 + Sync)| {
                Plane::from_fn(width, slope.height(), |x, y| (signal(y * width + x) as f32) * slope.get(x, y))
            };
            let of_rgb = |rgb: &[[f32; 3]]| shown(&|pixel| opponent(rgb[pixel].map(f64::from))[c]);
            let of_raw_half =
                |half: Half| shown(&|pixel| settings.nits_per_unit * opponent(film.half_or_other(half, pixel).mean)[c]);
            let picture = of_rgb(&self.film.rgb_cd_m2);
            let half_difference = half_of(self.film.halves_rgb_cd_m2.each_ref().map(|half| of_rgb(half)));
            let raw_half_difference = half_of(Half::BOTH.map(of_raw_half));
            let less_raw = |denoised: &Plane, raw: &Plane| denoised.combined(raw, |denoised, raw| denoised - raw);
            let differences = DenoisedDifferences {
                half_difference: &half_difference,
                residual: &less_raw(&picture, &of_rgb(&estimate.rgb_cd_m2)),
                residual_half_difference: &less_raw(&half_difference, &raw_half_difference),
            };
            let picture = ChromaticPicture { signal: &picture, luminance_cd_m2: &displayed, differences };
            Ok(chromatic_error(channel, &picture, &settings.viewing, settings.frames)?)
        };
        [(1, ChromaticChannel::RedGreen), (2, ChromaticChannel::YellowViolet)].into_par_iter().map(of_channel).collect()
    }
}

/// The denoised picture, moved towards the raw one where that is proven better.
fn blended_rgb(
    thresholds: &ThresholdMap,
    error: &DenoisedError,
    denoised: Vec<[f32; 3]>,
    raw: &[[f32; 3]],
) -> Vec<[f32; 3]> {
    let (width, height) = (thresholds.width(), thresholds.height());
    let channel = |picture: &[[f32; 3]], c: usize| Plane::from_fn(width, height, |x, y| picture[y * width + x][c]);
    let mut picture = denoised;
    for c in 0..3 {
        let Some(moved) = blended(thresholds, error, &channel(&picture, c), &channel(raw, c)) else { break };
        picture.iter_mut().zip(moved.values()).for_each(|(rgb, &value)| rgb[c] = value.max(0.0));
    }
    picture
}

fn luminance_plane(rgb: &[[f32; 3]], width: usize) -> Plane {
    Plane::from_fn(width, rgb.len() / width.max(1), |x, y| luminance(rgb[y * width + x]).max(0.0))
}

/// Luminance of a half, cd/m²; the other half's where it has no samples.
fn raw_luminance(film: &Film, half: Half, nits_per_unit: f64) -> Plane {
    let width = film.width() as usize;
    Plane::from_fn(width, film.height() as usize, |x, y| {
        (nits_per_unit * opponent(film.half_or_other(half, y * width + x).mean)[0]) as f32
    })
}

/// Even counts are kept where the best ones would take more than this share of their samples.
const EVEN_ENOUGH: f64 = 0.95;
/// Counts grow in all by this share of what is there. More, as far as the visibility is from the rung, was no gain (`benches/README.md`).
const GROWTH: f64 = 0.5;
/// What a look at a denoised picture costs, in samples for every pixel, about: three pictures to denoise, three channels to judge.
/// 0.33 s for 192×192 where a sample each takes 0.059 s (`benches/README.md`). A plan is no smaller while its pixels may have so many.
const SAMPLES_OF_A_LOOK: f64 = 6.0;
/// Doublings of a pixel before it is looked at again; early, that is less than a look costs, and all are doubled alike.
const MOST_DOUBLINGS: u32 = 2;
/// Share of the window, over the greatest such share, that must be above the visibility asked for.
const LEAST_BLAME: f32 = 0.1;
/// No pixel's noise counts as more than so many times the picture's mean: variances of few samples are not worth more trust.
const MOST_TIMES_MEAN: f64 = 16.0;

/// More samples for a picture that is denoised, while some of it is above `visibility`; at most `left` in all.
///
/// What raw noise would show at a pixel decides, not what is left of it: that is pooled over a degree and tells no noisy pixel from
/// its neighbours. Counts go as the root of that energy plus the picture's mean. Without the mean, noisy pixels starve the rest: a dark
/// room denoised by Open Image Denoise had JOD 9.52 at 256 samples a pixel where even counts have 9.74, with it 9.74; at 32 samples 9.50
/// and 9.55, even 9.44 (`benches/README.md`).
pub(super) fn denoised_plan(
    film: &Film,
    judgement: &Judgement,
    visibility: f64,
    max_samples: u32,
    left: u64,
) -> SamplePlan {
    let to_blame = to_blame(judgement, visibility);
    let raw = judgement.energy_of(&judgement.pooled_variance_per_sample);
    plan_by_energy(film, &defended(raw.values()), |pixel| to_blame[pixel], max_samples, left)
}

/// Which pixels' noise makes that some are above a visibility: those in whose window some are, and not just these, whose own noise may be
/// the least of it. Sampled alone, 1.3 % of `turntable` (64×36, Open Image Denoise) had 16384 samples and stayed above 2.
fn to_blame(judgement: &Judgement, visibility: f64) -> Vec<bool> {
    let is_above = judgement.predicted.map(|predicted| f32::from(f64::from(predicted) > visibility));
    let shares = judgement.thresholds.pooled(&is_above);
    let most = shares.values().iter().fold(0.0, |a: f32, &share| a.max(share));
    shares.values().iter().map(|&share| share > LEAST_BLAME * most).collect()
}

/// Energies with their mean added, and none much above it.
fn defended(energies: &[f32]) -> Vec<f64> {
    let energies = || energies.iter().map(|&energy| f64::from(energy));
    let mean = energies().filter(|energy| energy.is_finite()).sum::<f64>() / energies().len().max(1) as f64;
    // The order of `min` turns NaN into the most.
    energies().map(|energy| energy.min(MOST_TIMES_MEAN * mean) + mean).collect()
}

/// Doublings, again and again for the half of the pixels where one more sample takes away most of e/n, until the plan is worth a look;
/// among those to blame alone when they are few. As many for all where other than even counts would hardly be better.
fn plan_by_energy(
    film: &Film,
    energies: &[f64],
    is_to_blame: impl Fn(usize) -> bool,
    max_samples: u32,
    left: u64,
) -> SamplePlan {
    let pixels = energies.len();
    let to_blame = (0..pixels).filter(|&pixel| is_to_blame(pixel)).count();
    if to_blame == 0 {
        return SamplePlan::default();
    }
    let is_for_all = 2 * to_blame > pixels;
    let is_wanted = |pixel: usize| is_for_all || is_to_blame(pixel);
    let present: f64 = (0..pixels).filter(|&pixel| is_wanted(pixel)).map(|pixel| f64::from(film.samples(pixel))).sum();
    let worth_a_look = (GROWTH * present).max(SAMPLES_OF_A_LOOK * pixels as f64).min(left as f64);
    if is_for_all && share_of_even(energies) > EVEN_ENOUGH {
        let mean_samples = ((present + worth_a_look) / pixels as f64).round() as u32;
        return plan_up_to(film, |_| mean_samples.min(max_samples));
    }
    let mut doublings = vec![0; pixels];
    let mut added = 0.0;
    while added < worth_a_look {
        let count = |pixel: usize| f64::from(film.samples(pixel).max(1) << doublings[pixel]);
        let may_double = |pixel: usize| {
            is_wanted(pixel) && doublings[pixel] < MOST_DOUBLINGS && count(pixel) < f64::from(max_samples)
        };
        let gain = |pixel: usize| if may_double(pixel) { energies[pixel] / count(pixel).powi(2) } else { 0.0 };
        let mut gains: Vec<f64> = (0..pixels).map(gain).filter(|&gain| gain > 0.0).collect();
        if gains.is_empty() {
            break;
        }
        let middle = gains.len() / 2;
        let (_, &mut median, _) = gains.select_nth_unstable_by(middle, f64::total_cmp);
        let doubled: Vec<usize> = (0..pixels).filter(|&pixel| gain(pixel) >= median).collect();
        added += doubled.iter().map(|&pixel| count(pixel)).sum::<f64>();
        doubled.into_iter().for_each(|pixel| doublings[pixel] += 1);
    }
    doubling_plan(film, max_samples, |pixel| [doublings[pixel]; 2])
}

/// Samples that the best counts would need for the energy that even counts leave, as a share of theirs: the sum of e/n is smallest
/// where n goes as √e, so (mean √e)² / mean e (Cauchy and Schwarz: at most 1).
fn share_of_even(energies: &[f64]) -> f64 {
    let root: f64 = energies.iter().map(|energy| energy.sqrt()).sum();
    let sum: f64 = energies.iter().sum();
    if sum > 0.0 { root * root / (sum * energies.len() as f64) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::super::judge::judge;
    use super::super::test_films::{film_of, settings};
    use super::*;
    use glam::Vec3;

    /// Where every place is about as noisy, counts stay even; where one half of the picture is noisier, it gets the samples; few pixels that are
    /// to blame get theirs alone.
    #[test]
    fn counts_are_even_unless_others_are_much_better() {
        let film = film_of(|_, random| Vec3::splat(1.0 + random));
        let plan = |left: f64, right: f64, is_to_blame: fn(usize) -> bool| {
            let energies: Vec<f64> = (0..64 * 64).map(|pixel| if pixel % 64 < 32 { left } else { right }).collect();
            plan_by_energy(&film, &energies, is_to_blame, 1024, u64::MAX)
        };
        assert_eq!(plan(8.0, 6.0, |_| true).samples(), 8 * 64 * 64, "half as many again");
        let uneven = plan(16.0, 1.0, |_| true);
        assert!(uneven.blocks.iter().all(|block| block.pixel % 64 < 32));
        assert_eq!(uneven.samples(), 16 * 32 * 64, "32 and 16");
        let few = plan(8.0, 6.0, |pixel| pixel % 64 < 16);
        assert!(few.blocks.iter().all(|block| block.pixel % 64 < 16));
        assert_eq!(few.samples(), 48 * 16 * 64, "four times what they have");
        assert!(plan(8.0, 1.0, |_| false).blocks.is_empty());
    }

    /// Nobody starves beside one whose variance is enormous, or no number.
    #[test]
    fn quiet_pixels_keep_their_share() {
        let mut energies = vec![1.0; 100];
        (energies[3], energies[5]) = (1e9, f32::NAN);
        let defended = defended(&energies);
        let mean_root = defended.iter().map(|energy| energy.sqrt()).sum::<f64>() / 100.0;
        assert!(defended.iter().all(|energy| energy.is_finite() && energy.sqrt() > 0.7 * mean_root));
        assert!(defended[3].sqrt() < 5.0 * mean_root);
    }

    /// What is above the target is the noise of a window: all of that window gets samples, and nothing far from it.
    #[test]
    fn the_surroundings_of_what_shows_are_sampled() {
        let film = film_of(|_, random| Vec3::splat(1.0 + random));
        let mut judgement = judge(&film, &settings(), 1.0).expect("judges");
        judgement.predicted = Plane::from_fn(64, 64, |x, y| if (x, y) == (5, 5) { 3.0 } else { 1.0 });
        let plan = denoised_plan(&film, &judgement, 2.0, 1024, u64::MAX);
        let is_sampled = |x: u32, y: u32| plan.blocks.iter().any(|block| block.pixel == 64 * y + x);
        assert!(is_sampled(5, 5) && is_sampled(17, 5) && is_sampled(5, 17), "within a quarter of a degree, 15 pixels");
        assert!(!is_sampled(60, 5) && !is_sampled(5, 60) && !is_sampled(60, 60));
    }

    /// It is raw noise that gets samples, while anything can be seen.
    #[test]
    fn noisy_pixels_are_sampled() {
        let film = film_of(|pixel, random| Vec3::splat(1.0 + if pixel % 64 < 32 { 0.5 } else { 0.05 } * random));
        let judgement = judge(&film, &settings(), 1.0).expect("judges");
        let plan = denoised_plan(&film, &judgement, 0.01, 1024, 4 * 64 * 64);
        let left = plan.blocks.iter().filter(|block| block.pixel % 64 < 32).count();
        assert!(left * 20 > plan.blocks.len() * 19, "{left} of {}", plan.blocks.len());
        assert!(denoised_plan(&film, &judgement, f64::from(f32::MAX), 1024, u64::MAX).blocks.is_empty());
    }
}
