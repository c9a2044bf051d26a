//! What is at a hit: from a place on a triangle or sphere at a time to a [`SurfacePoint`].

use super::{Hit, World};
use crate::geometry::face::{Face, scaled_to_one};
use crate::geometry::mesh_tree::TriangleShape;
use crate::geometry::offset;
use crate::geometry::simd::prefetch;
use crate::geometry::surface::SurfaceDerivatives;
use crate::geometry::{Ray, SurfacePoint};
use crate::scene::pictured_edges::PicturedEdges;
use crate::scene::{Instance, Mesh, Scene, SpherePlace};
use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};
use std::f32::consts::{PI, TAU};

/// What shading needs of an instance besides its transform.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    /// Cofactors of the transform: turns normals, and turns them over where the transform mirrors.
    normal_matrix: Mat3A,
    /// −1 where the transform mirrors.
    flip: f32,
    /// Whether the material asks for a tangent.
    needs_tangent: bool,
    /// The tree that the mesh shares with others or moves with, in coordinates of its own; `None` where it is part of
    /// the fixed tree, in world space.
    shared: Option<u32>,
}

impl Placement {
    pub(super) fn new(scene: &Scene, instance: &Instance, shared: Option<u32>) -> Self {
        let needs_tangent = scene.materials[instance.material.0 as usize].needs_tangent();
        Self { normal_matrix: Mat3A::ZERO, flip: 1.0, needs_tangent, shared }.moved_to(&instance.to_world)
    }

    /// The same of an instance that is elsewhere.
    fn moved_to(self, to_world: &Affine3A) -> Self {
        let m = scaled_to_one(to_world.matrix3);
        let flip = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        let cofactors = Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        Self { normal_matrix: cofactors * flip, flip, ..self }
    }

    /// A shading normal in the world, of the mean of the corners' normals in the mesh. A file may wind its triangles
    /// against its normals; the geometric side is what counts.
    #[inline(always)]
    fn blended_normal(&self, of_corners: Vec3, geometric_normal: Vec3) -> Vec3 {
        let n = Vec3::from(self.normal_matrix * Vec3A::from(of_corners)).normalize_or(geometric_normal);
        if n.dot(geometric_normal) < 0.0 { -n } else { n }
    }
}

impl World {
    /// Object space to world space of an instance at a share of the open shutter.
    pub fn transform_at(&self, object: u32, time: f32) -> Affine3A {
        self.scene.instances[object as usize].transform_at(time)
    }

    /// Where a sphere is at a share of the open shutter.
    pub fn sphere_at(&self, object: u32, time: f32) -> SpherePlace {
        self.scene.spheres[object as usize - self.scene.instances.len()].place_at(time)
    }

    /// The translation of a transform that puts a mesh into the world where its tree is in coordinates of its own; zero
    /// where that is in world space.
    pub(crate) fn translation_of_tree(&self, object: u32, to_world: &Affine3A) -> Vec3A {
        match self.placements[object as usize].shared {
            None => Vec3A::ZERO,
            Some(_) => to_world.translation,
        }
    }

    /// World-space corners of a triangle of an instance at a share of the open shutter.
    pub fn triangle_corners(&self, object: u32, triangle: u32, time: f32) -> [Vec3; 3] {
        self.placed_corners(object, triangle, &self.transform_at(object, time))
    }

    /// World-space corners of a triangle of an instance that this transform places.
    pub(crate) fn placed_corners(&self, object: u32, triangle: u32, to_world: &Affine3A) -> [Vec3; 3] {
        let mesh = &self.scene.meshes[self.scene.instances[object as usize].mesh.0 as usize];
        mesh.triangles[triangle as usize].map(|i| to_world.transform_point3(mesh.positions[i as usize]))
    }

