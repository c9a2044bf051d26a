//! The frame at a surface point: its normal with relief and as the viewer can see it, and the tangent of stretched
//! facets.

use super::{PathTracer, relief};
use crate::geometry::SurfacePoint;
use crate::geometry::surface::Frame;
use crate::scene::{CoatRelief, Material, Relief, Surface, Texture};
use glam::{Mat3, Vec3};

/// The frame in which a BSDF works, and what else it has to know of normals.
pub(super) struct Frames {
    /// Frame of the coat where that has a normal of its own, else of all layers.
    pub(super) frame: Frame,
    /// Rotation from [`Self::frame`] to the frame of what lies beneath such a coat.
    pub(super) beneath_coat: Option<Mat3>,
    /// Normal of what has the material's relief.
    pub(super) normal: Vec3,
}

impl PathTracer {
    /// The frames at a point, seen from the direction `wo` (world, unit, away from the surface) at a share of the open
    /// shutter.
    #[inline(always)]
    pub(super) fn frames(&self, point: &SurfacePoint, wo: Vec3, time: f32) -> Frames {
        let scene = self.world.scene();
        let material = self.world.material(point.object);
        let normal_under = |relief: Option<&Relief>| {
            let normal =
                seen_side(relief::shading_normal(&self.world, relief, point, time), point.geometric_normal, wo);
            if is_diffuse(&material.surface) { normal } else { mirroring_outwards(normal, point.geometric_normal, wo) }
        };
        let normal = normal_under(material.relief.as_ref());
        let frame = stretched_frame(material, &scene.textures, point, normal);
        let Some(of_coat) = relief_of_other_coat(material) else {
            return Frames { frame, beneath_coat: None, normal };
        };
        let coat = Frame::new(normal_under(of_coat), None);
        let beneath_coat = Mat3::from_cols_array_2d(
            &[Vec3::X, Vec3::Y, Vec3::Z].map(|axis| frame.to_local(coat.to_world(axis)).to_array()),
        );
        Frames { frame: coat, beneath_coat: Some(beneath_coat), normal }
    }
}

/// The relief, or none, of a clear coat whose normal is another than that of what it covers.
fn relief_of_other_coat(material: &Material) -> Option<Option<&Relief>> {
    let Surface::MetalRoughness(model) = &material.surface else { return None };
    match &model.coat_relief {
        CoatRelief::Own(of_coat) if model.clearcoat.factor > 0.0 && *of_coat != material.relief => {
            Some(of_coat.as_ref())
        }
        _ => None,
    }
}

/// The frame around a normal whose x axis is the tangent of anisotropic surfaces.
#[inline(always)]
fn stretched_frame(material: &Material, textures: &[Texture], point: &SurfacePoint, normal: Vec3) -> Frame {
    let along_u = Frame::new(normal, point.tangent);
    let Some(stretch) = &material.stretch else { return along_u };
    let direction = stretch.evaluate(textures, point.uv);
    let tangent = along_u.to_world(Vec3::new(direction.x, direction.y * point.handedness, 0.0));
    Frame::new(normal, Some(tangent))
}

/// A shading normal that the viewer can see: one that points away from the viewer, although the surface faces them, is
/// turned back to just this side of perpendicular, so that bumps at silhouettes do not go black.
fn seen_side(normal: Vec3, geometric_normal: Vec3, wo: Vec3) -> Vec3 {
    let facing = if wo.dot(geometric_normal) >= 0.0 { 1.0 } else { -1.0 };
    let cosine = facing * wo.dot(normal);
    const MIN_COSINE: f32 = 0.01;
    if cosine >= MIN_COSINE {
        return normal;
    }
    (normal + facing * wo * (MIN_COSINE - cosine)).normalize_or(geometric_normal)
}

/// Whether a surface scatters nothing into directions of its own.
fn is_diffuse(surface: &Surface) -> bool {
    match surface {
        Surface::Diffuse { .. } | Surface::OrenNayar { .. } | Surface::DiffuseTransmission { .. } => true,
        Surface::Mix { first, second, .. } => is_diffuse(first) && is_diffuse(second),
        Surface::Mirror { .. }
        | Surface::Conductor { .. }
        | Surface::Dielectric { .. }
        | Surface::ThinDielectric { .. }
        | Surface::CoatedDiffuse { .. }
        | Surface::CoatedConductor { .. }
        | Surface::Phong { .. }
        | Surface::Ward { .. }
        | Surface::HeTorrance { .. }
        | Surface::MetalRoughness(_) => false,
    }
}

/// A shading normal, seen from `wo`, about which a mirror reflects the viewer away from the face: one about which it
/// would not is turned until it just does (Keller and others, "The Iray Light Transport Simulation and Rendering
/// System", 2017), since what goes below the face is lost.
#[inline]
fn mirroring_outwards(normal: Vec3, geometric_normal: Vec3, wo: Vec3) -> Vec3 {
    let (height_of_viewer, cosine) = (wo.dot(geometric_normal), wo.dot(normal));
    let height = 2.0 * cosine * normal.dot(geometric_normal) - height_of_viewer;
    // A flat face keeps its own normal at any angle, whatever rounding says.
    let least_height = (0.9 * height_of_viewer.abs()).min(0.01).copysign(height_of_viewer);
    if height * height_of_viewer.signum() >= least_height.abs() {
        return normal;
    }
    let mirrored = 2.0 * cosine * normal - wo;
    mirroring_at(least_height, mirrored - height * geometric_normal, geometric_normal, wo)
}

