//! Saliency: what of a picture attracts the gaze.
//!
//! Itti, Koch and Niebur, "A model of saliency-based visual attention for rapid scene analysis", IEEE PAMI 20(11),
//! 1998: centre–surround differences of intensity, opponent colour and orientation over a pyramid; and of motion, as
//! Yee, Pattanaik and Greenberg added in 2001.
//!
//! The paper's colour maps are doubly opponent, |(R − G)(centre) + (R − G)(surround)|, and stand out where centre and
//! surround are of one colour. Here the surround is subtracted, as it is of intensity: what differs stands out.
//!
//! It is of what draws the eye by itself, and knows no task, no faces and no text. Not for thresholds of stills:
//! attention decides what moving things the eye follows ([`crate::motion`]), and changes nothing where nothing moves.

use crate::display::Display;
use crate::error::Error;
use crate::filter::reflect;
use crate::plane::Plane;
use crate::table::Between;

/// The picture that somebody looks at. All planes have one size.
#[derive(Clone, Copy, Debug)]
pub struct SaliencyInputs<'a> {
    /// Red, green and blue of the tone-mapped guide, 0..1: linear HDR would let one lamp own the map.
    pub rgb: [&'a Plane; 3],
    /// Speed over the picture, any unit; `None` for a still.
    pub velocity: Option<&'a Plane>,
}

/// Saliency of a moving picture as a display sends it to the eye: RGB in cd/m², row by row, `width` pixels wide, and
/// speed over the picture in any unit.
///
/// # Errors
/// As [`saliency`].
pub fn saliency_of_displayed(
    width: usize,
    rgb_cd_m2: &[[f32; 3]],
    velocity: &Plane,
    display: &Display,
) -> Result<Plane, Error> {
    let white_cd_m2 = display.luminance_cd_m2(1.0) as f32;
    let channel = |channel: usize| {
        let relative = rgb_cd_m2.iter().map(|rgb| rgb[channel] / white_cd_m2).collect();
        Plane::from_values(width, rgb_cd_m2.len() / width.max(1), relative)
    };
    let [red, green, blue] = [channel(0)?, channel(1)?, channel(2)?];
    saliency(&SaliencyInputs { rgb: [&red, &green, &blue], velocity: Some(velocity) })
}

/// Saliency of each pixel, 0..1. A picture in which nothing stands out is 1 everywhere: all of it may be looked at.
///
/// # Errors
/// [`Error::Empty`], [`Error::BadPixel`], [`Error::SizeMismatch`].
pub fn saliency(inputs: &SaliencyInputs<'_>) -> Result<Plane, Error> {
    let [red, green, blue] = inputs.rgb;
    let (width, height) = (red.width(), red.height());
    for (what, plane) in
        [("red", Some(red)), ("green", Some(green)), ("blue", Some(blue)), ("velocity", inputs.velocity)]
    {
        if let Some(plane) = plane {
            plane.check_size(what, width, height)?;
            plane.check_non_negative(what)?;
        }
    }
    let intensity = Plane::from_fn(width, height, |x, y| (red.get(x, y) + green.get(x, y) + blue.get(x, y)) / 3.0);
    let pyramid = Pyramid::of(&intensity);
    let opponents = opponent_colours(inputs.rgb, &intensity);
    let mut conspicuities = vec![
        conspicuity([&pyramid].into_iter()),
        conspicuity(opponents.iter().map(Pyramid::of).collect::<Vec<_>>().iter()),
        conspicuity((0..4).map(|turn| pyramid.oriented(turn)).collect::<Vec<_>>().iter()),
    ];
    if let Some(velocity) = inputs.velocity {
        let fastest = velocity.max().max(f32::MIN_POSITIVE);
        conspicuities.push(conspicuity([Pyramid::of(&velocity.map(|speed| speed / fastest))].iter()));
    }
    let mut sum = Plane::filled(conspicuities[0].width(), conspicuities[0].height(), 0.0);
    for map in &conspicuities {
        add(&mut sum, &promoted(map));
    }
    let largest = sum.max();
    if largest <= 1e-6 {
        return Ok(Plane::filled(width, height, 1.0));
    }
    let small = sum.map(|value| value / largest);
    Ok(resized(&small, pyramid.octave(COMMON), Level { octave: 0, width, height }))
}

