//! The material of glTF 2.0: a mix of a metal and of a dielectric coat over a diffuse base, with the extensions for the
//! index of refraction and for thin transmission.
//!
//! Parameters: `base_color` per linear RGB channel in [0, 1] (reflectance of the metal at normal incidence, albedo of the
//! base); `metallic` in [0, 1]; `roughness` in [0, 1], perceptual; `ior` of the dielectric, at least 1, or 0 for a coat
//! that reflects everything, as the extension defines; `transmission` in [0, 1], the share of what passes the coat that goes straight through instead of being
//! scattered back, tinted by `base_color`, blurred like the reflection.
//!
//! Sources: Khronos Group, *glTF 2.0* (2021), appendix B, with KHR_materials_ior and KHR_materials_transmission; the base
//! is coupled to the coat as Kelemen & Szirmay-Kalos (2001), eq. 5, and Kulla & Conty (2017), so that no light is lost:
//! the base sees (1 − E(μo))(1 − E(μi))/(π(1 − E_avg)) with E the coat's albedo, where the specification's own sample code
//! uses 1 − F(h) and is not lossless. Not for metals by measured index, nor for glass with an inside.

use super::albedo_table::AlbedoCurve;
use super::energy::{self, ReflectionTables, SchlickCurve};
use super::fresnel::{SCHLICK_AVERAGE, normal_reflectance, schlick_weight};
use super::microfacets::Microfacets;
use super::mirror::reflect_about_normal;
use super::warp::GrazingHemisphere;
use super::{BsdfEvaluation, BsdfSample, Lobe, SMALLEST_ALPHA, to_front, turn, warp};
use crate::scene::Distribution;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// The metal-roughness material of glTF 2.0.
#[derive(Clone, Copy, Debug)]
pub struct MetalRoughness {
    /// Reflectance at normal incidence of metal and coat together.
    f0: Vec3,
    /// Reflectance at normal incidence of the dielectric's coat alone.
    coat_f0: f32,
    /// Albedo of the base, with the metal's share and the transmitted share taken out.
    diffuse: Vec3,
    /// The same for what goes through.
    transmitted: Vec3,
    /// 1 − the coat's average albedo.
    base_average: f32,
    /// None if perfectly smooth.
    facets: Option<Facets>,
}

#[derive(Clone, Copy, Debug)]
struct Facets {
    ggx: Microfacets,
    grazing: GrazingHemisphere,
    missing: AlbedoCurve<'static>,
    schlick: SchlickCurve,
    /// Tint of light that bounced twice or more, metal and coat together.
    tint: Vec3,
    /// The same of the coat alone.
    coat_tint: f32,
}

/// Directional albedos at one direction.
#[derive(Clone, Copy, Debug)]
struct Albedos {
    /// One bounce, metal and coat together.
    specular: Vec3,
    /// Two or more bounces, metal and coat together.
    multiple: Vec3,
    /// Coat alone, all bounces.
    coat: f32,
    /// What passes the coat at a single facet, per unit of transmitted colour.
    through_single: f32,
    /// What passes the coat after several bounces.
    through_multiple: f32,
}

/// Probabilities of the lobes; they sum to 1.
#[derive(Clone, Copy, Debug)]
struct Shares {
    specular: f32,
    multiple: f32,
    diffuse: f32,
    through_single: f32,
    through_multiple: f32,
}

/// A lobe to sample.
#[derive(Clone, Copy, Debug)]
enum Choice {
    /// One bounce off a facet.
    Specular,
    /// Several.
    Multiple,
    /// The base.
    Diffuse,
    /// Through one facet.
    ThroughSingle,
    /// Through after several bounces.
    ThroughMultiple,
}

impl Shares {
    fn choose(&self, u: f32) -> Choice {
        let choices = [
            (self.specular, Choice::Specular),
            (self.multiple, Choice::Multiple),
            (self.diffuse, Choice::Diffuse),
            (self.through_single, Choice::ThroughSingle),
            (self.through_multiple, Choice::ThroughMultiple),
        ];
        let mut left = u;
        let mut last = Choice::Specular;
        for (share, choice) in choices {
            if share > 0.0 {
                if left < share {
                    return choice;
                }
                last = choice;
            }
            left -= share;
        }
        // Rounding left a crumb over: it belongs to the last lobe that there is.
        last
    }
}

