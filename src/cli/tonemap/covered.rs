//! Pictures with alpha through an operator, each pixel before whatever lies behind it.
//!
//! Light that is multiplied by its alpha may be more than what covers the pixel could send: flames, glows and flares add light and cover little or
//! nothing. What covers a pixel is taken to be no brighter, channel by channel, than what is shown as white or than the brightest pixel that is
//! covered whole, since the soft edge of a lamp is no flame; the rest is light in front of it, and adds what it adds before black.

use fechner::output::rendered::shown_where_covered;
use fechner_perception::tone::{FittedTone, Pixel, map_picture};

/// Share of the display's white from which a grey is shown as white: some operators only approach it.
const NEARLY_WHITE: f32 = 0.98;
/// Halvings of the interval in which the least such grey is looked for, in stops: from 64 to 1e-5.
const HALVINGS: u32 = 23;
/// Least light, of the display's white, that is a gain.
const LEAST_GAIN: f32 = 1e-5;

/// What is shown of a picture with alpha.
pub(super) struct Covered<'a> {
    /// Linear display RGB, 0 to 1, of what covers each pixel, not multiplied by alpha.
    straight: Vec<[f32; 3]>,
    /// How much of each pixel is covered.
    alpha: &'a [f32],
    /// Pixels with light in front of what covers them, by number: their display RGB multiplied by alpha, that light with it.
    beyond: Vec<(usize, [f32; 3])>,
}

impl<'a> Covered<'a> {
    /// Of a picture in cd/m² that is multiplied by its alpha.
    pub(super) fn of(fitted: &dyn FittedTone, width: usize, rgb_cd_m2: &[[f32; 3]], alpha: &'a [f32]) -> Self {
        let straight = shown_where_covered(fitted, width, rgb_cd_m2, alpha);
        let beyond = beyond(fitted, width, rgb_cd_m2, alpha, &straight);
        Self { straight, alpha, beyond }
    }

    /// Whether any pixel has light in front of what covers it.
    pub(super) fn has_light_in_front(&self) -> bool {
        !self.beyond.is_empty()
    }

    /// How much of each pixel is covered.
    pub(super) fn alpha(&self) -> &[f32] {
        self.alpha
    }

    /// Display RGB multiplied by alpha.
    pub(super) fn premultiplied(&self) -> Vec<[f32; 3]> {
        let mut shown: Vec<[f32; 3]> =
            self.straight.iter().zip(self.alpha).map(|(rgb, alpha)| rgb.map(|light| light * alpha)).collect();
        self.beyond.iter().for_each(|&(pixel, light)| shown[pixel] = light);
        shown
    }

    /// Display RGB that is not multiplied, and an alpha that is just large enough to hold all light.
    pub(super) fn straight(&self) -> (Vec<[f32; 3]>, Vec<f32>) {
        let (mut shown, mut alpha) = (self.straight.clone(), self.alpha.to_vec());
        for &(pixel, light) in &self.beyond {
            let held = largest(light).max(alpha[pixel]);
            alpha[pixel] = held;
            shown[pixel] = light.map(|light| light / held);
        }
        (shown, alpha)
    }
}

/// The pixels with more light than `straight` times alpha holds, and that light.
fn beyond(
    fitted: &dyn FittedTone,
    width: usize,
    rgb_cd_m2: &[[f32; 3]],
    alpha: &[f32],
    straight: &[[f32; 3]],
) -> Vec<(usize, [f32; 3])> {
    let width = width.max(1);
    let opaque = rgb_cd_m2.iter().zip(alpha).filter(|(_, alpha)| **alpha >= 1.0);
    let brightest_cd_m2 = opaque.map(|(rgb, _)| largest(*rgb)).fold(0.0, f32::max);
    let mut covering_cd_m2 = rgb_cd_m2.to_vec();
    let mut pixels = Vec::new();
    for (i, (rgb, &alpha)) in covering_cd_m2.iter_mut().zip(alpha).enumerate() {
        let most_cd_m2 = alpha * brightest_cd_m2;
        if largest(*rgb) <= most_cd_m2 {
            continue;
        }
        let pixel = Pixel { x: i % width, y: i / width };
        let white_cd_m2 = if alpha > 0.0 { white_cd_m2(fitted, pixel, largest(*rgb) / alpha) } else { Some(0.0) };
        let Some(white_cd_m2) = white_cd_m2 else { continue };
        *rgb = rgb.map(|channel| channel.min(most_cd_m2.max(alpha * white_cd_m2)));
        pixels.push(i);
    }
    if pixels.is_empty() {
        return Vec::new();
    }
    let covering = shown_where_covered(fitted, width, &covering_cd_m2, alpha);
    let (all, covered) = (map_picture(fitted, width, rgb_cd_m2), map_picture(fitted, width, &covering_cd_m2));
    let light = |i: usize| {
        let in_front = |c: usize| (all[i][c] - covered[i][c]).max(0.0);
        (i, std::array::from_fn(|c| (alpha[i] * covering[i][c] + in_front(c)).min(1.0)))
    };
    let is_gain = |(i, light): &(usize, [f32; 3])| {
        light.iter().zip(straight[*i]).any(|(light, straight)| light - alpha[*i] * straight > LEAST_GAIN)
    };
    pixels.into_iter().map(light).filter(is_gain).collect()
}

