//! From a material and a surface point to a BSDF in a frame.

use super::PathTracer;
use crate::bsdf::Bsdf;
use crate::geometry::SurfacePoint;
use crate::geometry::surface::Frame;
use crate::light::LightReceiver;
use crate::scene::{Material, Surface};
use glam::Vec3;

/// A BSDF and the frame in which it works.
pub(super) struct Shading<'a> {
    pub(super) bsdf: Bsdf<'a>,
    pub(super) frame: Frame,
    pub(super) geometric_normal: Vec3,
    /// Index of refraction behind the surface over that in front of it; 1 where light is not refracted.
    pub(super) relative_ior: f32,
    /// Whether light can come from the other side.
    pub(super) transmits: bool,
}

impl Shading<'_> {
    /// What the choice of a light may know of this point: surfaces that transmit receive from both sides.
    pub(super) fn receiver(&self, point: &SurfacePoint, wo: Vec3) -> LightReceiver {
        let side = if wo.dot(self.geometric_normal) >= 0.0 { 1.0 } else { -1.0 };
        let normal = if self.transmits { Vec3::ZERO } else { side * self.geometric_normal };
        LightReceiver { position: point.position, normal }
    }

    /// Whether two world directions are on the same side of the surface by both normals, or on opposite sides by both.
    /// Where shading and geometric normal disagree, light would leak through: such pairs scatter nothing.
    pub(super) fn sides_agree(&self, a: Vec3, b: Vec3) -> bool {
        let geometric = a.dot(self.geometric_normal) * b.dot(self.geometric_normal);
        let shading = a.dot(self.frame.normal()) * b.dot(self.frame.normal());
        geometric * shading > 0.0
    }
}

impl PathTracer {
    /// The BSDF at a point seen from the direction `wo` (world, unit, away from the surface).
    pub(super) fn shading(&self, point: &SurfacePoint, wo: Vec3) -> Shading<'_> {
        let scene = self.world.scene();
        let material_id = self.world.material_of(point.object);
        let material = &scene.materials[material_id.0 as usize];
        let normal = seen_side(self.shading_normal(material, point), point.geometric_normal, wo);
        let frame = Frame::new(normal, point.tangent);
        let color = |input: &crate::scene::ColorInput| input.evaluate(&scene.textures, point.uv);
        let scalar = |input: &crate::scene::ScalarInput| input.evaluate(&scene.textures, point.uv);
        let bsdf = match &material.surface {
            Surface::Diffuse { reflectance } => Bsdf::lambert(color(reflectance)),
            Surface::Mirror { reflectance } => Bsdf::mirror(color(reflectance)),
            Surface::Conductor { eta, k, roughness } => Bsdf::conductor(*eta, *k, scalar(roughness)),
            Surface::Dielectric { ior, roughness, transmittance } => Bsdf::dielectric(
                *ior,
                scalar(roughness),
                color(transmittance),
                self.dielectric_tables[material_id.0 as usize].as_ref(),
            ),
            Surface::ThinDielectric { ior, transmittance } => Bsdf::thin_dielectric(*ior, color(transmittance)),
            Surface::MetalRoughness { base_color, metallic, roughness, ior, transmission } => Bsdf::metal_roughness(
                color(base_color),
                scalar(metallic),
                scalar(roughness),
                *ior,
                scalar(transmission),
            ),
        };
        let relative_ior = match material.surface {
            Surface::Dielectric { ior, .. } => ior,
            _ => 1.0,
        };
        let transmits = match material.surface {
            Surface::Diffuse { .. } | Surface::Mirror { .. } | Surface::Conductor { .. } => false,
            Surface::MetalRoughness { transmission, .. } => transmission.factor > 0.0,
            _ => true,
        };
        Shading { bsdf, frame, geometric_normal: point.geometric_normal, relative_ior, transmits }
    }

    fn shading_normal(&self, material: &Material, point: &SurfacePoint) -> Vec3 {
        let Some((lookup, strength)) = &material.normal_map else {
            return point.shading_normal;
        };
        let scene = self.world.scene();
        let texel = scene.textures[lookup.texture.0 as usize].sample_rgba(lookup.transform(point.uv));
        let mut mapped = texel.truncate() * 2.0 - 1.0;
        mapped.x *= strength;
        mapped.y *= strength;
        let frame = Frame::new(point.shading_normal, point.tangent);
        let local = Vec3::new(mapped.x, mapped.y * point.handedness, mapped.z);
        frame.to_world(local).normalize_or(point.shading_normal)
    }
}

/// A shading normal that the viewer can see: one that points away from the viewer, although the surface faces them, is
/// turned back to just this side of perpendicular, so that bumps at silhouettes do not go black.
fn seen_side(normal: Vec3, geometric_normal: Vec3, wo: Vec3) -> Vec3 {
    let facing = if wo.dot(geometric_normal) >= 0.0 { 1.0 } else { -1.0 };
    let cosine = facing * wo.dot(normal);
    const LEAST_COSINE: f32 = 0.01;
    if cosine >= LEAST_COSINE {
        return normal;
    }
    (normal + facing * wo * (LEAST_COSINE - cosine)).normalize_or(geometric_normal)
}
