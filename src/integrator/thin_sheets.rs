//! Clear sheets before lamps: window panes let the sun in.
//!
//! A pane in a shadow ray's way would keep the light out of it; only paths that happen to scatter towards the lamp
//! would find it, and none would find a light without extent. What goes straight on through smooth thin sheets is
//! therefore let through here. A path that has gone straight on through sheets and meets a lamp counts as scattered
//! where its direction was, so that both ways of finding the lamp are weighed against each other as if the sheets were
//! not there. Whether a path takes a sheet's other lobe does not enter the weights: they need only add up to 1. Not for
//! boundaries of volumes, which refract.

use super::PathTracer;
use super::path::ShadowRay;
use super::shading::Components;
use super::specular::may_be_smooth;
use crate::geometry::Ray;
use crate::scene::{Material, Surface};
use glam::Vec3;

/// Sheets that a shadow ray passes at most; more of them let next to nothing through.
pub(super) const MAX_SHEETS: u32 = 32;

/// Whether any of these may be a clear sheet.
pub(super) fn any_of(materials: &[Material]) -> bool {
    materials.iter().any(|material| may_be_a_sheet(&material.surface))
}

fn may_be_a_sheet(surface: &Surface) -> bool {
    match surface {
        Surface::ThinDielectric { .. } => true,
        Surface::MetalRoughness(model) => {
            model.volume.is_none() && model.transmission.factor > 0.0 && may_be_smooth(&model.roughness)
        }
        Surface::Mix { first, second, .. } => may_be_a_sheet(first) || may_be_a_sheet(second),
        Surface::Diffuse { .. }
        | Surface::OrenNayar { .. }
        | Surface::DiffuseTransmission { .. }
        | Surface::Mirror { .. }
        | Surface::Conductor { .. }
        | Surface::Dielectric { .. }
        | Surface::CoatedDiffuse { .. }
        | Surface::CoatedConductor { .. }
        | Surface::Phong { .. }
        | Surface::Ward { .. }
        | Surface::HeTorrance { .. } => false,
    }
}

/// What comes through sheets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passed {
    /// Share of light that comes through, by channel; 0 where anything else is in the way.
    pub(super) share: Vec3,
    /// Rays that it took to find out.
    pub(super) rays: u32,
}

impl PathTracer {
    /// What comes along a shadow ray from the light through at most so many clear sheets.
    pub(super) fn through_sheets(&self, shadow_ray: &ShadowRay, most_sheets: u32) -> Passed {
        let ShadowRay { mut ray, distance } = *shadow_ray;
        let end = distance.is_finite().then(|| ray.origin + distance * ray.direction);
        let (mut left, mut share) = (distance, Vec3::ONE);
        for rays in 1..=most_sheets + 1 {
            let Some(hit) = self.world.closest(&ray).filter(|hit| hit.distance < left) else {
                return Passed { share, rays };
            };
            let wo = -Vec3::from(ray.direction);
            let point = self.world.surface(&ray, &hit);
            let components = Components::new();
            let frames = self.frames(&point, wo, ray.time);
            let bsdf = self.bsdf(&point, &frames, &components);
            let shading = self.shading(&bsdf, &point, &frames);
            share *= shading.straight_through(wo);
            if share == Vec3::ZERO {
                return Passed { share, rays };
            }
            ray.origin = point.spawn(-wo);
            // Lifting the origin off the sheet moves the ray aside, and the lamp itself would be in its way: it is
            // aimed anew.
            if let Some(end) = end {
                left = (end - ray.origin).length();
                ray = Ray { time: ray.time, ..Ray::new(ray.origin, (end - ray.origin) / left) };
            }
        }
        Passed { share: Vec3::ZERO, rays: most_sheets + 1 }
    }
}
