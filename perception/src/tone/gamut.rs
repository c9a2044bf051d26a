//! Colours that a display can show.
//!
//! By mixing with grey, which keeps luminance and hue. Not for operators that clip each channel on purpose (`linear`,
//! `srgb`).

use crate::photometry::luminance;

/// Linear display RGB in 0..1 of the same luminance and hue: luminance above 1 becomes white, and what does not fit, at
/// either end, is mixed with the grey of equal luminance.
#[must_use]
pub fn fit_into_display(rgb: [f32; 3]) -> [f32; 3] {
    let rgb = light(rgb);
    let shown = luminance(rgb);
    if shown <= 0.0 {
        return [0.0; 3];
    }
    let target = shown.min(1.0);
    desaturate(rgb.map(|channel| channel / shown * target), target)
}

/// Scene RGB with luminance `scene` brought to display luminance `target` (clamped to 0..1), hue kept.
pub(super) fn with_luminance(rgb: [f32; 3], scene: f32, target: f32) -> [f32; 3] {
    if scene <= 0.0 {
        return [target.clamp(0.0, 1.0); 3];
    }
    let target = target.clamp(0.0, 1.0);
    desaturate(rgb.map(|channel| channel / scene * target), target)
}

/// Mixes `rgb` with the grey of its own luminance `grey` (0..1) until no channel exceeds 1.
fn desaturate(rgb: [f32; 3], grey: f32) -> [f32; 3] {
    let largest = rgb.into_iter().fold(0.0, f32::max);
    if largest <= 1.0 {
        return rgb;
    }
    let keep = ((1.0 - grey) / (largest - grey)).clamp(0.0, 1.0);
    rgb.map(|channel| (grey + keep * (channel - grey)).clamp(0.0, 1.0))
}

/// Brighter than anything that is not shown as white, and far from where squares of luminances end.
const BRIGHTEST_CD_M2: f32 = 1e15;

/// `rgb` as light that Rec.709 holds: a colour outside it, which has negative channels, is mixed with the grey of its
/// own luminance until none is negative. Channels that are no number become 0, infinite ones very bright; what has no
/// luminance above 0 is black.
#[must_use]
pub fn light(rgb: [f32; 3]) -> [f32; 3] {
    let rgb = rgb.map(|channel| match channel {
        f32::INFINITY => BRIGHTEST_CD_M2,
        finite if finite.is_finite() => finite,
        _ => 0.0,
    });
    let least = rgb.into_iter().fold(0.0, f32::min);
    if least >= 0.0 {
        return rgb;
    }
    let grey = luminance(rgb);
    if grey <= 0.0 {
        return [0.0; 3];
    }
    let keep = grey / (grey - least);
    rgb.map(|channel| (grey + keep * (channel - grey)).max(0.0))
}

/// The colour of light, linear Rec. 709 RGB of any strength, at a luminance of 1 and within Rec. 709; `None` of black.
#[must_use]
pub fn hue(rgb: [f32; 3]) -> Option<[f32; 3]> {
    let rgb = light(rgb);
    let hue = rgb.map(|channel| channel / luminance(rgb));
    hue.iter().all(|channel| channel.is_finite()).then_some(hue)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn infinite_light_is_light() {
        assert_eq!(light([f32::NAN, -1.0, f32::NEG_INFINITY]), [0.0; 3]);
        let lamp = light([f32::INFINITY, 1.0, 1.0]);
        assert_eq!(with_luminance(lamp, luminance(lamp), 1.0), [1.0; 3]);
    }

    /// Rec.2020's green: with its negative channels cut off it would be a fifth brighter.
    #[test]
    fn colours_outside_rec_709_keep_their_luminance() {
        let green = [-0.5876, 1.1329, -0.1006];
        let inside = light(green);
        assert!((luminance(inside) / luminance(green) - 1.0).abs() < 1e-6, "{inside:?}");
        assert!(inside[0] == 0.0 && inside[1] > inside[2] && inside[2] > 0.0, "{inside:?}");
        assert_eq!(light([1.0, -20.0, 1.0]), [0.0; 3]);
        let shown = fit_into_display([-0.2, 0.5, -0.1]);
        assert!((luminance(shown) / luminance([-0.2, 0.5, -0.1]) - 1.0).abs() < 1e-6, "{shown:?}");
    }

    #[test]
    fn what_is_too_bright_keeps_luminance_and_hue() {
        let shown = fit_into_display([2.0, 0.2, 0.2]);
        assert!((luminance(shown) - luminance([2.0, 0.2, 0.2])).abs() < 1e-5, "{shown:?}");
        assert!((shown[0] - 1.0).abs() < 1e-5 && shown[1] < shown[0] && shown[1] == shown[2]);
        assert_eq!(fit_into_display([5.0, 4.0, 6.0]), [1.0; 3]);
        assert_eq!(fit_into_display([0.0, -1.0, 0.0]), [0.0; 3]);
        assert_eq!(with_luminance([0.0; 3], 0.0, 0.5), [0.5; 3]);
    }
}
