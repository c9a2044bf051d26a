//! What surfaces emit: the one rule for paths that meet them and for light sampling.

use crate::bsdf::passed_by_clearcoat;
use crate::scene::{Alpha, Material, MetalRoughness, Surface, Texture};
use glam::{Vec2, Vec3};

/// Radiance at texture coordinates in a direction at this cosine, at least 0, to the geometric normal: what a clear
/// coat turns back of it stays (KHR_materials_clearcoat). Not by the shading normal, which light sampling does not
/// know.
pub fn emitted(material: &Material, textures: &[Texture], uv: Vec2, cosine: f32) -> Vec3 {
    let radiance = material.emission.evaluate(textures, uv);
    match material.surface.has_clearcoat() {
        true => radiance * passed_by_coat(&material.surface, textures, uv, cosine),
        false => radiance,
    }
}

/// The radiance of a surface that is the same everywhere and in all directions.
pub(super) fn even_radiance(material: &Material) -> Option<Vec3> {
    let is_even = material.emission.texture.is_none()
        && matches!(material.alpha, Alpha::Opaque | Alpha::Unseen)
        && !material.surface.has_clearcoat();
    is_even.then_some(material.emission.factor)
}

fn passed_by_coat(surface: &Surface, textures: &[Texture], uv: Vec2, cosine: f32) -> f32 {
    match surface {
        Surface::MetalRoughness(MetalRoughness { clearcoat, clearcoat_roughness, .. }) => {
            let [clearcoat, roughness] = [clearcoat, clearcoat_roughness].map(|input| input.evaluate(textures, uv));
            passed_by_clearcoat(clearcoat, roughness, cosine)
        }
        Surface::Mix { first, second, amount } => {
            let [first, second] = [first, second].map(|part| passed_by_coat(part, textures, uv, cosine));
            first + (second - first) * amount.evaluate(textures, uv).clamp(0.0, 1.0)
        }
        // As `Surface::has_clearcoat` has it.
        _ => 1.0,
    }
}
