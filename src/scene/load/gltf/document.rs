//! The JSON part of a glTF file, checked: its extensions, and what the crate's own checks leave out or are too strict
//! about.

use super::super::builder::Builder;
use super::super::error::{LoadError, Place};
use ::gltf::json::Root;
use ::gltf::json::validation::{Checked, Validate};
use ::gltf::mesh::Semantic;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// Some editors put it before JSON.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Extensions that are done, or change nothing that a rest pose shows.
const KNOWN: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Whether an extension of this name is done, or changes nothing that a rest pose shows.
pub(super) fn is_known(name: &str) -> bool {
    KNOWN.contains(&name)
}

/// The document, checked by the crate, after our own look at its extensions.
pub(super) fn parse(path: &Path, json: &[u8], builder: &mut Builder) -> Result<::gltf::Document, LoadError> {
    let json = json.strip_prefix(BYTE_ORDER_MARK).unwrap_or(json);
    let mut root = read(json).map_err(|error| {
        let place = Place { file: path.to_owned(), line: Some(error.line()).filter(|&line| line > 0) };
        LoadError::invalid_at(place, format_args!("not valid glTF: {error}"))
    })?;
    if let Some(refused) = root.extensions_required.iter().find(|name| !is_known(name)) {
        let advice = match refused.as_str() {
            "KHR_draco_mesh_compression" | "EXT_meshopt_compression" => "; export it without mesh compression",
            "KHR_texture_basisu" => "; export its textures as PNG, JPEG or WebP",
            _ => "",
        };
        return Err(LoadError::unsupported(
            path,
            format_args!("needs the extension {refused}, which is not read{advice}"),
        ));
    }
    // Those of materials and nodes are named whether the file declares them or not.
    let of_materials = root.materials.iter().filter_map(|material| material.extensions.as_ref());
    let of_materials = of_materials.flat_map(|extensions| extensions.others.keys());
    let of_nodes = root.nodes.iter().filter_map(|node| node.extensions.as_ref());
    let of_nodes = of_nodes.flat_map(|extensions| extensions.others.keys());
    let declared = root.extensions_used.iter();
    let used: BTreeSet<&str> = declared.chain(of_materials).chain(of_nodes).map(String::as_str).collect();
    for name in used.into_iter().filter(|name| !is_known(name)) {
        let instead = match name {
            "KHR_materials_variants" => "the default variant is rendered",
            "KHR_node_visibility" => "what it hides is rendered",
            _ => "it is left out",
        };
        builder.note(format!("{name} is not supported: {instead}."));
    }
    // The crate refuses some that we do ourselves.
    root.extensions_required.clear();
    let version = root.asset.version.clone();
    if !version.starts_with("2.") {
        return Err(LoadError::unsupported(path, format_args!("glTF version {version}; version 2 is read")));
    }
    check_positions(path, &root)?;
    check_animations(path, &root)?;
    check_by_crate(path, &root)?;
    note_morphed_attributes(json, &root, builder);
    make_affine(&mut root, builder);
    Ok(::gltf::Document::from_json_without_validation(root))
}

/// The JSON's content. Where the crate misses something, once more without the animation's channels that name no node:
/// they move nothing, and the crate wants one.
fn read(json: &[u8]) -> serde_json::Result<Root> {
    serde_json::from_slice(json).or_else(|error| {
        let Ok(mut value) = serde_json::from_slice::<Value>(json) else { return Err(error) };
        let animations = value.get_mut("animations").and_then(Value::as_array_mut);
        for animation in animations.into_iter().flatten() {
            if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
                channels.retain(|channel| channel.pointer("/target/node").is_some());
            }
        }
        serde_json::from_value(value).map_err(|_| error)
    })
}

