//! Which pixels get how many more samples. Decisions only: nothing here traces. How plans are made of blocks, and cut,
//! is in `blocks`.
//!
//! Counts double, because trickles would be decided by luck. Where the need of a pixel lies between two doublings, the
//! two are mixed over 2×2 quads so that the mean of 1/n, which is what the eye's pooling sees, is right: rounding up
//! alone would cost 1.44 times the samples.

mod blocks;

pub(super) use blocks::{blocks_between, by_chance, doubled_blocks, share_of_half, slice_count};
pub use blocks::{cut_to_budget, slices};

use super::forecast::Forecast;
use super::judge::Judgement;
use super::settings::{AllocationRule, Limits};
use crate::film::Film;
use crate::integrator::{BlockWork, PILOT_SAMPLES_PER_HALF, PILOT_SAMPLES_PER_PIXEL, SamplePlan};
use crate::sampler::Half;
use fechner_perception::allocation::{AllocationProblem, allocate};
use fechner_perception::{PIXELS_PER_TASK, Plane};
use rayon::prelude::*;
use std::ops::Range;

/// Doublings that one plan gives a pixel at most where that costs no more than a look. Otherwise there is one: the
/// pixel's variance, and what stratification makes of it, are looked at again in between, since stratification pays
/// more the more samples there are.
pub(super) const MAX_DOUBLINGS_AT_ONCE: u32 = 3;

/// What a look at the picture costs, in samples for every pixel, about.
pub(super) const SAMPLES_OF_A_RAW_LOOK: f64 = 1.5;

/// Doublings that one plan gives at most to a pixel that shows too much by itself.
const MAX_DOUBLINGS_OF_EXCESS: u32 = 4;

/// One part in so many of the film's samples may go at once to pixels that are doubled on suspicion.
const SMALL_DOUBLING: u64 = 32;

/// Gap to the cheapest counts that is enough: rounding to doublings and the confidence margin cost more than 1 %.
const ENOUGH_GAP: f64 = 0.01;

/// Samples of each half that every pixel has before any has the rest of its pilot: who watches has a picture
/// of 2 + 2 early, and one that is about even on the way to 8 + 8. Single samples at first would be as many
/// sums again in a farm's files.
const FIRST_PASS_SAMPLES_PER_HALF: u32 = 2;

/// What a film lacks of the first samples of every pixel: 8 + 8, or `most_samples` in all where they are fewer.
pub fn pilot_plan(film: &Film, most_samples: u32) -> SamplePlan {
    let mut plan = SamplePlan::default();
    let samples = most_samples.min(PILOT_SAMPLES_PER_PIXEL);
    for [from, to] in [[0, FIRST_PASS_SAMPLES_PER_HALF], [FIRST_PASS_SAMPLES_PER_HALF, PILOT_SAMPLES_PER_HALF]] {
        for half in Half::BOTH {
            let to = to.min(share_of_half(samples, half));
            for pixel in 0..film.pixel_count() as u32 {
                let first = film.taken(pixel as usize, half).max(from);
                if first < to {
                    plan.blocks.push(BlockWork { first, samples: to - first, ..BlockWork::whole(pixel, half, 0) });
                }
            }
        }
    }
    plan
}

/// Doubles every pixel, up to `mean_samples` a pixel in all. Empty when they are there.
pub fn uniform_plan(film: &Film, mean_samples: u32) -> SamplePlan {
    let mut plan = SamplePlan::default();
    for pixel in 0..film.pixel_count() as u32 {
        for half in Half::BOTH {
            let taken = film.taken(pixel as usize, half);
            plan.blocks.extend(blocks_between(pixel, half, taken, share_of_half(mean_samples, half)).next());
        }
    }
    plan
}

/// A plan of equally many more samples for every pixel, `samples` in all, where it may have them. Those that are too
/// few for one more each go by chance.
pub(super) fn even_plan(film: &Film, samples: u64, max_samples: u32) -> SamplePlan {
    let each = (samples / film.pixel_count().max(1) as u64) as u32;
    let more = |range: Range<u32>| {
        let mut plan = SamplePlan::default();
        for pixel in 0..film.pixel_count() as u32 {
            for half in Half::BOTH {
                let taken = film.taken(pixel as usize, half);
                let [from, to] = [range.start, range.end].map(|more| taken.saturating_add(share_of_half(more, half)));
                plan.blocks.extend(blocks_between(pixel, half, from, to.min(share_of_half(max_samples, half))));
            }
        }
        plan
    };
    let mut plan = more(0..each);
    let left = samples - plan.samples();
    plan.blocks.extend(cut_to_budget(more(each..each.saturating_add(1)), by_chance(film), left).blocks);
    plan
}

