//! Pictures with alpha through an operator, each pixel before whatever lies behind it.
//!
//! Light that is multiplied by its alpha may be more than what covers the pixel could send: flames, glows and
//! flares add light and cover little or nothing. What covers a pixel is taken to be no brighter than what is shown
//! as white or than the brightest pixel nearby that is covered whole, since the soft edge of a lamp is no flame. Of
//! light beyond that what covers the pixel sends white, channel by channel; the rest is in front of it, and adds
//! what it adds before black.

use fechner_perception::tone::{FittedTone, Pixel};

/// Brings scene light, cd/m², of a picture this wide to linear display RGB.
pub type Mapping = fn(&dyn FittedTone, usize, &[[f32; 3]]) -> Vec<[f32; 3]>;

/// Share of the display's white from which a grey is shown as white: some operators only approach it.
const NEARLY_WHITE: f32 = 0.98;
/// Halvings of the interval in which the least such grey is looked for, in stops: from 64 to 1e-5.
const HALVINGS: u32 = 23;
/// Least light, of the display's white, that is a gain.
const MIN_GAIN: f32 = 1e-5;
/// Around the pixel nearest to a soft edge that is covered whole its lamp is looked for so many pixels far: our
/// widest filter, of radius 2, mixes what is up to 4 apart, so that between a lamp and what stands beside it the
/// nearest may be of either.
const EDGE_PIXELS: usize = 4;
/// A soft edge is up to so many times as bright as the lamp that it ends at, a quarter of a stop: an edge has noise of
/// its own, and more of the sky than what lies behind it. Without it alphas of 219 on a table's edge become 244.
const EDGE_OVER_LAMP: f32 = 1.189_207_1;
/// Above that light an edge becomes a flame over so many stops: at once, noise and rounding would put specks of white
/// on soft edges.
const STOPS_FROM_EDGE_TO_FLAME: f32 = 0.75;

/// What is shown of a picture with alpha.
#[derive(Debug)]
pub struct Covered<'a> {
    /// Linear display RGB, 0 to 1, of what covers each pixel, not multiplied by alpha.
    straight: Vec<[f32; 3]>,
    /// How much of each pixel is covered.
    alpha: &'a [f32],
    /// Pixels with light in front of what covers them, by number: their display RGB multiplied by alpha, that light
    /// with it.
    beyond: Vec<(usize, [f32; 3])>,
}

impl<'a> Covered<'a> {
    /// What covers the pixels of a picture in cd/m² that is multiplied by its alpha.
    pub fn of(fitted: &dyn FittedTone, map: Mapping, width: usize, rgb_cd_m2: &[[f32; 3]], alpha: &'a [f32]) -> Self {
        let straight = map(fitted, width, &divided_by_alpha(rgb_cd_m2, alpha));
        let beyond = beyond(fitted, map, width, rgb_cd_m2, alpha, &straight);
        Self { straight, alpha, beyond }
    }

    /// Whether any pixel has light in front of what covers it.
    pub fn has_light_in_front(&self) -> bool {
        !self.beyond.is_empty()
    }

    /// Display RGB multiplied by alpha.
    pub fn premultiplied(&self) -> Vec<[f32; 3]> {
        let mut shown: Vec<[f32; 3]> =
            self.straight.iter().zip(self.alpha).map(|(rgb, alpha)| rgb.map(|light| light * alpha)).collect();
        self.beyond.iter().for_each(|&(pixel, light)| shown[pixel] = light);
        shown
    }

    /// Display RGB that is not multiplied, and an alpha that is just large enough to hold all light.
    pub fn straight(&self) -> (Vec<[f32; 3]>, Vec<f32>) {
        let (mut shown, mut alpha) = (self.straight.clone(), self.alpha.to_vec());
        for &(pixel, light) in &self.beyond {
            let held = largest(light).max(alpha[pixel]);
            alpha[pixel] = held;
            shown[pixel] = light.map(|light| light / held);
        }
        (shown, alpha)
    }
}

/// Light of what covers each pixel, for a picture that is multiplied by its alpha: none where nothing does.
fn divided_by_alpha(rgb: &[[f32; 3]], alpha: &[f32]) -> Vec<[f32; 3]> {
    let scale = |alpha: f32| if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
    rgb.iter().zip(alpha).map(|(rgb, &alpha)| rgb.map(|value| value * scale(alpha))).collect()
}

