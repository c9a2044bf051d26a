//! Textures that are made of others, alike for colours and for numbers.

use super::super::Reader;
use super::super::parameters::Parameters;
use crate::scene::load::error::LoadError;
use crate::scene::load::texture::Request;
use crate::scene::{ColorInput, ScalarInput, TextureLookup, Wrap};
use glam::{Vec2, Vec3};
use std::ops::Mul;

/// A texture that is made of others.
#[derive(Clone, Copy)]
pub(super) struct Combination<'a> {
    pub(super) parameters: &'a Parameters,
    pub(super) name: &'a str,
    /// Depth of the texture in textures that use textures.
    pub(super) depth: usize,
}

/// What textures of colours and of numbers have in common.
pub(super) trait Input: Copy {
    type Value: Copy + Mul<f32, Output = Self::Value>;

    fn of(factor: Self::Value, texture: Option<TextureLookup>) -> Self;

    fn factor(&self) -> Self::Value;

    fn texture(&self) -> Option<TextureLookup>;

    /// A number, or grey.
    fn value(number: f32) -> Self::Value;

    fn between(first: Self::Value, second: Self::Value, amount: f32) -> Self::Value;

    /// A value, or another texture.
    fn operand(reader: &mut Reader<'_>, of: Combination<'_>, name: &str, default: f32) -> Result<Self, LoadError>;

    /// The colour that stands for it where only a constant has a place.
    fn mean_color(&self, reader: &Reader<'_>) -> Result<Vec3, LoadError>;
}

impl Input for ColorInput {
    type Value = Vec3;

    fn of(factor: Vec3, texture: Option<TextureLookup>) -> Self {
        Self { factor, texture }
    }

    fn factor(&self) -> Vec3 {
        self.factor
    }

    fn texture(&self) -> Option<TextureLookup> {
        self.texture
    }

    fn value(number: f32) -> Vec3 {
        Vec3::splat(number)
    }

    fn between(first: Vec3, second: Vec3, amount: f32) -> Vec3 {
        first.lerp(second, amount)
    }

    fn operand(reader: &mut Reader<'_>, of: Combination<'_>, name: &str, default: f32) -> Result<Self, LoadError> {
        reader.color_operand(of.parameters, name, Vec3::splat(default), of.depth)
    }

    fn mean_color(&self, reader: &Reader<'_>) -> Result<Vec3, LoadError> {
        reader.mean_of_color(self)
    }
}

impl Input for ScalarInput {
    type Value = f32;

    /// The three colours of a number's texture are that number.
    fn of(factor: f32, texture: Option<TextureLookup>) -> Self {
        Self { factor, texture: texture.map(|lookup| (lookup, 0)) }
    }

    fn factor(&self) -> f32 {
        self.factor
    }

    fn texture(&self) -> Option<TextureLookup> {
        self.texture.map(|(lookup, _)| lookup)
    }

    fn value(number: f32) -> f32 {
        number
    }

    fn between(first: f32, second: f32, amount: f32) -> f32 {
        first + (second - first) * amount
    }

    fn operand(reader: &mut Reader<'_>, of: Combination<'_>, name: &str, default: f32) -> Result<Self, LoadError> {
        reader.scalar_operand(of.parameters, name, default, of.depth)
    }

    fn mean_color(&self, reader: &Reader<'_>) -> Result<Vec3, LoadError> {
        reader.mean_of_number(self).map(Vec3::splat)
    }
}

impl Reader<'_> {
    pub(super) fn scaled<I: Input>(&mut self, of: Combination<'_>) -> Result<I, LoadError> {
        let base = I::operand(self, of, "tex", 1.0)?;
        let scale = ScalarInput::operand(self, of, "scale", 1.0)?;
        let (rest, texture) = match (base.texture(), scale.texture()) {
            (None, texture) | (texture, None) => (scale.factor, texture),
            (texture, Some(_)) => {
                self.average(of.parameters, of.name, "its scale's texture: its mean");
                (self.mean_of_number(&scale)?, texture)
            }
        };
        Ok(I::of(base.factor() * rest, texture))
    }

    pub(super) fn mixed<I: Input>(&mut self, of: Combination<'_>) -> Result<I, LoadError> {
        let amount = self.amount(of)?;
        let first = I::operand(self, of, "tex1", 0.0)?;
        let second = I::operand(self, of, "tex2", 1.0)?;
        if first.texture().is_none() && second.texture().is_none() {
            return Ok(I::of(I::between(first.factor(), second.factor(), amount), None));
        }
        self.average(of.parameters, of.name, "the mix of textures: the heavier one");
        Ok(if amount < 0.5 { first } else { second })
    }

    /// The share of a mix's second part, which is one number here.
    fn amount(&mut self, of: Combination<'_>) -> Result<f32, LoadError> {
        let amount = ScalarInput::operand(self, of, "amount", 0.5)?;
        if amount.texture.is_some() {
            self.average(of.parameters, of.name, "its amount's texture: its mean");
        }
        self.mean_of_number(&amount)
    }

    pub(super) fn checkered<I: Input>(&mut self, of: Combination<'_>) -> Result<I, LoadError> {
        let even = I::operand(self, of, "tex1", 1.0)?;
        let odd = I::operand(self, of, "tex2", 0.0)?;
        if even.texture().is_some() || odd.texture().is_some() {
            self.average(of.parameters, of.name, "textures inside a checkerboard: their mean colours");
        }
        let colors = [even.mean_color(self)?, odd.mean_color(self)?];
        let lookup = self.checkerboard(of.parameters, colors)?;
        Ok(I::of(I::value(1.0), Some(lookup)))
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
