//! The material of glTF 2.0: a mix of a metal and of a dielectric coat over a diffuse base, with the extensions for the
//! index of refraction and for thin transmission.
//!
//! Parameters: `base_color` per linear RGB channel in [0, 1] (reflectance of the metal at normal incidence, albedo of
//! the base); `metallic` in [0, 1]; `roughness` in [0, 1], perceptual; `ior` of the dielectric, at least 1, or 0 for a
//! coat that reflects everything, as the extension defines; `transmission` in [0, 1], the share of what passes the coat
//! that goes straight through instead of being scattered back, tinted by `base_color`, blurred like the reflection.
//!
//! Sources: Khronos Group, *glTF 2.0* (2021), appendix B, with KHR_materials_ior and KHR_materials_transmission; the
//! base is coupled to the coat as Kelemen & Szirmay-Kalos (2001), eq. 5, and Kulla & Conty (2017), so that no light is
//! lost: the base sees (1 − E(μo))(1 − E(μi))/(π(1 − E_avg)) with E the coat's albedo, where the specification's own
//! sample code uses 1 − F(h) and is not lossless. Not for metals by measured index, nor for glass with an inside.

use super::energy::{self, SchlickAlbedo, SchlickCurves};
use super::fresnel::{SCHLICK_AVERAGE, normal_reflectance, schlick_weight};
use super::microfacets::Microfacets;
use super::mirror::reflect_about_normal;
use super::warp::GrazingHemisphere;
use super::{BsdfEvaluation, BsdfSample, Lobe, to_front, turn, warp};
use crate::scene::Distribution;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Parameters of the model, resolved at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetalRoughnessParameters {
    /// Reflectance of the metal at normal incidence and albedo of the base, per channel in [0, 1].
    pub base_color: Vec3,
    /// Share of the metal in [0, 1].
    pub metallic: f32,
    /// Perceptual roughness in [0, 1].
    pub roughness: f32,
    /// Stretch of the facets along the tangent, in [0, 1]: α there is lerp(α, 1, anisotropy²).
    pub anisotropy: f32,
    /// Index of refraction of the dielectric, at least 1, or 0 for one that reflects everything.
    pub ior: f32,
    /// Strength of the dielectric's reflection in [0, 1].
    pub specular: f32,
    /// Tint of the dielectric's reflection at normal incidence, at least 0.
    pub specular_color: Vec3,
    /// Share in [0, 1] of what passes the dielectric that goes straight through.
    pub transmission: f32,
}

impl Default for MetalRoughnessParameters {
    fn default() -> Self {
        Self {
            base_color: Vec3::ONE,
            metallic: 0.0,
            roughness: 0.5,
            anisotropy: 0.0,
            ior: 1.5,
            specular: 1.0,
            specular_color: Vec3::ONE,
            transmission: 0.0,
        }
    }
}

/// The metal-roughness material of glTF 2.0.
#[derive(Clone, Copy, Debug)]
pub struct MetalRoughness {
    /// Reflectance of metal and coat together, face on and at grazing angles.
    both: Schlick,
    /// The dielectric's coat alone, in the channel in which it reflects most.
    coat: CoatSchlick,
    /// Albedo of the base, with the metal's share and the transmitted share taken out.
    diffuse: Vec3,
    /// The same for what goes through.
    transmitted: Vec3,
    /// 1 − the coat's average albedo.
    base_average: f32,
    /// None if perfectly smooth.
    facets: Option<Facets>,
}

/// Schlick's reflectance: from `f0` face on to `f90` at grazing angles.
#[derive(Clone, Copy, Debug)]
struct Schlick {
    f0: Vec3,
    f90: f32,
}

/// The same for one channel.
#[derive(Clone, Copy, Debug)]
struct CoatSchlick {
    f0: f32,
    f90: f32,
}

impl Schlick {
    fn at(&self, weight: f32) -> Vec3 {
        self.f0 + (Vec3::splat(self.f90) - self.f0) * weight
    }

    fn average(&self) -> Vec3 {
        self.at(SCHLICK_AVERAGE)
    }
}

impl CoatSchlick {
    fn at(&self, weight: f32) -> f32 {
        self.f0 + (self.f90 - self.f0) * weight
    }
}

#[derive(Clone, Copy, Debug)]
struct Facets {
    microfacets: Microfacets,
    grazing: GrazingHemisphere,
    curves: SchlickCurves,
    /// Tint of light that bounced twice or more, metal and coat together.
    tint: Vec3,
    /// The same of the coat alone.
    coat_tint: f32,
    /// 1/(π × average of what one bounce loses).
    missing_norm: f32,
}

