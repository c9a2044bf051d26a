//! How much light a clear coat lets through to what lies beneath, and the tables for it.
//!
//! E(ω) is the share that the coat's outer face reflects at one facet; everything else, 1 − E(ω), enters. A
//! base of separable, diffuse-like scattering then gets (1 − E(ωo))(1 − E(ωi))/(π(1 − E_avg)) times its
//! colour, which is reciprocal and, for a white base, lossless: all light that the coat turns back inside is
//! scattered again until it leaves.
//!
//! Source: C. Kelemen & L. Szirmay-Kalos, *A microfacet based coupled specular-matte BRDF model with importance
//! sampling* (2001), eq. 5. The tables are computed here, by quadrature over visible normals.

use super::albedo_table::{AlbedoTable, DirectionalCurve, average_over_visible_normals, direction_at};
use super::anisotropic_table::{AnisotropicTable, WidthRange};
use super::dielectric_tables::dielectric_average;
use super::energy::reflected;
use super::fresnel;
use super::microfacets::Microfacets;
use crate::scene::Distribution;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use std::fmt;

/// What coats of one index of refraction reflect, for all roughnesses. Make one per index and share it.
#[derive(Clone)]
pub struct CoatTables {
    eta: f32,
    distribution: Distribution,
    /// E less the Fresnel reflectance of a smooth coat: what is left is smooth even where the columns are wide apart.
    above_smooth: AlbedoTable,
    anisotropic: Option<Box<AnisotropicTable>>,
    /// Cosine-weighted average of a smooth coat's reflectance.
    smooth_average: f32,
}

// Tables are not for reading: the parameters that they were made for are.
impl fmt::Debug for CoatTables {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CoatTables")
            .field("eta", &self.eta)
            .field("distribution", &self.distribution)
            .finish_non_exhaustive()
    }
}

impl CoatTables {
    /// Computes the tables for an index of refraction `eta`, relative to what lies outside, of at least 1.
    pub fn new(eta: f32, distribution: Distribution) -> Self {
        let above_smooth = AlbedoTable::new(|mu, alpha| {
            let facets = Microfacets::isotropic(alpha, distribution);
            above_smooth_at(&facets, direction_at(mu), eta)
        });
        Self { eta, distribution, above_smooth, anisotropic: None, smooth_average: dielectric_average(eta) }
    }

    /// Adds what facets of different widths along x and y need; `ranges` says which widths there are.
    pub fn with_anisotropy(mut self, ranges: [WidthRange; 2]) -> Self {
        let eta = self.eta;
        let table = AnisotropicTable::new(ranges, self.distribution, |facets, wo| above_smooth_at(facets, wo, eta));
        self.anisotropic = Some(Box::new(table));
        self
    }

    /// The index of refraction that the tables were made for.
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// The distribution that the tables were made for.
    pub fn distribution(&self) -> Distribution {
        self.distribution
    }

    /// A coat of such facets, or a smooth one.
    pub(crate) fn coat(&self, facets: Option<&Microfacets>) -> Coat<'_> {
        let above_smooth = facets.map(|facets| self.above_smooth.along(facets, self.anisotropic.as_deref()));
        let average = self.smooth_average + above_smooth.map_or(0.0, |curve| curve.average());
        Coat { eta: self.eta, facets: facets.copied(), above_smooth, average: average.clamp(0.0, 1.0) }
    }
}

/// Albedo of such facets' reflection for light from `wo`, less the reflectance of a smooth coat.
fn above_smooth_at(facets: &Microfacets, wo: Vec3, eta: f32) -> f32 {
    let rough = average_over_visible_normals(facets, wo, |m| {
        fresnel::dielectric(wo.dot(m), eta).reflectance * reflected(facets, wo, m)
    });
    rough - fresnel::dielectric(wo.z, eta).reflectance
}

/// A coat of one index and roughness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coat<'a> {
    pub(crate) eta: f32,
    /// Facets of the coat; `None` if it is perfectly smooth.
    pub(crate) facets: Option<Microfacets>,
    above_smooth: Option<DirectionalCurve<'a>>,
    average: f32,
}

impl Coat<'_> {
    /// E(ω), for a direction of the upper half outside.
    pub(crate) fn reflectance(&self, w: Vec3) -> f32 {
        let smooth = fresnel::dielectric(w.z, self.eta).reflectance;
        match &self.above_smooth {
            None => smooth,
            Some(curve) => (smooth + curve.at(w)).clamp(0.0, 1.0),
        }
    }

    /// 1 − E(ω).
    pub(crate) fn passed(&self, w: Vec3) -> f32 {
        1.0 - self.reflectance(w)
    }

    /// Cosine-weighted average of what enters, above 0.
    pub(crate) fn average_passed(&self) -> f32 {
        (1.0 - self.average).max(1e-6)
    }

    /// Share of diffuse light inside that the coat turns back: radiance inside is 1/η² of what it is outside, so
    /// (1 − r)η² = 1 − E_avg.
    pub(crate) fn turned_back(&self) -> f32 {
        (1.0 - self.average_passed() / (self.eta * self.eta)).clamp(0.0, 1.0)
    }

    /// The lobe of a white diffuse base under the coat, cosine of `wi` included.
    pub(crate) fn diffuse_lobe(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.passed(wo) * self.passed(wi) * wi.z * FRAC_1_PI / self.average_passed()
    }
}
