//! `Texture`: image maps and constants here, products, mixes and checkerboards in `combined`. What else pbrt can
//! compute is named and averaged.

mod combined;

use self::combined::Combination;
use super::super::error::{LoadError, no_such};
use super::super::texture::{Adjust, IfMissing, Number, Picture, Request, is_grey};
use super::Reader;
use super::inputs::Meaning;
use super::parameters::Parameters;
use crate::scene::{ColorInput, Encoding, ScalarInput, TextureLookup, Wrap};
use glam::{Vec2, Vec3};
use std::cell::OnceCell;
use std::path::Path;
use std::rc::Rc;

/// Deepest chain of textures that use textures.
const DEEPEST: usize = 32;

/// A texture as it was written.
pub(super) struct Definition {
    kind: String,
    parameters: Parameters,
    /// What it came to where it was used first: textures may be named many times over.
    color: OnceCell<ColorInput>,
    scalar: OnceCell<ScalarInput>,
}

impl Definition {
    pub(super) fn new(kind: &str, parameters: Parameters) -> Self {
        Self { kind: kind.to_owned(), parameters, color: OnceCell::new(), scalar: OnceCell::new() }
    }
}

/// What a picture is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wanted {
    Color,
    Number,
}

/// How pbrt reads a picture (`Image::Read`), by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reading {
    /// Its numbers are light, which no curve encodes.
    Light,
    /// Encoded as the texture says, alpha and all.
    AsTold,
    /// As sRGB whatever the texture says, and its alpha dropped.
    AsSrgb,
}

impl Reading {
    fn of(file: &Path) -> Self {
        let ending = file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match ending.as_str() {
            "exr" | "hdr" | "pfm" => Self::Light,
            "jpg" | "jpeg" | "tga" | "bmp" => Self::AsSrgb,
            _ => Self::AsTold,
        }
    }

    fn number(self) -> Number {
        match self {
            Self::Light | Self::AsTold => Number::AlphaOrMean,
            Self::AsSrgb => Number::Mean,
        }
    }
}

/// The curve of a picture, and the exponent that follows it.
fn encoding(parameters: &Parameters, reading: Reading) -> Result<(Encoding, f32), LoadError> {
    let told = match parameters.string("encoding")? {
        None | Some("sRGB") => (Encoding::Srgb, 1.0),
        Some("linear") => (Encoding::Linear, 1.0),
        Some(other) => match other.strip_prefix("gamma ").and_then(|gamma| gamma.trim().parse::<f32>().ok()) {
            Some(gamma) if gamma > 0.0 && gamma.is_finite() => (Encoding::Linear, gamma),
            _ => {
                return Err(parameters.error(format_args!("encoding \"{other}\": expected sRGB, linear or gamma G")));
            }
        },
    };
    Ok(match reading {
        Reading::Light => (told.0, 1.0),
        Reading::AsTold => told,
        Reading::AsSrgb => (Encoding::Srgb, 1.0),
    })
}

