//! Lights that are points: point, spot and photometric. No path meets them by chance: they are only sampled.
//! Directional lights are in `distant`.

use super::{LightPlace, LightSample};
use crate::scene::Light;
use glam::Vec3;

/// The light that arrives at `from`; nothing for lights that are no points.
pub(super) fn sample(light: &Light, from: Vec3) -> Option<LightSample> {
    let (&position, &intensity) = match light {
        Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => (position, intensity),
        Light::Photometric { position, per_candela, .. } => (position, per_candela),
        Light::Directional { .. } => return None,
    };
    let to_light = position - from;
    let distance = to_light.length();
    let direction = to_light / distance;
    let factor = match light {
        Light::Spot { direction: axis, inner_angle, outer_angle, falloff, .. } => {
            falloff.at(-direction, *axis, *inner_angle, *outer_angle)
        }
        Light::Photometric { from_world, web, .. } => web.intensity_cd(*from_world * -direction),
        _ => 1.0,
    };
    (distance > 0.0 && factor > 0.0).then(|| LightSample {
        direction,
        place: Some(LightPlace { position, normal: Vec3::ZERO, offset: 0.0 }),
        radiance: intensity * (factor / (distance * distance)),
        pdf: 1.0,
        is_delta: true,
    })
}
