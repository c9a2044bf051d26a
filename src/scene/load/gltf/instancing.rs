//! EXT_mesh_gpu_instancing: one node that places its mesh many times, by translation, rotation and scale in accessors.
//! Attributes of other names are an application's own and are left out.

use super::super::error::LoadError;
use super::buffers::Buffers;
use glam::{Mat4, Quat, Vec3};
use serde_json::Value;

const NAME: &str = "EXT_mesh_gpu_instancing";

/// Where a node places its mesh, in the node's own space; `None` where it does so once, as nodes do.
///
/// # Errors
/// If the extension is not an object of attributes, names an accessor that is not there, or its attributes differ in
/// length.
pub(super) fn places(
    document: &gltf::Document,
    buffers: &Buffers,
    node: &gltf::Node,
) -> Result<Option<Vec<Mat4>>, LoadError> {
    let Some(extension) = node.extension_value(NAME) else { return Ok(None) };
    let wrong = |problem: String| buffers.wrong_file(format_args!("node {}: {NAME}: {problem}", node.index()));
    let Some(Value::Object(attributes)) = extension.get("attributes") else {
        return Err(wrong("expected an object \"attributes\"".to_owned()));
    };
    let mut count = None;
    let mut accessors = Vec::new();
    for (name, index) in attributes {
        let place = index.as_u64().and_then(|index| usize::try_from(index).ok());
        let Some(accessor) = place.and_then(|place| document.accessors().nth(place)) else {
            return Err(wrong(format!("{name}: expected the index of an accessor, found {index}")));
        };
        let expected = *count.get_or_insert(accessor.count());
        if accessor.count() != expected {
            let problem = format!("{name} has {} elements, but the one before has {expected}", accessor.count());
            return Err(wrong(problem));
        }
        accessors.push((name.as_str(), accessor));
    }
    let Some(count) = count else { return Ok(None) };
    super::super::check_placed(buffers.path(), count)?;
    let mut translations = vec![Vec3::ZERO; count];
    let mut rotations = vec![Quat::IDENTITY; count];
    let mut scales = vec![Vec3::ONE; count];
    for (name, accessor) in accessors {
        match name {
            "TRANSLATION" => translations = buffers.floats(&accessor)?.into_iter().map(Vec3::from_array).collect(),
            "SCALE" => scales = buffers.floats(&accessor)?.into_iter().map(Vec3::from_array).collect(),
            "ROTATION" => {
                let unit = |numbers| Quat::from_vec4(glam::Vec4::from_array(numbers).normalize_or(glam::Vec4::W));
                rotations = buffers.floats(&accessor)?.into_iter().map(unit).collect();
            }
            _ => {}
        }
    }
    let transforms = scales.into_iter().zip(rotations).zip(translations);
    let place = |((scale, rotation), translation)| Mat4::from_scale_rotation_translation(scale, rotation, translation);
    Ok(Some(transforms.map(place).collect()))
}
