//! The rules of today's renderers, on the same tracer and sampler, for comparison.
//!
//! They look at every 16 samples, as Cycles does, and know neither display nor eye: `exposure` is all that they are
//! told. Not for use: each has a knob without a unit, and stops dark regions and fireflies early.

use super::StopReason;
use super::plan::{blocks_between, by_chance, cut_to_budget, share_of_half};
use super::settings::RivalRule;
use crate::film::{Film, HalfPixel};
use crate::integrator::SamplePlan;
use crate::sampler::{Half, hash_words, unit_f64_of_hash};

/// Samples between two looks, both halves together.
const STEP: u32 = 16;
/// Cycles multiplies its threshold by this.
const RELATIVE_SCALE: f64 = 5.0;
/// Cycles adds this to what it divides by (`film_adaptive_sampling_convergence_check`).
const RELATIVE_EPSILON: f64 = 1e-4;
/// Least mean to divide by, as a share of display white.
const MIN_MEAN: f64 = 1e-3;
/// Side of the square of pixels whose samples Tungsten pools.
const RECORD_SIDE: usize = 4;
/// Quantile of records' errors at which Tungsten clamps them (`errorPercentile95`).
const CLAMPED_AT: f64 = 0.95;
/// Tungsten's least squared mean to divide by.
const MIN_SQUARED_MEAN: f64 = 1e-3;

/// The next samples by a rule, `left` in all at most; empty when the rule would stop. `exposure` turns scene units
/// into shares of display white.
pub fn rival_plan(rule: RivalRule, film: &Film, exposure: f64, left: u64, max_samples: u32) -> SamplePlan {
    let plan = match rule {
        RivalRule::Relative { threshold } => {
            step_where(film, max_samples, left, &relative_active(film, threshold, exposure))
        }
        RivalRule::Variance { threshold } => {
            step_where(film, max_samples, left, &variance_active(film, threshold, exposure))
        }
        RivalRule::Budget => budget_pass(film, exposure, left, max_samples),
    };
    if plan.samples() <= left {
        return plan;
    }
    cut_to_budget(plan, by_chance(film), left)
}

/// Why [`rival_plan`] has none: with the same arguments it was empty.
pub fn rival_stop(rule: RivalRule, film: &Film, exposure: f64, left: u64) -> StopReason {
    let pixels = film.pixel_count() as u64;
    if rule == RivalRule::Budget && left < pixels {
        return StopReason::Samples;
    }
    let would_go_on = !rival_plan(rule, film, exposure, left, u32::MAX).blocks.is_empty();
    if would_go_on { StopReason::MaxSamples } else { StopReason::Rule }
}

/// Takes `samples` of a pixel, half of them in each half, through as many doublings as they reach.
fn push_samples(plan: &mut SamplePlan, film: &Film, pixel: usize, samples: u32) {
    for half in Half::BOTH {
        let taken = film.taken(pixel, half);
        let wanted = taken.saturating_add(share_of_half(samples, half));
        plan.blocks.extend(blocks_between(pixel as u32, half, taken, wanted));
    }
}

/// A step for each pixel that is active, or as much of one as it may have; what is left goes evenly where it is
/// too little for whole ones.
fn step_where(film: &Film, max_samples: u32, left: u64, active: &[bool]) -> SamplePlan {
    let allowed = |pixel: usize| max_samples.saturating_sub(film.samples(pixel));
    let may_have = |&pixel: &usize| active[pixel] && allowed(pixel) > 0;
    let pixels: Vec<usize> = (0..active.len()).filter(may_have).collect();
    let step = (left / pixels.len().max(1) as u64).clamp(1, u64::from(STEP)) as u32;
    let mut plan = SamplePlan::default();
    pixels.into_iter().for_each(|pixel| push_samples(&mut plan, film, pixel, step.min(allowed(pixel))));
    plan
}

/// Cycles' test: |I − A| summed over RGB, over S where the RGB sum S is at least 1 and over √S below, with its least
/// count of max(4, ⌈16 / threshold^0.3⌉) samples and its 3×3 dilation.
fn relative_active(film: &Film, threshold: f64, exposure: f64) -> Vec<bool> {
    let least = (16.0 / threshold.powf(0.3)).ceil().max(4.0);
    let (a, b) = (film.half(Half::A), film.half(Half::B));
    let fails = |i: usize| {
        let error: f64 = a[i].mean.iter().zip(b[i].mean).map(|(a, b)| 0.5 * (a - b).abs() * exposure).sum();
        let sum: f64 = a[i].mean.iter().zip(b[i].mean).map(|(a, b)| 0.5 * (a + b) * exposure).sum();
        let norm = if sum < 1.0 { sum.max(0.0).sqrt() } else { sum };
        f64::from(film.samples(i)) < least || error > threshold * RELATIVE_SCALE * (RELATIVE_EPSILON + norm)
    };
    dilated(&(0..a.len()).map(fails).collect::<Vec<_>>(), film.width() as usize)
}

