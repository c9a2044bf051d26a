//! No NaN, no infinity, no direction off the sphere, whatever goes in; and samples agree with evaluations.

use super::cases::{Case, GLASS, delta_cases, smooth_cases, views};
use super::statistics::Random;
use crate::bsdf::Bsdf;
use glam::Vec3;

const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

fn check_sample(case: &str, bsdf: &Bsdf<'_>, wo: Vec3, u: [f32; 3]) {
    let Some(sample) = bsdf.sample(wo, u) else {
        return;
    };
    let context = || format!("{case}: wo {wo} u {u:?}: {sample:?}");
    assert!(sample.weight.is_finite(), "{}", context());
    assert!(sample.weight.min_element() >= 0.0, "{}", context());
    assert!(sample.pdf.is_finite() && sample.pdf > 0.0, "{}", context());
    assert!((sample.wi.length() - 1.0).abs() < 1e-4, "{}", context());
    assert!(sample.wi.z != 0.0, "{}", context());
    let crossed = (sample.wi.z > 0.0) != (wo.z > 0.0);
    assert_eq!(crossed, sample.lobe.is_transmission(), "{}", context());
    if !sample.lobe.is_delta() {
        assert!(bsdf.has_smooth_lobe(), "{}", context());
        let evaluation = bsdf.evaluate(wo, sample.wi);
        assert_eq!(evaluation.pdf, sample.pdf, "{}", context());
        // To rounding: a diffuse surface's weight is its albedo, without the way over value and pdf.
        let weight = evaluation.value / evaluation.pdf;
        assert!(weight.abs_diff_eq(sample.weight, 4.0 * f32::EPSILON * weight.max_element()), "{}", context());
    }
}

fn check_evaluation(case: &str, bsdf: &Bsdf<'_>, wo: Vec3, wi: Vec3) {
    let evaluation = bsdf.evaluate(wo, wi);
    let fine = evaluation.value.is_finite()
        && evaluation.value.min_element() >= 0.0
        && evaluation.pdf.is_finite()
        && evaluation.pdf >= 0.0;
    assert!(fine, "{case}: wo {wo} wi {wi}: {evaluation:?}");
    // Less than this is rounding: 1 − E of a hardly rough surface, or a cosine next to 0.
    if evaluation.value.max_element() > 1e-9 {
        assert!(evaluation.pdf > 0.0, "{case}: wo {wo} wi {wi} is never sampled");
    }
}

/// Directions at and near the poles and the horizon.
fn extreme_directions() -> Vec<Vec3> {
    let mut directions = Vec::new();
    for z in [0.0f32, 1e-30, 1e-7, 1e-4, 0.02, 0.7, 0.999_999, 1.0] {
        for sign in [1.0, -1.0] {
            let radius = (1.0 - z * z).sqrt();
            directions.push(Vec3::new(radius, 0.0, sign * z));
            directions.push(Vec3::new(-0.6 * radius, 0.8 * radius, sign * z));
        }
    }
    directions
}

/// Models at the ends of their parameters.
fn extreme_models() -> Vec<Bsdf<'static>> {
    let mut models = Vec::new();
    for roughness in [0.0f32, 0.03, 0.0317, 0.04, 0.2, 1.0] {
        for eta in [0.3, 0.999, 1.0, 1.000_5, 1.002, 1.5, 3.0] {
            for tint in [Vec3::ZERO, Vec3::ONE, Vec3::X] {
                models.push(Bsdf::dielectric(eta, roughness, tint, None));
                models.push(Bsdf::thin_dielectric(eta, tint));
            }
        }
        models.push(Bsdf::dielectric(1.5, roughness, Vec3::ZERO, Some(&GLASS)));
        models.push(Bsdf::dielectric(1.5, roughness, Vec3::ONE, Some(&GLASS)));
        for (eta, k) in [(0.0, 0.0), (1.0, 0.0), (0.0, 5.0), (1.0, 20.0), (2.0, 0.0)] {
            models.push(Bsdf::conductor(Vec3::splat(eta), Vec3::splat(k), roughness));
        }
        for color in [Vec3::ZERO, Vec3::ONE, Vec3::Y] {
            models.push(Bsdf::oren_nayar(color, roughness));
            models.push(Bsdf::diffuse_transmission(color, Vec3::ZERO));
            models.push(Bsdf::diffuse_transmission(Vec3::ZERO, color));
            for metallic in [0.0, 0.5, 1.0] {
                for ior in [0.0, 1.0, 1.5] {
                    for transmission in [0.0, 0.5, 1.0] {
                        models.push(Bsdf::metal_roughness(color, metallic, roughness, ior, transmission));
                    }
                }
            }
        }
    }
    models
}

#[test]
fn nothing_breaks_at_the_extremes() {
    let directions = extreme_directions();
    let numbers = [0.0, f32::MIN_POSITIVE, 0.3, BELOW_ONE];
    for bsdf in extreme_models() {
        let name = format!("{bsdf:?}");
        for &wo in &directions {
            for a in numbers {
                for b in numbers {
                    for c in numbers {
                        check_sample(&name, &bsdf, wo, [a, b, c]);
                    }
                }
            }
            for &wi in &directions {
                check_evaluation(&name, &bsdf, wo, wi);
            }
            let albedo = bsdf.albedo(wo);
            assert!(albedo.is_finite(), "{name}: wo {wo}: albedo {albedo}");
            assert!(albedo.min_element() >= 0.0 && albedo.max_element() <= 1.01, "{name}: wo {wo}: albedo {albedo}");
        }
    }
}

#[test]
fn samples_agree_with_evaluations() {
    let cases: Vec<Case> = smooth_cases().into_iter().chain(delta_cases()).collect();
    let mut random = Random::new(3);
    for case in &cases {
        for wo in views() {
            for _ in 0..2000 {
                check_sample(&case.name, &case.bsdf, wo, random.triple());
            }
        }
    }
}
