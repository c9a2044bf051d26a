//! The listings of the founding paper's appendix, faults and all: the proof that each fault is real, beside what the
//! operators do instead. Constants of ours are held to reference values in the operators' own tests.

use super::*;
use crate::display::Display;
use crate::plane::Plane;
use crate::test_golden::check;

const DISPLAY_AMBIENT: f64 = 25.0;
const MAX_DISPLAY_LUMINANCE: f64 = 125.0;

/// The paper's luminance.
fn luminance_of([r, g, b]: [f64; 3]) -> f64 {
    0.3 * r + 0.6 * g + 0.1 * b
}

/// `MIN(1.0, x)` as a macro: what is not less is taken, NaN included.
fn macro_min(x: f64) -> f64 {
    if 1.0 < x { 1.0 } else { x }
}

/// Table 1. Radiance in, adaptation in cd/m².
fn tumblin_rushmeier(rgb: [f64; 3], adaptation_cd_m2: f64) -> [f64; 3] {
    let to_lambert = |c: f64| c * 0.001 / 3.18;
    let display = to_lambert(DISPLAY_AMBIENT);
    let display_slope = 100.0 + 10.0 * display.log10();
    let adaptation = to_lambert(adaptation_cd_m2);
    let y = luminance_of(rgb);
    let scene_slope = 100.0 + 10.0 * adaptation.log10();
    let scene = -10.0 * (to_lambert(y) / adaptation).log10();
    let shown = 8.4 - (scene_slope - 27.0) * (8.4 - scene) / (display_slope - 27.0);
    let shown = display * 10.0_f64.powf(-0.1 * shown) * 3.18 * 1000.0 / MAX_DISPLAY_LUMINANCE;
    rgb.map(|channel| macro_min(shown * (channel / y)))
}

/// Threshold of table 2.
fn tvi(luminance: f64) -> f64 {
    if luminance < 1.148_15e-4 {
        return 1.380_384_26e-3;
    }
    let log = luminance.log10();
    if log < -1.44 {
        10.0_f64.powf((0.405 * log + 1.6).powf(2.18) - 2.86)
    } else if log < -0.0184 {
        10.0_f64.powf(log - 0.395)
    } else if log < 1.9 {
        10.0_f64.powf((0.249 * log + 0.65).powf(2.7) - 0.72)
    } else {
        luminance * 5.559e-2
    }
}

/// Table 2, whose `lumscale` is declared nowhere: 1 here.
fn ferwerda(rgb: [f64; 3], adaptation_cd_m2: f64) -> [f64; 3] {
    let scale = tvi(DISPLAY_AMBIENT) / MAX_DISPLAY_LUMINANCE / tvi(adaptation_cd_m2);
    rgb.map(|channel| macro_min((channel * scale).max(0.0)))
}

/// Table 3: the adaptation luminances stand in for their logarithms.
struct SeedHistogram {
    bin_scale: f64,
    cumulative: Vec<f64>,
}

impl SeedHistogram {
    const BINS: usize = 128;
    const RANGE: f64 = 32.0;
    const GREATEST: f64 = 100.0;

    fn of(adaptation: &[f64]) -> Self {
        let least = adaptation.iter().copied().fold(f64::from(f32::MAX), f64::min);
        let greatest = adaptation.iter().copied().fold(-f64::from(f32::MIN_POSITIVE), f64::max);
        let bin_scale = (Self::BINS - 1) as f64 / (greatest - least);
        let mut counts = vec![0_u32; Self::BINS];
        for value in adaptation {
            let bin = ((value - least) * bin_scale) as i64;
            counts[bin.clamp(0, Self::BINS as i64 - 1) as usize] += 1;
        }
        let delta = (greatest - least) / Self::BINS as f64;
        let threshold = (adaptation.len() as f64 * 0.025 + 0.5) as u32;
        let mut total = adaptation.len() as u32;
        let mut cumulative = vec![0.0; Self::BINS + 1];
        loop {
            let mut sum = 0;
            for bin in 0..Self::BINS {
                cumulative[bin] = f64::from(sum) / f64::from(total);
                sum += counts[bin];
            }
            cumulative[Self::BINS] = 1.0;
            let most = f64::from(total) * delta / Self::RANGE.ln();
            let mut trimmed = 0;
            for bin in (0..Self::BINS).rev() {
                let scene = (least + bin as f64 * delta).exp();
                let middle = 0.5 * (cumulative[bin] + cumulative[bin + 1]);
                let shown = Self::GREATEST / Self::RANGE * (Self::RANGE.ln() * middle).exp();
                let ceiling =
                    most * (crate::tvi::combined(shown) * scene) / (crate::tvi::combined(scene) * shown) + 1.0;
                let ceiling = ceiling as u32;
                if counts[bin] > ceiling {
                    trimmed += counts[bin] - ceiling;
                    counts[bin] = ceiling;
                }
            }
            total -= trimmed;
            if total <= threshold || trimmed <= threshold {
                return Self { bin_scale, cumulative };
            }
        }
    }

