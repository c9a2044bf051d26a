//! Reads glTF materials.

use super::super::builder::Builder;
use super::super::error::LoadError;
use super::buffers::Buffers;
use super::extension::{ANISOTROPY, CLEARCOAT, Extension, SHEEN, name_of, share};
use super::textures::read_transform;
use crate::scene::{
    Alpha, CoatRelief, ColorInput, Encoding, Material, MaterialId, MetalRoughness, Relief, ScalarInput,
    StretchDirection, Surface, TextureLookup, USUAL_IOR,
};
use glam::Vec3;
use gltf::material::AlphaMode;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Converts materials when a primitive uses them.
pub(super) struct Materials<'a> {
    pub(super) path: &'a Path,
    pub(super) document: &'a gltf::Document,
    pub(super) buffers: &'a Buffers,
    converted: HashMap<Option<usize>, MaterialId>,
    pub(super) embedded: HashMap<usize, Arc<Vec<u8>>>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(path: &'a Path, document: &'a gltf::Document, buffers: &'a Buffers) -> Self {
        Self { path, document, buffers, converted: HashMap::new(), embedded: HashMap::new() }
    }

    /// Our material for glTF's.
    pub(super) fn get(&mut self, builder: &mut Builder, material: &gltf::Material) -> Result<MaterialId, LoadError> {
        if let Some(id) = self.converted.get(&material.index()) {
            return Ok(*id);
        }
        let converted = self.convert(builder, material)?;
        let id = builder.add_material(converted);
        self.converted.insert(material.index(), id);
        Ok(id)
    }

    fn convert(&mut self, builder: &mut Builder, from: &gltf::Material) -> Result<Material, LoadError> {
        let name = name_of(from);
        let base_texture = from.pbr_metallic_roughness().base_color_texture();
        let base = self.optional(builder, base_texture.as_ref(), Encoding::Srgb)?;
        Ok(Material {
            surface: self.surface(builder, from, base, &name)?,
            emission: self.emission(builder, from)?,
            emits_both_sides: from.double_sided(),
            relief: self.relief(builder, from)?,
            stretch: self.stretch(builder, from)?,
            alpha: alpha(from, base),
            name,
        })
    }

    /// `base` is the picture of its base colour.
    fn surface(
        &mut self,
        builder: &mut Builder,
        from: &gltf::Material,
        base: Option<TextureLookup>,
        name: &str,
    ) -> Result<Surface, LoadError> {
        let pbr = from.pbr_metallic_roughness();
        let [red, green, blue, _] = pbr.base_color_factor();
        let base_color = ColorInput { factor: Vec3::new(share(red), share(green), share(blue)), texture: base };
        if from.unlit() {
            builder.note("KHR_materials_unlit: rendered as a diffuse surface.");
            return Ok(Surface::Diffuse { reflectance: base_color });
        }
        let map = self.optional(builder, pbr.metallic_roughness_texture().as_ref(), Encoding::Linear)?;
        let scalar = |factor: f32, channel: u8| ScalarInput {
            factor: share(factor),
            texture: map.map(|lookup| (lookup, channel)),
        };
        let model = MetalRoughness {
            base_color,
            metallic: scalar(pbr.metallic_factor(), 2),
            roughness: scalar(pbr.roughness_factor(), 1),
            transmission: self.transmission(builder, from)?,
            ior: index_of_refraction(builder, from, name),
            volume: from.volume().filter(|volume| volume.thickness_factor() > 0.0).map(|volume| absorption(&volume)),
            ..self.extensions(builder, from)?
        };
        if has_plain_boundary(&model) {
            builder.note(format!(
                "\"{name}\": its volume's boundary is not stretched by its anisotropy, and reflects by its index alone."
            ));
        }
        Ok(Surface::MetalRoughness(model))
    }

    fn transmission(&mut self, builder: &mut Builder, from: &gltf::Material) -> Result<ScalarInput, LoadError> {
        let Some(transmission) = from.transmission() else { return Ok(ScalarInput::constant(0.0)) };
        let lookup = self.optional(builder, transmission.transmission_texture().as_ref(), Encoding::Linear)?;
        Ok(ScalarInput { factor: share(transmission.transmission_factor()), texture: lookup.map(|lookup| (lookup, 0)) })
    }

    /// The file's unit is cd/m².
    fn emission(&mut self, builder: &mut Builder, from: &gltf::Material) -> Result<ColorInput, LoadError> {
        let strength = from.emissive_strength().unwrap_or(1.0) / builder.nits_per_unit as f32;
        let factor = Vec3::from_array(from.emissive_factor()) * strength;
        let factor = if factor.is_finite() { factor.max(Vec3::ZERO) } else { Vec3::ZERO };
        if factor == Vec3::ZERO {
            return Ok(ColorInput::constant(Vec3::ZERO));
        }
        Ok(ColorInput { factor, texture: self.optional(builder, from.emissive_texture().as_ref(), Encoding::Srgb)? })
    }

    fn relief(&mut self, builder: &mut Builder, from: &gltf::Material) -> Result<Option<Relief>, LoadError> {
        let Some(normal) = from.normal_texture() else { return Ok(None) };
        let transform = normal.extension_value("KHR_texture_transform");
        let transform = transform.map(read_transform);
        let lookup = self.lookup(builder, &normal.texture(), Encoding::Linear, transform, [128, 128, 255, 255])?;
        let strength = if normal.scale().is_finite() { normal.scale() } else { 1.0 };
        Ok(lookup.map(|map| Relief::Normals { map, strength }))
    }

    /// What extensions say about the surface beyond the core's parameters.
    fn extensions(&mut self, builder: &mut Builder, from: &gltf::Material) -> Result<MetalRoughness, LoadError> {
        let mut model = MetalRoughness::default();
        if let Some(coat) = Extension::of(self.path, builder, from, &CLEARCOAT)? {
            model.clearcoat = self.scalar(builder, &coat, ["clearcoatFactor", "clearcoatTexture"], 0)?;
            let keys = ["clearcoatRoughnessFactor", "clearcoatRoughnessTexture"];
            model.clearcoat_roughness = self.scalar(builder, &coat, keys, 1)?;
            model.coat_relief = CoatRelief::Own(self.coat_normals(builder, &coat)?);
        }
        if let Some(sheen) = Extension::of(self.path, builder, from, &SHEEN)? {
            let texture = self.picture_of(builder, &sheen, "sheenColorTexture", Encoding::Srgb, [255; 4])?;
            model.sheen_color = ColorInput { factor: sheen.color("sheenColorFactor")?, texture };
            let keys = ["sheenRoughnessFactor", "sheenRoughnessTexture"];
            model.sheen_roughness = self.scalar(builder, &sheen, keys, 3)?;
        }
        if let Some(anisotropy) = Extension::of(self.path, builder, from, &ANISOTROPY)? {
            let lookup = self.anisotropy_texture(builder, &anisotropy)?;
            model.anisotropy = ScalarInput {
                factor: share(anisotropy.number("anisotropyStrength")?),
                texture: lookup.map(|lookup| (lookup, 2)),
            };
        }
        if let Some(specular) = from.specular() {
            let factor = specular.specular_factor();
            model.specular = ScalarInput {
                factor: if factor.is_finite() { factor.clamp(0.0, 1.0) } else { 1.0 },
                texture: self
                    .optional(builder, specular.specular_texture().as_ref(), Encoding::Linear)?
                    .map(|lookup| (lookup, 3)),
            };
            let color = Vec3::from_array(specular.specular_color_factor());
            model.specular_color = ColorInput {
                factor: if color.is_finite() { color.max(Vec3::ZERO) } else { Vec3::ONE },
                texture: self.optional(builder, specular.specular_color_texture().as_ref(), Encoding::Srgb)?,
            };
        }
        Ok(model)
    }

    /// The normal map of KHR_materials_clearcoat; without one the coat is smooth, whatever lies beneath it.
    fn coat_normals(&mut self, builder: &mut Builder, coat: &Extension) -> Result<Option<Relief>, LoadError> {
        let key = "clearcoatNormalTexture";
        let map = self.picture_of(builder, coat, key, Encoding::Linear, [128, 128, 255, 255])?;
        let strength = match coat.values.get(key).and_then(|info| info.get("scale")) {
            None => 1.0,
            Some(scale) => scale.as_f64().ok_or_else(|| coat.wrong(key, "its scale is no number"))? as f32,
        };
        Ok(map.map(|map| Relief::Normals { map, strength: if strength.is_finite() { strength } else { 1.0 } }))
    }

    /// The direction of KHR_materials_anisotropy: red and green of its texture, whose blue is the strength, and its
    /// rotation.
    fn stretch(&mut self, builder: &mut Builder, from: &gltf::Material) -> Result<Option<StretchDirection>, LoadError> {
        let Some(anisotropy) = Extension::of(self.path, builder, from, &ANISOTROPY)? else { return Ok(None) };
        let rotation = anisotropy.number("anisotropyRotation")?;
        let rotation = if rotation.is_finite() { rotation } else { 0.0 };
        let map = self.anisotropy_texture(builder, &anisotropy)?;
        Ok((rotation != 0.0 || map.is_some()).then_some(StretchDirection { rotation, map }))
    }

    /// Red and green are a direction, blue a strength; along u and in full where the picture is missing.
    fn anisotropy_texture(
        &mut self,
        builder: &mut Builder,
        anisotropy: &Extension,
    ) -> Result<Option<TextureLookup>, LoadError> {
        self.picture_of(builder, anisotropy, "anisotropyTexture", Encoding::Linear, [255, 128, 255, 255])
    }

    /// A factor in [0, 1], 0 unless told, and a channel of a texture.
    fn scalar(
        &mut self,
        builder: &mut Builder,
        extension: &Extension,
        [factor, texture]: [&str; 2],
        channel: u8,
    ) -> Result<ScalarInput, LoadError> {
        let lookup = self.picture_of(builder, extension, texture, Encoding::Linear, [255; 4])?;
        let factor = share(extension.number(factor)?);
        Ok(ScalarInput { factor, texture: lookup.map(|lookup| (lookup, channel)) })
    }
}

