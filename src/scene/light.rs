//! Lights that are no surfaces, in scene units: a photometric amount over [`super::Scene::nits_per_unit`].

use super::PhotometricWeb;
use glam::{Mat3, Vec3};
use std::f32::consts::TAU;
use std::sync::Arc;

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
    /// Shines by a photometric web.
    Photometric {
        /// World position.
        position: Vec3,
        /// Rotation from the world's space into the web's, as [`PhotometricWeb::from_world`] gives it.
        from_world: Mat3,
        /// Luminous intensity by direction; lamps of one kind share it.
        web: Arc<PhotometricWeb>,
        /// Intensity, as that of a point, for each cd of the web: the lamp's colour, and what it is dimmed to.
        per_candela: Vec3,
    },
    /// Shines from infinitely far away: a direction, or a disc of uniform radiance around it such as the sun's, which
    /// is then seen where a ray meets no surface.
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
    /// Share of the axis's intensity in a unit direction. `axis`: unit vector.
    pub fn at(self, direction: Vec3, axis: Vec3, inner_angle: f32, outer_angle: f32) -> f32 {
        // 1 − cos: a cosine itself tells nothing below a twentieth of a degree.
        let versine = 0.5 * direction.distance_squared(axis);
        let (inner, outer) = (versine_of(inner_angle), versine_of(outer_angle));
        if versine >= outer {
            return 0.0;
        }
        if versine <= inner {
            return 1.0;
        }
        let x = (outer - versine) / (outer - inner);
        match self {
            Self::Smoothstep => x * x * (3.0 - 2.0 * x),
            Self::Squared => x * x,
            Self::LinearInAngle => {
                let angle = 2.0 * (0.5 * versine).sqrt().min(1.0).asin();
                ((outer_angle - angle) / (outer_angle - inner_angle)).clamp(0.0, 1.0)
            }
        }
    }

    /// Flux over the axis's intensity, in steradian: what turns lumen into candela.
    pub fn solid_angle(self, inner_angle: f32, outer_angle: f32) -> f32 {
        let (inner, outer) = (versine_of(inner_angle), versine_of(outer_angle));
        match self {
            // Means over a ramp that is linear in the cosine: ∫(3x² − 2x³)dx = 1/2, ∫x²dx = 1/3.
            Self::Smoothstep => TAU * 0.5 * (inner + outer),
            Self::Squared => TAU * (inner + (outer - inner) / 3.0),
            // ∫(o − θ) sin θ dθ / (o − i) from i to o, by parts.
            Self::LinearInAngle => {
                let (inner, outer) = (f64::from(inner_angle), f64::from(outer_angle));
                let width = outer - inner;
                let mean_cosine = if width > 1e-9 { (outer.sin() - inner.sin()) / width } else { outer.cos() };
                TAU * (1.0 - mean_cosine) as f32
            }
        }
    }
}

/// 1 − cos of an angle, exact to the last bits where that is small.
fn versine_of(angle: f32) -> f32 {
    2.0 * (0.5 * angle).sin().powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed forms against the falloff itself, summed over the cap. Regression: cones of a hundredth of a degree
    /// kept none of their lumen.
    #[test]
    fn solid_angles_are_the_integral_of_the_falloff() {
        let sharp = [0.01, 0.1].map(f32::to_radians);
        let cones = [
            (0.2, 0.9),
            (0.0, 1.5),
            (0.5, 0.5),
            (0.2, 2.6),
            (sharp[0], sharp[0]),
            (0.0, sharp[0]),
            (sharp[0], sharp[1]),
        ];
        for falloff in [SpotFalloff::Smoothstep, SpotFalloff::Squared, SpotFalloff::LinearInAngle] {
            for (inner, outer) in cones {
                let n = 100_000;
                let cap = (1.1 * f64::from(versine_of(outer))).min(2.0);
                let at = |i: u32| {
                    let versine = cap * (f64::from(i) + 0.5) / f64::from(n);
                    let sine = (versine * (2.0 - versine)).sqrt() as f32;
                    falloff.at(Vec3::new(sine, 0.0, (1.0 - versine) as f32), Vec3::Z, inner, outer)
                };
                let measured = (0..n).map(|i| f64::from(at(i))).sum::<f64>() / f64::from(n) * cap * f64::from(TAU);
                let stated = f64::from(falloff.solid_angle(inner, outer));
                assert!((measured / stated - 1.0).abs() < 2e-3, "{falloff:?} {inner} {outer}: {measured} {stated}");
            }
        }
    }
}
