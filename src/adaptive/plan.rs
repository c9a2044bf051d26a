//! Which pixels get how many more samples. Decisions only: nothing here traces.
//!
//! Counts double, because trickles would be decided by luck. Where the need of a pixel lies between two doublings, the
//! two are mixed over 2×2 quads so that the mean of 1/n, which is what the eye's pooling sees, is right: rounding up
//! alone would cost 1.44 times the samples.

use super::judge::Judgement;
use super::settings::{AllocationRule, Limits};
use crate::film::Film;
use crate::integrator::{BlockWork, PILOT_SAMPLES, SamplePlan};
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::allocation::{AllocationProblem, allocate};

/// Doublings that one plan gives a pixel at most: its variance, and what stratification makes of it, are looked at again
/// in between, since stratification pays more the more samples there are.
const MOST_DOUBLINGS_AT_ONCE: u32 = 1;

/// The same where the pixels are so few that their samples do not count.
const MOST_DOUBLINGS_OF_A_HANDFUL: u32 = 3;

/// The first samples of every pixel: 8 + 8, or as many as `max_samples` allows.
pub fn pilot_plan(pixels: u32, max_samples: u32) -> SamplePlan {
    let mut plan = SamplePlan::default();
    for pixel in 0..pixels {
        for half in Half::BOTH {
            let share = (max_samples + 1 - half.index() as u32) / 2;
            let samples = PILOT_SAMPLES.min(share);
            if samples > 0 {
                plan.blocks.push(BlockWork { samples, ..BlockWork::whole(pixel, half, 0) });
            }
        }
    }
    plan
}

/// Doubles every pixel, up to `mean_samples` a pixel in all. Empty when they are there.
pub fn uniform_plan(film: &Film, mean_samples: u32) -> SamplePlan {
    let mut plan = SamplePlan::default();
    for pixel in 0..film.width() * film.height() {
        for half in Half::BOTH {
            let taken = film.half(half)[pixel as usize].taken;
            let wanted = (mean_samples + 1 - half.index() as u32) / 2;
            if wanted > taken {
                let block = BlockWork::rest(pixel, half, taken);
                plan.blocks.push(BlockWork { samples: block.samples.min(wanted - taken), ..block });
            }
        }
    }
    plan
}

/// How many samples each pixel should have in all for a visibility, if its variance were that of its neighbours.
///
/// # Errors
/// Only if the allocation refuses the judgement's maps, which would be a defect of ours.
pub fn wanted_samples(
    judgement: &Judgement,
    rule: AllocationRule,
    visibility: f64,
    limits: &Limits,
) -> Result<Plane, fechner_perception::Error> {
    let least = f64::from(limits.pilot_samples);
    let most = f64::from(limits.max_samples).max(least);
    let variance = &judgement.pooled_variance_per_sample;
    if rule == AllocationRule::Convex && judgement.pixel_thresholds.is_none() {
        let allocation = allocate(&AllocationProblem {
            variance_per_sample: variance,
            thresholds: &judgement.thresholds,
            cost: &Plane::filled(variance.width(), variance.height(), 1.0),
            tolerance: judgement.importance.as_ref(),
            visibility,
            min_samples: least,
            max_samples: most,
        })?;
        return Ok(allocation.samples);
    }
    let allowed = judgement.allowed_standard_error_cd_m2();
    Ok(Plane::from_fn(variance.width(), variance.height(), |x, y| {
        let standard_error = f64::from(allowed.get(x, y)) * visibility;
        (f64::from(variance.get(x, y)) / (standard_error * standard_error)).clamp(least, most) as f32
    }))
}

/// Doublings for pixels that have fewer samples than `wanted`.
///
/// Each half scales its share by what the other half knows of the pixel itself (counts go as the standard deviation,
/// Neyman 1934).
pub fn adaptive_plan(film: &Film, judgement: &Judgement, wanted: &Plane, max_samples: u32) -> SamplePlan {
    doubling_plan(film, max_samples, |pixel| {
        let pooled = judgement.pooled_variance_per_sample.values()[pixel];
        let own = judgement.variance_per_sample.each_ref().map(|plane| plane.values()[pixel]);
        doublings_of_halves(film, pixel, wanted.values()[pixel], pooled, own)
    })
}

