//! Layers of motion in a frame's file.

use super::AovNames;
use fechner::animate::velocity::VelocityMap;
use fechner::output::Picture;

/// Adds the layers of motion, in pixels.
pub(super) fn push_velocity(picture: &mut Picture<'_>, velocity: &VelocityMap, names: AovNames) {
    let next = |of: fn(glam::Vec2) -> f32| velocity.to_next.iter().map(|&motion| of(motion)).collect::<Vec<f32>>();
    let previous = |of: fn(glam::Vec2) -> f32| velocity.to_previous.iter().map(|&m| of(m)).collect::<Vec<f32>>();
    match names {
        AovNames::Fechner => {
            picture.push_f32("velocity.X", next(|m| m.x));
            picture.push_f32("velocity.Y", next(|m| m.y));
            picture.push_f32("velocity_previous.X", previous(|m| m.x));
            picture.push_f32("velocity_previous.Y", previous(|m| m.y));
        }
        // Cycles' vector pass: where it was less where it is, then where it is less where it will be; y upwards.
        AovNames::Blender => {
            picture.push_f32("Vector.X", previous(|m| m.x));
            picture.push_f32("Vector.Y", previous(|m| -m.y));
            picture.push_f32("Vector.Z", next(|m| -m.x));
            picture.push_f32("Vector.W", next(|m| m.y));
        }
    }
}
