//! Lacquered or anodised metal: a clear dielectric coat over a conductor, either of them smooth or rough.
//!
//! Parameters: `eta` and `k`, the metal's index of refraction per linear RGB channel relative to air; its facets and
//! the coat's; tables for the coat's index of refraction (at least 1) and for both roughnesses.
//!
//! Light is reflected by the coat's face, or refracted into the coat, reflected once by the metal and refracted out
//! again (a rough coat widens the metal's facets by half the variance that its slopes give to refracted rays, twice),
//! or meets the metal twice or more often. Tables say how much of it each of these is, by light that goes to and fro
//! between the layers; two diffuse-like lobes give back what meets the metal twice, and what meets it more often:
//! reciprocal, and lossless over a lossless metal. With both smooth the series of reflections is summed exactly.
//!
//! Sources: own combination of the half-way vectors of B. Walter et al. (2007), the compensation of C. Kulla & A. Conty
//! (2017) and the series of plane layers, F + T²R/(1 − FR). Not for tinted or thick coats.

use super::coat::Coat;
use super::layer_tables::{LayerCurve, LayerPoint, LayerTables, inside, outside, seen_through};
use super::microfacets::Microfacets;
use super::mirror::reflect_about_normal;
use super::{BsdfEvaluation, BsdfSample, fresnel, to_front, turn, warp};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// A clear coat over a metal.
#[derive(Clone, Copy, Debug)]
pub struct CoatedConductor<'a> {
    coat: Coat<'a>,
    /// The metal's index relative to the coat.
    eta: Vec3,
    k: Vec3,
    /// The metal as seen through the coat; `None` where both are smooth.
    rough: Option<Rough<'a>>,
}

/// What there is if coat or metal are rough.
#[derive(Clone, Copy, Debug)]
struct Rough<'a> {
    base: Microfacets,
    curve: LayerCurve<'a>,
    /// Reflectance of light that meets the metal twice.
    second: Vec3,
    /// Reflectance of light that meets it more often.
    later: Vec3,
}

/// Probabilities of the coat's face, one reflection off the metal, and the rest.
struct LobeProbabilities {
    coat: f32,
    single: f32,
    multiple: f32,
}

impl Rough<'_> {
    /// What meets the metal twice or more often, per what enters and what could leave.
    fn multiple_lobes(&self, from: &LayerPoint, to: &LayerPoint) -> Vec3 {
        self.second * (from.second * to.second / self.curve.average_second)
            + self.later * (from.later * to.later / self.curve.average_later)
    }
}

impl<'a> CoatedConductor<'a> {
    /// The metal's index relative to air, the facets of metal and coat, and the tables of both.
    pub fn new(eta: Vec3, k: Vec3, base: Microfacets, coat_facets: Microfacets, tables: &'a LayerTables) -> Self {
        let coat = tables.coat.coat(coat_facets.rough().as_ref());
        let (eta, k) = (eta / coat.eta, k / coat.eta);
        let rough = seen_through(base, &coat).map(|seen| {
            let curve = tables.curve(&coat_facets, &base);
            let fresnel = fresnel::conductor_average(eta, k);
            let second = fresnel * fresnel;
            let escape = curve.later_escape;
            let later = second * fresnel * escape / (Vec3::ONE - fresnel * (1.0 - escape));
            Rough { base: seen, curve, second, later }
        });
        Self { coat, eta, k, rough }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.rough.is_some()
    }

    /// Reflectance of what met the metal once, where light comes from `wo`, and of what met it more often.
    fn beneath(&self, rough: &Rough<'_>, wo: Vec3) -> [Vec3; 2] {
        let layers = rough.curve.at(wo);
        let cos = inside(wo, self.coat.eta).z * layers.steeper;
        let single = fresnel::conductor(cos, self.eta, self.k) * (1.0 - layers.second - layers.later);
        [single, rough.second * layers.second + rough.later * layers.later]
    }

