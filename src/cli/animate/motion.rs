//! Adds layers of motion to a frame's file.

use super::AovNames;
use fechner::animate::velocity::VelocityMap;
use fechner::output::{Picture, channel};

/// Adds the layers of motion, in pixels.
pub(super) fn push_velocity(picture: &mut Picture<'_>, velocity: &VelocityMap, names: AovNames) {
    let next = |of: fn(glam::Vec2) -> f32| velocity.to_next.iter().map(|&motion| of(motion)).collect::<Vec<f32>>();
    let previous = |of: fn(glam::Vec2) -> f32| velocity.to_previous.iter().map(|&m| of(m)).collect::<Vec<f32>>();
    match names {
        AovNames::Fechner => {
            let [x, y] = channel::VELOCITY;
            picture.push_f32(x, next(|m| m.x));
            picture.push_f32(y, next(|m| m.y));
            let [x, y] = channel::VELOCITY_TO_PREVIOUS;
            picture.push_f32(x, previous(|m| m.x));
            picture.push_f32(y, previous(|m| m.y));
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