/// What the crate finds wrong, but for what the format allows: accessors of zeros, which have no bytes, and
/// textures without an image.
fn check_by_crate(path: &Path, root: &Root) -> Result<(), LoadError> {
    let mut errors = Vec::new();
    root.validate(root, ::gltf::json::Path::new, &mut |place, error| {
        let place = place();
        let is_allowed = match place.as_str().split_once('[') {
            Some(("accessors", rest)) => rest.ends_with("].bufferView"),
            Some(("textures", rest)) => rest.ends_with("].source"),
            _ => false,
        };
        if !(is_allowed && matches!(error, ::gltf::json::validation::Error::Missing)) {
            errors.push((place, error));
        }
    });
    if errors.is_empty() {
        return Ok(());
    }
    /// What is named of many slips.
    const MOST: usize = 3;
    let named: Vec<String> = errors.iter().take(MOST).map(|(place, error)| format!("{place}: {error}")).collect();
    let more = errors.len().saturating_sub(MOST);
    let more = if more > 0 { format!("; and {more} more") } else { String::new() };
    Err(LoadError::invalid(path, format_args!("not valid glTF: {}{more}", named.join("; "))))
}

/// Makes affine what the format wants to be so: the last row of nodes' matrices. Says how many were not.
fn make_affine(root: &mut Root, builder: &mut Builder) {
    /// What files round to.
    const ROUNDING: f32 = 1e-4;
    let mut others = 0;
    for matrix in root.nodes.iter_mut().filter_map(|node| node.matrix.as_mut()) {
        let mut is_other = false;
        for (place, affine) in [(3, 0.0), (7, 0.0), (11, 0.0), (15, 1.0)] {
            is_other |= (matrix[place] - affine).abs() > ROUNDING;
            matrix[place] = affine;
        }
        others += usize::from(is_other);
    }
    if others > 0 {
        builder.note(format!("{others} of the nodes' matrices are taken as if their last row were 0, 0, 0, 1."));
    }
}

/// Names what morph targets change besides positions, normals and tangents, which the crate does not hand on.
fn note_morphed_attributes(json: &[u8], root: &Root, builder: &mut Builder) {
    if !root.meshes.iter().flat_map(|mesh| &mesh.primitives).any(|primitive| primitive.targets.is_some()) {
        return;
    }
    let Ok(value) = serde_json::from_slice::<Value>(json) else { return };
    let array = |value: &Value, key: &str| value.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
    for mesh in array(&value, "meshes") {
        let targets = array(&mesh, "primitives").into_iter().flat_map(|primitive| array(&primitive, "targets"));
        let keys = targets
            .flat_map(|target| target.as_object().into_iter().flat_map(|t| t.keys().cloned()).collect::<Vec<_>>());
        if keys.into_iter().any(|key| key.starts_with("TEXCOORD_") || key.starts_with("COLOR_")) {
            let name = mesh.get("name").and_then(Value::as_str).unwrap_or("a mesh");
            builder.note(format!("\"{name}\": morph targets of texture coordinates and colours are not applied."));
        }
    }
}

/// Refuses primitives whose positions are in an accessor that is not there: the crate's own validation looks at the
/// accessor's range before it looks whether it exists, and panics (gltf-json 1.4.1, found by damaging a file).
fn check_positions(path: &Path, root: &Root) -> Result<(), LoadError> {
    let positions = Checked::Valid(Semantic::Positions);
    for (mesh_number, mesh) in root.meshes.iter().enumerate() {
        for primitive in &mesh.primitives {
            let accessor = primitive.attributes.get(&positions).map(::gltf::json::Index::value);
            if let Some(accessor) = accessor.filter(|&a| a >= root.accessors.len()) {
                let count = root.accessors.len();
                return Err(LoadError::invalid(
                    path,
                    format_args!("mesh {mesh_number} has its positions in accessor {accessor}, but there are {count}"),
                ));
            }
        }
    }
    Ok(())
}

/// Refuses animations of a node or property that does not exist: the crate's validation looks at neither, and its
/// reader panics (gltf-json 1.4.1, found by damaging a file).
fn check_animations(path: &Path, root: &Root) -> Result<(), LoadError> {
    for (number, animation) in root.animations.iter().enumerate() {
        for target in animation.channels.iter().map(|channel| &channel.target) {
            let (node, count) = (target.node.value(), root.nodes.len());
            if node >= count {
                let problem = format!("animation {number} moves node {node}, but there are {count}");
                return Err(LoadError::invalid(path, problem));
            }
            if matches!(target.path, Checked::Invalid) {
                let problem =
                    format!("animation {number} moves what is not known; translation, rotation, scale and weights are");
                return Err(LoadError::invalid(path, problem));
            }
        }
    }
    Ok(())
}