impl Reader<'_> {
    /// A colour texture by name.
    pub(super) fn color_texture(
        &mut self,
        user: &Parameters,
        name: &str,
        depth: usize,
    ) -> Result<ColorInput, LoadError> {
        let definition = self.find_texture(user, "spectrum", name, depth)?;
        if let Some(color) = definition.color.get() {
            return Ok(*color);
        }
        let color = self.color_of(&definition, name, depth)?;
        self.note_unread(&format!("texture \"{name}\""), &definition.parameters);
        Ok(*definition.color.get_or_init(|| color))
    }

    fn color_of(&mut self, definition: &Definition, name: &str, depth: usize) -> Result<ColorInput, LoadError> {
        let parameters = &definition.parameters;
        match definition.kind.as_str() {
            "constant" => {
                let value = self.color(parameters, "value", Meaning::Reflectance)?.unwrap_or(Vec3::ONE);
                Ok(ColorInput::constant(value))
            }
            "imagemap" => {
                let (lookup, scale) = self.image(parameters, Wanted::Color)?;
                Ok(ColorInput { factor: Vec3::splat(scale), texture: Some(lookup) })
            }
            "scale" => self.scaled(Combination { parameters, name, depth }),
            "mix" => self.mixed(Combination { parameters, name, depth }),
            "checkerboard" => self.checkered(Combination { parameters, name, depth }),
            other => {
                self.average(parameters, name, &format!("a texture of type \"{other}\": grey 0.5"));
                Ok(ColorInput::constant(Vec3::splat(0.5)))
            }
        }
    }

    /// A scalar texture by name.
    pub(super) fn scalar_texture(
        &mut self,
        user: &Parameters,
        name: &str,
        depth: usize,
    ) -> Result<ScalarInput, LoadError> {
        let definition = self.find_texture(user, "float", name, depth)?;
        if let Some(scalar) = definition.scalar.get() {
            return Ok(*scalar);
        }
        let scalar = self.scalar_of(&definition, name, depth)?;
        self.note_unread(&format!("texture \"{name}\""), &definition.parameters);
        Ok(*definition.scalar.get_or_init(|| scalar))
    }

    fn scalar_of(&mut self, definition: &Definition, name: &str, depth: usize) -> Result<ScalarInput, LoadError> {
        let parameters = &definition.parameters;
        match definition.kind.as_str() {
            "constant" => Ok(ScalarInput::constant(parameters.float_or("value", 1.0)?)),
            "imagemap" => {
                let (lookup, factor) = self.image(parameters, Wanted::Number)?;
                Ok(ScalarInput { factor, texture: Some((lookup, 0)) })
            }
            "scale" => self.scaled(Combination { parameters, name, depth }),
            "mix" => self.mixed(Combination { parameters, name, depth }),
            "checkerboard" => self.checkered(Combination { parameters, name, depth }),
            other => {
                self.average(parameters, name, &format!("a texture of type \"{other}\": 0.5"));
                Ok(ScalarInput::constant(0.5))
            }
        }
    }

    /// What stands for a texture where only a colour has a place.
    pub(super) fn mean_of_color(&self, input: &ColorInput) -> Result<Vec3, LoadError> {
        let Some(lookup) = input.texture else { return Ok(input.factor) };
        Ok(input.factor * self.builder.textures.mean_color(lookup.texture)?)
    }

    /// The same where only a number has one.
    fn mean_of_number(&self, input: &ScalarInput) -> Result<f32, LoadError> {
        let Some((lookup, _)) = input.texture else { return Ok(input.factor) };
        Ok(input.factor * self.builder.textures.mean_color(lookup.texture)?.x)
    }

    fn average(&mut self, parameters: &Parameters, name: &str, what: &str) {
        self.builder.note(format!("{}: texture \"{name}\": not rendered as such: {what}.", parameters.place()));
    }

    fn find_texture(
        &mut self,
        user: &Parameters,
        class: &'static str,
        name: &str,
        depth: usize,
    ) -> Result<Rc<Definition>, LoadError> {
        if depth > DEEPEST {
            return Err(user.error(format_args!("texture \"{name}\" uses itself, or {DEEPEST} others in a chain")));
        }
        let key = (class, name.to_owned());
        if !self.textures.contains_key(&key) {
            self.look_ahead()?;
        }
        if let Some(definition) = self.textures.get(&key) {
            return Ok(Rc::clone(definition));
        }
        let of_class = self.textures.keys().filter(|(of, _)| *of == class).map(|(_, name)| name);
        Err(user.error(no_such(format_args!("{class} texture"), name, of_class)))
    }

    /// A colour, or another texture.
    fn color_operand(
        &mut self,
        parameters: &Parameters,
        name: &str,
        default: Vec3,
        depth: usize,
    ) -> Result<ColorInput, LoadError> {
        if let Some(texture) = parameters.word(&["texture"], name)? {
            let texture = texture.to_owned();
            return self.color_texture(parameters, &texture, depth + 1);
        }
        let color = self.color(parameters, name, Meaning::Reflectance)?;
        let color = color.or(parameters.float(name)?.map(Vec3::splat)).unwrap_or(default);
        Ok(ColorInput::constant(color))
    }

    fn scalar_operand(
        &mut self,
        parameters: &Parameters,
        name: &str,
        default: f32,
        depth: usize,
    ) -> Result<ScalarInput, LoadError> {
        match parameters.word(&["texture"], name)? {
            Some(texture) => {
                let texture = texture.to_owned();
                self.scalar_texture(parameters, &texture, depth + 1)
            }
            None => Ok(ScalarInput::constant(parameters.float_or(name, default)?)),
        }
    }

    /// An image file, of colours or of some number, and its scale.
    fn image(&mut self, parameters: &Parameters, wanted: Wanted) -> Result<(TextureLookup, f32), LoadError> {
        let Some(file) = parameters.string("filename")? else {
            return Err(parameters.error("an imagemap needs a \"string filename\""));
        };
        let file = self.file(file);
        let reading = Reading::of(&file);
        let (encoding, exponent) = encoding(parameters, reading)?;
        let wrap = match parameters.string("wrap")? {
            None | Some("repeat") => Wrap::Repeat,
            Some("clamp") => Wrap::Clamp,
            Some(other) => {
                let note = format!("{}: wrap \"{other}\" is rendered as \"clamp\".", parameters.place());
                self.builder.note(note);
                Wrap::Clamp
            }
        };
        let nearest = match parameters.string("filter")? {
            Some("point") => true,
            Some("trilinear" | "ewa" | "EWA" | "bilinear") | None => false,
            Some(other) => return Err(parameters.error(format_args!("filter \"{other}\" is not known"))),
        };
        let scale = parameters.float_or("scale", 1.0)?;
        let inverts = parameters.boolean_or("invert", false)?;
        let mut lookup = self.mapping(parameters)?;
        // A picture of one channel is its number already, and stays small. pbrt drops its alpha.
        let to_number = (wanted == Wanted::Number && !is_grey(&file)).then(|| reading.number());
        lookup.texture = self.builder.textures.add(Request {
            picture: Picture::File(file),
            encoding,
            wrap_u: wrap,
            wrap_v: wrap,
            nearest,
            if_missing: IfMissing::Fail(parameters.place()),
            adjust: Adjust {
                exponent_bits: exponent.to_bits(),
                inverted_scale_bits: inverts.then_some(scale.to_bits()),
                to_number,
            },
        });
        // Inverting is the last that pbrt does.
        Ok((lookup, if inverts { 1.0 } else { scale }))
    }

    /// A picture that stands where a texture could, all of it over the unit square.
    pub(super) fn picture(
        &mut self,
        file: &str,
        parameters: &Parameters,
        encoding: Encoding,
        wrap: Wrap,
    ) -> TextureLookup {
        TextureLookup::plain(self.builder.textures.add(Request {
            picture: Picture::File(self.file(file)),
            encoding,
            wrap_u: wrap,
            wrap_v: wrap,
            nearest: false,
            if_missing: IfMissing::Fail(parameters.place()),
            adjust: Adjust::NONE,
        }))
    }

    /// `uscale` and its like, for pbrt's v that runs up where ours runs down.
    fn mapping(&mut self, parameters: &Parameters) -> Result<TextureLookup, LoadError> {
        if let Some(other) = parameters.string("mapping")?.filter(|mapping| *mapping != "uv") {
            let note = format!("{}: mapping \"{other}\": the mesh's own coordinates are used.", parameters.place());
            self.builder.note(note);
        }
        let scale = Vec2::new(parameters.float_or("uscale", 1.0)?, parameters.float_or("vscale", 1.0)?);
        let delta = Vec2::new(parameters.float_or("udelta", 0.0)?, parameters.float_or("vdelta", 0.0)?);
        Ok(TextureLookup {
            texture: crate::scene::TextureId(0),
            offset: Vec2::new(delta.x, 1.0 - scale.y - delta.y),
            rotation: 0.0,
            scale,
        })
    }
}