impl MetalRoughness {
    /// The parameters as in the file's head.
    pub fn new(base_color: Vec3, metallic: f32, roughness: f32, ior: f32, transmission: f32) -> Self {
        let metallic = metallic.clamp(0.0, 1.0);
        let transmission = transmission.clamp(0.0, 1.0);
        let roughness = roughness.clamp(0.0, 1.0);
        let alpha = roughness * roughness;
        let coat_f0 = normal_reflectance(ior);
        let facets = (alpha >= SMALLEST_ALPHA).then(|| Facets::new(roughness, base_color, metallic, coat_f0));
        let coat_average = match &facets {
            None => coat_f0 + (1.0 - coat_f0) * SCHLICK_AVERAGE,
            Some(facets) => facets.coat_albedo(coat_f0, facets.missing.average(), facets.schlick.average()),
        };
        let base = base_color * (1.0 - metallic);
        Self {
            f0: Vec3::splat(coat_f0).lerp(base_color, metallic),
            coat_f0,
            diffuse: base * (1.0 - transmission),
            transmitted: base * transmission,
            base_average: (1.0 - coat_average).max(1e-7),
            facets,
        }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.facets.is_some() || self.diffuse != Vec3::ZERO
    }

    fn albedos(&self, cos: f32) -> Albedos {
        match &self.facets {
            None => {
                let weight = schlick_weight(cos);
                let coat = self.coat_f0 + (1.0 - self.coat_f0) * weight;
                Albedos {
                    specular: self.f0 + (Vec3::ONE - self.f0) * weight,
                    multiple: Vec3::ZERO,
                    coat,
                    through_single: 1.0 - coat,
                    through_multiple: 0.0,
                }
            }
            Some(facets) => {
                let missing = facets.missing.at(cos);
                let schlick = facets.schlick.at(cos);
                Albedos {
                    specular: self.f0 * (1.0 - missing) + (Vec3::ONE - self.f0) * schlick,
                    multiple: facets.tint * missing,
                    coat: facets.coat_albedo(self.coat_f0, missing, schlick),
                    through_single: ((1.0 - self.coat_f0) * (1.0 - missing - schlick)).max(0.0),
                    through_multiple: missing * (1.0 - facets.coat_tint),
                }
            }
        }
    }

    fn shares(&self, albedos: &Albedos) -> Option<Shares> {
        let through = self.transmitted.max_element();
        let specular = albedos.specular.max_element();
        let multiple = albedos.multiple.max_element();
        let diffuse = self.diffuse.max_element() * (1.0 - albedos.coat);
        let through_single = through * albedos.through_single;
        let through_multiple = through * albedos.through_multiple;
        let total = specular + multiple + diffuse + through_single + through_multiple;
        (total > 0.0).then(|| Shares {
            specular: specular / total,
            multiple: multiple / total,
            diffuse: diffuse / total,
            through_single: through_single / total,
            through_multiple: through_multiple / total,
        })
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        if wo.z <= 0.0 {
            return BsdfEvaluation::BLACK;
        }
        let near = self.albedos(wo.z);
        match self.shares(&near) {
            Some(shares) => self.evaluate_front(&near, &shares, wo, wi),
            None => BsdfEvaluation::BLACK,
        }
    }

    fn evaluate_front(&self, near: &Albedos, shares: &Shares, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        if wi.z > 0.0 {
            self.evaluate_reflection(near, shares, wo, wi)
        } else if wi.z < 0.0 {
            self.evaluate_transmission(shares, wo, turn(wi))
        } else {
            BsdfEvaluation::BLACK
        }
    }

    fn evaluate_reflection(&self, near: &Albedos, shares: &Shares, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let far = self.albedos(wi.z);
        let base = (1.0 - near.coat) * (1.0 - far.coat) * wi.z * FRAC_1_PI / self.base_average;
        let mut value = self.diffuse * base;
        let mut pdf = shares.diffuse * warp::cosine_hemisphere_pdf(wi.z);
        if let Some(facets) = &self.facets {
            let facet = facets.reflect(wo, wi);
            let fresnel = self.f0 + (Vec3::ONE - self.f0) * facet.schlick;
            value += fresnel * facet.value + facets.tint * facets.missing_lobe(wo.z, wi.z);
            pdf += shares.specular * facet.pdf + shares.multiple * facets.grazing.pdf(wi.z);
        }
        BsdfEvaluation { value, pdf }
    }

