//! What the camera is in: asked once where all of its rays begin in the same volumes, and else of each ray.
//!
//! Not for scenes where nothing absorbs: there it does not matter, and is not asked.

use super::camera::{CameraRays, CameraSample};
use super::media::Media;
use crate::geometry::{Ray, World};
use glam::Vec2;

/// Looks along a side of the picture, over the lens and over the shutter's time, where there is anything to look over.
/// A boundary that passes between them is missed.
const LOOKS: usize = 5;

/// The volumes that camera rays begin in.
pub(super) enum AroundCamera {
    /// All in the same ones.
    Everywhere(Media),
    /// Not all: a boundary passes through the lens, or between parallel rays, or comes by while the shutter is open.
    OfEachRay,
}

impl AroundCamera {
    /// What is around the camera for a picture of such a size in pixels; `moves`: whether anything does while the
    /// shutter is open.
    pub(super) fn of(world: &World, camera: &CameraRays, size_px: Vec2, moves: bool) -> Self {
        let at = |sample: &CameraSample| Media::around(world, camera.ray(sample));
        let media = at(&CameraSample { position_px: 0.5 * size_px, lens: [0.5; 2], time: 0.0 });
        let shares = |many: bool| if many { LOOKS } else { 1 };
        let share = |look: usize| (look as f32 / (LOOKS - 1) as f32).min(1.0_f32.next_down());
        let (across, over_lens, over_time) = (shares(camera.is_parallel()), shares(camera.has_lens()), shares(moves));
        // The middle, and places on the rim: the square's sides are the disc's.
        let end = 1.0_f32.next_down();
        let on_lens: [[f32; 2]; LOOKS] = [[0.5, 0.5], [0.0, 0.5], [0.5, 0.0], [end, 0.5], [0.5, end]];
        for place in 0..across * across {
            let of_side = |look: usize| if across > 1 { share(look) } else { 0.5 };
            let position_px = size_px * Vec2::new(of_side(place % across), of_side(place / across));
            for &lens in &on_lens[..over_lens] {
                for look in 0..over_time {
                    if at(&CameraSample { position_px, lens, time: share(look) }) != media {
                        return Self::OfEachRay;
                    }
                }
            }
        }
        Self::Everywhere(media)
    }

    /// The volumes that a camera ray begins in.
    pub(super) fn at(&self, world: &World, ray: &Ray) -> Media {
        match self {
            Self::Everywhere(media) => *media,
            Self::OfEachRay => Media::around(world, *ray),
        }
    }
}
