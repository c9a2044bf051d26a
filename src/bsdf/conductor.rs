//! Metal: a boundary that reflects or absorbs, smooth or rough.
//!
//! Parameters: `eta` and `k`, real and imaginary part of the index of refraction per linear RGB channel, relative to
//! air (η of 0 with any k reflects everything); `tint` in [0, 1], white for real metals; microfacets of GGX or
//! Beckmann, of which slope widths below 1e-3 are a perfect mirror with the metal's Fresnel reflectance.
//!
//! Sources: R. Cook & K. Torrance (1982) for the model, B. Walter et al. (2007), eq. 20; the GGX distribution and the
//! compensation of multiple bounces as their own files say. Not for painted or anodised metal: those are coated
//! diffuse.

use super::albedo_table::DirectionalCurve;
use super::anisotropic_table::AnisotropicTable;
use super::energy::{self, MAX_SINGLE_SHARE, ReflectionTables};
use super::microfacets::Microfacets;
use super::mirror::reflect_about_normal;
use super::warp::GrazingHemisphere;
use super::{BsdfEvaluation, BsdfSample, fresnel, to_front, turn};
use glam::Vec3;

/// Metal, smooth or rough.
#[derive(Clone, Copy, Debug)]
pub struct Conductor<'a> {
    eta: Vec3,
    k: Vec3,
    tint: Vec3,
    facets: Option<Facets<'a>>,
}

/// The rough part: one bounce off facets and a diffuse-like lobe for two or more.
#[derive(Clone, Copy, Debug)]
struct Facets<'a> {
    microfacets: Microfacets,
    missing: DirectionalCurve<'a>,
    grazing: GrazingHemisphere,
    /// Reflectance of light that bounced twice or more.
    multiple: Vec3,
}

impl<'a> Conductor<'a> {
    /// Index of refraction η + ik per channel, at least 0, a tint in [0, 1] that multiplies what is reflected, and the
    /// surface's facets with, if they are anisotropic, their table of missing energy.
    pub fn new(
        eta: Vec3,
        k: Vec3,
        tint: Vec3,
        microfacets: Microfacets,
        anisotropic: Option<&'a AnisotropicTable>,
    ) -> Self {
        let facets = microfacets.rough().map(|microfacets| {
            let missing = ReflectionTables::of(microfacets.distribution()).missing.along(&microfacets, anisotropic);
            Facets {
                microfacets,
                missing,
                grazing: GrazingHemisphere::new(microfacets.mean_alpha()),
                multiple: tint
                    * energy::multiple_bounce_tint(fresnel::conductor_average(eta, k), 1.0 - missing.average()),
            }
        });
        Self { eta, k, tint, facets }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.facets.is_some()
    }

    fn reflectance(&self, cos: f32) -> Vec3 {
        self.tint * fresnel::conductor(cos, self.eta, self.k)
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        match &self.facets {
            Some(facets) if wo.z > 0.0 && wi.z > 0.0 => self.evaluate_front(facets, wo, wi),
            _ => BsdfEvaluation::BLACK,
        }
    }

    fn evaluate_front(&self, facets: &Facets<'_>, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let single = facets.microfacets.reflect(wo, wi);
        let multiple = energy::missing_lobe(&facets.missing, wo, wi);
        let share = facets.single_share(wo);
        BsdfEvaluation {
            value: self.reflectance(single.cos_half) * single.value + facets.multiple * multiple,
            pdf: share * single.pdf + (1.0 - share) * facets.grazing.pdf(wi.z),
        }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let front = if wo.z < 0.0 { turn(wo) } else { wo };
        let Some(facets) = &self.facets else {
            return Some(BsdfSample::reflected_delta(reflect_about_normal(wo), self.reflectance(front.z), 1.0));
        };
        let wi = if u[2] < facets.single_share(front) {
            facets.microfacets.sample_reflection(front, [u[0], u[1]])?
        } else {
            facets.grazing.sample([u[0], u[1]])
        };
        self.evaluate_front(facets, front, wi).sample_turned(wi, wo)
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let (up, _) = to_front(wo, wo);
        let reflectance = self.reflectance(up.z);
        match &self.facets {
            None => reflectance,
            Some(facets) => {
                let missing = facets.missing.at(up);
                reflectance * (1.0 - missing) + facets.multiple * missing
            }
        }
    }
}

impl Facets<'_> {
    /// Probability that a sample is one bounce off a facet. Close to its share of the energy; never below 0.25, since a
    /// dark tint makes the other lobe count for less than it does for a lossless metal.
    fn single_share(&self, wo: Vec3) -> f32 {
        (1.0 - self.missing.at(wo)).clamp(0.25, MAX_SINGLE_SHARE)
    }
}
