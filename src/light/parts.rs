//! What a camera may see of lamps that stand still: triangles and spheres.

use super::{Emitter, Lights};
use crate::geometry::World;
use crate::scene::Alpha;
use glam::Vec3;

/// A part of a lamp, in the world.
#[derive(Clone, Copy, Debug)]
pub struct LampPart {
    /// Where it is.
    pub shape: LampShape,
    /// What it emits, without what a clear coat keeps.
    pub radiance: Vec3,
}

/// What a part of a lamp is.
#[derive(Clone, Copy, Debug)]
pub enum LampShape {
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
        let radiance_all_over = |object: u32| {
            let material = &world.scene().materials[world.material_of(object).0 as usize];
            (material.emission.texture.is_none() && material.alpha == Alpha::Opaque).then_some(material.emission.factor)
        };
        self.emitters.iter().flat_map(move |emitter| {
            let (object, shapes) = match emitter {
                Emitter::Flat(flat) => {
                    let front = (!flat.both_sides).then_some(flat.normal);
                    let shapes = flat.triangles().map(|corners| Some(LampShape::Triangle { corners: corners?, front }));
                    (Some(flat.object), shapes)
                }
                Emitter::Sphere(sphere) => {
                    let shape = LampShape::Sphere { center: sphere.center, radius: sphere.radius };
                    (Some(sphere.object), [Some(shape), None])
                }
                Emitter::Point(_) | Emitter::MovingTriangle { .. } | Emitter::MovingSphere { .. } => (None, [None; 2]),
            };
            let radiance = object.and_then(radiance_all_over);
            shapes.into_iter().flatten().filter_map(move |shape| Some(LampPart { shape, radiance: radiance? }))
        })
    }
}