/// The pixels with more light than `straight` times alpha holds, and that light.
fn beyond(
    fitted: &dyn FittedTone,
    map: Mapping,
    width: usize,
    rgb_cd_m2: &[[f32; 3]],
    alpha: &[f32],
    straight: &[[f32; 3]],
) -> Vec<(usize, [f32; 3])> {
    let width = width.max(1);
    let brightest_cd_m2 = brightest_whole_nearby(width, rgb_cd_m2, alpha);
    let edges = edges(width, rgb_cd_m2, alpha);
    let mut covering_cd_m2 = rgb_cd_m2.to_vec();
    let mut pixels = Vec::new();
    for (i, (rgb, &alpha)) in covering_cd_m2.iter_mut().zip(alpha).enumerate() {
        let lamp_cd_m2 = EDGE_OVER_LAMP * brightest_cd_m2[i];
        if largest(*rgb) <= alpha * lamp_cd_m2 || edges[i] {
            continue;
        }
        let pixel = Pixel { x: i % width, y: i / width };
        let straight_cd_m2 = largest(*rgb) / alpha;
        let white_cd_m2 = if alpha > 0.0 { white_cd_m2(fitted, pixel, straight_cd_m2) } else { Some(0.0) };
        let Some(white_cd_m2) = white_cd_m2 else { continue };
        let covering_cd_m2 = covering_light(white_cd_m2, lamp_cd_m2, straight_cd_m2);
        *rgb = rgb.map(|channel| channel.min(alpha * covering_cd_m2));
        pixels.push(i);
    }
    if pixels.is_empty() {
        return Vec::new();
    }
    let covering = map(fitted, width, &divided_by_alpha(&covering_cd_m2, alpha));
    let (all, covered) = (map(fitted, width, rgb_cd_m2), map(fitted, width, &covering_cd_m2));
    let light = |i: usize| {
        let in_front = |c: usize| (all[i][c] - covered[i][c]).max(0.0);
        (i, std::array::from_fn(|c| (alpha[i] * covering[i][c] + in_front(c)).min(1.0)))
    };
    let is_gain = |(i, light): &(usize, [f32; 3])| {
        light.iter().zip(straight[*i]).any(|(light, straight)| light - alpha[*i] * straight > MIN_GAIN)
    };
    pixels.into_iter().map(light).filter(is_gain).collect()
}

/// The pixels that touch both what is covered by half or more and what has nothing, neither cover nor light: between
/// them lies an edge, however bright the few samples were that met it. Without this a mirroring rim of which a
/// sixty-fourth is there is taken for a glow, and covers 92 % of its pixel.
fn edges(width: usize, rgb_cd_m2: &[[f32; 3]], alpha: &[f32]) -> Vec<bool> {
    let touches = |pixel: usize, is_it: &dyn Fn(usize) -> bool| around(width, alpha.len(), pixel).any(is_it);
    let is_solid = |pixel: usize| alpha[pixel] >= 0.5;
    let is_empty = |pixel: usize| alpha[pixel] <= 0.0 && largest(rgb_cd_m2[pixel]) <= 0.0;
    let is_edge = |pixel: usize| alpha[pixel] > 0.0 && touches(pixel, &is_solid) && touches(pixel, &is_empty);
    (0..alpha.len()).map(is_edge).collect()
}

/// Light of what covers a pixel that is brighter than white and than the lamp nearby: white, but as bright as its edge
/// may be where that is hardly darker.
fn covering_light(white_cd_m2: f32, lamp_cd_m2: f32, straight_cd_m2: f32) -> f32 {
    if lamp_cd_m2 <= white_cd_m2 {
        return white_cd_m2;
    }
    let as_flame = ((straight_cd_m2 / lamp_cd_m2).log2() / STOPS_FROM_EDGE_TO_FLAME).min(1.0);
    lamp_cd_m2 * (white_cd_m2 / lamp_cd_m2).powf(as_flame)
}

/// Of each pixel the largest channel, cd/m², of what is covered whole within [`EDGE_PIXELS`] of the nearest
/// such pixels, all distances as a king goes: a soft edge ends at its lamp, however wide it is. 0 where
/// nothing is covered whole.
fn brightest_whole_nearby(width: usize, rgb_cd_m2: &[[f32; 3]], alpha: &[f32]) -> Vec<f32> {
    const FAR: u32 = u32::MAX;
    let own = |(rgb, alpha): (&[f32; 3], &f32)| if *alpha >= 1.0 { largest(*rgb) } else { 0.0 };
    let mut brightest = widened(width, &rgb_cd_m2.iter().zip(alpha).map(own).collect::<Vec<f32>>());
    let mut distance: Vec<u32> = alpha.iter().map(|alpha| if *alpha >= 1.0 { 0 } else { FAR }).collect();
    let mut ring: Vec<usize> = (0..alpha.len()).filter(|&i| distance[i] == 0).collect();
    for next_distance in 1.. {
        let mut next = Vec::new();
        for &from in &ring {
            for to in around(width, alpha.len(), from) {
                if distance[to] == FAR {
                    (distance[to], brightest[to]) = (next_distance, brightest[from]);
                    next.push(to);
                } else if distance[to] == next_distance {
                    brightest[to] = brightest[to].max(brightest[from]);
                }
            }
        }
        if next.is_empty() {
            break;
        }
        ring = next;
    }
    brightest
}

