//! ModelFest's stimuli as contrast: −1 to 1, 0 is the background. Gratings vary along y unless they say otherwise.

use std::path::Path;

use fechner_perception::Plane;

pub(crate) const SIDE: usize = 256;
pub(crate) const PIXELS_PER_DEGREE: f64 = 120.0;
pub(crate) const BACKGROUND_CD_M2: f32 = 30.0;
/// Place of the centre, pixels.
const CENTER: f64 = 128.0;
/// Standard deviation of the common window, degrees.
const WINDOW_DEG: f64 = 0.5;

pub(crate) struct Stimulus {
    pub(crate) name: String,
    pub(crate) contrast: Plane,
}

/// All 43 in ModelFest's order.
pub(crate) fn all(folder: &Path) -> Result<Vec<Stimulus>, Box<dyn std::error::Error>> {
    let mut stimuli = Vec::new();
    let mut add = |name: String, contrast: Plane| stimuli.push(Stimulus { name, contrast });
    for freq in [1.12, 2.0, 2.83, 4.0, 5.66, 8.0, 11.3, 16.0, 22.6, 30.0] {
        add(format!("Gabor {freq} cpd, 0.5°"), gabor(freq, 0.5, 0.5));
    }
    for (freq, sigma) in [(2.0, 0.28), (4.0, 0.14), (8.0, 0.07), (16.0, 0.035)] {
        add(format!("Gabor {freq} cpd, {sigma}°"), gabor(freq, sigma, sigma));
    }
    for (freq, sigma_y) in [(4.0, 0.28), (8.0, 0.14), (16.0, 0.07)] {
        add(format!("elongated Gabor {freq} cpd"), gabor(freq, 0.5, sigma_y));
    }
    for (sigma_x, sigma_y) in [(0.28, 0.14), (0.5, 0.14), (0.14, 0.28), (0.14, 0.5)] {
        add(format!("Gabor 4 cpd, {sigma_x}° × {sigma_y}°"), gabor(4.0, sigma_x, sigma_y));
    }
    let root = std::f64::consts::SQRT_2;
    for (low, high) in [(2.0, 2.0 * root), (2.0, 4.0), (4.0, 4.0 * root), (4.0, 8.0)] {
        add(format!("Gabors {low} and {high:.2} cpd"), mean(&gabor(low, 0.5, 0.5), &gabor(high, 0.5, 0.5)));
    }
    for minutes in [30.0, 8.43, 2.106, 1.05] {
        add(format!("Gaussian {minutes}′"), stimulus(|x, y| gauss(x, y, minutes / 60.0, minutes / 60.0)));
    }
    // Whole pixels, so that a line is one.
    let row = |y: f64| (y * PIXELS_PER_DEGREE).round() as i32;
    add("edge".into(), windowed(|_, y| if row(y) < 0 { -1.0 } else { 1.0 }));
    add("line 0.5′".into(), windowed(|_, y| f64::from(u8::from(row(y) == 0))));
    add("dipole, 3 pixels".into(), windowed(|_, y| f64::from(i8::from(row(y) == -2) - i8::from(row(y) == 0))));
    for flip in [1.0_f64, -1.0] {
        add(
            format!("5 collinear Gabors 8 cpd, {}", if flip > 0.0 { "in phase" } else { "alternating" }),
            stimulus(|x, y| {
                let wave = (std::f64::consts::TAU * 8.0 * y).cos();
                let window: f64 =
                    (-2..=2).map(|k: i32| flip.powi(k) * gauss(x - 0.35 * f64::from(k), y, 0.07, 0.07)).sum();
                wave * window
            }),
        );
    }
    add("binary noise".into(), picture(&folder.join("modelfest_noise.tif"))?);
    add("oblique Gabor 4 cpd".into(), turned_gabor(45.0));
    add("vertical Gabor 4 cpd".into(), turned_gabor(90.0));
    add("plaid 0° and 90°".into(), mean(&turned_gabor(0.0), &turned_gabor(90.0)));
    add("plaid 45° and 0°".into(), mean(&turned_gabor(45.0), &turned_gabor(0.0)));
    add("disc 0.25°".into(), stimulus(|x, y| f64::from(u8::from(x.hypot(y) < 0.1249))));
    add("Bessel 4 cpd".into(), windowed(|x, y| bessel_j0(std::f64::consts::TAU * 4.0 * x.hypot(y))));
    add("checkerboard 4 cpd".into(), windowed(checks));
    add("natural scene".into(), picture(&folder.join("modelfest_natural_scene.tif"))?);
    Ok(stimuli)
}

