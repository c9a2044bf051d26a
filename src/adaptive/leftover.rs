//! Whose noise it is that still shows where each pixel by itself has what it needs: of a pixel one half may have stayed
//! behind, and surroundings add up.
//!
//! Not for where a picture is far from its target: what shows there is nearly everybody's.

use super::forecast::Forecast;
use super::gain::Energies;
use super::judge::Judgement;
use super::plan::{MAX_DOUBLINGS_AT_ONCE, SAMPLES_OF_A_RAW_LOOK, doubled_blocks, doubling_plan};
use crate::film::Film;
use crate::integrator::SamplePlan;
use crate::sampler::Half;
use fechner_perception::Plane;
use rayon::prelude::*;

/// Halves that bring so much of the noise that shows, of what those bring that may have more samples, are doubled.
const MOST_OF_IT: f64 = 0.5;
/// Where halves that may have more samples bring less of the noise, nothing helps.
const HELPS: f32 = 0.01;
/// No energy counts as more: sums stay finite.
const MAX_ENERGY: f32 = 1e25;

/// Doublings of the halves whose noise is most of what shows above a rung; none where those that may have more samples
/// bring next to nothing of it. For a model that pools.
///
/// Only these are doubled, not every pixel around which noise shows: a sky behind the sun's disc has none of its own.
/// Measured with every pixel doubled: 262,144 samples in pixels of that sky, and 362 a pixel for a picture that takes
/// 28 (`benches/results/energy.md`, whose noise shows).
pub(super) fn of_what_shows(
    film: &Film,
    judgement: &Judgement,
    forecast: &Forecast<'_>,
    rung: f64,
    max_samples: u32,
) -> SamplePlan {
    let shown = Shown { film, judgement, rung, max_samples };
    let energies = Energies::of(film, judgement);
    // What the halves go by may miss what both together show.
    let by_halves = shown.loudness(&energies, |half| energies.of_half(half));
    let Some(loudness) = by_halves.or_else(|| shown.loudness(&energies, |_| energies.of_both())) else {
        return SamplePlan::default();
    };
    let plan_of = |doublings: u32| {
        let of_half = |loudness_of_half: f32| if loudness_of_half >= loudness.least { doublings } else { 0 };
        doubling_plan(film, max_samples, |pixel| loudness.of_halves[pixel].map(of_half))
    };
    let most = SAMPLES_OF_A_RAW_LOOK * film.pixel_count() as f64;
    let mut plan = plan_of(1);
    for doublings in 2..=MAX_DOUBLINGS_AT_ONCE {
        let further = plan_of(doublings);
        if further.samples() as f64 > most || forecast.is_reached_by(&plan, rung) {
            break;
        }
        plan = further;
    }
    plan
}

/// What is above a rung.
struct Shown<'a> {
    film: &'a Film,
    judgement: &'a Judgement,
    rung: f64,
    max_samples: u32,
}

/// What each half of each pixel that may have more samples brings of the noise that shows.
struct Loudness {
    of_halves: Vec<[f32; 2]>,
    /// That of those that are doubled.
    least: f32,
}

impl Shown<'_> {
    /// By what each half goes by; `None` where more samples help nowhere. `energies`: by which the picture is judged.
    fn loudness<'a>(&self, energies: &Energies, of_half: impl Fn(Half) -> &'a [f32] + Sync) -> Option<Loudness> {
        let pooled = |plane: &Plane| self.judgement.thresholds.in_bands.pooled(plane);
        let of_both_halves = |noise: &(dyn Fn(usize, Half) -> f32 + Sync)| {
            pooled(&self.film.plane(|pixel| Half::BOTH.map(|half| noise(pixel, half)).iter().sum()))
        };
        let helped = |pixel: usize, half: Half| {
            if self.may_have_more(pixel, half) { self.noise(of_half(half), pixel, half) } else { 0.0 }
        };
        let all = of_both_halves(&|pixel, half| self.noise(energies.of_both(), pixel, half));
        let helps = of_both_halves(&helped).combined(&all, |helped, all| f32::from(helped > HELPS * all));
        let urgency = pooled(&self.excess().combined(&helps, |excess, helps| excess * helps));
        let of_pixel = |pixel: usize| Half::BOTH.map(|half| urgency.values()[pixel].max(0.0) * helped(pixel, half));
        let of_halves: Vec<[f32; 2]> = (0..self.film.pixel_count()).into_par_iter().map(of_pixel).collect();
        let least = least_of_most(of_halves.as_flattened())?;
        Some(Loudness { of_halves, least })
    }

    fn noise(&self, energies: &[f32], pixel: usize, half: Half) -> f32 {
        let samples = self.film.taken(pixel, half).max(1) as f32;
        // The order of `min` turns NaN into the most.
        (energies[pixel] / samples).min(MAX_ENERGY)
    }

    fn may_have_more(&self, pixel: usize, half: Half) -> bool {
        doubled_blocks(pixel as u32, half, self.film.taken(pixel, half), self.max_samples).next().is_some()
    }

    /// How far each place is above the rung, squared.
    fn excess(&self) -> Plane {
        /// Times the rung, squared, beyond which all is as urgent, infinity among it.
        const MOST: f32 = 100.0;
        self.judgement.predicted.map(|visibility| {
            let excess = (visibility / self.rung as f32).powi(2) - 1.0;
            if excess.is_nan() { MOST } else { excess.clamp(0.0, MOST) }
        })
    }
}

