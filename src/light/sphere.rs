//! Spheres that emit: sampled uniformly in the cone that they fill. From inside they are left to the BSDF.

use super::emission::{emitted, even_radiance};
use super::{LightPlace, LightSample};
use crate::geometry::{World, offset};
use crate::scene::{Alpha, SpherePlace};
use glam::{Mat3A, Vec3};
use std::f32::consts::{PI, TAU};

#[derive(Clone, Copy, Debug)]
pub(super) struct SphereEmitter {
    pub(super) object: u32,
    pub(super) center: Vec3,
    pub(super) radius: f32,
    axes: Mat3A,
    /// What it emits where that is the same everywhere; `None` where a picture says.
    even_radiance: Option<Vec3>,
    /// No ray meets it.
    is_unseen: bool,
}

impl SphereEmitter {
    /// A sphere as it is at a share of the open shutter.
    pub(super) fn new(world: &World, object: u32, time: f32) -> Self {
        let SpherePlace { center, radius, axes } = world.sphere_at(object, time);
        let material = world.material(object);
        Self {
            object,
            center: center.into(),
            radius,
            axes,
            even_radiance: even_radiance(material),
            is_unseen: material.alpha == Alpha::Unseen,
        }
    }

    /// What it emits into the opposite of `direction` where its unit normal is `normal`.
    fn radiance(&self, world: &World, normal: Vec3, direction: Vec3) -> Vec3 {
        self.even_radiance.unwrap_or_else(|| {
            let place = SpherePlace { center: self.center.into(), radius: self.radius, axes: self.axes };
            let (textures, uv) = (&world.scene().textures, place.uv(normal.into()));
            let material = world.material(self.object);
            emitted(material, textures, uv, direction.dot(normal).abs()) * material.alpha.coverage(textures, uv)
        })
    }

    /// Area of its outline.
    pub(super) fn cross_section(&self) -> f32 {
        PI * self.radius * self.radius
    }

    /// 1 − cos θ of the cone that the sphere fills from outside, without cancellation; `None` from inside.
    fn one_minus_cos(&self, from: Vec3) -> Option<f32> {
        let sin_squared = self.radius * self.radius / from.distance_squared(self.center);
        (sin_squared < 0.9999).then(|| sin_squared / (1.0 + (1.0 - sin_squared).sqrt()))
    }

    pub(super) fn sample(&self, world: &World, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let one_minus_cos_max = self.one_minus_cos(from)?;
        let axis = self.center - from;
        let axis_length = axis.length();
        let axis = axis / axis_length;
        let in_cone = Cone { axis, one_minus_cos: one_minus_cos_max };
        let direction = in_cone.sample(u);
        // Distance to the near side; at the rim the root is 0.
        let one_minus_cos = u[0] * one_minus_cos_max;
        let along = axis_length * (1.0 - one_minus_cos);
        let miss_squared = axis_length * axis_length * one_minus_cos * (2.0 - one_minus_cos);
        let distance = along - (self.radius * self.radius - miss_squared).max(0.0).sqrt();
        let normal = (from + direction * distance - self.center).normalize_or(-direction);
        let position = self.center + self.radius * normal;
        Some(LightSample {
            direction,
            place: Some(LightPlace { position, normal, offset: offset::of_sphere(position, self.radius) }),
            radiance: self.radiance(world, normal, direction),
            pdf: in_cone.pdf(),
            is_delta: self.is_unseen,
        })
    }

    /// Density per steradian of a direction that reaches the sphere at this distance; 0 for its far side, which is seen
    /// through what alpha leaves out and is never sampled.
    pub(super) fn pdf(&self, from: Vec3, direction: Vec3, distance: f32) -> f32 {
        let is_far_side = direction.dot(from + distance * direction - self.center) > 0.0;
        let one_minus_cos = self.one_minus_cos(from).filter(|_| !is_far_side);
        one_minus_cos.map_or(0.0, |one_minus_cos| Cone { axis: Vec3::Y, one_minus_cos }.pdf())
    }
}

/// Directions around an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    /// Unit vector.
    pub(super) axis: Vec3,
    /// 1 − cos of the half angle, above 0.
    pub(super) one_minus_cos: f32,
}

impl Cone {
    /// A unit direction, uniform in the cone.
    pub(super) fn sample(&self, u: [f32; 2]) -> Vec3 {
        let one_minus_cos = u[0] * self.one_minus_cos;
        let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
        let (tangent, bitangent) = self.axis.any_orthonormal_pair();
        let (sin_phi, cos_phi) = (TAU * u[1]).sin_cos();
        (self.axis * (1.0 - one_minus_cos) + (tangent * cos_phi + bitangent * sin_phi) * sin).normalize()
    }

    /// Density per steradian inside.
    pub(super) fn pdf(&self) -> f32 {
        1.0 / (TAU * self.one_minus_cos)
    }
}