/// Centre scales and the surrounds' distance from them, as published.
const CENTERS: [usize; 3] = [2, 3, 4];
const DELTAS: [usize; 2] = [3, 4];
/// Scale at which maps are added.
const COMMON: usize = 4;

/// Half-sized copies of a plane; small pictures have fewer than the published nine.
struct Pyramid {
    levels: Vec<Plane>,
}

impl Pyramid {
    fn of(plane: &Plane) -> Self {
        let mut levels = vec![plane.clone()];
        while levels.len() < 9 {
            let last = &levels[levels.len() - 1];
            if last.width().min(last.height()) < 2 {
                break;
            }
            levels.push(halved(last));
        }
        Self { levels }
    }

    /// The nearest scale to `octave` that there is.
    fn octave(&self, octave: usize) -> usize {
        octave.min(self.levels.len() - 1)
    }

    fn plane(&self, octave: usize) -> &Plane {
        &self.levels[self.octave(octave)]
    }

    fn level(&self, octave: usize) -> Level {
        let plane = self.plane(octave);
        Level { octave: self.octave(octave), width: plane.width(), height: plane.height() }
    }

    /// One scale interpolated to the pixels of another.
    fn level_at(&self, octave: usize, to_octave: usize) -> Plane {
        resized(self.plane(octave), self.octave(octave), self.level(to_octave))
    }

    /// Magnitude of the response to a Gabor patch at `turn` · 45° on every level.
    fn oriented(&self, turn: u8) -> Self {
        Self { levels: self.levels.iter().map(|level| gabor(level, turn)).collect() }
    }
}

/// Red–green and blue–yellow, hue only where there is light enough to see it.
fn opponent_colours(rgb: [&Plane; 3], intensity: &Plane) -> [Plane; 2] {
    let brightest = intensity.max();
    let channel = |opponent: fn(f32, f32, f32) -> f32| {
        Plane::from_fn(intensity.width(), intensity.height(), |x, y| {
            let light = intensity.get(x, y);
            if light <= brightest / 10.0 || light <= 0.0 {
                return 0.0;
            }
            let [r, g, b] = rgb.map(|plane| plane.get(x, y) / light);
            opponent(r, g, b)
        })
    };
    [
        channel(|r, g, b| (r - (g + b) / 2.0).max(0.0) - (g - (r + b) / 2.0).max(0.0)),
        channel(|r, g, b| (b - (r + g) / 2.0).max(0.0) - ((r + g) / 2.0 - (r - g).abs() / 2.0 - b).max(0.0)),
    ]
}

/// The across-scale sum of promoted centre–surround maps.
fn conspicuity<'a>(pyramids: impl Iterator<Item = &'a Pyramid>) -> Plane {
    let mut sum: Option<Plane> = None;
    for pyramid in pyramids {
        let common = pyramid.level(COMMON);
        for center in CENTERS {
            for delta in DELTAS {
                let surround = pyramid.level_at(center + delta, center);
                let mut difference = pyramid.plane(center).clone();
                difference.for_each_row_mut(|y, row| {
                    row.iter_mut().zip(surround.row(y)).for_each(|(value, other)| *value = (*value - other).abs());
                });
                let map = promoted(&resized(&difference, pyramid.octave(center), common));
                match &mut sum {
                    Some(sum) => add(sum, &map),
                    None => sum = Some(map),
                }
            }
        }
    }
    sum.unwrap_or_else(|| Plane::filled(1, 1, 0.0))
}

/// Itti's N: scaled to 0..1, times (1 − m)² with m the mean of the local maxima but the global one: many equal peaks
/// say nothing.
fn promoted(map: &Plane) -> Plane {
    // Of what goes up to 1 less than that is rounding.
    const LEAST: f32 = 1e-5;
    let largest = map.max();
    if largest <= LEAST {
        return map.map(|_| 0.0);
    }
    let scaled = map.map(|value| value / largest);
    let factor = promotion(&scaled);
    scaled.map(|value| value * factor)
}

