//! Tangents of smooth meshes that come without: from one triangle to the next they turn with the normals, so that a
//! normal map or a brushed metal shows no edges between them.
//!
//! At each vertex the directions of growing u of the triangles around are averaged by their angles there, in the plane
//! of its normal, as normal maps are commonly made for. Triangles whose picture is mirrored are averaged apart. Flat
//! meshes need none: what a triangle says of itself is all there is.

use super::shapes;
use crate::scene::pictured_edges::PicturedEdges;
use crate::scene::{Mesh, TextureLookup};
use glam::{Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// What corners have that share a tangent: place, normal, coordinates, and whether the picture is mirrored.
type Key = ([u32; 8], bool);

/// Gives a mesh tangents, if it has normals and coordinates and no tangents. A vertex where mirrored and other
/// triangles meet becomes two.
pub(super) fn add(mesh: &mut Mesh) {
    if !mesh.normals.is_empty() {
        add_along(mesh, |uv| uv);
    }
}

/// Gives a mesh tangents, as [`add`] does, by the coordinates at which a picture is read: glTF's tangents follow
/// the normal map where the file has none. By the mesh's own, normals of a map that is turned by half a turn are
/// lit from the opposite side.
pub(super) fn add_for(mesh: &mut Mesh, picture: &TextureLookup) {
    if picture.rotation == 0.0 && picture.scale.min_element() >= 0.0 {
        return add(mesh);
    }
    if mesh.normals.is_empty() {
        give_flat_normals(mesh);
    }
    add_along(mesh, |uv| picture.transform(uv));
}

fn add_along(mesh: &mut Mesh, on_picture: impl Fn(Vec2) -> Vec2) {
    if mesh.uvs.is_empty() || !mesh.tangents.is_empty() {
        return;
    }
    let is_mirrored = |triangle| edges(mesh, triangle, &on_picture).is_mirrored();
    let mirrored: Vec<bool> = mesh.triangles.iter().map(is_mirrored).collect();
    split_mirrored(mesh, &mirrored);
    let (group_of, groups) = groups(mesh, &mirrored);
    let mut sums = vec![Vec3::ZERO; groups];
    for triangle in &mesh.triangles {
        let Some(along) = along_u(edges(mesh, triangle, &on_picture)) else { continue };
        for place in 0..3 {
            let vertex = triangle[place] as usize;
            let normal = mesh.normals[vertex];
            let in_plane = (along - normal * normal.dot(along)).normalize_or_zero();
            sums[group_of[vertex]] += in_plane * angle_at(mesh, triangle, place);
        }
    }
    let mut tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); mesh.positions.len()];
    for (triangle, &mirrored) in mesh.triangles.iter().zip(&mirrored) {
        for vertex in triangle.map(|vertex| vertex as usize) {
            let sum = sums[group_of[vertex]];
            let tangent = sum.try_normalize().unwrap_or_else(|| mesh.normals[vertex].any_orthonormal_vector());
            tangents[vertex] = tangent.extend(if mirrored { -1.0 } else { 1.0 });
        }
    }
    mesh.tangents = tangents;
}

/// For each vertex the number of those that share its tangent, and how many numbers there are. Vertices of mirrored
/// triangles have no others ([`split_mirrored`]); those that no triangle uses count as not mirrored.
fn groups(mesh: &Mesh, mirrored: &[bool]) -> (Vec<usize>, usize) {
    let mut is_mirrored = vec![false; mesh.positions.len()];
    for (triangle, _) in mesh.triangles.iter().zip(mirrored).filter(|(_, mirrored)| **mirrored) {
        triangle.iter().for_each(|&vertex| is_mirrored[vertex as usize] = true);
    }
    let mut numbers: HashMap<Key, usize> = HashMap::with_capacity(mesh.positions.len());
    let mut group_of = Vec::with_capacity(mesh.positions.len());
    for (vertex, mirrored) in is_mirrored.into_iter().enumerate() {
        let next = numbers.len();
        group_of.push(*numbers.entry(key(mesh, vertex, mirrored)).or_insert(next));
    }
    (group_of, numbers.len())
}

