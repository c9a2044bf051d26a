//! Meshes of the simple shapes that scene files name. A sphere is among them only where a transform has squeezed it.

use crate::scene::Mesh;
use glam::{Affine3A, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Triangles around a disk: the polygon's area is within 0.03 % of the circle's.
const DISK_SEGMENTS: u32 = 128;
/// Rings and segments of a sphere that a transform has squeezed.
const SPHERE_RINGS: u32 = 96;
const SPHERE_SEGMENTS: u32 = 192;

/// A parallelogram from `corner` along two edges; its front is where edge_u × edge_v points.
pub fn rectangle(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> Mesh {
    Mesh {
        name: "rectangle".to_owned(),
        positions: vec![corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v],
        // v runs down the image: its top row lies along the far edge.
        uvs: vec![Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// An axis-aligned box whose faces point outwards.
pub fn cuboid(min: Vec3, max: Vec3) -> Mesh {
    let size = max - min;
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    let faces = [
        rectangle(min + z, x, y),      // +z
        rectangle(min + x, -x, y),     // −z
        rectangle(min + x + z, -z, y), // +x
        rectangle(min, z, y),          // −x
        rectangle(min + y + z, x, -z), // +y
        rectangle(min, x, z),          // −y
    ];
    let mut mesh = Mesh { name: "box".to_owned(), ..Mesh::default() };
    for face in faces {
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(face.positions);
        mesh.uvs.extend(face.uvs);
        mesh.triangles.extend(face.triangles.iter().map(|triangle| triangle.map(|index| index + base)));
    }
    mesh
}

/// A disk that faces along `normal`.
pub fn disk(center: Vec3, normal: Vec3, radius: f32) -> Mesh {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    // any_orthonormal_pair's handedness is not promised; the front must be where the normal points.
    let bitangent = if tangent.cross(bitangent).dot(normal) < 0.0 { -bitangent } else { bitangent };
    let mut mesh =
        Mesh { name: "disk".to_owned(), positions: vec![center], uvs: vec![Vec2::splat(0.5)], ..Mesh::default() };
    for segment in 0..DISK_SEGMENTS {
        let (sin, cos) = (TAU * segment as f32 / DISK_SEGMENTS as f32).sin_cos();
        mesh.positions.push(center + radius * (cos * tangent + sin * bitangent));
        mesh.uvs.push(Vec2::new(0.5 + 0.5 * cos, 0.5 - 0.5 * sin));
        mesh.triangles.push([0, 1 + segment, 1 + (segment + 1) % DISK_SEGMENTS]);
    }
    mesh
}

/// The disk around the origin that faces +z, its texture coordinates by the distance from the middle as a share of the
/// radius and by the turn from +x in [0, 1]. Each triangle has a middle of its own, since that lies at every turn.
pub(super) fn polar_disk(radius: f32, uv: impl Fn(f32, f32) -> Vec2) -> Mesh {
    let mut mesh = Mesh { name: "disk".to_owned(), ..Mesh::default() };
    for segment in 0..=DISK_SEGMENTS {
        let turn = segment as f32 / DISK_SEGMENTS as f32;
        // The last corner is the first one to the bit.
        let (sin, cos) = (TAU * (segment % DISK_SEGMENTS) as f32 / DISK_SEGMENTS as f32).sin_cos();
        mesh.positions.push(radius * Vec3::new(cos, sin, 0.0));
        mesh.uvs.push(uv(1.0, turn));
    }
    for segment in 0..DISK_SEGMENTS {
        let middle = mesh.positions.len() as u32;
        mesh.positions.push(Vec3::ZERO);
        mesh.uvs.push(uv(0.0, (segment as f32 + 0.5) / DISK_SEGMENTS as f32));
        mesh.triangles.push([middle, segment, segment + 1]);
    }
    mesh
}

/// The triangles of a grid of so many cells, columns by rows, whose corners stand row by row from `first` on.
pub(super) fn grid_triangles(first: u32, [columns, rows]: [u32; 2]) -> impl Iterator<Item = [u32; 3]> {
    (0..rows * columns).flat_map(move |cell| {
        let low = first + cell / columns * (columns + 1) + cell % columns;
        let high = low + columns + 1;
        [[low, low + 1, high], [low + 1, high + 1, high]]
    })
}

/// Gives every triangle of a mesh without texture coordinates the same ones, and so corners of its own.
pub(super) fn give_each_triangle(mesh: &mut Mesh, uvs: [Vec2; 3]) {
    set_apart(mesh);
    mesh.uvs = mesh.triangles.iter().flat_map(|_| uvs).collect();
}

/// Gives every triangle of a mesh corners of its own.
pub(super) fn set_apart(mesh: &mut Mesh) {
    fn apart<T: Copy>(values: &mut Vec<T>, triangles: &[[u32; 3]]) {
        if !values.is_empty() {
            *values = triangles.iter().flatten().map(|&index| values[index as usize]).collect();
        }
    }
    let triangles = std::mem::take(&mut mesh.triangles);
    apart(&mut mesh.positions, &triangles);
    apart(&mut mesh.normals, &triangles);
    apart(&mut mesh.tangents, &triangles);
    apart(&mut mesh.colors, &triangles);
    apart(&mut mesh.uvs, &triangles);
    mesh.triangles =
        (0..triangles.len() as u32).map(|triangle| [0, 1, 2].map(|corner| 3 * triangle + corner)).collect();
}

/// A sphere as a mesh, for transforms that do not leave it a sphere.
pub fn sphere(center: Vec3, radius: f32) -> Mesh {
    let mut mesh = Mesh { name: "sphere".to_owned(), ..Mesh::default() };
    for ring in 0..=SPHERE_RINGS {
        let v = ring as f32 / SPHERE_RINGS as f32;
        let (sin_theta, cos_theta) = (PI * v).sin_cos();
        for segment in 0..=SPHERE_SEGMENTS {
            let u = segment as f32 / SPHERE_SEGMENTS as f32;
            let (sin_phi, cos_phi) = (TAU * u).sin_cos();
            let normal = Vec3::new(sin_theta * cos_phi, cos_theta, -sin_theta * sin_phi);
            mesh.positions.push(center + radius * normal);
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(u, v));
        }
    }
    let row = SPHERE_SEGMENTS + 1;
    for ring in 0..SPHERE_RINGS {
        for segment in 0..SPHERE_SEGMENTS {
            let top = ring * row + segment;
            let bottom = top + row;
            if ring > 0 {
                mesh.triangles.push([top, bottom, top + 1]);
            }
            if ring + 1 < SPHERE_RINGS {
                mesh.triangles.push([top + 1, bottom, bottom + 1]);
            }
        }
    }
    mesh
}

/// Winds every triangle so that its front is on the side of its corners' normals, where there are any.
pub fn face_along_normals(mesh: &mut Mesh) {
    let Mesh { positions, normals, triangles, .. } = mesh;
    let vertices = positions.len();
    if normals.len() != vertices {
        return;
    }
    for triangle in triangles.iter_mut().filter(|triangle| triangle.iter().all(|&i| (i as usize) < vertices)) {
        let [a, b, c] = triangle.map(|index| positions[index as usize]);
        let shading: Vec3 = triangle.iter().map(|&index| normals[index as usize]).sum();
        if (b - a).cross(c - a).dot(shading) < 0.0 {
            triangle.swap(1, 2);
        }
    }
}

/// Whether a triangle has an area: by f64, or small ones far from the origin would have none by rounding.
pub(super) fn has_area(positions: &[Vec3], triangle: &[u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|index| positions[index as usize].as_dvec3());
    (b - a).cross(c - a).length_squared() > 0.0
}

/// Makes its back its front.
pub(super) fn turn_over(mesh: &mut Mesh) {
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
}

/// Area of a mesh after a transform.
pub fn area(mesh: &Mesh, to_world: &Affine3A) -> f64 {
    let corner = |index: u32| to_world.transform_point3(mesh.positions[index as usize]).as_dvec3();
    let double: f64 =
        mesh.triangles.iter().map(|&[a, b, c]| (corner(b) - corner(a)).cross(corner(c) - corner(a)).length()).sum();
    0.5 * double
}

/// The factor by which a transform scales every length, if it scales all alike (then spheres stay spheres).
pub fn similarity_scale(transform: &Affine3A) -> Option<f32> {
    let [x, y, z] = [transform.x_axis, transform.y_axis, transform.z_axis].map(|axis| axis.as_dvec3());
    let scale = x.length();
    let tolerance = 1e-5 * scale * scale;
    let alike = |a: f64| (a - scale * scale).abs() <= tolerance;
    let similar = scale > 0.0
        && alike(y.length_squared())
        && alike(z.length_squared())
        && [x.dot(y), y.dot(z), z.dot(x)].iter().all(|dot| dot.abs() <= tolerance);
    similar.then_some(scale as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn enclosed_volume(mesh: &Mesh) -> f32 {
        let corner = |index: u32| mesh.positions[index as usize];
        mesh.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
    }

    #[test]
    fn closed_shapes_face_outwards_and_enclose_their_volume() {
        let cuboid = cuboid(Vec3::new(-1.0, 0.0, 2.0), Vec3::new(1.0, 3.0, 6.0));
        assert!((enclosed_volume(&cuboid) - 24.0).abs() < 1e-4);
        let sphere = sphere(Vec3::ZERO, 1.0);
        assert!((enclosed_volume(&sphere) / (4.0 / 3.0 * PI) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn flat_shapes_face_along_their_normal() {
        for normal in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::new(1.0, -2.0, 0.5).normalize()] {
            let mesh = disk(Vec3::ONE, normal, 0.5);
            assert!((area(&mesh, &Affine3A::IDENTITY) / (PI as f64 * 0.25) - 1.0).abs() < 1e-3);
            let [a, b, c] = mesh.triangles[5].map(|index| mesh.positions[index as usize]);
            assert!((b - a).cross(c - a).normalize().dot(normal) > 0.999);
        }
    }

    #[test]
    fn similarity_is_told_from_squeezing() {
        let turned = Affine3A::from_scale_rotation_translation(
            Vec3::splat(2.0),
            glam::Quat::from_rotation_x(0.7) * glam::Quat::from_rotation_y(1.1),
            Vec3::ONE,
        );
        assert!((similarity_scale(&turned).unwrap() - 2.0).abs() < 1e-5);
        assert_eq!(similarity_scale(&Affine3A::from_scale(Vec3::new(1.0, 1.1, 1.0))), None);
        assert_eq!(similarity_scale(&Affine3A::from_scale(Vec3::ZERO)), None);
    }
}