    /// Light that goes through, with `wi` already mirrored to the upper side: the facets' reflection lobe, upside down,
    /// with what they do not reflect.
    fn evaluate_transmission(&self, shares: &Shares, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let Some(facets) = &self.facets else {
            return BsdfEvaluation::BLACK;
        };
        let facet = facets.reflect(wo, wi);
        let passed = (1.0 - self.coat_f0) * (1.0 - facet.schlick);
        let multiple = (1.0 - facets.coat_tint) * facets.missing_lobe(wo.z, wi.z);
        BsdfEvaluation {
            value: self.transmitted * (passed * facet.value + multiple),
            pdf: shares.through_single * facet.pdf + shares.through_multiple * facets.grazing.pdf(wi.z),
        }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let front = if wo.z < 0.0 { turn(wo) } else { wo };
        if front.z <= 0.0 {
            return None;
        }
        let near = self.albedos(front.z);
        let shares = self.shares(&near)?;
        let choice = shares.choose(u[2]);
        let through = matches!(choice, Choice::ThroughSingle | Choice::ThroughMultiple);
        let up = match (choice, &self.facets) {
            (Choice::Diffuse, _) => warp::cosine_hemisphere([u[0], u[1]]),
            (_, None) => return Some(self.sample_smooth(&near, &shares, wo, through)),
            (Choice::Multiple | Choice::ThroughMultiple, Some(facets)) => facets.grazing.sample([u[0], u[1]]),
            (Choice::Specular | Choice::ThroughSingle, Some(facets)) => {
                let m = facets.ggx.sample_visible(front, [u[0], u[1]]);
                2.0 * front.dot(m) * m - front
            }
        };
        if up.z <= 0.0 {
            return None;
        }
        let wi = if through { turn(up) } else { up };
        self.evaluate_front(&near, &shares, front, wi).sample_turned(wi, wo)
    }

    /// The delta lobes of a perfectly smooth coat.
    fn sample_smooth(&self, near: &Albedos, shares: &Shares, wo: Vec3, through: bool) -> BsdfSample {
        if through {
            BsdfSample {
                wi: -wo,
                weight: self.transmitted * (near.through_single / shares.through_single),
                pdf: shares.through_single,
                lobe: Lobe::DeltaTransmission,
                crossed_index: None,
            }
        } else {
            BsdfSample {
                wi: reflect_about_normal(wo),
                weight: near.specular / shares.specular,
                pdf: shares.specular,
                lobe: Lobe::Delta,
                crossed_index: None,
            }
        }
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let near = self.albedos(wo.z.abs());
        near.specular + near.multiple + (self.diffuse + self.transmitted) * (1.0 - near.coat)
    }
}

/// One bounce off a facet that reflects everything.
struct FacetReflection {
    /// D·G2/(4 cos θo), the cosine of wi included.
    value: f32,
    /// Pdf of choosing wi by a visible normal.
    pdf: f32,
    /// Schlick's weight at the facet.
    schlick: f32,
}

impl Facets {
    fn new(roughness: f32, base_color: Vec3, metallic: f32, coat_f0: f32) -> Self {
        let alpha = roughness * roughness;
        let missing = ReflectionTables::of(Distribution::Ggx).missing.curve(roughness);
        let average = |f0: Vec3| f0 + (Vec3::ONE - f0) * SCHLICK_AVERAGE;
        let tint = |f0: Vec3| energy::multiple_bounce_tint(average(f0), 1.0 - missing.average());
        let coat_tint = tint(Vec3::splat(coat_f0));
        Self {
            ggx: Microfacets::isotropic(alpha, Distribution::Ggx),
            grazing: GrazingHemisphere::new(alpha),
            missing,
            schlick: SchlickCurve::new(roughness),
            tint: coat_tint.lerp(tint(base_color), metallic),
            coat_tint: coat_tint.x,
        }
    }

    /// Albedo of the coat, all bounces, from the tabulated albedos at one direction or from their averages.
    fn coat_albedo(&self, coat_f0: f32, missing: f32, schlick: f32) -> f32 {
        coat_f0 * (1.0 - missing) + (1.0 - coat_f0) * schlick + self.coat_tint * missing
    }

    fn missing_lobe(&self, cos_o: f32, cos_i: f32) -> f32 {
        self.missing.at(cos_o) * self.missing.at(cos_i) * cos_i * FRAC_1_PI / self.missing.average().max(1e-9)
    }

    fn reflect(&self, wo: Vec3, wi: Vec3) -> FacetReflection {
        let h = (wo + wi).normalize_or(Vec3::Z);
        FacetReflection {
            value: self.ggx.density(h) * self.ggx.visibility(wo, wi) * wi.z,
            pdf: 0.25 * self.ggx.visible_density_over_cosine(wo, h),
            schlick: schlick_weight(wo.dot(h)),
        }
    }
}
