//! Tests what the module promises about sides and about radiance across boundaries.

use super::cases::{delta_cases, smooth_cases};
use crate::bsdf::{Bsdf, BsdfSample, Lobe, Varnish, Varnished, turn};
use glam::{Mat3, Vec3};

fn refracted(bsdf: &Bsdf<'_>, wo: Vec3) -> BsdfSample {
    let sample = bsdf.sample(wo, [0.5, 0.5, 0.999]).expect("transmission");
    assert_eq!(sample.lobe, Lobe::DeltaTransmission);
    sample
}

#[test]
fn a_slab_of_glass_changes_neither_direction_nor_radiance() {
    let glass = Bsdf::dielectric(1.5, 0.0, Vec3::ONE, None);
    let wo = Vec3::new(0.6, 0.0, 0.8);
    let entering = refracted(&glass, wo);
    // Snell, and 1/η² on the way in.
    assert!((entering.wi.x + 0.4).abs() < 1e-6, "{entering:?}");
    assert!((entering.weight.x * 1.5 * 1.5 - 1.0).abs() < 1e-5, "{entering:?}");
    let leaving = refracted(&glass, turn(-entering.wi).with_z(entering.wi.z));
    assert!((leaving.weight.x / (1.5 * 1.5) - 1.0).abs() < 1e-5, "{leaving:?}");
}

#[test]
fn opaque_models_look_the_same_from_both_sides() {
    let wo = Vec3::new(0.36, 0.48, 0.8);
    // Near the mirror direction, where lobes without tails are above 0 too.
    let wi = Vec3::new(-0.48, -0.36, 0.8);
    for case in smooth_cases() {
        if case.eta != 1.0 {
            continue;
        }
        let front = case.bsdf.evaluate(wo, wi);
        let back = case.bsdf.evaluate(turn(wo), turn(wi));
        assert_eq!(front, back, "{}", case.name);
        assert!(front.value.max_element() > 0.0, "{}", case.name);
    }
}

#[test]
fn only_models_of_delta_lobes_say_so() {
    for case in delta_cases() {
        assert!(!case.bsdf.has_smooth_lobe(), "{}", case.name);
    }
    for case in smooth_cases() {
        assert!(case.bsdf.has_smooth_lobe(), "{}", case.name);
    }
}

/// Shadow rays pass sheets by what paths carry through them.
#[test]
fn what_goes_straight_on_is_what_samples_carry() {
    const LOBES: usize = 1 << 14;
    let wo = Vec3::new(0.48, 0.64, 0.6);
    let tint = Vec3::new(0.2, 0.6, 0.9);
    let (pane, wall) = (Bsdf::thin_dielectric(1.5, tint), Bsdf::lambert(Vec3::splat(0.5)));
    let glass = Bsdf::dielectric(1.5, 0.0, Vec3::ONE, None);
    let clear = |roughness: f32| match Bsdf::metal_roughness(tint, 0.3, roughness, 1.5, 0.7) {
        Bsdf::MetalRoughness(model) => Varnished::Sheet(model),
        other => panic!("{other:?}"),
    };
    let varnished = |base, sheen: Vec3| Bsdf::Varnish(Varnish::new(base, 0.8, 0.4, sheen, 0.5));
    for (bsdf, is_clear) in [
        (pane, true),
        (varnished(clear(0.0), Vec3::ZERO), true),
        (varnished(clear(0.0), Vec3::new(0.5, 0.3, 0.1)), true),
        (varnished(clear(0.3), Vec3::ZERO), false),
        (varnished(Varnished::Boundary(&glass), Vec3::ZERO), false),
        (Bsdf::metal_roughness(tint, 0.3, 0.0, 1.5, 0.7), true),
        (Bsdf::mix(&pane, &wall, 0.25), true),
        (Bsdf::metal_roughness(tint, 0.0, 0.3, 1.5, 1.0), false),
        (glass, false),
        (wall, false),
    ] {
        let lobes = (0..LOBES).map(|i| (i as f32 + 0.5) / LOBES as f32);
        let carried = lobes.filter_map(|lobe| bsdf.sample(wo, [0.3, 0.6, lobe])).filter(|sample| sample.wi == -wo);
        let carried: Vec3 = carried.map(|sample| sample.weight / LOBES as f32).sum();
        let told = bsdf.straight_through(wo);
        assert!(told.abs_diff_eq(carried, 2e-4) && (told != Vec3::ZERO) == is_clear, "{told} for {carried}, {bsdf:?}");
        assert!(bsdf.straight_through(turn(wo)).abs_diff_eq(told, 1e-6), "{bsdf:?}");
    }
}

/// A coat's normal and its base's may put a direction on different sides: no path goes on through such a
/// sheet, and no shadow ray may.
#[test]
fn nothing_goes_straight_through_where_the_normals_of_coat_and_base_disagree() {
    let Bsdf::MetalRoughness(clear) = Bsdf::metal_roughness(Vec3::ONE, 0.0, 0.0, 1.5, 1.0) else { panic!("a sheet") };
    let tilted = Some(Mat3::from_rotation_x(0.6));
    let sheet = Bsdf::Varnish(Varnish::new(Varnished::Sheet(clear), 0.5, 0.0, Vec3::ZERO, 0.5).over_relief(tilted));
    // 0.6 rad are 34 degrees: of these two, one is below the base's plane.
    for (wo, is_clear) in [(Vec3::new(0.0, 0.6, 0.8), true), (Vec3::new(0.0, -0.98, 0.2).normalize(), false)] {
        for wo in [wo, -wo] {
            assert_eq!(sheet.straight_through(wo) != Vec3::ZERO, is_clear, "{wo}");
            let mut samples = (0..100).filter_map(|lobe| sheet.sample(wo, [0.3, 0.6, (lobe as f32 + 0.5) / 100.0]));
            let passes = samples.any(|sample| sample.wi.abs_diff_eq(-wo, 1e-5));
            assert_eq!(passes, is_clear, "{wo}");
        }
    }
}

/// The pane's reflectance at normal incidence: 2R/(1 + R) with R = 4 %.
#[test]
fn reflectance_matches_known_values() {
    let straight = |bsdf: Bsdf<'_>| {
        let sample = bsdf.sample(Vec3::Z, [0.5, 0.5, 0.0]).expect("reflection");
        sample.weight * sample.pdf
    };
    let pane = straight(Bsdf::thin_dielectric(1.5, Vec3::ONE));
    assert!((pane.x - 0.08 / 1.04).abs() < 1e-6, "{pane}");
    let glass = straight(Bsdf::dielectric(1.5, 0.0, Vec3::ONE, None));
    assert!((glass.x - 0.04).abs() < 1e-6, "{glass}");
    // ((n − 1)² + k²)/((n + 1)² + k²) for n = 0.2, k = 3.
    let metal = straight(Bsdf::conductor(Vec3::splat(0.2), Vec3::splat(3.0), 0.0));
    assert!((metal.x - 9.64 / 10.44).abs() < 1e-6, "{metal}");
}
