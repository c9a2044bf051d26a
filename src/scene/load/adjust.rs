//! Changes a picture's values as a loader asks, before anything else sees them.

use super::luminance;
use super::texture::{Decoded, Values};
use crate::scene::{Encoding, Texels};
use glam::Vec3;
use std::sync::Arc;

/// What is done to a picture's linear values, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Adjust {
    /// Exponent of the value, as the bits of an f32.
    pub(super) exponent_bits: u32,
    /// 1 minus so many times the value, no less than 0, as the bits of an f32.
    pub(super) inverted_scale_bits: Option<u32>,
    /// Number that takes the place of all three colours, if any.
    pub(super) to_number: Option<Number>,
}

/// The number that a picture's texels stand for where one is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Number {
    /// The luminance of their colours, as in Mitsuba.
    Luminance,
    /// Alpha, decoded as the colours are, and where all of it is 1 the mean of R, G and B, as in pbrt-v4
    /// (`MIPMap::Bilerp<Float>`, `MIPMap::CreateFromFile`).
    AlphaOrMean,
    /// The mean of R, G and B whatever alpha is, as in pbrt-v4 of pictures whose alpha it drops.
    Mean,
}

impl Adjust {
    /// Values as they are.
    pub(super) const NONE: Self = Self { exponent_bits: 1.0_f32.to_bits(), inverted_scale_bits: None, to_number: None };

    /// What the values of the picture are.
    pub(super) fn values(self, encoding: Encoding) -> Values {
        match (encoding, self.to_number) {
            (Encoding::Linear, _) | (_, Some(Number::AlphaOrMean | Number::Mean)) => Values::Numbers,
            (Encoding::Srgb, None) => Values::Colours,
            (Encoding::Srgb, Some(Number::Luminance)) => Values::Luminances,
        }
    }

    pub(super) fn apply(self, picture: Decoded) -> Decoded {
        if self == Self::NONE {
            return picture;
        }
        let alpha_counts = self.to_number == Some(Number::AlphaOrMean) && has_holes(&picture.texels);
        let texels = match &picture.texels {
            Texels::Floats(floats) if alpha_counts => floats.iter().map(|&[.., a]| self.texel([a; 4])).collect(),
            Texels::Floats(floats) => floats.iter().map(|&texel| self.texel(texel)).collect(),
            Texels::Bytes(bytes, encoding) => {
                let decode = |byte| encoding.linear(byte);
                let linear = |&[r, g, b, a]: &[u8; 4]| {
                    let [r, g, b] = if alpha_counts { [a; 3] } else { [r, g, b] };
                    [decode(r), decode(g), decode(b), f32::from(a) / 255.0]
                };
                bytes.iter().map(|texel| self.texel(linear(texel))).collect()
            }
        };
        Decoded { texels: Texels::Floats(Arc::new(texels)), ..picture }
    }

    fn texel(self, [r, g, b, a]: [f32; 4]) -> [f32; 4] {
        let exponent = f32::from_bits(self.exponent_bits);
        let mut color = Vec3::new(r, g, b);
        if exponent != 1.0 {
            color = color.max(Vec3::ZERO).powf(exponent);
        }
        if matches!(self.to_number, Some(Number::AlphaOrMean | Number::Mean)) {
            color = Vec3::splat(color.element_sum() / 3.0);
        }
        if let Some(bits) = self.inverted_scale_bits {
            color = (1.0 - f32::from_bits(bits) * color).max(Vec3::ZERO);
        }
        if self.to_number == Some(Number::Luminance) {
            color = Vec3::splat(luminance(color));
        }
        [color.x, color.y, color.z, a]
    }
}

/// Whether any alpha is not 1.
fn has_holes(texels: &Texels) -> bool {
    match texels {
        Texels::Floats(floats) => floats.iter().any(|&[.., a]| a != 1.0),
        Texels::Bytes(bytes, _) => bytes.iter().any(|&[.., a]| a != u8::MAX),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_raised_then_scaled_and_inverted_then_weighed() {
        let adjust = Adjust { exponent_bits: 2.0_f32.to_bits(), ..Adjust::NONE };
        assert_eq!(adjust.texel([0.5, 1.0, 0.0, 0.3]), [0.25, 1.0, 0.0, 0.3]);
        let adjust = Adjust { inverted_scale_bits: Some(2.0_f32.to_bits()), ..adjust };
        assert_eq!(adjust.texel([0.5, 1.0, 0.0, 0.3]), [0.5, 0.0, 1.0, 0.3]);
        let adjust = Adjust { to_number: Some(Number::Luminance), ..Adjust::NONE };
        assert_eq!(adjust.texel([0.0, 1.0, 0.0, 1.0]), [0.7152, 0.7152, 0.7152, 1.0]);
    }

    #[test]
    fn a_number_of_pbrts_is_alpha_and_the_mean_where_that_is_1_throughout() {
        let adjust = Adjust { to_number: Some(Number::AlphaOrMean), ..Adjust::NONE };
        let numbers = |texels| {
            let picture = Decoded::of_texels([2, 1], texels);
            let Texels::Floats(floats) = adjust.apply(picture).texels else { return Vec::new() };
            floats.iter().map(|texel| texel[0]).collect::<Vec<f32>>()
        };
        let bytes = |texels: [[u8; 4]; 2]| Texels::Bytes(Arc::new(texels.to_vec()), Encoding::Srgb);
        assert_eq!(numbers(bytes([[0, 255, 255, 255], [255; 4]])), [2.0 / 3.0, 1.0]);
        // pbrt decodes alpha by the curve of the colours.
        assert_eq!(numbers(bytes([[255, 255, 255, 0], [0, 0, 0, 128]])), [0.0, Encoding::Srgb.linear(128)]);
        let floats = |texels: [[f32; 4]; 2]| Texels::Floats(Arc::new(texels.to_vec()));
        assert_eq!(numbers(floats([[0.0, 0.0, 0.75, 1.0], [1.0; 4]])), [0.25, 1.0]);
        assert_eq!(numbers(floats([[1.0, 1.0, 1.0, 0.25], [0.0, 0.0, 0.0, 1.0]])), [0.25, 1.0]);
    }
}
