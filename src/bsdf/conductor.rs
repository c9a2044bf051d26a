//! Metal: a boundary that reflects or absorbs, smooth or rough.
//!
//! Parameters: `eta` and `k`, real and imaginary part of the index of refraction per linear RGB channel, relative to air
//! (η of 0 with any k reflects everything); `roughness` in [0, 1], perceptual. α = roughness² below 1e-3 is a perfect
//! mirror with the metal's Fresnel reflectance.
//!
//! Sources: R. Cook & K. Torrance (1982) for the model, B. Walter et al. (2007), eq. 20; the GGX distribution and the
//! compensation of multiple bounces as their own files say. Not for painted or anodised metal: those are coated diffuse.

use super::energy::{self, AlbedoCurve, LARGEST_SINGLE_SHARE};
use super::ggx::Ggx;
use super::mirror::reflect_about_normal;
use super::warp::GrazingHemisphere;
use super::{BsdfEvaluation, BsdfSample, Lobe, SMALLEST_ALPHA, fresnel, to_front, turn};
use glam::Vec3;

/// Metal, smooth or rough.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    eta: Vec3,
    k: Vec3,
    facets: Option<Facets>,
}

/// The rough part: one bounce off GGX facets and a diffuse-like lobe for two or more.
#[derive(Clone, Copy, Debug)]
struct Facets {
    ggx: Ggx,
    missing: AlbedoCurve<'static>,
    grazing: GrazingHemisphere,
    /// Tint of light that bounced twice or more.
    tint: Vec3,
}

impl Conductor {
    /// Index of refraction η + ik per channel, at least 0, and perceptual roughness in [0, 1].
    pub fn new(eta: Vec3, k: Vec3, roughness: f32) -> Self {
        let roughness = roughness.clamp(0.0, 1.0);
        let alpha = roughness * roughness;
        let facets = (alpha >= SMALLEST_ALPHA).then(|| {
            let missing = energy::GGX.missing.curve(roughness);
            Facets {
                ggx: Ggx::isotropic(alpha),
                missing,
                grazing: GrazingHemisphere::new(alpha),
                tint: energy::multiple_bounce_tint(fresnel::conductor_average(eta, k), 1.0 - missing.average()),
            }
        });
        Self { eta, k, facets }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.facets.is_some()
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        match &self.facets {
            Some(facets) if wo.z > 0.0 && wi.z > 0.0 => self.evaluate_front(facets, wo, wi),
            _ => BsdfEvaluation::BLACK,
        }
    }

    fn evaluate_front(&self, facets: &Facets, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let h = (wo + wi).normalize_or(Vec3::Z);
        let density = facets.ggx.density(h);
        let reflectance = fresnel::conductor(wo.dot(h), self.eta, self.k);
        let single = density * facets.ggx.visibility(wo, wi) * wi.z;
        let multiple = energy::missing_lobe(&facets.missing, wo.z, wi.z);
        let share = facets.single_share(wo.z);
        let visible = 0.25 * facets.ggx.visible_density_over_cosine(wo, h);
        BsdfEvaluation {
            value: reflectance * single + facets.tint * multiple,
            pdf: share * visible + (1.0 - share) * facets.grazing.pdf(wi.z),
        }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let front = if wo.z < 0.0 { turn(wo) } else { wo };
        let Some(facets) = &self.facets else {
            return Some(BsdfSample {
                wi: reflect_about_normal(wo),
                weight: fresnel::conductor(front.z, self.eta, self.k),
                pdf: 1.0,
                lobe: Lobe::Delta,
            });
        };
        let wi = if u[2] < facets.single_share(front.z) {
            let m = facets.ggx.sample_visible(front, [u[0], u[1]]);
            2.0 * front.dot(m) * m - front
        } else {
            facets.grazing.sample([u[0], u[1]])
        };
        if wi.z <= 0.0 {
            return None;
        }
        self.evaluate_front(facets, front, wi).sample_turned(wi, wo)
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let cos = wo.z.abs();
        let reflectance = fresnel::conductor(cos, self.eta, self.k);
        match &self.facets {
            None => reflectance,
            Some(facets) => {
                let missing = facets.missing.at(cos);
                reflectance * (1.0 - missing) + facets.tint * missing
            }
        }
    }
}

impl Facets {
    /// Probability that a sample is one bounce off a facet. Close to its share of the energy; never below 0.25, since a
    /// dark tint makes the other lobe count for less than it does for a lossless metal.
    fn single_share(&self, cos_o: f32) -> f32 {
        (1.0 - self.missing.at(cos_o)).clamp(0.25, LARGEST_SINGLE_SHARE)
    }
}