/// Doublings of both halves of a pixel that should have `wanted` samples if its variance were `pooled`; `own` is the larger of
/// that and what each half may know of the pixel itself.
fn doublings_of_halves(film: &Film, pixel: usize, wanted: f32, pooled: f32, own: [f32; 2]) -> [u32; 2] {
    let doublings = Half::BOTH.map(|half| {
        let taken = film.half(half)[pixel].taken.max(1);
        let harder = if pooled > 0.0 { f64::from(own[half.index()] / pooled).max(1.0).sqrt() } else { 1.0 };
        let need = 0.5 * f64::from(wanted) * harder * confidence_margin(f64::from(taken));
        doublings_for(need / f64::from(taken), dither(film.width(), pixel))
    });
    // A half that falls far behind makes the other's samples worthless, yet one that follows closely is decided by its own
    // data after all, through the other's count: on the lognormal field of the tests a lag of one doubling costs 0.50 % of
    // the energy, two 0.24 %, none that is bounded 0.14 % (each ± 0.12).
    let after = |half: Half| u64::from(film.half(half)[pixel].taken) << doublings[half.index()];
    Half::BOTH.map(|half| {
        let is_far_behind = 8 * after(half) <= after(half.other());
        doublings[half.index()] + u32::from(is_far_behind)
    })
}

/// One doubling for every pixel of a mask; more at once, up to three, where that is next to nothing of the film's samples. A look
/// at the picture costs about a sample for every pixel: several of them for a handful of pixels would be most of the work.
pub fn doubling_of(film: &Film, max_samples: u32, mask: impl Fn(usize) -> bool) -> SamplePlan {
    let pixels = (film.width() * film.height()) as usize;
    let masked: u64 = (0..pixels).filter(|&pixel| mask(pixel)).map(|pixel| u64::from(film.samples(pixel))).sum();
    let is_small = |doublings: &u32| ((1 << doublings) - 1) * masked <= film.total_samples() / 256;
    let doublings = (2..=MOST_DOUBLINGS_OF_A_HANDFUL).rev().find(is_small).unwrap_or(1);
    doubling_plan(film, max_samples, |pixel| [if mask(pixel) { doublings } else { 0 }; 2])
}

fn doubling_plan(film: &Film, max_samples: u32, doublings: impl Fn(usize) -> [u32; 2]) -> SamplePlan {
    let mut plan = SamplePlan::default();
    for pixel in 0..(film.width() * film.height()) as usize {
        let doublings = doublings(pixel);
        for half in Half::BOTH {
            let mut taken = film.half(half)[pixel].taken;
            for _ in 0..doublings[half.index()] {
                let rest = BlockWork::rest(pixel as u32, half, taken);
                // A pilot may have been a part of the first block.
                let block = BlockWork { samples: rest.samples.min(taken.max(1)), ..rest };
                taken += block.samples;
                if taken > max_samples / 2 {
                    break;
                }
                plan.blocks.push(block);
            }
        }
    }
    plan
}

/// How much more than the estimated need is asked for, against estimates that are low by chance. Pooling leaves few per
/// cent of scatter on well-behaved noise; what is left is for tails, and fades as samples come in.
fn confidence_margin(samples: f64) -> f64 {
    1.0 + 0.25 / samples.sqrt()
}

