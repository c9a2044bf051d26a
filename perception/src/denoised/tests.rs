use super::*;
use crate::csf::{CastleCsf, ChromaticChannel, FrameTiming};
use crate::display::{Display, Viewing};
use crate::filter::gaussian_blur;
use crate::test_noise::normal;
use crate::threshold::{ThresholdInputs, threshold_map};

const SIDE: usize = 256;
const GREY: f32 = 100.0;

/// 30 pixels a degree, so that the picture is 8.5° wide.
fn map_of(picture: &Plane) -> ThresholdMap {
    let viewing = Viewing::of(Display::preset("strict").unwrap());
    let inputs = ThresholdInputs::clean(picture);
    threshold_map(&inputs, &viewing, &CastleCsf::default()).unwrap()
}

fn grey() -> Plane {
    Plane::filled(SIDE, SIDE, GREY)
}

fn white_noise(seed: u64, deviation: f32) -> Plane {
    let mut state = seed;
    let mut plane = Plane::filled(SIDE, SIDE, 0.0);
    plane.values_mut().iter_mut().for_each(|value| *value = deviation * normal(&mut state));
    plane
}

/// Noise of blotches this wide (full width of a Gaussian at half height) and this RMS.
fn blotches(seed: u64, width_deg: f64, rms: f32) -> Plane {
    let smooth = gaussian_blur(&white_noise(seed, 1.0), width_deg * 30.0 / 2.355);
    let found = smooth.map(|value| value * value).mean().sqrt() as f32;
    smooth.map(|value| value * rms / found)
}

/// A picture whose raw and denoised halves are given.
struct Halves {
    denoised: Plane,
    denoised_halves: [Plane; 2],
    raw_halves: [Plane; 2],
}

impl Halves {
    fn judged(&self, map: &ThresholdMap) -> DenoisedError {
        self.judged_after(Blending::Proven, map)
    }

    fn judged_after(&self, blending: Blending, map: &ThresholdMap) -> DenoisedError {
        let half = |a: &Plane, b: &Plane| a.combined(b, |a, b| 0.5 * (a - b));
        let [a, b] = &self.denoised_halves;
        let [raw_a, raw_b] = &self.raw_halves;
        let half_difference = half(a, b);
        let raw_half_difference = half(raw_a, raw_b);
        let raw = raw_a.combined(raw_b, |a, b| 0.5 * (a + b));
        let differences = DenoisedDifferences {
            half_difference: &half_difference,
            residual: &self.denoised.combined(&raw, |denoised, raw| denoised - raw),
            residual_half_difference: &half_difference.combined(&raw_half_difference, |denoised, raw| denoised - raw),
        };
        map.denoised_error_after(blending, &differences)
    }

    /// A denoiser that takes all white noise of each half and gives the truth plus its own mistakes.
    fn of(truth: &Plane, mistakes: [Plane; 2], raw_deviation: f32, seed: u64) -> Self {
        let sum = |a: &Plane, b: &Plane| a.combined(b, |a, b| a + b);
        let denoised_halves = mistakes.each_ref().map(|mistake| sum(truth, mistake));
        let denoised = denoised_halves[0].combined(&denoised_halves[1], |a, b| 0.5 * (a + b));
        let raw_halves = [0, 1].map(|half| sum(truth, &white_noise(seed + 1000 * half, raw_deviation)));
        Self { denoised, denoised_halves, raw_halves }
    }
}

fn parts_make_the_whole(error: &DenoisedError) -> bool {
    let parts = error.variance.combined(&error.bias, f32::hypot);
    parts.values().iter().zip(error.visibility.values()).all(|(parts, whole)| (parts - whole).abs() <= 1e-4 * whole)
}

fn energy(visibility: &Plane) -> f64 {
    visibility.map(|v| v * v).mean()
}

