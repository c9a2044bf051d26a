//! What a camera may see of lamps that stand still: triangles and spheres.

use super::{Emitter, Lights};
use crate::geometry::World;
use crate::scene::Alpha;
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
    /// The parts of all lamps that have a surface and do not move while the shutter is open. Not those of lamps whose emission is a picture or
    /// that alpha covers: they may be black anywhere.
    pub fn still_parts(&self, world: &World) -> impl Iterator<Item = LampPart> {
        let shines_all_over = |object: u32| {
            let material = &world.scene().materials[world.material_of(object).0 as usize];
            material.emission.texture.is_none() && material.alpha == Alpha::Opaque
        };
        self.emitters.iter().flat_map(move |emitter| {
            let parts = match emitter {
                Emitter::Flat(flat) if shines_all_over(flat.object) => {
                    let front = (!flat.both_sides).then_some(flat.normal);
                    flat.triangles().map(|corners| Some(LampPart::Triangle { corners: corners?, front }))
                }
                Emitter::Sphere(sphere) if shines_all_over(sphere.object) => {
                    [Some(LampPart::Sphere { center: sphere.center, radius: sphere.radius }), None]
                }
                Emitter::Flat(_)
                | Emitter::Sphere(_)
                | Emitter::Point(_)
                | Emitter::MovingTriangle { .. }
                | Emitter::MovingSphere { .. } => [None; 2],
            };
            parts.into_iter().flatten()
        })
    }
}
