//! Shading normals under normal and height maps. The surface itself stays as it is: nothing is displaced.

use crate::geometry::surface::{Frame, SurfaceDerivatives};
use crate::geometry::{SurfacePoint, World};
use crate::scene::{HeightMap, HeightUnit, Relief, Texture, TextureLookup};
use glam::{Vec2, Vec3};

/// The shading normal under a relief at a point at a share of the open shutter: unit, on the mesh's shading normal's
/// side.
pub(super) fn shading_normal(world: &World, relief: Option<&Relief>, point: &SurfacePoint, time: f32) -> Vec3 {
    let textures = &world.scene().textures;
    match relief {
        None => point.shading_normal,
        Some(Relief::Normals { map, strength }) => mapped(textures, map, *strength, point),
        Some(Relief::Heights(heights)) => {
            let gradient = heights.gradient(textures, point.uv);
            if gradient == Vec2::ZERO {
                return point.shading_normal;
            }
            world.derivatives(point, time).map_or(point.shading_normal, |surface| {
                tilted(point.shading_normal, &surface, gradient * unit_height(heights, &surface))
            })
        }
    }
}

fn mapped(textures: &[Texture], map: &TextureLookup, strength: f32, point: &SurfacePoint) -> Vec3 {
    let texel = textures[map.texture.0 as usize].sample_rgba(map.transform(point.uv));
    let mut mapped = texel.truncate() * 2.0 - 1.0;
    mapped.x *= strength;
    mapped.y *= strength;
    let frame = Frame::new(point.shading_normal, point.tangent);
    let local = Vec3::new(mapped.x, mapped.y * point.handedness, mapped.z);
    frame.to_world(local).normalize_or(point.shading_normal)
}

/// What a height of 1 is in world units.
fn unit_height(heights: &HeightMap, surface: &SurfaceDerivatives) -> f32 {
    match (heights.unit, &heights.height.texture) {
        (HeightUnit::PictureWidth, Some((lookup, _))) => {
            lookup.along_picture(surface.along_u, surface.along_v).length()
        }
        _ => 1.0,
    }
}

/// The normal of a surface that is raised along its `normal` by a height of this `gradient` over (u, v), in world
/// units.
///
/// Blinn 1978, as the gradient ∇h in the plane of the normal with ∇h · ∂p/∂u = ∂h/∂u and ∇h · ∂p/∂v = ∂h/∂v (Mikkelsen
/// 2010): the normal is n − ∇h. The height itself is taken to be small beside the surface's radius of curvature. Where
/// u and v do not span a surface, or a slope is beyond floats, the normal stays.
fn tilted(normal: Vec3, surface: &SurfaceDerivatives, gradient: Vec2) -> Vec3 {
    let (across_u, across_v) = (surface.along_v.cross(normal), normal.cross(surface.along_u));
    let area = surface.along_u.dot(across_u);
    let turned = normal - (gradient.x * across_u + gradient.y * across_v) / area;
    if turned.is_finite() { turned.normalize_or(normal) } else { normal }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANE: SurfaceDerivatives = SurfaceDerivatives { along_u: Vec3::X, along_v: Vec3::Y };

    #[test]
    fn a_ramp_turns_the_normal_by_the_angle_of_its_slope() {
        for slope in [-3.0_f32, -0.1, 1e-4, 0.5, 2.0] {
            let turned = tilted(Vec3::Z, &PLANE, Vec2::new(slope, 0.0));
            let angle = turned.x.atan2(turned.z);
            assert!((angle + slope.atan()).abs() < 1e-6 && turned.y == 0.0, "slope {slope}: {turned}");
        }
    }

    /// The surface (x, y, h(x, y)) has its normal along (−h_x, −h_y, 1), however u and v lie in it: oblique, stretched,
    /// mirrored.
    #[test]
    fn coordinates_do_not_matter() {
        let slopes = Vec2::new(0.7, -0.3);
        let expected = Vec3::new(-slopes.x, -slopes.y, 1.0).normalize();
        for (u, v) in [
            (Vec2::new(3.0, 0.5), Vec2::new(-1.0, 0.2)),
            (Vec2::Y, Vec2::X),
            (Vec2::new(1e-3, 1e-3), Vec2::new(-2e3, 0.0)),
        ] {
            let surface = SurfaceDerivatives { along_u: u.extend(0.0), along_v: v.extend(0.0) };
            let turned = tilted(Vec3::Z, &surface, Vec2::new(slopes.dot(u), slopes.dot(v)));
            assert!(turned.abs_diff_eq(expected, 1e-5), "{surface:?}: {turned}, expected {expected}");
        }
    }

    #[test]
    fn what_spans_no_surface_keeps_its_normal() {
        let parallel = SurfaceDerivatives { along_u: Vec3::X, along_v: 2.0 * Vec3::X };
        let nothing = SurfaceDerivatives { along_u: Vec3::ZERO, along_v: Vec3::Y };
        let upright = SurfaceDerivatives { along_u: Vec3::X, along_v: Vec3::Z };
        for surface in [parallel, nothing, upright] {
            assert_eq!(tilted(Vec3::Z, &surface, Vec2::ONE), Vec3::Z, "{surface:?}");
        }
        for gradient in [Vec2::new(f32::INFINITY, 0.0), Vec2::splat(f32::NAN), Vec2::splat(f32::MAX)] {
            let turned = tilted(Vec3::Z, &PLANE, gradient);
            assert!(turned.is_finite() && (turned.length() - 1.0).abs() < 1e-6, "{gradient}: {turned}");
        }
    }
}
