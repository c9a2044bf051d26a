//! Spheres that emit: sampled uniformly in the cone that they fill. From inside they are left to the BSDF.

use super::{LightPlace, LightSample};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

#[derive(Clone, Copy, Debug)]
pub(super) struct SphereEmitter {
    pub(super) center: Vec3,
    pub(super) radius: f32,
    /// The material's mean: textures on emitting spheres are seen, but sampled by their mean.
    pub(super) radiance: Vec3,
}

impl SphereEmitter {
    /// Area of its outline.
    pub(super) fn cross_section(&self) -> f32 {
        PI * self.radius * self.radius
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
        let in_cone = Cone { axis, one_minus_cos: one_minus_cos_max };
        let direction = in_cone.sample(u);
        // Distance to the near side; at the rim the root is 0.
        let one_minus_cos = u[0] * one_minus_cos_max;
        let along = axis_length * (1.0 - one_minus_cos);
        let miss_squared = axis_length * axis_length * one_minus_cos * (2.0 - one_minus_cos);
        let distance = along - (self.radius * self.radius - miss_squared).max(0.0).sqrt();
        let position = from + direction * distance;
        Some(LightSample {
            direction,
            place: Some(LightPlace { position, normal: (position - self.center).normalize_or(-direction) }),
            radiance: self.radiance,
            pdf: in_cone.pdf(),
            is_delta: false,
        })
    }

    pub(super) fn pdf(&self, from: Vec3) -> f32 {
        self.one_minus_cos(from).map_or(0.0, |one_minus_cos| Cone { axis: Vec3::Y, one_minus_cos }.pdf())
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