/// Blotches that the denoiser leaves are as visible as the law says, whatever their size. A picture holds about a
/// dozen of 3°: each pair of halves is shown twice, once with one half's mistakes reversed, so that chance likeness
/// of the two cancels.
#[test]
fn blotches_of_one_and_of_three_degrees_are_as_visible_as_predicted() {
    let map = map_of(&grey());
    for width_deg in [1.0, 3.0] {
        let (mut predicted, mut truth, mut variance) = (0.0, 0.0, 0.0);
        for index in 0..16 {
            let (seed, sign) = (index / 2, if index % 2 == 0 { 1.0 } else { -1.0 });
            let [first, second] = [3, 5].map(|half| blotches(100 * seed + half, width_deg, 2.0));
            let mistakes = [first, second.map(|value| sign * value)];
            let mut halves = Halves::of(&grey(), mistakes.clone(), 1.0, 7 * seed + 1);
            // The raw halves hold the same light: a denoiser that leaves it alone.
            for (raw, mistake) in halves.raw_halves.iter_mut().zip(&mistakes) {
                *raw = raw.combined(mistake, |raw, mistake| raw + mistake);
            }
            let found = halves.judged(&map);
            predicted += energy(&found.visibility);
            variance += energy(&found.variance);
            let error = halves.denoised.map(|value| value - GREY);
            truth += energy(&map.measured_visibility(&error));
        }
        let ratio = (predicted / truth).sqrt();
        println!("{width_deg}°: {ratio:.3}, by variance {:.3}", (variance / truth).sqrt());
        assert!((ratio - 1.0).abs() < 0.1, "{width_deg}°: predicted {ratio} times the truth");
    }
}

/// A texture that both halves lose alike leaves no half difference, and the raw mean tells of it.
#[test]
fn a_smeared_texture_is_reported_as_bias() {
    let texture = Plane::from_fn(SIDE, SIDE, |x, y| {
        let wave = |at: usize| (std::f32::consts::TAU * 3.0 * at as f32 / 30.0).cos();
        GREY * (1.0 + 0.05 * wave(x) * wave(y))
    });
    let map = map_of(&grey());
    let lost = texture.map(|value| GREY - value);
    let halves = Halves::of(&texture, [lost.clone(), lost.clone()], 4.0, 3);
    let found = halves.judged(&map);
    let truth = energy(&map.measured_visibility(&lost)).sqrt();
    let as_it_is = halves.judged_after(Blending::Never, &map);
    let bias = energy(&as_it_is.bias).sqrt();
    assert!((bias / truth - 1.0).abs() < 0.1, "bias {bias}, truth {truth}");
    assert!(energy(&as_it_is.variance) < 1e-6 && truth > 2.0);
    assert_eq!(as_it_is.unproven(1.0).mean(), 0.0, "nothing is called fine");

    // And given back: the raw noise is far less visible than the loss.
    let raw = halves.raw_halves[0].combined(&halves.raw_halves[1], |a, b| 0.5 * (a + b));
    let residual = halves.denoised.combined(&raw, |denoised, raw| denoised - raw);
    let step = step_towards_raw(&map, &found, &residual).expect("worth it");
    let moved = halves.denoised.combined(&step, |denoised, step| denoised + step);
    let error = moved.combined(&texture, |moved, truth| moved - truth);
    let after = energy(&map.measured_visibility(&error)).sqrt();
    let predicted = energy(&found.visibility).sqrt();
    assert!(parts_make_the_whole(&found) && parts_make_the_whole(&as_it_is));
    assert!(after < 0.5 * truth, "{after} of {truth}");
    assert!((predicted / after - 1.0).abs() < 0.35, "predicted {predicted}, found {after}");
}

/// A bias that few places have is found where it is, and not elsewhere.
#[test]
fn a_local_bias_stays_local() {
    let inside = |x: usize, y: usize| (64..128).contains(&x) && (64..128).contains(&y);
    let mistake = Plane::from_fn(SIDE, SIDE, |x, y| if inside(x, y) && (x / 5 + y / 5) % 2 == 0 { 6.0 } else { 0.0 });
    let map = map_of(&grey());
    let halves = Halves::of(&grey(), [mistake.clone(), mistake.clone()], 6.0, 11);
    let found = halves.judged_after(Blending::Never, &map);
    let truth = map.measured_visibility(&mistake);
    let ratio = found.bias.get(96, 96) / truth.get(96, 96);
    assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
    assert!(found.visibility.get(220, 220) < 0.2, "{}", found.visibility.get(220, 220));
}

