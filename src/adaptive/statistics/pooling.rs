//! What the neighbours of a pixel say of its variance: weighted sums over 7×7 pixels of like surface.
//!
//! By rows and in planes, so that one instruction works on several pixels: pixel by pixel, with each pixel's facts together, this
//! took about a quarter of a look (a profile read by hand on 22 November 2026).

use super::{PixelEvidence, by_channel};
use crate::film::{CHANNELS, PixelGuide};
use rayon::prelude::*;

/// Pixels to each side that are pooled.
const POOL_RADIUS: usize = 3;
/// Range of the low-discrepancy factor: stratified samples do better than their scatter says, hardly ever worse.
const FACTOR_RANGE: (f32, f32) = (0.02, 1.2);
/// Evidence is cut here, so that sums and products of weights stay finite.
const MOST_EVIDENCE: f64 = 1e36;

/// A channel's statistics of a pixel.
#[derive(Clone, Copy)]
pub(super) struct Pooled {
    pub(super) variance: f32,
    pub(super) factor: f32,
    pub(super) factor_with_own: f32,
}

/// Pools the neighbours of every pixel of a picture that is `width` wide, row-major. Each neighbour weighs the same whatever its
/// count, so that a region's variance is not that of its hardest pixels.
pub(super) fn pooled_by_neighbours(
    evidence: &[[PixelEvidence; CHANNELS]],
    guides: &[PixelGuide],
    width: usize,
) -> Vec<[Pooled; CHANNELS]> {
    if width == 0 {
        return Vec::new();
    }
    let height = evidence.len() / width;
    let (surfaces, channels) =
        rayon::join(|| Surfaces::of(guides), || by_channel(|channel| Evidence::of(evidence, channel)));
    let rows = (0..height).into_par_iter().flat_map_iter(|y| {
        let mut sums = RowSums::new(width);
        for neighbour_y in y.saturating_sub(POOL_RADIUS)..(y + POOL_RADIUS + 1).min(height) {
            for shift in -(POOL_RADIUS as isize)..=POOL_RADIUS as isize {
                if neighbour_y != y || shift != 0 {
                    sums.add(&surfaces, &channels, Neighbours::of([y, neighbour_y], shift, width));
                }
            }
        }
        (0..width).map(move |x| sums.pooled(x, &evidence[y * width + x]))
    });
    rows.collect()
}

/// First surfaces, a plane for each number.
struct Surfaces {
    normal: [Vec<f32>; 3],
    albedo: [Vec<f32>; 3],
    depth: Vec<f32>,
}

impl Surfaces {
    fn of(guides: &[PixelGuide]) -> Self {
        Self {
            normal: std::array::from_fn(|axis| guides.iter().map(|guide| guide.normal[axis]).collect()),
            albedo: std::array::from_fn(|band| guides.iter().map(|guide| guide.albedo[band]).collect()),
            depth: guides.iter().map(|guide| guide.depth).collect(),
        }
    }

    /// How alike the surfaces of pixels and of neighbours are, in [0.02, 1]: never 0, so that a lone pixel still learns something.
    fn likeness(&self, pairs: &Neighbours, weights: &mut [f32]) {
        let squared_distance = |planes: &[Vec<f32>; 3], weights: &mut [f32], scale: f32| {
            let [p, q] = [0, 1].map(|side| planes.each_ref().map(|plane| pairs.side(side, plane)));
            for (i, weight) in weights.iter_mut().enumerate() {
                let [dx, dy, dz] = [p[0][i] - q[0][i], p[1][i] - q[1][i], p[2][i] - q[2][i]];
                *weight += (dx * dx + dy * dy + dz * dz) * scale;
            }
        };
        // Half weight at: normals 25° apart, albedo 0.1 apart, depth 5 % apart.
        weights.fill(0.0);
        squared_distance(&self.normal, weights, 5.3);
        squared_distance(&self.albedo, weights, 100.0);
        let [own, neighbour] = [pairs.side(0, &self.depth), pairs.side(1, &self.depth)];
        for ((weight, &a), &b) in weights.iter_mut().zip(own).zip(neighbour) {
            let depth = (a - b).abs() / (a.max(b) + f32::MIN_POSITIVE);
            *weight = (1.0 / (1.0 + (*weight + depth * depth * 400.0))).max(0.02);
        }
    }
}