/// −0 is 0 here.
fn key(mesh: &Mesh, vertex: usize, mirrored: bool) -> Key {
    let ([a, b, c], [d, e, f]) = (mesh.positions[vertex].to_array(), mesh.normals[vertex].to_array());
    let [u, v] = mesh.uvs[vertex].to_array();
    ([a, b, c, d, e, f, u, v].map(|number| (number + 0.0).to_bits()), mirrored)
}

fn edges(mesh: &Mesh, triangle: &[u32; 3], on_picture: impl Fn(Vec2) -> Vec2) -> PicturedEdges {
    let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
    let [p, q, r] = triangle.map(|vertex| on_picture(mesh.uvs[vertex as usize]));
    PicturedEdges { in_space: [b - a, c - a], on_picture: [q - p, r - p] }
}

/// The direction of growing u; `None` where the triangle has no area on the picture.
fn along_u(edges: PicturedEdges) -> Option<Vec3> {
    edges.along_u().filter(|_| edges.doubled_area() != 0.0)
}

/// The faces' own normals, at corners of their own.
fn give_flat_normals(mesh: &mut Mesh) {
    shapes::set_apart(mesh);
    let Mesh { positions, normals, .. } = mesh;
    let faces = positions.as_chunks::<3>().0.iter();
    normals.extend(faces.flat_map(|&[a, b, c]| [(b - a).cross(c - a).normalize_or(Vec3::Y); 3]));
}

fn angle_at(mesh: &Mesh, triangle: &[u32; 3], place: usize) -> f32 {
    let [at, next, last] = [0, 1, 2].map(|step| mesh.positions[triangle[(place + step) % 3] as usize]);
    let angle = (next - at).angle_between(last - at);
    if angle.is_finite() { angle } else { 0.0 }
}