/// Directional albedos at one direction.
#[derive(Clone, Copy, Debug)]
struct Albedos {
    /// One bounce, metal and coat together.
    specular: Vec3,
    /// What one bounce loses off facets that reflect everything.
    missing: f32,
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
struct LobeProbabilities {
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

impl Choice {
    fn goes_through(self) -> bool {
        match self {
            Self::ThroughSingle | Self::ThroughMultiple => true,
            Self::Specular | Self::Multiple | Self::Diffuse => false,
        }
    }
}

impl LobeProbabilities {
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
    /// The model of such parameters.
    pub fn new(parameters: &MetalRoughnessParameters) -> Self {
        let MetalRoughnessParameters { base_color, ior, .. } = *parameters;
        let metallic = parameters.metallic.clamp(0.0, 1.0);
        let transmission = parameters.transmission.clamp(0.0, 1.0);
        let specular = parameters.specular.clamp(0.0, 1.0);
        let f0 = (normal_reflectance(ior) * parameters.specular_color).min(Vec3::ONE) * specular;
        let dielectric = Schlick { f0, f90: specular };
        let metal = Schlick { f0: base_color, f90: 1.0 };
        let coat = CoatSchlick { f0: f0.max_element(), f90: specular };
        let facets = Facets::new(parameters, metallic, &dielectric, &metal);
        let coat_average = match &facets {
            None => coat.at(SCHLICK_AVERAGE),
            Some(facets) => facets.coat_albedo(&coat, &facets.curves.averages()),
        };
        let base = base_color * (1.0 - metallic);
        Self {
            both: Schlick {
                f0: dielectric.f0.lerp(metal.f0, metallic),
                f90: dielectric.f90 + (metal.f90 - dielectric.f90) * metallic,
            },
            coat,
            diffuse: base * (1.0 - transmission),
            transmitted: base * transmission,
            base_average: (1.0 - coat_average).max(1e-7),
            facets,
        }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.facets.is_some() || self.diffuse != Vec3::ZERO
    }

    fn albedos(&self, w: Vec3) -> Albedos {
        match &self.facets {
            None => {
                let weight = schlick_weight(w.z);
                let coat = self.coat.at(weight);
                Albedos {
                    specular: self.both.at(weight),
                    missing: 0.0,
                    multiple: Vec3::ZERO,
                    coat,
                    through_single: 1.0 - coat,
                    through_multiple: 0.0,
                }
            }
            Some(facets) => {
                let albedo = facets.curves.at(w);
                let SchlickAlbedo { missing, schlick } = albedo;
                let kept = 1.0 - missing;
                Albedos {
                    specular: self.both.f0 * kept + (Vec3::splat(self.both.f90) - self.both.f0) * schlick,
                    missing,
                    multiple: facets.tint * missing,
                    coat: facets.coat_albedo(&self.coat, &albedo),
                    through_single: (kept - self.coat.f0 * kept - (self.coat.f90 - self.coat.f0) * schlick).max(0.0),
                    through_multiple: missing * (1.0 - facets.coat_tint),
                }
            }
        }
    }

