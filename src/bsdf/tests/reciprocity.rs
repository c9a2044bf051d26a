//! Tests Helmholtz reciprocity: f(A→B)/η_B² = f(B→A)/η_A².

use super::cases::smooth_cases;
use super::statistics::Random;
use crate::bsdf::warp;
use glam::Vec3;

#[test]
fn light_may_be_turned_round() {
    let mut random = Random::new(11);
    for case in smooth_cases() {
        let mut compared = 0;
        for _ in 0..4000 {
            let mut direction = || {
                let [a, b, side] = random.triple();
                let up = warp::cosine_hemisphere([a, b]);
                if side < 0.5 { up } else { -up }
            };
            let wo = direction();
            // Half of the partners by the model itself, so that narrow lobes are met.
            let other = direction();
            let wi = match case.bsdf.sample(wo, random.triple()) {
                Some(sample) if !sample.lobe.is_delta() && random.uniform() < 0.5 => sample.wi,
                _ => other,
            };
            let f = |wo: Vec3, wi: Vec3| {
                let index = if wo.z > 0.0 { 1.0 } else { case.eta };
                let value = case.bsdf.evaluate(wo, wi).value;
                value.as_dvec3() / f64::from(wi.z.abs() * index * index)
            };
            let forth = f(wo, wi);
            let back = f(wi, wo);
            let scale = forth.max(back).max_element();
            let difference = (forth - back).abs().max_element();
            // Single precision, magnified by narrow lobes at grazing angles.
            assert!(difference <= 5e-3 * scale + 1e-6, "{}: {wo} {wi}: {forth} {back}", case.name);
            compared += usize::from(scale > 0.0);
        }
        assert!(compared > 500, "{}: only {compared} pairs", case.name);
    }
}
