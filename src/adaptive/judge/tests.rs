use super::*;
use crate::adaptive::is_reached;
use crate::adaptive::test_films::{film_of, film_of_halves, film_of_lamps, settings};
use crate::denoise::Denoiser;
use crate::film::film_of_samples;
use crate::integrator::{FirstHit, PathSample};
use crate::sampler::hash_words;
use fechner_perception::csf::FrameTiming;
use fechner_perception::tone::{Pixel, SceneLight, operator};
use glam::Vec3;

/// Noise that leaves luminance alone is seen by its colour: no stop at the pilot.
#[test]
fn isoluminant_noise_is_seen() {
    let red_for_green = Vec3::new(1.0, -0.2126 / 0.7152, 0.0);
    let film = film_of(|_, random| Vec3::splat(0.8) + 0.7 * random * red_for_green);
    let judgement = judge(&film, &settings(), 1.0).expect("judges");
    let luminance_variance = judgement.estimate.variance_of_mean.get(32, 32);
    assert!(luminance_variance < 1e-4, "luminance varies by {luminance_variance}");
    assert!(judgement.predicted.get(32, 32) > 1.0, "v = {}", judgement.predicted.get(32, 32));
    let of_luminance = LoopSettings { model: fechner_perception::model::by_name("tvi"), ..settings() };
    let blind = judge(&film, &of_luminance, 1.0).expect("judges");
    assert!(blind.predicted.get(32, 32) < 0.01, "a model of luminance sees {}", blind.predicted.get(32, 32));
}

/// Nor does a denoiser hide it: what it leaves of colour's noise and smears of its patterns counts.
#[test]
fn isoluminant_noise_is_seen_in_denoised_pictures() {
    let red_for_green = Vec3::new(1.0, -0.2126 / 0.7152, 0.0);
    let film = film_of(|_, random| Vec3::splat(0.8) + 0.7 * random * red_for_green);
    let denoised = || LoopSettings { denoiser: Some(Denoiser::Builtin), ..settings() };
    let seen = judge(&film, &denoised(), 1.0).expect("judges").predicted;
    let of_luminance = LoopSettings { model: fechner_perception::model::by_name("tvi"), ..denoised() };
    let blind = judge(&film, &of_luminance, 1.0).expect("judges").predicted;
    assert!(seen.get(32, 32) > 10.0 * blind.get(32, 32), "{} and {}", seen.get(32, 32), blind.get(32, 32));
}

/// Beyond white every colour is white, and one sample in sixteen that brings thirty times as much changes
/// nothing of what is shown. Regression: without the halves' difference as displayed, visibility of the
/// second came to 15.4; it is 2.2.
#[test]
fn noise_beyond_white_is_not_seen() {
    let red_for_green = Vec3::new(1.0, -0.2126 / 0.7152, 0.0);
    let coloured = film_of(|_, random| Vec3::splat(3.0) + 2.0 * random * red_for_green);
    let rare = film_of(|_, random| Vec3::splat(if random > 0.875 { 80.0 } else { 2.4 }));
    for (film, most) in [(coloured, 0.01), (rare, 3.0)] {
        let judgement = judge(&film, &settings(), 1.0).expect("judges");
        let told = judgement.predicted.quantile(0.99);
        assert!(told < most, "{told}");
    }
}

/// A wall far beyond white in red, and below it in green and blue: where each channel is clipped by itself, its noise
/// is seen there. Regression: by greys of its luminance its visibility came to 0, since such a wall would be white.
#[test]
fn noise_below_a_clipped_channel_is_seen() {
    let red = Vec3::new(20.0, 0.4, 0.2);
    let film = film_of(|_, random| red * (1.0 + 0.5 * random));
    let settings = LoopSettings { operator: operator("srgb", None).expect("an operator"), ..settings() };
    let judgement = judge(&film, &settings, 1.0).expect("judges");
    let (predicted, measured) = (judgement.predicted.mean(), judgement.measured_error().visibility.mean());
    assert!(predicted > 2.0 && (0.7..1.4).contains(&(predicted / measured)), "{predicted} for {measured}");
    let wall_cd_m2 = 100.0 * fechner_perception::photometry::luminance(red.to_array());
    let shown = judgement.tone.relative_luminance_at(Pixel { x: 32, y: 32 }, wall_cd_m2);
    assert!((shown - 0.59).abs() < 0.02, "{shown} of white");
}

