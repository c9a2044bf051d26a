//! Which set of texture coordinates a mesh is given. It has one: that on which its material's pictures lie, which may
//! be another than the first where the first is kept for light maps.

use super::super::builder::Builder;
use super::document::is_known;
use serde_json::Value;

/// Where a material has the pictures that are rendered: its base colour first. Occlusion is not, and often on a set of
/// its own.
const PICTURES: [&str; 4] = [
    "/pbrMetallicRoughness/baseColorTexture",
    "/pbrMetallicRoughness/metallicRoughnessTexture",
    "/normalTexture",
    "/emissiveTexture",
];

/// The number of the set on which a material's pictures lie, by the texture's own or its transform's `texCoord`; that
/// of the first of [`PICTURES`] where they are several, which a note says of `mesh`. 0 without pictures.
pub(super) fn set_of(
    document: &gltf::Document,
    material: &gltf::Material,
    mesh: &str,
    builder: &mut Builder,
) -> Result<u32, serde_json::Error> {
    let Some(index) = material.index() else { return Ok(0) };
    let material = serde_json::to_value(&document.as_json().materials[index])?;
    let own = PICTURES.iter().filter_map(|path| material.pointer(path));
    let extensions = material.get("extensions").and_then(Value::as_object).into_iter().flatten();
    let of_extensions = extensions.filter(|(name, _)| is_known(name)).filter_map(|(_, values)| values.as_object());
    let sets: Vec<u32> =
        own.chain(of_extensions.flat_map(|values| values.values())).filter_map(set_of_picture).collect();
    let first = sets.first().copied().unwrap_or(0);
    if sets.iter().any(|&set| set != first) {
        builder.note(format!(
            "\"{mesh}\": its pictures lie on several sets of texture coordinates, of which set {first} alone is used."
        ));
    }
    Ok(first)
}

/// The set of a picture; `None` of what is none.
fn set_of_picture(info: &Value) -> Option<u32> {
    info.get("index").filter(|index| index.is_u64())?;
    let of_transform = info.pointer("/extensions/KHR_texture_transform/texCoord").and_then(Value::as_u64);
    let set = of_transform.or_else(|| info.get("texCoord")?.as_u64()).unwrap_or(0);
    Some(u32::try_from(set).unwrap_or(u32::MAX))
}