/// Where raw noise drowns a visible bias, nothing is called proven; where it is faint, everything is.
#[test]
fn strong_raw_noise_leaves_the_picture_unproven() {
    let map = map_of(&grey());
    let nothing = || Plane::filled(SIDE, SIDE, 0.0);
    let share = |deviation: f32| {
        let found = Halves::of(&grey(), [nothing(), nothing()], deviation, 5).judged(&map);
        (found.unproven(1.0).mean(), energy(&found.visibility).sqrt())
    };
    let (drowned, seen) = share(60.0);
    let raw = energy(&map.predicted_visibility(&Plane::filled(SIDE, SIDE, 0.5 * 60.0 * 60.0))).sqrt();
    assert!(drowned > 0.95 && seen < 0.05 * raw, "{drowned} {seen} of {raw}");
    let (faint, seen) = share(0.5);
    assert!(faint == 0.0 && seen < 0.1, "{faint} {seen}");
}

/// What is learned elsewhere goes for what no witness of the place's own tells, and for nothing else.
#[test]
fn only_what_is_inferred_is_raised() {
    let map = map_of(&grey());
    let raised = |raw_deviation: f32| {
        let mistakes = [15, 16].map(|seed| white_noise(seed, 2.0));
        let before = Halves::of(&grey(), mistakes, raw_deviation, 17).judged(&map);
        let mut after = before.clone();
        after.raise_inferred(2.0);
        (before.visibility.mean(), after.visibility.mean())
    };
    let (before, after) = raised(60.0);
    assert!((after / before - 2.0).abs() < 1e-3, "{before} {after}");
    let (before, after) = raised(0.2);
    assert_eq!(before, after);
}

/// Independent noise without bias: no factor is invented where the witness can tell, and chance alone is not believed.
#[test]
fn noise_without_bias_is_variance() {
    let map = map_of(&grey());
    let (mut predicted, mut truth) = (0.0, 0.0);
    for seed in 0..6 {
        let raw = [1, 2].map(|half| white_noise(50 * seed + half, 8.0));
        let smooth = raw.each_ref().map(|noise| gaussian_blur(noise, 1.5));
        let add = |noise: &Plane| noise.map(|noise| GREY + noise);
        let denoised_halves = smooth.each_ref().map(add);
        let halves = Halves {
            denoised: denoised_halves[0].combined(&denoised_halves[1], |a, b| 0.5 * (a + b)),
            denoised_halves,
            raw_halves: raw.each_ref().map(add),
        };
        let found = halves.judged(&map);
        predicted += energy(&found.visibility);
        truth += energy(&map.measured_visibility(&halves.denoised.map(|value| value - GREY)));
    }
    let ratio = (predicted / truth).sqrt();
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
}

#[test]
fn planes_of_another_size_are_infinitely_visible() {
    let map = map_of(&Plane::filled(16, 16, GREY));
    let (small, other) = (Plane::filled(16, 16, 0.0), Plane::filled(8, 16, 0.0));
    let found = map.denoised_error(&DenoisedDifferences {
        half_difference: &small,
        residual: &other,
        residual_half_difference: &small,
    });
    assert!(found.visibility.get(0, 0).is_infinite());
    assert!(step_towards_raw(&map, &found, &small).is_none());
}

/// Where thresholds are twice as high, what is called fine and unproven is what is so at half the target elsewhere.
#[test]
fn importance_goes_for_what_is_unproven_too() {
    let map = map_of(&grey());
    let mistakes = [18, 19].map(|seed| white_noise(seed, 2.0));
    let plain = Halves::of(&grey(), mistakes, 20.0, 20).judged(&map);
    let halved = plain.with_thresholds_times(&Plane::filled(SIDE, SIDE, 2.0));
    let target = plain.visibility.quantile(0.5);
    let expected = plain.unproven(target);
    assert!((0.1..0.9).contains(&expected.mean()), "{}", expected.mean());
    assert_eq!(halved.unproven(0.5 * target), expected);
    assert_eq!(halved.variance, plain.variance.map(|v| 0.5 * v));
    assert_eq!(halved.bias, plain.bias.map(|v| 0.5 * v));
}

#[test]
fn broken_pixels_are_infinitely_visible() {
    let map = map_of(&Plane::filled(16, 16, GREY));
    let fine = Plane::filled(16, 16, 0.0);
    for broken in 0..3 {
        let mut planes = [fine.clone(), fine.clone(), fine.clone()];
        planes[broken].values_mut()[17] = f32::NAN;
        let [half_difference, residual, residual_half_difference] = &planes;
        let found = map.denoised_error(&DenoisedDifferences { half_difference, residual, residual_half_difference });
        for plane in [&found.visibility, &found.variance, &found.bias] {
            assert!(plane.get(1, 1).is_infinite() && plane.get(8, 8) == 0.0, "plane {broken}");
        }
    }
}

