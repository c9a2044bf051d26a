use super::*;
use crate::display::Display;
use crate::plane::Plane;
use crate::test_golden::check;

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found / expected - 1.0).abs() < relative, "{found} for {expected}");
}

/// The display of the check values: white 125 cd/m², no black of its own.
fn display() -> Viewing {
    Viewing::of(Display { white_cd_m2: 125.0, black_cd_m2: 0.0, ..Display::default() })
}

fn fitted(adaptation: f64) -> FittedPattanaik00 {
    let state = AdaptationState::adapted_to(Goal::both(adaptation), &Kinetics::PATTANAIK_2000);
    FittedPattanaik00::new(state, LocalAdaptation::default(), &display(), 1.0)
}

#[test]
fn golden_half_saturations() {
    check("ptyg_sigma_cone", 1e-6, |row| sigma_cone(row[0]));
    check("ptyg_sigma_rod_paper", 1e-6, |row| sigma_rod(row[0]));
    close(sigma_cone(0.0), 12.92, 1e-3);
    assert!(sigma_rod(0.0).is_finite() && sigma_rod(0.0) > 0.0);
    let Kinetics { cones, rods } = Kinetics::PATTANAIK_2000;
    check("ptyg_bleach_cone", 1e-9, |row| cones.steady_pigment(row[0]));
    check("ptyg_bleach_rod", 1e-9, |row| rods.steady_pigment(row[0]));
}

#[test]
fn golden_mapping() {
    let eye = DisplayEye::before(125.0);
    close(eye.references().white, 0.231_627_4, 1e-5);
    // Printed from the unrounded form of the half-saturation: 1.2e-5 away.
    close(eye.references().black, 0.023_450_5, 2e-5);
    let checks = [
        (1.0, 0.156_25, 3.9063),
        (1.0, 1.0, 14.1046),
        (1.0, 5.0, 57.8727),
        (25.0, 25.0, 25.021),
        (100.0, 100.0, 26.5646),
        (1000.0, 1000.0, 30.3483),
    ];
    for (adaptation, scene, expected) in checks {
        close(125.0 * f64::from(fitted(adaptation).relative_luminance(scene as f32)), expected, 2e-5);
    }
    for adaptation in [100.0, 1000.0, 1e4] {
        close(f64::from(fitted(adaptation).relative_luminance((5.0 * adaptation) as f32)), 1.0, 1e-5);
    }
    for (adaptation, expected) in [(100.0, 0.7869), (1000.0, 0.5636), (1e4, 0.4444)] {
        close(fitted(adaptation).appearance.scale, expected, 1e-3);
    }
    // Where the scene's range is smaller than the display's it is only shifted.
    close(fitted(1.0).appearance.scale, 1.0, 1e-12);
}

#[test]
fn colour_strength_of_an_identity_is_nearly_one() {
    let fit = fitted(25.0);
    close(fit.retina.cones.slope(fit.retina.cones.share(25.0)) / fit.display_slope, 0.947, 1e-3);
}

#[test]
fn out_of_the_dark_blinds_and_then_the_picture_comes() {
    let kinetics = Kinetics::PATTANAIK_2000;
    let theatre = AdaptationState::adapted_to(Goal::both(0.05), &kinetics);
    let door = theatre.looking_at(Goal::both(5000.0));
    let shown = |seconds: f64| {
        let state = door.after(Goal::both(5000.0), seconds, &kinetics);
        let fit = FittedPattanaik00::new(state, LocalAdaptation::default(), &display(), 1.0);
        [2000.0, 10_000.0].map(|light| fit.relative_luminance(light))
    };
    // At first even the darker grey is white; soon the two are told apart, and in the end the bright one alone is.
    let (first, last) = (shown(0.0), shown(60.0));
    assert!(first[0] >= 1.0 && first[1] >= 1.0, "{first:?}");
    let half = shown(0.3);
    assert!(half[0] < first[0] && half[1] / half[0] > 1.5, "{half:?}");
    assert!(last[0] < 0.3 && last[1] < 0.7, "{last:?}");
}

#[test]
fn into_a_cave_it_takes_minutes() {
    let kinetics = Kinetics::PATTANAIK_2000;
    let cave = AdaptationState::adapted_to(Goal::both(1000.0), &kinetics).looking_at(Goal::both(0.005));
    let contrast = |seconds: f64| {
        let state = cave.after(Goal::both(0.005), seconds, &kinetics);
        let fit = FittedPattanaik00::new(state, LocalAdaptation::default(), &display(), 1.0);
        fit.relative_luminance(0.02) / fit.relative_luminance(0.002)
    };
    let course = [1.0, 30.0, 120.0, 600.0, 1800.0].map(contrast);
    assert!(course.windows(2).all(|pair| pair[1] > pair[0]), "{course:?}");
    // After half a minute less than a quarter of what there will be.
    assert!(course[1] < 0.25 * course[4] && course[2] < 0.5 * course[4], "{course:?}");
}

#[test]
fn black_stays_black_by_day_and_colours_pale_by_night() {
    let day = fitted(100.0);
    assert!(day.map_rgb([0.0; 3])[0] < 0.02);
    let saturation = |adaptation: f64| {
        let light = adaptation as f32;
        let shown = fitted(adaptation).map_rgb([2.0 * light, light, 0.3 * light]);
        (shown[0] - shown[2]) / shown[0]
    };
    assert!(saturation(100.0) > 0.5 && saturation(0.01) < 0.1, "{} {}", saturation(100.0), saturation(0.01));
}

#[test]
fn local_adaptation_keeps_detail_on_both_sides() {
    let viewing = Viewing::of(Display { pixels_per_degree: 20.0, ..Display::default() });
    let guide = Plane::from_fn(120, 20, |x, _| if x < 60 { 1.0 } else { 3000.0 });
    let at = |scope, x, scene| {
        let fit = Pattanaik00 { exposure: 1.0, scope }.fit(&SceneGuide::of(&guide), &viewing, None);
        fit.relative_luminance_at(Pixel { x, y: 10 }, scene)
    };
    let contrast = |scope| at(scope, 110, 4500.0) / at(scope, 110, 2000.0);
    assert!(contrast(AdaptationScope::Local) > contrast(AdaptationScope::World));
}