/// The normal about which a mirror reflects `wo` to this height over the face, in the plane of the face's normal
/// and a vector along the face.
#[cold]
fn mirroring_at(height: f32, along_face: Vec3, geometric_normal: Vec3, wo: Vec3) -> Vec3 {
    let Some(along_face) = along_face.try_normalize() else { return geometric_normal };
    let mirrored = (1.0 - height * height).sqrt() * along_face + height * geometric_normal;
    height.signum() * (wo + mirrored).normalize_or(height.signum() * geometric_normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{hash_words, unit_of_hash};
    use crate::scene::{Encoding, StretchDirection, Texels, TextureId, TextureLookup, Wrap};
    use glam::Vec2;
    use std::sync::Arc;

    fn texture(direction: [u8; 2]) -> Texture {
        Texture {
            name: String::new(),
            width: 1,
            height: 1,
            texels: Texels::Bytes(Arc::new(vec![[direction[0], direction[1], 255, 255]]), Encoding::Linear),
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            nearest: false,
        }
    }

    /// u grows along +x; the top of the picture is at +y, or at −y where it is mirrored.
    #[test]
    fn facets_are_stretched_where_rotation_and_picture_say() {
        let third = std::f32::consts::FRAC_PI_3;
        for (rotation, direction, handedness, expected) in [
            (0.0, [255, 128], 1.0, Vec3::X),
            (third, [255, 128], 1.0, Vec3::new(0.5, 0.866, 0.0)),
            (third, [255, 128], -1.0, Vec3::new(0.5, -0.866, 0.0)),
            (0.0, [128, 255], 1.0, Vec3::Y),
            (0.0, [128, 0], -1.0, Vec3::Y),
            (third, [128, 255], 1.0, Vec3::new(-0.866, 0.5, 0.0)),
            (third, [128, 128], 1.0, Vec3::new(0.5, 0.866, 0.0)),
        ] {
            let mut material = Material::plain("test", Surface::clear_dielectric(1.5));
            let map = Some(TextureLookup::plain(TextureId(0)));
            material.stretch = Some(StretchDirection { rotation, map });
            let point = SurfacePoint {
                position: Vec3::ZERO,
                geometric_normal: Vec3::Z,
                shading_normal: Vec3::Z,
                tangent: Some(3.0 * Vec3::X),
                handedness,
                uv: Vec2::splat(0.5),
                color: Vec3::ONE,
                object: 0,
                triangle: 0,
                offset: 0.0,
            };
            let frame = stretched_frame(&material, &[texture(direction)], &point, Vec3::Z);
            let tangent = frame.to_world(Vec3::X);
            assert!(tangent.abs_diff_eq(expected, 0.01), "{rotation} {direction:?} {handedness}: {tangent}");
        }
    }

    fn random_direction(index: u64, dimension: u64) -> Vec3 {
        let number = |axis| 2.0 * unit_of_hash(hash_words(index, dimension + axis)) - 1.0;
        Vec3::new(number(0), number(1), number(2)).normalize_or(Vec3::Z)
    }

    /// Rounding counts where faces are seen from their edges, so those are left out.
    #[test]
    fn turned_normals_mirror_the_viewer_away_from_the_face() {
        for i in 0..10_000 {
            let [face, wo, other] = [0, 3, 6].map(|dimension| random_direction(i, dimension));
            let normal = (other + other.dot(face).signum() * face * 0.2).normalize();
            let normal = seen_side(normal * normal.dot(face).signum(), face, wo);
            let turned = mirroring_outwards(normal, face, wo);
            let facing = wo.dot(face).signum();
            let height = |normal: Vec3| facing * (2.0 * wo.dot(normal) * normal - wo).dot(face);
            if facing * wo.dot(face) < 0.01 {
                continue;
            }
            let least = (0.9 * facing * wo.dot(face)).min(0.01);
            assert!((turned.length() - 1.0).abs() < 1e-5 && facing * turned.dot(wo) > 0.0, "{i}: {turned}");
            assert!(height(turned) > least - 1e-4, "{i}: {} of {least}", height(turned));
            assert!(turned == normal || height(normal) < least + 1e-4, "{i}: {normal} became {turned}");
        }
    }

    /// Also where the face is nearly seen from its edge.
    #[test]
    fn a_faces_own_normal_stays() {
        for i in 0..10_000 {
            let face = random_direction(i, 0);
            let along = face.any_orthonormal_vector();
            for height in [0.0, 1e-8, 1e-6, 1e-3, 0.5, -1e-7, -0.1] {
                let wo = (along + height * face).normalize();
                assert_eq!(mirroring_outwards(face, face, wo), face, "{face} {height}");
            }
        }
    }
}