fn dilated(mask: &[bool], width: usize) -> Vec<bool> {
    let height = mask.len() / width;
    let any_near = |i: usize| {
        let (x, y) = (i % width, i / width);
        (y.saturating_sub(1)..(y + 2).min(height))
            .any(|v| (x.saturating_sub(1)..(x + 2).min(width)).any(|u| mask[v * width + u]))
    };
    (0..mask.len()).map(any_near).collect()
}

/// Relative standard error of the pixel by its own samples.
fn variance_active(film: &Film, threshold: f64, exposure: f64) -> Vec<bool> {
    let is_active = |pixel: usize| {
        let halves = film.halves(pixel);
        let mean = halves.mean(HalfPixel::luminance);
        halves.variance_of_mean(0).sqrt() > threshold * mean.max(MIN_MEAN / exposure)
    };
    (0..film.pixel_count()).map(is_active).collect()
}

/// One pass of Tungsten's: as many samples as 16 a pixel, one everywhere and the others in proportion to each record's
/// error, which is clamped at [`CLAMPED_AT`] and dilated; fractions are rounded by chance.
fn budget_pass(film: &Film, exposure: f64, left: u64, max_samples: u32) -> SamplePlan {
    let pixels = film.pixel_count();
    let pass = left.min(u64::from(STEP) * pixels as u64);
    let mut plan = SamplePlan::default();
    if pass < pixels as u64 {
        return plan;
    }
    let errors = record_errors(film, exposure);
    let total: f64 = errors.iter().sum();
    let spread = (pass - pixels as u64) as f64;
    for (pixel, error) in errors.iter().enumerate() {
        let share = if total > 0.0 { error / total } else { 1.0 / pixels as f64 };
        let random = unit_f64_of_hash(hash_words(film.total_samples(), pixel as u64));
        let samples = 1 + (spread * share + random) as u32;
        push_samples(&mut plan, film, pixel, samples.min(max_samples.saturating_sub(film.samples(pixel))));
    }
    plan
}

/// Error of each pixel's record.
fn record_errors(film: &Film, exposure: f64) -> Vec<f64> {
    let (width, height) = (film.width() as usize, film.height() as usize);
    let (columns, rows) = (width.div_ceil(RECORD_SIDE), height.div_ceil(RECORD_SIDE));
    let records: Vec<f64> = (0..columns * rows)
        .map(|r| {
            let (left, top) = (r % columns * RECORD_SIDE, r / columns * RECORD_SIDE);
            let pixels = (top..(top + RECORD_SIDE).min(height))
                .flat_map(|y| (left..(left + RECORD_SIDE).min(width)).map(move |x| y * width + x));
            record_error(film, pixels, exposure)
        })
        .collect();
    let mut sorted = records.clone();
    sorted.sort_by(f64::total_cmp);
    let clamp = sorted[(CLAMPED_AT * (sorted.len() - 1) as f64) as usize];
    let dilated = |r: usize| {
        let (x, y) = (r % columns, r / columns);
        (y.saturating_sub(1)..(y + 2).min(rows))
            .flat_map(|v| (x.saturating_sub(1)..(x + 2).min(columns)).map(move |u| v * columns + u))
            .map(|near| records[near].min(clamp))
            .fold(0.0, f64::max)
    };
    let spread: Vec<f64> = (0..records.len()).map(dilated).collect();
    (0..width * height).map(|i| spread[i / width / RECORD_SIDE * columns + i % width / RECORD_SIDE]).collect()
}

