//! What a camera may see of lamps: triangles and spheres.

use super::collect::triangle_at;
use super::distant::{Disc, DistantLights};
use super::flat::FlatEmitter;
use super::sphere::SphereEmitter;
use super::{Emitter, Lights};
use crate::geometry::World;
use crate::scene::Alpha;
use glam::Vec3;

/// Where spheres stand for lights from afar, scene units: beyond every scene, and so far that cameras see them in one direction.
const AFAR: f32 = 1e12;

/// A part of a lamp, in the world.
#[derive(Clone, Copy, Debug)]
pub struct LampPart {
    /// Where it is.
    pub shape: LampShape,
    /// What it emits, without what a clear coat keeps.
    pub radiance: Vec3,
    /// Whether it moves while the shutter is open.
    pub moves: bool,
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

impl LampShape {
    /// Its middle.
    pub fn center(&self) -> Vec3 {
        match self {
            Self::Triangle { corners, .. } => corners.iter().sum::<Vec3>() / 3.0,
            Self::Sphere { center, .. } => *center,
        }
    }
}

impl Lights {
    /// The discs of lights from afar, as spheres beyond all that is in the scene.
    pub fn parts_afar(&self) -> impl Iterator<Item = LampPart> {
        self.distant.iter().flat_map(DistantLights::discs).map(|Disc { axis, tangent, radiance }| LampPart {
            shape: LampShape::Sphere { center: AFAR * axis, radius: AFAR * tangent },
            radiance,
            moves: false,
        })
    }

    /// The parts of all lamps that have a surface, as they are at a share of the open shutter, in one order at any time. Not those of lamps whose
    /// emission is a picture or that alpha covers: they may be black anywhere.
    pub fn parts_at(&self, world: &World, time: f32) -> impl Iterator<Item = LampPart> {
        let radiance_all_over = |object: u32| {
            let material = world.material(object);
            (material.emission.texture.is_none() && material.alpha == Alpha::Opaque).then_some(material.emission.factor)
        };
        self.emitters.iter().flat_map(move |emitter| {
            let (object, shapes) = match emitter {
                Emitter::Flat(flat) => (Some(flat.object), shapes_of(flat)),
                Emitter::MovingTriangle { object, triangle } => {
                    (Some(*object), shapes_of(&triangle_at(world, *object, *triangle, time)))
                }
                Emitter::Sphere(sphere) => (Some(sphere.object), [Some(shape_of(sphere)), None]),
                Emitter::MovingSphere { object } => {
                    (Some(*object), [Some(shape_of(&SphereEmitter::new(world, *object, time))), None])
                }
                Emitter::Point(_) => (None, [None; 2]),
            };
            let moves = matches!(emitter, Emitter::MovingTriangle { .. } | Emitter::MovingSphere { .. });
            let radiance = object.and_then(radiance_all_over);
            shapes.into_iter().flatten().filter_map(move |shape| Some(LampPart { shape, radiance: radiance?, moves }))
        })
    }
}

fn shapes_of(flat: &FlatEmitter) -> [Option<LampShape>; 2] {
    let front = (!flat.both_sides).then_some(flat.normal);
    flat.triangles().map(|corners| Some(LampShape::Triangle { corners: corners?, front }))
}

fn shape_of(sphere: &SphereEmitter) -> LampShape {
    LampShape::Sphere { center: sphere.center, radius: sphere.radius }
}
