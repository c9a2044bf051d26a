//! Morph targets and skins: meshes as a pose bends them.

use super::super::error::LoadError;
use super::buffers::Buffers;
use crate::scene::Mesh;
use glam::{Mat3, Mat4, Vec3};
use gltf::mesh::Semantic;

/// Adds weighted morph targets to a mesh.
pub(super) fn morph(
    buffers: &Buffers,
    primitive: &gltf::Primitive,
    weights: &[f32],
    mesh: &mut Mesh,
) -> Result<(), LoadError> {
    for (target, &weight) in primitive.morph_targets().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let (name, vertices) = (&mesh.name, mesh.positions.len());
        let add =
            |accessor: Option<gltf::Accessor>, values: &mut Vec<Vec3>, attribute: &str| -> Result<(), LoadError> {
                let Some(accessor) = accessor else { return Ok(()) };
                let offsets = buffers.of_vertices::<3>(&accessor, attribute, name, vertices)?;
                values.iter_mut().zip(offsets).for_each(|(value, offset)| *value += weight * Vec3::from_array(offset));
                Ok(())
            };
        add(target.positions(), &mut mesh.positions, "a morph target's POSITION")?;
        add(target.normals(), &mut mesh.normals, "a morph target's NORMAL")?;
    }
    // Tangents are made anew from the texture coordinates.
    mesh.tangents.clear();
    Ok(())
}

/// Moves every vertex with its joints; `joints` are world transforms times inverse bind matrices. The result is in
/// world space.
pub(super) fn skin(
    buffers: &Buffers,
    primitive: &gltf::Primitive,
    joints: &[Mat4],
    mesh: &mut Mesh,
) -> Result<(), LoadError> {
    let mut blended = vec![Mat4::ZERO; mesh.positions.len()];
    let mut total = vec![0.0_f32; mesh.positions.len()];
    for set in 0.. {
        let (Some(indices), Some(weights)) =
            (primitive.get(&Semantic::Joints(set)), primitive.get(&Semantic::Weights(set)))
        else {
            break;
        };
        let vertices = blended.len();
        let indices = buffers.of_vertices::<4>(&indices, &format!("JOINTS_{set}"), &mesh.name, vertices)?;
        let weights = buffers.of_vertices::<4>(&weights, &format!("WEIGHTS_{set}"), &mesh.name, vertices)?;
        for (vertex, (indices, weights)) in indices.iter().zip(&weights).enumerate() {
            let moves = |&(_, weight): &(f32, f32)| weight > 0.0 && weight.is_finite();
            for (index, weight) in indices.iter().copied().zip(weights.iter().copied()).filter(moves) {
                let Some(joint) = joints.get(index as usize) else {
                    let problem =
                        format!("vertex {vertex} hangs on joint {index}, but its skin has {} joints", joints.len());
                    return Err(buffers.wrong_mesh(&mesh.name, problem));
                };
                blended[vertex] += *joint * weight;
                total[vertex] += weight;
            }
        }
    }
    let mirrors = |&vertex: &u32| blended.get(vertex as usize).is_some_and(|matrix| matrix.determinant() < 0.0);
    for triangle in mesh.triangles.iter_mut().filter(|triangle| triangle.iter().all(mirrors)) {
        // Outside stays outside: corners of what is mirrored go round the other way.
        triangle.swap(1, 2);
    }
    for (vertex, (matrix, total)) in blended.iter().zip(&total).enumerate().filter(|(_, (_, total))| **total > 0.0) {
        let matrix = *matrix * (1.0 / total);
        mesh.positions[vertex] = matrix.transform_point3(mesh.positions[vertex]);
        if let Some(normal) = mesh.normals.get_mut(vertex) {
            *normal = (cofactors(&matrix) * *normal).normalize_or(*normal);
        }
    }
    mesh.tangents.clear();
    Ok(())
}

/// What turns normals where the matrix moves points; outwards stays outwards where it mirrors.
fn cofactors(matrix: &Mat4) -> Mat3 {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(glam::Vec4::truncate);
    let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if x.dot(y.cross(z)) < 0.0 { cofactors * -1.0 } else { cofactors }
}

/// World transforms of a skin's joints times their inverse bind matrices; `node` is who wears it.
pub(super) fn joints(
    buffers: &Buffers,
    skin: &gltf::Skin,
    node: &str,
    world: &std::collections::HashMap<usize, Mat4>,
) -> Result<Vec<Mat4>, LoadError> {
    let bind = match skin.inverse_bind_matrices() {
        Some(accessor) => buffers.floats::<16>(&accessor)?,
        None => vec![Mat4::IDENTITY.to_cols_array(); skin.joints().count()],
    };
    if bind.len() < skin.joints().count() {
        let problem =
            format!("its skin has {} joints, but {} inverse bind matrices", skin.joints().count(), bind.len());
        return Err(buffers.wrong_mesh(node, problem));
    }
    let joint = |(node, bind): (gltf::Node, &[f32; 16])| {
        world.get(&node.index()).copied().unwrap_or(Mat4::IDENTITY) * Mat4::from_cols_array(bind)
    };
    Ok(skin.joints().zip(&bind).map(joint).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stay_perpendicular_under_uneven_scales() {
        for scale in [Vec3::new(3.0, 1.0, 1.0), Vec3::new(-2.0, 1.0, 0.5)] {
            let matrix = Mat4::from_scale(scale) * Mat4::from_rotation_y(0.4);
            let (normal, along) = (Vec3::new(1.0, 0.0, 1.0), Vec3::new(1.0, 0.0, -1.0));
            let turned = cofactors(&matrix) * normal;
            assert!(turned.dot(matrix.transform_vector3(along)).abs() < 1e-5);
            assert!(turned.dot(matrix.transform_vector3(normal)) > 0.0);
        }
    }
}
