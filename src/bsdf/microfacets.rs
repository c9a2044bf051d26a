//! Distributions of microfacet normals: GGX (Trowbridge–Reitz) and Beckmann, isotropic or not.
//!
//! Parameters: slope widths αx and αy along the local x and y axes, in [1e-3, 1]. GGX has the long tails of most real
//! surfaces; Beckmann's Gaussian slopes fit some polymers and polished metals better.
//!
//! Sources: T. Trowbridge & K. Reitz (1975); P. Beckmann & A. Spizzichino (1963); B. Walter et al., *Microfacet
//! models for refraction through rough surfaces* (2007), eqs. 25 and 33; E. Heitz, *Understanding the
//! masking-shadowing function* (2014), eqs. 72, 86 and 99 (anisotropic forms and the height-correlated G2); J.
//! Dupuy & A. Benyoub, *Sampling visible GGX normals with spherical caps* (2023), listing 3. Visible Beckmann
//! normals: see [`super::beckmann`].

use super::{MIN_ALPHA, beckmann, warp};
use crate::scene::Distribution;
use glam::Vec3;
use std::f32::consts::PI;

/// A distribution of facet normals. Every direction given to it lies above the macro-surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets {
    alpha_x: f32,
    alpha_y: f32,
    distribution: Distribution,
}

/// An isotropic GGX distribution of perceptual roughness in [0, 1].
impl From<f32> for Microfacets {
    fn from(roughness: f32) -> Self {
        Self::new(roughness * roughness, roughness * roughness, Distribution::Ggx)
    }
}

impl Microfacets {
    /// Slope widths along the local x and y axes, in [0, 1].
    pub fn new(alpha_x: f32, alpha_y: f32, distribution: Distribution) -> Self {
        Self { alpha_x: alpha_x.clamp(0.0, 1.0), alpha_y: alpha_y.clamp(0.0, 1.0), distribution }
    }

    /// Facets of the same slope width along every azimuth, in [0, 1].
    pub fn isotropic(alpha: f32, distribution: Distribution) -> Self {
        Self::new(alpha, alpha, distribution)
    }

    /// The distribution with widths that it can be evaluated with, or `None` where the surface counts as smooth.
    pub(crate) fn rough(self) -> Option<Self> {
        let is_rough = self.alpha_x.max(self.alpha_y) >= MIN_ALPHA;
        is_rough.then(|| Self { alpha_x: self.alpha_x.max(MIN_ALPHA), alpha_y: self.alpha_y.max(MIN_ALPHA), ..self })
    }

    /// Which shape the distribution has.
    pub(crate) fn distribution(&self) -> Distribution {
        self.distribution
    }

    pub(crate) fn is_isotropic(&self) -> bool {
        self.alpha_x == self.alpha_y
    }

    /// Geometric mean of both widths.
    pub(crate) fn mean_alpha(&self) -> f32 {
        if self.is_isotropic() { self.alpha_x } else { (self.alpha_x * self.alpha_y).sqrt() }
    }

    /// Slope widths along x and y.
    pub(crate) fn alphas(&self) -> [f32; 2] {
        [self.alpha_x, self.alpha_y]
    }

    /// D(m): area of facets with normal `m` per unit of macro-surface and steradian.
    pub(crate) fn density(&self, m: Vec3) -> f32 {
        if m.z <= 0.0 {
            return 0.0;
        }
        let x = m.x / self.alpha_x;
        let y = m.y / self.alpha_y;
        let area = PI * self.alpha_x * self.alpha_y;
        match self.distribution {
            Distribution::Ggx => {
                let sum = x * x + y * y + m.z * m.z;
                1.0 / (area * sum * sum)
            }
            Distribution::Beckmann => {
                let z2 = m.z * m.z;
                let exponential = (-(x * x + y * y) / z2).exp();
                // Far in the tail z⁴ is 0 as well; there is nothing there.
                if exponential > 0.0 { exponential / (area * z2 * z2) } else { 0.0 }
            }
        }
    }

    /// cos θ·(1 + 2Λ(w)), with Smith's Λ. With it, no use below divides by cos θ; for GGX it is the length of `w` after
    /// stretching by the roughness.
    fn stretch(&self, w: Vec3) -> f32 {
        let x = self.alpha_x * w.x;
        let y = self.alpha_y * w.y;
        let slope2 = x * x + y * y;
        match self.distribution {
            Distribution::Ggx => (slope2 + w.z * w.z).sqrt(),
            Distribution::Beckmann => beckmann::stretch(slope2.sqrt(), w.z),
        }
    }