/// The least of the greatest values that add up to [`MOST_OF_IT`] of all; `None` where there are none.
fn least_of_most(values: &[f32]) -> Option<f32> {
    let mut greatest: Vec<f32> = values.iter().copied().filter(|&value| value > 0.0).collect();
    greatest.par_sort_unstable_by(|a, b| b.total_cmp(a));
    let enough = MOST_OF_IT * greatest.iter().map(|&value| f64::from(value)).sum::<f64>();
    let mut sum = 0.0;
    greatest.into_iter().find(|&value| {
        sum += f64::from(value);
        sum >= enough
    })
}

#[cfg(test)]
mod tests {
    use super::super::judge::judge;
    use super::super::plan::plan_up_to;
    use super::super::test_films::{film_of, settings};
    use super::*;
    use crate::film::BlockSum;
    use crate::integrator::PathSample;
    use glam::Vec3;

    /// What shows around eight pixels is theirs: no pixel without noise gets a sample, and none is asked for
    /// once they have all they may.
    #[test]
    fn silent_surroundings_get_no_samples() {
        let is_noisy = |pixel: u32| (28..32).contains(&(pixel % 64)) && (30..32).contains(&(pixel / 64));
        let film = film_of(|pixel, random| Vec3::splat(1.0 + if is_noisy(pixel) { 0.9 * random } else { 0.0 }));
        let judgement = judge(&film, &settings(), 1.0).expect("judges");
        let rung = 0.9 * judgement.predicted.quantile(1.0);
        let shows = judgement.predicted.values().iter().filter(|&&v| f64::from(v) > rung).count();
        let forecast = Forecast::of(&film, &judgement);
        let plan = of_what_shows(&film, &judgement, &forecast, rung, 1 << 16);
        assert!(shows > 100 && !plan.blocks.is_empty(), "{shows} pixels show");
        // Neighbours pool their variances three pixels far.
        let is_near = |pixel: u32| (25..35).contains(&(pixel % 64)) && (27..35).contains(&(pixel / 64));
        assert!(plan.blocks.iter().all(|block| is_near(block.pixel)));
        assert!(of_what_shows(&film, &judgement, &forecast, rung, film.samples(0)).blocks.is_empty());
    }

    /// A place that is two hundred times as loud, whose pixels have all they may, does not keep another from its
    /// samples.
    #[test]
    fn a_place_beyond_help_does_not_hide_another() {
        let is_in =
            |pixel: u32, column: u32| (column..column + 4).contains(&(pixel % 64)) && (30..34).contains(&(pixel / 64));
        let swing = |pixel: u32| match (is_in(pixel, 2), is_in(pixel, 58)) {
            (true, _) => 0.9,
            (_, true) => 0.03,
            _ => 0.0,
        };
        let mut film = film_of(|pixel, random| Vec3::splat(1.0 + swing(pixel) * random));
        add_to(&mut film, swing, |pixel| pixel % 64 < 32);
        let judgement = judge(&film, &settings(), 1.0).expect("judges");
        let rung = 0.3 * f64::from(judgement.predicted.get(59, 31));
        let plan = of_what_shows(&film, &judgement, &Forecast::of(&film, &judgement), rung, 64);
        assert!(plan.blocks.iter().any(|block| is_in(block.pixel, 58)), "{} blocks", plan.blocks.len());
    }

    /// Brings pixels to 64 samples, whose light swings by so much about 1.
    fn add_to(film: &mut Film, swing: impl Fn(u32) -> f32, is_chosen: impl Fn(u32) -> bool) {
        for block in plan_up_to(film, |pixel| if is_chosen(pixel as u32) { 64 } else { 0 }).blocks {
            let mut sum = BlockSum::default();
            (0..block.samples).for_each(|index| {
                let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
                sum.add(&PathSample::of_wall(Vec3::splat(1.0 + swing(block.pixel) * sign)));
            });
            film.merge_block(block, &sum);
        }
    }

    /// Next to nothing is what faint noise around brings of what shows: it is left as it is, rather than
    /// sampled until it has all it may.
    #[test]
    fn faint_noise_is_left_where_the_loud_have_all_they_may() {
        let is_near =
            |pixel: u32, margin: u32| pixel % 64 < 6 + margin && (30 - margin..34 + margin).contains(&(pixel / 64));
        let swing = |pixel: u32| if is_near(pixel, 0) { 0.9 } else { 0.002 };
        let mut film = film_of(|pixel, random| Vec3::splat(1.0 + swing(pixel) * random));
        add_to(&mut film, swing, |pixel| is_near(pixel, 3));
        let judgement = judge(&film, &settings(), 1.0).expect("judges");
        let rung = 0.5 * f64::from(judgement.predicted.get(3, 31));
        let plan = |most: u32| of_what_shows(&film, &judgement, &Forecast::of(&film, &judgement), rung, most);
        assert!(plan(64).blocks.is_empty(), "{} blocks", plan(64).blocks.len());
        assert!(!plan(128).blocks.is_empty());
    }

    #[test]
    fn half_of_all_is_found_among_the_greatest() {
        assert_eq!(least_of_most(&[1.0, 0.0, 5.0, 3.0, 1.0]), Some(5.0));
        assert_eq!(least_of_most(&[1.0, 2.0, 2.0, 2.0, 1.0]), Some(2.0));
        assert_eq!(least_of_most(&[0.0; 3]), None);
    }
}
