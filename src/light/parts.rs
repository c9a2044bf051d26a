//! Tells what a camera may see of lamps: triangles and spheres. Whether anything hides them is left to the caller.

use super::collect::triangle_at;
use super::distant::{Disc, DistantLights};
use super::flat::FlatEmitter;
use super::sphere::SphereEmitter;
use super::{Emitter, Lights};
use crate::geometry::{Facet, World};
use glam::Vec3;

/// Where spheres stand for lights from afar, scene units: beyond every scene, and so far that cameras see them in one
/// direction.
const AFAR: f32 = 1e12;

/// A part of a lamp, in the world.
#[derive(Clone, Copy, Debug)]
pub struct LampPart {
    /// Where it is.
    pub facet: Facet,
    /// Unit normal of the side of a triangle that shines; `None` where all sides do.
    pub front: Option<Vec3>,
    /// What it emits, without what a clear coat keeps.
    pub radiance: Vec3,
    /// Whether it moves while the shutter is open.
    pub moves: bool,
}

impl Lights {
    /// The discs of lights from afar, as spheres beyond all that is in the scene.
    pub fn parts_afar(&self) -> impl Iterator<Item = LampPart> {
        self.distant.iter().flat_map(DistantLights::discs).map(|Disc { axis, tangent, radiance }| LampPart {
            facet: Facet::Sphere { center: AFAR * axis, radius: AFAR * tangent },
            front: None,
            radiance,
            moves: false,
        })
    }

    /// The parts of all lamps that have a surface, as they are at a share of the open shutter, in one order at any
    /// time. Not those of lamps whose emission is a picture or that alpha covers: they may be black anywhere.
    pub fn parts_at(&self, world: &World, time: f32) -> impl Iterator<Item = LampPart> {
        self.emitters.iter().flat_map(move |emitter| {
            let (object, surfaces) = match emitter {
                Emitter::Flat(flat) => (Some(flat.object), surfaces_of(flat)),
                Emitter::MovingTriangle { object, triangle } => {
                    (Some(*object), surfaces_of(&triangle_at(world, *object, *triangle, time)))
                }
                Emitter::Sphere(sphere) => (Some(sphere.object), [Some(surface_of(sphere)), None]),
                Emitter::MovingSphere { object } => {
                    (Some(*object), [Some(surface_of(&SphereEmitter::new(world, *object, time))), None])
                }
                Emitter::Point(_) => (None, [None; 2]),
            };
            let moves = matches!(emitter, Emitter::MovingTriangle { .. } | Emitter::MovingSphere { .. });
            let radiance = object.and_then(|object| world.material(object).even_emission());
            surfaces
                .into_iter()
                .flatten()
                .filter_map(move |Surface { facet, front }| Some(LampPart { facet, front, radiance: radiance?, moves }))
        })
    }
}

/// What shines of an emitter.
#[derive(Clone, Copy)]
struct Surface {
    facet: Facet,
    front: Option<Vec3>,
}

fn surfaces_of(flat: &FlatEmitter) -> [Option<Surface>; 2] {
    let front = (!flat.both_sides).then_some(flat.normal);
    flat.triangles().map(|corners| Some(Surface { facet: Facet::Triangle(corners?), front }))
}

fn surface_of(sphere: &SphereEmitter) -> Surface {
    Surface { facet: Facet::Sphere { center: sphere.center, radius: sphere.radius }, front: None }
}
