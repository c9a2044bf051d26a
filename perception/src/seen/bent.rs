//! Noise of colour through an operator that bends or clips each channel by itself, where a tint's noise is another
//! matter on a colour than on a grey, and greys of a luminance say nothing of it.

use super::shown::{Noise, Shown, variances_of_opponent};
use crate::opponent::{OPPONENT_OF_RGB, opponent};
use crate::primaries::{IDENTITY, inverse};
use crate::tone::Pixel;
use crate::tone::gamut::hue;
use std::sync::LazyLock;

/// Linear Rec. 709 RGB of one unit of red–green and of yellow–violet, without luminance.
static TINTS: LazyLock<[[f64; 3]; 2]> = LazyLock::new(|| {
    let rgb_of_opponent = inverse(&OPPONENT_OF_RGB).unwrap_or(IDENTITY);
    [1, 2].map(|signal| rgb_of_opponent.map(|row| row[signal]))
});

/// Variances of luminance, red–green and yellow–violet as displayed, (cd/m²)², of a colour, linear Rec. 709 RGB of
/// any strength, whose chromatic signals have the variances `of_tints`: what noise of its luminance makes of it, and
/// what is not that, tints that come and go beside it. Noise of luminance is of the colour as far as there is noise
/// of tints to go with it, and of grey as to the rest.
///
/// The colour itself is asked, since clips are its channels': of a blue wall under a white lamp nearly all noise of
/// colour is noise of luminance, and where its blue is clipped hardly any of it shows. Taken as tints of a grey as
/// bright as it is shown, its noise is predicted as 2 to 7 times what is seen. Of a red lamp under a white one all of
/// the noise is grey, and shows in green and blue alone.
pub(super) fn variances_of_colour(
    shown: &Shown<'_>,
    pixel: Pixel,
    noise: Noise,
    rgb: [f32; 3],
    of_tints: [f32; 2],
) -> [f32; 3] {
    let hue = hue(rgb).unwrap_or([1.0; 3]);
    let signals = opponent(hue);
    let of_hue = [signals.red_green, signals.yellow_violet].map(|signal| noise.variance * f64::from(signal).powi(2));
    let both = || of_hue.into_iter().zip(of_tints.map(f64::from));
    let explained: f64 = both().map(|(of_hue, of_tint)| of_hue.min(of_tint)).sum();
    let all: f64 = of_hue.iter().sum();
    let share_of_hue = if all > 0.0 { (explained / all) as f32 } else { 1.0 };

    let (noisy, points) = shown.coloured_pixel(pixel, noise, hue);
    let along_hue = points.map_or([0.0; 3], |points| variances_of_opponent(&points, noise));
    let along_grey = if share_of_hue < MOSTLY { shown.variances_along_grey(pixel, noise, hue) } else { [0.0; 3] };
    let mixed = |of_hue: f32, of_grey: f32| {
        if share_of_hue < MOSTLY { share_of_hue * of_hue + (1.0 - share_of_hue) * of_grey } else { of_hue }
    };
    let beside = |signal: usize| {
        let deviation = (f64::from(of_tints[signal]) - of_hue[signal]).max(0.0).sqrt();
        let rgb = hue.map(|channel| noise.mean * f64::from(channel));
        shown_tint(shown, pixel, rgb, TINTS[signal].map(|channel| deviation * channel))[signal].powi(2)
    };
    [
        mixed(noisy.variance(), along_grey[0]),
        mixed(along_hue[1], along_grey[1]) + beside(0),
        mixed(along_hue[2], along_grey[2]) + beside(1),
    ]
}

/// Share of the colour's noise from which on grey is not asked for.
const MOSTLY: f32 = 0.98;

/// Half of what a colour's chromatic signals differ by as displayed, cd/m², between more and less of a tint. Colours
/// in scene cd/m².
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
