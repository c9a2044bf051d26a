//! The boundary of a clear volume (glass, water), smooth or rough: light is reflected or refracted.
//!
//! Parameters: index of refraction inside over outside, above 0 (`wo.z > 0` is outside); microfacets of GGX or
//! Beckmann, of which slope widths below 1e-3 are perfectly smooth; `transmittance`, a tint per linear RGB channel in
//! [0, 1] on every crossing; tables for the light that bounces between facets, without which a rough boundary loses it.
//! What the inside absorbs is the integrator's to count.
//!
//! Sources: B. Walter et al., *Microfacet models for refraction through rough surfaces* (2007), eqs. 16 to 21; masking
//! and shadowing of both kinds of light by the height-correlated G2 of Pharr, Jakob & Humphreys (2023), section 9.7;
//! Kulla & Conty (2017) for the compensation. Not for sheets without an inside: see the thin dielectric.

use super::dielectric_tables::{DielectricCompensation, DielectricTables, Side};
use super::energy::{self, MAX_SINGLE_SHARE};
use super::microfacets::Microfacets;
use super::mirror::reflect_about_normal;
use super::warp::GrazingHemisphere;
use super::{BsdfEvaluation, BsdfSample, Lobe, fresnel, turn, warp};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// An index closer to 1 than this bends light by less than the smallest roughness does, so the boundary is smooth; the
/// half-way vector of refraction would be lost in rounding.
const MIN_INDEX_STEP: f32 = 1e-3;

/// Boundary of a clear volume.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric<'a> {
    eta_inside_over_outside: f32,
    transmittance: Vec3,
    facets: Option<Facets<'a>>,
}

/// What makes a boundary rough.
#[derive(Clone, Copy, Debug)]
struct Facets<'a> {
    microfacets: Microfacets,
    grazing: GrazingHemisphere,
    tables: Option<&'a DielectricTables>,
}

/// The boundary as seen from the side that the path is on, with that side turned up.
#[derive(Clone, Copy, Debug)]
struct Near<'a> {
    wo: Vec3,
    /// Index on the far side over the index on the path's side.
    eta: f32,
    tint: Vec3,
    microfacets: Microfacets,
    grazing: GrazingHemisphere,
    compensation: Option<DielectricCompensation<'a>>,
    /// Probability that a sample is one event at a facet.
    single_share: f32,
    /// Probability that a sample of the compensation is a reflection.
    compensation_reflects: f32,
}

impl<'a> Dielectric<'a> {
    /// Index inside over outside, the surface's facets, tint of each crossing in [0, 1], and the tables of the
    /// same index and distribution.
    pub fn new(
        eta_inside_over_outside: f32,
        microfacets: Microfacets,
        transmittance: Vec3,
        tables: Option<&'a DielectricTables>,
    ) -> Self {
        let bends = (eta_inside_over_outside - 1.0).abs() >= MIN_INDEX_STEP;
        Self {
            eta_inside_over_outside,
            transmittance,
            facets: microfacets.rough().filter(|_| bends).map(|microfacets| Facets {
                microfacets,
                grazing: GrazingHemisphere::new(microfacets.mean_alpha()),
                tables,
            }),
        }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.facets.is_some()
    }

    /// Index on the far side over the index on `wo`'s side.
    fn eta_from(&self, wo: Vec3) -> f32 {
        if wo.z > 0.0 { self.eta_inside_over_outside } else { 1.0 / self.eta_inside_over_outside }
    }

    fn near(&self, facets: &Facets<'a>, wo: Vec3) -> Near<'a> {
        let (side, up) = if wo.z > 0.0 { (Side::Outside, wo) } else { (Side::Inside, turn(wo)) };
        let compensation = facets.tables.map(|tables| tables.compensation(&facets.microfacets, side));
        let single_share = compensation.map_or(1.0, |c| (1.0 - c.near.at(up)).clamp(0.05, MAX_SINGLE_SHARE));
        let compensation_reflects = compensation.map_or(0.0, |c| {
            let reflected = 1.0 - c.transmitted_share;
            reflected / (reflected + c.transmitted_share * self.transmittance.max_element())
        });
        Near {
            wo: up,
            eta: self.eta_from(wo),
            tint: self.transmittance,
            microfacets: facets.microfacets,
            grazing: facets.grazing,
            compensation,
            single_share,
            compensation_reflects,
        }
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        match &self.facets {
            Some(facets) if wo.z != 0.0 => {
                let wi = if wo.z > 0.0 { wi } else { turn(wi) };
                self.near(facets, wo).evaluate(wi)
            }
            _ => BsdfEvaluation::BLACK,
        }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        match &self.facets {
            None => self.sample_smooth(wo, u[2]),
            Some(facets) => {
                let near = self.near(facets, wo);
                let wi = near.choose(u)?;
                let sample = near.evaluate(wi).into_sample(wi)?.turned_like(wo);
                let crossed_index = sample.lobe.is_transmission().then_some(near.eta);
                Some(BsdfSample { crossed_index, ..sample })
            }
        }
    }

    fn sample_smooth(&self, wo: Vec3, u: f32) -> Option<BsdfSample> {
        let eta = self.eta_from(wo);
        let boundary = fresnel::dielectric(wo.z.abs(), eta);
        let transmitted = (1.0 - boundary.reflectance) * self.transmittance;
        let probability = reflection_probability(boundary.reflectance, self.transmittance);
        if u < probability {
            let weight = Vec3::splat(boundary.reflectance / probability);
            return Some(BsdfSample::reflected_delta(reflect_about_normal(wo), weight, probability));
        }
        let pdf = 1.0 - probability;
        let wi = Vec3::new(-wo.x / eta, -wo.y / eta, -boundary.cos_transmitted.copysign(wo.z)).normalize();
        (pdf > 0.0 && wi.z != 0.0).then(|| BsdfSample {
            wi,
            weight: transmitted / (pdf * eta * eta),
            pdf,
            lobe: Lobe::DeltaTransmission,
            crossed_index: Some(eta),
        })
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let reflectance = fresnel::dielectric(wo.z.abs(), self.eta_from(wo)).reflectance;
        Vec3::splat(reflectance) + (1.0 - reflectance) * self.transmittance
    }
}

impl Near<'_> {
    /// A direction by one of the lobes, `None` where the facet sends it to a side that it cannot reach.
    fn choose(&self, u: [f32; 3]) -> Option<Vec3> {
        let warp::Choice { is_taken: scatters_once, rest } = warp::choose(u[2], self.single_share);
        if !scatters_once {
            let wi = self.grazing.sample([u[0], u[1]]);
            return Some(if rest < self.compensation_reflects { wi } else { turn(wi) });
        }
        let m = self.microfacets.sample_visible(self.wo, [u[0], u[1]]);
        let cos = self.wo.dot(m).max(0.0);
        let boundary = fresnel::dielectric(cos, self.eta);
        if rest < reflection_probability(boundary.reflectance, self.tint) {
            let wi = 2.0 * cos * m - self.wo;
            (wi.z > 0.0).then_some(wi)
        } else {
            let wi = m * (cos / self.eta - boundary.cos_transmitted) - self.wo / self.eta;
            (wi.z < 0.0 && boundary.cos_transmitted > 0.0).then(|| wi.normalize())
        }
    }

