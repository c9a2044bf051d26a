//! Tables of the light that single scattering off microfacets keeps, and what is needed to give the rest back.
//!
//! A microfacet model follows light to its first facet only; what the shadowing term removes has in truth gone on to
//! another facet. Kulla & Conty add a diffuse-like lobe of exactly the missing energy, (1 − E(μo))(1 − E(μi)) /
//! (π(1 − E_avg)), where E(μ) is the directional albedo of single scattering at incident cosine μ and E_avg = 2∫E(μ)μ
//! dμ: reciprocal by its symmetry and lossless by its norm, whatever the interpolation error of the table at μi.
//!
//! Sources: C. Kulla & A. Conty, *Revisiting physically based shading at Imageworks* (SIGGRAPH course 2017), the
//! compensation, its tint and the split for dielectrics; C. Kelemen & L. Szirmay-Kalos (2001) for the form; S.
//! Hill, *A multi-faceted exploration* (2018) for the tint's squared F_avg. The tables are computed here, by
//! quadrature over visible normals.

use super::albedo_table::{
    AlbedoTable, DirectionalCurve, PairCurve, PairTable, average_over_visible_normals, direction_at,
};
use super::anisotropic_table::{AnisotropicCurve, AnisotropicTable, WidthRange};
use super::fresnel;
use super::microfacets::Microfacets;
use crate::scene::Distribution;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use std::sync::LazyLock;

/// Most of the samples that may go to single scattering. The rest keeps the compensation reachable where the energy
/// that it gives back is too small for single precision to tell 1 − E from 0.
pub(crate) const MAX_SINGLE_SHARE: f32 = 0.9999;

/// Kulla and Conty's lobe without its tint, times cos θi: the light that single scattering loses, given by
/// `missing` = 1 − E.
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
    /// Albedo of facets that reflect Schlick's (1 − wo·h)⁵, less (1 − μ)⁵: what is left is smooth even where the
    /// columns are wide apart. See [`SchlickCurves`].
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

/// What a GGX lobe with Schlick's reflectance keeps and loses at one roughness: its albedo is F0·(1 − missing) +
/// (F90 − F0)·S, S being the albedo of facets that reflect Schlick's (1 − wo·h)⁵.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SchlickCurves {
    /// Missing energy, and S less (1 − μ)⁵.
    pair: PairCurve<'static>,
    /// Missing energy of facets that are wider along one axis.
    anisotropic: Option<AnisotropicCurve<'static>>,
}

/// Values of [`SchlickCurves`] at a direction, or their averages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SchlickAlbedo {
    pub(crate) missing: f32,
    pub(crate) schlick: f32,
}

static GGX_PAIR: LazyLock<PairTable> = LazyLock::new(|| PairTable::new(&GGX.missing, &GGX.schlick));
static GGX_ANISOTROPIC: LazyLock<AnisotropicTable> =
    LazyLock::new(|| AnisotropicTable::missing([WidthRange::Textured; 2], Distribution::Ggx));

impl SchlickCurves {
    /// The curves for GGX facets. S is that of the mean width where widths differ.
    pub(crate) fn new(facets: &Microfacets) -> Self {
        let anisotropic = (!facets.is_isotropic()).then(|| GGX_ANISOTROPIC.curve(facets.alphas()));
        Self { pair: GGX_PAIR.curve(facets.mean_alpha().sqrt()), anisotropic }
    }

    /// Missing energy and Schlick's S at a direction of the upper half.
    pub(crate) fn at(&self, w: Vec3) -> SchlickAlbedo {
        let [missing, above_smooth] = self.pair.at(w.z);
        SchlickAlbedo {
            missing: self.anisotropic.as_ref().map_or(missing, |curve| curve.at(w)),
            schlick: (above_smooth + fresnel::schlick_weight(w.z)).max(0.0),
        }
    }

    /// Cosine-weighted averages of both.
    pub(crate) fn averages(&self) -> SchlickAlbedo {
        let [missing, above_smooth] = self.pair.averages();
        SchlickAlbedo {
            missing: self.anisotropic.as_ref().map_or(missing, AnisotropicCurve::average),
            schlick: above_smooth + fresnel::SCHLICK_AVERAGE,
        }
    }
}

/// Share of light that leaves after being reflected by facet `m`.
pub(super) fn reflected(facets: &Microfacets, wo: Vec3, m: Vec3) -> f32 {
    let wi = 2.0 * wo.dot(m) * m - wo;
    if wi.z > 0.0 { facets.unshadowed(wo, wi) } else { 0.0 }
}
