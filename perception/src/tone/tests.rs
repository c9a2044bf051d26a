use super::*;
use crate::display::Display;
use crate::plane::Plane;
use crate::tvi;

fn guides() -> Vec<Plane> {
    let mut sparse = Plane::filled(8, 8, 0.0);
    sparse.values_mut()[3] = 1e30;
    let mut broken = Plane::filled(8, 8, 5.0);
    broken.values_mut()[0] = f32::NAN;
    broken.values_mut()[1] = f32::INFINITY;
    vec![
        Plane::filled(0, 0, 0.0),
        Plane::filled(1, 1, 0.0),
        Plane::filled(1, 1, 1e-40),
        Plane::filled(1, 1, 1e-6),
        Plane::filled(5, 4, 100.0),
        Plane::filled(5, 4, 1e6),
        Plane::from_fn(32, 32, |x, y| ((x * y) as f32).exp2().min(1e30)),
        sparse,
        broken,
    ]
}

fn settings() -> Vec<ToneSettings> {
    let effects = Effects { glare: true, acuity: true, colour: true };
    vec![
        ToneSettings { exposure_stops: 0.5, ..ToneSettings::default() },
        ToneSettings { scope: AdaptationScope::Local, ..ToneSettings::default() },
        ToneSettings { effects: Some(effects), ..ToneSettings::default() },
    ]
}

#[test]
fn every_operator_survives_every_picture_and_never_falls() {
    let blinded = AdaptationState::adapted_to(Goal::both(1e-6), &Kinetics::PATTANAIK_2000);
    let dazzled = AdaptationState::adapted_to(Goal::both(1e6), &Kinetics::PATTANAIK_2000).looking_at(Goal::both(0.0));
    for name in operator_names() {
        for (guide, settings) in guides().iter().flat_map(|guide| settings().into_iter().map(move |s| (guide, s))) {
            let operator = operator_with(name, &settings).unwrap();
            assert_eq!(&operator.name(), name);
            let states = if settings.exposure_stops > 0.0 { 3 } else { 1 };
            for state in [None, Some(&blinded), Some(&dazzled)].into_iter().take(states) {
                let fitted = operator.fit(&SceneGuide::of(guide), &Viewing::default(), state);
                for pixel in [Pixel::NOWHERE, Pixel { x: 0, y: 0 }, Pixel { x: 3, y: 2 }] {
                    check_fit(name, fitted.as_ref(), pixel);
                }
            }
        }
    }
}

fn check_fit(name: &str, fitted: &dyn FittedTone, pixel: Pixel) {
    let mut last = 0.0;
    for scene in [0.0, 1e-40, 1e-6, 1e-4, 0.1, 1.0, 10.0, 1e3, 1e6, 1e8, 1e30, f32::MAX, f32::INFINITY] {
        let relative = fitted.relative_luminance_at(pixel, scene);
        assert!(relative >= last && relative.is_finite(), "{name} at {scene}: {relative} after {last}");
        last = relative;
    }
    let [of_nothing, black] = [f32::NAN, 0.0].map(|scene| fitted.relative_luminance_at(pixel, scene));
    assert!(of_nothing == black, "{name}: NaN is shown as {of_nothing}, black as {black}");
    for rgb in [[0.0; 3], [1e30, 0.0, 0.0], [f32::NAN, 1.0, f32::INFINITY], [3.0, 100.0, 0.2], [1e-6; 3], [-1.0; 3]] {
        let shown = fitted.map_rgb_at(pixel, rgb);
        assert!(shown.iter().all(|channel| (0.0..=1.0).contains(channel)), "{name} {rgb:?} {shown:?}");
    }
}