/// Variance of all samples in a record over their number and squared mean.
fn record_error(film: &Film, pixels: impl Iterator<Item = usize>, exposure: f64) -> f64 {
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for pixel in pixels {
        for half in Half::BOTH {
            let of_half = &film.half(half)[pixel];
            let (n, mean) = (f64::from(of_half.samples), of_half.luminance() * exposure);
            count += n;
            sum += n * mean;
            squares += f64::from(of_half.m2[0]) * exposure * exposure + n * mean * mean;
        }
    }
    if count < 2.0 {
        return 0.0;
    }
    let mean = sum / count;
    let variance = ((squares - count * mean * mean) / (count - 1.0)).max(0.0);
    variance / (count * (mean * mean).max(MIN_SQUARED_MEAN))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::plan::pilot_plan;
    use crate::film::BlockSum;
    use crate::integrator::{BlockWork, PathSample};
    use crate::sampler::unit_of_hash;
    use glam::Vec3;

    /// A film whose left half is noise of standard deviation `noise` about 0.5, and whose right half is flat.
    fn film(noise: f32) -> Film {
        let mut film = Film::new(32, 16);
        for block in pilot_plan(&film, 16).blocks {
            extend(&mut film, block, noise);
        }
        film
    }

    fn extend(film: &mut Film, block: BlockWork, noise: f32) {
        let mut sum = BlockSum::default();
        for index in block.first..block.first + block.samples {
            let key = u64::from(block.pixel) << 32 | u64::from(block.level) << 24 | u64::from(index);
            let u = unit_of_hash(hash_words(key, block.half.index() as u64)) - 0.5;
            let value = if block.pixel % 32 < 16 { 0.5 + noise * u * 12f32.sqrt() } else { 0.5 };
            sum.add(&PathSample::of_wall(Vec3::splat(value)));
        }
        film.merge_block(block, &sum);
    }

    /// Each rule spends on the noisy half alone (but for the least counts), and stops.
    #[test]
    fn rules_spend_where_the_noise_is_and_stop() {
        for rule in [RivalRule::Relative { threshold: 0.01 }, RivalRule::Variance { threshold: 0.02 }] {
            let mut film = film(0.3);
            loop {
                let plan = rival_plan(rule, &film, 1.0, u64::MAX, 1 << 16);
                if plan.blocks.is_empty() {
                    break;
                }
                for block in plan.blocks {
                    extend(&mut film, block, 0.3);
                }
            }
            let mean = |columns: std::ops::Range<usize>| {
                let count = columns.len() as f64 * 16.0;
                (0..16)
                    .flat_map(|y| columns.clone().map(move |x| y * 32 + x))
                    .map(|i| f64::from(film.samples(i)))
                    .sum::<f64>()
                    / count
            };
            let (noisy, flat) = (mean(0..15), mean(18..32));
            assert!(noisy > 2.0 * flat, "{rule:?}: {noisy} and {flat} samples");
            if let RivalRule::Variance { threshold } = rule {
                let right = (0.3 / 0.5 / threshold).powi(2);
                assert!((noisy / right - 1.0).abs() < 0.1, "{noisy} samples, not {right}");
            }
        }
    }

    #[test]
    fn a_budget_is_spent_and_no_more() {
        let mut film = film(0.3);
        for _ in 0..100 {
            let left = (128 * 512u64).saturating_sub(film.total_samples());
            let plan = rival_plan(RivalRule::Budget, &film, 1.0, left, 1 << 16);
            if plan.blocks.is_empty() {
                break;
            }
            for block in plan.blocks {
                extend(&mut film, block, 0.3);
            }
        }
        let mean = film.total_samples() as f64 / 512.0;
        assert!((126.0..=128.0).contains(&mean), "{mean} samples a pixel");
        assert!(film.samples(5 * 32 + 5) > 3 * film.samples(5 * 32 + 28));
    }

    /// A rule is satisfied where it asks for no more, not where a pixel may have no more.
    #[test]
    fn the_most_samples_satisfy_no_rule() {
        let film = film(0.3);
        let relative = |threshold: f64| RivalRule::Relative { threshold };
        assert!(rival_plan(relative(1e-4), &film, 1.0, u64::MAX, 16).blocks.is_empty(), "all have 16");
        assert_eq!(rival_stop(relative(1e-4), &film, 1.0, u64::MAX), StopReason::MaxSamples);
        // Its least count is 16 from threshold 1 on.
        assert_eq!(rival_stop(relative(10.0), &film, 1.0, u64::MAX), StopReason::Rule);
        assert_eq!(rival_stop(RivalRule::Budget, &film, 1.0, u64::MAX), StopReason::MaxSamples);
        assert_eq!(rival_stop(RivalRule::Budget, &film, 1.0, 511), StopReason::Samples, "less than a sample a pixel");
    }

    /// The last step goes as far as a pixel may.
    #[test]
    fn a_step_beyond_the_most_samples_is_cut() {
        let film = film(0.3);
        for (most, added) in [(16, 0), (17, 1), (23, 7), (32, 16), (1 << 16, 16)] {
            let plan = rival_plan(RivalRule::Relative { threshold: 1e-9 }, &film, 1.0, u64::MAX, most);
            assert_eq!(plan.samples(), added * 512, "16 samples a pixel, {most} at the most");
        }
    }

    /// What a budget leaves is less than a step: all active pixels have some of it, and it is not exceeded.
    #[test]
    fn a_step_beyond_the_budget_is_cut() {
        let film = film(0.3);
        for rule in [RivalRule::Relative { threshold: 1e-4 }, RivalRule::Variance { threshold: 1e-4 }] {
            let active = rival_plan(rule, &film, 1.0, u64::MAX, 1 << 16).samples() / u64::from(STEP);
            for left in [active / 2, active, 4 * active + 3] {
                let plan = rival_plan(rule, &film, 1.0, left, 1 << 16);
                assert!(plan.samples() <= left && 20 * plan.samples() > 19 * left - 80, "{} of {left}", plan.samples());
                let rows = (0..16).filter(|row| plan.blocks.iter().any(|block| block.pixel / 32 == *row)).count();
                assert_eq!(rows, 16, "{rule:?}: {left} samples in {rows} rows");
            }
        }
    }
}
