//! Linear light to 8-bit sRGB codes with a dither, by straight lines between tabulated places of the curve.
//!
//! Every frame of a preview and every PNG passes here. `powf` for each channel took as much of a frame as its JPEG
//! (`cargo bench --bench frames`). Between 512 places an octave a line is off by at most 5e-5 of a step of 8 bits.

use fechner_perception::eotf::{SRGB_SLOPE, srgb_from_linear};
use std::sync::LazyLock;

/// Places of an octave, a power of two.
const PLACES: usize = 512;
const REST_BITS: u32 = f32::MANTISSA_DIGITS - 1 - PLACES.trailing_zeros();
/// Below this the curve is straight (IEC 61966-2-1: up to 0.0031308).
const LOWEST: f32 = 1.0 / 512.0;
const OCTAVES: usize = 9;

/// Steps of 8 bits, 0 to 255, at every place from [`LOWEST`] to 1.
static STEPS: LazyLock<[f32; OCTAVES * PLACES + 1]> = LazyLock::new(|| {
    std::array::from_fn(|place| {
        255.0 * srgb_from_linear(f32::from_bits(LOWEST.to_bits() + ((place as u32) << REST_BITS)))
    })
});

/// Encodes.
#[derive(Clone, Copy)]
pub(super) struct SrgbCodes(&'static [f32; OCTAVES * PLACES + 1]);

impl SrgbCodes {
    pub(super) fn new() -> Self {
        Self(&STEPS)
    }

    /// The code of a linear value clamped to 0..1 (1: display white; NaN: black), `dither` in [0, 1) added before the
    /// fraction is cut off: a value that is a whole step stays that step.
    #[inline]
    pub(super) fn code(self, linear: f32, dither: f32) -> u8 {
        let steps = if linear < LOWEST {
            255.0 * SRGB_SLOPE as f32 * linear
        } else if linear < 1.0 {
            let above = linear.to_bits() - LOWEST.to_bits();
            let place = (above >> REST_BITS) as usize;
            let rest = (above & ((1 << REST_BITS) - 1)) as f32 * (1.0 / (1 << REST_BITS) as f32);
            let (low, high) = (self.0[place], self.0[place + 1]);
            low + rest * (high - low)
        } else {
            // White and more than white; NaN is no light.
            if linear.is_nan() { 0.0 } else { 255.0 }
        };
        (steps + dither) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Within 1e-4 of a step of the curve itself at every 97th float of 0 to 1.
    #[test]
    fn steps_are_those_of_the_curve() {
        let codes = SrgbCodes::new();
        for bits in (0..=1.0f32.to_bits()).step_by(97) {
            let linear = f32::from_bits(bits);
            let exact = 255.0 * f64::from(srgb_from_linear(linear));
            // The dither at which the next code begins says where between two codes the value lies.
            let up = exact.ceil() - exact;
            for dither in
                [up - 1e-4, up + 1e-4].map(|dither| dither as f32).into_iter().filter(|d| (0.0..1.0).contains(d))
            {
                let wanted = (exact + f64::from(dither)).floor().min(255.0);
                assert_eq!(f64::from(codes.code(linear, dither)), wanted, "{linear} with a dither of {dither}");
            }
        }
    }

    #[test]
    fn nothing_else_gets_out_of_range() {
        let codes = SrgbCodes::new();
        let just_below_one = 1.0 - f32::EPSILON / 2.0;
        for (linear, wanted) in
            [(f32::NAN, 0), (f32::NEG_INFINITY, 0), (-1.0, 0), (0.0, 0), (1.0, 255), (7.0, 255), (f32::INFINITY, 255)]
        {
            assert_eq!([0.0, 0.999_999_9].map(|dither| codes.code(linear, dither)), [wanted; 2], "{linear}");
        }
        assert_eq!(codes.code(just_below_one, 0.5), 255);
    }
}