/// Operators of different settings differ in their `Debug` form.
#[test]
fn every_operator_says_which_settings_change_it() {
    for name in operator_names() {
        let with = |settings: ToneSettings| format!("{:?}", operator_with(name, &settings).unwrap());
        let operator = operator(name, None).unwrap();
        let local = ToneSettings { scope: AdaptationScope::Local, ..ToneSettings::default() };
        assert_eq!(operator.knows_places(), with(local) != with(ToneSettings::default()), "{name}");
        let with = |effects| with(ToneSettings { effects: Some(effects), ..ToneSettings::default() });
        let nothing = Effects::default();
        let knows = |effect| with(effect) != with(nothing);
        let known = Effects {
            glare: knows(Effects { glare: true, ..nothing }),
            acuity: knows(Effects { acuity: true, ..nothing }),
            colour: knows(Effects { colour: true, ..nothing }),
        };
        assert_eq!(operator.optional_effects(), known, "{name}");
    }
}

#[test]
fn black_is_black_to_every_operator_that_has_no_veil() {
    let guide = Plane::from_fn(64, 64, |x, y| (x * y) as f32 * 0.1);
    for name in operator_names() {
        let fitted = operator(name, None).unwrap().fit(&SceneGuide::of(&guide), &Viewing::default(), None);
        assert!(fitted.map_rgb([0.0; 3]).iter().all(|channel| *channel < 1e-3), "{name}");
    }
}

#[test]
fn greys_stay_grey_and_have_the_luminance_that_is_promised() {
    let guide = Plane::from_fn(64, 64, |x, _| 10.0_f32.powf(x as f32 / 16.0 - 1.0));
    for name in operator_names() {
        let fitted = operator(name, None).unwrap().fit(&SceneGuide::of(&guide), &Viewing::default(), None);
        // Rods of `durand-dorsey00` see blue.
        let tint = if *name == "durand-dorsey00" { 0.4 } else { 2e-4 };
        for scene in [0.1, 1.0, 10.0, 30.0] {
            let [r, g, b] = fitted.map_rgb([scene; 3]);
            assert!((r - g).abs() <= tint * g.max(1e-3) && (b - g).abs() <= tint * g.max(1e-3), "{name}: {r} {g} {b}");
            let promised = fitted.relative_luminance(scene).min(1.0);
            assert!((luminance([r, g, b]) - promised).abs() < 1e-3, "{name} at {scene}: {r} {g} {b} for {promised}");
        }
    }
}

#[test]
fn a_saved_fit_is_the_same_operator() {
    let guide = Plane::from_fn(48, 32, |x, y| 10.0_f32.powf(x as f32 / 12.0 - 1.0) + y as f32);
    for name in operator_names() {
        for settings in settings() {
            let fit = operator_with(name, &settings).unwrap().fit(&SceneGuide::of(&guide), &Viewing::default(), None);
            let text = serde_json::to_string(&fit.save()).unwrap();
            let again = serde_json::from_str::<SavedTone>(&text).unwrap().restore();
            let pixel = Pixel { x: 30, y: 20 };
            let rgb = [3.0, 7.0, 1.0];
            assert_eq!(again.map_rgb_at(pixel, rgb), fit.map_rgb_at(pixel, rgb), "{name}");
            assert_eq!(again.acuity(), fit.acuity(), "{name}");
            assert_eq!(again.describe(), fit.describe());
        }
    }
}

/// Fits are read from files that may have been cut or written by hand.
#[test]
fn a_fit_with_numbers_missing_does_not_panic() {
    let guide = Plane::from_fn(200, 100, |x, _| 10.0_f32.powf(x as f32 / 40.0 - 1.0));
    for settings in settings() {
        let operator = operator_with("ward-larson97", &settings).unwrap();
        let fit = operator.fit(&SceneGuide::of(&guide), &Viewing::default(), None).save();
        let mut json = serde_json::to_value(&fit).unwrap();
        empty_lists(&mut json);
        let restored = serde_json::from_value::<SavedTone>(json).unwrap().restore();
        for (x, y) in [(0, 0), (199, 99), (usize::MAX, usize::MAX)] {
            let shown = restored.relative_luminance_at(Pixel { x, y }, 3.0);
            assert!(!shown.is_nan(), "{x} {y}");
        }
    }
}

fn empty_lists(json: &mut serde_json::Value) {
    match json {
        serde_json::Value::Array(list) => list.clear(),
        serde_json::Value::Object(fields) => fields.values_mut().for_each(empty_lists),
        _ => {}
    }
}

