//! Where light comes from, one file a kind, and how one is chosen.
//!
//! A light is chosen by its power (the environment, if there is one, gets half of the choices), then a direction towards
//! it by its own rule. All pdfs are per steradian at the shaded point and include the choice, so they can be weighed
//! against those of BSDFs. Not for scenes of hundreds of emitters: choosing by power alone ignores distance.

mod area;
mod distribution;
mod environment;
mod punctual;

use crate::geometry::{Hit, Ray, SurfacePoint, World};
use crate::scene::{Light, Scene};
use area::{SphereEmitter, TriangleEmitter};
use distribution::Distribution1d;
use environment::EnvironmentSampler;
use glam::Vec3;

/// A direction towards a light, seen from a point.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction.
    pub direction: Vec3,
    /// Where the light is reached; `None` for environment and directional lights, which are infinitely far.
    pub place: Option<LightPlace>,
    /// Radiance that arrives if nothing is between; for lights without area, irradiance perpendicular to `direction`.
    pub radiance: Vec3,
    /// Probability per steradian; for lights without area, the probability of the choice.
    pub pdf: f32,
    /// Whether a BSDF could never find this light by chance.
    pub is_delta: bool,
}

/// A point on a light.
#[derive(Clone, Copy, Debug)]
pub struct LightPlace {
    /// World position.
    pub position: Vec3,
    /// Unit normal on the side that shines on the shaded point; zero for lights without a surface.
    pub normal: Vec3,
}

#[derive(Clone, Debug)]
enum Emitter {
    Triangle(TriangleEmitter),
    Sphere(SphereEmitter),
    Punctual(Light),
}

/// All lights of a world, ready to be sampled.
#[derive(Debug)]
pub struct Lights {
    emitters: Vec<Emitter>,
    /// Over `emitters`, by power.
    choice: Option<Distribution1d>,
    environment: Option<EnvironmentSampler>,
    /// Probability of choosing the environment.
    environment_share: f32,
    /// Per object: index of the emitter of its first triangle.
    first_emitter: Vec<Option<u32>>,
}

impl Lights {
    /// Collects every emitter of the world.
    pub fn new(world: &World) -> Self {
        let scene = world.scene();
        let (mut emitters, mut powers) = (Vec::new(), Vec::new());
        let mut first_emitter = vec![None; scene.instances.len() + scene.spheres.len()];
        for (object, instance) in scene.instances.iter().enumerate() {
            let material = &scene.materials[instance.material.0 as usize];
            let Some(radiance) = material.mean_emission(&scene.textures) else { continue };
            first_emitter[object] = Some(emitters.len() as u32);
            for triangle in 0..scene.meshes[instance.mesh.0 as usize].triangles.len() {
                let corners = world.triangle_corners(object as u32, triangle as u32);
                let emitter = TriangleEmitter::new(object as u32, triangle as u32, corners, instance, material);
                powers.push(f64::from(emitter.area() * radiance.max_element()) * f64::from(emitter.sides()));
                emitters.push(Emitter::Triangle(emitter));
            }
        }
        for (number, sphere) in scene.spheres.iter().enumerate() {
            let material = &scene.materials[sphere.material.0 as usize];
            let Some(radiance) = material.mean_emission(&scene.textures) else { continue };
            let object = scene.instances.len() + number;
            first_emitter[object] = Some(emitters.len() as u32);
            let emitter = SphereEmitter::new(sphere, radiance);
            powers.push(f64::from(emitter.area() * radiance.max_element()));
            emitters.push(Emitter::Sphere(emitter));
        }
        let (_, world_radius) = world.bounding_sphere();
        for light in &scene.lights {
            powers.push(f64::from(punctual::power(light, world_radius) / std::f32::consts::PI));
            emitters.push(Emitter::Punctual(light.clone()));
        }
        let choice = Distribution1d::new(&powers);
        let environment = scene.environment.as_ref().and_then(EnvironmentSampler::new);
        let environment_share = match (&environment, &choice) {
            (None, _) => 0.0,
            (Some(_), None) => 1.0,
            (Some(_), Some(_)) => 0.5,
        };
        Self { emitters, choice, environment, environment_share, first_emitter }
    }

    /// Whether there is nothing to sample.
    pub fn is_empty(&self) -> bool {
        self.choice.is_none() && self.environment.is_none()
    }

    /// A direction from `point` towards a light, for three numbers in [0, 1): two for the place, one for the choice.
    pub fn sample(&self, scene: &Scene, point: &SurfacePoint, u: [f32; 3]) -> Option<LightSample> {
        let [u0, u1, select] = u;
        if select < self.environment_share {
            let sample = self.environment.as_ref()?.sample([u0, u1])?;
            return Some(LightSample { pdf: sample.pdf * self.environment_share, ..sample });
        }
        let select = (select - self.environment_share) / (1.0 - self.environment_share);
        let (index, chosen) = self.choice.as_ref()?.sample_discrete(select);
        let chosen = chosen * (1.0 - self.environment_share);
        let sample = match &self.emitters[index] {
            Emitter::Triangle(emitter) => emitter.sample(scene, point.position, [u0, u1])?,
            Emitter::Sphere(emitter) => emitter.sample(point.position, [u0, u1])?,
            Emitter::Punctual(light) => punctual::sample(light, point.position)?,
        };
        Some(LightSample { pdf: sample.pdf * chosen, ..sample })
    }

    /// Probability per steradian that [`Lights::sample`] from `from` would have chosen the direction of a ray that hit
    /// the emitting surface point `there`.
    pub fn pdf_of_hit(&self, from: Vec3, ray: &Ray, hit: &Hit, there: &SurfacePoint) -> f32 {
        let (Some(first), Some(choice)) = (self.first_emitter[hit.object as usize], &self.choice) else {
            return 0.0;
        };
        let index = (first + hit.triangle) as usize;
        let chosen = choice.probability(index) * (1.0 - self.environment_share);
        chosen
            * match &self.emitters[index] {
                Emitter::Triangle(emitter) => emitter.pdf(ray.direction.into(), hit.distance, there.geometric_normal),
                Emitter::Sphere(emitter) => emitter.pdf(from),
                Emitter::Punctual(_) => 0.0,
            }
    }

    /// Radiance of the environment in a direction.
    pub fn environment_radiance(&self, direction: Vec3) -> Vec3 {
        self.environment.as_ref().map_or(Vec3::ZERO, |e| e.radiance(direction))
    }

    /// Probability per steradian that [`Lights::sample`] chooses this direction towards the environment.
    pub fn pdf_of_environment(&self, direction: Vec3) -> f32 {
        self.environment.as_ref().map_or(0.0, |e| e.pdf(direction) * self.environment_share)
    }
}
