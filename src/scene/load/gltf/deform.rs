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
        let add = |accessor: Option<gltf::Accessor>, values: &mut Vec<Vec3>| -> Result<(), LoadError> {
            let Some(accessor) = accessor else { return Ok(()) };
            let offsets = buffers.floats::<3>(&accessor)?;
            values.iter_mut().zip(offsets).for_each(|(value, offset)| *value += weight * Vec3::from_array(offset));
            Ok(())
        };
        add(target.positions(), &mut mesh.positions)?;
        add(target.normals(), &mut mesh.normals)?;
    }
    // Tangents are made anew from the texture coordinates.
    mesh.tangents.clear();
    Ok(())
}

/// Moves every vertex with its joints; `joints` are world transforms times inverse bind matrices. The result is in world
/// space.
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
        let (indices, weights) = (buffers.floats::<4>(&indices)?, buffers.floats::<4>(&weights)?);
        for (vertex, (indices, weights)) in indices.iter().zip(&weights).enumerate().take(blended.len()) {
            for (&index, &weight) in indices.iter().zip(weights) {
                let Some(joint) = joints.get(index as usize).filter(|_| weight > 0.0 && weight.is_finite()) else {
                    continue;
                };
                blended[vertex] += *joint * weight;
                total[vertex] += weight;
            }
        }
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

/// World transforms of a skin's joints times their inverse bind matrices.
pub(super) fn joints(
    buffers: &Buffers,
    skin: &gltf::Skin,
    world: &std::collections::HashMap<usize, Mat4>,
) -> Result<Vec<Mat4>, LoadError> {
    let bind = match skin.inverse_bind_matrices() {
        Some(accessor) => buffers.floats::<16>(&accessor)?,
        None => Vec::new(),
    };
    let joint = |(place, node): (usize, gltf::Node)| {
        let world = world.get(&node.index()).copied().unwrap_or(Mat4::IDENTITY);
        world * bind.get(place).map_or(Mat4::IDENTITY, Mat4::from_cols_array)
    };
    Ok(skin.joints().enumerate().map(joint).collect())
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
