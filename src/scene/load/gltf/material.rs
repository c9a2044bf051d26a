//! glTF materials and textures.

use super::super::builder::Builder;
use super::super::error::{LoadError, Place};
use super::super::texture::{Adjust, IfMissing, Picture, Request};
use super::buffers::{Buffers, Uri, resolve};
use super::extension::{ANISOTROPY, CLEARCOAT, Extension, SHEEN, name_of, share};
use crate::scene::{
    Alpha, CoatRelief, ColorInput, Encoding, Material, MaterialId, MetalRoughness, Relief, ScalarInput,
    StretchDirection, Surface, TextureLookup, USUAL_IOR, Wrap,
};
use glam::{Vec2, Vec3};
use gltf::material::AlphaMode;
use gltf::texture::{MagFilter, WrappingMode};
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Converts materials when a primitive uses them.
pub(super) struct Materials<'a> {
    pub(super) path: &'a Path,
    pub(super) document: &'a gltf::Document,
    pub(super) buffers: &'a Buffers,
    converted: HashMap<Option<usize>, MaterialId>,
    embedded: HashMap<usize, Arc<Vec<u8>>>,
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
        note_coordinates(builder, Some(u64::from(normal.tex_coord())), transform);
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

    /// The direction of KHR_materials_anisotropy: red and green of its texture, whose blue is the strength, and its rotation.
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

    fn picture_of(
        &mut self,
        builder: &mut Builder,
        extension: &Extension,
        key: &str,
        encoding: Encoding,
        if_missing: [u8; 4],
    ) -> Result<Option<TextureLookup>, LoadError> {
        let Some(info) = extension.values.get(key) else { return Ok(None) };
        let index = info.get("index").and_then(Value::as_u64);
        let Some(texture) = index.and_then(|index| self.document.textures().nth(index as usize)) else {
            return Err(extension.wrong(key, "there is no texture of this index"));
        };
        let transform = info.pointer("/extensions/KHR_texture_transform");
        note_coordinates(builder, info.get("texCoord").map_or(Some(0), Value::as_u64), transform);
        let transform = transform.map(read_transform);
        self.lookup(builder, &texture, encoding, transform, if_missing)
    }

    fn optional(
        &mut self,
        builder: &mut Builder,
        info: Option<&gltf::texture::Info>,
        encoding: Encoding,
    ) -> Result<Option<TextureLookup>, LoadError> {
        let Some(info) = info else { return Ok(None) };
        let transform = info.texture_transform();
        let set = transform.as_ref().and_then(gltf::texture::TextureTransform::tex_coord).unwrap_or(info.tex_coord());
        note_coordinates(builder, Some(u64::from(set)), None);
        let transform = transform.map(|transform| Transform {
            offset: Vec2::from_array(transform.offset()),
            rotation: transform.rotation(),
            scale: Vec2::from_array(transform.scale()),
        });
        self.lookup(builder, &info.texture(), encoding, transform, [180, 180, 180, 255])
    }

    fn lookup(
        &mut self,
        builder: &mut Builder,
        texture: &gltf::Texture,
        encoding: Encoding,
        transform: Option<Transform>,
        if_missing: [u8; 4],
    ) -> Result<Option<TextureLookup>, LoadError> {
        let json = &self.document.as_json().textures[texture.index()];
        let others = || json.extensions.iter().flat_map(|extensions| &extensions.others);
        // Its image stands for the other, which is for programs that do not read WebP.
        let webp =
            others().find(|(name, _)| *name == "EXT_texture_webp").and_then(|(_, webp)| webp.get("source")?.as_u64());
        let index = webp.map_or(json.source.value(), |index| index as usize);
        let picture = match self.picture(index) {
            Err(error) if error.is_unsupported() => {
                builder.note(format!("Texture {}: {error}; left out.", texture.index()));
                return Ok(None);
            }
            other => other?,
        };
        let Some(picture) = picture else {
            let extensions: Vec<&str> = others().map(|(name, _)| name.as_str()).collect();
            let why = if index < self.document.as_json().images.len() {
                "its image has neither a file nor a buffer view".to_owned()
            } else if extensions.is_empty() || webp.is_some() {
                "its image is not there".to_owned()
            } else {
                format!("its image is that of {} alone, which is not read", extensions.join(", "))
            };
            builder.note(format!("Texture {}: {why}; left out.", texture.index()));
            return Ok(None);
        };
        let sampler = texture.sampler();
        let wrap = |mode| match mode {
            WrappingMode::ClampToEdge => Wrap::Clamp,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::Repeat => Wrap::Repeat,
        };
        let texture = builder.textures.add(Request {
            picture,
            encoding,
            wrap_u: wrap(sampler.wrap_s()),
            wrap_v: wrap(sampler.wrap_t()),
            nearest: sampler.mag_filter() == Some(MagFilter::Nearest),
            if_missing: IfMissing::Replace(if_missing, Place::file(self.path)),
            adjust: Adjust::NONE,
        });
        let plain = TextureLookup::plain(texture);
        Ok(Some(match transform {
            Some(Transform { offset, rotation, scale })
                if offset.is_finite() && rotation.is_finite() && scale.is_finite() =>
            {
                TextureLookup { offset, rotation, scale, ..plain }
            }
            _ => plain,
        }))
    }

    /// Where an image's bytes are. Not through the crate's `Image::source`, which panics without a MIME type.
    fn picture(&mut self, index: usize) -> Result<Option<Picture>, LoadError> {
        let Some(image) = self.document.as_json().images.get(index) else {
            return Ok(None);
        };
        let name = image.name.clone().unwrap_or_else(|| format!("image {index}"));
        let name = format!("{}: {name}", self.path.display());
        if let Some(bytes) = self.embedded.get(&index) {
            return Ok(Some(Picture::Memory { name, bytes: bytes.clone() }));
        }
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => match resolve(self.path, uri)? {
                Uri::File(file) => return Ok(Some(Picture::File(file))),
                Uri::Data(bytes) => bytes,
            },
            (None, Some(view)) => match self.document.views().nth(view.value()) {
                Some(view) => self.buffers.view(&view)?.to_vec(),
                None => return Ok(None),
            },
            (None, None) => return Ok(None),
        };
        let bytes = self.embedded.entry(index).or_insert(Arc::new(bytes)).clone();
        Ok(Some(Picture::Memory { name, bytes }))
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

/// Says so where a texture asks for coordinates beyond the first set; a transform's own set stands over the texture's.
fn note_coordinates(builder: &mut Builder, set: Option<u64>, transform: Option<&Value>) {
    let own = transform.and_then(|transform| transform.get("texCoord"));
    if own.map_or(set, Value::as_u64) != Some(0) {
        builder.note("Texture coordinate sets beyond the first are not used.");
    }
}

/// KHR_texture_transform.
#[derive(Clone, Copy)]
struct Transform {
    offset: Vec2,
    rotation: f32,
    scale: Vec2,
}

/// The extension where the crate leaves it as JSON (normal maps).
fn read_transform(value: &Value) -> Transform {
    let number =
        |value: Option<&Value>, default: f32| value.and_then(Value::as_f64).map_or(default, |number| number as f32);
    let pair = |key: &str, default: f32| {
        let part = |place: usize| number(value.get(key).and_then(|pair| pair.get(place)), default);
        Vec2::new(part(0), part(1))
    };
    Transform { offset: pair("offset", 0.0), rotation: number(value.get("rotation"), 0.0), scale: pair("scale", 1.0) }
}
