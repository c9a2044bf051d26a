//! Rough diffuse reflection: a surface of Lambertian grooves, flatter than a Lambertian one (the moon, clay, cloth).
//!
//! Parameters: `reflectance` ρ per linear RGB channel in [0, 1], the albedo of the grooves' walls (1 reflects
//! everything, darker colours come out a little darker and more saturated with roughness); `roughness` in [0, 1], 0
//! being Lambert.
//!
//! Sources: M. Oren & S. Nayar (1994) for the phenomenon; Y. Fujii's qualitative form, made energy-preserving by J.
//! Portsmouth, P. Kutz & S. Hill, *EON: a practical energy-preserving rough diffuse BRDF* (2024): the single-scattering
//! lobe with its closed-form albedo, and the reciprocal lobe for light between grooves. Not for glossy surfaces, nor
//! where the original's exact angular shape matters.

use super::{BsdfEvaluation, Reflector, warp};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};

/// Rough diffuse reflection.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    reflectance: Vec3,
    roughness: f32,
    /// Albedo of single scattering at normal incidence, for white walls.
    facing: f32,
    /// Cosine-weighted average of that albedo.
    average: f32,
    /// Albedo of light that met two or more walls.
    multiple: Vec3,
}

impl OrenNayar {
    /// Albedo per channel and roughness, both in [0, 1].
    pub fn new(reflectance: Vec3, roughness: f32) -> Self {
        let roughness = roughness.clamp(0.0, 1.0);
        let facing = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * PI)) * roughness);
        let average = facing * (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * PI)) * roughness);
        let multiple = reflectance * reflectance * average / (Vec3::ONE - reflectance * (1.0 - average));
        Self { reflectance, roughness, facing, average, multiple }
    }

    /// Albedo of single scattering at an incident cosine, for white walls.
    fn single_albedo(&self, cos: f32) -> f32 {
        let cos = cos.clamp(0.0, 1.0);
        let sin = (1.0 - cos * cos).sqrt();
        // tan θ (1 − sin³θ) with its division by cos θ cancelled, so that it holds at the horizon.
        let tangent_term = sin * cos * (1.0 + sin + sin * sin) / (1.0 + sin);
        let groove = sin * (cos.acos() - sin * cos) + 2.0 / 3.0 * (tangent_term - sin);
        self.facing * (1.0 + self.roughness * FRAC_1_PI * groove)
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let single = self.single_albedo(wo.z.abs());
        self.reflectance * single + self.multiple * (1.0 - single)
    }
}

impl Reflector for OrenNayar {
    fn evaluate_front(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let s = wo.dot(wi) - wo.z * wi.z;
        let ratio = if s > 0.0 { s / wo.z.max(wi.z) } else { s };
        let single = self.facing * (1.0 + self.roughness * ratio);
        // Without roughness nothing is missing, and 0/0 must not be asked.
        let missing_average = (1.0 - self.average).max(1e-7);
        let missing = |cos| (1.0 - self.single_albedo(cos)).max(0.0);
        let between = missing(wo.z) * missing(wi.z) / missing_average;
        let f = self.reflectance * single.max(0.0) + self.multiple * between;
        BsdfEvaluation { value: f * (FRAC_1_PI * wi.z), pdf: warp::cosine_hemisphere_pdf(wi.z) }
    }

    fn sample_front(&self, _wo: Vec3, u: [f32; 3]) -> Vec3 {
        warp::cosine_hemisphere([u[0], u[1]])
    }
}