/// What the pixels have to say about variance in one channel, a plane for each number; see [`PixelEvidence`].
struct Evidence {
    variance: Vec<f32>,
    squared_difference: Vec<f32>,
    expected_difference: Vec<f32>,
}

impl Evidence {
    fn of(evidence: &[[PixelEvidence; CHANNELS]], channel: usize) -> Self {
        let plane = |of: fn(&PixelEvidence) -> f64| -> Vec<f32> {
            evidence.iter().map(|pixel| of(&pixel[channel]).min(MOST_EVIDENCE) as f32).collect()
        };
        Self {
            variance: plane(|pixel| pixel.variance),
            squared_difference: plane(|pixel| pixel.squared_difference),
            expected_difference: plane(|pixel| pixel.expected_difference),
        }
    }
}

/// The pixels of a row that have a neighbour at some place relative to them: where they and their neighbours begin in a plane.
struct Neighbours {
    /// Of the first pixel in its row.
    column: usize,
    begins: [usize; 2],
    len: usize,
}

impl Neighbours {
    fn of(rows: [usize; 2], shift: isize, width: usize) -> Self {
        // A picture may be narrower than the window.
        let column = shift.min(0).unsigned_abs().min(width);
        let len = width.saturating_sub(shift.unsigned_abs());
        let neighbour_column = column.saturating_add_signed(shift).min(width);
        Self { column, begins: [rows[0] * width + column, rows[1] * width + neighbour_column], len }
    }

    /// The pixels (0) or their neighbours (1) in a plane.
    fn side<'a>(&self, side: usize, plane: &'a [f32]) -> &'a [f32] {
        if self.len == 0 { &[] } else { &plane[self.begins[side]..][..self.len] }
    }
}

/// Weighted sums over the neighbours of each pixel of a row.
struct RowSums {
    weight: Vec<f32>,
    weights: Vec<f32>,
    channels: [ChannelSums; CHANNELS],
}

struct ChannelSums {
    variance: Vec<f32>,
    squared: Vec<f32>,
    expected: Vec<f32>,
    /// The largest expectation of a single neighbour, weighted.
    most_expected: Vec<f32>,
}

impl RowSums {
    fn new(width: usize) -> Self {
        let zeros = || vec![0.0; width];
        let sums = || ChannelSums { variance: zeros(), squared: zeros(), expected: zeros(), most_expected: zeros() };
        Self { weight: zeros(), weights: zeros(), channels: std::array::from_fn(|_| sums()) }
    }

    fn add(&mut self, surfaces: &Surfaces, channels: &[Evidence; CHANNELS], pairs: Neighbours) {
        let weights = &mut self.weights[..pairs.len];
        surfaces.likeness(&pairs, weights);
        let weights = &*weights;
        let row = pairs.column..pairs.column + pairs.len;
        self.weight[row.clone()].iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight);
        for (sums, evidence) in self.channels.iter_mut().zip(channels) {
            for (sum, plane) in [
                (&mut sums.variance, &evidence.variance),
                (&mut sums.squared, &evidence.squared_difference),
                (&mut sums.expected, &evidence.expected_difference),
            ] {
                let sum = sum[row.clone()].iter_mut().zip(weights).zip(pairs.side(1, plane));
                sum.for_each(|((sum, weight), value)| *sum += weight * value);
            }
            let expected = pairs.side(1, &evidence.expected_difference);
            let most = sums.most_expected[row.clone()].iter_mut().zip(weights).zip(expected);
            most.for_each(|((most, weight), expected)| *most = most.max(weight * expected));
        }
    }

    fn pooled(&self, x: usize, own: &[PixelEvidence; CHANNELS]) -> [Pooled; CHANNELS] {
        std::array::from_fn(|c| {
            let (sums, own) = (&self.channels[c], &own[c]);
            Pooled {
                // A pixel like none of its neighbours has only itself to go by.
                variance: if self.weight[x] > 0.0 { sums.variance[x] / self.weight[x] } else { own.variance as f32 },
                factor: sums.factor(x).clamp(FACTOR_RANGE.0, FACTOR_RANGE.1),
                factor_with_own: match f64::from(sums.expected[x]) + own.expected_difference {
                    0.0 => 1.0,
                    expected => ((f64::from(sums.squared[x]) + own.squared_difference) / expected) as f32,
                },
            }
        })
    }
}

