//! What one more sample of a pixel does for the picture as a whole, where not everything that is wanted can be had at
//! once.
//!
//! Not for how many samples a visibility takes: these are `plan`'s.

use super::judge::Judgement;
use super::plan::{cut_to_budget, doubling_plan};
use super::small_things::few_meetings;
use crate::film::Film;
use crate::integrator::{BlockWork, SamplePlan};
use crate::sampler::Half;
use fechner_perception::Plane;

/// What comes before the next plan is this share of what is there: counts adapt while variances become known. More, as
/// far as the visibility is from the rung, was no gain (`benches/results/denoising.md`).
pub(super) const GROWTH: f64 = 0.5;
/// Even counts are kept where the best ones would take more than this share of their samples.
pub(super) const EVEN_ENOUGH: f64 = 0.95;
/// Even counts are kept, in raw pictures on the way to a far rung, where the best ones would take more than this share
/// of their samples. It lies between the Cornell box (0.95 to 0.96), whose squared error was 0.90 ± 0.03 of even
/// counts' when this was chosen and is 1.04 ± 0.02 by present masks, and the product shot (0.98), where even counts
/// have 9.875 JOD at 96 samples and uneven ones 9.834 (`benches/results/equal-time.md`).
const EVEN_ENOUGH_WHILE_FAR: f64 = 0.97;
/// Samples for every pixel up to which a plan is never cut: less would hardly pay for the look before it.
const MIN_UNCUT: f64 = 16.0;
/// No pixel's noise counts as more than so many times the picture's mean: variances of few samples are not worth more
/// trust.
const MAX_TIMES_MEAN: f64 = 16.0;

/// The part of a plan that is worth its samples before the next look: where it does most for the picture.
pub(super) fn most_worthwhile(plan: SamplePlan, film: &Film, judgement: &Judgement) -> SamplePlan {
    cut(plan, film, judgement, most_at_once(film))
}

/// Samples of a plan before the next look.
fn most_at_once(film: &Film) -> u64 {
    let pixels = film.pixel_count() as f64;
    (GROWTH * film.total_samples() as f64).max(MIN_UNCUT * pixels) as u64
}

/// Samples for a rung that is far nearly everywhere: where they do most for the picture among what shows by itself.
/// `None` where even counts would do as much.
///
/// What the cheapest counts are does not matter yet, and to find them was a quarter of a small look.
pub(super) fn while_far(film: &Film, judgement: &Judgement, rung: f64, max_samples: u32) -> Option<SamplePlan> {
    let energies = Energies::of(film, judgement);
    if share_of_even(&defended(energies.whole.values())) > EVEN_ENOUGH_WHILE_FAR {
        return None;
    }
    let shows = |pixel: usize, half: Half| {
        f64::from(energies.of_half(half)[pixel]) > rung * rung * twice_taken(film, pixel, half)
    };
    let plan = doubling_plan(film, max_samples, |pixel| Half::BOTH.map(|half| u32::from(shows(pixel, half))));
    Some(cut_to_budget(plan, gains(film, &energies), most_at_once(film)))
}

/// A plan cut to so many samples: where these do most for the picture.
pub(super) fn cut(plan: SamplePlan, film: &Film, judgement: &Judgement, most: u64) -> SamplePlan {
    if plan.samples() <= most {
        return plan;
    }
    cut_to_budget(plan, gains(film, &Energies::of(film, judgement)), most)
}

/// Squared visibility of one sample's noise in each pixel for itself.
pub(super) struct Energies {
    whole: Plane,
    /// Energies by which each half goes, where they differ from the whole's: what both halves may have missed must
    /// not count, or a pixel that met a star's rim by luck is less urgent than its neighbour that did not. Measured
    /// by what both may have missed: stars 6.4 ± 0.7 % too bright at 64 samples a pixel
    /// (`benches/results/energy.md`, lamps on black).
    of_halves: Option<[Plane; 2]>,
}

impl Energies {
    pub(super) fn of(film: &Film, judgement: &Judgement) -> Self {
        let pooled = &judgement.pooled_variance_per_sample;
        match &judgement.pooled_of_halves {
            None => Self { whole: judgement.energy_of(pooled), of_halves: None },
            Some([a, b]) => {
                let [whole, a, b] = judgement.energies_of([pooled, a, b]);
                Self { whole, of_halves: Some([a, b].map(|half| with_unmet_alike(film, half))) }
            }
        }
    }

    /// Energy of each pixel by which the whole picture is judged.
    pub(super) fn of_both(&self) -> &[f32] {
        self.whole.values()
    }

    /// Energy of each pixel by which a half may go.
    pub(super) fn of_half(&self, half: Half) -> &[f32] {
        self.of_halves.as_ref().map_or(&self.whole, |halves| &halves[half.index()]).values()
    }
}