/// `value_at(x, y)` in degrees from the centre.
fn stimulus(value_at: impl Fn(f64, f64) -> f64 + Sync) -> Plane {
    let degrees = |pixel: usize| (pixel as f64 - CENTER) / PIXELS_PER_DEGREE;
    Plane::from_fn(SIDE, SIDE, |x, y| value_at(degrees(x), degrees(y)) as f32)
}

fn windowed(value_at: impl Fn(f64, f64) -> f64 + Sync) -> Plane {
    stimulus(|x, y| value_at(x, y) * gauss(x, y, WINDOW_DEG, WINDOW_DEG))
}

fn gauss(x: f64, y: f64, sigma_x: f64, sigma_y: f64) -> f64 {
    (-0.5 * ((x / sigma_x).powi(2) + (y / sigma_y).powi(2))).exp()
}

fn gabor(freq_cpd: f64, sigma_x: f64, sigma_y: f64) -> Plane {
    stimulus(|x, y| (std::f64::consts::TAU * freq_cpd * y).cos() * gauss(x, y, sigma_x, sigma_y))
}

/// 4 cpd under a Gaussian of 0.14°, its stripes turned from horizontal.
fn turned_gabor(degrees: f64) -> Plane {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    stimulus(|x, y| (std::f64::consts::TAU * 4.0 * (x * sine + y * cosine)).cos() * gauss(x, y, 0.14, 0.14))
}

fn mean(a: &Plane, b: &Plane) -> Plane {
    Plane::from_fn(SIDE, SIDE, |x, y| 0.5 * (a.get(x, y) + b.get(x, y)))
}

/// Checks on the slant, so that the fundamentals lie along x and y, at 4 cpd.
fn checks(x: f64, y: f64) -> f64 {
    let phase = std::f64::consts::TAU * 4.0;
    let (across, along) = (0.5 * phase * (x + y), 0.5 * phase * (x - y));
    if (across.cos() >= 0.0) == (along.cos() >= 0.0) { 1.0 } else { -1.0 }
}

/// J₀ by its integral, (1/π) ∫ cos(z sin t) dt over half a turn: for a periodic integrand the midpoint rule is exact
/// to rounding.
fn bessel_j0(z: f64) -> f64 {
    const STEPS: u32 = 128;
    let at = |step: u32| (z * ((f64::from(step) + 0.5) * std::f64::consts::PI / f64::from(STEPS)).sin()).cos();
    (0..STEPS).map(at).sum::<f64>() / f64::from(STEPS)
}

/// A sampled stimulus: 129 is the background, 3 and 255 are contrast −1 and 1.
fn picture(path: &Path) -> Result<Plane, Box<dyn std::error::Error>> {
    let grey = image::open(path).map_err(|error| format!("{}: {error}", path.display()))?.into_luma8();
    if grey.dimensions() != (SIDE as u32, SIDE as u32) {
        return Err(format!("{}: not {SIDE}×{SIDE} pixels", path.display()).into());
    }
    let values = grey.pixels().map(|pixel| (f32::from(pixel.0[0]) - 129.0) / 126.0).collect();
    Ok(Plane::from_values(SIDE, SIDE, values)?)
}
