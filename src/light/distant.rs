//! Directional lights and the sun: light from one direction, or from a disc around it.

use super::LightSample;
use super::distribution::Distribution1d;
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

#[derive(Clone, Debug)]
struct DistantLight {
    /// Axis towards the light.
    cone: Cone,
    /// Irradiance, or radiance of the disc where there is one.
    strength: Vec3,
    has_disc: bool,
}

impl DistantLights {
    /// `None` where no light shines from afar.
    pub(super) fn new(lights: &[Light]) -> Option<Self> {
        let (mut distant, mut weights) = (Vec::new(), Vec::new());
        for light in lights {
            let &Light::Directional { direction, irradiance, angular_radius, .. } = light else { continue };
            let half_sin = (0.5 * angular_radius).sin();
            let one_minus_cos = 2.0 * half_sin * half_sin;
            // Irradiance of a disc of radiance L that is faced: π L sin²θ.
            let disc = PI * one_minus_cos * (2.0 - one_minus_cos);
            let has_disc = disc > 1e-12;
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
        let (index, chosen) = self.choice.sample_discrete(u[2]);
        let DistantLight { cone, strength, has_disc } = &self.lights[index];
        let (direction, radiance) = if *has_disc {
            let direction = cone.sample([u[0], u[1]]);
            // Discs that overlap add up, as they do for a ray that meets no surface.
            (direction, self.radiance(direction))
        } else {
            (cone.axis, *strength)
        };
        let pdf = if *has_disc { self.pdf(direction) } else { chosen };
        LightSample { direction, place: None, radiance, pdf, is_delta: !has_disc }
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