/// Energies in which all pixels with known lamps that few samples have met have the mean of these pixels. A pixel
/// that was lucky is bright, so that its threshold is high. Measured without: lamps far out of focus 7.3 ± 1.0 % too
/// bright with 32 samples a pixel.
fn with_unmet_alike(film: &Film, mut energies: Plane) -> Plane {
    let unmet: Vec<usize> = (0..film.pixel_count()).filter(|&pixel| few_meetings(film, pixel).is_some()).collect();
    let of_unmet =
        || unmet.iter().map(|&pixel| f64::from(energies.values()[pixel])).filter(|energy| energy.is_finite());
    let mean = of_unmet().sum::<f64>() / of_unmet().count().max(1) as f64;
    unmet.iter().for_each(|&pixel| energies.values_mut()[pixel] = mean as f32);
    energies
}

/// What one more sample takes away of a half's share of its pixel's visible energy, e/n: by its own count n, not the
/// pixel's. The other half's count was decided by this one's samples: by both counts, a half that was lucky stays as it
/// is while the other one grows. Measured by both: the sun through blinds makes a room 0.8 % too bright
/// (`benches/results/energy.md`).
///
/// Samples that go where it is most make counts that go as √e and leave the least mean energy (Neyman 1934) of known
/// variances. Counts for equal visibility go as e: at 96 samples a pixel of the Cornell box their FLIP is 1.09 times
/// that of even counts, with these it is 1.015 (`benches/results/equal-time.md`).
fn gains(film: &Film, energies: &Energies) -> impl Fn(&BlockWork) -> f32 {
    let defended = Half::BOTH.map(|half| defended(energies.of_half(half)));
    move |block| {
        let pixel = block.pixel as usize;
        gain(defended[block.half.index()][pixel], twice_taken(film, pixel, block.half).max(1.0)) as f32
    }
}

/// Samples of a pixel if its other half had as many as this one.
fn twice_taken(film: &Film, pixel: usize, half: Half) -> f64 {
    2.0 * f64::from(film.taken(pixel, half))
}

/// What one sample more than `samples` takes away of `energy` / `samples`, about.
pub(super) fn gain(energy: f64, samples: f64) -> f64 {
    energy / (samples * samples)
}

/// Samples that the best counts would need for the energy that even counts leave, as a share of theirs: the sum of e/n
/// is smallest where n goes as √e, so (mean √e)² / mean e (Cauchy and Schwarz: at most 1).
pub(super) fn share_of_even(energies: &[f64]) -> f64 {
    let root: f64 = energies.iter().map(|energy| energy.sqrt()).sum();
    let sum: f64 = energies.iter().sum();
    if sum > 0.0 { root * root / (sum * energies.len() as f64) } else { 1.0 }
}

/// Energies of one sample with their mean added, and none much above it.
///
/// Without the mean, noisy pixels starve the rest. Measured in a dark room denoised by Open Image Denoise: without it
/// JOD 9.52 at 256 samples a pixel where even counts have 9.74; with it 0.02 to 0.07 more than even counts from 8 to
/// 256 (`benches/results/denoising.md`).
pub(super) fn defended(energies: &[f32]) -> Vec<f64> {
    let energies = || energies.iter().map(|&energy| f64::from(energy));
    let mean = energies().filter(|energy| energy.is_finite()).sum::<f64>() / energies().len().max(1) as f64;
    // The order of `min` turns NaN into the most.
    energies().map(|energy| energy.min(MAX_TIMES_MEAN * mean) + mean).collect()
}

#[cfg(test)]
mod tests {
    use super::super::judge::{LookFor, judge, judge_for};
    use super::super::plan::plan_up_to;
    use super::super::test_films::{film_of, film_of_halves, settings};
    use super::*;
    use crate::film::{BlockSum, KnownThings};
    use crate::integrator::PathSample;
    use glam::Vec3;

    /// Of more than can be had at once, noisy pixels have theirs first; what is little is not cut.
    #[test]
    fn plans_are_cut_where_least_is_lost() {
        let film = film_of(|pixel, random| Vec3::splat(1.0 + if pixel % 64 < 32 { 0.5 } else { 0.05 } * random));
        let judgement = judge(&film, &settings(), 1.0).expect("judges");
        let plan_to = |samples: u32| plan_up_to(&film, move |_| samples);
        assert_eq!(most_worthwhile(plan_to(32), &film, &judgement), plan_to(32));
        let cut = most_worthwhile(plan_to(96), &film, &judgement);
        let pixels = 64 * 64;
        assert!((15 * pixels..=16 * pixels).contains(&cut.samples()), "{} a pixel", cut.samples() / pixels);
        let left = cut.blocks.iter().filter(|block| block.pixel % 64 < 32).count();
        assert!(left * 20 > cut.blocks.len() * 19, "{left} of {}", cut.blocks.len());
    }