impl ChannelSums {
    /// Squared differences over their expectation, drawn towards 1 by one observation as heavy as the heaviest: where a
    /// single pixel outweighs the others, its half difference may be small by luck.
    fn factor(&self, x: usize) -> f32 {
        let most_expected = self.most_expected[x];
        let expected = self.expected[x] + most_expected;
        if expected > 0.0 { (self.squared[x] + most_expected) / expected } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Seen;
    use crate::sampler::hash_words;

    const SIZE: [usize; 2] = [11, 6];

    fn random(pixel: usize, what: u64) -> f64 {
        (hash_words(pixel as u64, what) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn picture() -> (Vec<[PixelEvidence; CHANNELS]>, Vec<PixelGuide>) {
        let evidence = |pixel: usize| {
            std::array::from_fn(|c| PixelEvidence {
                variance: random(pixel, c as u64),
                squared_difference: random(pixel, 10 + c as u64),
                expected_difference: random(pixel, 20 + c as u64),
            })
        };
        let guide = |pixel: usize| PixelGuide {
            albedo: std::array::from_fn(|band| (0.3 * random(pixel, 30 + band as u64)) as f32),
            normal: std::array::from_fn(|axis| random(pixel, 40 + axis as u64) as f32),
            depth: 2.0 + 0.2 * random(pixel, 50) as f32,
            seen: Seen::default(),
        };
        let pixels = SIZE[0] * SIZE[1];
        ((0..pixels).map(evidence).collect(), (0..pixels).map(guide).collect())
    }

    /// The sums, pixel by pixel as they are defined.
    fn expected(
        pixel: usize,
        channel: usize,
        evidence: &[[PixelEvidence; CHANNELS]],
        guides: &[PixelGuide],
    ) -> [f64; 3] {
        let at = |pixel: usize| [pixel % SIZE[0], pixel / SIZE[0]];
        let neighbours = (0..evidence.len()).filter(|&other| {
            other != pixel && at(other).iter().zip(at(pixel)).all(|(&a, b)| a.abs_diff(b) <= POOL_RADIUS)
        });
        let (mut weights, mut variance, mut squared, mut expected, mut most) = (0.0, 0.0, 0.0, 0.0, 0.0_f64);
        for other in neighbours {
            let (p, q) = (&guides[pixel], &guides[other]);
            let square =
                |p: [f32; 3], q: [f32; 3]| -> f64 { p.iter().zip(q).map(|(a, b)| f64::from(a - b).powi(2)).sum() };
            let depth = f64::from((p.depth - q.depth).abs() / p.depth.max(q.depth));
            let unlike = 5.3 * square(p.normal, q.normal) + 100.0 * square(p.albedo, q.albedo) + 400.0 * depth * depth;
            let weight = (1.0 / (1.0 + unlike)).max(0.02);
            let neighbour = &evidence[other][channel];
            weights += weight;
            variance += weight * neighbour.variance;
            squared += weight * neighbour.squared_difference;
            expected += weight * neighbour.expected_difference;
            most = most.max(weight * neighbour.expected_difference);
        }
        let own = &evidence[pixel][channel];
        let with_own = (squared + own.squared_difference) / (expected + own.expected_difference);
        [variance / weights, ((squared + most) / (expected + most)).clamp(0.02, 1.2), with_own]
    }

    /// By rows and in planes comes out what the definition says, at borders too.
    #[test]
    fn rows_pool_what_pixels_would() {
        let (evidence, guides) = picture();
        let pooled = pooled_by_neighbours(&evidence, &guides, SIZE[0]);
        assert_eq!(pooled.len(), evidence.len());
        for (pixel, channels) in pooled.iter().enumerate() {
            for (channel, pooled) in channels.iter().enumerate() {
                let found = [pooled.variance, pooled.factor, pooled.factor_with_own];
                let expected = expected(pixel, channel, &evidence, &guides);
                for (found, expected) in found.into_iter().zip(expected) {
                    let error = (f64::from(found) / expected - 1.0).abs();
                    assert!(error < 1e-5, "pixel {pixel}, channel {channel}: {found} for {expected}");
                }
            }
        }
    }

    #[test]
    fn a_lone_pixel_goes_by_itself() {
        let (evidence, guides) = picture();
        let pooled = pooled_by_neighbours(&evidence[..1], &guides[..1], 1);
        assert_eq!(pooled[0][1].variance, evidence[0][1].variance as f32);
    }
}