/// The least grey that is shown as white at a pixel; `None` where `bright_cd_m2` is not.
fn white_cd_m2(fitted: &dyn FittedTone, pixel: Pixel, bright_cd_m2: f32) -> Option<f32> {
    let is_white = |cd_m2: f32| fitted.relative_luminance_at(pixel, cd_m2) >= NEARLY_WHITE;
    if !is_white(bright_cd_m2) {
        return None;
    }
    let (mut least_stops, mut most_stops) = (-64.0_f32, 0.0_f32);
    for _ in 0..HALVINGS {
        let stops = 0.5 * (least_stops + most_stops);
        *(if is_white(bright_cd_m2 * stops.exp2()) { &mut most_stops } else { &mut least_stops }) = stops;
    }
    Some(bright_cd_m2 * most_stops.exp2())
}

fn largest(rgb: [f32; 3]) -> f32 {
    rgb.into_iter().fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner_perception::tone::{self, SceneGuide, ToneSettings};
    use fechner_perception::{Plane, Viewing};

    fn fitted(name: &str) -> Box<dyn FittedTone> {
        let operator = tone::operator_with(name, &ToneSettings::default()).expect("an operator");
        operator.fit(&SceneGuide::of(&Plane::filled(8, 8, 20.0)), &Viewing::default(), None)
    }

    /// Edges of what is dim and of a lamp beyond white, both of which are there uncut, and edges of hair that nothing uncut is as bright as.
    #[test]
    fn soft_edges_stay_as_they_are() {
        let alpha = [1.0, 0.6, 0.1, 1.0, 0.5, 0.01, 0.3, 0.0];
        let straight = [30.0, 30.0, 30.0, 5000.0, 5000.0, 5000.0, 45.0, 0.0];
        let hair = [0.2, 0.7, 0.0, 0.4, 0.3, 0.9, 0.8, 0.1];
        for name in tone::operator_names() {
            let fitted = fitted(name);
            let of = |straight: [f32; 8], alpha: [f32; 8]| -> Vec<[f32; 3]> {
                straight
                    .into_iter()
                    .zip(alpha)
                    .map(|(light, alpha)| [light * alpha, 0.8 * light * alpha, 0.0])
                    .collect()
            };
            for (rgb, alpha) in [(of(straight, alpha), alpha), (of([10.0; 8], hair), hair)] {
                let covered = Covered::of(fitted.as_ref(), 8, &rgb, &alpha);
                let before = shown_where_covered(fitted.as_ref(), 8, &rgb, &alpha);
                assert!(!covered.has_light_in_front(), "{name}: {:?}", covered.beyond);
                assert_eq!(covered.straight(), (before, alpha.to_vec()), "{name}");
            }
        }
    }

    /// Flames before black are as bright as without alpha, and what lies behind them is covered no more than it must be.
    #[test]
    fn light_that_covers_nothing_is_shown() {
        let rgb = [[1.0; 3], [40.0, 30.0, 10.0], [50.0; 3], [0.0; 3]];
        let alpha = [1.0, 0.1, 0.0, 0.0];
        for name in tone::operator_names() {
            let fitted = fitted(name);
            let covered = Covered::of(fitted.as_ref(), 4, &rgb, &alpha);
            let (shown, black) = (covered.premultiplied(), map_picture(fitted.as_ref(), 4, &rgb));
            assert!(covered.has_light_in_front());
            for channel in 0..3 {
                // What black is shown as is not there twice.
                assert!((shown[2][channel] - black[2][channel]).abs() < 2e-3, "{name}: {shown:?} {black:?}");
                if ["absolute", "srgb"].contains(name) {
                    assert!((shown[1][channel] - black[1][channel]).abs() < 2e-3, "{name}: {shown:?} {black:?}");
                }
            }
            assert_eq!(shown[3], [0.0; 3]);
            let (straight, raised) = covered.straight();
            for i in 0..4 {
                let light = straight[i].map(|light| light * raised[i]);
                assert!(
                    light.iter().zip(shown[i]).all(|(a, b)| (a - b).abs() < 1e-6),
                    "{name}: {light:?} {:?}",
                    shown[i]
                );
                assert!(raised[i] >= alpha[i] && straight[i].iter().all(|light| *light <= 1.0 + 1e-6), "{name}");
            }
            assert_eq!((raised[0], raised[3], covered.alpha()), (1.0, 0.0, &alpha[..]));
        }
    }

    /// From what covers to what does not nothing jumps.
    #[test]
    fn more_light_is_never_shown_as_less() {
        let alpha = [0.2; 256];
        let rgb: Vec<[f32; 3]> = (0..256).map(|i| [0.5 * i as f32, 0.3 * i as f32, 0.1 * i as f32]).collect();
        for name in ["absolute", "srgb", "reinhard02", "agx", "constant"] {
            let shown = Covered::of(fitted(name).as_ref(), 256, &rgb, &alpha).premultiplied();
            for pair in shown.windows(2) {
                let [before, after] = [0, 1].map(|i| fechner_perception::photometry::luminance(pair[i]));
                assert!(after >= before - 1e-3 && after - before < 0.03, "{name}: {before} to {after}");
            }
        }
    }
}
