//! Tables of the light that one facet of a rough dielectric boundary keeps, for both sides of the boundary.
//!
//! Source: C. Kulla & A. Conty, *Revisiting physically based shading at Imageworks* (SIGGRAPH course 2017), for
//! the split of what is missing between reflection and transmission. The tables are computed here, by
//! quadrature over visible normals.

use super::albedo_table::{AlbedoTable, DirectionalCurve, average_over_visible_normals, direction_at};
use super::anisotropic_table::{AnisotropicTable, WidthRange};
use super::energy::reflected;
use super::fresnel;
use super::microfacets::Microfacets;
use crate::scene::Distribution;
use glam::Vec3;
use std::fmt;

/// On which side of a boundary a path is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Outside,
    Inside,
}

/// What a rough dielectric boundary of one index keeps after one facet, for both sides, and how what it loses is split
/// between reflection and transmission. Make one per index of refraction and share it.
#[derive(Clone)]
pub struct DielectricTables {
    eta: f32,
    distribution: Distribution,
    /// 1 − E of reflection and transmission together, by energy, for light that arrives from outside.
    outside: AlbedoTable,
    /// The table for light that arrives from inside.
    inside: AlbedoTable,
    anisotropic: Option<Box<AnisotropicSides>>,
    /// Average transmittance of a smooth boundary times the squared index of the side that light comes from: the same
    /// for both sides.
    throughput: f32,
}

/// Both curves for facets of different widths.
#[derive(Clone)]
struct AnisotropicSides {
    outside: AnisotropicTable,
    inside: AnisotropicTable,
}

/// The compensation of a dielectric at one roughness, for a path that is on one side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DielectricCompensation<'a> {
    /// Energy that single scattering loses on the path's side.
    pub(crate) near: DirectionalCurve<'a>,
    /// Energy that single scattering loses on the other side.
    pub(crate) far: DirectionalCurve<'a>,
    /// Share of the missing energy that is transmitted; the rest is reflected.
    pub(crate) transmitted_share: f32,
}

// Tables are not for reading: the parameters that they were made for are.
impl fmt::Debug for DielectricTables {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DielectricTables").field("eta", &self.eta).finish_non_exhaustive()
    }
}

impl DielectricTables {
    /// Computes the tables for a relative index `eta_inside_over_outside` above 0.
    pub fn new(eta_inside_over_outside: f32, distribution: Distribution) -> Self {
        let eta = eta_inside_over_outside;
        let side = |eta: f32| {
            AlbedoTable::new(move |mu, alpha| {
                missing(&Microfacets::isotropic(alpha, distribution), direction_at(mu), eta)
            })
        };
        let (outside, inside) = rayon::join(|| side(eta), || side(1.0 / eta));
        Self { eta, distribution, outside, inside, anisotropic: None, throughput: 1.0 - dielectric_average(eta) }
    }

    /// Adds what facets of different widths along x and y need; `ranges` says which widths there are.
    pub fn with_anisotropy(mut self, ranges: [WidthRange; 2]) -> Self {
        let side = |eta: f32| AnisotropicTable::new(ranges, self.distribution, |facets, wo| missing(facets, wo, eta));
        let (outside, inside) = rayon::join(|| side(self.eta), || side(1.0 / self.eta));
        self.anisotropic = Some(Box::new(AnisotropicSides { outside, inside }));
        self
    }

    /// The relative index that the tables were made for.
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// The distribution that the tables were made for.
    pub fn distribution(&self) -> Distribution {
        self.distribution
    }

    /// The compensation of a boundary of such `facets` for a path on one side of it.
    ///
    /// Reciprocity asks that b·(1 − E_avg)·η² be the same for both sides, b being the transmitted share. Kulla and
    /// Conty leave one number free; it is set so that b is the smooth boundary's average transmittance on the side that
    /// loses less, which keeps b in [0, 1] on both.
    pub(crate) fn compensation(&self, facets: &Microfacets, side: Side) -> DielectricCompensation<'_> {
        let outer = self.outside.along(facets, self.anisotropic.as_ref().map(|sides| &sides.outside));
        let inner = self.inside.along(facets, self.anisotropic.as_ref().map(|sides| &sides.inside));
        let (near, far, index) = match side {
            Side::Outside => (outer, inner, 1.0),
            Side::Inside => (inner, outer, self.eta),
        };
        let transmittance = self.throughput / (index * index);
        DielectricCompensation {
            near,
            far,
            transmitted_share: transmittance * (far.missing_average() / near.missing_average()).min(1.0),
        }
    }
}

/// Average reflectance 2∫F(μ)μ dμ of a smooth dielectric boundary, by the midpoint rule in μ².
pub(super) fn dielectric_average(eta: f32) -> f32 {
    const STEPS: usize = 1024;
    let sum: f32 = (0..STEPS)
        .map(|step| {
            let mu2 = (step as f32 + 0.5) / STEPS as f32;
            fresnel::dielectric(mu2.sqrt(), eta).reflectance
        })
        .sum();
    sum / STEPS as f32
}

/// Energy that one event at a facet loses, of light that comes from `wo`; `eta` is the far side's index over this
/// one's.
fn missing(facets: &Microfacets, wo: Vec3, eta: f32) -> f32 {
    average_over_visible_normals(facets, wo, |m| {
        let boundary = fresnel::dielectric(wo.dot(m).max(0.0), eta);
        let reflectance = boundary.reflectance;
        let through = transmitted(facets, wo, m, eta, boundary.cos_transmitted);
        1.0 - reflectance * reflected(facets, wo, m) - (1.0 - reflectance) * through
    })
}

/// Share of light that leaves on the other side after being refracted by facet `m`.
pub(super) fn transmitted(facets: &Microfacets, wo: Vec3, m: Vec3, eta: f32, cos_transmitted: f32) -> f32 {
    let wi = m * (wo.dot(m) / eta - cos_transmitted) - wo / eta;
    if wi.z < 0.0 { facets.unshadowed(wo, super::turn(wi)) } else { 0.0 }
}