    fn evaluate(&self, wi: Vec3) -> BsdfEvaluation {
        if wi.z > 0.0 {
            self.evaluate_reflection(wi)
        } else if wi.z < 0.0 {
            self.evaluate_transmission(wi)
        } else {
            BsdfEvaluation::BLACK
        }
    }

    fn evaluate_reflection(&self, wi: Vec3) -> BsdfEvaluation {
        let wo = self.wo;
        let facet = self.microfacets.reflect(wo, wi);
        let reflectance = fresnel::dielectric(facet.cos_half, self.eta).reflectance;
        let single = reflectance * facet.value;
        let single_pdf = reflection_probability(reflectance, self.tint) * facet.pdf;
        let multiple =
            self.compensation.map_or(0.0, |c| (1.0 - c.transmitted_share) * energy::missing_lobe(&c.near, wo, wi));
        let multiple_pdf = self.compensation_reflects * self.grazing.pdf(wi.z);
        BsdfEvaluation {
            value: Vec3::splat(single + multiple),
            pdf: self.single_share * single_pdf + (1.0 - self.single_share) * multiple_pdf,
        }
    }

    fn evaluate_transmission(&self, wi: Vec3) -> BsdfEvaluation {
        let (single, single_pdf) = self.single_transmission(wi);
        // Energy that arrives on the far side, times 1/η² to become radiance.
        let multiple = self.compensation.map_or(0.0, |c| {
            let lobe = c.near.at(self.wo) * c.far.at(turn(wi)) / c.far.missing_average();
            c.transmitted_share * lobe * -wi.z * FRAC_1_PI / (self.eta * self.eta)
        });
        let multiple_pdf = (1.0 - self.compensation_reflects) * self.grazing.pdf(-wi.z);
        BsdfEvaluation {
            value: self.tint * (single + multiple),
            pdf: self.single_share * single_pdf + (1.0 - self.single_share) * multiple_pdf,
        }
    }

    /// Value without tint, and pdf, of light refracted by one facet (Walter et al. 2007, eqs. 17 and 21).
    fn single_transmission(&self, wi: Vec3) -> (f32, f32) {
        let wo = self.wo;
        let half = (wo + self.eta * wi).normalize_or(Vec3::Z);
        let h = if half.z < 0.0 { -half } else { half };
        let cos_o = wo.dot(h);
        let cos_i = wi.dot(h);
        if cos_o <= 0.0 || cos_i >= 0.0 {
            return (0.0, 0.0);
        }
        let reflectance = fresnel::dielectric(cos_o, self.eta).reflectance;
        let root = cos_o + self.eta * cos_i;
        // Facet steradians per steradian of wi.
        let jacobian = self.eta * self.eta * -cos_i / (root * root);
        let up = turn(wi);
        let value = (1.0 - reflectance)
            * self.microfacets.density(h)
            * self.microfacets.visibility(wo, up)
            * 4.0
            * up.z
            * cos_o
            * jacobian
            / (self.eta * self.eta);
        let pdf = (1.0 - reflection_probability(reflectance, self.tint))
            * self.microfacets.visible_density_over_cosine(wo, h)
            * cos_o
            * jacobian;
        (value, pdf)
    }
}

/// Probability of following the reflected ray: its share of the energy in the brightest channel.
fn reflection_probability(reflectance: f32, tint: Vec3) -> f32 {
    let transmitted = (1.0 - reflectance) * tint.max_element();
    let total = reflectance + transmitted;
    // With nothing to follow (an index of 1 and a black tint) either answer is right.
    if total > 0.0 { reflectance / total } else { 1.0 }
}
