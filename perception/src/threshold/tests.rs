use super::*;
use crate::csf::{CastleCsf, peak_sensitivity};
use crate::display::Display;
use crate::test_golden::check;
use crate::test_noise::normal;

fn viewing(pixels_per_degree: f64) -> Viewing {
    Viewing { display: Display { pixels_per_degree, ..Display::default() }, ..Viewing::default() }
}

fn map_of(picture: &Plane, viewing: &Viewing) -> ThresholdMap {
    let inputs = ThresholdInputs::clean(picture);
    threshold_map(&inputs, viewing, &CastleCsf::default()).unwrap()
}

/// Standard error at v = 1 is σ/L = 1 / (S_peak G √2), G being the specification's gain of white noise.
#[test]
fn uniform_pictures_have_the_tabulated_thresholds() {
    check("fft_white_noise_gain_castle_N256", 2e-3, |row| {
        let (luminance, ppd) = (row[0], row[1]);
        let map = map_of(&Plane::filled(32, 24, luminance as f32), &viewing(ppd));
        let allowed = f64::from(map.allowed_standard_error_cd_m2(1.0).get(16, 12)) / luminance;
        1.0 / (allowed * peak_sensitivity(&CastleCsf::default(), luminance) * std::f64::consts::SQRT_2)
    });
}

#[test]
fn an_edge_masks_nothing_beside_it() {
    for ppd in [38.0, 60.0] {
        let step = Plane::from_fn(256, 64, |x, _| if x < 128 { 50.0 } else { 100.0 });
        let elevation = map_of(&step, &viewing(ppd)).masking_elevation();
        let beside = (0.25 * ppd) as usize;
        for x in [128 - beside, 127 + beside] {
            let found = elevation.get(x, 32);
            assert!(found < 1.25, "{ppd} ppd, x {x}: {found}");
        }
    }
}

#[test]
fn texture_masks_and_its_own_noise_does_not() {
    let wave = |amplitude: f32| {
        Plane::from_fn(192, 192, move |x, y| {
            let phase = std::f32::consts::TAU * 4.0 / 60.0;
            100.0 * (1.0 + amplitude * ((x as f32 * phase).cos() * (y as f32 * phase).cos()))
        })
    };
    let textured = map_of(&wave(0.3), &viewing(60.0)).masking_elevation().get(96, 96);
    assert!(textured > 1.15, "{textured}");
    // White noise of 10 % of the mean, known as such, and unknown.
    let mut state = 1_u64;
    let noisy = Plane::from_values(192, 192, (0..192 * 192).map(|_| 100.0 + 10.0 * normal(&mut state)).collect());
    let noisy = noisy.unwrap();
    let variance = Plane::filled(192, 192, 100.0);
    let known = ThresholdInputs { display_luminance_cd_m2: &noisy, guide_noise: GuideNoise::White(&variance) };
    let known = threshold_map(&known, &viewing(60.0), &CastleCsf::default()).unwrap().masking_elevation();
    let unknown = map_of(&noisy, &viewing(60.0)).masking_elevation();
    assert!(known.mean() < 1.01 && unknown.mean() > 1.2, "known {} unknown {}", known.mean(), unknown.mean());
}

/// A denoised guide's texture is masked by less than if it were clean and by more than if all noise were left in it:
/// by the mean of both, on a logarithmic scale.
#[test]
fn masks_of_a_denoised_guide_lie_between_two_bounds() {
    let texture = Plane::from_fn(192, 192, |x, y| 100.0 * (1.0 + 0.5 * hashed(x / 4, y / 4)));
    // Of a standard deviation beyond the texture's, 14 cd/m², on the left.
    let before = Plane::from_fn(192, 192, |x, _| if x < 96 { 1e4 } else { 0.0 });
    let elevation = |guide_noise| {
        let inputs = ThresholdInputs { display_luminance_cd_m2: &texture, guide_noise };
        threshold_map(&inputs, &viewing(60.0), &CastleCsf::default()).unwrap().masking_elevation()
    };
    let (at_most, at_least) = (elevation(GuideNoise::Clean), elevation(GuideNoise::White(&before)));
    let found = elevation(GuideNoise::BeforeDenoising(&before));
    let at = |map: &Plane, x| map.get(x, 96);
    assert!(at(&at_least, 48) < 1.001 && at(&at_most, 48) > 1.2, "{} {}", at(&at_least, 48), at(&at_most, 48));
    let mean = (at(&at_least, 48) * at(&at_most, 48)).sqrt();
    // Bands have each their own mean, whose sum is never less.
    assert!((1.0..1.05).contains(&(at(&found, 48) / mean)), "{} for {mean}", at(&found, 48));
    assert!((at(&found, 144) / at(&at_most, 144) - 1.0).abs() < 0.02, "{} {}", at(&found, 144), at(&at_most, 144));
}

