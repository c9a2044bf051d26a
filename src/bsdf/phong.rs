//! The modified Phong model: a diffuse base and a lobe around the mirror direction.
//!
//! Parameters: `diffuse` and `specular` albedo per linear RGB channel in [0, 1], their sum at most 1; `exponent` n of
//! the lobe, at least 0. f = ρd/π + ρs (n + 2)/(2π) cosⁿα, α being the angle between wi and the mirror direction of wo.
//!
//! Sources: B. T. Phong (1975) for the lobe; R. Lewis, *Making shaders more physically plausible* (1994), and E.
//! Lafortune & Y. Willems, *Using the modified Phong reflectance model for physically based rendering* (1994), for the
//! reciprocal form and its norm, with which the lobe's albedo is ρs face on and falls towards grazing angles, where
//! part of it would lie below the surface. Not for metals or plastic: there is no Fresnel effect.

use super::{BsdfEvaluation, Reflector, warp};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, TAU};

/// Diffuse base and Phong lobe.
#[derive(Clone, Copy, Debug)]
pub struct Phong {
    diffuse: Vec3,
    specular: Vec3,
    exponent: f32,
    /// Probability of sampling the lobe.
    specular_share: f32,
}

/// Beyond this the lobe is narrower than single precision can place it.
const MAX_EXPONENT: f32 = 1e6;

impl Phong {
    /// The parameters as in the file's head.
    pub fn new(diffuse: Vec3, specular: Vec3, exponent: f32) -> Self {
        let total = diffuse.max_element() + specular.max_element();
        let specular_share = if total > 0.0 { specular.max_element() / total } else { 0.0 };
        Self { diffuse, specular, exponent: exponent.clamp(0.0, MAX_EXPONENT), specular_share }
    }

    /// Right face on; the lobe's loss towards grazing angles is left out.
    pub(super) fn albedo(&self) -> Vec3 {
        self.diffuse + self.specular
    }
}

impl Reflector for Phong {
    fn evaluate_front(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        // cos α = 1 − |wi − r|²/2 keeps the digits that a narrow lobe needs.
        let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
        let half_distance2 = 0.5 * (wi - mirror).length_squared();
        let power = if half_distance2 < 1.0 { (self.exponent * (-half_distance2).ln_1p()).exp() } else { 0.0 };
        let lobe = self.specular * ((self.exponent + 2.0) / TAU * power);
        BsdfEvaluation {
            value: (self.diffuse * FRAC_1_PI + lobe) * wi.z,
            pdf: (1.0 - self.specular_share) * warp::cosine_hemisphere_pdf(wi.z)
                + self.specular_share * (self.exponent + 1.0) / TAU * power,
        }
    }

    fn sample_front(&self, wo: Vec3, u: [f32; 3]) -> Vec3 {
        if u[2] < self.specular_share {
            let cos = (1.0 - u[1]).powf(1.0 / (self.exponent + 1.0));
            let radius = (1.0 - cos * cos).max(0.0).sqrt();
            let (sin_phi, cos_phi) = warp::sin_cos_of_turns(u[0]);
            let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
            let (x, y) = mirror.any_orthonormal_pair();
            (x * (radius * cos_phi) + y * (radius * sin_phi) + mirror * cos).normalize()
        } else {
            warp::cosine_hemisphere([u[0], u[1]])
        }
    }
}
