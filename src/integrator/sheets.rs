//! Clear sheets before lights without extent: window panes let the sun of a directional light in.
//!
//! No path ever meets such a light, so that a pane in a shadow ray's way would keep all of it out. What goes straight on through
//! smooth thin sheets is therefore let through here. Not for lights of some extent, which paths find behind panes by themselves: their
//! light would count twice. Not for boundaries of volumes either, which refract it.

use super::PathTracer;
use super::shading::Components;
use super::specular::may_be_smooth;
use crate::geometry::Ray;
use crate::scene::{Material, Surface};
use glam::Vec3;

/// Sheets that a shadow ray passes at most; more of them let next to nothing through.
const MOST_SHEETS: usize = 32;

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
        _ => false,
    }
}

impl PathTracer {
    /// Share of light that comes along a shadow ray from a `distance` (scene units, may be infinite) through clear sheets, and how
    /// many rays it took to find out: 0 where anything else is in the way.
    pub(super) fn through_sheets(&self, shadow_ray: &Ray, distance: f32) -> (Vec3, u32) {
        let (mut ray, mut share) = (*shadow_ray, Vec3::ONE);
        let wo = -Vec3::from(ray.direction);
        for rays in 1..=MOST_SHEETS as u32 {
            let left = distance - (ray.origin - shadow_ray.origin).length();
            let Some(hit) = self.world.closest(&ray).filter(|hit| hit.distance < left) else { return (share, rays) };
            let point = self.world.surface(&ray, &hit);
            let components = Components::new();
            let bsdf = self.bsdf(&point, &components);
            let shading = self.shading(&bsdf, &point, wo, ray.time);
            share *= shading.bsdf.straight_through(shading.frame.to_local(wo));
            if share == Vec3::ZERO {
                return (share, rays);
            }
            ray.origin = point.spawn(-wo);
        }
        (Vec3::ZERO, MOST_SHEETS as u32)
    }
}
