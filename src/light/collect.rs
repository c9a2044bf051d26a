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
    match light {
        &Light::Point { position, intensity } => Some(all_around(position, position, intensity.max_element())),
        &Light::Spot { position, direction, intensity, inner_angle, outer_angle, .. } => {
            // What a spot wider than a half-space has beyond it is said by its normals.
            let normal_angle = inner_angle.max(outer_angle - FRAC_PI_2);
            Some(LightBounds {
                axis: direction,
                normal_angle,
                emission_angle: (outer_angle - normal_angle).clamp(0.0, FRAC_PI_2),
                ..all_around(position, position, intensity.max_element())
            })
        }
        Light::Photometric { position, from_world, web, per_candela } => {
            let (largest, axis) = (web.max_cd(), -from_world.row(2));
            let below = LightCone::around(web.profile(), largest);
            let above =
                LightCone::around(web.profile().rev().map(|(angle, intensity)| (PI - angle, intensity)), largest);
            let (axis, cone) = if above.reach() < below.reach() { (-axis, above) } else { (axis, below) };
            Some(LightBounds {
                axis,
                normal_angle: cone.normal_angle,
                emission_angle: cone.emission_angle,
                ..all_around(*position, *position, largest * per_candela.max_element())
            })
        }
        Light::Directional { .. } => None,
    }
}

/// Where a point shines around an axis: at most by its largest intensity up to the normals' angle, and from there on by
/// the cosine of what is beyond. In radians.
struct LightCone {
    normal_angle: f32,
    emission_angle: f32,
}

impl LightCone {
    /// The narrowest around the axis from which the angles of a profile count, which come with the largest intensity
    /// that there is at each; they rise.
    fn around(profile: impl Iterator<Item = (f32, f32)>, largest: f32) -> Self {
        let (mut normal_angle, mut dark_from, mut before) = (0.0_f32, 0.0_f32, 0.0);
        for (angle, intensity) in profile {
            if intensity > 0.0 {
                normal_angle = normal_angle.max(angle - (intensity / largest).acos());
            }
            // Up to the first angle without light it is still falling.
            if intensity > 0.0 || before > 0.0 {
                dark_from = angle;
            }
            before = intensity;
        }
        let normal_angle = normal_angle.max(dark_from - FRAC_PI_2);
        Self { normal_angle, emission_angle: dark_from - normal_angle }
    }

    fn reach(&self) -> f32 {
        self.normal_angle + self.emission_angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::PhotometricWeb;
    use glam::Mat3;
    use std::sync::Arc;

    /// Name, intensity by direction, the cone's angle of normals and its reach in radians.
    type Lobe = (&'static str, fn(Vec3) -> f32, f32, f32);

    /// What the tree takes a lamp for holds what the lamp gives, and is no wider than that: of a Lambertian disk, the
    /// half-space before it.
    #[test]
    fn cones_hold_what_photometric_lamps_give() {
        let lobes: [Lobe; 4] = [
            ("downlight", |d| (-d.z).max(0.0), 0.0, FRAC_PI_2),
            ("uplight", |d| (d.z - 0.5).max(0.0), 0.0, PI / 3.0),
            ("batwing", |d| if d.z < -0.2 { (1.0 + d.z) * (1.0 + 0.5 * d.x) } else { 0.0 }, 1.36, 1.38),
            ("ball", |_| 3.0, PI, PI),
        ];
        for (name, lobe, normal_angle, reach) in lobes {
            let web = Arc::new(PhotometricWeb::from_directions(1.0, lobe));
            let from_world = Mat3::from_rotation_x(0.7) * Mat3::from_rotation_y(2.1);
            let (position, per_candela) = (Vec3::ONE, Vec3::splat(2.0));
            let light = Light::Photometric { position, from_world, web: Arc::clone(&web), per_candela };
            let bounds = point_bounds(&light).expect("a point");
            assert!((bounds.normal_angle - normal_angle).abs() < 0.02, "{name}: {bounds:?}");
            assert!((bounds.normal_angle + bounds.emission_angle - reach).abs() < 0.02, "{name}: {bounds:?}");
            for i in 0..20_000u64 {
                let unit = |dimension| crate::sampler::unit_of_hash(crate::sampler::hash_words(i, dimension));
                let z = 1.0 - 2.0 * unit(1);
                let (sin, cos) = (2.0 * PI * unit(2)).sin_cos();
                let direction = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                let beyond = direction.angle_between(bounds.axis) - bounds.normal_angle;
                let most = if beyond < bounds.emission_angle { bounds.intensity * beyond.max(0.0).cos() } else { 0.0 };
                let given = 2.0 * web.intensity_cd(from_world * direction);
                assert!(given <= most + 1e-3 * bounds.intensity, "{name}: {given} of {most} along {direction}");
            }
        }
    }
}
