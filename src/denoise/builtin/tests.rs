//! Tests what the denoiser keeps and what it takes away.

use super::*;
use crate::denoise::Denoiser;
use crate::sampler::{hash_words, unit_of_hash};
use fechner_perception::Plane;

const SIDE: usize = 48;

fn denoised(picture: &NoisyPicture<'_>) -> Vec<[f32; 3]> {
    Denoiser::Builtin.denoise(picture).expect("cannot fail")
}

fn random(x: usize, y: usize) -> f32 {
    2.0 * unit_of_hash(hash_words(x as u64, y as u64)) - 1.0
}

fn pixels() -> impl Iterator<Item = (usize, usize)> {
    (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE))
}

/// A wall of albedo 0.5, seen from the front, that does not shine.
fn wall_guides() -> SurfaceGuides {
    SurfaceGuides {
        width: SIDE,
        height: SIDE,
        albedo: vec![[0.5; 3]; SIDE * SIDE],
        normal: vec![[0.0, 0.0, 1.0]; SIDE * SIDE],
        depth: vec![1.0; SIDE * SIDE],
        shines: vec![false; SIDE * SIDE],
        samples: 16.0,
        samples_of_picture: 16.0,
    }
}

/// Two walls that meet at a column of pixels which see both, under noise of 20 %.
fn corner() -> Vec<[f32; 3]> {
    let rgb: Vec<[f32; 3]> = pixels().map(|(x, y)| [100.0 + 34.0 * random(x, y); 3]).collect();
    let normal = pixels().map(|(x, _)| match x.cmp(&24) {
        std::cmp::Ordering::Less => [1.0, 0.0, 0.0],
        std::cmp::Ordering::Equal => [0.5, 0.5, 0.0],
        std::cmp::Ordering::Greater => [0.0, 1.0, 0.0],
    });
    let guides = SurfaceGuides { normal: normal.collect(), ..wall_guides() };
    let guides = Denoiser::Builtin.prepare(guides).expect("cannot fail");
    denoised(&NoisyPicture { rgb: &rgb, variance: &Plane::filled(SIDE, SIDE, 400.0), guides: &guides })
}

/// A wall of which each pixel is told its light and its variance.
fn wall(guides: SurfaceGuides, pixel: impl Fn(usize, usize) -> (f32, f32) + Sync) -> Vec<f32> {
    let rgb: Vec<[f32; 3]> = pixels().map(|(x, y)| [pixel(x, y).0; 3]).collect();
    let guides = Denoiser::Builtin.prepare(guides).expect("cannot fail");
    let variance = Plane::from_fn(SIDE, SIDE, |x, y| pixel(x, y).1);
    denoised(&NoisyPicture { rgb: &rgb, variance: &variance, guides: &guides }).iter().map(|rgb| rgb[1]).collect()
}

/// The wall's guides with other albedos.
fn of_albedo(albedo: impl Fn(usize, usize) -> f32) -> SurfaceGuides {
    SurfaceGuides { albedo: pixels().map(|(x, y)| [albedo(x, y); 3]).collect(), ..wall_guides() }
}

fn deviation(values: &[f32], truth: impl Fn(usize, usize) -> f32) -> f32 {
    let squares = values.iter().enumerate().map(|(i, value)| (value - truth(i % SIDE, i / SIDE)).powi(2));
    (squares.sum::<f32>() / values.len() as f32).sqrt()
}

/// Bricks four pixels wide and two high under noise of 20 % (variance of 34 times a uniform number in −1..1).
#[test]
fn bricks_stay_and_noise_goes() {
    let albedo = |x: usize, y: usize| if (x / 4 + y / 2).is_multiple_of(2) { 0.4 } else { 0.6 };
    let lit = |x: usize, y: usize| 200.0 * albedo(x, y);
    let denoised = wall(of_albedo(albedo), |x, y| (lit(x, y) + 34.0 * random(x, y), 400.0));
    let left = deviation(&denoised, lit);
    assert!(left < 3.0, "{left} of 20, and bricks 20 to each side of their mean");
}

/// The mirror image of a lamp, as noisy as it is bright, stays where it is.
#[test]
fn a_highlight_does_not_spread() {
    let is_bright = |x: usize, y: usize| (20..24).contains(&x) && (20..24).contains(&y);
    let pixel = |x: usize, y: usize| {
        if is_bright(x, y) { (1e4 * (1.0 + 0.5 * random(x, y)), 1e7) } else { (100.0 + 17.0 * random(x, y), 100.0) }
    };
    let denoised = wall(wall_guides(), pixel);
    let around = (0..SIDE * SIDE).filter(|i| !is_bright(i % SIDE, i / SIDE)).map(|i| denoised[i]);
    let brightest = around.fold(0.0_f32, f32::max);
    assert!(brightest < 500.0, "{brightest} of 10,000");
}

/// A lamp of one column and the wall beside it: neither takes of the other.
#[test]
fn a_lamp_keeps_its_light() {
    let pixel = |x: usize, y: usize| if x == SIDE / 2 { (2e3, 4e6) } else { (100.0 + 17.0 * random(x, y), 100.0) };
    let shines = pixels().map(|(x, _)| x == SIDE / 2).collect();
    let denoised = wall(SurfaceGuides { shines, ..wall_guides() }, pixel);
    for (i, &value) in denoised.iter().enumerate() {
        let expected = if i % SIDE == SIDE / 2 { 2e3..=2e3 } else { 70.0..=130.0 };
        assert!(expected.contains(&value), "{value} in column {}", i % SIDE);
    }
}

/// Numbers that are none, or too large to square, are nobody's neighbours' fault.
#[test]
fn what_is_broken_stays_finite() {
    let broken = [f32::NAN, f32::INFINITY, -1.0, 1e38];
    let pixel = |x: usize, y: usize| match (x, y) {
        (10, 0..4) => (broken[y], 100.0),
        (20, 0..4) => (100.0, broken[y]),
        _ => (100.0 + 17.0 * random(x, y), 100.0),
    };
    let denoised = wall(of_albedo(|x, y| if x == 30 && y < 4 { broken[y] } else { 0.5 }), pixel);
    assert!(denoised.iter().all(|value| value.is_finite()));
    let far = &denoised[(SIDE - 1) * SIDE..];
    assert!(far.iter().all(|value| (80.0..120.0).contains(value)), "{far:?}");
}

#[test]
fn pixels_on_an_edge_are_denoised_along_it() {
    let denoised = corner();
    let column: Vec<f32> = (4..SIDE - 4).map(|y| denoised[y * SIDE + 24][0]).collect();
    let mean = column.iter().sum::<f32>() / column.len() as f32;
    let deviation = (column.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / column.len() as f32).sqrt();
    assert!(deviation < 8.0, "{deviation} of 20");
}

/// Two of them, as uncertain as light is of which one sample in sixteen made all.
#[test]
fn fireflies_side_by_side_are_spread() {
    let is_firefly = |x: usize, y: usize| y == 10 && (x == 10 || x == 11);
    let pixel = |x: usize, y: usize| {
        if is_firefly(x, y) { (1e5, 1e10) } else { (100.0 + 34.0 * random(x, y), 400.0) }
    };
    let denoised = wall(wall_guides(), pixel);
    let most = denoised.iter().copied().fold(0.0_f32, f32::max);
    assert!(most < 500.0, "{most} of 100,000");
}

/// Equal bytes on any number of threads.
#[test]
fn threads_change_nothing() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(corner)
    };
    assert_eq!(on(1), on(3));
}
