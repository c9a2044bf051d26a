//! Lights without area: point, spot and directional.

use super::{LightPlace, LightSample};
use crate::scene::Light;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Emitted power, largest channel; a directional light's is what falls on the scene's disc.
pub(super) fn power(light: &Light, world_radius: f32) -> f32 {
    match light {
        Light::Point { intensity, .. } => 4.0 * PI * intensity.max_element(),
        Light::Spot { intensity, inner_angle, outer_angle, .. } => {
            TAU * (1.0 - 0.5 * (inner_angle.cos() + outer_angle.cos())) * intensity.max_element()
        }
        Light::Directional { irradiance, .. } => PI * world_radius * world_radius * irradiance.max_element(),
    }
}

pub(super) fn sample(light: &Light, from: Vec3) -> Option<LightSample> {
    let towards = |position: Vec3, intensity: Vec3| {
        let to_light = position - from;
        let distance = to_light.length();
        (distance > 0.0).then(|| LightSample {
            direction: to_light / distance,
            place: Some(LightPlace { position, normal: Vec3::ZERO }),
            radiance: intensity / (distance * distance),
            pdf: 1.0,
            is_delta: true,
        })
    };
    match *light {
        Light::Point { position, intensity } => towards(position, intensity),
        Light::Spot { position, direction, intensity, inner_angle, outer_angle } => {
            let sample = towards(position, intensity)?;
            let falloff = cone_falloff(-sample.direction.dot(direction), inner_angle.cos(), outer_angle.cos());
            (falloff > 0.0).then(|| LightSample { radiance: sample.radiance * falloff, ..sample })
        }
        Light::Directional { direction, irradiance } => {
            Some(LightSample { direction: -direction, place: None, radiance: irradiance, pdf: 1.0, is_delta: true })
        }
    }
}

/// 1 inside the inner cone, 0 outside the outer, squared ramp in the cosine between (glTF KHR_lights_punctual).
fn cone_falloff(cos_angle: f32, cos_inner: f32, cos_outer: f32) -> f32 {
    let ramp = ((cos_angle - cos_outer) / (cos_inner - cos_outer).max(1e-4)).clamp(0.0, 1.0);
    ramp * ramp
}