/// What a film lacks of so many samples of each pixel, as many blocks as that takes.
pub(super) fn plan_up_to(film: &Film, wanted_samples: impl Fn(usize) -> u32) -> SamplePlan {
    let mut plan = SamplePlan::default();
    for pixel in 0..film.pixel_count() {
        let wanted_samples = wanted_samples(pixel);
        for half in Half::BOTH {
            let taken = film.taken(pixel, half);
            plan.blocks.extend(blocks_between(pixel as u32, half, taken, share_of_half(wanted_samples, half)));
        }
    }
    plan
}

/// How many samples each pixel should have in all, and for which visibility.
pub(super) struct Wanted {
    pub(super) samples: Plane,
    pub(super) visibility: f64,
}

/// How many samples each pixel should have in all for a visibility, if its variance were that of its neighbours.
///
/// # Errors
/// Only if the allocation refuses the judgement's maps, which would be a defect of ours.
pub(super) fn wanted_samples(
    judgement: &Judgement,
    forecast: &Forecast<'_>,
    rule: AllocationRule,
    visibility: f64,
    limits: &Limits,
) -> Result<Wanted, fechner_perception::Error> {
    let least = f64::from(limits.pilot());
    let most = f64::from(limits.max_samples).max(least);
    let variance = &judgement.pooled_variance_per_sample;
    if rule == AllocationRule::Convex && judgement.thresholds.per_pixel.is_none() {
        let allocation = allocate(&AllocationProblem {
            variance_per_sample: variance,
            thresholds: &judgement.thresholds.in_bands,
            cost: &Plane::filled(variance.width(), variance.height(), 1.0),
            tolerance: Some(&forecast.tolerance()),
            visibility,
            min_samples: least,
            max_samples: most,
            enough_gap: ENOUGH_GAP,
        })?;
        return Ok(Wanted { samples: allocation.samples, visibility });
    }
    let allowed = judgement.decisive_standard_error_cd_m2();
    let samples = Plane::from_fn(variance.width(), variance.height(), |x, y| {
        let standard_error = f64::from(allowed.get(x, y)) * visibility;
        (f64::from(variance.get(x, y)) / (standard_error * standard_error)).clamp(least, most) as f32
    });
    Ok(Wanted { samples, visibility })
}

/// Mean samples a pixel that a film needs for a visibility, by what it shows now.
///
/// # Errors
/// Only if the allocation refuses the judgement's maps, which would be a defect of ours.
pub fn needed_samples(
    film: &Film,
    judgement: &Judgement,
    visibility: f64,
    limits: &Limits,
) -> Result<f64, fechner_perception::Error> {
    let forecast = Forecast::of(film, judgement);
    Ok(wanted_samples(judgement, &forecast, AllocationRule::Convex, visibility, limits)?.samples.mean())
}

/// Doublings for pixels that have fewer samples than `wanted`.
///
/// Each half scales its share by what the other half knows of the pixel itself (counts go as the standard deviation,
/// Neyman 1934), if it was judged to plan.
///
/// A plan that costs no more than a look asks for so much that no other should be needed: the last few pixels that miss
/// the target narrowly, or whose half doubling was rounded away, would otherwise take several.
pub(super) fn adaptive_plan(
    film: &Film,
    judgement: &Judgement,
    forecast: &Forecast<'_>,
    wanted: &Wanted,
    max_samples: u32,
) -> SamplePlan {
    let plan_of = |haste: Haste| {
        doubling_plan(film, max_samples, |pixel| {
            let pooled = judgement.pooled_variance_per_sample.values()[pixel];
            let own = match &judgement.variance_per_sample {
                Some(halves) => halves.each_ref().map(|plane| plane.values()[pixel]),
                None => [pooled; 2],
            };
            doublings_of_halves(film, pixel, wanted.samples.values()[pixel], pooled, own, haste)
        })
    };
    let pixels = film.pixel_count() as f64;
    let is_cheap = |plan: &SamplePlan| plan.samples() as f64 <= SAMPLES_OF_A_RAW_LOOK * pixels;
    let mut best = plan_of(Haste::NONE);
    // What comes in haste holds all of it.
    if !is_cheap(&best) {
        return best;
    }
    for margin in MARGINS {
        let plan = plan_of(Haste { most_doublings: MAX_DOUBLINGS_AT_ONCE, margin });
        if !is_cheap(&plan) {
            break;
        }
        let is_enough = forecast.is_reached_by(&plan, wanted.visibility);
        best = plan;
        if is_enough {
            break;
        }
    }
    best
}

/// How much is asked for before the next look.
#[derive(Clone, Copy)]
struct Haste {
    most_doublings: u32,
    /// Times the need.
    margin: f64,
}

impl Haste {
    const NONE: Self = Self { most_doublings: 1, margin: 1.0 };
}

