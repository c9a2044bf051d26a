//! Lights that are no surfaces, in scene units: a photometric amount over [`super::Scene::nits_per_unit`].

use glam::Vec3;
use std::f32::consts::TAU;

/// A light that is no surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Shines equally in all directions.
    Point {
        /// World position.
        position: Vec3,
        /// Radiant intensity in scene units × area: luminous intensity in cd is `nits_per_unit` × its luminance.
        intensity: Vec3,
    },
    /// Shines in a cone.
    Spot {
        /// World position.
        position: Vec3,
        /// Unit axis of the cone, away from the light.
        direction: Vec3,
        /// Intensity on the axis.
        intensity: Vec3,
        /// Half angle in radians inside which it shines fully.
        inner_angle: f32,
        /// Half angle in radians outside which it is dark.
        outer_angle: f32,
        /// What happens between the two.
        falloff: SpotFalloff,
    },
    /// Shines from infinitely far away: a direction, or a disc of uniform radiance around it such as the sun's, which is
    /// then seen where a ray meets no surface.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it: illuminance in lx is `nits_per_unit` × its luminance.
        irradiance: Vec3,
        /// Half angle of the disc in radians, below π/2; 0 is no disc (the sun's is 0.00465).
        angular_radius: f32,
        /// Whether it is the sun of the surroundings and goes when others take their place.
        is_of_sky: bool,
    },
}

/// How a spot's intensity falls from its inner to its outer angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpotFalloff {
    /// 3x² − 2x³ of x, linear in the cosine (pbrt-v4; our own format).
    Smoothstep,
    /// x² of x, linear in the cosine (glTF's KHR_lights_punctual).
    Squared,
    /// Linear in the angle (Mitsuba 3).
    LinearInAngle,
}

impl SpotFalloff {
    /// Share of the axis's intensity at the angle with this cosine.
    pub fn at(self, cos_angle: f32, inner_angle: f32, outer_angle: f32) -> f32 {
        let (cos_inner, cos_outer) = (inner_angle.cos(), outer_angle.cos());
        let x = ((cos_angle - cos_outer) / (cos_inner - cos_outer).max(1e-6)).clamp(0.0, 1.0);
        match self {
            Self::Smoothstep => x * x * (3.0 - 2.0 * x),
            Self::Squared => x * x,
            Self::LinearInAngle => {
                let angle = cos_angle.clamp(-1.0, 1.0).acos();
                ((outer_angle - angle) / (outer_angle - inner_angle).max(1e-6)).clamp(0.0, 1.0)
            }
        }
    }

    /// Flux over the axis's intensity, in steradian: what turns lumen into candela.
    pub fn solid_angle(self, inner_angle: f32, outer_angle: f32) -> f32 {
        let (cos_inner, cos_outer) = (inner_angle.cos(), outer_angle.cos());
        match self {
            // Means over a ramp that is linear in the cosine: ∫(3x² − 2x³)dx = 1/2, ∫x²dx = 1/3.
            Self::Smoothstep => TAU * (1.0 - 0.5 * (cos_inner + cos_outer)),
            Self::Squared => TAU * (1.0 - cos_inner + (cos_inner - cos_outer) / 3.0),
            // ∫(o − θ) sin θ dθ / (o − i) from i to o, by parts.
            Self::LinearInAngle => {
                let width = outer_angle - inner_angle;
                let ramp = if width > 1e-6 { cos_inner - (outer_angle.sin() - inner_angle.sin()) / width } else { 0.0 };
                TAU * (1.0 - cos_inner + ramp)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed forms against the falloff itself, summed over the sphere.
    #[test]
    fn solid_angles_are_the_integral_of_the_falloff() {
        for falloff in [SpotFalloff::Smoothstep, SpotFalloff::Squared, SpotFalloff::LinearInAngle] {
            for (inner, outer) in [(0.2f32, 0.9f32), (0.0, 1.5), (0.5, 0.5), (0.2, 2.6)] {
                let n = 200_000;
                let sum: f64 =
                    (0..n).map(|i| f64::from(falloff.at(1.0 - 2.0 * (i as f32 + 0.5) / n as f32, inner, outer))).sum();
                let measured = sum * 2.0 / f64::from(n) * f64::from(TAU);
                let stated = f64::from(falloff.solid_angle(inner, outer));
                assert!((measured / stated - 1.0).abs() < 1e-3, "{falloff:?} {inner} {outer}: {measured} {stated}");
            }
        }
    }
}