/// A film of so many samples of grey noise in half A of each pixel, and so many in half B.
fn noisy(samples: [u32; 2]) -> Film {
    film_of_halves(samples, |_| false, |_, _, random| Vec3::splat(0.8 + 0.5 * random))
}

/// Whether a half was lucky and went beyond white is no matter to what it decides by, or it would stop because of its
/// luck; the other half goes by it. On a lamp's rim, where light is expected, as elsewhere.
#[test]
fn a_half_does_not_go_by_its_own_luck() {
    const RIM: u32 = 32 * 64 + 32;
    const LAMP: u32 = RIM + 1;
    for shines in [false, true] {
        let of_halves = |lucky: f32| {
            let grey = |pixel, half, random| match (pixel, half) {
                (RIM, Half::A) => lucky + 0.5 * random,
                (RIM, Half::B) => 1.0 + random,
                (LAMP, _) => 5.0,
                _ => 0.1 + 0.01 * random,
            };
            let is_lamp = |pixel| shines && [RIM, LAMP].contains(&pixel);
            let film = film_of_halves([8, 8], is_lamp, |pixel, half, random| Vec3::splat(grey(pixel, half, random)));
            let judgement = judge_for(LookFor::Plan, &film, &settings(), 1.0).expect("judges");
            judgement.variance_per_sample.expect("is to plan by").map(|half| half.values()[RIM as usize])
        };
        let ([a, b], [lucky_a, lucky_b]) = (of_halves(1.0), of_halves(20.0));
        assert!((lucky_a / a - 1.0).abs() < 0.01, "half A decides by {a} and, when lucky, by {lucky_a}");
        assert!(lucky_b < 0.5 * b, "half B decides by {b}, and by {lucky_b} where A saw nothing but white");
    }
}

/// Two single samples show √8 times the noise of eight each, about; of one alone nothing is claimed, denoised or not.
#[test]
fn few_samples_claim_no_more_than_they_know() {
    let visible = |samples: [u32; 2]| judge(&noisy(samples), &settings(), 1.0).expect("judges").predicted.mean();
    let ratio = visible([1, 1]) / visible([8, 8]);
    assert!((0.7..1.3).contains(&(ratio / 8f64.sqrt())), "{ratio} times as visible");
    for denoiser in [None, Some(Denoiser::Builtin)] {
        let settings = LoopSettings { denoiser, ..settings() };
        for samples in [[1, 0], [0, 0], [4, 0]] {
            let judgement = judge(&noisy(samples), &settings, 1.0).expect("judges");
            assert!(!judgement.is_known && !is_reached(&judgement, f64::INFINITY), "{samples:?}");
            assert!(judgement.predicted.values().iter().all(|v| *v == f32::INFINITY), "{samples:?}");
        }
        assert!(judge(&noisy([1, 1]), &settings, 1.0).expect("judges").is_known);
    }
}

/// One sample a pixel is no witness against its own denoising: the picture stays what the filter made of it.
#[test]
fn a_single_sample_does_not_undo_its_denoising() {
    let film = noisy([1, 0]);
    let settings = LoopSettings { denoiser: Some(Denoiser::Builtin), ..settings() };
    let judgement = judge(&film, &settings, 1.0).expect("judges");
    let denoised = crate::denoise::denoise_film(&Denoiser::Builtin, &film, settings.nits_per_unit).expect("denoises");
    assert_eq!(judgement.picture(), denoised.rgb_cd_m2);
}

/// What the display clips is not pooled into dark neighbours: a lamp that scatters by a thousand times white.
#[test]
fn a_clipped_lamp_does_not_trouble_its_neighbours() {
    let dim = |random: f32| Vec3::splat(0.5 + 0.05 * random);
    let film = film_of(|_, random| dim(random));
    let is_lamp = |pixel: u32| (28..36).contains(&(pixel % 64)) && (28..36).contains(&(pixel / 64));
    let lit = film_of(|pixel, random| if is_lamp(pixel) { Vec3::splat(2000.0 + 900.0 * random) } else { dim(random) });
    let beside = |film: &Film| judge(film, &settings(), 1.0).expect("judges").pooled_variance_per_sample.get(37, 32);
    let (before, after) = (beside(&film), beside(&lit));
    assert!(after < 4.0 * before, "variance beside the lamp went from {before} to {after}");
}