/// A step of one threshold by Blackwell's law, as it was printed with the operator, is one on the display.
#[test]
fn ward94_keeps_blackwells_threshold() {
    let blackwell = |adaptation: f64| 0.0594 * (1.219 + adaptation.powf(0.4)).powf(2.5);
    let viewing = Viewing::of(Display { black_cd_m2: 0.0, ..Display::default() });
    for adaptation in [0.001_f64, 0.1, 1.0, 10.0, 1000.0] {
        let guide = Plane::filled(8, 8, adaptation as f32);
        let fit = operator("ward94", None).unwrap().fit(&SceneGuide::of(&guide), &viewing, None);
        let shown = |light: f64| viewing.display.white_cd_m2 * f64::from(fit.relative_luminance(light as f32));
        let step = shown(adaptation + blackwell(adaptation)) - shown(adaptation);
        assert!((step / blackwell(viewing.display.white_cd_m2 / 2.0) - 1.0).abs() < 0.01, "{adaptation}: {step}");
    }
}

/// The scale that `ward-larson97` falls back to keeps thresholds of the combined curve.
#[test]
fn ward_larson97_falls_back_to_what_keeps_thresholds() {
    let viewing = Viewing::of(Display { black_cd_m2: 1.0, white_cd_m2: 100.0, ..Display::default() });
    for adaptation in [0.001_f64, 0.1, 0.5, 1.0, 10.0] {
        let guide = Plane::filled(8, 8, adaptation as f32);
        let fit = operator("wrp", None).unwrap().fit(&SceneGuide::of(&guide), &viewing, None);
        // Far enough above black, which is subtracted.
        let light = 5.0 * adaptation;
        let shown = |light: f64| 99.0 * f64::from(fit.relative_luminance(light as f32));
        let step = shown(light + tvi::combined(adaptation)) - shown(light);
        assert!((step / tvi::combined(10.0) - 1.0).abs() < 0.01, "{adaptation}: {step}");
    }
}

#[test]
fn a_state_of_the_eyes_moves_those_who_see_it_and_nobody_else() {
    let guide = Plane::filled(8, 8, 50.0);
    let dark = AdaptationState::adapted_to(Goal::both(0.1), &Kinetics::PATTANAIK_2000);
    for name in operator_names() {
        let operator = operator(name, None).unwrap();
        let at = |state| operator.fit(&SceneGuide::of(&guide), &Viewing::default(), state).relative_luminance(5.0);
        let moved = (at(Some(&dark)) - at(None)).abs() > 0.01;
        assert_eq!(moved, operator.sees_adaptation(), "{name}: {} {}", at(Some(&dark)), at(None));
    }
}

#[test]
fn what_rods_see_moves_those_who_look_at_it_and_nobody_else() {
    let (photopic, scotopic) = (Plane::filled(8, 8, 0.05), Plane::filled(8, 8, 2.0));
    for name in operator_names() {
        let operator = operator(name, None).unwrap();
        let at = |guide: SceneGuide<'_>| operator.fit(&guide, &Viewing::default(), None).relative_luminance(0.05);
        let grey = SceneGuide::of(&photopic);
        let moved = (at(SceneGuide { scotopic_cd_m2: Some(&scotopic), ..grey }) / at(grey) - 1.0).abs() > 0.01;
        assert_eq!(moved, operator.sees_rods(), "{name}");
    }
}

