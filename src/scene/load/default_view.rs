//! The camera of scenes that bring none: a three-quarter view with everything in the picture.

use crate::scene::{Camera, Instance, Mesh, Sphere};
use glam::{Vec3, Vec3A};

const VERTICAL_FOV_DEG: f32 = 40.0;
/// From the front (+z) towards +x, and above the horizon.
const AZIMUTH_DEG: f32 = 35.0;
const ELEVATION_DEG: f32 = 20.0;
/// Empty border as a share of the half picture.
const MARGIN: f32 = 0.06;

/// Axis-aligned bounds in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest corner.
    pub min: Vec3,
    /// Highest corner.
    pub max: Vec3,
}

/// The bounds of everything that is rendered. Only vertices that triangles use count.
pub fn bounds(meshes: &[Mesh], instances: &[Instance], spheres: &[Sphere]) -> Bounds {
    let mut min = Vec3A::INFINITY;
    let mut max = Vec3A::NEG_INFINITY;
    for instance in instances {
        let mesh = &meshes[instance.mesh.0 as usize];
        for &index in mesh.triangles.iter().flatten() {
            let point = instance.to_world.transform_point3a(mesh.positions[index as usize].into());
            min = min.min(point);
            max = max.max(point);
        }
    }
    for sphere in spheres {
        min = min.min(Vec3A::from(sphere.center - sphere.radius));
        max = max.max(Vec3A::from(sphere.center + sphere.radius));
    }
    Bounds { min: min.into(), max: max.into() }
}

/// A camera with all of the bounds in a picture of this aspect (width / height).
pub fn framed(bounds: Bounds, aspect: f32) -> Camera {
    let (sin_azimuth, cos_azimuth) = AZIMUTH_DEG.to_radians().sin_cos();
    let (sin_elevation, cos_elevation) = ELEVATION_DEG.to_radians().sin_cos();
    let forward = -Vec3::new(cos_elevation * sin_azimuth, sin_elevation, cos_elevation * cos_azimuth);
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);

    // Half the sum first, in case both are near the largest float.
    let center = 0.5 * bounds.min + 0.5 * bounds.max;
    let half = 0.5 * bounds.max - 0.5 * bounds.min;
    let tan_vertical = (0.5 * VERTICAL_FOV_DEG).to_radians().tan() / (1.0 + MARGIN);
    let tan_horizontal = tan_vertical * aspect;
    let mut distance: f32 = 0.0;
    for corner in 0..8 {
        let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let offset = half * Vec3::new(sign(0), sign(1), sign(2));
        // A corner this far sideways must be at least this far in front of the camera.
        let needed = (offset.dot(right).abs() / tan_horizontal).max(offset.dot(up).abs() / tan_vertical);
        distance = distance.max(needed - offset.dot(forward));
    }
    // A single point has no size: any distance frames it.
    let distance = if distance > 0.0 && distance.is_finite() { distance } else { 1.0 };
    Camera {
        focus_distance: distance,
        ..Camera::pinhole(center - distance * forward, forward, Vec3::Y, VERTICAL_FOV_DEG)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_corner_is_in_the_picture_and_one_is_near_its_edge() {
        for (size, aspect) in [(Vec3::ONE, 1.0), (Vec3::new(10.0, 0.1, 3.0), 1.5), (Vec3::new(0.2, 40.0, 0.3), 0.6)] {
            let bounds = Bounds { min: Vec3::splat(5.0), max: Vec3::splat(5.0) + size };
            let camera = framed(bounds, aspect);
            let right = camera.forward.cross(camera.up).normalize();
            let up = right.cross(camera.forward);
            let tan = (0.5 * VERTICAL_FOV_DEG).to_radians().tan();
            let mut widest: f32 = 0.0;
            for corner in 0..8 {
                let pick = |bit: u32| if corner >> bit & 1 == 0 { 0.0 } else { 1.0 };
                let point = bounds.min + size * Vec3::new(pick(0), pick(1), pick(2)) - camera.position;
                let depth = point.dot(camera.forward);
                assert!(depth > 0.0);
                widest =
                    widest.max(point.dot(right).abs() / depth / tan / aspect).max(point.dot(up).abs() / depth / tan);
            }
            assert!((0.9..0.96).contains(&widest), "{widest}");
        }
    }
}
