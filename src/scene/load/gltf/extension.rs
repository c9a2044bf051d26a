//! Extensions of glTF's materials that the `gltf` crate leaves as JSON: what they say, by keys and types that are
//! checked.

use super::super::builder::Builder;
use super::super::error::{LoadError, suggestion};
use glam::Vec3;
use serde_json::Value;
use std::path::Path;

/// An extension of materials that the crate leaves as JSON.
pub(super) struct KnownExtension {
    name: &'static str,
    keys: &'static [&'static str],
}

pub(super) const CLEARCOAT: KnownExtension = KnownExtension {
    name: "KHR_materials_clearcoat",
    keys: &[
        "clearcoatFactor",
        "clearcoatTexture",
        "clearcoatRoughnessFactor",
        "clearcoatRoughnessTexture",
        "clearcoatNormalTexture",
    ],
};
pub(super) const SHEEN: KnownExtension = KnownExtension {
    name: "KHR_materials_sheen",
    keys: &["sheenColorFactor", "sheenColorTexture", "sheenRoughnessFactor", "sheenRoughnessTexture"],
};
pub(super) const ANISOTROPY: KnownExtension = KnownExtension {
    name: "KHR_materials_anisotropy",
    keys: &["anisotropyStrength", "anisotropyRotation", "anisotropyTexture"],
};

/// What a material says in one.
pub(super) struct Extension<'a> {
    path: &'a Path,
    /// Material and extension, for messages.
    place: String,
    pub(super) values: &'a serde_json::Map<String, Value>,
}

impl<'a> Extension<'a> {
    /// The extension of a material; `None` where that does not have it. Keys that it does not know are noted.
    pub(super) fn of(
        path: &'a Path,
        builder: &mut Builder,
        from: &'a gltf::Material,
        known: &KnownExtension,
    ) -> Result<Option<Self>, LoadError> {
        let Some(json) = from.extension_value(known.name) else { return Ok(None) };
        let place = format!("\"{}\": {}", name_of(from), known.name);
        let Some(values) = json.as_object() else {
            return Err(LoadError::invalid(path, format_args!("{place}: expected an object, found {json}")));
        };
        let is_known = |key: &str| known.keys.contains(&key) || ["extras", "extensions"].contains(&key);
        for key in values.keys().filter(|key| !is_known(key)) {
            builder.note(format!("{place} has no \"{key}\"{}", suggestion(key, known.keys.iter().copied())));
        }
        Ok(Some(Self { path, place, values }))
    }

    pub(super) fn wrong(&self, key: &str, problem: impl std::fmt::Display) -> LoadError {
        LoadError::invalid(self.path, format_args!("{}.{key}: {problem}", self.place))
    }

    /// A number, 0 unless told.
    pub(super) fn number(&self, key: &str) -> Result<f32, LoadError> {
        let Some(value) = self.values.get(key) else { return Ok(0.0) };
        let number = value.as_f64().map(|number| number as f32);
        number.ok_or_else(|| self.wrong(key, format_args!("expected a number, found {value}")))
    }

    /// A colour in [0, 1], black unless told.
    pub(super) fn color(&self, key: &str) -> Result<Vec3, LoadError> {
        let Some(value) = self.values.get(key) else { return Ok(Vec3::ZERO) };
        let channels: Option<Vec<f64>> =
            value.as_array().and_then(|channels| channels.iter().map(Value::as_f64).collect());
        match channels.as_deref() {
            Some(&[red, green, blue]) => Ok(Vec3::new(share(red as f32), share(green as f32), share(blue as f32))),
            _ => Err(self.wrong(key, format_args!("expected three numbers, found {value}"))),
        }
    }
}

/// What messages call it.
pub(super) fn name_of(material: &gltf::Material) -> String {
    material.name().map_or_else(|| format!("material {}", material.index().unwrap_or(0)), str::to_owned)
}

/// Cut to 0 to 1.
pub(super) fn share(value: f32) -> f32 {
    if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 }
}
