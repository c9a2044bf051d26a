//! What must hold for any picture.

use fechner_perception::difference::difference;
use fechner_perception::{
    CastleCsf, Display, GuideNoise, Plane, ThresholdInputs, ThresholdMap, Viewing, csf, model, threshold_map,
};
use proptest::prelude::*;

/// Pictures of any small size, luminances over twelve decades and some blacks.
fn pictures() -> impl Strategy<Value = Plane> {
    (1_usize..24, 1_usize..24).prop_flat_map(|(width, height)| {
        let pixel = prop_oneof![1 => Just(0.0_f32), 9 => (-4.0_f32..8.0).prop_map(|decade| 10.0_f32.powf(decade))];
        proptest::collection::vec(pixel, width * height)
            .prop_map(move |values| Plane::from_values(width, height, values).expect("as many as pixels"))
    })
}

fn map_of(picture: &Plane, pixels_per_degree: f64) -> ThresholdMap {
    let viewing = Viewing { display: Display { pixels_per_degree, ..Display::default() }, ..Viewing::default() };
    let inputs = ThresholdInputs::clean(picture);
    threshold_map(&inputs, &viewing, &CastleCsf::default()).expect("a good picture")
}

fn never_nan(plane: &Plane) -> bool {
    plane.values().iter().all(|value| !value.is_nan() && *value >= 0.0)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn no_picture_gives_nan(picture in pictures(), ppd in 2.0_f64..120.0) {
        let map = map_of(&picture, ppd);
        prop_assert!(map.noise_gain().values().iter().all(|gain| gain.is_finite() && *gain > 0.0));
        prop_assert!(never_nan(&map.predicted_visibility(&picture)));
        prop_assert!(never_nan(&map.measured_visibility(&picture)));
        prop_assert!(map.masking_elevation().values().iter().all(|m| (0.999..3.01).contains(m)));
    }

    #[test]
    fn visibility_scales_with_error(picture in pictures(), scale in 0.1_f32..10.0) {
        let map = map_of(&picture, 30.0);
        let error = Plane::from_fn(picture.width(), picture.height(), |x, y| {
            map.adaptation_cd_m2().get(x, y) * 0.01 * if (x * 5 + y * 3) % 7 < 3 { 1.0 } else { -1.0 }
        });
        let (one, scaled) = (map.measured_visibility(&error), map.measured_visibility(&error.map(|e| e * scale)));
        for (one, scaled) in one.values().iter().zip(scaled.values()) {
            prop_assert!((scaled - one * scale).abs() <= 1e-3 * (one * scale).max(1e-2), "{one} {scaled}");
        }
    }

    #[test]
    fn more_error_is_never_less_visible(picture in pictures(), factors in proptest::collection::vec(1.0_f32..5.0, 1..9)) {
        let map = map_of(&picture, 45.0);
        let variance = picture.map(|value| 1e-4 * value * value);
        let mut more = variance.clone();
        for (index, value) in more.values_mut().iter_mut().enumerate() {
            *value *= factors[index % factors.len()];
        }
        let (less, more) = (map.predicted_visibility(&variance), map.predicted_visibility(&more));
        for (less, more) in less.values().iter().zip(more.values()) {
            prop_assert!(*more >= less * 0.999_99, "{less} {more}");
        }
    }

    #[test]
    fn more_distance_hides_what_is_above_the_peak(luminance in 0.1_f32..200.0, near in 20.0_f64..60.0, step in 1.1_f64..2.0) {
        // The finest checkerboard: √2 · ppd / 2 cycles a degree.
        let grey = Plane::filled(48, 48, luminance);
        let checks = Plane::from_fn(48, 48, |x, y| luminance * if (x + y) % 2 == 0 { 0.1 } else { -0.1 });
        let at = |ppd: f64| map_of(&grey, ppd).measured_visibility(&checks).get(24, 24);
        prop_assert!(at(near * step) <= at(near), "{} {}", at(near * step), at(near));
    }

    #[test]
    fn noise_is_less_visible_from_farther_away(luminance in 0.1_f32..200.0, near in 20.0_f64..60.0, step in 1.1_f64..2.0) {
        let grey = Plane::filled(8, 8, luminance);
        let at = |ppd: f64| map_of(&grey, ppd).noise_gain().get(4, 4);
        prop_assert!(at(near * step) < at(near));
    }

    #[test]
    fn differences_are_never_nan(a in pictures()) {
        let b = a.map(|value| value * 1.01 + 0.1);
        let seen = difference(&a, &b, &Viewing::default(), &CastleCsf::default()).expect("two pictures of one size");
        prop_assert!(never_nan(&seen.visibility) && seen.worst_visibility >= 0.0);
    }

    #[test]
    fn every_model_and_every_csf_answers(picture in pictures(), csf in proptest::sample::select(csf::names())) {
        let viewing = Viewing::default();
        let csf = csf::by_name(csf, &viewing).expect("a known name");
        for model in model::names().iter().map(|name| model::by_name(name).expect("a known name")) {
            let inputs = model::ModelInputs {
                display_luminance_cd_m2: &picture,
                guide_noise: GuideNoise::BeforeDenoising(&picture),
                image_velocity_deg_s: Some(&picture),
                attention: None,
                viewing: &viewing,
                csf: &*csf,
            };
            let allowed = model.allowed_standard_error_cd_m2(&inputs).expect("a good picture");
            prop_assert!(allowed.values().iter().all(|value| value.is_finite() && *value > 0.0), "{} {}", model.name(), csf.name());
        }
    }
}
