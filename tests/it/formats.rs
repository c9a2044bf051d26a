//! The same scene from several formats gives the same picture.

use crate::support::{loop_settings, trace_settings};
use fechner::adaptive::settings::Sampling;
use fechner::adaptive::{Quiet, render};
use fechner::integrator::PathTracer;
use fechner::scene::load::{LoadOptions, load};
use std::path::Path;
use std::sync::Arc;

const SIZE: u32 = 32;
/// Regions along each side.
const REGIONS: u32 = 4;

/// Mean and its variance of each channel of each region.
fn regions(file: &str, seed: u64) -> Vec<[f64; 2]> {
    let mut scene = load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file), &LoadOptions::default())
        .unwrap_or_else(|error| panic!("{error}"));
    scene.nits_per_unit = 1.0;
    let settings = loop_settings(1.0, Sampling::Uniform, 0.0, Some(128));
    let tracer = PathTracer::new(Arc::new(scene), trace_settings(SIZE, SIZE, seed));
    let rendered = render(&tracer, &settings, &Quiet).expect("the perception model takes the picture");
    let estimate = &rendered.judgement.estimate;
    let mut sums = vec![[0.0; 2]; (3 * REGIONS * REGIONS) as usize];
    let side = SIZE / REGIONS;
    for (i, rgb) in estimate.rgb_cd_m2.iter().enumerate() {
        let (x, y) = (i as u32 % SIZE, i as u32 / SIZE);
        let region = (y / side * REGIONS + x / side) as usize;
        let luminance = f64::from(estimate.luminance_cd_m2.values()[i]).max(1e-9);
        for (channel, value) in rgb.iter().enumerate() {
            let value = f64::from(*value);
            // Noise of one channel, in proportion to its share of luminance; red walls have little of the others.
            let share = value / luminance;
            sums[3 * region + channel][0] += value;
            sums[3 * region + channel][1] += f64::from(estimate.variance_of_mean.values()[i]) * share * share;
        }
    }
    let count = f64::from(side * side);
    sums.into_iter().map(|[sum, variance]| [sum / count, variance / (count * count)]).collect()
}

/// 48 Z tests a format, two-sided at 1e-4 together by Bonferroni: |z| below 5.
#[test]
fn the_cornell_box_is_the_same_in_three_formats() {
    let ours = regions("scenes/cornell-box.toml", 1);
    for (file, seed) in [("scenes/other-formats/cornell-box.pbrt", 2), ("scenes/other-formats/cornell-box.xml", 3)] {
        let theirs = regions(file, seed);
        let mut worst = 0.0_f64;
        for (place, (a, b)) in ours.iter().zip(&theirs).enumerate() {
            let z = (a[0] - b[0]) / (a[1] + b[1]).sqrt();
            worst = if z.abs() > worst.abs() { z } else { worst };
            assert!(
                z.abs() < 5.0,
                "{file}: region {}, channel {}: {} and {}, z = {z:.1}",
                place / 3,
                place % 3,
                a[0],
                b[0]
            );
        }
        println!("{file}: largest z {worst:.2}");
    }
}