/// Gives mirrored triangles vertices of their own where others use the same.
fn split_mirrored(mesh: &mut Mesh, mirrored: &[bool]) {
    let mut used_plainly = vec![false; mesh.positions.len()];
    for (triangle, _) in mesh.triangles.iter().zip(mirrored).filter(|(_, mirrored)| !**mirrored) {
        triangle.iter().for_each(|&vertex| used_plainly[vertex as usize] = true);
    }
    let mut doubles: HashMap<u32, u32> = HashMap::new();
    let Mesh { positions, normals, uvs, colors, triangles, .. } = mesh;
    for (triangle, _) in triangles.iter_mut().zip(mirrored).filter(|(_, mirrored)| **mirrored) {
        for vertex in triangle.iter_mut().filter(|vertex| used_plainly[**vertex as usize]) {
            *vertex = *doubles.entry(*vertex).or_insert_with(|| {
                let old = *vertex as usize;
                positions.push(positions[old]);
                normals.push(normals[old]);
                uvs.push(uvs[old]);
                if !colors.is_empty() {
                    colors.push(colors[old]);
                }
                positions.len() as u32 - 1
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares side by side that bend by a right angle at x = 1; the picture of the second goes on or comes back.
    fn bent(comes_back: bool) -> Mesh {
        let last_u = if comes_back { 0.0 } else { 2.0 };
        let up = Vec3::new(0.0, 0.0, 1.0);
        let edge = Vec3::new(1.0, 0.0, 1.0).normalize();
        Mesh {
            positions: [
                [0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 1.0, 0.0],
                [1.0, 0.0, -1.0],
                [1.0, 1.0, -1.0],
            ]
            .map(Vec3::from_array)
            .to_vec(),
            normals: vec![up, up, edge, edge, Vec3::X, Vec3::X],
            uvs: [0.0, 1.0, last_u].into_iter().flat_map(|u| [Vec2::new(u, 1.0), Vec2::new(u, 0.0)]).collect(),
            triangles: vec![[0, 2, 1], [2, 3, 1], [2, 4, 3], [4, 5, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn tangents_turn_with_the_normals() {
        let mut mesh = bent(false);
        add(&mut mesh);
        assert_eq!((mesh.positions.len(), mesh.tangents.len()), (6, 6));
        let at = |vertex: usize| mesh.tangents[vertex].truncate();
        assert!(at(0).abs_diff_eq(Vec3::X, 1e-5) && at(4).abs_diff_eq(Vec3::NEG_Z, 1e-5), "{:?}", mesh.tangents);
        assert!(at(2).abs_diff_eq(Vec3::new(1.0, 0.0, -1.0).normalize(), 1e-5), "{:?}", mesh.tangents);
        assert!(mesh.tangents.iter().all(|tangent| tangent.w == 1.0));
    }

    /// As if the picture's coordinates stood in the mesh, and flat meshes as smooth ones.
    #[test]
    fn tangents_follow_a_picture_that_is_turned_or_mirrored() {
        let quarter = std::f32::consts::FRAC_PI_2;
        let plain = TextureLookup::plain(crate::scene::TextureId(0));
        for (rotation, scale, along, side) in [
            (0.0, Vec2::new(-1.0, 1.0), Vec3::NEG_X, -1.0),
            (2.0 * quarter, Vec2::ONE, Vec3::NEG_X, 1.0),
            // u of the picture grows with v of the mesh, which runs down.
            (quarter, Vec2::new(1.0, 2.0), Vec3::NEG_Y, 1.0),
        ] {
            let picture = TextureLookup { rotation, scale, ..plain };
            let mut smooth = bent(false);
            add_for(&mut smooth, &picture);
            let mut flat = bent(false);
            flat.normals.clear();
            add_for(&mut flat, &picture);
            for mesh in [&smooth, &flat] {
                let tangent = mesh.tangents[mesh.triangles[0][0] as usize];
                assert!(tangent.abs_diff_eq(along.extend(side), 1e-5), "{picture:?}: {tangent}");
            }
            assert_eq!((flat.positions.len(), flat.uvs.len(), flat.normals.len()), (12, 12, 12));
        }
    }

    #[test]
    fn mirrored_pictures_have_tangents_of_their_own() {
        let mut mesh = bent(true);
        add(&mut mesh);
        assert_eq!(mesh.positions.len(), 8, "the two vertices on the edge are doubled");
        let signs = |triangle: usize| mesh.triangles[triangle].map(|vertex| mesh.tangents[vertex as usize].w);
        assert_eq!((signs(0), signs(3)), ([1.0; 3], [-1.0; 3]));
        let of_far = mesh.tangents[4].truncate();
        assert!(of_far.abs_diff_eq(Vec3::Z, 1e-5), "{of_far}");
    }

    #[test]
    fn triangles_that_share_no_vertex_share_tangents_all_the_same() {
        let whole = {
            let mut mesh = bent(false);
            add(&mut mesh);
            mesh
        };
        let mut soup = bent(false);
        let order: Vec<usize> = soup.triangles.iter().flatten().map(|&vertex| vertex as usize).collect();
        soup.positions = order.iter().map(|&vertex| whole.positions[vertex]).collect();
        soup.normals = order.iter().map(|&vertex| whole.normals[vertex]).collect();
        soup.uvs = order.iter().map(|&vertex| whole.uvs[vertex]).collect();
        soup.triangles = (0..4).map(|triangle| [0, 1, 2].map(|corner| 3 * triangle + corner)).collect();
        // 0 of either sign is the same place.
        soup.positions.iter_mut().skip(6).filter(|at| at.y == 0.0).for_each(|at| at.y = -0.0);
        add(&mut soup);
        for (new, &old) in order.iter().enumerate() {
            assert!(soup.tangents[new].abs_diff_eq(whole.tangents[old], 1e-6));
        }
    }
}
