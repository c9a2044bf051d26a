//! Textures within a limit of memory: the largest are halved until all fit.
//!
//! A picture is averaged over the area of each new texel, in one go and in linear light, so that it stays as bright as
//! it was. What it loses is detail, also where the camera is near. Normal maps are averaged as vectors and stay
//! shorter than 1 where normals differ: shading makes them unit length after its own interpolation, in which
//! disagreeing texels should count less.

use super::texture::Decoded;
use crate::scene::{Encoding, Texels};
use fechner_perception::eotf::srgb_from_linear;
use std::sync::Arc;

/// What a decoded picture takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Extent {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) bytes_per_texel: u64,
}

impl Extent {
    /// Bytes after so many halvings.
    fn bytes(&self, halvings: u32) -> u64 {
        u64::from(halved(self.width, halvings)) * u64::from(halved(self.height, halvings)) * self.bytes_per_texel
    }
}

/// A side after halvings, rounded up; never below 1.
pub(super) fn halved(side: u32, halvings: u32) -> u32 {
    u64::from(side).div_ceil(1 << halvings.min(32)).max(1) as u32
}

/// How often each picture is halved so that together they take at most `limit` bytes: always the one that takes most,
/// of equals the first. Less than a texel is left of none, so that a limit may be missed.
pub(super) fn halvings(extents: &[Extent], limit: u64) -> Vec<u32> {
    let mut halvings = vec![0; extents.len()];
    let mut total: u64 = extents.iter().map(|extent| extent.bytes(0)).sum();
    while total > limit {
        let bytes = |place: &usize| extents[*place].bytes(halvings[*place]);
        let Some(largest) = (0..extents.len()).rev().max_by_key(bytes) else { break };
        let before = bytes(&largest);
        let after = extents[largest].bytes(halvings[largest] + 1);
        if after == before {
            break; // single texels
        }
        halvings[largest] += 1;
        total = total - before + after;
    }
    halvings
}

/// What the fourth channel says of the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alpha {
    /// Alpha is a value among others, or nobody reads it.
    Independent,
    /// How much of the colour is there: what is not there must not colour the mean.
    Coverage,
}

/// The picture with both sides halved so often.
pub(super) fn shrunk(picture: Decoded, halvings: u32, alpha: Alpha) -> Decoded {
    if halvings == 0 {
        return picture;
    }
    let (width, height) = (halved(picture.width, halvings), halved(picture.height, halvings));
    let (columns, rows) = (spans(picture.width, width), spans(picture.height, height));
    let mean_at = |texel: &dyn Fn(usize) -> [f32; 4], column: &Span, row: &Span| {
        let mut mean = Mean::default();
        for (y, weight_y) in row.parts() {
            for (x, weight_x) in column.parts() {
                mean.add(texel(y * picture.width as usize + x), weight_x * weight_y, alpha);
            }
        }
        mean.finish()
    };
    let means = |texel: &dyn Fn(usize) -> [f32; 4]| -> Vec<[f32; 4]> {
        rows.iter()
            .flat_map(|row| columns.iter().map(move |column| (column, row)))
            .map(|(c, r)| mean_at(texel, c, r))
            .collect()
    };
    let texels = match &picture.texels {
        Texels::Floats(floats) => Texels::Floats(Arc::new(means(&|place| floats[place]))),
        Texels::Bytes(bytes, encoding) => {
            let from_linear = |value: f32| match encoding {
                Encoding::Srgb => srgb_from_linear(value),
                Encoding::Linear => value,
            };
            let byte = |value: f32| (value * 255.0).round() as u8;
            let linear = means(&|place| {
                let [r, g, b, a] = bytes[place];
                [encoding.linear(r), encoding.linear(g), encoding.linear(b), f32::from(a) / 255.0]
            });
            let encoded = linear
                .iter()
                .map(|&[r, g, b, a]| [byte(from_linear(r)), byte(from_linear(g)), byte(from_linear(b)), byte(a)]);
            Texels::Bytes(Arc::new(encoded.collect()), *encoding)
        }
    };
    Decoded { width, height, texels, ..picture }
}

/// The part of a line of texels that one new texel covers.
#[derive(Clone, Copy, Debug)]
struct Span {
    start: f64,
    end: f64,
}

impl Span {
    /// Texels and how much of each is covered.
    fn parts(self) -> impl Iterator<Item = (usize, f64)> {
        (self.start as usize..self.end.ceil() as usize)
            .map(move |place| (place, self.end.min(place as f64 + 1.0) - self.start.max(place as f64)))
    }
}

fn spans(from: u32, to: u32) -> Vec<Span> {
    let edge = |place: u32| f64::from(place) * f64::from(from) / f64::from(to);
    (0..to).map(|place| Span { start: edge(place), end: edge(place + 1) }).collect()
}

