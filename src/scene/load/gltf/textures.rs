//! glTF textures: where their pictures are, how they are placed and wrapped.

use super::super::builder::Builder;
use super::super::error::{LoadError, Place};
use super::super::texture::{Adjust, IfMissing, Picture, Request};
use super::buffers::{Uri, resolve};
use super::extension::Extension;
use super::material::Materials;
use crate::scene::{Encoding, TextureLookup, Wrap};
use glam::Vec2;
use gltf::texture::{MagFilter, WrappingMode};
use serde_json::Value;
use std::sync::Arc;

impl Materials<'_> {
    pub(super) fn picture_of(
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
        let transform = transform.map(read_transform);
        self.lookup(builder, &texture, encoding, transform, if_missing)
    }

    pub(super) fn optional(
        &mut self,
        builder: &mut Builder,
        info: Option<&gltf::texture::Info>,
        encoding: Encoding,
    ) -> Result<Option<TextureLookup>, LoadError> {
        let Some(info) = info else { return Ok(None) };
        let transform = info.texture_transform().map(|transform| Transform {
            offset: Vec2::from_array(transform.offset()),
            rotation: transform.rotation(),
            scale: Vec2::from_array(transform.scale()),
        });
        self.lookup(builder, &info.texture(), encoding, transform, [180, 180, 180, 255])
    }

    pub(super) fn lookup(
        &mut self,
        builder: &mut Builder,
        texture: &gltf::Texture,
        encoding: Encoding,
        transform: Option<Transform>,
        if_missing: [u8; 4],
    ) -> Result<Option<TextureLookup>, LoadError> {
        let Some(picture) = self.picture_of_texture(builder, texture)? else { return Ok(None) };
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
        Ok(Some(transform.map_or(plain, |transform| transform.of(plain))))
    }

    /// The picture of a texture; a note says why there is none.
    fn picture_of_texture(
        &mut self,
        builder: &mut Builder,
        texture: &gltf::Texture,
    ) -> Result<Option<Picture>, LoadError> {
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
        if picture.is_none() {
            let extensions: Vec<&str> = others().map(|(name, _)| name.as_str()).collect();
            let why = if index < self.document.as_json().images.len() {
                "its image has neither a file nor a buffer view".to_owned()
            } else if extensions.is_empty() || webp.is_some() {
                "its image is not there".to_owned()
            } else {
                format!("its image is that of {} alone, which is not read", extensions.join(", "))
            };
            builder.note(format!("Texture {}: {why}; left out.", texture.index()));
        }
        Ok(picture)
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

/// KHR_texture_transform.
#[derive(Clone, Copy)]
pub(super) struct Transform {
    offset: Vec2,
    rotation: f32,
    scale: Vec2,
}

impl Transform {
    /// A look-up so placed; as it was where the transform is not finite.
    fn of(self, plain: TextureLookup) -> TextureLookup {
        let Self { offset, rotation, scale } = self;
        let is_finite = offset.is_finite() && rotation.is_finite() && scale.is_finite();
        if is_finite { TextureLookup { offset, rotation, scale, ..plain } } else { plain }
    }
}

/// The extension where the crate leaves it as JSON (normal maps).
pub(super) fn read_transform(value: &Value) -> Transform {
    let number =
        |value: Option<&Value>, default: f32| value.and_then(Value::as_f64).map_or(default, |number| number as f32);
    let pair = |key: &str, default: f32| {
        let part = |place: usize| number(value.get(key).and_then(|pair| pair.get(place)), default);
        Vec2::new(part(0), part(1))
    };
    Transform { offset: pair("offset", 0.0), rotation: number(value.get("rotation"), 0.0), scale: pair("scale", 1.0) }
}
