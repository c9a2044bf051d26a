//! A thin diffuse sheet (paper, a leaf, a lampshade): light is scattered evenly on both sides.
//!
//! Parameters: `reflectance` and `transmittance`, albedo of the lit side and of the other per linear RGB channel, each
//! in [0, 1]; their sum should not exceed 1 in any channel, or the sheet would make light.
//!
//! Source: Pharr, Jakob & Humphreys, *Physically Based Rendering* (2023), section 9.2 on diffuse transmission;
//! f = ρ/π and τ/π. Both sides lie in the same medium, so no factor for the index of refraction arises. Not for
//! volumes whose thickness shows.

use super::{BsdfEvaluation, BsdfSample, to_front, turn, warp};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// A thin diffuse sheet.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseTransmission {
    reflectance: Vec3,
    transmittance: Vec3,
    /// Probability that a sample is a reflection.
    reflects: f32,
}

impl DiffuseTransmission {
    /// Albedo of either side per channel in [0, 1], their sum at most 1.
    pub fn new(reflectance: Vec3, transmittance: Vec3) -> Self {
        let total = reflectance.max_element() + transmittance.max_element();
        Self { reflectance, transmittance, reflects: if total > 0.0 { reflectance.max_element() / total } else { 1.0 } }
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        if wo.z <= 0.0 {
            return BsdfEvaluation::BLACK;
        }
        let (albedo, share) =
            if wi.z > 0.0 { (self.reflectance, self.reflects) } else { (self.transmittance, 1.0 - self.reflects) };
        let cos = wi.z.abs();
        BsdfEvaluation { value: albedo * (FRAC_1_PI * cos), pdf: share * warp::cosine_hemisphere_pdf(cos) }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let up = warp::cosine_hemisphere([u[0], u[1]]);
        let wi = if u[2] < self.reflects { up } else { turn(up) };
        let (front, _) = to_front(wo, wi);
        self.evaluate(front, wi).sample_turned(wi, wo)
    }

    pub(super) fn albedo(&self) -> Vec3 {
        self.reflectance + self.transmittance
    }
}