    fn shares(&self, albedos: &Albedos) -> Option<LobeProbabilities> {
        let through = self.transmitted.max_element();
        let specular = albedos.specular.max_element();
        let multiple = albedos.multiple.max_element();
        let diffuse = self.diffuse.max_element() * (1.0 - albedos.coat);
        let through_single = through * albedos.through_single;
        let through_multiple = through * albedos.through_multiple;
        let total = specular + multiple + diffuse + through_single + through_multiple;
        (total > 0.0).then(|| LobeProbabilities {
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
        let near = self.albedos(wo);
        match self.shares(&near) {
            Some(shares) => self.evaluate_front(&near, &shares, wo, wi),
            None => BsdfEvaluation::BLACK,
        }
    }

    fn evaluate_front(&self, near: &Albedos, shares: &LobeProbabilities, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        if wi.z > 0.0 {
            self.evaluate_reflection(near, shares, wo, wi)
        } else if wi.z < 0.0 {
            self.evaluate_transmission(near, shares, wo, turn(wi))
        } else {
            BsdfEvaluation::BLACK
        }
    }

    fn evaluate_reflection(&self, near: &Albedos, shares: &LobeProbabilities, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let far = self.albedos(wi);
        let base = (1.0 - near.coat) * (1.0 - far.coat) * wi.z * FRAC_1_PI / self.base_average;
        let mut value = self.diffuse * base;
        let mut pdf = shares.diffuse * warp::cosine_hemisphere_pdf(wi.z);
        if let Some(facets) = &self.facets {
            let facet = facets.microfacets.reflect(wo, wi);
            let multiple = near.missing * far.missing * wi.z * facets.missing_norm;
            value += self.both.at(schlick_weight(facet.cos_half)) * facet.value + facets.tint * multiple;
            pdf += shares.specular * facet.pdf + shares.multiple * facets.grazing.pdf(wi.z);
        }
        BsdfEvaluation { value, pdf }
    }

    /// Light that goes through, with `wi` already mirrored to the upper side: the facets' reflection lobe, upside down,
    /// with what they do not reflect.
    fn evaluate_transmission(&self, near: &Albedos, shares: &LobeProbabilities, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let Some(facets) = &self.facets else {
            return BsdfEvaluation::BLACK;
        };
        let facet = facets.microfacets.reflect(wo, wi);
        let passed = 1.0 - self.coat.at(schlick_weight(facet.cos_half));
        let missing = facets.curves.at(wi).missing;
        let multiple = (1.0 - facets.coat_tint) * near.missing * missing * wi.z * facets.missing_norm;
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
        let near = self.albedos(front);
        let shares = self.shares(&near)?;
        let choice = shares.choose(u[2]);
        let up = match (choice, &self.facets) {
            (Choice::Diffuse, _) => warp::cosine_hemisphere([u[0], u[1]]),
            (_, None) => return Some(self.sample_smooth(&near, &shares, wo, choice)),
            (Choice::Multiple | Choice::ThroughMultiple, Some(facets)) => facets.grazing.sample([u[0], u[1]]),
            (Choice::Specular | Choice::ThroughSingle, Some(facets)) => {
                facets.microfacets.sample_reflection(front, [u[0], u[1]])?
            }
        };
        let wi = if choice.goes_through() { turn(up) } else { up };
        self.evaluate_front(&near, &shares, front, wi).sample_turned(wi, wo)
    }

    /// The delta lobes of a perfectly smooth coat.
    fn sample_smooth(&self, near: &Albedos, shares: &LobeProbabilities, wo: Vec3, choice: Choice) -> BsdfSample {
        if choice.goes_through() {
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

    pub(super) fn straight_through(&self, wo: Vec3) -> Vec3 {
        match self.facets {
            Some(_) => Vec3::ZERO,
            None => self.transmitted * self.albedos(to_front(wo, wo).0).through_single,
        }
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let (up, _) = to_front(wo, wo);
        let near = self.albedos(up);
        near.specular + near.multiple + (self.diffuse + self.transmitted) * (1.0 - near.coat)
    }
}

impl Facets {
    /// `None` where the surface is smooth.
    fn new(
        parameters: &MetalRoughnessParameters,
        metallic: f32,
        dielectric: &Schlick,
        metal: &Schlick,
    ) -> Option<Self> {
        let roughness = parameters.roughness.clamp(0.0, 1.0);
        let alpha = roughness * roughness;
        let stretch = parameters.anisotropy.clamp(0.0, 1.0).powi(2);
        let microfacets = Microfacets::new(alpha + (1.0 - alpha) * stretch, alpha, Distribution::Ggx).rough()?;
        let curves = SchlickCurves::new(&microfacets);
        let missing = curves.averages().missing;
        let tint = |schlick: &Schlick| energy::multiple_bounce_tint(schlick.average(), 1.0 - missing);
        let coat_tint = tint(dielectric);
        Some(Self {
            microfacets,
            grazing: GrazingHemisphere::new(microfacets.mean_alpha()),
            curves,
            tint: coat_tint.lerp(tint(metal), metallic),
            coat_tint: coat_tint.max_element(),
            missing_norm: FRAC_1_PI / missing.max(1e-9),
        })
    }

    /// Albedo of the coat, all bounces, from the tabulated albedos at one direction or from their averages.
    fn coat_albedo(&self, coat: &CoatSchlick, albedo: &SchlickAlbedo) -> f32 {
        coat.f0 * (1.0 - albedo.missing) + (coat.f90 - coat.f0) * albedo.schlick + self.coat_tint * albedo.missing
    }
}
