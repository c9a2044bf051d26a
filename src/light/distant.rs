//! Directional lights and the sun: light from one direction, or from a disc around it.

use super::LightSample;
use super::distribution::{ChosenCell, Distribution1d};
use super::sphere::Cone;
use crate::scene::Light;
use glam::Vec3;
use std::f32::consts::PI;

/// All directional lights of a scene, chosen by their irradiance.
#[derive(Debug)]
pub(super) struct DistantLights {
    lights: Vec<DistantLight>,
    choice: Distribution1d,
}

/// A light that looks smaller than this comes from one direction: f32 has too few directions within it, so that sampled
/// ones fall outside (2 % of a disc of 6e-7 rad, 0.1 % of one of 9e-6).
const MIN_DISC_RAD: f32 = 5e-5;

#[derive(Clone, Debug)]
struct DistantLight {
    /// Axis towards the light.
    cone: Cone,
    /// Irradiance, or radiance of the disc where there is one.
    strength: Vec3,
    has_disc: bool,
}

/// What is seen of a light from afar.
pub(super) struct Disc {
    /// Unit vector towards its middle.
    pub(super) axis: Vec3,
    /// Tangent of half the angle that the disc fills.
    pub(super) tangent: f32,
    pub(super) radiance: Vec3,
}

impl DistantLights {
    /// The distant lights among these; `None` where no light shines from afar.
    pub(super) fn new(lights: &[Light]) -> Option<Self> {
        let (mut distant, mut weights) = (Vec::new(), Vec::new());
        for light in lights {
            let &Light::Directional { direction, irradiance, angular_radius, .. } = light else { continue };
            let half_sin = (0.5 * angular_radius).sin();
            let one_minus_cos = 2.0 * half_sin * half_sin;
            // Irradiance of a disc of radiance L that is faced: π L sin²θ.
            let disc = PI * one_minus_cos * (2.0 - one_minus_cos);
            let has_disc = angular_radius > MIN_DISC_RAD;
            distant.push(DistantLight {
                cone: Cone { axis: -direction, one_minus_cos },
                strength: if has_disc { irradiance / disc } else { irradiance },
                has_disc,
            });
            weights.push(f64::from(irradiance.max_element()));
        }
        Some(Self { lights: distant, choice: Distribution1d::new(&weights)? })
    }

    pub(super) fn sample(&self, u: [f32; 3]) -> LightSample {
        let ChosenCell { index, probability } = self.choice.choose(u[2]);
        let DistantLight { cone, strength, has_disc } = &self.lights[index];
        let (direction, radiance) = if *has_disc {
            let direction = cone.sample([u[0], u[1]]);
            // Discs that overlap add up, as they do for a ray that meets no surface.
            (direction, self.radiance(direction))
        } else {
            (cone.axis, *strength)
        };
        let pdf = if *has_disc { self.pdf(direction) } else { probability };
        LightSample { direction, place: None, radiance, pdf, is_delta: !has_disc }
    }

    /// The discs of those that have one and fill no half of the sky.
    pub(super) fn discs(&self) -> impl Iterator<Item = Disc> {
        self.lights.iter().filter(|light| light.has_disc && light.cone.one_minus_cos < 1.0).map(|light| {
            let Cone { axis, one_minus_cos } = light.cone;
            let sine = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
            Disc { axis, tangent: sine / (1.0 - one_minus_cos), radiance: light.strength }
        })
    }

    fn seen(&self, direction: Vec3) -> impl Iterator<Item = (usize, &DistantLight)> {
        let outside = move |light: &DistantLight| {
            // 1 − cos of the angle, without cancellation.
            0.5 * (direction - light.cone.axis).length_squared() > light.cone.one_minus_cos
        };
        self.lights.iter().enumerate().filter(move |(_, light)| light.has_disc && !outside(light))
    }

    /// Radiance of the discs in a direction.
    pub(super) fn radiance(&self, direction: Vec3) -> Vec3 {
        self.seen(direction).map(|(_, light)| light.strength).sum()
    }

    /// Density per steradian with which a direction towards a disc is sampled.
    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        self.seen(direction).map(|(index, light)| self.choice.probability(index) * light.cone.pdf()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However small the disc, no sample falls outside of it, and what they bring is its irradiance.
    #[test]
    fn small_discs_lose_no_light() {
        let direction = Vec3::new(0.3, -0.9, 0.2).normalize();
        for angular_radius in [0.0, 1e-7, 1e-6, 1e-5, 4.9e-5, 5.1e-5, 1e-4, 4.6e-3] {
            let light = Light::Directional { direction, irradiance: Vec3::ONE, angular_radius, is_of_sky: false };
            let lights = DistantLights::new(&[light]).expect("it shines");
            let n = 4096;
            let brought = (0..n).map(|i| {
                let u = [(i as f32 + 0.5) / n as f32, ((i * 1597) % n) as f32 / n as f32, 0.5];
                let sample = lights.sample(u);
                f64::from(sample.radiance.x / sample.pdf)
            });
            let mean = brought.sum::<f64>() / f64::from(n);
            assert!((mean - 1.0).abs() < 1e-3, "{angular_radius}: {mean}");
        }
    }
}