    fn shares(&self, rough: &Rough<'_>, wo: Vec3) -> LobeProbabilities {
        let passed = self.coat.passed(wo);
        let [single, multiple] = self.beneath(rough, wo).map(|part| passed * part.max_element());
        let coat = 1.0 - passed;
        let total = coat + single + multiple;
        if total > 0.0 {
            LobeProbabilities { coat: coat / total, single: single / total, multiple: multiple / total }
        } else {
            LobeProbabilities { coat: 1.0, single: 0.0, multiple: 0.0 }
        }
    }

    fn evaluate_front(&self, rough: &Rough<'_>, shares: &LobeProbabilities, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let eta = self.coat.eta;
        let passed = self.coat.passed(wo) * self.coat.passed(wi);
        let (from, to) = (rough.curve.at(wo), rough.curve.at(wi));
        let mut value = rough.multiple_lobes(&from, &to) * (passed * wi.z * FRAC_1_PI);
        let mut pdf = shares.multiple * warp::cosine_hemisphere_pdf(wi.z);

        let (view, light) = (inside(wo, eta), inside(wi, eta));
        let facet = rough.base.reflect(view, light);
        // Steradians inside per steradian outside.
        let jacobian = wi.z / (eta * eta * light.z);
        let cos = facet.cos_half * (from.steeper * to.steeper).sqrt();
        let brought_out = (from.brought_out * to.brought_out).sqrt();
        value += fresnel::conductor(cos, self.eta, self.k) * (passed * brought_out * facet.value * jacobian);
        pdf += shares.single * facet.pdf * jacobian;

        if let Some(facets) = &self.coat.facets {
            let facet = facets.reflect(wo, wi);
            value += Vec3::splat(fresnel::dielectric(facet.cos_half, eta).reflectance * facet.value);
            pdf += shares.coat * facet.pdf;
        }
        BsdfEvaluation { value, pdf }
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        match &self.rough {
            Some(rough) if wo.z > 0.0 && wi.z > 0.0 => self.evaluate_front(rough, &self.shares(rough, wo), wo, wi),
            _ => BsdfEvaluation::BLACK,
        }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let front = if wo.z < 0.0 { turn(wo) } else { wo };
        let mirrored = reflect_about_normal(wo);
        let Some(rough) = &self.rough else {
            return Some(BsdfSample::reflected_delta(mirrored, self.smooth_reflectance(front), 1.0));
        };
        let shares = self.shares(rough, front);
        let point = [u[0], u[1]];
        let wi = if u[2] < shares.coat {
            match &self.coat.facets {
                Some(facets) => facets.sample_reflection(front, point)?,
                None => {
                    let weight = Vec3::splat(self.coat.reflectance(front) / shares.coat);
                    return Some(BsdfSample::reflected_delta(mirrored, weight, shares.coat));
                }
            }
        } else if u[2] < shares.coat + shares.single {
            let light = rough.base.sample_reflection(inside(front, self.coat.eta), point)?;
            outside(light, self.coat.eta)?
        } else {
            warp::cosine_hemisphere(point)
        };
        self.evaluate_front(rough, &shares, front, wi).sample_turned(wi, wo)
    }

    /// The sum of all reflections between two smooth faces.
    fn smooth_reflectance(&self, wo: Vec3) -> Vec3 {
        let face = self.coat.reflectance(wo);
        let metal = fresnel::conductor(inside(wo, self.coat.eta).z, self.eta, self.k);
        Vec3::splat(face) + metal * ((1.0 - face) * (1.0 - face)) / (Vec3::ONE - metal * face).max(Vec3::splat(1e-6))
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let (up, _) = to_front(wo, wo);
        match &self.rough {
            None => self.smooth_reflectance(up),
            Some(rough) => {
                let passed = self.coat.passed(up);
                let [single, multiple] = self.beneath(rough, up);
                Vec3::splat(1.0 - passed) + passed * (single + multiple)
            }
        }
    }
}
