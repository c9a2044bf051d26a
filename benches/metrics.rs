//! FLIP and ColorVideoVDP of two PNG files by the crates that `fechner bench` uses, to be held against their authors'
//! programs.
//!
//! `cargo bench --bench metrics -- REFERENCE.png TEST.png` prints one line; `benches/peers/metrics_check.py` calls it
//! and prints the difference to `flip-evaluator` and `cvvdp` from PyPI.

use anyhow::{Context, Result};
use colorvideovdp::{Color, Cvvdp, DisplayModel, Execution, Image, Options};
use flip_rs::{RgbImage, ldr_flip};

/// For both: FLIP's default is 67, the display of ColorVideoVDP names its own.
const PIXELS_PER_DEGREE: f32 = 60.0;
const DISPLAY: &str = "standard_4k";

fn main() -> Result<()> {
    let files: Vec<String> = std::env::args().skip(1).filter(|argument| argument.ends_with(".png")).collect();
    let [reference, test] = &files[..] else {
        eprintln!("usage: cargo bench --bench metrics -- REFERENCE.png TEST.png");
        return Ok(());
    };
    let open = |path: &String| image::open(path).map(|picture| picture.into_rgb8()).with_context(|| path.clone());
    let (reference, test) = (open(reference)?, open(test)?);
    let (width, height) = (reference.width() as usize, reference.height() as usize);
    let flip = ldr_flip(
        &RgbImage::new(width, height, reference.as_raw().clone())?,
        &RgbImage::new(test.width() as usize, test.height() as usize, test.as_raw().clone())?,
        PIXELS_PER_DEGREE,
    )?;
    let codes = |picture: &image::RgbImage| {
        let values = picture.as_raw().iter().map(|&code| f32::from(code) / 255.0).collect();
        Image::new(picture.width() as usize, picture.height() as usize, 3, values)
    };
    let metric =
        Cvvdp::new(DisplayModel::from_name(DISPLAY)?, Options::default().with_execution(Execution::SingleThread))?;
    let prediction = metric.predict_image(&codes(&test)?, &codes(&reference)?, Color::Srgb)?;
    println!("flip {:.7} jod {:.6}", flip.statistics().mean, prediction.jod);
    Ok(())
}
