//! From linear RGB to luminance.
//!
//! For linear Rec. 709; other colour spaces go through [`crate::primaries`] first. Not for light that no red, green and
//! blue stand for: what rods see of a spectrum is only approximated by three channels.

/// Rec. 709 luminance weights for linear red, green and blue with a D65 white (ITU-R BT.709-6, section 3.2).
pub const REC709_WEIGHTS: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Photopic luminance of linear Rec. 709 RGB, in the unit of `rgb` (cd/m² in, cd/m² out).
///
/// ```
/// assert_eq!(fechner_perception::photometry::luminance([100.0, 100.0, 100.0]), 100.0);
/// ```
#[must_use]
#[inline]
pub fn luminance(rgb: [f32; 3]) -> f32 {
    // Summed so that the weights of white add to exactly 1 in f32.
    rgb[0] * REC709_WEIGHTS[0] + rgb[1] * REC709_WEIGHTS[1] + rgb[2] * REC709_WEIGHTS[2]
}

/// Scotopic luminance (what the rods see) of linear Rec. 709 RGB, in the unit of `rgb`, scaled so that white has the
/// same photopic and scotopic luminance.
///
/// Weights of Ward Larson, Rushmeier and Piatko's 1997 operator as Radiance publishes it, made for its own primaries
/// and used here as an approximation for Rec. 709. Multiply by 2.26 for scotopic cd/m² of an equal-energy white.
#[must_use]
#[inline]
pub fn scotopic_luminance(rgb: [f32; 3]) -> f32 {
    rgb[0] * 0.062 + rgb[1] * 0.608 + rgb[2] * 0.330
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rods_are_blind_to_red() {
        assert!((scotopic_luminance([1.0; 3]) - 1.0).abs() < 1e-6);
        assert!(scotopic_luminance([1.0, 0.0, 0.0]) < 0.3 * luminance([1.0, 0.0, 0.0]));
    }

    #[test]
    fn weights_are_rec709() {
        let close = |a: f32, b: f32| (a - b).abs() < 1e-5;
        assert!(close(luminance([1.0, 0.0, 0.0]), 0.2126));
        assert!(close(luminance([0.6, 0.35, 0.25]), 0.39593));
        assert!(close(luminance([0.3, 0.5, 0.9]), 0.48636));
    }
}
