//! Surfaces that emit: triangles, sampled uniformly by area, and spheres, sampled uniformly in the cone that they fill.

use super::{LightPlace, LightSample};
use crate::scene::{Instance, Material, Scene, Sphere};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

#[derive(Clone, Debug)]
pub(super) struct TriangleEmitter {
    object: u32,
    triangle: u32,
    corner: Vec3,
    edge_1: Vec3,
    edge_2: Vec3,
    normal: Vec3,
    area: f32,
    both_sides: bool,
}

impl TriangleEmitter {
    pub(super) fn new(
        object: u32,
        triangle: u32,
        corners: [Vec3; 3],
        instance: &Instance,
        material: &Material,
    ) -> Self {
        let (edge_1, edge_2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let scaled_normal = edge_1.cross(edge_2);
        let mirrored = instance.to_world.matrix3.determinant() < 0.0;
        Self {
            object,
            triangle,
            corner: corners[0],
            edge_1,
            edge_2,
            normal: scaled_normal.normalize_or(Vec3::Y) * if mirrored { -1.0 } else { 1.0 },
            area: 0.5 * scaled_normal.length(),
            both_sides: material.emits_both_sides,
        }
    }

    pub(super) fn area(&self) -> f32 {
        self.area
    }

    pub(super) fn sides(&self) -> f32 {
        if self.both_sides { 2.0 } else { 1.0 }
    }

    pub(super) fn sample(&self, scene: &Scene, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let (b1, b2) = uniform_barycentrics(u);
        let position = self.corner + b1 * self.edge_1 + b2 * self.edge_2;
        let to_light = position - from;
        let distance = to_light.length();
        let direction = to_light / distance;
        let facing = -direction.dot(self.normal);
        if distance == 0.0 || self.area == 0.0 || (facing <= 0.0 && !self.both_sides) {
            return None;
        }
        let instance = &scene.instances[self.object as usize];
        let material = &scene.materials[instance.material.0 as usize];
        let uv = self.uv(scene, instance, b1, b2);
        Some(LightSample {
            direction,
            place: Some(LightPlace { position, normal: self.normal * facing.signum() }),
            radiance: material.emission.evaluate(&scene.textures, uv),
            pdf: self.pdf(direction, distance, self.normal),
            is_delta: false,
        })
        .filter(|s| s.pdf > 0.0 && s.pdf.is_finite())
    }

    fn uv(&self, scene: &Scene, instance: &Instance, b1: f32, b2: f32) -> Vec2 {
        let mesh = &scene.meshes[instance.mesh.0 as usize];
        if mesh.uvs.is_empty() {
            return Vec2::ZERO;
        }
        let [a, b, c] = mesh.triangles[self.triangle as usize].map(|i| mesh.uvs[i as usize]);
        a * (1.0 - b1 - b2) + b * b1 + c * b2
    }

    /// Area density turned to solid angle.
    pub(super) fn pdf(&self, direction: Vec3, distance: f32, normal: Vec3) -> f32 {
        distance * distance / (direction.dot(normal).abs() * self.area)
    }
}

/// Square to triangle without folding, so that stratification survives (Heitz, "A Low-Distortion Map Between Triangle and
/// Square", 2019).
fn uniform_barycentrics([u, v]: [f32; 2]) -> (f32, f32) {
    if v > u {
        let x = 0.5 * u;
        (x, v - x)
    } else {
        let y = 0.5 * v;
        (u - y, y)
    }
}

#[derive(Clone, Debug)]
pub(super) struct SphereEmitter {
    center: Vec3,
    radius: f32,
    radiance: Vec3,
}

impl SphereEmitter {
    /// `radiance` is the material's mean: textures on emitting spheres are seen, but sampled by their mean.
    pub(super) fn new(sphere: &Sphere, radiance: Vec3) -> Self {
        Self { center: sphere.center, radius: sphere.radius, radiance }
    }

    pub(super) fn area(&self) -> f32 {
        4.0 * PI * self.radius * self.radius
    }

    /// 1 − cos θ of the cone that the sphere fills from outside, without cancellation; `None` from inside.
    fn one_minus_cos(&self, from: Vec3) -> Option<f32> {
        let sin_squared = self.radius * self.radius / from.distance_squared(self.center);
        (sin_squared < 0.9999).then(|| sin_squared / (1.0 + (1.0 - sin_squared).sqrt()))
    }

    pub(super) fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let one_minus_cos_max = self.one_minus_cos(from)?;
        let axis = self.center - from;
        let axis_length = axis.length();
        let axis = axis / axis_length;
        let one_minus_cos = u[0] * one_minus_cos_max;
        let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
        let (tangent, bitangent) = axis.any_orthonormal_pair();
        let (sin_phi, cos_phi) = (TAU * u[1]).sin_cos();
        let direction = (axis * (1.0 - one_minus_cos) + (tangent * cos_phi + bitangent * sin_phi) * sin).normalize();
        // Distance to the near side; at the rim the root is 0.
        let along = axis_length * (1.0 - one_minus_cos);
        let miss = axis_length * sin;
        let distance = along - (self.radius * self.radius - miss * miss).max(0.0).sqrt();
        let position = from + direction * distance;
        Some(LightSample {
            direction,
            place: Some(LightPlace { position, normal: (position - self.center).normalize_or(-direction) }),
            radiance: self.radiance,
            pdf: 1.0 / (TAU * one_minus_cos_max),
            is_delta: false,
        })
    }

    pub(super) fn pdf(&self, from: Vec3) -> f32 {
        self.one_minus_cos(from).map_or(0.0, |c| 1.0 / (TAU * c))
    }
}