    /// On the way to what is far, next to nothing goes where noise does not show by itself; where it is even, so are
    /// counts.
    #[test]
    fn what_shows_is_sampled_while_the_rung_is_far() {
        let judged = |film: &Film| judge(film, &settings(), 1.0).expect("judges");
        let film = film_of(|pixel, random| Vec3::splat(1.0 + if pixel % 64 < 20 { 0.5 } else { 0.001 } * random));
        let plan = while_far(&film, &judged(&film), 0.5, 1 << 16).expect("uneven");
        assert!((2 * 20 * 64..2 * 24 * 64).contains(&plan.blocks.len()), "{} blocks", plan.blocks.len());
        // Neighbours pool their variances three pixels far.
        assert!(plan.blocks.iter().all(|block| block.pixel % 64 < 23));
        let even = film_of(|_, random| Vec3::splat(1.0 + 0.5 * random));
        assert_eq!(while_far(&even, &judged(&even), 0.5, 1 << 16), None);
    }

    /// Of two halves the one that has fewer samples comes first, whatever the pixel has in all.
    #[test]
    fn halves_are_cut_by_what_they_have_themselves() {
        let mut film = film_of(|_, random| Vec3::splat(1.0 + 0.5 * random));
        let ahead = plan_up_to(&film, |pixel| if pixel % 2 == 0 { 64 } else { 16 });
        for block in ahead.blocks.into_iter().filter(|block| block.half == Half::B) {
            let mut sum = BlockSum::default();
            (0..block.samples).for_each(|index| {
                let radiance = Vec3::splat(if index % 2 == 0 { 0.5 } else { 1.5 });
                sum.add(&PathSample::of_wall(radiance));
            });
            film.merge_block(block, &sum);
        }
        let judgement = judge(&film, &settings(), 1.0).expect("judges");
        let more = doubling_plan(&film, 1 << 16, |_| [1; 2]);
        // What the halves that are behind would have, and no more.
        let kept = cut(more, &film, &judgement, 3 * 64 * 64 / 2 * 8);
        let is_ahead = |block: &BlockWork| block.half == Half::B && block.pixel.is_multiple_of(2);
        assert_eq!(kept.blocks.iter().filter(|block| is_ahead(block)).count(), 0);
        assert_eq!(kept.samples(), 3 * 64 * 64 / 2 * 8);
    }

    /// A lamp's rim that one half has met by luck is as urgent for that half as if it had not.
    #[test]
    fn a_half_is_not_cut_by_its_own_luck() {
        const RIM: u32 = 32 * 64 + 35;
        let urgency_of_a = |of_a: f32| {
            let grey = |pixel: u32, half: Half| match (pixel % 8, half) {
                (0 | 2, _) => 20.0,
                (1, _) => 40.0,
                _ if pixel == RIM && half == Half::A => of_a,
                _ => 0.01,
            };
            let shines = |pixel: u32| pixel % 8 < 3 || pixel == RIM;
            let film = film_of_halves([8; 2], shines, |pixel, half, _| Vec3::splat(grey(pixel, half)));
            let judgement = judge_for(LookFor::Plan, &film, &settings(), 1.0).expect("judges");
            let energies = Energies::of(&film, &judgement);
            gains(&film, &energies)(&BlockWork::whole(RIM, Half::A, 1))
        };
        let (unlucky, lucky) = (urgency_of_a(0.01), urgency_of_a(5.0));
        assert!((lucky / unlucky - 1.0).abs() < 0.05, "{unlucky}, and {lucky} where it was lucky");
    }

    /// Of pixels with a lamp that few samples have met, one that was lucky is as urgent as the others.
    #[test]
    fn unmet_lamps_are_urgent_alike() {
        let lucky = |pixel: u32| pixel % 64 < 8 && pixel.is_multiple_of(5);
        let mut film = film_of(|pixel, random| Vec3::splat(if lucky(pixel) { 5.0 } else { 0.1 + 0.02 * random }));
        let mut lamps = KnownThings::new(film.pixel_count());
        (0..film.pixel_count()).filter(|pixel| pixel % 64 < 8).for_each(|pixel| lamps.add(pixel, 0.005, 200.0, true));
        film.known_things = Some(lamps);
        let judgement = judge_for(LookFor::Plan, &film, &settings(), 1.0).expect("judges");
        let energies = Energies::of(&film, &judgement);
        for half in Half::BOTH {
            let of_half = energies.of_half(half);
            assert!((0..64 * 64).filter(|pixel| pixel % 64 < 8).all(|pixel| of_half[pixel] == of_half[0]));
            assert!((8..64).all(|pixel| of_half[pixel] < of_half[0]), "and more than where nothing is missing");
        }
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

    /// Samples that go where the gain is most end in counts that go as the root of the energy.
    #[test]
    fn greatest_gains_lead_to_counts_as_the_root_of_energy() {
        let energies = [1.0, 16.0];
        let mut counts = [1.0; 2];
        for _ in 0..1000 {
            let gains = [0, 1].map(|pixel| gain(energies[pixel], counts[pixel]));
            counts[usize::from(gains[1] > gains[0])] += 1.0;
        }
        assert!((counts[1] / counts[0] - 4.0).abs() < 0.05, "{counts:?}");
    }
}
