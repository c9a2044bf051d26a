//! Ideal diffuse reflection: equally bright from everywhere.
//!
//! Parameter: `reflectance` ρ, the albedo per linear RGB channel in [0, 1]. f = ρ/π on both sides of the surface.
//!
//! Source: J. H. Lambert, *Photometria* (1760). Not for surfaces with visible relief at grazing light (the moon, cloth,
//! unfired clay), which look flatter than a Lambertian one.

use super::{BsdfEvaluation, BsdfSample, to_front, warp};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Ideal diffuse reflection.
#[derive(Clone, Copy, Debug)]
pub struct Lambert {
    reflectance: Vec3,
}

impl Lambert {
    /// Albedo per channel in [0, 1].
    pub fn new(reflectance: Vec3) -> Self {
        Self { reflectance }
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        if !(wo.z > 0.0 && wi.z > 0.0) {
            return BsdfEvaluation::BLACK;
        }
        BsdfEvaluation { value: self.reflectance * (FRAC_1_PI * wi.z), pdf: warp::cosine_hemisphere_pdf(wi.z) }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let wi = warp::cosine_hemisphere([u[0], u[1]]);
        let evaluation =
            BsdfEvaluation { value: self.reflectance * (FRAC_1_PI * wi.z), pdf: warp::cosine_hemisphere_pdf(wi.z) };
        evaluation.sample_turned(wi, wo)
    }

    pub(super) fn albedo(&self) -> Vec3 {
        self.reflectance
    }
}