/// Margins that are tried, one after the other.
const MARGINS: [f64; 6] = [1.0, 1.05, 1.1, 1.2, 1.4, 1.8];

/// Doublings of both halves of a pixel that should have `wanted` samples if its variance were `pooled`; `own` is the
/// larger of that and what each half may know of the pixel itself.
fn doublings_of_halves(film: &Film, pixel: usize, wanted: f32, pooled: f32, own: [f32; 2], haste: Haste) -> [u32; 2] {
    // A half that falls far behind makes the other's samples worthless, yet one that follows is decided by its own data
    // after all, through the other's count: on the lognormal field of the tests a lag of at most one doubling costs
    // 0.50 % of the energy, two 0.24 %, any 0.14 % (each ± 0.12), on a caustic two cost 0.32 %, any 0.27 % (± 0.06),
    // for level samples (`benches/results/energy.md`).
    Half::BOTH.map(|half| {
        let taken = film.taken(pixel, half).max(1);
        let harder = if pooled > 0.0 { f64::from(own[half.index()] / pooled).max(1.0).sqrt() } else { 1.0 };
        let need = 0.5 * f64::from(wanted) * harder * confidence_margin(f64::from(taken));
        doublings_for(haste.margin * need / f64::from(taken), dither(film.width(), pixel), haste.most_doublings)
    })
}

/// Doublings for every pixel that shows so many times what it may, `excess` (no more than 1: none): as many as bring
/// that down and one more, since it is what a single pixel of the halves' difference says, while they are next to
/// nothing of the film's samples; else one.
///
/// Asked for one to three at once without regard to the excess, a lamp's edge took seven looks for six pixels
/// (`benches/results/equal-time.md`).
pub fn doubling_of(film: &Film, max_samples: u32, excess: impl Fn(usize) -> f64 + Sync) -> SamplePlan {
    let doublings = |pixel: usize, most: u32| {
        let excess = excess(pixel);
        let needed = (2.0 * excess.log2()).ceil() + 1.0;
        if excess > 1.0 { needed.min(f64::from(most)) as u32 } else { 0 }
    };
    let pixels = film.pixel_count();
    // Counted before it is made: four doublings of a whole picture would be hundreds of megabytes.
    let cost = |most: u32| -> u64 {
        (0..pixels).map(|pixel| ((1 << doublings(pixel, most)) - 1) * u64::from(film.samples(pixel))).sum()
    };
    let is_small = |&most: &u32| cost(most) <= film.total_samples() / SMALL_DOUBLING;
    let most = (2..=MAX_DOUBLINGS_OF_EXCESS).rev().find(is_small).unwrap_or(1);
    doubling_plan(film, max_samples, |pixel| [doublings(pixel, most); 2])
}

/// A plan of so many doublings of each half of each pixel, up to `max_samples`.
pub(super) fn doubling_plan(film: &Film, max_samples: u32, doublings: impl Fn(usize) -> [u32; 2] + Sync) -> SamplePlan {
    let of_pixel = |pixel: usize| {
        let doublings = doublings(pixel);
        Half::BOTH.into_iter().flat_map(move |half| {
            let taken = film.taken(pixel, half);
            doubled_blocks(pixel as u32, half, taken, max_samples).take(doublings[half.index()] as usize)
        })
    };
    let pixels = film.pixel_count();
    let blocks = (0..pixels).into_par_iter().with_min_len(PIXELS_PER_TASK).flat_map_iter(of_pixel).collect();
    SamplePlan { blocks }
}

/// How much more than the estimated need is asked for, against estimates that are low by chance. Pooling leaves few per
/// cent of scatter on well-behaved noise; what is left is for tails, and fades as samples come in.
fn confidence_margin(samples: f64) -> f64 {
    1.0 + 0.25 / samples.sqrt()
}

/// Doublings for a pixel that needs `ratio` times what it has: whole ones, and one more for a share of pixels such that
/// the mean of 1/n is 1/need.
fn doublings_for(ratio: f64, dither: f64, most: u32) -> u32 {
    if ratio.is_nan() || ratio <= 1.0 {
        return 0;
    }
    // The logarithm's floor, without one.
    let whole = (1..=most).take_while(|&doublings| ratio >= f64::from(1_u32 << doublings)).count() as u32;
    if whole == most {
        return whole;
    }
    let rest = ratio / f64::from(1 << whole);
    // share/(2n) + (1 − share)/n = 1/(rest·n)
    let share = 2.0 * (1.0 - 1.0 / rest);
    whole + u32::from(share > dither)
}

/// Thresholds of the four pixels of a quad.
fn dither(width: u32, pixel: usize) -> f64 {
    let (x, y) = (pixel % width as usize, pixel / width as usize);
    [[0.125, 0.625], [0.875, 0.375]][y % 2][x % 2]
}

#[cfg(test)]
mod tests;
