//! What loaders do to a picture's values before anything else sees them.

use super::luminance;
use super::texture::Decoded;
use crate::scene::Texels;
use glam::Vec3;
use std::sync::Arc;

/// What is done to a picture's linear values, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Adjust {
    /// Exponent of the value, as the bits of an f32.
    pub(super) exponent_bits: u32,
    /// 1 minus so many times the value, no less than 0, as the bits of an f32.
    pub(super) inverted_scale_bits: Option<u32>,
    /// Luminance in the place of all three colours.
    pub(super) to_luminance: bool,
}

impl Adjust {
    /// Values as they are.
    pub(super) const NONE: Self =
        Self { exponent_bits: 1.0_f32.to_bits(), inverted_scale_bits: None, to_luminance: false };

    pub(super) fn apply(self, picture: Decoded) -> Decoded {
        if self == Self::NONE {
            return picture;
        }
        let texels = match &picture.texels {
            Texels::Floats(floats) => floats.iter().map(|&texel| self.texel(texel)).collect(),
            Texels::Bytes(bytes, encoding) => {
                let decode = |byte| encoding.linear(byte);
                let linear = |&[r, g, b, a]: &[u8; 4]| [decode(r), decode(g), decode(b), f32::from(a) / 255.0];
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
        if let Some(bits) = self.inverted_scale_bits {
            color = (1.0 - f32::from_bits(bits) * color).max(Vec3::ZERO);
        }
        if self.to_luminance {
            color = Vec3::splat(luminance(color));
        }
        [color.x, color.y, color.z, a]
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
        let adjust = Adjust { to_luminance: true, ..Adjust::NONE };
        assert_eq!(adjust.texel([0.0, 1.0, 0.0, 1.0]), [0.7152, 0.7152, 0.7152, 1.0]);
    }
}
