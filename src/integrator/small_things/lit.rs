//! Small things that others light, or whose emission is a picture: which ones are unlike all that is around them, and
//! by how much.
//!
//! Nothing says how bright they are but paths to them. Not for pieces of something larger, of which
//! neighbouring pixels tell.

use super::luminances::Luminances;
use super::spots::Spot;
use super::{Moment, Part, Shine};
use crate::geometry::{Facet, Ray, World};
use crate::integrator::PathTracer;
use crate::integrator::camera::CameraAt;
use crate::sampler::{BlockKey, Pixel};
use crate::scene::{Alpha, Scene, SpherePlace};
use glam::Vec2;
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Triangles and spheres that are looked at, of objects with the fewest triangles first; the rest is left to chance.
/// Each takes 3 µs: some of what the first samples of a pixel take.
const FACETS_PER_PIXEL: f32 = 0.25;
const MIN_FACETS: usize = 1 << 12;
const MAX_FACETS: usize = 1 << 16;
/// Places around a spot that are looked at.
const AROUND: u32 = 8;
/// As far from it, over what is small there.
const AWAY: f32 = 1.5;
/// So many of them may be of the same thing: a wire goes on to two sides, the rim of something larger to three or more.
const MOST_ALIKE: usize = 2;
/// Paths that ask how bright a spot is. Each place around it has one.
const PATHS: u32 = 4;
/// Such paths over the film's pixels, at most: a thirtieth of what their first samples take.
const PATHS_PER_PIXEL: f32 = 0.5;
/// Makes the random numbers differ from those of pictures, whatever their seed.
const STREAM: u64 = 0x6c69_745f_7370_6f74;

/// A spot, and its luminance, or how much it differs from that of what is around it; scene units.
pub(super) struct BrightSpot {
    pub(super) spot: Spot,
    pub(super) luminance: f32,
}

/// How many triangles and spheres are looked at for a film of so many pixels, at all moments together.
pub(super) fn most_facets(pixels: usize) -> usize {
    ((FACETS_PER_PIXEL * pixels as f32) as usize).clamp(MIN_FACETS, MAX_FACETS)
}

/// Pieces of objects that do not shine evenly, in one order at any time, of those with the fewest first. `is_asked`:
/// for what moves, or does not. Not of what alpha covers in part: a ray meets all of it or nothing.
pub(super) fn parts_at(
    world: &World,
    most: usize,
    time: f32,
    is_asked: impl Fn(bool) -> bool,
) -> impl Iterator<Item = Part> {
    let mut objects: Vec<Object> = objects_of(world.scene())
        .filter(|object| {
            let material = world.material(object.number);
            is_asked(object.moves) && material.even_emission().is_none() && material.alpha == Alpha::Opaque
        })
        .collect();
    objects.sort_unstable();
    objects.into_iter().flat_map(move |object| facets_of(world, object, time)).take(most)
}

/// A mesh that is placed, or a sphere; few facets first.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Object {
    facets: u32,
    /// As rays know it: instances first, then spheres.
    number: u32,
    moves: bool,
}

fn objects_of(scene: &Scene) -> impl Iterator<Item = Object> {
    let meshes = scene.instances.iter().map(|instance| {
        let facets = scene.meshes[instance.mesh.0 as usize].triangles.len() as u32;
        (facets, instance.motion.is_some())
    });
    let spheres = scene.spheres.iter().map(|sphere| (1, sphere.motion.is_some()));
    (0..).zip(meshes.chain(spheres)).map(|(number, (facets, moves))| Object { facets, number, moves })
}

fn facets_of(world: &World, object: Object, time: f32) -> impl Iterator<Item = Part> {
    let number = object.number;
    let is_mesh = (number as usize) < world.scene().instances.len();
    let to_world = is_mesh.then(|| world.transform_at(number, time));
    (0..object.facets).map(move |triangle| {
        let facet = match &to_world {
            Some(to_world) => Facet::Triangle(world.placed_corners(number, triangle, to_world)),
            None => {
                let SpherePlace { center, radius, .. } = world.sphere_at(number, time);
                Facet::Sphere { center: center.into(), radius }
            }
        };
        Part { facet, front: None, shine: Shine::Of(number) }
    })
}

