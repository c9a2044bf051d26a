//! The shapes that need no file, with Mitsuba's own texture coordinates: v = 0 is the top row of a picture
//! wherever that comes to lie.

use super::super::shapes;
use crate::scene::Mesh;
use glam::{Mat3, Vec2, Vec3};
use std::f32::consts::TAU;

/// Steps around a full turn.
const SEGMENTS: u32 = 128;

/// The square [−1, 1]² that faces +z. u and v grow with x and y.
pub(super) fn rectangle() -> Mesh {
    let mut mesh = shapes::rectangle(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0);
    flip_v(&mut mesh);
    mesh
}

/// The cube [−1, 1]³ seen from outside.
pub(super) fn cube() -> Mesh {
    /// Corners of each face, of uv (0, 1), (1, 1), (1, 0) and (0, 0).
    const FACES: [[[i8; 3]; 4]; 6] = [
        [[1, -1, -1], [1, -1, 1], [-1, -1, 1], [-1, -1, -1]],
        [[1, 1, -1], [-1, 1, -1], [-1, 1, 1], [1, 1, 1]],
        [[1, -1, -1], [1, 1, -1], [1, 1, 1], [1, -1, 1]],
        [[1, -1, 1], [1, 1, 1], [-1, 1, 1], [-1, -1, 1]],
        [[-1, -1, 1], [-1, 1, 1], [-1, 1, -1], [-1, -1, -1]],
        [[1, 1, -1], [1, -1, -1], [-1, -1, -1], [-1, 1, -1]],
    ];
    let mut mesh = Mesh { name: "cube".to_owned(), ..Mesh::default() };
    for face in FACES {
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(face.map(|corner| Vec3::from_array(corner.map(f32::from))));
        mesh.uvs.extend([Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]);
        mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    }
    mesh
}

/// The unit disk that faces +z, over its radius and its turn from +x.
pub(super) fn disk() -> Mesh {
    shapes::polar_disk(1.0, Vec2::new)
}

/// A cylinder without caps, seen from outside: u is the turn, v the way along the axis. `None` if the ends are one
/// point.
pub(super) fn cylinder(from: Vec3, to: Vec3, radius: f32) -> Option<Mesh> {
    let axis = (to - from).try_normalize()?;
    let (x, y) = axis.any_orthonormal_pair();
    let frame = Mat3::from_cols(x, y, axis);
    let mut mesh = Mesh { name: "cylinder".to_owned(), ..Mesh::default() };
    for segment in 0..=SEGMENTS {
        let u = segment as f32 / SEGMENTS as f32;
        let (sin, cos) = (TAU * u).sin_cos();
        let normal = frame * Vec3::new(cos, sin, 0.0);
        for (end, v) in [(from, 0.0), (to, 1.0)] {
            mesh.positions.push(end + radius * normal);
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(u, v));
        }
    }
    for segment in 0..SEGMENTS {
        let low = 2 * segment;
        mesh.triangles.push([low, low + 2, low + 1]);
        mesh.triangles.push([low + 1, low + 2, low + 3]);
    }
    Some(mesh)
}

/// Exchanges the top and the bottom of a mesh's pictures.
pub(super) fn flip_v(mesh: &mut Mesh) {
    mesh.uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;

    #[test]
    fn closed_shapes_face_outwards() {
        let cylinder = cylinder(Vec3::ZERO, Vec3::new(0.0, 2.0, 0.0), 0.5).unwrap();
        for (mesh, outward) in [(&cylinder, Vec3::new(1.0, 0.0, 1.0)), (&cube(), Vec3::ONE)] {
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
                assert!((b - a).cross(c - a).dot((a + b + c) * outward) > 0.0, "{}", mesh.name);
            }
        }
        let area = shapes::area(&cylinder, &Affine3A::IDENTITY);
        assert!((area / (std::f64::consts::TAU * 0.5 * 2.0) - 1.0).abs() < 1e-3);
    }

    /// Coordinates that Mitsuba 3.9 gives.
    #[test]
    fn coordinates_are_mitsubas() {
        let uv_at = |mesh: &Mesh, x: f32, y: f32, z: f32| {
            let at = Vec3::new(x, y, z);
            mesh.uvs[mesh.positions.iter().position(|position| position.abs_diff_eq(at, 1e-6)).unwrap()]
        };
        assert_eq!(uv_at(&rectangle(), 1.0, -1.0, 0.0), Vec2::X);
        assert_eq!(uv_at(&cube(), 1.0, -1.0, 1.0), Vec2::ONE);
        assert!(uv_at(&disk(), 0.0, 1.0, 0.0).abs_diff_eq(Vec2::new(1.0, 0.25), 1e-6));
        let upright = cylinder(Vec3::ZERO, Vec3::Z, 1.0).unwrap();
        assert!(uv_at(&upright, 0.0, 1.0, 1.0).abs_diff_eq(Vec2::new(0.25, 1.0), 1e-6));
    }
}
