//! Gathering the emitters of a world that have a place, with what the light tree needs to know of each.

use super::Emitter;
use super::flat::{FlatEmitter, Winding};
use super::sphere::SphereEmitter;
use super::tree::LightBounds;
use crate::geometry::World;
use crate::geometry::tree::Bounds;
use crate::scene::Light;
use glam::{Vec3, Vec3A};
use std::f32::consts::{FRAC_PI_2, PI};

/// Emitters, their bounds, and which is whose.
#[derive(Default)]
pub(super) struct Collected {
    pub(super) emitters: Vec<Emitter>,
    pub(super) bounds: Vec<LightBounds>,
    pub(super) emitter_of: Vec<Option<Vec<u32>>>,
}

impl Collected {
    fn add(&mut self, emitter: Emitter, bounds: LightBounds) -> u32 {
        self.emitters.push(emitter);
        self.bounds.push(bounds);
        self.emitters.len() as u32 - 1
    }
}

/// Collects every emitter that has a place.
pub(super) fn placed(world: &World) -> Collected {
    let scene = world.scene();
    let mut collected = Collected::default();
    for object in 0..scene.instances.len() {
        let of_triangle = instance(world, object as u32, &mut collected);
        collected.emitter_of.push(of_triangle);
    }
    for number in 0..scene.spheres.len() {
        let emitter = sphere(world, number, &mut collected);
        collected.emitter_of.push(emitter.map(|emitter| vec![emitter]));
    }
    for light in &scene.lights {
        if let Some(bounds) = point_bounds(light) {
            collected.add(Emitter::Point(light.clone()), bounds);
        }
    }
    collected
}

/// The emitters of an instance's triangles.
fn instance(world: &World, object: u32, collected: &mut Collected) -> Option<Vec<u32>> {
    let scene = world.scene();
    let instance = &scene.instances[object as usize];
    let material = &scene.materials[instance.material.0 as usize];
    let radiance = material.mean_emission(&scene.textures)?.max_element();
    let triangles = scene.meshes[instance.mesh.0 as usize].triangles.len() as u32;
    let mut of_triangle = Vec::with_capacity(triangles as usize);
    while (of_triangle.len() as u32) < triangles {
        let triangle = of_triangle.len() as u32;
        let emitter = triangle_at(world, object, triangle, 0.0);
        if instance.motion.is_some() {
            let bounds = moving_triangle_bounds(world, object, triangle, radiance);
            of_triangle.push(collected.add(Emitter::MovingTriangle { object, triangle }, bounds));
            continue;
        }
        let merged = (triangle + 1 < triangles)
            .then(|| emitter.merged(&triangle_at(world, object, triangle + 1, 0.0), scene))
            .flatten();
        let parts = if merged.is_some() { 2 } else { 1 };
        let emitter = merged.unwrap_or(emitter);
        let bounds = flat_bounds(&emitter, radiance);
        let number = collected.add(Emitter::Flat(emitter), bounds);
        of_triangle.extend(std::iter::repeat_n(number, parts));
    }
    Some(of_triangle)
}

fn sphere(world: &World, number: usize, collected: &mut Collected) -> Option<u32> {
    let scene = world.scene();
    let sphere = &scene.spheres[number];
    let mean_radiance = scene.materials[sphere.material.0 as usize].mean_emission(&scene.textures)?;
    let object = (scene.instances.len() + number) as u32;
    let own = SphereEmitter::new(world, object, 0.0);
    let intensity = own.cross_section() * mean_radiance.max_element();
    let (mut low, mut high) = (own.center - own.radius, own.center + own.radius);
    let Some(motion) = &sphere.motion else {
        return Some(collected.add(Emitter::Sphere(own), all_around(low, high, intensity)));
    };
    let corners = Bounds { min: low.into(), max: high.into() }.corners();
    motion.sweep(&corners, |center, radius| {
        (low, high) = (low.min(Vec3::from(center) - radius), high.max(Vec3::from(center) + radius));
    });
    Some(collected.add(Emitter::MovingSphere { object }, all_around(low, high, intensity)))
}

/// A triangle as it is at a time.
pub(super) fn triangle_at(world: &World, object: u32, triangle: u32, time: f32) -> FlatEmitter {
    let scene = world.scene();
    let to_world = world.transform_at(object, time);
    let winding = Winding::after(&to_world);
    let material = &scene.materials[scene.instances[object as usize].material.0 as usize];
    let corners = world.placed_corners(object, triangle, &to_world);
    FlatEmitter::triangle(object, triangle, corners, world.translation_of_tree(object, &to_world), winding, material)
}

fn flat_bounds(emitter: &FlatEmitter, radiance: f32) -> LightBounds {
    let (low, high) = emitter
        .corners()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), corner| (low.min(corner), high.max(corner)));
    LightBounds {
        axis: emitter.normal,
        normal_angle: if emitter.both_sides { PI } else { 0.0 },
        ..all_around(low, high, emitter.area * radiance)
    }
}

fn moving_triangle_bounds(world: &World, object: u32, triangle: u32, radiance: f32) -> LightBounds {
    let scene = world.scene();
    let instance = &scene.instances[object as usize];
    let mesh = &scene.meshes[instance.mesh.0 as usize];
    let corners = mesh.triangles[triangle as usize].map(|i| Vec3A::from(mesh.positions[i as usize]));
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    if let Some(motion) = &instance.motion {
        motion.sweep(&corners, |center, radius| {
            (low, high) = (low.min(Vec3::from(center) - radius), high.max(Vec3::from(center) + radius));
        });
    }
    all_around(low, high, triangle_at(world, object, triangle, 0.0).area * radiance)
}

/// Bounds of something that may shine in every direction.
fn all_around(min: Vec3, max: Vec3, intensity: f32) -> LightBounds {
    LightBounds { min, max, intensity, axis: Vec3::Y, normal_angle: PI, emission_angle: FRAC_PI_2 }
}

fn point_bounds(light: &Light) -> Option<LightBounds> {
    match *light {
        Light::Point { position, intensity } => Some(all_around(position, position, intensity.max_element())),
        Light::Spot { position, direction, intensity, inner_angle, outer_angle, .. } => {
            // What a spot wider than a half-space has beyond it is said by its normals.
            let normal_angle = inner_angle.max(outer_angle - FRAC_PI_2);
            Some(LightBounds {
                axis: direction,
                normal_angle,
                emission_angle: (outer_angle - normal_angle).clamp(0.0, FRAC_PI_2),
                ..all_around(position, position, intensity.max_element())
            })
        }
        Light::Directional { .. } => None,
    }
}
