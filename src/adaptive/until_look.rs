//! Where a picture that is denoised gets samples between one look at it and the next.
//!
//! A look says whose noise shows; how much each pixel gets is decided, as samples come, by raw noise, which costs a
//! tenth of a look to know. Not for pictures that stay raw: these have `plan`.

use super::gain::{EVEN_ENOUGH, GROWTH, defended, gain, share_of_even};
use super::judge::Judgement;
use super::plan::{doubling_plan, plan_up_to};
use super::stop::TOLERATED_SHARE;
use crate::denoise::{Denoiser, DenoiserKind};
use crate::film::Film;
use crate::integrator::SamplePlan;
use serde::{Deserialize, Serialize};

/// Samples for every pixel that a plan adds at least, while its pixels may have so many: variances of four samples are
/// not worth being asked more often.
const MIN_PLAN: f64 = 6.0;
/// What a look costs with Open Image Denoise, in samples for every pixel, about: 5 to 15
/// (`benches/results/denoising.md`).
const SAMPLES_OF_AN_OIDN_LOOK: f64 = 10.0;
/// With the built-in filter: 2 to 4.
const SAMPLES_OF_A_BUILTIN_LOOK: f64 = 3.0;
/// Samples for every pixel between two looks at the least, and before the first one: spent on more of them,
/// what the dearer look costs is spent better. The same with the built-in filter; whether more of its looks
/// would pay was not measured.
const MIN_SAMPLES_BETWEEN_LOOKS: f64 = SAMPLES_OF_AN_OIDN_LOOK;
/// Most that comes between two looks, as a share of what is there.
const MAX_GROWTH: f64 = 3.0;
/// What raw noise may be above the visibility asked for, so that a look is worth its cost: denoising made ten scenes
/// 0.8 to 2.7 times better at 32 samples, one of them 4.4 times at 8 (`benches/results/denoising.md`).
const MAX_GAIN: f64 = 3.0;
/// Doublings of a pixel in one plan.
const MAX_DOUBLINGS: u32 = 2;
/// What is in a pixel's window above the visibility asked for, as a share of what is in the window that has most, from
/// which on its noise counts.
const MIN_BLAME: f32 = 0.1;

/// What a look at a denoised picture costs, in samples for every pixel, about.
pub(super) fn samples_of_a_look(denoiser: &Denoiser) -> f64 {
    match denoiser.kind() {
        DenoiserKind::Builtin => SAMPLES_OF_A_BUILTIN_LOOK,
        DenoiserKind::Oidn => SAMPLES_OF_AN_OIDN_LOOK,
    }
}

/// What a look at a denoised picture decides until the next one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UntilLook {
    /// Pixels whose noise makes that something shows.
    to_blame: Vec<bool>,
    /// Samples of all pixels from which on there is a look, unless raw noise says that nothing can be reached.
    earliest: u64,
    /// Samples of all pixels at which there is one in any case.
    latest: u64,
}

impl UntilLook {
    /// When to look before the first look.
    pub(super) fn first(film: &Film) -> Self {
        let pixels = film.pixel_count();
        let earliest = MIN_SAMPLES_BETWEEN_LOOKS * pixels as f64;
        let latest = (1.0 + MAX_GROWTH) * earliest;
        Self { to_blame: vec![true; pixels], earliest: earliest as u64, latest: latest as u64 }
    }

    /// A look before anything more is traced: whoever goes on from a film that a look has ended must see what that one
    /// saw.
    pub(super) fn at_once(film: &Film) -> Self {
        let now = film.total_samples();
        Self { to_blame: vec![true; film.pixel_count()], earliest: now, latest: now }
    }

    /// When to look after a look, while some of the picture is above `visibility`: once that may be reached, if errors
    /// fell as 1/n (measured are 1/n^0.35 to 1/n^0.9), and at least until as many samples are traced as a look costs.
    pub(super) fn after(film: &Film, judgement: &Judgement, visibility: f64) -> Self {
        let to_blame = to_blame(judgement, visibility);
        let present: f64 = wanted(&to_blame).map(|pixel| f64::from(film.samples(pixel))).sum();
        let growth = judgement.predicted.quantile(1.0 - TOLERATED_SHARE) / visibility - 1.0;
        let least = MIN_SAMPLES_BETWEEN_LOOKS * to_blame.len() as f64;
        // The order of `max` turns NaN, of 0 / 0, into the least.
        let most = MAX_GROWTH * present;
        let added = (growth.max(GROWTH) * present).max(least).min(most);
        let after = |added: f64| film.total_samples() + added as u64;
        Self { to_blame, earliest: after(added), latest: after(most) }
    }

    /// Whether it is of a picture of so many pixels.
    pub(crate) fn is_sound(&self, pixels: u32) -> bool {
        self.to_blame.len() == pixels as usize
    }

    /// Whether there may be a look. A sample a pixel is not worth another plan.
    pub(super) fn may_look(&self, film: &Film) -> bool {
        film.total_samples() + self.to_blame.len() as u64 > self.earliest
    }