/// A grating beyond the centre of the last band of 8 cpd, at half its threshold, raises thresholds there by what
/// Daly's formula says of any mask of half a threshold.
#[test]
fn a_mask_counts_by_how_well_it_is_seen() {
    let (ppd, freq_cpd, luminance) = (38.0, 13.0, 10.0);
    let csf = CastleCsf::default();
    let contrast = 0.5 / csf.sensitivity(freq_cpd, luminance);
    let grating = Plane::from_fn(192, 192, |x, _| {
        (luminance * (1.0 + contrast * (std::f64::consts::TAU * freq_cpd * x as f64 / ppd).cos())) as f32
    });
    let map = map_of(&grating, &viewing(ppd));
    let last = map.elevations.last().unwrap().enlarged().get(96, 96);
    let expected = crate::masking::threshold_elevation(0.5) as f32;
    assert!((last / expected - 1.0).abs() < 0.02, "{last}, not {expected}");
}

/// Stripes of a pixel at 100 cpd and a tenth of their threshold hide nothing.
#[test]
fn an_invisible_pattern_masks_nothing() {
    let stripes = Plane::from_fn(256, 256, |x, _| if x % 2 == 0 { 130.0 } else { 70.0 });
    let found = map_of(&stripes, &viewing(200.0)).masking_elevation().get(128, 128);
    assert!(found < 1.01, "{found}");
}

#[test]
fn a_firefly_does_not_raise_its_threshold() {
    let mut picture = Plane::filled(64, 64, 20.0);
    picture.values_mut()[32 * 64 + 32] = 200.0;
    let adapted = map_of(&picture, &viewing(60.0)).adaptation_cd_m2().get(32, 32);
    assert!((adapted - 20.0).abs() < 1e-3, "{adapted}");
}

/// A lamp far beyond what any display shows must not blind the transform to everything else: its rounding would be a
/// mask everywhere.
#[test]
fn one_lamp_does_not_mask_the_picture() {
    let textured = Plane::from_fn(256, 256, |x, y| 20.0 + ((x * 7 + y * 13) % 11) as f32 * 0.05);
    let alone = map_of(&textured, &viewing(60.0));
    for lamp in [2e7, 1e30] {
        let mut lit = textured.clone();
        lit.values_mut()[40 * 256 + 40] = lamp;
        let lit = map_of(&lit, &viewing(60.0));
        for (x, y) in [(128, 128), (200, 60), (40, 200), (250, 250)] {
            let ratio = lit.noise_gain().get(x, y) / alone.noise_gain().get(x, y);
            assert!((ratio - 1.0).abs() < 0.01, "lamp of {lamp} cd/m², ({x}, {y}): noise gain × {ratio}");
        }
    }
}

/// Some of a path tracer's outliers, alone and in pairs, on a textured picture: adaptation hardly moves.
#[test]
fn scattered_fireflies_do_not_move_adaptation() {
    let clean = Plane::from_fn(160, 120, |x, y| 20.0 + 5.0 * ((x * 7 + y * 13) % 11) as f32);
    let mut dirty = clean.clone();
    let mut state = 3;
    let mut fireflies = 0;
    for y in 2..118 {
        for x in 2..158 {
            if crate::test_noise::uniform(&mut state) < 2e-3 {
                dirty.values_mut()[y * 160 + x] = 1e5;
                fireflies += 1;
            }
        }
    }
    assert!(fireflies > 20);
    let (clean, dirty) = (map_of(&clean, &viewing(60.0)), map_of(&dirty, &viewing(60.0)));
    let change = dirty.adaptation_cd_m2().combined(clean.adaptation_cd_m2(), |dirty, clean| dirty / clean);
    let (least, greatest) = change.range();
    assert!(least > 0.999 && greatest < 1.02, "{least} {greatest}");
}