impl PathTracer {
    /// The spots that lamps have, and those of other things that are unlike all that is around them.
    pub(super) fn bright_spots(&self, camera: &CameraAt<'_>, spots: Vec<Spot>, moment: &Moment) -> Vec<BrightSpot> {
        let alone: Vec<Spot> = spots.into_par_iter().filter(|spot| self.is_alone(camera, spot)).collect();
        let affordable = (PATHS_PER_PIXEL * self.settings.film_area().pixels() as f32) as usize / moment.of;
        let alike = (alone.len() * (PATHS + AROUND) as usize).div_ceil(affordable.max(1)).max(1);
        let asked = asked_for(&alone, alike);
        let luminance_of = |number: usize| self.luminance_at(camera, &alone[number], number, moment);
        let luminances: Vec<f32> =
            (0..alone.len()).into_par_iter().map(|at| if asked[at] == at { luminance_of(at) } else { 0.0 }).collect();
        let bright = |(spot, number): (Spot, usize)| BrightSpot { spot, luminance: luminances[number] };
        alone.into_iter().zip(asked).map(bright).filter(|spot| spot.luminance > 0.0).collect()
    }

    /// Whether a spot is of a lamp, or is seen, and what is around it is of other things and materials.
    fn is_alone(&self, camera: &CameraAt<'_>, spot: &Spot) -> bool {
        let Shine::Of(object) = spot.shine else { return true };
        if self.seen_at(camera, spot, [0.5; 2]).is_none() {
            return false;
        }
        let alike = around(camera, spot).filter(|ray| self.meets(ray, object));
        alike.take(MOST_ALIKE + 1).count() <= MOST_ALIKE
    }

    /// Whether a ray meets an object, or one of its material.
    fn meets(&self, ray: &Ray, object: u32) -> bool {
        let material = self.world.material_of(object);
        self.world.closest(ray).is_some_and(|hit| self.world.material_of(hit.object) == material)
    }

    /// How bright a spot of a lamp is, or how much another one differs from what is around it; 0 where that is too
    /// little, or cannot be told.
    fn luminance_at(&self, camera: &CameraAt<'_>, spot: &Spot, number: usize, moment: &Moment) -> f32 {
        let object = match spot.shine {
            Shine::Known(luminance) => return luminance,
            Shine::Of(object) => object,
        };
        let Some(place_px) = camera.project(spot.position) else { return 0.0 };
        let key = BlockKey::of_probe(STREAM, Pixel { x: number as u32, y: moment.number as u32 });
        let luminance = |ray: Ray, index: u32| self.luminance_of(self.trace_path(ray, key.sample(index)).radiance);
        let own = camera.ray_through(place_px);
        let own: Luminances = (0..PATHS).map(|index| luminance(own, index)).collect();
        let others = (PATHS..).zip(around(camera, spot)).filter(|(_, ray)| !self.meets(ray, object));
        own.difference(&others.map(|(index, ray)| luminance(ray, index)).collect())
    }
}

/// For each spot the one whose luminance it has: of those of one object every so many are asked, and their next
/// neighbours are like them.
fn asked_for(spots: &[Spot], alike: usize) -> Vec<usize> {
    let (mut asked, mut latest) = (Vec::with_capacity(spots.len()), 0);
    for (number, spot) in spots.iter().enumerate() {
        let is_like_latest = match (spot.shine, spots[latest].shine) {
            (Shine::Of(object), Shine::Of(other)) => object == other && number - latest < alike,
            _ => false,
        };
        latest = if is_like_latest { latest } else { number };
        asked.push(latest);
    }
    asked
}

/// Rays to places around a spot. None is level with it or above it: many wires go that way.
fn around<'a>(camera: &'a CameraAt<'_>, spot: &Spot) -> impl Iterator<Item = Ray> + 'a {
    let place_px = camera.project(spot.position);
    let away_px = AWAY * spot.small_px.max(1.0);
    let angles = (0..AROUND).map(|number| TAU * (number as f32 + 0.5) / AROUND as f32);
    place_px.into_iter().flat_map(move |place_px| {
        angles.clone().map(move |angle| camera.ray_through(place_px + away_px * Vec2::from_angle(angle)))
    })
}
