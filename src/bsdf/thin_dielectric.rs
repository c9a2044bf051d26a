//! A thin clear sheet, such as a window pane or a soap film seen as a surface without inside: light is reflected or
//! goes straight on, with all reflections between the sheet's two faces summed up.
//!
//! Parameters: `ior`, index of refraction of the sheet over its surroundings, above 0; `transmittance`, tint of what
//! goes through, per linear RGB channel in [0, 1].
//!
//! Source: Pharr, Jakob & Humphreys, *Physically Based Rendering* (2023), section 9.5 (R + T²R/(1 − R²) = 2R/(1 + R) of
//! a lossless sheet). Not for thick glass, which shifts and refracts what is seen through it.

use super::mirror::reflect_about_normal;
use super::{BsdfSample, Lobe, fresnel};
use glam::Vec3;

/// Thin clear sheet.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric {
    ior: f32,
    transmittance: Vec3,
}

impl ThinDielectric {
    /// Index of refraction above 0 and tint of the transmitted light in [0, 1].
    pub fn new(ior: f32, transmittance: Vec3) -> Self {
        Self { ior, transmittance }
    }

    fn reflectance(&self, cos: f32) -> f32 {
        let face = fresnel::dielectric(cos, self.ior).reflectance;
        2.0 * face / (1.0 + face)
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let reflectance = self.reflectance(wo.z.abs());
        let transmitted = self.straight_through(wo);
        let probability = reflectance / (reflectance + transmitted.max_element());
        if u[2] < probability {
            Some(BsdfSample {
                wi: reflect_about_normal(wo),
                weight: Vec3::splat(reflectance / probability),
                pdf: probability,
                lobe: Lobe::Delta,
                crossed_index: None,
            })
        } else {
            let pdf = 1.0 - probability;
            (pdf > 0.0).then(|| BsdfSample {
                wi: -wo,
                weight: transmitted / pdf,
                pdf,
                lobe: Lobe::DeltaTransmission,
                crossed_index: None,
            })
        }
    }

    pub(super) fn straight_through(&self, wo: Vec3) -> Vec3 {
        (1.0 - self.reflectance(wo.z.abs())) * self.transmittance
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let reflectance = self.reflectance(wo.z.abs());
        Vec3::splat(reflectance) + (1.0 - reflectance) * self.transmittance
    }
}
