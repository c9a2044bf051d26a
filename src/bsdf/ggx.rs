//! The GGX (Trowbridge–Reitz) distribution of microfacet normals.
//!
//! Parameters: slope widths αx and αy along the local x and y axes, in [1e-3, 1].
//!
//! Sources: T. Trowbridge & K. Reitz (1975); B. Walter et al., *Microfacet models for refraction through rough surfaces*
//! (2007), eq. 33; E. Heitz, *Understanding the masking-shadowing function* (2014), eqs. 72, 86 and 99 (anisotropic form
//! and the height-correlated G2); J. Dupuy & A. Benyoub, *Sampling visible GGX normals with spherical caps* (2023),
//! listing 3. Not for surfaces measured with short tails (some polymers and polished metals): Beckmann fits these better.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// A GGX distribution. Every direction given to it lies above the macro-surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ggx {
    alpha_x: f32,
    alpha_y: f32,
}

impl Ggx {
    /// The same width along every azimuth.
    pub(crate) fn isotropic(alpha: f32) -> Self {
        Self { alpha_x: alpha, alpha_y: alpha }
    }

    /// D(m): area of facets with normal `m` per unit of macro-surface and steradian.
    pub(crate) fn density(&self, m: Vec3) -> f32 {
        if m.z <= 0.0 {
            return 0.0;
        }
        let x = m.x / self.alpha_x;
        let y = m.y / self.alpha_y;
        let sum = x * x + y * y + m.z * m.z;
        1.0 / (PI * self.alpha_x * self.alpha_y * sum * sum)
    }

    /// Length of `w` after stretching by the roughness. With it, Smith's Λ(w) is (stretch/cos θ − 1)/2, and every use
    /// below avoids the division by cos θ.
    fn stretch(&self, w: Vec3) -> f32 {
        let x = self.alpha_x * w.x;
        let y = self.alpha_y * w.y;
        (x * x + y * y + w.z * w.z).sqrt()
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

    /// Chooses a facet normal visible from `wo`.
    pub(crate) fn sample_visible(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        self.visible_cap(wo).normal((TAU * u[0]).sin_cos(), u[1])
    }

    /// The normals visible from `wo`, as a cap of the sphere.
    pub(crate) fn visible_cap(&self, wo: Vec3) -> VisibleCap {
        VisibleCap { ggx: *self, stretched: Vec3::new(self.alpha_x * wo.x, self.alpha_y * wo.y, wo.z).normalize() }
    }
}

/// The spherical cap from which Dupuy and Benyoub make visible normals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VisibleCap {
    ggx: Ggx,
    /// Direction of the viewer after stretching by the roughness.
    stretched: Vec3,
}

impl VisibleCap {
    /// The normal at an azimuth (sine and cosine) and a height `u` in [0, 1]: uniform numbers give visible normals.
    pub(crate) fn normal(&self, (sin_phi, cos_phi): (f32, f32), u: f32) -> Vec3 {
        let z = (1.0 - u) * (1.0 + self.stretched.z) - self.stretched.z;
        let sin_theta = (1.0 - z * z).max(0.0).sqrt();
        let half = Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, z) + self.stretched;
        Vec3::new(self.ggx.alpha_x * half.x, self.ggx.alpha_y * half.y, half.z.max(0.0)).normalize_or(Vec3::Z)
    }
}