    /// G2(wo, wi) / (4 cos θo cos θi), both directions above the surface: Smith's height-correlated masking and
    /// shadowing with the denominator of the microfacet BRDF.
    pub(crate) fn visibility(&self, wo: Vec3, wi: Vec3) -> f32 {
        0.5 / (wo.z * self.stretch(wi) + wi.z * self.stretch(wo))
    }

    /// G2 / G1(wo): share of the visible facets from which `wi` is not shadowed; both directions above the surface.
    pub(crate) fn unshadowed(&self, wo: Vec3, wi: Vec3) -> f32 {
        let stretch_o = self.stretch(wo);
        wi.z * (wo.z + stretch_o) / (wo.z * self.stretch(wi) + wi.z * stretch_o)
    }

    /// Pdf per steradian of a facet normal among those visible from `wo`, divided by wo·m.
    pub(crate) fn visible_density_over_cosine(&self, wo: Vec3, m: Vec3) -> f32 {
        2.0 * self.density(m) / (wo.z + self.stretch(wo))
    }

    /// One bounce off a facet that reflects everything; both directions above the surface.
    pub(crate) fn reflect(&self, wo: Vec3, wi: Vec3) -> FacetReflection {
        let half = (wo + wi).normalize_or(Vec3::Z);
        let density = self.density(half);
        let (stretch_o, stretch_i) = (self.stretch(wo), self.stretch(wi));
        FacetReflection {
            value: density * wi.z * 0.5 / (wo.z * stretch_i + wi.z * stretch_o),
            pdf: 0.5 * density / (wo.z + stretch_o),
            cos_half: wo.dot(half),
        }
    }

    /// Chooses a facet normal visible from `wo`.
    pub(crate) fn sample_visible(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        self.visible_normals(wo).normal(u)
    }

    /// Chooses where light goes that is reflected once by a facet visible from `wo`; `None` where it is shadowed.
    pub(crate) fn sample_reflection(&self, wo: Vec3, u: [f32; 2]) -> Option<Vec3> {
        let m = self.sample_visible(wo, u);
        let wi = 2.0 * wo.dot(m) * m - wo;
        (wi.z > 0.0).then_some(wi)
    }

    /// The normals visible from `wo`.
    pub(crate) fn visible_normals(&self, wo: Vec3) -> VisibleNormals {
        VisibleNormals {
            facets: *self,
            stretched: Vec3::new(self.alpha_x * wo.x, self.alpha_y * wo.y, wo.z).normalize(),
        }
    }
}

/// One bounce off a facet that reflects everything.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacetReflection {
    /// D·G2/(4 cos θo), the cosine of wi included.
    pub(crate) value: f32,
    /// Pdf of choosing wi by a visible normal.
    pub(crate) pdf: f32,
    /// Cosine between either direction and the facet's normal.
    pub(crate) cos_half: f32,
}

/// The normals that are visible from one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VisibleNormals {
    facets: Microfacets,
    /// Direction of the viewer after stretching by the roughness.
    stretched: Vec3,
}

impl VisibleNormals {
    /// The normal at `u` in [0, 1)²: uniform numbers give visible normals.
    pub(crate) fn normal(&self, u: [f32; 2]) -> Vec3 {
        let stretched = match self.facets.distribution {
            Distribution::Ggx => self.normal_on_cap(warp::sin_cos_of_turns(u[0]), u[1]),
            Distribution::Beckmann => beckmann::visible_normal(self.stretched, u),
        };
        Vec3::new(self.facets.alpha_x * stretched.x, self.facets.alpha_y * stretched.y, stretched.z.max(0.0))
            .normalize_or(Vec3::Z)
    }

    /// Dupuy and Benyoub's cap, from the sine and cosine of an azimuth and a height in [0, 1].
    fn normal_on_cap(&self, (sin_phi, cos_phi): (f32, f32), u: f32) -> Vec3 {
        let z = (1.0 - u) * (1.0 + self.stretched.z) - self.stretched.z;
        let sin_theta = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, z) + self.stretched
    }
}