/// A lamp's rim that none of sixteen samples has met leaves no scatter, and yet is not done: the pixel beside it says
/// that a hundredth of the filter's light comes from the lamp.
#[test]
fn a_rim_that_no_sample_met_is_seen() {
    let column = |pixel: u32| pixel % 64;
    let radiance = |pixel: u32| match column(pixel) {
        0..=31 => 40.0,
        32 => 20.0,
        _ => 0.01,
    };
    let film = film_of_lamps(|pixel, _| Vec3::splat(radiance(pixel)), |pixel| column(pixel) <= 32);
    let judgement = judge_for(LookFor::Plan, &film, &settings(), 1.0).expect("judges");
    // 1.3 % of 4,000 cd/m², less for sixteen samples without it: 43 cd/m² on 1.
    let displayed = (judgement.pooled_variance_per_sample.get(33, 32) / 16.0).sqrt();
    assert!((20.0..80.0).contains(&displayed), "{displayed} cd/m²");
    let visibility = judgement.predicted.get(33, 32);
    assert!(visibility > 2.0 && !is_reached(&judgement, 1.0), "v = {visibility}");
    assert!(judgement.variance_per_sample.is_some_and(|halves| halves.iter().all(|half| half.get(33, 32) > 1000.0)));
    assert_eq!(judgement.pooled_variance_per_sample.get(40, 32), 0.0, "not where the filter does not reach");
}

/// One that a sample of one half has met is beyond white by its mean, and no better known for that: counts that ended
/// there made a small lamp that moves 19 % too bright.
#[test]
fn a_rim_that_was_lucky_is_not_done() {
    let place = 21 * 64 + 33;
    let noise_beside_a_lamp = |luck: f32| {
        let radiance = |pixel: u32, random: f32| match pixel % 64 {
            0..=31 => 40.0,
            32 => 20.0,
            _ if pixel == place && random > luck => 40.0,
            _ => 0.01,
        };
        let film = film_of_lamps(|pixel, random| Vec3::splat(radiance(pixel, random)), |pixel| pixel % 64 <= 32);
        let lucky_halves = Half::BOTH.map(|half| film.half(half)[place as usize].mean[0] > 1.0);
        let judgement = judge_for(LookFor::Plan, &film, &settings(), 1.0).expect("judges");
        (lucky_halves, judgement.pooled_variance_per_sample.values()[place as usize])
    };
    let (none, unmet) = noise_beside_a_lamp(2.0);
    let (one, met) = noise_beside_a_lamp(0.85);
    assert_eq!((none, one.iter().filter(|&&is_lucky| is_lucky).count()), ([false; 2], 1), "{one:?}");
    assert!(met > 0.4 * unmet, "{met} where it was met, {unmet} where not");
}

/// An operator that sees rods is fitted to what they see: of blue, more than cones do.
#[test]
fn rods_see_the_colours_of_the_guide() {
    let film = film_of(|_, random| (1.0 + 0.1 * random) * Vec3::new(0.002, 0.01, 0.05));
    for denoiser in [None, Some(Denoiser::Builtin)] {
        let operator = fechner_perception::tone::operator("ferwerda96", None).expect("an operator");
        let settings = LoopSettings { operator, nits_per_unit: 1.0, denoiser, ..settings() };
        let judgement = judge(&film, &settings, 1.0).expect("judges");
        let light = [[0.002, 0.01, 0.05]; 4];
        let expected = settings.operator.fit(
            &SceneLight::of(settings.operator.as_ref(), 2, &light).guide(),
            &settings.viewing,
            None,
        );
        let [found, expected] = [judgement.tone.as_ref(), expected.as_ref()].map(|tone| tone.relative_luminance(0.01));
        assert!((found / expected - 1.0).abs() < 0.02, "{found}, not {expected}");
    }
}