/// A weighted mean of texels.
#[derive(Default)]
struct Mean {
    color: [f64; 3],
    color_weight: f64,
    /// Colours regardless of coverage, for where nothing is there at all.
    bare: [f64; 3],
    alpha: f64,
    weight: f64,
}

impl Mean {
    fn add(&mut self, [r, g, b, a]: [f32; 4], weight: f64, alpha: Alpha) {
        let a = f64::from(a);
        let color_weight = if alpha == Alpha::Coverage { weight * a } else { weight };
        for ((color, bare), value) in self.color.iter_mut().zip(&mut self.bare).zip([r, g, b]) {
            *color += color_weight * f64::from(value);
            *bare += weight * f64::from(value);
        }
        self.color_weight += color_weight;
        self.alpha += weight * a;
        self.weight += weight;
    }

    fn finish(self) -> [f32; 4] {
        let (sums, weight) =
            if self.color_weight > 0.0 { (self.color, self.color_weight) } else { (self.bare, self.weight) };
        let [r, g, b] = sums.map(|sum| (sum / weight) as f32);
        [r, g, b, (self.alpha / self.weight) as f32]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extent(width: u32, height: u32) -> Extent {
        Extent { width, height, bytes_per_texel: 4 }
    }

    #[test]
    fn the_largest_are_halved_first() {
        let extents = [extent(64, 64), extent(256, 256), extent(256, 256), extent(1, 7)];
        let all = 4 * (64 * 64 + 2 * 256 * 256 + 7);
        assert_eq!(halvings(&extents, all), [0, 0, 0, 0]);
        assert_eq!(halvings(&extents, all - 1), [0, 1, 0, 0]);
        assert_eq!(halvings(&extents, all / 2), [0, 1, 1, 0]);
        assert_eq!(halvings(&extents, 4 * (64 * 64 * 2 + 32 * 32 + 7)), [1, 2, 2, 0]);
        assert_eq!(halvings(&extents, 0), [6, 8, 8, 3]);
    }

    fn floats(width: u32, height: u32, texels: Vec<[f32; 4]>) -> Decoded {
        Decoded::of_texels([width, height], Texels::Floats(Arc::new(texels)))
    }

    fn values(picture: &Decoded) -> &[[f32; 4]] {
        match &picture.texels {
            Texels::Floats(texels) => texels,
            Texels::Bytes(..) => panic!("bytes"),
        }
    }

    /// Also of sides that are odd, where texels are shared.
    #[test]
    fn the_mean_stays() {
        for (width, height, halvings) in [(8, 8, 1), (7, 5, 1), (9, 1, 2), (5, 6, 3)] {
            let texels =
                (0..width * height).map(|i| [i as f32, (i % 3) as f32, 1.0, (i % 2) as f32]).collect::<Vec<_>>();
            let mean = |texels: &[[f32; 4]], channel: usize| {
                texels.iter().map(|texel| f64::from(texel[channel])).sum::<f64>() / texels.len() as f64
            };
            let small = shrunk(floats(width, height, texels.clone()), halvings, Alpha::Independent);
            assert_eq!((small.width, small.height), (halved(width, halvings), halved(height, halvings)));
            for channel in 0..4 {
                let (before, after) = (mean(&texels, channel), mean(values(&small), channel));
                assert!((before - after).abs() < 1e-5, "{width} x {height}, channel {channel}: {before} and {after}");
            }
        }
    }

    #[test]
    fn what_is_not_there_does_not_colour() {
        let texels = vec![[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.0]];
        let covered = shrunk(floats(2, 2, texels.clone()), 1, Alpha::Coverage);
        assert_eq!(values(&covered), [[1.0, 0.0, 0.0, 0.375]]);
        let independent = shrunk(floats(2, 2, texels), 1, Alpha::Independent);
        assert_eq!(values(&independent), [[0.5, 0.5, 0.0, 0.375]]);
        let nothing = shrunk(floats(2, 1, vec![[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]), 1, Alpha::Coverage);
        assert_eq!(values(&nothing), [[0.5, 0.5, 0.0, 0.0]]);
    }

    /// Black and white bytes average to half the light, which is 188 under sRGB's curve; linear ones to 128.
    #[test]
    fn bytes_are_averaged_in_linear_light() {
        for (encoding, expected) in [(Encoding::Srgb, 188), (Encoding::Linear, 128)] {
            let texels = Texels::Bytes(Arc::new(vec![[0, 0, 0, 255], [255, 255, 255, 255]]), encoding);
            let small = shrunk(Decoded::of_texels([2, 1], texels), 1, Alpha::Independent);
            let Texels::Bytes(bytes, kept) = small.texels else { panic!("floats") };
            assert_eq!((bytes[0], kept), ([expected, expected, expected, 255], encoding));
        }
    }
}