/// How much of what is there counts: by the base colour's factor and the alpha of its picture.
fn alpha(from: &gltf::Material, base: Option<TextureLookup>) -> Alpha {
    let [.., opacity] = from.pbr_metallic_roughness().base_color_factor();
    let value = ScalarInput { factor: share(opacity), texture: base.map(|lookup| (lookup, 3)) };
    match from.alpha_mode() {
        AlphaMode::Opaque => Alpha::Opaque,
        AlphaMode::Mask => {
            let cutoff = from.alpha_cutoff().filter(|cutoff| cutoff.is_finite()).unwrap_or(0.5);
            Alpha::Mask { value, cutoff: cutoff.max(0.0) }
        }
        AlphaMode::Blend => Alpha::Blend { value },
    }
}

/// Per unit of length.
fn absorption(volume: &gltf::material::Volume) -> Vec3 {
    let distance = volume.attenuation_distance();
    let left = Vec3::from_array(volume.attenuation_color()).clamp(Vec3::splat(1e-4), Vec3::ONE);
    if distance.is_finite() && distance > 0.0 { Surface::absorption_of(left, distance) } else { Vec3::ZERO }
}

/// What is told where it can be used, else the usual one.
fn index_of_refraction(builder: &mut Builder, from: &gltf::Material, name: &str) -> f32 {
    let has_volume = from.volume().is_some_and(|volume| volume.thickness_factor() > 0.0);
    let Some(ior) = from.ior() else { return USUAL_IOR };
    match MetalRoughness::problem_with_ior(ior, has_volume) {
        None => ior,
        Some(problem) => {
            builder.note(format!("\"{name}\": ior {ior} is taken as {USUAL_IOR}: {problem}."));
            USUAL_IOR
        }
    }
}

/// Whether a volume's boundary, which is a plain dielectric, leaves out what the material asks for.
fn has_plain_boundary(model: &MetalRoughness) -> bool {
    let asks = model.anisotropy.factor > 0.0
        || model.specular != ScalarInput::constant(1.0)
        || model.specular_color != ColorInput::constant(Vec3::ONE);
    model.volume.is_some() && model.transmission.factor > 0.0 && asks
}