    fn shown(&self, scene: f64) -> f64 {
        let place = scene * self.bin_scale;
        let bin = (place as i64).clamp(0, Self::BINS as i64 - 1) as usize;
        let share = place - bin as f64;
        let position = (1.0 - share) * self.cumulative[bin] + share * self.cumulative[bin + 1];
        Self::GREATEST / Self::RANGE * (Self::RANGE.ln() * position).exp()
    }
}

/// Table 4.
struct SeedModel {
    sigma_cone: f64,
    sigma_rod: f64,
    shown: f64,
    colour_strength: f64,
}

fn pattanaik(luminance: f64, adaptation: f64) -> SeedModel {
    const N: f64 = 0.73;
    let sigma_cone = |i: f64| {
        let k = 1.0 / (5.0 * i + 1.0);
        let fl = 0.2 * k.powi(4) * (5.0 * i) + 0.1 * (1.0 - k.powi(4)).powi(2) * (5.0 * i).powf(1.0 / 3.0);
        2.0_f64.powf(1.0 / N) / (fl / (5.0 * i))
    };
    let sigma_rod = |i: f64| {
        let j = 0.00001 / (5.0 * i + 0.00001);
        let fls = 3800.0 * j * j * (5.0 * i) + 0.2 * (1.0 - j * j).powi(4) * (5.0 * i).powf(1.0 / 6.0);
        2.0_f64.powf(1.0 / N) / (fls / (5.0 * i))
    };
    let response = |i: f64, sigma: f64| i.powf(N) / (i.powf(N) + sigma.powf(N));
    let (white, black) = (DISPLAY_AMBIENT * 5.0, DISPLAY_AMBIENT / 6.4);
    let display_sigma = sigma_cone(DISPLAY_AMBIENT);
    let slope = (response(white, display_sigma) - response(black, display_sigma)) / (white.log10() - black.log10());
    let (cone, rod) = (sigma_cone(adaptation), sigma_rod(adaptation));
    let cones = 2e6 / (2e6 + adaptation) * response(luminance, cone);
    let rods = 0.04 / (0.04 + adaptation) * response(luminance, rod);
    let shown = if cones + rods >= 1.0 { 0.99999 } else { cones + rods };
    let power = luminance.powf(N);
    SeedModel {
        sigma_cone: cone,
        sigma_rod: rod,
        shown: display_sigma * (shown / (1.0 - shown)).powf(1.0 / N) / white,
        colour_strength: cone.powf(N) * N * power / (power + cone.powf(N)).powi(2) / slope,
    }
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found / expected - 1.0).abs() < relative, "{found} for {expected}");
}

/// The display of the listings.
fn viewing() -> Viewing {
    Viewing::of(Display { white_cd_m2: 125.0, black_cd_m2: 0.0, ..Display::default() })
}

fn ours(name: &str, guide: &Plane) -> Box<dyn FittedTone> {
    operator(name, None).unwrap().fit(&SceneGuide::of(guide), &viewing(), None)
}

