//! A Campbell–Robson chart and the boundary that the model predicts for it.
//!
//! Frequency rises to the right from 0.5 to 20 cpd, contrast falls upwards from 1 to 1/400. Above, the chart, for 60
//! pixels a degree; below it the same with every place that the model calls visible tinted, and 1/S of castleCSF as a
//! line. The tint should end at the line, and there where you stop seeing bars.

#[path = "support/target.rs"]
mod target;

use fechner_perception::csf::ContrastSensitivity;
use fechner_perception::{CastleCsf, Display, Plane, ThresholdInputs, Viewing, threshold_map};

const WIDTH: usize = 1024;
const HEIGHT: usize = 512;
/// Columns on either side that are judged and not shown: at a picture's border the eye's filters see its mirror image.
const MARGIN: usize = 64;
const GREY_CD_M2: f64 = 80.0;
const LOWEST_CPD: f64 = 0.5;
/// Highest shown frequency over the lowest.
const SPAN: f64 = 40.0;

/// Frequency in cpd at column `x` of what is shown.
fn freq_cpd(x: f64) -> f64 {
    LOWEST_CPD * SPAN.powf(x / WIDTH as f64)
}

/// Contrast at row `y`: 1 at the bottom, 1/400 at the top.
fn contrast(y: f64) -> f64 {
    400.0_f64.powf(-(1.0 - (y + 0.5) / HEIGHT as f64))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let viewing = Viewing { display: Display::preset("desktop").ok_or("no desktop")?, ..Viewing::default() };
    let ppd = viewing.display.pixels_per_degree;
    // Phase: the integral of frequency over the columns.
    let phase = |x: f64| std::f64::consts::TAU / ppd * freq_cpd(x) * WIDTH as f64 / SPAN.ln();
    let wave = Plane::from_fn(WIDTH + 2 * MARGIN, HEIGHT, |column, y| {
        (GREY_CD_M2 * contrast(y as f64) * phase(column as f64 - MARGIN as f64).sin()) as f32
    });
    let grey = Plane::filled(wave.width(), HEIGHT, GREY_CD_M2 as f32);
    let csf = CastleCsf::default();
    // On plain grey: the chart is the signal here and must not mask itself.
    let inputs = ThresholdInputs::clean(&grey);
    let visibility = threshold_map(&inputs, &viewing, &csf)?.measured_visibility(&wave);
    let row_of_threshold = |x: usize| {
        let threshold = 1.0 / csf.sensitivity(freq_cpd(x as f64), GREY_CD_M2);
        HEIGHT as f64 * (1.0 + threshold.ln() / 400.0_f64.ln()) - 0.5
    };

    let path = target::target("campbell_robson.png");
    image::RgbImage::from_fn(WIDTH as u32, 2 * HEIGHT as u32, |column, row| {
        let (x, y) = (column as usize, row as usize % HEIGHT);
        let is_below = row as usize >= HEIGHT;
        if is_below && (y as f64 - row_of_threshold(x)).abs() < 1.0 {
            return image::Rgb([170, 30, 30]);
        }
        let shown = (f64::from(wave.get(x + MARGIN, y)) + GREY_CD_M2) / viewing.display.white_cd_m2;
        let code = (255.0 * viewing.display.eotf.encode(shown, viewing.display.white_cd_m2)).round() as u8;
        let is_tinted = is_below && visibility.get(x + MARGIN, y) > 1.0;
        image::Rgb([code, code, if is_tinted { (f64::from(code) * 0.7) as u8 } else { code }])
    })
    .save(&path)?;
    println!("{}", path.display());
    println!("  cpd   contrast at v = 1   1/S");
    for freq in [1.0_f64, 2.0, 4.0, 8.0, 16.0] {
        let x = (WIDTH as f64 * (freq / LOWEST_CPD).ln() / SPAN.ln()) as usize;
        let boundary = (0..HEIGHT).find(|&y| visibility.get(x + MARGIN, y) > 1.0);
        let contrast = boundary.map_or(f64::NAN, |y| contrast(y as f64));
        println!("{freq:5}   {contrast:17.4}   {:.4}", 1.0 / csf.sensitivity(freq, GREY_CD_M2));
    }
    Ok(())
}
