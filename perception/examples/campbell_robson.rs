//! A Campbell–Robson chart and the boundary that the model predicts for it.
//!
//! Frequency rises to the right, contrast falls upwards. Left half of the picture file: the chart; below it the same with
//! every pixel that the model calls visible tinted. The boundary of the tint should follow the edge of what you see.

mod support;

use fechner_perception::csf::ContrastSensitivity;
use fechner_perception::{CastleCsf, Display, Plane, ThresholdInputs, Viewing, threshold_map};

const WIDTH: usize = 1024;
const HEIGHT: usize = 512;
const GREY_CD_M2: f64 = 80.0;

/// Frequency in cpd at column `x`: 0.5 to 25.
fn freq_cpd(x: f64) -> f64 {
    0.5 * 50.0_f64.powf(x / WIDTH as f64)
}

/// Contrast at row `y`: 1 at the bottom, 1/400 at the top.
fn contrast(y: f64) -> f64 {
    400.0_f64.powf(-(1.0 - (y + 0.5) / HEIGHT as f64))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let viewing = Viewing { display: Display::preset("desktop").ok_or("no desktop")?, ..Viewing::default() };
    let ppd = viewing.display.pixels_per_degree;
    // Phase: the integral of frequency over the columns.
    let phase = |x: f64| std::f64::consts::TAU / ppd * freq_cpd(x) * WIDTH as f64 / 50.0_f64.ln();
    let wave = Plane::from_fn(WIDTH, HEIGHT, |x, y| (GREY_CD_M2 * contrast(y as f64) * phase(x as f64).sin()) as f32);
    let grey = Plane::filled(WIDTH, HEIGHT, GREY_CD_M2 as f32);
    let csf = CastleCsf::default();
    // On plain grey: the chart is the signal here and must not mask itself.
    let inputs = ThresholdInputs { display_luminance_cd_m2: &grey, guide_variance: None };
    let visibility = threshold_map(&inputs, &viewing, &csf)?.measured_visibility(&wave);

    let path = support::target("campbell_robson.png");
    image::RgbImage::from_fn(WIDTH as u32, 2 * HEIGHT as u32, |column, row| {
        let (x, y) = (column as usize, row as usize % HEIGHT);
        let shown = (f64::from(wave.get(x, y)) + GREY_CD_M2) / viewing.display.white_cd_m2;
        let code = (255.0 * viewing.display.eotf.encode(shown, viewing.display.white_cd_m2)).round() as u8;
        let is_tinted = row as usize >= HEIGHT && visibility.get(x, y) > 1.0;
        image::Rgb([code, code, if is_tinted { code / 2 } else { code }])
    })
    .save(&path)?;
    println!("{}", path.display());
    println!("  cpd   contrast at v = 1   1/S");
    for freq in [1.0_f64, 2.0, 4.0, 8.0, 16.0] {
        let x = (WIDTH as f64 * (freq / 0.5).ln() / 50.0_f64.ln()) as usize;
        let boundary = (0..HEIGHT).find(|&y| visibility.get(x, y) > 1.0).map_or(f64::NAN, |y| contrast(y as f64));
        println!("{freq:5}   {boundary:17.4}   {:.4}", 1.0 / csf.sensitivity(freq, GREY_CD_M2));
    }
    Ok(())
}