/// The chromatic slope is what a tint becomes in the picture, wherever the display does not clip it.
#[test]
fn a_tint_is_shown_as_strong_as_the_slope_says() {
    for level in [0.02, 1.0, 100.0] {
        let guide = Plane::from_fn(64, 64, |x, _| level * 10.0_f32.powf(x as f32 / 32.0 - 1.0));
        for (name, settings) in operator_names().iter().flat_map(|name| settings().into_iter().map(move |s| (name, s)))
        {
            let fitted =
                operator_with(name, &settings).unwrap().fit(&SceneGuide::of(&guide), &Viewing::default(), None);
            let pixel = Pixel { x: 32, y: 32 };
            let scenes = [0.1, 0.5, 1.0, 3.0].map(|share| share * level);
            let is_unclipped = |scene: &f32| fitted.relative_luminance_at(pixel, 1.1 * scene) < 0.9;
            assert!(scenes.iter().any(is_unclipped), "{name} {settings:?} clips all of {scenes:?}");
            for scene in scenes.into_iter().filter(is_unclipped) {
                let found = fitted.chromatic_slope_at(pixel, scene);
                let shown = chroma_slope_of_picture(fitted.as_ref(), pixel, scene);
                let close = (found - shown).abs() <= 0.03 * shown + 1e-3 / level;
                assert!(close, "{name} {settings:?} at {scene}: {found}, shown {shown}");
            }
        }
    }
}

/// Red–green signal of the picture for a red tint, over the scene's.
fn chroma_slope_of_picture(fitted: &dyn FittedTone, pixel: Pixel, scene: f32) -> f32 {
    let red_green = |sign: f32| {
        let tint = crate::test_noise::red_for_green(1.0).map(|part| scene * (1.0 + sign * 0.02 * part));
        let red_green = |rgb| crate::opponent::opponent(rgb).red_green;
        (red_green(fitted.map_rgb_at(pixel, tint)), red_green(tint))
    };
    let ((shown_up, up), (shown_down, down)) = (red_green(1.0), red_green(-1.0));
    (shown_up - shown_down) / (up - down)
}

#[test]
fn a_picture_is_mapped_as_its_pixels_are_with_any_number_of_threads() {
    let rgb: Vec<[f32; 3]> = (0..48 * 32).map(|i| [i as f32 * 0.1, 3.0, (i % 48) as f32]).collect();
    let guide = Plane::from_fn(48, 32, |x, y| luminance(rgb[y * 48 + x]));
    for name in operator_names() {
        let settings = ToneSettings { scope: AdaptationScope::Local, ..ToneSettings::default() };
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let operator = operator_with(name, &settings).unwrap();
                let fit = operator.fit(&SceneGuide::of(&guide), &Viewing::default(), None);
                map_picture(fit.as_ref(), 48, &rgb)
            })
        };
        assert_eq!(run(1), run(2), "{name}");
    }
}

/// What a picture does not cover changes nothing of what is shown, whatever an operator makes of darkness; and those
/// that make something of it say so. Regression: eyes took what is not covered for night, and a daylit figure in a
/// picture of which 85 % were nothing came out flat white.
#[test]
fn what_is_not_there_is_not_adapted_to() {
    let lit = |x: usize, y: usize| if (x + y).is_multiple_of(2) { 800.0 } else { 4000.0 };
    let is_there = |x: usize, _: usize| x < 48;
    for name in operator_names() {
        for settings in settings() {
            let operator = operator_with(name, &settings).unwrap();
            let shown = |width: usize, beyond: f32| {
                let guide = Plane::from_fn(width, 48, |x, y| if is_there(x, y) { lit(x, y) } else { beyond });
                let fitted = operator.fit(&SceneGuide::of(&guide), &Viewing::default(), None);
                [15.0, 150.0, 1500.0].map(|cd_m2| fitted.relative_luminance_at(Pixel { x: 24, y: 24 }, cd_m2))
            };
            let alone = shown(48, 0.0);
            let change = |other: [f32; 3]| {
                other.iter().zip(alone).map(|(other, alone)| (other / alone - 1.0).abs()).fold(0.0, f32::max)
            };
            let (nothing, darkness) = (change(shown(384, f32::NAN)), change(shown(384, 0.0)));
            assert!(nothing < 0.12, "{name}, {settings:?}: another by {nothing} beside nothing");
            let is_plain = settings.scope == AdaptationScope::World && settings.effects.is_none();
            assert!(
                !is_plain || (darkness > 0.02) == operator.counts_darkness(),
                "{name}: another by {darkness} beside darkness"
            );
        }
    }
}
