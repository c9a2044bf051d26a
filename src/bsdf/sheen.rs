//! The fibres of glTF's sheen.
//!
//! Sources: Khronos Group, KHR_materials_sheen; A. Estevez & C. Kulla, *Production friendly microfacet sheen BRDF*
//! (2017), eq. 2, for the fibres' distribution; D. Neubelt & M. Pettineo (2013) for their visibility 1/(4(cos θo + cos
//! θi − cos θo cos θi)), with which fibres of roughness below 0.5 reflect more than comes in at grazing angles, and
//! are scaled down by as much.

use super::albedo_table::{AlbedoTable, direction_at};
use glam::Vec3;
use std::f32::consts::TAU;
use std::sync::LazyLock;

/// Fibres of one roughness.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheen {
    pub(super) color: Vec3,
    roughness: f32,
    inverse_alpha: f32,
    /// 1, or less where fibres would reflect more than comes in.
    scale: f32,
    /// What it passes face on.
    pub(super) passes: f32,
}

/// Exponents beyond 1/this would crowd at grazing angles only.
const MIN_ALPHA: f32 = 0.01;

fn inverse_alpha(alpha: f32) -> f32 {
    1.0 / alpha.max(MIN_ALPHA)
}

/// Charlie's distribution and Neubelt's visibility, cosine of `wi` included.
fn fibres(wo: Vec3, wi: Vec3, inverse_alpha: f32) -> f32 {
    let half = (wo + wi).normalize_or(Vec3::Z);
    let sin2 = (1.0 - half.z * half.z).max(0.0);
    let density = (2.0 + inverse_alpha) * sin2.powf(0.5 * inverse_alpha) / TAU;
    density * wi.z / (4.0 * (wo.z + wi.z - wo.z * wi.z))
}

/// Albedo of white fibres, by the midpoint rule over cosine and azimuth.
static SHEEN: LazyLock<AlbedoTable> = LazyLock::new(|| {
    AlbedoTable::new(|mu, alpha| {
        const STEPS: usize = 32;
        let wo = direction_at(mu);
        let inverse_alpha = inverse_alpha(alpha);
        let mut sum = 0.0;
        for row in 0..STEPS {
            // Squared, because fibres shine where light grazes.
            let root = (row as f32 + 0.5) / STEPS as f32;
            let cos = root * root;
            let sin = (1.0 - cos * cos).sqrt();
            for column in 0..STEPS {
                let (y, x) = (0.5 * TAU * (column as f32 + 0.5) / STEPS as f32).sin_cos();
                sum += 2.0 * root * fibres(wo, Vec3::new(sin * x, sin * y, cos), inverse_alpha);
            }
        }
        sum * TAU / (STEPS * STEPS) as f32
    })
});

impl Sheen {
    pub(super) fn new(color: Vec3, roughness: f32) -> Self {
        let roughness = roughness.clamp(0.0, 1.0);
        let curve = SHEEN.curve(roughness);
        // Least where light grazes most, which is where fibres reflect most; a hair more for quadrature.
        let most = curve.at(f32::MIN_POSITIVE) * 1.02;
        let scale = 1.0 / most.max(1.0);
        let passes = 1.0 - color.max_element() * scale * curve.at(1.0);
        Self { color, roughness, inverse_alpha: inverse_alpha(roughness * roughness), scale, passes }
    }

    pub(super) fn albedo(&self, w: Vec3) -> f32 {
        (self.scale * SHEEN.curve(self.roughness).at(w.z)).clamp(0.0, 1.0)
    }

    pub(super) fn passed(&self, w: Vec3) -> f32 {
        1.0 - self.color.max_element() * self.albedo(w)
    }

    /// What it scatters of light of which layers above it leave a share both ways, cosine of `wi` included.
    pub(super) fn scattered(&self, left_above: f32, wo: Vec3, wi: Vec3) -> Vec3 {
        self.color * (self.scale * left_above * fibres(wo, wi, self.inverse_alpha))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: all fibres were scaled down by 1.02, which is for those that reflect more than comes in.
    #[test]
    fn fibres_are_scaled_down_only_where_they_reflect_more_than_comes_in() {
        for (roughness, is_scaled) in [(0.2, true), (0.3, true), (0.7, false), (1.0, false)] {
            let scale = Sheen::new(Vec3::ONE, roughness).scale;
            assert_eq!(scale < 1.0, is_scaled, "roughness {roughness}: {scale}");
        }
    }
}
