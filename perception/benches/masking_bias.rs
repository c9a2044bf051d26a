//! What noise does to masks: m(guide) / m(reference), the elevation of thresholds that a path tracer's guide gives
//! over that of the picture without noise. Above 1, noise hides noise; below 1, a render stops later than it could.
//!
//! A wall with three parts (flat; texture in the albedo, which the guide's filter is told of; texture in the light,
//! which it is not), log-normal noise whose standard deviation for one sample is the pixel's own luminance, and 4 to
//! 1024 samples. Printed are the median over each part of m from the denoised guide, given its variance before
//! denoising (what a render uses), with all of that taken out, and as if it were clean; and from the noisy mean, its
//! variance taken out, and as if it were clean.

use fechner_perception::guide::{GuideInputs, denoise};
use fechner_perception::photometry::luminance;
use fechner_perception::{CastleCsf, GuideNoise, Plane, ThresholdInputs, Viewing, threshold_map};

const WIDTH: usize = 480;
const HEIGHT: usize = 240;
const PARTS: [&str; 3] = ["flat", "texture in the albedo", "texture in the light"];

/// Part of a column; the ends of each part are left out of the figures.
fn part(x: usize) -> usize {
    x * PARTS.len() / WIDTH
}

/// 2 and 4 cpd at 60 pixels a degree.
fn texture(x: usize, y: usize) -> f32 {
    let phase = std::f32::consts::TAU / 60.0;
    let (x, y) = (x as f32, y as f32);
    (4.0 * phase * x).cos() * (4.0 * phase * y).cos() + (2.0 * phase * (x + y)).cos()
}

fn albedo(x: usize, y: usize) -> f32 {
    if part(x) == 1 { 0.5 * (1.0 + 0.3 * texture(x, y)) } else { 0.5 }
}

fn light(x: usize, y: usize) -> f32 {
    100.0 * if part(x) == 2 { 1.0 + 0.3 * texture(x, y) } else { 1.0 }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let truth = Plane::from_fn(WIDTH, HEIGHT, |x, y| albedo(x, y) * light(x, y));
    let reference = elevation(&truth, GuideNoise::Clean)?;
    println!("median elevation without noise: {}", medians(&reference).map(|m| format!("{m:.3}")).join(", "));
    println!("m / m(reference), samples: {}", PARTS.join(", "));
    for samples in [4, 16, 64, 256, 1024] {
        let variance = truth.map(|value| value * value / samples as f32);
        let noisy = noisy(&truth, samples);
        let guide = denoised(&noisy, &variance);
        let ratios = |map: &Plane| {
            let ratio = Plane::from_fn(WIDTH, HEIGHT, |x, y| map.get(x, y) / reference.get(x, y));
            medians(&ratio).map(|m| format!("{m:.3}")).join(", ")
        };
        for (what, picture, noise) in [
            ("guide, variance before", &guide, GuideNoise::BeforeDenoising(&variance)),
            ("guide, all taken out", &guide, GuideNoise::White(&variance)),
            ("guide, taken as clean", &guide, GuideNoise::Clean),
            ("noisy, variance known", &noisy, GuideNoise::White(&variance)),
            ("noisy, taken as clean", &noisy, GuideNoise::Clean),
        ] {
            println!("{samples:5}  {what:22}  {}", ratios(&elevation(picture, noise)?));
        }
    }
    Ok(())
}

fn elevation(picture: &Plane, guide_noise: GuideNoise<&Plane>) -> Result<Plane, fechner_perception::Error> {
    let inputs = ThresholdInputs { display_luminance_cd_m2: picture, guide_noise };
    Ok(threshold_map(&inputs, &Viewing::default(), &CastleCsf::default())?.masking_elevation())
}

fn medians(map: &Plane) -> [f64; 3] {
    [0, 1, 2].map(|wanted| {
        let inside = |x: usize| {
            part(x) == wanted && part(x.saturating_sub(30)) == wanted && part((x + 30).min(WIDTH - 1)) == wanted
        };
        let mut values: Vec<f32> =
            (0..HEIGHT).flat_map(|y| (0..WIDTH).filter(|x| inside(*x)).map(move |x| map.get(x, y))).collect();
        let middle = values.len() / 2;
        f64::from(*values.select_nth_unstable_by(middle, f32::total_cmp).1)
    })
}

/// The mean of `samples` log-normal samples, each of standard deviation 1 times its mean.
fn noisy(truth: &Plane, samples: u32) -> Plane {
    let sigma = std::f64::consts::LN_2.sqrt();
    let mut state = 20_u64;
    let mut result = truth.clone();
    for value in result.values_mut() {
        let sum: f64 = (0..samples).map(|_| (sigma * normal(&mut state) - 0.5 * sigma * sigma).exp()).sum();
        *value *= (sum / f64::from(samples)) as f32;
    }
    result
}

/// Box and Muller on a 64-bit congruential generator.
fn normal(state: &mut u64) -> f64 {
    let mut uniform = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    let (a, b) = (uniform(), uniform());
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

fn denoised(noisy: &Plane, variance: &Plane) -> Plane {
    let rgb: Vec<[f32; 3]> = noisy.values().iter().map(|value| [*value; 3]).collect();
    let pixels = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    let albedo: Vec<[f32; 3]> = pixels.map(|(x, y)| [albedo(x, y); 3]).collect();
    let guide = denoise(&GuideInputs {
        rgb: &rgb,
        variance,
        albedo: &albedo,
        normal: &vec![[0.0, 0.0, 1.0]; rgb.len()],
        depth: &vec![1.0; rgb.len()],
        width: WIDTH,
        height: HEIGHT,
    });
    Plane::from_fn(WIDTH, HEIGHT, |x, y| luminance(guide[y * WIDTH + x]))
}