/// Doublings for a pixel that needs `ratio` times what it has: whole ones, and one more for a share of pixels such that
/// the mean of 1/n is 1/need.
fn doublings_for(ratio: f64, dither: f64) -> u32 {
    if ratio.is_nan() || ratio <= 1.0 {
        return 0;
    }
    let whole = ratio.log2().floor().min(f64::from(MOST_DOUBLINGS_AT_ONCE)) as u32;
    if whole == MOST_DOUBLINGS_AT_ONCE {
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

/// Cuts a plan into up to 16 that each hold one pixel of every 4×4 block (or of every quad, for 4), so that a limit of
/// time can end between them and still leave an even picture. A slice is at most about an eighth of what was traced
/// before: how much depends on counts alone, never on a clock.
pub fn slices(plan: SamplePlan, width: u32, traced_samples: u64) -> Vec<SamplePlan> {
    /// Order in which the pixels of a 4×4 block are visited: neighbours far apart in time (Bayer 1973).
    const BAYER: [[usize; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];
    let eighths = plan.samples() / (traced_samples / 8).max(1);
    let count = match eighths {
        0..=1 => return vec![plan],
        2..=4 => 4,
        _ => 16,
    };
    let mut slices = vec![SamplePlan::default(); count];
    for block in plan.blocks {
        let (x, y) = (block.pixel % width, block.pixel / width);
        let place = BAYER[y as usize % 4][x as usize % 4];
        slices[place * count / 16].blocks.push(block);
    }
    slices.retain(|s| !s.blocks.is_empty());
    slices
}

/// Cuts a plan to a budget: the blocks of pixels with the largest `urgency` first.
pub fn cut_to_budget(plan: SamplePlan, urgency: &Plane, samples: u64) -> SamplePlan {
    let mut blocks = plan.blocks;
    let urgency = |b: &BlockWork| urgency.values()[b.pixel as usize];
    blocks.sort_by(|a, b| urgency(b).total_cmp(&urgency(a)).then(a.pixel.cmp(&b.pixel)).then(a.level.cmp(&b.level)));
    let mut left = samples;
    blocks.retain(|b| {
        let fits = u64::from(b.samples) <= left;
        if fits {
            left -= u64::from(b.samples);
        }
        fits
    });
    // A block of a later level must not come without the one before it.
    blocks.sort_by_key(|b| (b.pixel, b.half, b.level));
    let mut kept: Vec<BlockWork> = Vec::with_capacity(blocks.len());
    for block in blocks {
        let follows =
            kept.last().is_some_and(|k| k.pixel == block.pixel && k.half == block.half && k.level + 1 == block.level);
        let is_first = plan_first_level(&kept, &block);
        if follows || is_first {
            kept.push(block);
        }
    }
    SamplePlan { blocks: kept }
}

/// Whether no earlier block of the same pixel and half stands before this one.
fn plan_first_level(kept: &[BlockWork], block: &BlockWork) -> bool {
    kept.last().is_none_or(|k| (k.pixel, k.half) != (block.pixel, block.half))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::statistics::{SampleStatistics, scene_units};
    use crate::film::BlockSum;
    use crate::integrator::{FirstHit, PathSample};
    use crate::sampler::hash_words;
    use glam::Vec3;

    /// Over a quad, the mean of 1/n is that of the need to within the four steps of the dither.
    #[test]
    fn mixing_two_counts_meets_the_need() {
        for ratio in [1.05, 1.2, 1.5, 1.9, 2.0] {
            let inverse: f64 = [0.125, 0.375, 0.625, 0.875]
                .map(|d| 1.0 / f64::from(1u32 << doublings_for(ratio, d)))
                .iter()
                .sum::<f64>()
                / 4.0;
            assert!((inverse * ratio - 1.0).abs() < 0.15, "ratio {ratio}: {}", inverse * ratio);
        }
        assert_eq!(doublings_for(1.0, 0.0), 0);
        assert_eq!(doublings_for(f64::NAN, 0.0), 0);
        assert_eq!(doublings_for(1e9, 0.9), MOST_DOUBLINGS_AT_ONCE);
    }

    fn constant_block(samples: u32) -> BlockSum {
        let first_hit = FirstHit { albedo: Vec3::ONE, normal: Vec3::Z, depth: 1.0, object_id: 1 };
        let mut sum = BlockSum::default();
        (0..samples).for_each(|_| sum.add(&PathSample { radiance: Vec3::ONE, first_hit, rays: 1 }));
        sum
    }

    /// Pieces of any size take up a half's sequence without a gap or an overlap.
    #[test]
    fn the_rest_of_a_doubling_follows_on() {
        for step in [1u32, 3, 8, 13] {
            let mut taken = 0;
            let mut seen = std::collections::BTreeSet::new();
            while taken < 128 {
                let rest = BlockWork::rest(0, Half::A, taken);
                let samples = rest.samples.min(step);
                assert!((rest.first..rest.first + samples).all(|index| seen.insert((rest.level, index))));
                taken += samples;
            }
            let complete = (0..128).all(|i: u32| {
                let level = if i < 8 { 0 } else { 1 + (i / 8).ilog2() as u8 };
                seen.contains(&(level, if level == 0 { i } else { i - (8 << (level - 1)) }))
            });
            assert!(complete, "pieces of {step}");
        }
    }

    /// A handful of pixels is doubled three times at once, a picture once, and never beyond what a pixel may have.
    #[test]
    fn handfuls_are_not_looked_at_after_each_doubling() {
        let mut film = Film::new(64, 64);
        for block in pilot_plan(64 * 64, 16).blocks {
            film.merge_block(block, &constant_block(block.samples));
        }
        assert_eq!(doubling_of(&film, 1 << 16, |pixel| pixel == 70).samples(), 7 * 16);
        assert_eq!(doubling_of(&film, 1 << 16, |pixel| pixel < 5).samples(), 5 * 3 * 16);
        assert_eq!(doubling_of(&film, 1 << 16, |_| true).samples(), 64 * 64 * 16);
        assert_eq!(doubling_of(&film, 40, |pixel| pixel == 70).samples(), 16);
        assert!(doubling_of(&film, 1 << 16, |_| false).blocks.is_empty());
    }

    #[test]
    fn a_uniform_plan_takes_exactly_what_is_asked() {
        for spp in [1u32, 2, 7, 16, 17, 100, 256] {
            let mut film = Film::new(3, 2);
            let mut taken = 0;
            let mut plan = pilot_plan(6, spp);
            while !plan.blocks.is_empty() {
                taken += plan.samples();
                for block in &plan.blocks {
                    film.merge_block(*block, &constant_block(block.samples));
                }
                plan = uniform_plan(&film, spp);
            }
            assert_eq!(taken, u64::from(spp) * 6, "{spp} spp");
        }
    }

    /// The count rule on flat fields of 96×96 pixels whose standard error should become 1/32 of the samples' deviation: mean
    /// count over the right one (1024), pixels that stop below half of it, and energy lost. Gaussian noise, a lognormal of
    /// coefficient of variation 4, and fireflies that hold 10 % of the energy in one sample of 1000.
    #[test]
    fn counts_can_be_trusted_on_heavy_tails() {
        type Draw = fn(f64, f64) -> f64;
        let gaussian: Draw = |u, v| 4.0 + (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos();
        let lognormal: Draw = |u, v| {
            let sigma = 17f64.ln().sqrt();
            (sigma * (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos() - 0.5 * sigma * sigma).exp()
        };
        let fireflies: Draw = |u, v| 0.9 * (0.5 + v) + if u < 1e-3 { 100.0 } else { 0.0 };
        let fields: [(&str, Draw, f64, f64, f64); 3] = [
            ("gaussian", gaussian, 4.0, 1.0, 0.0),
            ("lognormal", lognormal, 1.0, 16.0, 0.01),
            ("fireflies", fireflies, 1.0, 10.0 + 0.81 / 12.0 - 0.01, 0.03),
        ];
        for (name, draw, mean, variance, most_below) in fields {
            let film = stopped_film(96, draw, variance / 1024.0);
            let counts: Vec<f64> = (0..96 * 96).map(|i| f64::from(film.samples(i))).collect();
            let ratio = counts.iter().sum::<f64>() / 1024.0 / counts.len() as f64;
            let below = counts.iter().filter(|&&n| n < 512.0).count() as f64 / counts.len() as f64;
            let picture = film.estimate(1.0).luminance_cd_m2;
            let bias = picture.mean() / mean - 1.0;
            let standard_error = (variance / counts.iter().sum::<f64>()).sqrt() / mean;
            println!(
                "{name}: n/n_req {ratio:.2}, below half {:.2} %, bias {:+.2} ± {:.2} %",
                100.0 * below,
                100.0 * bias,
                100.0 * standard_error
            );
            assert!((0.95..1.8).contains(&ratio), "{name}: {ratio}");
            assert!(below <= most_below, "{name}: {below}");
            assert!(bias.abs() < 0.003 + 3.3 * standard_error, "{name}: bias {bias}");
        }
    }

    /// Samples a field until the count rule asks for no more.
    fn stopped_film(size: u32, draw: fn(f64, f64) -> f64, variance_of_mean: f64) -> Film {
        let mut film = Film::new(size, size);
        let mut plan = pilot_plan(size * size, 16);
        while !plan.blocks.is_empty() {
            for block in &plan.blocks {
                film.merge_block(*block, &drawn_block(*block, draw));
            }
            let statistics = SampleStatistics::of(&film, &scene_units(&film));
            let luminance = statistics.luminance();
            plan = doubling_plan(&film, 1 << 16, |i| {
                let factor = luminance.low_discrepancy_factor.values()[i];
                let pooled = luminance.pooled.values()[i] * factor;
                let own = luminance.for_half.each_ref().map(|plane| plane.values()[i] * factor);
                doublings_of_halves(&film, i, pooled / variance_of_mean as f32, pooled, own)
            });
        }
        film
    }

    fn drawn_block(block: BlockWork, draw: fn(f64, f64) -> f64) -> BlockSum {
        let first_hit = FirstHit { albedo: Vec3::ONE, normal: Vec3::Z, depth: 1.0, object_id: 1 };
        let mut sum = BlockSum::default();
        let key = hash_words(u64::from(block.pixel) << 8 | u64::from(block.level), block.half.index() as u64);
        for index in block.first..block.first + block.samples {
            let random =
                |d: u64| ((hash_words(key, u64::from(index) * 2 + d) >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
            let radiance = Vec3::splat(draw(random(0), random(1)) as f32);
            sum.add(&PathSample { radiance, first_hit, rays: 1 });
        }
        sum
    }

    #[test]
    fn slices_hold_the_whole_plan_and_spread_evenly() {
        let plan = pilot_plan(64, 16);
        for (traced, count) in [(u64::MAX, 1), (plan.samples() * 2, 4), (0, 16)] {
            let parts = slices(plan.clone(), 8, traced);
            assert_eq!(parts.len(), count);
            assert!(parts.iter().all(|p| p.samples() * count as u64 == plan.samples()));
            let mut blocks: Vec<_> = parts.into_iter().flat_map(|p| p.blocks).collect();
            blocks.sort_by_key(|b| (b.pixel, b.half));
            assert_eq!(blocks, plan.blocks);
        }
    }
}
