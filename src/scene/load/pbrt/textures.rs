//! `Texture`: image maps, constants, products, checkerboards. What else pbrt can compute is named and averaged.

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
/// What is done to textures that a checkerboard is made of.
const INSIDE_A_CHECKERBOARD: &str = "textures inside a checkerboard: their mean colours";

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

/// Whether a picture's numbers are light, by its name.
fn holds_light(file: &Path) -> bool {
    let ending = file.extension().map(|ending| ending.to_ascii_lowercase());
    ending.is_some_and(|ending| ["exr", "hdr", "pfm"].iter().any(|light| ending == *light))
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
                let (lookup, scale) = self.image(parameters, None)?;
                Ok(ColorInput { factor: Vec3::splat(scale), texture: Some(lookup) })
            }
            "scale" => {
                let base = self.color_operand(parameters, "tex", Vec3::ONE, depth)?;
                let scale = self.scalar_operand(parameters, "scale", 1.0, depth)?;
                // The three colours of a number's texture are that number.
                let (rest, texture) = match (base.texture, scale.texture) {
                    (None, texture) => (scale.factor, texture.map(|(lookup, _)| lookup)),
                    (texture, None) => (scale.factor, texture),
                    (texture, Some(_)) => {
                        self.average(parameters, name, "its scale's texture: its mean");
                        (self.mean_of_number(&scale)?, texture)
                    }
                };
                Ok(ColorInput { factor: base.factor * rest, texture })
            }
            "mix" => {
                let amount = self.amount(parameters, name, depth)?;
                let first = self.color_operand(parameters, "tex1", Vec3::ZERO, depth)?;
                let second = self.color_operand(parameters, "tex2", Vec3::ONE, depth)?;
                if first.texture.is_none() && second.texture.is_none() {
                    return Ok(ColorInput::constant(first.factor.lerp(second.factor, amount)));
                }
                self.average(parameters, name, "the mix of textures: the heavier one");
                Ok(if amount < 0.5 { first } else { second })
            }
            "checkerboard" => {
                let colors = [
                    self.color_operand(parameters, "tex1", Vec3::ONE, depth)?,
                    self.color_operand(parameters, "tex2", Vec3::ZERO, depth)?,
                ];
                if colors.iter().any(|color| color.texture.is_some()) {
                    self.average(parameters, name, INSIDE_A_CHECKERBOARD);
                }
                let [even, odd] = [self.mean_of_color(&colors[0])?, self.mean_of_color(&colors[1])?];
                let lookup = self.checkerboard(parameters, [even, odd])?;
                Ok(ColorInput { factor: Vec3::ONE, texture: Some(lookup) })
            }
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
                let (lookup, factor) = self.image(parameters, Some(Number::AlphaOrMean))?;
                Ok(ScalarInput { factor, texture: Some((lookup, 0)) })
            }
            "scale" => {
                let base = self.scalar_operand(parameters, "tex", 1.0, depth)?;
                let scale = self.scalar_operand(parameters, "scale", 1.0, depth)?;
                if base.texture.is_some() && scale.texture.is_some() {
                    self.average(parameters, name, "its scale's texture: its mean");
                    let factor = base.factor * self.mean_of_number(&scale)?;
                    return Ok(ScalarInput { factor, texture: base.texture });
                }
                Ok(ScalarInput { factor: base.factor * scale.factor, texture: base.texture.or(scale.texture) })
            }
            "mix" => {
                let amount = self.amount(parameters, name, depth)?;
                let first = self.scalar_operand(parameters, "tex1", 0.0, depth)?;
                let second = self.scalar_operand(parameters, "tex2", 1.0, depth)?;
                if first.texture.is_none() && second.texture.is_none() {
                    return Ok(ScalarInput::constant(first.factor + (second.factor - first.factor) * amount));
                }
                self.average(parameters, name, "the mix of textures: the heavier one");
                Ok(if amount < 0.5 { first } else { second })
            }
            "checkerboard" => {
                let values = [
                    self.scalar_operand(parameters, "tex1", 1.0, depth)?,
                    self.scalar_operand(parameters, "tex2", 0.0, depth)?,
                ];
                if values.iter().any(|value| value.texture.is_some()) {
                    self.average(parameters, name, INSIDE_A_CHECKERBOARD);
                }
                let [even, odd] = [self.mean_of_number(&values[0])?, self.mean_of_number(&values[1])?];
                let lookup = self.checkerboard(parameters, [even, odd].map(Vec3::splat))?;
                Ok(ScalarInput { factor: 1.0, texture: Some((lookup, 0)) })
            }
            other => {
                self.average(parameters, name, &format!("a texture of type \"{other}\": 0.5"));
                Ok(ScalarInput::constant(0.5))
            }
        }
    }

    /// The share of a mix's second part, which is one number here.
    fn amount(&mut self, parameters: &Parameters, name: &str, depth: usize) -> Result<f32, LoadError> {
        let amount = self.scalar_operand(parameters, "amount", 0.5, depth)?;
        if amount.texture.is_some() {
            self.average(parameters, name, "its amount's texture: its mean");
        }
        self.mean_of_number(&amount)
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
    fn image(&mut self, parameters: &Parameters, of_number: Option<Number>) -> Result<(TextureLookup, f32), LoadError> {
        let Some(file) = parameters.string("filename")? else {
            return Err(parameters.error("an imagemap needs a \"string filename\""));
        };
        let file = self.file(file);
        let (encoding, exponent) = match parameters.string("encoding")? {
            None | Some("sRGB") => (Encoding::Srgb, 1.0),
            Some("linear") => (Encoding::Linear, 1.0),
            Some(other) => match other.strip_prefix("gamma ").and_then(|gamma| gamma.trim().parse::<f32>().ok()) {
                // What holds light itself is not encoded.
                Some(gamma) if gamma > 0.0 && gamma.is_finite() && holds_light(&file) => (Encoding::Linear, 1.0),
                Some(gamma) if gamma > 0.0 && gamma.is_finite() => (Encoding::Linear, gamma),
                _ => {
                    return Err(
                        parameters.error(format_args!("encoding \"{other}\": expected sRGB, linear or gamma G"))
                    );
                }
            },
        };
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
        let to_number = of_number.filter(|_| !is_grey(&file));
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

    /// Two colours that alternate over unit squares: four texels, repeated.
    fn checkerboard(&mut self, parameters: &Parameters, [even, odd]: [Vec3; 2]) -> Result<TextureLookup, LoadError> {
        if parameters.integer("dimension")?.is_some_and(|dimension| dimension != 2) {
            return Err(parameters.unsupported("a checkerboard in three dimensions is not rendered"));
        }
        let lookup = self.mapping(parameters)?;
        let [even, odd] = [even, odd].map(|color| color.extend(1.0).to_array());
        let texture = self.builder.textures.add(Request {
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            nearest: true,
            // pbrt's t runs up: the upper row holds t in [1, 2).
            ..Request::texels("checkerboard", [2, 2], &[odd, even, even, odd])
        });
        // Two squares a picture; our v of the picture is 1 − t/2.
        let (scale, offset) = (0.5 * lookup.scale, 0.5 * lookup.offset);
        Ok(TextureLookup { texture, scale, offset: Vec2::new(offset.x, offset.y + 0.5), ..lookup })
    }
}
