//! Morph targets and skins: meshes as a pose bends them.

use super::super::error::LoadError;
use super::buffers::Buffers;
use crate::scene::Mesh;
use glam::{Mat4, Vec3};
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
            // Skins turn and scale alike; where they do not, the normal is slightly off.
            *normal = matrix.transform_vector3(*normal).normalize_or(*normal);
        }
    }
    mesh.tangents.clear();
    Ok(())
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
