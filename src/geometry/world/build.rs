//! What the trees are built of: triangles, and the boxes of what is placed.

use super::super::tree::Bounds;
use super::super::wide_tree::TriangleRef;
use crate::scene::{Instance, Motion, Scene};
use glam::Vec3A;

/// A mesh in its own space.
pub(super) fn own_triangles(scene: &Scene, mesh: usize) -> Vec<([Vec3A; 3], TriangleRef)> {
    let mesh = &scene.meshes[mesh];
    mesh.triangles
        .iter()
        .enumerate()
        .map(|(triangle, indices)| {
            let corners = indices.map(|i| Vec3A::from(mesh.positions[i as usize]));
            (corners, TriangleRef { instance: 0, triangle: triangle as u32 })
        })
        .collect()
}

/// All meshes that are placed once, in world space.
pub(super) fn fixed_triangles(scene: &Scene, uses: &[u32]) -> Vec<([Vec3A; 3], TriangleRef)> {
    let mut triangles = Vec::new();
    for (number, instance) in scene.instances.iter().enumerate() {
        if uses[instance.mesh.0 as usize] != 1 {
            continue;
        }
        for (corners, reference) in own_triangles(scene, instance.mesh.0 as usize) {
            let world = corners.map(|p| instance.to_world.transform_point3a(p));
            triangles.push((world, TriangleRef { instance: number as u32, ..reference }));
        }
    }
    triangles
}

/// Vertices of all placed instances up to which boxes are made around each; of more, around the corners of the meshes' boxes.
pub(super) const MOST_VERTICES: usize = 30_000_000;

/// What a box is made around.
#[derive(Clone, Copy, Debug)]
pub(super) enum Around {
    /// As tightly as can be.
    Vertices,
    /// The corners of the mesh's own box.
    OwnBox,
}

/// Bounds of an instance whose mesh has these bounds of its own.
pub(super) fn placed_bounds(scene: &Scene, instance: &Instance, own: Bounds, around: Around) -> Bounds {
    let place = |point| instance.to_world.transform_point3a(point);
    match around {
        Around::Vertices => {
            let mesh = &scene.meshes[instance.mesh.0 as usize];
            Bounds::of_points(mesh.positions.iter().map(|&point| place(point.into())))
        }
        Around::OwnBox => Bounds::of_points(own.corners().map(place)),
    }
}

/// Where things with these bounds in their own space can be while the shutter is open.
pub(super) fn swept_bounds(motion: &Motion, own: Bounds) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    motion.sweep(&own.corners(), |center, radius| {
        bounds = bounds.union(Bounds { min: center - radius, max: center + radius });
    });
    bounds
}