    /// Whether there is one where there may: not yet while raw noise is so far above a visibility that no denoiser
    /// can bring the picture to it.
    pub(super) fn must_look(&self, film: &Film, raw: &Judgement, visibility: f64) -> bool {
        let is_late = film.total_samples() + self.to_blame.len() as u64 > self.latest;
        is_late || raw.predicted.quantile(1.0 - TOLERATED_SHARE) <= MAX_GAIN * visibility
    }

    /// A plan of more samples for the pixels to blame; at most `left` in all. `judgement` may be of the raw picture.
    ///
    /// What raw noise would show at a pixel decides, not what is left of it: that is pooled over a degree and tells no
    /// noisy pixel from its neighbours. Counts go as the root of that energy plus the picture's mean ([`defended`]).
    pub(super) fn plan(&self, film: &Film, judgement: &Judgement, max_samples: u32, left: u64) -> SamplePlan {
        let raw = judgement.energy_of(&judgement.pooled_variance_per_sample);
        let due = if self.may_look(film) { self.latest } else { self.earliest };
        let left = left.min(due.saturating_sub(film.total_samples()));
        plan_by_energy(film, &defended(raw.values()), &self.to_blame, max_samples, left)
    }
}

/// Which pixels' noise makes that some are above a visibility: these and those in whose window some are, and not just
/// these, whose own noise may be the least of it. Measured with just these: 1.3 % of `turntable` (64×36, Open Image
/// Denoise) take 16384 samples and stay above 2.
fn to_blame(judgement: &Judgement, visibility: f64) -> Vec<bool> {
    let above = judgement.predicted.map(|predicted| f32::from(f64::from(predicted) > visibility));
    let shares = judgement.thresholds.in_bands.pooled(&above);
    let most = shares.max();
    let is_to_blame = |(&above, &share): (&f32, &f32)| above > 0.0 || share > MIN_BLAME * most;
    above.values().iter().zip(shares.values()).map(is_to_blame).collect()
}

/// Pixels that a plan is for: those to blame, or all where that is most of them.
fn wanted(to_blame: &[bool]) -> impl Iterator<Item = usize> {
    let is_for_all = is_for_all(to_blame);
    (0..to_blame.len()).filter(move |&pixel| is_for_all || to_blame[pixel])
}

fn is_for_all(to_blame: &[bool]) -> bool {
    2 * to_blame.iter().filter(|&&is_to_blame| is_to_blame).count() > to_blame.len()
}

/// Doublings, again and again for the half of the pixels where one more sample takes away most of e/n, until the
/// plan is large enough; among those to blame alone when they are few. As many for all where other than even
/// counts would hardly be better.
fn plan_by_energy(film: &Film, energies: &[f64], to_blame: &[bool], max_samples: u32, left: u64) -> SamplePlan {
    let pixels = energies.len();
    let present: f64 = wanted(to_blame).map(|pixel| f64::from(film.samples(pixel))).sum();
    let enough = (GROWTH * present).max(MIN_PLAN * pixels as f64).min(left as f64);
    if is_for_all(to_blame) && share_of_even(energies) > EVEN_ENOUGH {
        let mean_samples = ((present + enough) / pixels as f64).round() as u32;
        return plan_up_to(film, |_| mean_samples.min(max_samples));
    }
    let mut doublings = vec![0; pixels];
    let mut added = 0.0;
    while added < enough {
        let count = |pixel: usize| f64::from(film.samples(pixel).max(1) << doublings[pixel]);
        let may_double = |pixel: usize| doublings[pixel] < MAX_DOUBLINGS && count(pixel) < f64::from(max_samples);
        let gain = |pixel: usize| if may_double(pixel) { gain(energies[pixel], count(pixel)) } else { 0.0 };
        let mut gains: Vec<f64> = wanted(to_blame).map(gain).filter(|&gain| gain > 0.0).collect();
        if gains.is_empty() {
            break;
        }
        let middle = gains.len() / 2;
        let (_, &mut median, _) = gains.select_nth_unstable_by(middle, f64::total_cmp);
        let doubled: Vec<usize> = wanted(to_blame).filter(|&pixel| gain(pixel) >= median).collect();
        added += doubled.iter().map(|&pixel| count(pixel)).sum::<f64>();
        doubled.into_iter().for_each(|pixel| doublings[pixel] += 1);
    }
    doubling_plan(film, max_samples, |pixel| [doublings[pixel]; 2])
}

#[cfg(test)]
mod tests {
    use super::super::judge::judge;
    use super::super::test_films::{film_of, settings};
    use super::*;
    use fechner_perception::Plane;
    use glam::Vec3;