/// Local maxima below this share of the greatest are none: where nothing happens they are rounding's.
const LEAST_MAXIMUM: f32 = 0.1;
/// A maximum from which a higher one is reached without going down by this share of the greatest is a part of that one.
const MIN_DESCENT: f32 = 0.01;

/// (M − m)² of a map scaled to M = 1.
fn promotion(scaled: &Plane) -> f32 {
    let mut maxima = local_maxima(scaled);
    maxima.sort_unstable_by(f32::total_cmp);
    maxima.pop();
    if maxima.is_empty() {
        return 1.0;
    }
    let mean = maxima.iter().sum::<f32>() / maxima.len() as f32;
    (1.0 - mean).powi(2)
}

/// Values of the local maxima, a plateau's once, whatever its shape.
fn local_maxima(scaled: &Plane) -> Vec<f32> {
    let (width, height) = (scaled.width(), scaled.height());
    let mut maxima = Vec::new();
    let mut is_found = vec![false; width * height];
    for (pixel, &value) in scaled.values().iter().enumerate() {
        let is_peak = neighbours(pixel, width, height).all(|other| scaled.values()[other] <= value);
        if value >= LEAST_MAXIMUM
            && is_peak
            && !is_found[pixel]
            && let Some(plateau) = plateau_of(scaled, pixel)
        {
            plateau.into_iter().for_each(|pixel| is_found[pixel] = true);
            maxima.push(value);
        }
    }
    maxima
}

/// What lies around a peak and at most [`MIN_DESCENT`] below it; `None` if something higher does.
fn plateau_of(scaled: &Plane, peak: usize) -> Option<Vec<usize>> {
    let values = scaled.values();
    let mut is_seen = vec![false; values.len()];
    is_seen[peak] = true;
    let (mut plateau, mut visited) = (vec![peak], 0);
    while let Some(&pixel) = plateau.get(visited) {
        visited += 1;
        for other in neighbours(pixel, scaled.width(), scaled.height()) {
            if values[other] > values[peak] {
                return None;
            }
            if !is_seen[other] && values[other] >= values[peak] - MIN_DESCENT {
                is_seen[other] = true;
                plateau.push(other);
            }
        }
    }
    Some(plateau)
}

