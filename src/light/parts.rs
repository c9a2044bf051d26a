//! What a camera may see of lamps that stand still: triangles and spheres.

use super::{Emitter, Lights};
use glam::Vec3;

/// A part of a lamp, in the world.
#[derive(Clone, Copy, Debug)]
pub enum LampPart {
    /// A triangle that shines to the side of its normal, or to both.
    Triangle {
        /// Its corners.
        corners: [Vec3; 3],
        /// Unit normal of the side that shines; `None` where both do.
        front: Option<Vec3>,
    },
    /// A sphere.
    Sphere {
        /// Its centre.
        center: Vec3,
        /// Its radius.
        radius: f32,
    },
}

impl Lights {
    /// The parts of all lamps that have a surface and do not move while the shutter is open.
    pub fn still_parts(&self) -> impl Iterator<Item = LampPart> {
        self.emitters.iter().flat_map(|emitter| {
            let [first, second] = match emitter {
                Emitter::Flat(flat) if !flat.is_unseen => {
                    let front = (!flat.both_sides).then_some(flat.normal);
                    let corners: Vec<Vec3> = flat.corners().collect();
                    let triangle = |corners| LampPart::Triangle { corners, front };
                    match corners[..] {
                        [a, b, c, d] => [Some(triangle([a, b, c])), Some(triangle([b, d, c]))],
                        [a, b, c] => [Some(triangle([a, b, c])), None],
                        _ => [None; 2],
                    }
                }
                Emitter::Sphere(sphere) if !sphere.is_unseen => {
                    [Some(LampPart::Sphere { center: sphere.center, radius: sphere.radius }), None]
                }
                _ => [None; 2],
            };
            first.into_iter().chain(second)
        })
    }
}
