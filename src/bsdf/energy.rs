//! Tables of the light that single scattering off microfacets keeps, and what is needed to give the rest back.
//!
//! A microfacet model follows light to its first facet only; what the shadowing term removes has in truth gone on to
//! another facet. Kulla & Conty add a diffuse-like lobe of exactly the missing energy,
//! (1 − E(μo))(1 − E(μi)) / (π(1 − E_avg)), where E(μ) is the directional albedo of single scattering at incident cosine
//! μ and E_avg = 2∫E(μ)μ dμ: reciprocal by its symmetry and lossless by its norm, whatever the interpolation error of
//! the table at μi.
//!
//! Sources: C. Kulla & A. Conty, *Revisiting physically based shading at Imageworks* (SIGGRAPH course 2017), the
//! compensation, its tint and the split for dielectrics; C. Kelemen & L. Szirmay-Kalos (2001) for the form; S. Hill, *A
//! multi-faceted exploration* (2018) for the tint's squared F_avg. The tables are computed here, by quadrature over visible normals.

use super::albedo_table::{AlbedoCurve, AlbedoTable, DirectionalCurve, average_over_visible_normals, direction_at};
use super::fresnel;
use super::microfacets::Microfacets;
use crate::scene::Distribution;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use std::sync::LazyLock;

/// Most of the samples that may go to single scattering. The rest keeps the compensation reachable where the energy
/// that it gives back is too small for single precision to tell 1 − E from 0.
pub(crate) const LARGEST_SINGLE_SHARE: f32 = 0.9999;

/// Kulla and Conty's lobe without its tint, times cos θi: the light that single scattering loses, given by `missing` = 1 − E.
pub(crate) fn missing_lobe(missing: &DirectionalCurve<'_>, wo: Vec3, wi: Vec3) -> f32 {
    missing.at(wo) * missing.at(wi) * wi.z * FRAC_1_PI / missing.missing_average()
}

/// Tint of light that bounced off two or more facets of average reflectance `fresnel`; 1 for a lossless metal.
pub(crate) fn multiple_bounce_tint(fresnel: Vec3, albedo_average: f32) -> Vec3 {
    fresnel * fresnel * albedo_average / (Vec3::ONE - fresnel * (1.0 - albedo_average))
}

/// What reflection off facets keeps after one bounce.
pub(crate) struct ReflectionTables {
    /// 1 − E, of facets that reflect everything.
    pub(crate) missing: AlbedoTable,
    /// Albedo of facets that reflect Schlick's (1 − wo·h)⁵, less (1 − μ)⁵: what is left is smooth even where the columns
    /// are wide apart. See [`SchlickCurve`].
    pub(crate) schlick: AlbedoTable,
}

impl ReflectionTables {
    /// The tables of a distribution, made on first use.
    pub(crate) fn of(distribution: Distribution) -> &'static Self {
        match distribution {
            Distribution::Ggx => &GGX,
            Distribution::Beckmann => &BECKMANN,
        }
    }

    fn new(distribution: Distribution) -> Self {
        let reflect_with = |quantity: fn(f32, f32, f32) -> f32| {
            AlbedoTable::new(move |mu, alpha| {
                let facets = Microfacets::isotropic(alpha, distribution);
                let wo = direction_at(mu);
                average_over_visible_normals(&facets, wo, |m| quantity(wo.dot(m), mu, reflected(&facets, wo, m)))
            })
        };
        Self {
            missing: reflect_with(|_, _, unshadowed| 1.0 - unshadowed),
            schlick: reflect_with(|cos, mu, unshadowed| {
                fresnel::schlick_weight(cos) * unshadowed - fresnel::schlick_weight(mu)
            }),
        }
    }
}

static GGX: LazyLock<ReflectionTables> = LazyLock::new(|| ReflectionTables::new(Distribution::Ggx));
static BECKMANN: LazyLock<ReflectionTables> = LazyLock::new(|| ReflectionTables::new(Distribution::Beckmann));

/// Albedo of facets that reflect Schlick's (1 − wo·h)⁵ at one roughness: the part S of a GGX lobe's albedo
/// F0·E + (1 − F0)·S.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SchlickCurve {
    above_smooth: AlbedoCurve<'static>,
}

impl SchlickCurve {
    /// S at `roughness` in [0, 1].
    pub(crate) fn new(roughness: f32) -> Self {
        Self { above_smooth: ReflectionTables::of(Distribution::Ggx).schlick.curve(roughness) }
    }

    /// S at an incident cosine in (0, 1].
    pub(crate) fn at(&self, mu: f32) -> f32 {
        (self.above_smooth.at(mu) + fresnel::schlick_weight(mu)).max(0.0)
    }

    /// 2∫S(μ)μ dμ.
    pub(crate) fn average(&self) -> f32 {
        self.above_smooth.average() + fresnel::SCHLICK_AVERAGE
    }
}

/// Share of light that leaves after being reflected by facet `m`.
pub(super) fn reflected(facets: &Microfacets, wo: Vec3, m: Vec3) -> f32 {
    let wi = 2.0 * wo.dot(m) * m - wo;
    if wi.z > 0.0 { facets.unshadowed(wo, wi) } else { 0.0 }
}