    /// Where every place is about as noisy, counts stay even; where one half of the picture is noisier, it gets the
    /// samples; few pixels that are to blame get theirs alone.
    #[test]
    fn counts_are_even_unless_others_are_much_better() {
        let film = film_of(|_, random| Vec3::splat(1.0 + random));
        let plan = |left: f64, right: f64, is_to_blame: fn(usize) -> bool| {
            let energies: Vec<f64> = (0..64 * 64).map(|pixel| if pixel % 64 < 32 { left } else { right }).collect();
            let to_blame: Vec<bool> = (0..64 * 64).map(is_to_blame).collect();
            plan_by_energy(&film, &energies, &to_blame, 1024, u64::MAX)
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

    fn plan_after(film: &Film, judgement: &Judgement, visibility: f64, left: u64) -> SamplePlan {
        UntilLook::after(film, judgement, visibility).plan(film, judgement, 1024, left)
    }

    /// A film of 16 samples a pixel, and a look that finds this visibility.
    fn looked_at(predicted: impl Fn(usize, usize) -> f32 + Sync) -> (Film, Judgement) {
        let film = film_of(|_, random| Vec3::splat(1.0 + random));
        let mut judgement = judge(&film, &settings(), 1.0).expect("judges");
        judgement.predicted = Plane::from_fn(64, 64, predicted);
        (film, judgement)
    }

    /// The first look is not at the pilot, and the next one not before as much is traced as a look costs; far from the
    /// target it comes later, but what is there is at most four times as much then.
    #[test]
    fn looks_are_as_far_apart_as_they_cost() {
        let pixels = 64 * 64;
        assert_eq!(UntilLook::first(&Film::new(64, 64)).earliest, 10 * pixels);
        let due = |predicted: f32, visibility: f64| {
            let (film, judgement) = looked_at(|_, _| predicted);
            let until_look = UntilLook::after(&film, &judgement, visibility);
            assert!(!until_look.may_look(&film), "it asks for samples");
            until_look.earliest / pixels
        };
        assert_eq!(due(2.2, 2.0), 16 + 10, "a look's worth");
        assert_eq!(due(4.0, 2.0), 16 + 16, "what errors that fall as 1/n need");
        assert_eq!(due(f32::INFINITY, 2.0), 4 * 16);
        let (film, judgement) = looked_at(|_, _| 1.0);
        assert!(UntilLook::after(&film, &judgement, 2.0).may_look(&film), "nothing shows");
    }

    /// What raw noise already says costs no look: while it is above three times the visibility asked for there is
    /// none, though not for ever.
    #[test]
    fn hopeless_looks_are_left_out() {
        let until_look = |film: &Film| UntilLook::first(film);
        let (film, raw) = looked_at(|_, _| 6.5);
        assert!(until_look(&film).may_look(&film), "16 samples");
        assert!(!until_look(&film).must_look(&film, &raw, 2.0));
        assert!(until_look(&film).must_look(&film, &raw, 2.2));
        assert!(!until_look(&film).plan(&film, &raw, 1024, u64::MAX).blocks.is_empty(), "it goes on without one");
        let late = UntilLook { latest: film.total_samples(), ..until_look(&film) };
        assert!(late.must_look(&film, &raw, 2.0));
    }

    /// Which pixels get samples where these are above the target.
    fn sampled(is_above: fn(usize, usize) -> bool) -> impl Fn(u32, u32) -> bool {
        let (film, judgement) = looked_at(|x, y| if is_above(x, y) { 3.0 } else { 1.0 });
        let plan = plan_after(&film, &judgement, 2.0, u64::MAX);
        move |x, y| plan.blocks.iter().any(|block| block.pixel == 64 * y + x)
    }

    /// What is above the target is the noise of a window: all of that window gets samples, and nothing far from it.
    #[test]
    fn the_surroundings_of_what_shows_are_sampled() {
        let is_sampled = sampled(|x, y| (x, y) == (5, 5));
        assert!(is_sampled(5, 5) && is_sampled(17, 5) && is_sampled(5, 17), "within a quarter of a degree, 15 pixels");
        assert!(!is_sampled(60, 5) && !is_sampled(5, 60) && !is_sampled(60, 60));
    }

    /// Nothing that is above the target waits for a larger place to come down, which may have all the samples that it
    /// may have.
    #[test]
    fn a_lone_pixel_is_sampled_beside_a_large_place() {
        let is_sampled = sampled(|x, y| (x, y) == (5, 5) || (x > 52 && y > 52));
        assert!(is_sampled(5, 5) && is_sampled(60, 60));
    }

    /// It is raw noise that gets samples, while anything can be seen.
    #[test]
    fn noisy_pixels_are_sampled() {
        let film = film_of(|pixel, random| Vec3::splat(1.0 + if pixel % 64 < 32 { 0.5 } else { 0.05 } * random));
        let judgement = judge(&film, &settings(), 1.0).expect("judges");
        let plan = plan_after(&film, &judgement, 0.01, 4 * 64 * 64);
        let left = plan.blocks.iter().filter(|block| block.pixel % 64 < 32).count();
        assert!(left * 20 > plan.blocks.len() * 19, "{left} of {}", plan.blocks.len());
        assert!(plan_after(&film, &judgement, f64::from(f32::MAX), u64::MAX).blocks.is_empty());
    }
}
