//! Metrics that no arm optimises: FLIP, ColorVideoVDP, relative mean squared error.

use anyhow::{Context, Result};
use colorvideovdp::{Color, Cvvdp, DisplayModel, Execution, Geometry, Image, Options, Photometry};
use fechner_perception::{Display, Eotf};
use flip_rs::{RgbImage, Weighting, ldr_flip};

/// How far a picture is from the reference by other people's measures.
#[derive(Clone, Copy, Debug)]
pub struct Metrics {
    /// Mean of LDR-FLIP.
    pub flip_mean: f64,
    /// 99th percentile of LDR-FLIP.
    pub flip_p99: f64,
    /// ColorVideoVDP's just-objectionable differences, at most 10.
    pub jod: f64,
    /// Mean of squared error over squared reference, on displayed light.
    pub relmse: f64,
}

/// Measures a picture as the display shows it against the reference shown there: linear RGB, 0..1, row-major, `width`
/// pixels a row.
///
/// # Errors
/// Where the two are not of one size, or too small for a metric.
pub fn measure(display: &Display, width: usize, reference: &[[f32; 3]], picture: &[[f32; 3]]) -> Result<Metrics> {
    let height = reference.len() / width;
    let encoded = |picture: &[[f32; 3]]| {
        let code = |&light: &f32| Eotf::Srgb.encode(f64::from(light), display.white_cd_m2) as f32;
        picture.iter().flatten().map(code).collect::<Vec<f32>>()
    };
    let flip = ldr_flip(
        &RgbImage::new(width, height, encoded(reference))?,
        &RgbImage::new(width, height, encoded(picture))?,
        display.pixels_per_degree as f32,
    )?;
    let image = |picture: &[[f32; 3]]| {
        let light = display.rgb_cd_m2(picture).into_iter().flatten().collect();
        Image::new(width, height, 3, light)
    };
    let prediction = color_video_vdp(display, [width, height])?
        .predict_image(&image(picture)?, &image(reference)?, Color::Linear)
        .context("ColorVideoVDP refuses the pictures")?;
    Ok(Metrics {
        flip_mean: f64::from(flip.statistics().mean),
        flip_p99: f64::from(flip.percentile(0.99, Weighting::Unweighted)?),
        jod: f64::from(prediction.jod),
        relmse: relative_mean_squared_error(reference, picture),
    })
}

/// ColorVideoVDP's just-objectionable differences between two sequences of displayed light, linear RGB in cd/m².
pub(crate) fn video_jod(
    display: &Display,
    size: (usize, usize),
    frames_per_second: f64,
    [test, reference]: [Vec<Vec<f32>>; 2],
) -> Result<f64> {
    let images = |frames: Vec<Vec<f32>>| {
        frames.into_iter().map(|light| Image::new(size.0, size.1, 3, light)).collect::<Result<Vec<Image>, _>>()
    };
    let prediction = color_video_vdp(display, [size.0, size.1])?
        .predict_video(&images(test)?, &images(reference)?, frames_per_second as f32, Color::Linear)
        .context("ColorVideoVDP refuses the frames")?;
    Ok(f64::from(prediction.jod))
}

fn color_video_vdp(display: &Display, size: [usize; 2]) -> Result<Cvvdp> {
    let contrast = display.white_cd_m2 / display.black_cd_m2.max(display.white_cd_m2 * 1e-6);
    let model = DisplayModel::new(
        "fechner",
        Photometry::new(display.white_cd_m2, contrast, 0.0, 0.0, 1.0)?,
        Geometry::from_ppd(size, display.pixels_per_degree)?,
        "BT.709-linear",
    )?;
    Ok(Cvvdp::new(model, Options::default().with_execution(Execution::SingleThread))?)
}

/// Mean of (test − reference)² / (reference² + 0.01²).
fn relative_mean_squared_error(reference: &[[f32; 3]], test: &[[f32; 3]]) -> f64 {
    let terms = reference.iter().flatten().zip(test.iter().flatten());
    let sum: f64 = terms
        .map(|(&reference, &test)| {
            let (reference, test) = (f64::from(reference), f64::from(test));
            (test - reference).powi(2) / (reference * reference + 1e-4)
        })
        .sum();
    sum / (3 * reference.len()) as f64
}
