use super::*;
use crate::test_noise::normal;

const WIDTH: usize = 96;
const HEIGHT: usize = 64;

struct Picture {
    truth: Vec<[f32; 3]>,
    noisy: Vec<[f32; 3]>,
    variance: Plane,
    albedo: Vec<[f32; 3]>,
    normal: Vec<[f32; 3]>,
    depth: Vec<f32>,
}

/// A wall and a floor, striped by their albedo, under a shadow edge; noise of 30 %.
fn picture(seed: u64) -> Picture {
    let mut state = seed;
    let pixels = || (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    let albedo: Vec<[f32; 3]> =
        pixels().map(|(x, _)| if x % 8 < 4 { [0.8, 0.2, 0.3] } else { [0.3, 0.7, 0.4] }).collect();
    let normal_of = |y: usize| {
        if y < 32 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] }
    };
    let light = |x: usize, y: usize| {
        if y < 32 {
            50.0
        } else if x < 40 {
            100.0
        } else {
            10.0
        }
    };
    let truth: Vec<[f32; 3]> =
        pixels().zip(&albedo).map(|((x, y), albedo)| albedo.map(|channel| channel * light(x, y))).collect();
    let noisy: Vec<[f32; 3]> = truth
        .iter()
        .map(|rgb| {
            let factor = 1.0 + 0.3 * normal(&mut state);
            rgb.map(|channel| channel * factor.max(0.0))
        })
        .collect();
    let variance = Plane::from_values(WIDTH, HEIGHT, truth.iter().map(|rgb| (0.3 * luminance(*rgb)).powi(2)).collect());
    Picture {
        truth,
        noisy,
        variance: variance.unwrap(),
        albedo,
        normal: pixels().map(|(_, y)| normal_of(y)).collect(),
        depth: pixels().map(|(_, y)| if y < 32 { 5.0 } else { 5.0 - 0.05 * (y - 32) as f32 }).collect(),
    }
}

fn run(picture: &Picture) -> Vec<[f32; 3]> {
    denoise(&GuideInputs {
        rgb: &picture.noisy,
        variance: &picture.variance,
        albedo: &picture.albedo,
        normal: &picture.normal,
        depth: &picture.depth,
        width: WIDTH,
        height: HEIGHT,
    })
}

fn relative_error(found: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
    let squares: f64 = found
        .iter()
        .zip(truth)
        .map(|(found, truth)| f64::from(luminance(*found) / luminance(*truth) - 1.0).powi(2))
        .sum();
    (squares / found.len() as f64).sqrt()
}

#[test]
fn most_of_the_noise_goes_and_the_edges_stay() {
    let picture = picture(1);
    let before = relative_error(&picture.noisy, &picture.truth);
    let after = relative_error(&run(&picture), &picture.truth);
    assert!(after < 0.25 * before, "relative error {before} → {after}");
}

#[test]
fn a_firefly_does_not_spread() {
    let mut picture = picture(2);
    picture.noisy[20 * WIDTH + 30] = [1e6; 3];
    picture.variance.values_mut()[20 * WIDTH + 30] = 1e12;
    picture.noisy[50 * WIDTH + 70] = [f32::NAN, f32::INFINITY, 1.0];
    let result = run(&picture);
    let after = relative_error(&result, &picture.truth);
    assert!(after < 0.12, "{after}");
    assert!(result.iter().flatten().all(|value| value.is_finite()));
}

#[test]
fn a_clean_picture_stays_as_it_is() {
    let mut picture = picture(3);
    picture.noisy.clone_from(&picture.truth);
    picture.variance = Plane::filled(WIDTH, HEIGHT, 0.0);
    assert!(relative_error(&run(&picture), &picture.truth) < 1e-3);
}

