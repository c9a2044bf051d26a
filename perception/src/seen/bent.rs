//! Noise of colour through an operator that bends or clips each channel by itself, where a tint's noise is another matter on a colour
//! than on a grey, and greys of a luminance say nothing of it.

use super::shown::{Noise, Shown, variances_of_tints};
use crate::opponent::{OPPONENT_OF_RGB, opponent};
use crate::photometry::luminance;
use crate::primaries::{IDENTITY, inverse};
use crate::tone::Pixel;
use std::sync::LazyLock;

/// Linear Rec. 709 RGB of one unit of red–green and of yellow–violet, without luminance.
static TINTS: LazyLock<[[f64; 3]; 2]> = LazyLock::new(|| {
    let rgb_of_opponent = inverse(&OPPONENT_OF_RGB).unwrap_or(IDENTITY);
    [1, 2].map(|signal| rgb_of_opponent.map(|row| row[signal]))
});

/// Variances of luminance, red–green and yellow–violet as displayed, (cd/m²)², of a colour, linear Rec. 709 RGB of any strength, whose
/// chromatic signals have the variances `of_tints`: what noise of its luminance makes of it, and what is not that, tints that come and go
/// beside it.
///
/// Of a blue wall under a white lamp nearly all noise of colour is noise of luminance. Where its blue is clipped hardly any of it shows; as
/// tints of a grey as bright as it was shown it was told as 3 to 7 times what was seen.
pub(super) fn variances_of_colour(
    shown: &Shown<'_>,
    pixel: Pixel,
    noise: Noise,
    rgb: [f32; 3],
    of_tints: [f32; 2],
) -> [f32; 3] {
    let strength = luminance(rgb);
    let hue = rgb.map(|channel| channel / strength);
    let hue = if strength > 0.0 && hue.iter().all(|channel| channel.is_finite()) { hue } else { [1.0; 3] };
    let (noisy, points) = shown.coloured_pixel(pixel, noise, hue);
    let of_luminance = points.map_or([0.0; 2], |points| variances_of_tints(&points, noise));
    let signals = opponent(hue);
    let beside = |signal: usize, of_hue: f32| {
        let explained = noise.variance * f64::from(of_hue).powi(2);
        let deviation = (f64::from(of_tints[signal]) - explained).max(0.0).sqrt();
        let rgb = hue.map(|channel| noise.mean * f64::from(channel));
        shown_tint(shown, pixel, rgb, TINTS[signal].map(|channel| deviation * channel))[signal]
    };
    let [red_green, yellow_violet] = [beside(0, signals.red_green), beside(1, signals.yellow_violet)];
    [noisy.variance(), of_luminance[0] + red_green * red_green, of_luminance[1] + yellow_violet * yellow_violet]
}

/// Half of what a colour's chromatic signals differ by as displayed, cd/m², between more and less of a tint. Colours in scene cd/m².
fn shown_tint(shown: &Shown<'_>, pixel: Pixel, rgb: [f64; 3], tint: [f64; 3]) -> [f32; 2] {
    if tint == [0.0; 3] {
        return [0.0; 2];
    }
    let [more, less] = [1.0, -1.0].map(|sign| {
        let tinted = std::array::from_fn(|c| (rgb[c] + sign * tint[c]).max(0.0) as f32);
        shown.opponent(pixel, tinted)
    });
    [0.5 * (more.red_green - less.red_green), 0.5 * (more.yellow_violet - less.yellow_violet)]
}