/// G3: the weights are right on grey and off by 41, −16 and 39 % on the primaries.
#[test]
fn seed_weights_miss_the_primaries() {
    for (rgb, error) in [([1.0, 0.0, 0.0], 0.411), ([0.0, 1.0, 0.0], -0.161), ([0.0, 0.0, 1.0], 0.385)] {
        let right = f64::from(luminance(rgb.map(|channel: f64| channel as f32)));
        assert!((luminance_of(rgb) / right - 1.0 - error).abs() < 0.005, "{rgb:?}");
    }
    close(luminance_of([1.0; 3]), 1.0, 1e-12);
}

/// G4, G5, T2: black is 0 / 0, and the macro lets NaN through.
#[test]
fn seed_black_is_not_a_number() {
    assert!(tumblin_rushmeier([0.0; 3], 10.0).iter().all(|channel| channel.is_nan()));
    let guide = Plane::filled(4, 4, 10.0);
    assert_eq!(ours("tr", &guide).map_rgb([0.0; 3]), [0.0; 3]);
}

/// G6: clipping each channel turns a bright orange yellow.
#[test]
fn seed_clipping_shifts_hue() {
    let [r, g, b] = ferwerda([80.0, 40.0, 2.0], 0.3);
    assert!(r == 1.0 && g == 1.0 && b < 0.5, "{r} {g} {b}");
    let shown = ours("ward94", &Plane::filled(4, 4, 60.0)).map_rgb([80.0, 40.0, 2.0]);
    assert!(shown[0] > 1.2 * shown[1], "{shown:?}");
}

/// T3: in starlight the picture becomes its negative.
#[test]
fn seed_starlight_is_a_negative() {
    let at = |light: f64| tumblin_rushmeier([light; 3], 1e-4)[0];
    assert!(at(2e-4) < at(1e-4));
    let fit = ours("tr", &Plane::filled(4, 4, 1.1e-4));
    assert!(fit.relative_luminance(2e-4) >= fit.relative_luminance(1e-4));
}

/// F2, F3, F4: one scale from one curve, for a display adaptation of 25, with a rounded constant; red is as bright by
/// night as by day.
#[test]
fn seed_ferwerda_is_one_scale() {
    let scale = |adaptation: f64| ferwerda([0.01; 3], adaptation)[0] / 0.01;
    check("fpsg_seed_m", 1e-5, |row| scale(row[0]));
    let exact = 0.002_709_776_357;
    assert!((scale(100.0) / exact - 1.0).abs() > 5e-6);
    let red = ferwerda([0.01, 0.0, 0.0], 0.01);
    assert!(red[0] > 0.0 && red[1] == 0.0);
    // Ours: by night the rods give red its grey.
    let night = ours("fpsg", &Plane::filled(4, 4, 0.01)).map_rgb([0.01, 0.0, 0.0]);
    assert!(night[1] > 0.5 * night[0], "{night:?}");
}

/// F5: a luminance that is not a number falls through every branch.
#[test]
fn seed_tvi_passes_nan() {
    assert!(tvi(f64::NAN).is_nan());
    assert!(crate::tvi::combined(f64::NAN).is_finite());
}

/// W1, W4: luminances are taken for their logarithms, so that ceilings are those of exp(505) cd/m². A grey wall is
/// then shown with many times the contrast that it has.
#[test]
fn seed_histogram_takes_no_logarithm() {
    let mut samples = vec![505.0; 2900];
    samples.extend((0..100).map(|i| 10.0_f64.powf(0.03 * f64::from(i))));
    let seed = SeedHistogram::of(&samples);
    let contrast = seed.shown(511.0) / seed.shown(504.0);
    assert!(contrast > 2.0, "{contrast} shown for {}", 511.0 / 504.0);
    let wall = Plane::from_fn(100, 30, |x, _| if x < 97 { 505.0 } else { 10.0_f32.powf(x as f32 - 97.0) });
    let fit = ours("wrp", &wall);
    let contrast = fit.relative_luminance(511.0) / fit.relative_luminance(504.0);
    assert!(contrast < 1.03, "{contrast}");
}