/// The pixel itself and the up to eight around it.
fn neighbours(pixel: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let around = |index: usize, len: usize| index.saturating_sub(1)..(index + 2).min(len);
    let columns = around(pixel % width, width);
    around(pixel / width, height).flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

fn add(sum: &mut Plane, other: &Plane) {
    for (value, other) in sum.values_mut().iter_mut().zip(other.values()) {
        *value += other;
    }
}

/// Blurred, and every second pixel of it, both ends alike: an even row by the binomial kernel (1, 3, 3, 1)/8, each
/// pixel between two, an odd one by (1, 8, 14, 8, 1)/32, which has the same variance, from its first pixel to its
/// last. So each level stands around the picture's middle (see [`resized`]), and a mirrored picture has the mirrored
/// levels.
fn halved(plane: &Plane) -> Plane {
    const BETWEEN: &[f32] = &[0.125, 0.375, 0.375, 0.125];
    const AROUND: &[f32] = &[0.031_25, 0.25, 0.437_5, 0.25, 0.031_25];
    let (width, height) = (plane.width(), plane.height());
    let sum = |at: usize, len: usize, value: &dyn Fn(usize) -> f32| -> f32 {
        let (kernel, before) = if len.is_multiple_of(2) { (BETWEEN, 1) } else { (AROUND, 2) };
        let taps = kernel.iter().zip(2 * at as isize - before..);
        taps.map(|(weight, index)| weight * value(reflect(index, len))).sum()
    };
    let across = Plane::from_fn(width.div_ceil(2), height, |x, y| sum(x, width, &|x| plane.get(x, y)));
    Plane::from_fn(across.width(), height.div_ceil(2), |x, y| sum(y, height, &|y| across.get(x, y)))
}

/// Which pixels a scale has.
#[derive(Clone, Copy)]
struct Level {
    /// Log₂ of a pixel's width.
    octave: usize,
    width: usize,
    height: usize,
}

/// Bilinear interpolation of the scale `octave` to the pixels of another one, whose middles lie over one another;
/// sides in proportion would move the levels of pictures that 256 does not divide against each other.
fn resized(plane: &Plane, octave: usize, to: Level) -> Plane {
    let ratio = (to.octave as f32 - octave as f32).exp2();
    let middle = |len: usize| 0.5 * (len - 1) as f32;
    let place = |index: usize, to: usize, from: usize| {
        Between::of(f64::from((index as f32 - middle(to)) * ratio + middle(from)), from)
    };
    Plane::from_fn(to.width, to.height, |x, y| {
        let (columns, rows) = (place(x, to.width, plane.width()), place(y, to.height, plane.height()));
        columns.bilinear(rows, |column, row| plane.get(column, row))
    })
}

/// Magnitude of the response to an even and an odd Gabor patch of wavelength 4 pixels and σ 2, at `turn` · 45°.
fn gabor(plane: &Plane, turn: u8) -> Plane {
    const RADIUS: isize = 4;
    let (sine, cosine) = (f32::from(turn) * std::f32::consts::FRAC_PI_4).sin_cos();
    let mut taps = Vec::new();
    let (mut even_sum, mut weight_sum) = (0.0, 0.0);
    for dy in -RADIUS..=RADIUS {
        for dx in -RADIUS..=RADIUS {
            let window = (-((dx * dx + dy * dy) as f32) / 8.0).exp();
            let phase = std::f32::consts::FRAC_PI_2 * (dx as f32 * cosine + dy as f32 * sine);
            even_sum += window * phase.cos();
            weight_sum += window;
            taps.push((dx, dy, window, phase));
        }
    }
    // The even patch must not answer to plain light.
    let offset = even_sum / weight_sum;
    Plane::from_fn(plane.width(), plane.height(), |x, y| {
        let (mut even, mut odd) = (0.0, 0.0);
        for &(dx, dy, window, phase) in &taps {
            let value =
                plane.get(reflect(x as isize + dx, plane.width()), reflect(y as isize + dy, plane.height())) * window;
            even += value * (phase.cos() - offset);
            odd += value * phase.sin();
        }
        (even * even + odd * odd).sqrt() / weight_sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn promotion_follows_the_published_rule() {
        // Peaks of a map scaled to 10: others {4, 2} → 49, {5} → 25, {10} → 0, none → 100.
        let peaks = |values: &[f32]| {
            let mut map = Plane::filled(40, 3, 0.0);
            for (index, value) in values.iter().enumerate() {
                map.values_mut()[40 + 4 + 8 * index] = value / 10.0;
            }
            promotion(&map) * 100.0
        };
        for (values, expected) in [
            (vec![10.0, 4.0, 2.0], 49.0),
            (vec![10.0, 5.0], 25.0),
            (vec![10.0, 10.0], 0.0),
            (vec![10.0], 100.0),
            (vec![10.0, 9.0, 1.0], 25.0),
        ] {
            assert!((peaks(&values) - expected).abs() < 1e-3, "{values:?}");
        }
    }

    #[test]
    fn the_odd_one_stands_out() {
        let spot = Plane::from_fn(256, 256, |x, y| if x.abs_diff(180) < 12 && y.abs_diff(70) < 12 { 0.9 } else { 0.2 });
        let map = saliency(&SaliencyInputs { rgb: [&spot; 3], velocity: None }).unwrap();
        assert!(map.get(180, 70) > 0.5 && map.get(40, 200) < 0.2, "{} {}", map.get(180, 70), map.get(40, 200));
        assert!(map.values().iter().all(|value| (0.0..=1.0).contains(value)));
        // Motion alone, in a picture without anything to see.
        let grey = Plane::filled(256, 256, 0.3);
        let velocity = Plane::from_fn(256, 256, |x, y| if x < 60 && y < 60 { 8.0 } else { 0.0 });
        let map = saliency(&SaliencyInputs { rgb: [&grey; 3], velocity: Some(&velocity) }).unwrap();
        assert!(map.get(40, 40) > 2.0 * map.get(200, 200));
    }

    /// What is seen in a mirror attracts the eye in the mirror's place, and what moves as one piece has no part that
    /// stands out.
    #[test]
    fn levels_lie_over_one_another() {
        let picture = |x: usize, y: usize| {
            let spot = if x.abs_diff(70) < 9 && y.abs_diff(90) < 9 { 0.6 } else { 0.0 };
            spot + 0.3 * x as f32 / 256.0
        };
        let of = |picture: &(dyn Fn(usize, usize) -> f32 + Sync)| {
            let plane = Plane::from_fn(256, 256, picture);
            saliency(&SaliencyInputs { rgb: [&plane; 3], velocity: None }).unwrap()
        };
        let (map, mirrored) = (of(&picture), of(&|x, y| picture(255 - x, y)));
        for y in 0..256 {
            for x in 0..256 {
                let (here, there) = (map.get(x, y), mirrored.get(255 - x, y));
                assert!((here - there).abs() < 1e-3, "({x}, {y}): {here}, mirrored {there}");
            }
        }
        let (grey, panned) = (Plane::filled(256, 256, 0.3), Plane::filled(256, 256, 30.1));
        let map = saliency(&SaliencyInputs { rgb: [&grey; 3], velocity: Some(&panned) }).unwrap();
        assert_eq!(map, Plane::filled(256, 256, 1.0));
    }

    /// Sides that 256 does not divide are no different.
    #[test]
    fn mirrored_pictures_of_any_size_attract_in_the_mirrored_place() {
        for (width, height) in [(480, 270), (257, 256), (97, 61)] {
            let picture = |x: usize, y: usize| {
                let (u, v) = (x as f32 / width as f32, y as f32 / height as f32);
                let spot = if (u - 0.3).abs() < 0.04 && (v - 0.35).abs() < 0.04 { 0.6 } else { 0.0 };
                spot + 0.2 * u + 0.1 * v
            };
            let of = |picture: &(dyn Fn(usize, usize) -> f32 + Sync)| {
                let plane = Plane::from_fn(width, height, picture);
                saliency(&SaliencyInputs { rgb: [&plane; 3], velocity: None }).unwrap()
            };
            let map = of(&picture);
            let across = of(&|x, y| picture(width - 1 - x, y));
            let down = of(&|x, y| picture(x, height - 1 - y));
            let mut worst = 0.0_f32;
            for y in 0..height {
                for x in 0..width {
                    let here = map.get(x, y);
                    worst = worst.max((here - across.get(width - 1 - x, y)).abs());
                    worst = worst.max((here - down.get(x, height - 1 - y)).abs());
                }
            }
            assert!(worst < 1e-3, "{width}×{height}: {worst}");
        }
    }

    /// A plateau's shape is no number of peaks, and rounding makes none.
    #[test]
    fn a_plateau_is_one_peak() {
        let ridge = |x: usize, y: usize| x.abs_diff(20) + y.abs_diff(20) == 8;
        let map = Plane::from_fn(60, 40, |x, y| {
            let rounding = 1e-6 * ((x * 7 + y * 13) % 5) as f32;
            if ridge(x, y) || (x, y) == (50, 20) { 1.0 - rounding - if x == 50 { 0.5 } else { 0.0 } } else { rounding }
        });
        assert!((promotion(&map) - 0.25).abs() < 1e-3, "{}", promotion(&map));
    }

    #[test]
    fn a_plain_picture_is_all_worth_a_look() {
        for (width, height) in [(1, 1), (3, 200), (300, 280)] {
            let grey = Plane::filled(width, height, 0.5);
            let map = saliency(&SaliencyInputs { rgb: [&grey; 3], velocity: None }).unwrap();
            assert_eq!(map, Plane::filled(width, height, 1.0));
        }
        let bad = Plane::filled(3, 3, f32::NAN);
        assert!(saliency(&SaliencyInputs { rgb: [&bad; 3], velocity: None }).is_err());
    }
}