#[test]
fn wrong_lengths_and_tiny_pictures_do_no_harm() {
    let rgb = [[1.0; 3]];
    let variance = Plane::filled(1, 1, 1.0);
    let mut inputs = GuideInputs {
        rgb: &rgb,
        variance: &variance,
        albedo: &rgb,
        normal: &rgb,
        depth: &[f32::INFINITY],
        width: 1,
        height: 1,
    };
    assert_eq!(denoise(&inputs), rgb);
    inputs.width = 7;
    assert_eq!(denoise(&inputs), rgb);
}

/// A floor of white tiles and of tiles as dark as `dark`, of albedo 0.8, with 2 % of reflection on both; noise of 50 %.
fn tiles(dark: f32, side: usize) -> Picture {
    let mut state = 4;
    let pixels = || (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    let albedo: Vec<[f32; 3]> =
        pixels().map(|(x, y)| if (x / side + y / side).is_multiple_of(2) { [dark; 3] } else { [0.8; 3] }).collect();
    let truth: Vec<[f32; 3]> = albedo.iter().map(|albedo| albedo.map(|channel| 50.0 * (channel + 0.02))).collect();
    let noisy = truth
        .iter()
        .map(|rgb| {
            let factor = (1.0 + 0.5 * normal(&mut state)).max(0.0);
            rgb.map(|channel| channel * factor)
        })
        .collect();
    let variance = truth.iter().map(|rgb| (0.5 * luminance(*rgb)).powi(2)).collect();
    Picture {
        truth,
        noisy,
        variance: Plane::from_values(WIDTH, HEIGHT, variance).unwrap(),
        albedo,
        normal: vec![[0.0, 0.0, 1.0]; WIDTH * HEIGHT],
        depth: vec![3.0; WIDTH * HEIGHT],
    }
}

/// What is too dark for its light to be divided by its albedo is in another unit than what is not.
#[test]
fn black_and_white_tiles_keep_their_light() {
    for (dark, side) in [(0.0, 6), (0.019, 6), (0.0, 3), (0.2, 6)] {
        let picture = tiles(dark, side);
        let denoised = run(&picture);
        for is_white in [false, true] {
            let sum = |of: &[[f32; 3]]| -> f32 {
                let kept = of.iter().zip(&picture.albedo).filter(|(_, albedo)| (albedo[0] > 0.5) == is_white);
                kept.map(|(rgb, _)| rgb[0]).sum()
            };
            let ratio = sum(&denoised) / sum(&picture.truth);
            // The reflection, which has no albedo, makes the tiles' illuminations differ by 7 % where both are divided.
            assert!((ratio - 1.0).abs() < 0.05, "albedo {dark}, {side} pixels, white {is_white}: {ratio} of its light");
        }
    }
}

/// A pixel without an albedo among others that have one keeps what it has: nothing beside it says better.
#[test]
fn a_pixel_without_albedo_keeps_its_light() {
    let wall = picture(5);
    let index = 20 * WIDTH + 30;
    for (broken, rgb) in [(0.0, [0.4; 3]), (f32::NAN, wall.noisy[index])] {
        let mut picture = picture(5);
        picture.albedo[index] = [broken; 3];
        picture.noisy[index] = rgb;
        let found = run(&picture)[index];
        assert!(found.iter().zip(rgb).all(|(found, rgb)| (found / rgb - 1.0).abs() < 1e-5), "{found:?} for {rgb:?}");
    }
}

/// Nothing beside the picture is taken for a neighbour, where nothing is hit least of all; in the second tile of a
/// row, too.
#[test]
fn an_even_sky_stays_even() {
    let (width, height) = (70, 5);
    let pixels = width * height;
    let denoised = denoise(&GuideInputs {
        rgb: &vec![[1.0; 3]; pixels],
        variance: &Plane::filled(width, height, 1.0),
        albedo: &vec![[1.0; 3]; pixels],
        normal: &vec![[0.0; 3]; pixels],
        depth: &vec![f32::INFINITY; pixels],
        width,
        height,
    });
    for (index, rgb) in denoised.iter().enumerate() {
        assert!(rgb.iter().all(|channel| (channel - 1.0).abs() < 1e-5), "pixel {index}: {rgb:?}");
    }
}
