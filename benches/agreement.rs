//! Does the picture agree with Mitsuba 3's, pixel by pixel? A t test with both renderers' own scatter.
//!
//! `cargo bench --bench agreement` renders each scene with ten seeds by each renderer (`python3`, or
//! `FECHNER_MITSUBA_PYTHON`, must have Mitsuba) and tests in every pixel whether the two means of ten luminances
//! differ (two-sided t test, 18 degrees of freedom). If the renderers agree, a share α of the pixels is beyond the
//! critical value of α. The ratio of the pictures' means stands with its standard error, from the scatter of the
//! seeds. A map of t is written to `benches/cache/agreement`: red where ours is brighter, blue where Mitsuba's is.

#[path = "support/mod.rs"]
mod support;

use anyhow::{Context, Result, bail};
use fechner::film::Film;
use fechner::integrator::{BlockWork, PathTracer, SamplePlan, TraceSettings};
use fechner::sampler::{Half, PixelFilter};
use fechner::scene::{ColorInput, Material, MaterialId, Roughness, Scene, Surface};
use fechner_perception::photometry::luminance;
use glam::Vec3;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::path::Path;
use std::sync::Arc;
use support::peer::{MAX_DEPTH, Mitsuba, write_scene};
use support::{cornell_box, textured_cave};

const SIZE: u32 = 128;
const SEEDS: u32 = 10;
/// Doublings of the 8 + 8 samples of a pilot: 64 samples a pixel and seed.
const LEVELS: u8 = 3;
const SIGNIFICANCES: [f64; 3] = [0.05, 0.01, 0.001];

fn main() -> Result<()> {
    println!("| scene | pixels beyond t at 5 % | at 1 % | at 0.1 % | mean ours / Mitsuba |");
    println!("| --- | --- | --- | --- | --- |");
    let glass = Surface::Dielectric {
        ior: 1.5,
        roughness: Roughness::SMOOTH,
        transmittance: ColorInput::constant(Vec3::ONE),
        absorption: Vec3::ZERO,
    };
    let copper = Surface::Conductor {
        eta: Vec3::new(0.200, 0.924, 1.102),
        k: Vec3::new(3.912, 2.452, 2.142),
        tint: ColorInput::constant(Vec3::ONE),
        roughness: Roughness::SMOOTH,
    };
    compare("Cornell box, diffuse", "diffuse", cornell_box()?)?;
    compare("Cornell box, copper ball", "copper", with_ball(cornell_box()?, copper))?;
    compare("Cornell box, glass ball", "glass", with_ball(cornell_box()?, glass))?;
    compare("textured cave", "cave", textured_cave())
}

/// The scene with its ball made of something else.
fn with_ball(mut scene: Scene, surface: Surface) -> Scene {
    let id = MaterialId(scene.materials.len() as u32);
    let white = scene.materials[scene.spheres[0].material.0 as usize].clone();
    scene.materials.push(Material { surface, ..white });
    scene.spheres[0].material = id;
    scene
}

/// Mean and variance of one value over the seeds.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    mean: f64,
    m2: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        let before = value - self.mean;
        self.mean += before / self.count;
        self.m2 += before * (value - self.mean);
    }

    /// Of the mean.
    fn variance(&self) -> f64 {
        self.m2 / (self.count - 1.0) / self.count
    }
}

/// All pixels and the picture's mean over the seeds.
struct Pictures {
    pixels: Vec<Moments>,
    whole: Moments,
}

impl Pictures {
    fn new() -> Self {
        Self { pixels: vec![Moments::default(); (SIZE * SIZE) as usize], whole: Moments::default() }
    }

    fn add(&mut self, luminances: &[f64]) {
        for (moments, &value) in self.pixels.iter_mut().zip(luminances) {
            moments.add(value);
        }
        self.whole.add(luminances.iter().sum::<f64>() / luminances.len() as f64);
    }
}

fn compare(title: &str, name: &str, scene: Scene) -> Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/cache/agreement").join(name);
    write_scene(&scene, &folder)?;
    let Some(mut mitsuba) = Mitsuba::start(&folder, SIZE)? else { bail!("nothing to compare with") };
    let scene = Arc::new(scene);
    let (mut ours, mut theirs) = (Pictures::new(), Pictures::new());
    for seed in 0..SEEDS {
        ours.add(&render(&scene, u64::from(seed)));
        let peer = mitsuba.render(16 << (LEVELS - 1), seed, 2)?;
        ours_like(&mut theirs, &peer.pixels);
    }
    let t_values: Vec<f64> = ours.pixels.iter().zip(&theirs.pixels).filter_map(|(a, b)| t_value(a, b)).collect();
    let student = StudentsT::new(0.0, 1.0, 2.0 * f64::from(SEEDS) - 2.0).context("degrees of freedom above 0")?;
    let shares = SIGNIFICANCES.map(|significance| {
        let critical = student.inverse_cdf(1.0 - significance / 2.0);
        t_values.iter().filter(|t| t.abs() > critical).count() as f64 / t_values.len() as f64
    });
    let ratio = ours.whole.mean / theirs.whole.mean;
    let relative = |m: &Moments| m.variance() / (m.mean * m.mean);
    let error = ratio * (relative(&ours.whole) + relative(&theirs.whole)).sqrt();
    let percent = shares.map(|share| format!("{:.2} %", 100.0 * share));
    println!("| {title} | {} | {ratio:.5} ± {error:.5} |", percent.join(" | "));
    write_map(&folder.join("t.png"), &ours.pixels, &theirs.pixels)
}

fn ours_like(pictures: &mut Pictures, pixels: &[[f32; 3]]) {
    let luminances: Vec<f64> = pixels.iter().map(|rgb| f64::from(luminance(*rgb))).collect();
    pictures.add(&luminances);
}

/// One picture of ours: its luminances.
fn render(scene: &Arc<Scene>, seed: u64) -> Vec<f64> {
    let settings =
        TraceSettings { max_depth: MAX_DEPTH, filter: PixelFilter::Box, ..TraceSettings::new(SIZE, SIZE, seed) };
    let levels = (0..SIZE * SIZE)
        .flat_map(|pixel| Half::BOTH.into_iter().flat_map(move |half| (0..LEVELS).map(move |l| (pixel, half, l))));
    let plan = SamplePlan { blocks: levels.map(|(pixel, half, level)| BlockWork::whole(pixel, half, level)).collect() };
    let mut film = Film::new(SIZE, SIZE);
    PathTracer::new(scene.clone(), settings).trace(&plan, &mut film, &|_| {});
    film.estimate(1.0).luminance_cd_m2.values().iter().map(|&y| f64::from(y)).collect()
}

/// `None` where neither renderer scatters.
fn t_value(a: &Moments, b: &Moments) -> Option<f64> {
    let variance = a.variance() + b.variance();
    (variance > 0.0).then(|| (a.mean - b.mean) / variance.sqrt())
}

fn write_map(file: &Path, ours: &[Moments], theirs: &[Moments]) -> Result<()> {
    let bytes = ours.iter().zip(theirs).flat_map(|(a, b)| {
        let t = t_value(a, b).unwrap_or(0.0);
        let strength = (t.abs() / 5.0).min(1.0);
        let (strong, weak) = (255.0, 255.0 * (1.0 - strength));
        let rgb = if t > 0.0 { [strong, weak, weak] } else { [weak, weak, strong] };
        rgb.map(|v: f64| v as u8)
    });
    let picture = image::RgbImage::from_raw(SIZE, SIZE, bytes.collect()).context("a value a pixel")?;
    Ok(picture.save(file)?)
}
