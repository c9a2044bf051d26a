//! What is seen in mirrors and through clear glass: a camera ray followed to the first thing that is neither.
//!
//! Not for light: only the likelier of reflection and refraction is followed, and nothing is weighed.

use super::PathTracer;
use super::shading::Components;
use crate::geometry::{Hit, Ray};
use crate::scene::{ScalarInput, Surface};
use glam::{Mat3A, Vec3, Vec3A};
use smallvec::SmallVec;

/// Mirrors and boundaries that are followed at most: what is seen behind more of them has hardly an image.
const MAX_VERTICES: usize = 8;

/// What a perfectly smooth surface does with a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpecularEvent {
    /// The ray is reflected, as by a mirror.
    Reflected,
    /// The ray is transmitted, as by glass.
    Transmitted,
}

/// One surface that a ray is followed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpecularVertex {
    /// Which thing, as [`Hit::object`].
    pub object: u32,
    /// What it does with the ray.
    pub event: SpecularEvent,
}

/// A camera ray followed over perfectly smooth surfaces.
#[derive(Clone, Debug)]
pub struct SpecularPath {
    /// The surfaces in order, at least one.
    pub vertices: SmallVec<[SpecularVertex; 2]>,
    /// The ray that leaves the last of the surfaces.
    pub last_ray: Ray,
    /// What that ray meets; `None` where it leaves the scene.
    pub end: Option<Hit>,
    /// Length of the way from the camera to the end over all surfaces, scene units; infinite where the last ray leaves
    /// the scene.
    pub length: f32,
    /// Turns directions along the last ray into those in which plane mirrors in place of its surfaces show them; glass
    /// turns none.
    pub unfolded: Mat3A,
}

/// What a smooth surface does with a ray.
struct SpecularBounce {
    event: SpecularEvent,
    next: Ray,
}

impl PathTracer {
    /// Whether any of the scene's surfaces may be perfectly smooth, so that following rays is worth while.
    pub fn has_specular_surfaces(&self) -> bool {
        self.world.scene().materials.iter().any(|material| may_be_specular(&material.surface))
    }

    /// Follows a camera ray over mirrors and glass, by the likelier event at each. `None` where the first thing in its
    /// way is neither, or there are more than eight.
    pub fn follow_specular(&self, camera_ray: Ray) -> Option<SpecularPath> {
        let (mut ray, mut length, mut vertices) = (camera_ray, 0.0, SmallVec::new());
        let mut unfolded = Mat3A::IDENTITY;
        loop {
            let hit = self.world.closest(&ray);
            let next = hit.as_ref().and_then(|hit| self.specular_bounce(&ray, hit, None));
            length += hit.as_ref().map_or(f32::INFINITY, |hit| hit.distance);
            match (hit, next) {
                (Some(hit), Some(bounce)) if vertices.len() < MAX_VERTICES => {
                    vertices.push(SpecularVertex { object: hit.object, event: bounce.event });
                    if bounce.event == SpecularEvent::Reflected {
                        unfolded *= mirroring(bounce.next.direction - ray.direction);
                    }
                    ray = bounce.next;
                }
                (_, Some(_)) => return None,
                (end, None) => {
                    let path = SpecularPath { vertices, last_ray: ray, end, length, unfolded };
                    return (!path.vertices.is_empty()).then_some(path);
                }
            }
        }
    }

    /// Follows a ray over the same things by the same events; the ray that leaves the last of them. `None` where it
    /// meets something else in place of one of them, or cannot go on as asked, as under total reflection.
    pub fn follow_again(&self, camera_ray: Ray, vertices: &[SpecularVertex]) -> Option<Ray> {
        vertices.iter().try_fold(camera_ray, |ray, vertex| {
            let hit = self.world.closest(&ray).filter(|hit| hit.object == vertex.object)?;
            self.specular_bounce(&ray, &hit, Some(vertex.event)).map(|bounce| bounce.next)
        })
    }

    /// What the surface at a hit does with a ray if it is perfectly smooth and does not shine: the event that is asked
    /// for, or the likelier one.
    fn specular_bounce(&self, ray: &Ray, hit: &Hit, wanted: Option<SpecularEvent>) -> Option<SpecularBounce> {
        let material = self.world.material(hit.object);
        if !may_be_specular(&material.surface) || material.emission.factor != Vec3::ZERO {
            return None;
        }
        let point = self.world.surface(ray, hit);
        let wo = -Vec3::from(ray.direction);
        let components = Components::new();
        let frames = self.frames(&point, wo, ray.time);
        let bsdf = self.bsdf(&point, &frames, &components);
        if bsdf.has_smooth_lobe() {
            return None;
        }
        let shading = self.shading(&bsdf, &point, &frames);
        // Of two lobes that share [0, 1), the likelier one has the middle; each end belongs to one of them.
        [0.5, 0.0, 1.0 - f32::EPSILON].into_iter().find_map(|lobe| {
            let scattered = shading.bsdf.sample(shading.frame.to_local(wo), [0.5, 0.5, lobe])?;
            let event =
                if scattered.lobe.is_transmission() { SpecularEvent::Transmitted } else { SpecularEvent::Reflected };
            let wi = shading.frame.to_world_direction(scattered.wi);
            let is_wanted = scattered.lobe.is_delta() && wanted.is_none_or(|wanted| wanted == event);
            let next = Ray { origin: point.spawn(wi), direction: wi.into(), ..*ray };
            (is_wanted && shading.sides_agree(wo, wi)).then_some(SpecularBounce { event, next })
        })
    }
}

/// Directions mirrored in a plane across a vector of any length; the identity for none.
fn mirroring(across: Vec3A) -> Mat3A {
    let normal = across.normalize_or_zero();
    Mat3A::IDENTITY - Mat3A::from_cols(normal.x * normal, normal.y * normal, normal.z * normal) * 2.0
}

/// Whether a perceptual roughness may be so small somewhere that it counts as none.
pub(super) fn may_be_smooth(roughness: &ScalarInput) -> bool {
    const SMOOTH: f32 = 0.05;
    roughness.texture.is_some() || roughness.factor < SMOOTH
}

/// Whether some place of a surface may be perfectly smooth. What it says of none need not be asked at a point.
fn may_be_specular(surface: &Surface) -> bool {
    match surface {
        Surface::Mirror { .. } | Surface::ThinDielectric { .. } | Surface::HeTorrance { .. } => true,
        Surface::Conductor { roughness, .. } | Surface::Dielectric { roughness, .. } => may_be_smooth(&roughness.u),
        Surface::CoatedDiffuse { reflectance, roughness, .. } => {
            may_be_smooth(&roughness.u) && (reflectance.factor == Vec3::ZERO || reflectance.texture.is_some())
        }
        Surface::CoatedConductor { roughness, coat_roughness, .. } => {
            may_be_smooth(&roughness.u) && may_be_smooth(&coat_roughness.u)
        }
        Surface::MetalRoughness(model) => {
            may_be_smooth(&model.roughness) && (model.metallic.factor > 0.0 || model.transmission.factor > 0.0)
        }
        Surface::Mix { first, second, .. } => may_be_specular(first) || may_be_specular(second),
        Surface::Diffuse { .. }
        | Surface::OrenNayar { .. }
        | Surface::DiffuseTransmission { .. }
        | Surface::Phong { .. }
        | Surface::Ward { .. } => false,
    }
}
