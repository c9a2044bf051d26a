//! Which set of texture coordinates a mesh is given. It has one: that on which its material's pictures lie, which may
//! be another than the first where the first is kept for light maps.

use super::super::builder::Builder;
use serde_json::Value;

/// The number of the set on which a material's pictures lie, by the texture's own or its transform's `texCoord`; that
/// of its base colour where they are several, which a note says of `mesh`. 0 without pictures.
pub(super) fn set_of(
    document: &gltf::Document,
    material: &gltf::Material,
    mesh: &str,
    builder: &mut Builder,
) -> Result<u32, serde_json::Error> {
    let Some(index) = material.index() else { return Ok(0) };
    let material = serde_json::to_value(&document.as_json().materials[index])?;
    let mut sets = Vec::new();
    if let Some(colour) = material.pointer("/pbrMetallicRoughness/baseColorTexture") {
        collect(colour, &mut sets);
    }
    collect(&material, &mut sets);
    let first = sets.first().copied().unwrap_or(0);
    if sets.iter().any(|&set| set != first) {
        builder.note(format!(
            "\"{mesh}\": its pictures lie on several sets of texture coordinates, of which set {first} alone is used."
        ));
    }
    Ok(first)
}

/// Adds the sets of all textures in a part of a material. Occlusion is not rendered, and often on a set of its own.
fn collect(part: &Value, sets: &mut Vec<u32>) {
    match part {
        Value::Object(entries) => {
            if entries.get("index").is_some_and(Value::is_u64) {
                let of_transform = part.pointer("/extensions/KHR_texture_transform/texCoord");
                let set = of_transform.or(entries.get("texCoord")).and_then(Value::as_u64).unwrap_or(0);
                sets.push(u32::try_from(set).unwrap_or(u32::MAX));
            }
            let rendered = entries.iter().filter(|(key, _)| *key != "occlusionTexture");
            rendered.for_each(|(_, value)| collect(value, sets));
        }
        Value::Array(values) => values.iter().for_each(|value| collect(value, sets)),
        _ => {}
    }
}
