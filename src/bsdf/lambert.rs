//! Ideal diffuse reflection: equally bright from everywhere.
//!
//! Parameter: `reflectance` ρ, the albedo per linear RGB channel in [0, 1]. f = ρ/π on both sides of the surface.
//!
//! Source: J. H. Lambert, *Photometria* (1760). Not for surfaces with visible relief at grazing light (the moon, cloth,
//! unfired clay), which look flatter than a Lambertian one.

use super::{BsdfEvaluation, BsdfSample, Lobe, Reflector, warp};
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

    pub(super) fn albedo(&self) -> Vec3 {
        self.reflectance
    }
}

impl Reflector for Lambert {
    fn evaluate_front(&self, _wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        BsdfEvaluation { value: self.reflectance * (FRAC_1_PI * wi.z), pdf: warp::cosine_hemisphere_pdf(wi.z) }
    }

    fn sample_front(&self, _wo: Vec3, u: [f32; 3]) -> Vec3 {
        warp::cosine_hemisphere([u[0], u[1]])
    }

    /// The weight is the albedo itself: no need to divide value by pdf.
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let wi = self.sample_front(wo, u);
        let pdf = warp::cosine_hemisphere_pdf(wi.z);
        let sample = BsdfSample { wi, weight: self.reflectance, pdf, lobe: Lobe::Smooth, crossed_index: None };
        (wo.z != 0.0).then(|| sample.turned_like(wo))
    }
}