/// A picture on pixels twice as wide as high shows what square pixels of the finer pitch show.
#[test]
fn pixels_need_not_be_square() {
    let square = viewing(60.0);
    let mut wide = viewing(30.0);
    wide.display.pixel_aspect_ratio = 2.0;
    // Texture to the right; gratings of one frequency along x and along y, 2 cpd, fine enough for both grids.
    let texture = |x: f32, y: f32| {
        let phase = std::f32::consts::TAU * 2.0;
        let amplitude = if x > 3.0 { 0.3 } else { 0.0 };
        80.0 * (1.0 + amplitude * (phase * x).cos() * (phase * y).cos())
    };
    let fine = Plane::from_fn(360, 240, |x, y| texture((x as f32 + 0.5) / 60.0, (y as f32 + 0.5) / 60.0));
    let coarse = Plane::from_fn(180, 240, |x, y| texture((x as f32 + 0.5) / 30.0, (y as f32 + 0.5) / 60.0));
    let (on_square, on_wide) = (map_of(&fine, &square), map_of(&coarse, &wide));
    for (x, y) in [(40, 60), (80, 120), (130, 100), (160, 200)] {
        let (a, b) = (on_square.adaptation_cd_m2().get(2 * x, y), on_wide.adaptation_cd_m2().get(x, y));
        assert!((b / a - 1.0).abs() < 0.01, "adaptation at ({x}, {y}): {a}, {b}");
        let (a, b) = (on_square.elevations[2].enlarged().get(2 * x, y), on_wide.elevations[2].enlarged().get(x, y));
        assert!((b / a - 1.0).abs() < 0.03, "elevation of the 2 cpd band at ({x}, {y}): {a}, {b}");
    }
    // The same grating as an error, along x and then along y, is as visible on both; pooled, it has its contrast over
    // threshold.
    for along_y in [false, true] {
        let wave = |x: f32, y: f32| (std::f32::consts::TAU * 4.0 * if along_y { y } else { x }).cos();
        let of = |width: usize, step: f32, map: &ThresholdMap| {
            let error = Plane::from_fn(width, 240, |x, y| wave((x as f32 + 0.5) * step, (y as f32 + 0.5) / 60.0));
            map.measured_visibility(&error).get(width / 4, 120)
        };
        let (a, b) = (of(360, 1.0 / 60.0, &on_square), of(180, 1.0 / 30.0, &on_wide));
        assert!((b / a - 1.0).abs() < 0.01, "grating along {}: {a}, {b}", if along_y { "y" } else { "x" });
    }
    // White noise of the same σ has half as many pixels to average over: more of its energy lies where the eye sees.
    let grey = |width| Plane::filled(width, 240, 80.0);
    let gain = |picture: &Plane, viewing: &Viewing| f64::from(map_of(picture, viewing).noise_gain().get(20, 100));
    let (fine, coarse, middle) = (gain(&grey(360), &square), gain(&grey(180), &wide), gain(&grey(180), &viewing(30.0)));
    assert!(fine < coarse && coarse < middle, "{fine} {coarse} {middle}");
    assert!((coarse / (fine * middle).sqrt() - 1.0).abs() < 0.15, "{coarse}");
}

#[test]
fn any_size_and_luminance_gives_finite_thresholds() {
    for (width, height) in [(1, 1), (2, 1), (1, 9), (3, 3), (17, 5)] {
        for luminance in [0.0, 1e-30, 1e-4, 1.0, 1e8] {
            let map = map_of(&Plane::filled(width, height, luminance), &viewing(30.0));
            let allowed = map.allowed_standard_error_cd_m2(1.0);
            assert!(allowed.values().iter().all(|value| value.is_finite() && *value > 0.0), "{luminance}");
        }
    }
}

/// Regression: where no `f32` holds a threshold it was infinite, and no error.
#[test]
fn luminance_without_an_answer_is_an_error() {
    let ask = |luminance: f32| {
        let picture = Plane::filled(32, 32, luminance);
        let inputs = ThresholdInputs::clean(&picture);
        threshold_map(&inputs, &Viewing::default(), &CastleCsf::default())
    };
    assert!(matches!(ask(3e38), Err(Error::OutOfRange { .. })));
    for luminance in [1e12, 1e20, 1e30] {
        let allowed = ask(luminance).unwrap().allowed_standard_error_cd_m2(1.0);
        assert!(allowed.values().iter().all(|value| value.is_finite()), "{luminance}: {:?}", allowed.get(9, 9));
    }
}

#[test]
fn error_that_moves_fast_may_be_larger() {
    let map = map_of(&Plane::filled(32, 32, 50.0), &viewing(60.0));
    let at = |velocity| {
        let moved = map.with_motion(&Plane::filled(32, 32, velocity)).unwrap();
        moved.allowed_standard_error_cd_m2(1.0).get(16, 16)
    };
    let still = map.allowed_standard_error_cd_m2(1.0).get(16, 16);
    assert!((at(0.0) / still - 1.0).abs() < 1e-5 && (at(0.15) / still - 1.0).abs() < 1e-5);
    assert!(at(10.0) > 2.0 * still, "{} {still}", at(10.0));
    assert!(at(1e9).is_finite());
    assert!(map.with_motion(&Plane::filled(3, 3, 0.0)).is_err());
}