/// A channel beside luminance counts where it shows more, and nowhere else.
#[test]
fn the_channel_that_shows_most_counts() {
    let of_error = |seed: u64, inside: fn(usize) -> bool| {
        let noise = white_noise(seed, 4.0);
        let mistake = Plane::from_fn(SIDE, SIDE, |x, y| if inside(x) { noise.get(x, y) } else { 0.0 });
        let half = mistake.map(|value| -value);
        Halves::of(&grey(), [mistake, half], 0.5, seed).judged(&map_of(&grey()))
    };
    let left = of_error(21, |x| x < SIDE / 2);
    let right = of_error(22, |x| x >= SIDE / 2);
    let both = left.clone().with_channel(&right);
    for (x, most, least) in [(32, &left, &right), (224, &right, &left)] {
        assert!(most.visibility.get(x, 128) > 2.0 * least.visibility.get(x, 128));
        let planes = |error: &DenoisedError| {
            [&error.visibility, &error.variance, &error.bias, &error.bias_squared_standard_error].map(|p| p.get(x, 128))
        };
        for (found, (most, least)) in planes(&both).into_iter().zip(planes(most).into_iter().zip(planes(least))) {
            assert_eq!(found, most.max(least));
        }
    }
}

/// Light that no half has found is bias, beside which noise stays what it is: squares add.
#[test]
fn missed_light_adds_to_the_bias() {
    let noise = white_noise(41, 4.0);
    let error = Halves::of(&grey(), [noise.clone(), noise.map(|value| -value)], 0.5, 41).judged(&map_of(&grey()));
    let missed = Plane::from_fn(SIDE, SIDE, |x, _| if x < SIDE / 2 { 3.0 } else { 0.0 });
    let found = error.clone().with_missed_light(&missed);
    assert_eq!(found.variance.values(), error.variance.values());
    let planes = |error: &DenoisedError, x| [&error.visibility, &error.bias].map(|p| p.get(x, 9));
    assert_eq!(planes(&found, SIDE - 1), planes(&error, SIDE - 1));
    for (found, without) in planes(&found, 0).into_iter().zip(planes(&error, 0)) {
        assert!((found * found - without * without - 9.0).abs() < 1e-3, "{found} {without}");
    }
}

/// Chromatic noise that is gone in the next frame is less visible, by the energy that castleCSF's temporal channels
/// leave; bias stays.
#[test]
fn chromatic_noise_of_a_moving_picture_is_less_visible() {
    let viewing = Viewing::of(Display::preset("strict").unwrap());
    let timing = FrameTiming { frames_per_second: 24.0, persistence: 1.0 };
    let (noise, nothing, luminance) = (white_noise(31, 2.0), Plane::filled(SIDE, SIDE, 0.0), grey());
    let smeared = white_noise(32, 2.0);
    for channel in [ChromaticChannel::RedGreen, ChromaticChannel::YellowViolet] {
        let error = |residual, residual_half_difference, frames| {
            let differences = DenoisedDifferences { half_difference: &noise, residual, residual_half_difference };
            let picture = ChromaticPicture { signal: &nothing, luminance_cd_m2: &luminance, differences };
            chromatic_error(channel, &picture, &viewing, frames).unwrap()
        };
        // A raw mean without noise is sure of what was smeared.
        let [still, moving] = [None, Some(timing)].map(|frames| error(&smeared, &nothing, frames).bias);
        assert!(still.mean() > 0.1 && moving.values() == still.values(), "{channel:?}: {}", still.mean());
        let of = |frames| error(&nothing, &noise, frames);
        let (still, moving) = (of(None), of(Some(timing)));
        let expected = timing.chromatic_energy(channel).unwrap();
        assert!(expected < 0.9, "{channel:?}: {expected}");
        let ratio = |of: fn(&DenoisedError) -> &Plane| of(&moving).mean() / of(&still).mean();
        assert!((ratio(|error| &error.variance) / expected.sqrt() - 1.0).abs() < 1e-5);
        assert!((ratio(|error| &error.bias_squared_standard_error) - 1.0).abs() < 1e-5);
        // All of it is noise here.
        assert!((ratio(|error| &error.visibility) / expected.sqrt() - 1.0).abs() < 1e-5);
    }
}
