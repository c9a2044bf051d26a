//! The camera of scenes that bring none: a three-quarter view with everything in the picture.

use crate::geometry::tree;
use crate::scene::{Camera, Instance, Mesh, Sphere};
use glam::{Affine3A, Vec3, Vec3A};

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

/// Corners of triangles up to which each is put into the world; of more, the corners of their meshes' boxes are.
const MAX_CORNERS: usize = 30_000_000;

/// The bounds of everything that is rendered, or somewhat larger ones where a scene places millions of triangles. Only
/// vertices that triangles use count.
pub fn bounds(meshes: &[Mesh], instances: &[Instance], spheres: &[Sphere]) -> Bounds {
    let corners = |instance: &Instance| 3 * meshes[instance.mesh.0 as usize].triangles.len();
    let mut all = Bounds::EMPTY;
    if instances.iter().map(corners).sum::<usize>() <= MAX_CORNERS {
        for instance in instances {
            all = all.union(Bounds::of_mesh(&meshes[instance.mesh.0 as usize], &instance.to_world));
        }
    } else {
        let own: Vec<Bounds> = meshes.iter().map(|mesh| Bounds::of_mesh(mesh, &Affine3A::IDENTITY)).collect();
        for instance in instances {
            all = all.union(own[instance.mesh.0 as usize].transformed(&instance.to_world));
        }
    }
    for sphere in spheres {
        all = all.union(Bounds { min: sphere.center - sphere.radius, max: sphere.center + sphere.radius });
    }
    all
}

impl Bounds {
    /// The bounds of nothing.
    const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    fn of_mesh(mesh: &Mesh, to_world: &Affine3A) -> Self {
        let (mut min, mut max) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        for &index in mesh.triangles.iter().flatten() {
            let point = to_world.transform_point3a(mesh.positions[index as usize].into());
            (min, max) = (min.min(point), max.max(point));
        }
        Self { min: min.into(), max: max.into() }
    }

    /// The box's eight corners.
    pub(super) fn corners(self) -> [Vec3A; 8] {
        tree::Bounds { min: self.min.into(), max: self.max.into() }.corners()
    }

    /// The bounds of the box after a transform; nothing stays nothing.
    fn transformed(self, to_world: &Affine3A) -> Self {
        if self.min.x > self.max.x {
            return self;
        }
        self.corners().into_iter().fold(Self::EMPTY, |all, corner| {
            let point = to_world.transform_point3a(corner).into();
            all.union(Self { min: point, max: point })
        })
    }
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
    let tan_vertical = (0.5 * Camera::USUAL_FOV_DEG).to_radians().tan() / (1.0 + MARGIN);
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
        ..Camera::pinhole(center - distance * forward, forward, Vec3::Y, Camera::USUAL_FOV_DEG)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_of_placed_meshes_hold_them() {
        let mesh = crate::scene::load::shapes::cuboid(Vec3::new(-1.0, 0.0, 2.0), Vec3::new(3.0, 1.0, 5.0));
        let turned = Affine3A::from_rotation_y(0.7) * Affine3A::from_translation(Vec3::X);
        let (own, exact) = (Bounds::of_mesh(&mesh, &Affine3A::IDENTITY), Bounds::of_mesh(&mesh, &turned));
        let around = own.transformed(&turned);
        assert!(around.min.abs_diff_eq(exact.min, 1e-5) && around.max.abs_diff_eq(exact.max, 1e-5));
        assert_eq!(Bounds::EMPTY.transformed(&turned), Bounds::EMPTY);
    }

    #[test]
    fn every_corner_is_in_the_picture_and_one_is_near_its_edge() {
        for (size, aspect) in [(Vec3::ONE, 1.0), (Vec3::new(10.0, 0.1, 3.0), 1.5), (Vec3::new(0.2, 40.0, 0.3), 0.6)] {
            let bounds = Bounds { min: Vec3::splat(5.0), max: Vec3::splat(5.0) + size };
            let camera = framed(bounds, aspect);
            let right = camera.forward.cross(camera.up).normalize();
            let up = right.cross(camera.forward);
            let tan = (0.5 * Camera::USUAL_FOV_DEG).to_radians().tan();
            let mut widest: f32 = 0.0;
            for corner in bounds.corners() {
                let point = Vec3::from(corner) - camera.position;
                let depth = point.dot(camera.forward);
                assert!(depth > 0.0);
                widest =
                    widest.max(point.dot(right).abs() / depth / tan / aspect).max(point.dot(up).abs() / depth / tan);
            }
            assert!((0.9..0.96).contains(&widest), "{widest}");
        }
    }
}