/// What rests keeps its thresholds to the bit, at the borders of masks too, and beside what moves.
#[test]
fn no_motion_changes_nothing() {
    let textured = Plane::from_fn(96, 96, |x, y| 100.0 + if x > 48 && (x / 3 + y / 3) % 2 == 0 { 60.0 } else { 0.0 });
    let map = map_of(&textured, &viewing(60.0));
    let moved = map.with_motion(&Plane::filled(96, 96, 0.0)).unwrap();
    assert_eq!(moved.noise_gain(), map.noise_gain());
    let half = map.with_motion(&Plane::from_fn(96, 96, |_, y| if y < 48 { 10.0 } else { 0.0 })).unwrap();
    for x in 0..96 {
        assert_eq!(half.noise_gain().get(x, 48), map.noise_gain().get(x, 48));
        assert!(half.noise_gain().get(x, 47) < 0.5 * map.noise_gain().get(x, 47));
    }
}

#[test]
fn isoluminant_noise_is_not_missed() {
    use crate::csf::{CastleChromatic, ChromaticChannel};
    use crate::opponent::opponent;
    use crate::test_noise::red_for_green;
    let mut state = 9;
    let noise: Vec<_> = (0..128 * 128).map(|_| opponent(red_for_green(40.0 * normal(&mut state)))).collect();
    let plane = |value: fn(&crate::opponent::Opponent) -> f32| {
        Plane::from_values(128, 128, noise.iter().map(value).collect()).unwrap()
    };
    let grey = Plane::filled(128, 128, 100.0);
    let csf = CastleChromatic::new(ChromaticChannel::RedGreen, 1.0).unwrap();
    let red_green = chromatic_threshold_map(&Plane::filled(128, 128, 0.0), &grey, &viewing(60.0), &csf).unwrap();
    let luminance_v = map_of(&grey, &viewing(60.0)).measured_visibility(&plane(|c| c.achromatic)).get(64, 64);
    let chromatic_v = red_green.measured_visibility(&plane(|c| c.red_green)).get(64, 64);
    assert!(luminance_v < 1e-3 && chromatic_v > 1.0, "luminance {luminance_v}, red–green {chromatic_v}");
}

#[test]
fn bad_inputs_are_errors() {
    let csf = CastleCsf::default();
    let bad = Plane::filled(4, 4, f32::NAN);
    let good = Plane::filled(4, 4, 1.0);
    let small = Plane::filled(2, 2, 1.0);
    let ask = |display_luminance_cd_m2, guide_noise, viewing: &Viewing| {
        threshold_map(&ThresholdInputs { display_luminance_cd_m2, guide_noise }, viewing, &csf).err()
    };
    assert!(matches!(ask(&bad, GuideNoise::Clean, &Viewing::default()), Some(Error::BadPixel { .. })));
    assert!(matches!(ask(&good, GuideNoise::White(&small), &Viewing::default()), Some(Error::SizeMismatch { .. })));
    assert!(matches!(ask(&good, GuideNoise::Clean, &viewing(0.0)), Some(Error::OutOfRange { .. })));
    assert!(matches!(ask(&good, GuideNoise::Clean, &viewing(f64::NAN)), Some(Error::OutOfRange { .. })));
}

/// Between −½ and ½, another value for every pixel.
fn hashed(x: usize, y: usize) -> f32 {
    let mut state = (x as u64 * 7919 + y as u64 * 104_729 + 12_345).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    state ^= state >> 31;
    state = state.wrapping_mul(0xBF58_476D_1CE4_E5B9);
    state ^= state >> 29;
    (state % 10_007) as f32 / 10_007.0 - 0.5
}

/// A mirrored picture has the mirrored thresholds, in its first and last rows too: grids of masks start at one side,
/// what they hold does not. Pixels of an even number of columns are on the grid in one of the two pictures and off it
/// in the other. Of 96 columns thresholds differ by 2.6 % at the most.
#[test]
fn a_mirrored_picture_has_the_mirrored_thresholds() {
    for (width, height, textured, tolerance) in [(96, 96, 96, 0.03), (255, 253, 120, 0.015)] {
        let at = |x: usize, y: usize| 50.0 * (1.0 + if x < textured { 0.6 * hashed(x, y) } else { 0.0 });
        let allowed = |value_at: &(dyn Fn(usize, usize) -> f32 + Sync)| {
            map_of(&Plane::from_fn(width, height, value_at), &viewing(60.0)).allowed_standard_error_cd_m2(1.0)
        };
        let seen = allowed(&at);
        let (left_right, upside_down) = (allowed(&|x, y| at(width - 1 - x, y)), allowed(&|x, y| at(x, height - 1 - y)));
        for (x, y) in (0..width).flat_map(|x| (0..height).map(move |y| (x, y))) {
            let own = seen.get(x, y);
            for other in [left_right.get(width - 1 - x, y), upside_down.get(x, height - 1 - y)] {
                assert!((own / other - 1.0).abs() < tolerance, "{width}×{height}, ({x}, {y}): {own}, mirrored {other}");
            }
        }
    }
}