    /// How the surface at a point goes along with its texture coordinates, at a share of the open shutter; `None` where
    /// it has none, or they do not span it (the poles of spheres, triangles whose corners share a place in the
    /// picture).
    pub fn derivatives(&self, point: &SurfacePoint, time: f32) -> Option<SurfaceDerivatives> {
        let derivatives = match self.scene.instances.get(point.object as usize) {
            None => sphere_derivatives(&self.sphere_at(point.object, time), point.geometric_normal.into()),
            Some(instance) => {
                let mesh = &self.scene.meshes[instance.mesh.0 as usize];
                if mesh.uvs.is_empty() {
                    return None;
                }
                let corners = self.triangle_corners(point.object, point.triangle, time);
                let edges = [corners[1] - corners[0], corners[2] - corners[0]];
                let edges = pictured_edges(mesh, point.triangle, edges);
                let inverse_area = 1.0 / edges.doubled_area();
                SurfaceDerivatives {
                    along_u: edges.along_u_times_area() * inverse_area,
                    along_v: edges.along_v_times_area() * inverse_area,
                }
            }
        };
        let SurfaceDerivatives { along_u, along_v } = derivatives;
        let spans = along_u.is_finite() && along_v.is_finite() && along_u.cross(along_v) != Vec3::ZERO;
        spans.then_some(derivatives)
    }

    /// Asks for the numbers of the corners of what was hit, which [`Self::prefetch_corners`] reads.
    #[inline]
    pub(crate) fn prefetch_indices(&self, hit: &Hit) {
        if let Some(mesh) = self.mesh_with_corners(hit) {
            prefetch(&mesh.triangles[hit.triangle as usize]);
        }
    }

    /// Asks for normals and texture coordinates of the corners, which [`Self::surface`] reads.
    #[inline]
    pub(crate) fn prefetch_corners(&self, hit: &Hit) {
        let Some(mesh) = self.mesh_with_corners(hit) else { return };
        for corner in mesh.triangles[hit.triangle as usize].map(|corner| corner as usize) {
            mesh.normals.get(corner).into_iter().for_each(prefetch);
            if !self.scene.textures.is_empty() {
                mesh.uvs.get(corner).into_iter().for_each(prefetch);
            }
        }
    }

    /// The mesh that was hit if [`Self::surface`] reads what its corners have.
    #[inline]
    fn mesh_with_corners(&self, hit: &Hit) -> Option<&Mesh> {
        let instance = self.scene.instances.get(hit.object as usize)?;
        let mesh = &self.scene.meshes[instance.mesh.0 as usize];
        let reads = !mesh.normals.is_empty() || !(mesh.uvs.is_empty() || self.scene.textures.is_empty());
        reads.then_some(mesh)
    }

    /// The surface at a hit.
    #[inline(always)]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        match self.scene.instances.get(hit.object as usize) {
            Some(instance) => self.surface_of_triangle(instance, ray, hit),
            None => self.surface_of_sphere(ray, hit),
        }
    }

    fn surface_of_sphere(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let place = self.sphere_at(hit.object, ray.time);
        let normal_a = ((ray.origin + ray.direction * hit.distance) - place.center).normalize_or(Vec3A::Y);
        let normal = Vec3::from(normal_a);
        let position = Vec3::from(place.center) + place.radius * normal;
        let needs_tangent = self.material(hit.object).needs_tangent();
        // −1 where the sphere is mirrored.
        let flip = place.axes.determinant().signum();
        let along_u = || flip * place.axes.y_axis.cross(normal_a).normalize_or(place.axes.x_axis);
        SurfacePoint {
            position,
            geometric_normal: normal,
            shading_normal: normal,
            tangent: needs_tangent.then(|| along_u().into()),
            handedness: if self.scene.bitangent_ignores_v { 1.0 } else { flip },
            uv: if self.scene.textures.is_empty() { Vec2::ZERO } else { place.uv(normal_a) },
            color: Vec3::ONE,
            object: hit.object,
            triangle: 0,
            offset: offset::of_sphere(position, place.radius),
        }
    }

    #[inline(always)]
    fn surface_of_triangle(&self, instance: &Instance, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let mesh = &self.scene.meshes[instance.mesh.0 as usize];
        let mut to_world = &instance.to_world;
        let mut placement = &self.placements[hit.object as usize];
        let moved;
        if let Some(motion) = &instance.motion {
            let transform = motion.at(ray.time);
            moved = (transform, placement.moved_to(&transform));
            (to_world, placement) = (&moved.0, &moved.1);
        }
        let (shape, translation) = match placement.shared {
            None => (self.fixed.shape(hit.place), Vec3A::ZERO),
            Some(tree) => (self.shared[tree as usize].shape(hit.place).transformed(to_world), to_world.translation),
        };
        let TriangleShape { corner, edges: [edge_1, edge_2] } = shape;
        let offset = offset::of_triangle(corner, [edge_1, edge_2], translation);
        let (b0, b1, b2) = (1.0 - hit.b1 - hit.b2, hit.b1, hit.b2);
        let position = Vec3::from(corner + edge_1 * b1 + edge_2 * b2);
        let face = Face::spanned_by([edge_1, edge_2]);
        let geometric_normal = face.map_or(Vec3::Y, |face| placement.flip * face.normal);
        let indices = || mesh.triangles[hit.triangle as usize].map(|i| i as usize);
        let shading_normal = if mesh.normals.is_empty() {
            geometric_normal
        } else {
            let [n0, n1, n2] = indices().map(|i| mesh.normals[i]);
            placement.blended_normal(n0 * b0 + n1 * b1 + n2 * b2, geometric_normal)
        };
        let (tangent, handedness) = if !placement.needs_tangent {
            (None, 1.0)
        } else if mesh.tangents.is_empty() {
            let (tangent, handedness) = tangent_from_uv(mesh, hit.triangle, [edge_1.into(), edge_2.into()]);
            (Some(tangent), handedness * placement.flip)
        } else {
            let [t0, t1, t2] = indices().map(|i| mesh.tangents[i]);
            let blended = t0.truncate() * b0 + t1.truncate() * b1 + t2.truncate() * b2;
            let world = Vec3::from(to_world.matrix3 * Vec3A::from(blended));
            (Some(world.normalize_or(Vec3::X)), if t0.w < 0.0 { -placement.flip } else { placement.flip })
        };
        let handedness = if self.scene.bitangent_ignores_v { 1.0 } else { handedness };
        let uv = match self.scene.textures.is_empty() {
            true => Vec2::ZERO,
            false => interpolate_uv(mesh, hit.triangle, b1, b2),
        };
        SurfacePoint {
            position,
            geometric_normal,
            shading_normal,
            tangent,
            handedness,
            uv,
            color: interpolate_color(mesh, hit.triangle, b1, b2),
            object: hit.object,
            triangle: hit.triangle,
            offset,
        }
    }
}