/// The pixels that touch one, and itself.
fn around(width: usize, pixels: usize, pixel: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (pixel % width, pixel / width);
    let (columns, rows) = (x.saturating_sub(1)..(x + 2).min(width), y.saturating_sub(1)..y + 2);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x)).filter(move |&i| i < pixels)
}

/// The largest value within [`EDGE_PIXELS`] of each pixel, along rows and then along columns.
fn widened(width: usize, values: &[f32]) -> Vec<f32> {
    let largest_along = |values: &[f32], step: usize, line: &dyn Fn(usize) -> (usize, usize)| -> Vec<f32> {
        let largest_around = |i: usize| {
            let (before, after) = line(i);
            let near = i - step * before.min(EDGE_PIXELS)..=i + step * after.min(EDGE_PIXELS);
            near.step_by(step).map(|i| values[i]).fold(0.0, f32::max)
        };
        (0..values.len()).map(largest_around).collect()
    };
    let rows = largest_along(values, 1, &|i| (i % width, (width - 1 - i % width).min(values.len() - 1 - i)));
    largest_along(&rows, width, &|i| (i / width, (values.len() - 1 - i) / width))
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
    use fechner_perception::tone::{self, SceneGuide, ToneSettings, map_picture};
    use fechner_perception::{Plane, Viewing};

    fn fitted(name: &str) -> Box<dyn FittedTone> {
        let operator = tone::operator_with(name, &ToneSettings::default()).expect("an operator");
        operator.fit(&SceneGuide::of(&Plane::filled(8, 8, 20.0)), &Viewing::default(), None)
    }

    /// Edges of what is dim and of a lamp beyond white, both of which are there uncut, and edges of hair that
    /// nothing uncut is as bright as.
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
                let covered = Covered::of(fitted.as_ref(), map_picture, 8, &rgb, &alpha);
                let before = map_picture(fitted.as_ref(), 8, &divided_by_alpha(&rgb, &alpha));
                assert!(!covered.has_light_in_front(), "{name}: {:?}", covered.beyond);
                assert_eq!(covered.straight(), (before, alpha.to_vec()), "{name}");
            }
        }
    }

    /// An edge is a little brighter than what lies behind it, of a lamp that is shown as white as of one that
    /// nearly is, and stays an edge.
    #[test]
    fn edges_that_are_a_little_brighter_stay_as_they_are() {
        let alpha = [1.0, 0.86, 0.5, 0.2];
        for name in tone::operator_names() {
            let fitted = fitted(name);
            let white_cd_m2 = white_cd_m2(fitted.as_ref(), Pixel { x: 0, y: 0 }, 1e6).expect("white");
            for lamp_cd_m2 in [0.95, 1.05, 20.0].map(|times| times * white_cd_m2) {
                let edge_cd_m2 = 1.15 * lamp_cd_m2;
                let light = alpha.map(|alpha| if alpha < 1.0 { alpha * edge_cd_m2 } else { lamp_cd_m2 });
                let covered = Covered::of(fitted.as_ref(), map_picture, 4, &light.map(|light| [light; 3]), &alpha);
                assert!(!covered.has_light_in_front(), "{name}, {lamp_cd_m2} cd/m²: {:?}", covered.beyond);
            }
        }
    }

    /// Flames before black are as bright as without alpha, and what lies behind them is covered no more than it must
    /// be.
    #[test]
    fn light_that_covers_nothing_is_shown() {
        let rgb = [[1.0; 3], [40.0, 30.0, 10.0], [50.0; 3], [0.0; 3]];
        let alpha = [1.0, 0.1, 0.0, 0.0];
        for name in tone::operator_names() {
            let fitted = fitted(name);
            let covered = Covered::of(fitted.as_ref(), map_picture, 4, &rgb, &alpha);
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
            assert_eq!((raised[0], raised[3], covered.alpha), (1.0, 0.0, &alpha[..]));
        }
    }

    /// A lamp elsewhere is no reason to show a flame darker, nor one beside it that is not as bright: neither is its
    /// soft edge.
    #[test]
    fn bright_things_leave_flames_alone() {
        const SIDE: usize = 16;
        let is_flame = |i: usize| i % SIDE >= SIDE / 2;
        let alpha: Vec<f32> = (0..SIDE * SIDE).map(|i| if is_flame(i) { 0.05 } else { 1.0 }).collect();
        let without: Vec<[f32; 3]> =
            (0..SIDE * SIDE).map(|i| if is_flame(i) { [400.0, 300.0, 200.0] } else { [50.0; 3] }).collect();
        for name in tone::operator_names() {
            let fitted = fitted(name);
            let shown = |rgb: &[[f32; 3]]| Covered::of(fitted.as_ref(), map_picture, SIDE, rgb, &alpha).premultiplied();
            let (right, black) = (shown(&without), map_picture(fitted.as_ref(), SIDE, &without));
            // Far away whatever it is; beside the flame what is a stop darker than light of 8,000 cd/m² behind its
            // alpha.
            for (lamp, lamp_cd_m2) in [(2 * SIDE + 2, 1e6), (2 * SIDE + 7, 3500.0)] {
                let mut rgb = without.clone();
                rgb[lamp] = [lamp_cd_m2; 3];
                let shown = shown(&rgb);
                for i in (0..SIDE * SIDE).filter(|&i| is_flame(i)) {
                    assert_eq!(shown[i], right[i], "{name}: pixel {i}, a lamp of {lamp_cd_m2} cd/m²");
                    let lost = (0..3).map(|channel| black[i][channel] - shown[i][channel]).fold(0.0, f32::max);
                    let is_linear = ["absolute", "srgb"].contains(name);
                    assert!(!is_linear || lost < 2e-3, "{name}: {:?} before black {:?}", shown[i], black[i]);
                }
            }
        }
    }

    /// A rim that mirrors a lamp is an edge, of which few samples met it; a flame beside it with light all around is
    /// none.
    #[test]
    fn a_bright_rim_covers_no_more_than_it_does() {
        let alpha = [1.0, 0.02, 0.0, 0.0, 1.0, 0.02, 0.02, 0.02];
        let rgb = [5.0, 900.0, 0.0, 0.0, 5.0, 900.0, 900.0, 900.0].map(|light| [light; 3]);
        for name in ["absolute", "srgb", "pattanaik00", "durand-dorsey00"] {
            let fitted = fitted(name);
            let covered = |pixels: std::ops::Range<usize>| {
                let covered = Covered::of(fitted.as_ref(), map_picture, 4, &rgb[pixels.clone()], &alpha[pixels]);
                covered.straight().1
            };
            let (rim, flame) = (covered(0..4), covered(4..8));
            assert_eq!(rim, alpha[..4], "{name}");
            assert!(flame[1] > 0.5 && flame[2] > 0.5, "{name}: {flame:?}");
        }
    }

    /// However wide: as out of focus, as ours is between two things that are covered whole, and a little brighter
    /// than the lamp's whole part.
    #[test]
    fn wide_soft_edges_of_lamps_stay_as_they_are() {
        const WIDTH: usize = 64;
        let alpha: Vec<f32> = (0..3 * WIDTH).map(|i| ((i % WIDTH) as f32 / 40.0).min(1.0)).collect();
        let dim = |i: usize| i % WIDTH >= 44;
        let light = |i: usize| if dim(i) { 20.0 } else { 5000.0 };
        for name in tone::operator_names() {
            let fitted = fitted(name);
            let straight = |brighter: f32| -> Vec<[f32; 3]> {
                alpha
                    .iter()
                    .enumerate()
                    .map(|(i, &a)| [light(i) * a * if a < 1.0 { brighter } else { 1.0 }; 3])
                    .collect()
            };
            let covered = Covered::of(fitted.as_ref(), map_picture, WIDTH, &straight(1.0), &alpha);
            assert!(!covered.has_light_in_front(), "{name}: {:?}", covered.beyond);
            let noisy = Covered::of(fitted.as_ref(), map_picture, WIDTH, &straight(1.02), &alpha).premultiplied();
            for (shown, alpha) in noisy.iter().zip(&alpha) {
                assert!(shown[0] - alpha < 0.1, "{name}: {shown:?} at an alpha of {alpha}");
            }
        }
    }

    /// From what covers to what does not nothing jumps.
    #[test]
    fn more_light_is_never_shown_as_less() {
        let alpha = [0.2; 256];
        let rgb: Vec<[f32; 3]> = (0..256).map(|i| [0.5 * i as f32, 0.3 * i as f32, 0.1 * i as f32]).collect();
        for name in ["absolute", "srgb", "reinhard02", "agx", "constant"] {
            let shown = Covered::of(fitted(name).as_ref(), map_picture, 256, &rgb, &alpha).premultiplied();
            for pair in shown.windows(2) {
                let [before, after] = [0, 1].map(|i| fechner_perception::photometry::luminance(pair[i]));
                assert!(after >= before - 1e-3 && after - before < 0.03, "{name}: {before} to {after}");
            }
        }
    }
}
