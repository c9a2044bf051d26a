//! What becomes of a faint tint.

use super::FittedTone;
use super::guide::Pixel;
use crate::opponent::opponent;
use crate::photometry::REC709_WEIGHTS;

/// Two tints without luminance: red for green, and blue for green.
const TINTS: [[f32; 3]; 2] =
    [[1.0, -REC709_WEIGHTS[0] / REC709_WEIGHTS[1], 0.0], [0.0, -REC709_WEIGHTS[2] / REC709_WEIGHTS[1], 1.0]];
/// Strength of the tint, over the grey that is tinted.
const STRENGTH: f32 = 0.02;

/// Chromatic signals of display light over those of the scene, cd/m², that make a faint tint on a grey of this
/// luminance: the mean of both tints. For operators that keep greys grey.
pub(super) fn tint_slope(fitted: &dyn FittedTone, pixel: Pixel, scene_cd_m2: f32) -> f32 {
    let grey = scene_cd_m2.clamp(1e-6, 1e30);
    let chroma = |rgb: [f32; 3]| {
        let signals = opponent(rgb);
        [signals.red_green, signals.yellow_violet]
    };
    let dot = |a: [f32; 2], b: [f32; 2]| a[0] * b[0] + a[1] * b[1];
    let of = |tint: [f32; 3]| {
        // Over the grey, so that dim greys do not vanish in their squares.
        let scene = chroma(tint.map(|part| STRENGTH * part));
        let shown = chroma(fitted.map_rgb_at(pixel, tint.map(|part| grey * (1.0 + STRENGTH * part))));
        dot(shown, scene) / dot(scene, scene) / grey
    };
    (TINTS.into_iter().map(of).sum::<f32>() / TINTS.len() as f32).max(0.0)
}
