//! Plans that double, mix, cut and trust.

use super::*;
use crate::adaptive::statistics::{SampleStatistics, scene_units};
use crate::film::BlockSum;
use crate::integrator::PathSample;
use crate::sampler::hash_words;
use glam::Vec3;

/// Over a quad, the mean of 1/n is that of the need to within the four steps of the dither.
#[test]
fn mixing_two_counts_meets_the_need() {
    for ratio in [1.05, 1.2, 1.5, 1.9, 2.0] {
        let inverse: f64 = [0.125, 0.375, 0.625, 0.875]
            .map(|d| 1.0 / f64::from(1u32 << doublings_for(ratio, d, 1)))
            .iter()
            .sum::<f64>()
            / 4.0;
        assert!((inverse * ratio - 1.0).abs() < 0.15, "ratio {ratio}: {}", inverse * ratio);
    }
    assert_eq!(doublings_for(1.0, 0.0, 1), 0);
    assert_eq!(doublings_for(f64::NAN, 0.0, 1), 0);
    assert_eq!(doublings_for(1e9, 0.9, 3), 3);
}

fn constant_block(samples: u32) -> BlockSum {
    let mut sum = BlockSum::default();
    (0..samples).for_each(|_| sum.add(&PathSample::of_wall(Vec3::ONE)));
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

/// A handful of pixels is doubled as often as what it shows asks for, a picture once, and none beyond what a pixel may
/// have.
#[test]
fn handfuls_are_not_looked_at_after_each_doubling() {
    let mut film = Film::new(64, 64);
    for block in pilot_plan(&film, 16).blocks {
        film.merge_block(block, &constant_block(block.samples));
    }
    let added = |max_samples: u32, pixels: usize, excess: f64| {
        doubling_of(&film, max_samples, |pixel| if pixel < pixels { excess } else { 1.0 }).samples() / 16
    };
    assert_eq!(added(1 << 16, 1, 1.3), 3, "two doublings: the one that is needed, and one more");
    assert_eq!(added(1 << 16, 1, 1.9), 7, "three");
    assert_eq!(added(1 << 16, 1, f64::INFINITY), 15, "four at most");
    assert_eq!(added(1 << 16, 20, 100.0), 20 * 3, "two: three would be more than a 32nd of the film");
    assert_eq!(added(1 << 16, 64 * 64, 100.0), 64 * 64, "one");
    let up_to = |most: u32| doubling_of(&film, most, |pixel| if pixel == 0 { 100.0 } else { 1.0 }).samples();
    assert_eq!(
        [16, 17, 18, 40, 41, 48].map(up_to),
        [0, 1, 2, 24, 25, 32],
        "no pixel may have more, nor is it left short"
    );
    assert_eq!(added(1 << 16, 1, f64::NAN) + added(1 << 16, 64 * 64, 1.0), 0, "nothing shows");
}

/// What does not fit takes what would follow it along, and leaves its place to others.
#[test]
fn a_budget_leaves_no_gap_in_a_sequence() {
    let block = |pixel, level, samples| BlockWork { samples, ..BlockWork::whole(pixel, Half::A, level) };
    let plan = SamplePlan { blocks: vec![block(0, 1, 8), block(0, 2, 4), block(1, 1, 5), block(1, 2, 2)] };
    let urgency = |block: &BlockWork| if block.pixel == 0 { 2.0 } else { 1.0 };
    let kept = |samples: u64| -> Vec<(u32, u8)> {
        cut_to_budget(plan.clone(), urgency, samples).blocks.iter().map(|block| (block.pixel, block.level)).collect()
    };
    assert_eq!(kept(3), []);
    assert_eq!(kept(7), [(1, 1), (1, 2)], "4 would fit, and would be the second half of nothing");
    assert_eq!(kept(14), [(0, 1), (0, 2)], "so would 2");
    assert_eq!(kept(19).len(), 4);
}

/// What is no multiple of the pixels is spread by chance, whatever single pixels had before. Regression: the last rows
/// of stars had 16 samples a pixel where all others had 19.
#[test]
fn an_even_plan_leaves_no_rows_out() {
    const SIDE: u32 = 32;
    let mut film = Film::new(SIDE, SIDE);
    for block in pilot_plan(&film, 16).blocks {
        film.merge_block(block, &constant_block(block.samples));
    }
    for (samples, most) in [(0, 0), (1, 1), (500, 1), (1024, 1), (4000, 4), (4096, 4), (5119, 5)] {
        let plan = even_plan(&film, samples, 1 << 16);
        assert_eq!(plan.samples(), samples);
        let mut of_pixels = vec![0; film.pixel_count()];
        plan.blocks.iter().for_each(|block| of_pixels[block.pixel as usize] += block.samples);
        let least = (samples / 1024) as u32;
        assert!(of_pixels.iter().all(|pixel| (least..=most).contains(pixel)), "{samples} samples");
        let mean = samples as f64 / 1024.0;
        for row in of_pixels.chunks(SIDE as usize) {
            let of_row = f64::from(row.iter().sum::<u32>()) / f64::from(SIDE);
            assert!((of_row - mean).abs() < 0.35, "{samples} samples: {of_row} a pixel in a row");
        }
    }
    assert_eq!(even_plan(&film, 4000, 17).samples(), 1024, "up to the most that a pixel may have");
}

#[test]
fn a_uniform_plan_takes_exactly_what_is_asked() {
    for spp in [1u32, 2, 7, 16, 17, 100, 256] {
        let mut film = Film::new(3, 2);
        let mut taken = 0;
        let mut plan = pilot_plan(&film, spp);
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

/// The count rule on flat fields of 96×96 pixels whose standard error should become 1/32 of the samples' deviation:
/// mean count over the right one (1024), pixels that stop below half of it, and energy lost. Gaussian noise, a
/// lognormal of coefficient of variation 4, and fireflies that hold 10 % of the energy in one sample of 1000.
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
    let mut plan = pilot_plan(&film, 16);
    while !plan.blocks.is_empty() {
        for block in &plan.blocks {
            film.merge_block(*block, &drawn_block(*block, draw));
        }
        let scale = scene_units(&film);
        let statistics = SampleStatistics::of(&film, &scale);
        let luminance = statistics.luminance();
        let halves = Half::BOTH.map(|half| statistics.for_half(&film, &scale[0], half, 0));
        plan = doubling_plan(&film, 1 << 16, |i| {
            let factor = luminance.low_discrepancy_factor.values()[i];
            let pooled = luminance.pooled.values()[i] * factor;
            let own = halves.each_ref().map(|plane| plane.values()[i] * factor);
            doublings_of_halves(&film, i, pooled / variance_of_mean as f32, pooled, own, Haste::NONE)
        });
    }
    film
}

fn drawn_block(block: BlockWork, draw: fn(f64, f64) -> f64) -> BlockSum {
    let mut sum = BlockSum::default();
    let key = hash_words(u64::from(block.pixel) << 8 | u64::from(block.level), block.half.index() as u64);
    for index in block.first..block.first + block.samples {
        let random = |d: u64| ((hash_words(key, u64::from(index) * 2 + d) >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
        let radiance = Vec3::splat(draw(random(0), random(1)) as f32);
        sum.add(&PathSample::of_wall(radiance));
    }
    sum
}

#[test]
fn slices_hold_the_whole_plan_and_spread_evenly() {
    let of_pixel = |pixel: u32| Half::BOTH.map(|half| BlockWork::whole(pixel, half, 0));
    let plan = SamplePlan { blocks: (0..64).flat_map(of_pixel).collect() };
    for (traced, count) in [(u64::MAX, 1), (plan.samples() * 2, 4), (0, 16)] {
        let parts = slices(plan.clone(), 8, traced);
        assert_eq!(parts.len(), count);
        assert!(parts.iter().all(|p| p.samples() * count as u64 == plan.samples()));
        let mut blocks: Vec<_> = parts.into_iter().flat_map(|p| p.blocks).collect();
        blocks.sort_by_key(|b| (b.pixel, b.half));
        assert_eq!(blocks, plan.blocks);
    }
}
