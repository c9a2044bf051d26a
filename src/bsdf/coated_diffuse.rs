//! Plastic, varnished wood, glazed ceramics: a clear dielectric coat, smooth or rough, over a diffuse base.
//!
//! Parameters: `reflectance`, albedo of the base per linear RGB channel in [0, 1]; the coat's index of refraction (at
//! least 1) and distribution, by its tables; the coat's facets; what comes of light that the coat turns back inside
//! ([`Saturation`]).
//!
//! Sources: the coupling of `coat`; the series ρ(1 − r)/(1 − ρr) of light between coat and base, r being the share of
//! diffuse light that the coat turns back, of J. Saunderson (1942). Lossless for a white base.
//! Not for coats with a colour of their own, nor for metals under varnish: see the coated conductor.

use super::coat::{Coat, CoatTables};
use super::microfacets::Microfacets;
use super::mirror::reflect_about_normal;
use super::{BsdfEvaluation, BsdfSample, fresnel, to_front, turn, warp};
use glam::Vec3;

/// A clear coat over a diffuse base.
#[derive(Clone, Copy, Debug)]
pub struct CoatedDiffuse<'a> {
    coat: Coat<'a>,
    /// Albedo of what enters the coat and leaves it again in the end.
    base: Vec3,
}

/// What light that the coat turns back inside does to the base's colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Saturation {
    /// Light meets the base again and takes on more of its colour, as it does in reality.
    Repeated,
    /// Nothing: albedo is `reflectance` times what the coat lets in, as in simpler models that scenes of others may
    /// expect.
    None,
}

impl<'a> CoatedDiffuse<'a> {
    /// The parameters as in the file's head.
    pub fn new(reflectance: Vec3, microfacets: Microfacets, saturation: Saturation, tables: &'a CoatTables) -> Self {
        let coat = tables.coat(microfacets.rough().as_ref());
        let back = coat.turned_back();
        let base = match saturation {
            Saturation::Repeated => reflectance * (1.0 - back) / (Vec3::ONE - reflectance * back),
            Saturation::None => reflectance,
        };
        Self { coat, base }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.coat.facets.is_some() || self.base != Vec3::ZERO
    }

    /// Probability of the coat's own reflection.
    fn coat_share(&self, wo: Vec3) -> f32 {
        let reflected = self.coat.reflectance(wo);
        let base = self.base.max_element() * (1.0 - reflected);
        let total = reflected + base;
        if total > 0.0 { reflected / total } else { 1.0 }
    }

    fn evaluate_front(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let share = self.coat_share(wo);
        let mut value = self.base * self.coat.diffuse_lobe(wo, wi);
        let mut pdf = (1.0 - share) * warp::cosine_hemisphere_pdf(wi.z);
        if let Some(facets) = &self.coat.facets {
            let facet = facets.reflect(wo, wi);
            value += Vec3::splat(fresnel::dielectric(facet.cos_half, self.coat.eta).reflectance * facet.value);
            pdf += share * facet.pdf;
        }
        BsdfEvaluation { value, pdf }
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        if wo.z > 0.0 && wi.z > 0.0 { self.evaluate_front(wo, wi) } else { BsdfEvaluation::BLACK }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let front = if wo.z < 0.0 { turn(wo) } else { wo };
        let share = self.coat_share(front);
        let wi = match &self.coat.facets {
            _ if u[2] >= share => warp::cosine_hemisphere([u[0], u[1]]),
            Some(facets) => facets.sample_reflection(front, [u[0], u[1]])?,
            None => {
                let weight = Vec3::splat(self.coat.reflectance(front) / share);
                return Some(BsdfSample::reflected_delta(reflect_about_normal(wo), weight, share));
            }
        };
        self.evaluate_front(front, wi).sample_turned(wi, wo)
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let (up, _) = to_front(wo, wo);
        let reflected = self.coat.reflectance(up);
        Vec3::splat(reflected) + self.base * (1.0 - reflected)
    }
}