/// W3: a constant picture divides by zero.
#[test]
fn seed_histogram_breaks_on_a_constant_picture() {
    let seed = SeedHistogram::of(&[5.0; 100]);
    assert!(seed.bin_scale.is_infinite());
    assert!(!seed.shown(5.0).is_finite() || seed.shown(5.0) > 100.0, "{}", seed.shown(5.0));
    assert!(ours("wrp", &Plane::filled(8, 8, 5.0)).relative_luminance(5.0) > 0.0);
}

/// W5: the fraction is not clamped, so that luminances beyond the samples run away.
#[test]
fn seed_histogram_runs_away_outside() {
    let samples: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i)).collect();
    let seed = SeedHistogram::of(&samples);
    assert!(seed.shown(1000.0) > 1e6, "{}", seed.shown(1000.0));
    // Ours, from 200 samples of a degree each: a hundred times the light is never shown as more than that.
    let fit = ours("wrp", &Plane::from_fn(1200, 600, |x, y| 0.05 * (10 * (x / 60) + y / 60) as f32));
    let [brightest, beyond] = [10.0, 1000.0].map(|light| fit.relative_luminance(light));
    assert!(brightest > 0.0 && (brightest..=100.1 * brightest).contains(&beyond), "{brightest} {beyond}");
}

/// W8, W10: ceilings are whole numbers plus 1, so that ten samples are never trimmed.
#[test]
fn seed_ceilings_never_reach_zero() {
    let samples: Vec<f64> = (0..10).map(|i| 1e-3 * f64::from(i)).collect();
    let seed = SeedHistogram::of(&samples);
    // One sample a bin is at its ceiling of 1: the whole display for a hundredth of a cd/m².
    let contrast = seed.shown(9e-3) / seed.shown(0.0);
    assert!(contrast > 0.6 * SeedHistogram::RANGE, "{contrast}");
    // Ours, from ten samples of a degree each: next to nothing of the display, since an eye in such light sees next
    // to nothing.
    let fit = ours("wrp", &Plane::from_fn(600, 60, |x, _| 1e-3 * (x / 60) as f32));
    let brightest = fit.relative_luminance(9e-3);
    assert!(brightest < 0.05, "{brightest}");
}

/// P1: white of a bright scene is shown at 906.7 and not at 125 cd/m².
#[test]
fn seed_model_has_no_appearance() {
    close(MAX_DISPLAY_LUMINANCE * pattanaik(5e4, 1e4).shown, 906.7, 1e-3);
    close(f64::from(ours("ptyg", &Plane::filled(4, 4, 1e4)).relative_luminance(5e4)), 1.0, 1e-4);
}

/// P2, P3: black and a black adaptation are 0 / 0.
#[test]
fn seed_model_is_undefined_in_the_dark() {
    assert!(pattanaik(1.0, 0.0).sigma_cone.is_nan());
    let ratio = 0.0 / luminance_of([0.0; 3]);
    assert!(f64::is_nan(ratio));
    assert!(ours("ptyg", &Plane::filled(4, 4, 0.0)).map_rgb([0.0; 3])[0].is_finite());
}

/// P4, P5: a slope for each natural logarithm over one for each decade makes an identity grey.
#[test]
fn seed_model_loses_colour() {
    close(pattanaik(25.0, 25.0).colour_strength, 0.411, 2e-3);
    let shown = ours("ptyg", &Plane::filled(4, 4, 25.0)).map_rgb([50.0, 20.0, 10.0]);
    assert!(shown[0] / shown[2] > 3.5, "{shown:?}");
}

/// P8, P10: rods and cones add up to more than 1 in the dark, which inverts to a luminance of millions, though the
/// rods' half-saturation is five times what the paper has.
#[test]
fn seed_model_whites_out() {
    check("ptyg_sigma_rod_seed", 1e-6, |row| pattanaik(100.0, row[0]).sigma_rod);
    assert!(pattanaik(100.0, 1e-3).shown > 100.0, "{}", pattanaik(100.0, 1e-3).shown);
    let fit = ours("ptyg", &Plane::filled(4, 4, 1e-3));
    assert!(fit.map_rgb([100.0; 3]).iter().all(|channel| *channel <= 1.0));
}