fn sphere_derivatives(place: &SpherePlace, normal: Vec3A) -> SurfaceDerivatives {
    let SpherePlace { radius, axes, .. } = *place;
    let own = axes.transpose() * normal;
    let sin_theta = own.x.hypot(own.z);
    let along_u = TAU * radius * Vec3A::new(own.z, 0.0, -own.x);
    let along_v = PI * radius * Vec3A::new(own.y * own.x / sin_theta, -sin_theta, own.y * own.z / sin_theta);
    SurfaceDerivatives { along_u: (axes * along_u).into(), along_v: (axes * along_v).into() }
}

pub(super) fn interpolate_uv(mesh: &Mesh, triangle: u32, b1: f32, b2: f32) -> Vec2 {
    if mesh.uvs.is_empty() {
        return Vec2::ZERO;
    }
    let [i, j, k] = mesh.triangles[triangle as usize].map(|i| mesh.uvs[i as usize]);
    i * (1.0 - b1 - b2) + j * b1 + k * b2
}

fn interpolate_color(mesh: &Mesh, triangle: u32, b1: f32, b2: f32) -> Vec3 {
    if mesh.colors.is_empty() {
        return Vec3::ONE;
    }
    let [i, j, k] = mesh.triangles[triangle as usize].map(|i| mesh.colors[i as usize]);
    i * (1.0 - b1 - b2) + j * b1 + k * b2
}

/// How the picture lies on a triangle with these edges. The mesh must have texture coordinates.
fn pictured_edges(mesh: &Mesh, triangle: u32, in_space: [Vec3; 2]) -> PicturedEdges {
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.uvs[i as usize]);
    PicturedEdges { in_space, on_picture: [b - a, c - a] }
}

/// Direction of growing u on a triangle and the handedness of (u, v), from its texture coordinates.
fn tangent_from_uv(mesh: &Mesh, triangle: u32, edges: [Vec3; 2]) -> (Vec3, f32) {
    let along_edge = edges[0].normalize_or(Vec3::X);
    if mesh.uvs.is_empty() {
        return (along_edge, 1.0);
    }
    let edges = pictured_edges(mesh, triangle, edges);
    (edges.along_u().unwrap_or(along_edge), if edges.is_mirrored() { -1.0 } else { 1.0 })
}