/// What is beyond all numbers cannot be called unseen: neither does a loop end there, nor does it fail.
#[test]
fn light_beyond_all_numbers_is_seen() {
    let film = film_of(|pixel, random| Vec3::splat(if pixel < 64 { 1e12 * (1.0 + random) } else { 1.0 }));
    for unit in [1e12, 1e15, 1e20] {
        let extreme = LoopSettings { nits_per_unit: unit, ..settings() };
        let judgement = judge_for(LookFor::Plan, &film, &extreme, 1.0).expect("judges");
        assert!(!is_reached(&judgement, 1.0), "{unit:e}: {}", judgement.predicted.mean());
        assert!(judgement.predicted.values().iter().all(|v| !v.is_nan()), "{unit:e}");
    }
}

/// A black disc's border, half of whose samples meet nothing: before black there is nothing to see, and before white a
/// lot.
#[test]
fn noise_of_alpha_is_seen_over_white() {
    let film = film_of_samples([64, 64], [8; 2], |pixel, half, index| {
        let key = u64::from(pixel) << 8 | u64::from(index);
        let is_border = (24..40).contains(&(pixel % 64));
        let object_id = u32::from(!is_border || hash_words(key, half.index() as u64) >> 63 == 0);
        let first_hit = FirstHit { object_id, ..FirstHit::WALL };
        PathSample { radiance: Vec3::ZERO, first_hit, rays: 1 }
    });
    let opaque = judge(&film, &settings(), 1.0).expect("judges");
    assert_eq!(opaque.predicted.quantile(1.0), 0.0);
    for denoiser in [None, Some(Denoiser::Builtin)] {
        let transparent = LoopSettings { is_transparent: true, denoiser, ..settings() };
        let judgement = judge_for(LookFor::Plan, &film, &transparent, 1.0).expect("judges");
        let [predicted, measured] = [&judgement.predicted, &judgement.measured_error().visibility]
            .map(|visibility| f64::from(visibility.get(32, 32)));
        assert!(predicted > 2.0, "{predicted} at the border");
        assert!((0.6..1.6).contains(&(measured / predicted)), "{measured} by the halves, {predicted} by variance");
        // What the plan goes by shows before black what there is to see before white.
        let per_sample = judgement.pooled_variance_per_sample.get(32, 32);
        let rough = judgement.energy_of(&judgement.pooled_variance_per_sample).get(32, 32) / 16.0;
        assert!(per_sample > 0.0 && rough.sqrt() > 0.5 * judgement.predicted.get(32, 32), "{rough}");
        assert!(judgement.variance_per_sample.is_some_and(|[a, b]| a.get(32, 32) > 0.0 && b.get(32, 32) > 0.0));
    }
}

/// What a denoiser smears stays where it is from frame to frame: in a shot it is seen as well as in a still, where
/// noise is seen less. What is left of that are blotches, which are hidden less than grain is: 0.88 of a still's.
#[test]
fn a_denoised_frame_has_the_bias_of_a_still() {
    let film = film_of(|pixel, random| Vec3::splat(0.5 + 0.3 * (pixel % 2) as f32 + 0.4 * random));
    let timing = FrameTiming { frames_per_second: 24.0, persistence: 1.0 };
    let error_of = |frames| {
        let settings = LoopSettings { denoiser: Some(Denoiser::Builtin), frames, ..settings() };
        let judgement = judge(&film, &settings, 1.0).expect("judges");
        judgement.denoised_error().expect("denoised").into_owned()
    };
    let (still, frame) = (error_of(None), error_of(Some(timing)));
    let [still_bias, frame_bias] = [&still, &frame].map(|error| error.bias.mean());
    assert!(still_bias > 0.1 && (frame_bias / still_bias - 1.0).abs() < 1e-3, "{frame_bias}, {still_bias} of a still");
    let [still_noise, frame_noise] = [&still, &frame].map(|error| error.variance.mean());
    assert!((0.8..0.95).contains(&(frame_noise / still_noise)), "noise of {frame_noise}, {still_noise} of a still");
}
