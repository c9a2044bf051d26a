//! What a frame of the live preview costs: its sRGB bytes, by our table and by `powf`, and its JPEG, by the encoder
//! that is used and by the `image` crate's.
//!
//! `cargo bench --bench frames -- PICTURE.png ...` prints a row for each picture: milliseconds of one thread (best of
//! 15, in turn; the table's with its dither, `powf`'s without), bytes, and the JPEG's root mean square error in steps
//! of 8 bits.

use anyhow::{Context, Result};
use fechner::output::encode_srgb8;
use fechner_perception::eotf::{srgb_from_linear, srgb_to_linear};
use image::{ExtendedColorType, ImageEncoder, RgbImage};
use std::time::Instant;

/// The preview's.
const QUALITY: u8 = 92;
const ROUNDS: u32 = 15;

fn main() -> Result<()> {
    println!(
        "| picture | size | powf, ms | table, ms | ratio | image, ms | jpeg-encoder, ms | ratio | bytes | error |"
    );
    println!("| --- |{}", " --- |".repeat(9));
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    for path in std::env::args().skip(1).filter(|argument| argument.ends_with(".png")) {
        let picture = image::open(&path).with_context(|| path.clone())?.into_rgb8();
        let linear: Vec<[f32; 3]> =
            picture.pixels().map(|pixel| pixel.0.map(|byte| srgb_to_linear(f32::from(byte) / 255.0))).collect();
        let (mut by_powf, mut by_table) = (f64::INFINITY, f64::INFINITY);
        let (mut theirs, mut ours) = (f64::INFINITY, f64::INFINITY);
        let [mut by_image, mut by_ours] = [Vec::new(), Vec::new()];
        let mut codes = Vec::new();
        for _ in 0..ROUNDS {
            by_powf = by_powf.min(milliseconds(&mut codes, |bytes| {
                bytes.extend(linear.iter().flatten().map(|&value| (srgb_from_linear(value) * 255.0 + 0.5) as u8));
                Ok(())
            })?);
            by_table = by_table.min(milliseconds(&mut codes, |bytes| {
                *bytes = encode_srgb8(picture.width(), &linear);
                Ok(())
            })?);
            theirs = theirs.min(milliseconds(&mut by_image, |bytes| image_jpeg(&picture, bytes))?);
            ours = ours.min(milliseconds(&mut by_ours, |bytes| preview_jpeg(&picture, bytes))?);
        }
        println!(
            "| {path} | {}×{} | {by_powf:.2} | {by_table:.2} | {:.2} | {theirs:.2} | {ours:.2} | {:.2} | {} → {} | {:.2} → {:.2} |",
            picture.width(),
            picture.height(),
            by_table / by_powf,
            ours / theirs,
            by_image.len(),
            by_ours.len(),
            error(&picture, &by_image)?,
            error(&picture, &by_ours)?,
        );
    }
    Ok(())
}

fn milliseconds(bytes: &mut Vec<u8>, encode: impl Fn(&mut Vec<u8>) -> Result<()>) -> Result<f64> {
    bytes.clear();
    let begun = Instant::now();
    encode(bytes)?;
    Ok(1e3 * begun.elapsed().as_secs_f64())
}

fn image_jpeg(picture: &RgbImage, bytes: &mut Vec<u8>) -> Result<()> {
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(bytes, QUALITY);
    Ok(encoder.write_image(picture.as_raw(), picture.width(), picture.height(), ExtendedColorType::Rgb8)?)
}

/// As `preview::screen` does.
fn preview_jpeg(picture: &RgbImage, bytes: &mut Vec<u8>) -> Result<()> {
    let mut encoder = jpeg_encoder::Encoder::new(bytes, QUALITY);
    encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::R_4_4_4);
    let (width, height) = (picture.width().try_into()?, picture.height().try_into()?);
    Ok(encoder.encode(picture.as_raw(), width, height, jpeg_encoder::ColorType::Rgb)?)
}

fn error(picture: &RgbImage, jpeg: &[u8]) -> Result<f64> {
    let shown = image::load_from_memory(jpeg)?.into_rgb8();
    let square = |(a, b): (&u8, &u8)| (f64::from(*a) - f64::from(*b)).powi(2);
    let sum: f64 = shown.as_raw().iter().zip(picture.as_raw()).map(square).sum();
    Ok((sum / picture.as_raw().len() as f64).sqrt())
}
