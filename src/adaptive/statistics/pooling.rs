//! What the neighbours of a pixel say of its variance: weighted sums over 7×7 pixels of like surface.
//!
//! In planes, [`LANES`] columns at a time, whose sums stay in registers and in the first cache: a whole row at a time, one neighbour
//! after the other, it took 1.3 times the instructions and the time.

use super::PixelEvidence;
use crate::film::{CHANNELS, PixelGuide};
use fechner_perception::Plane;
use glam::Vec4;
use rayon::prelude::*;
use std::slice::ChunksMut;

/// Pixels to each side that are pooled.
const POOL_RADIUS: usize = 3;
/// Range of the low-discrepancy factor: stratified samples do better than their scatter says, hardly ever worse.
const FACTOR_RANGE: (f32, f32) = (0.02, 1.2);
/// Evidence is cut here, so that sums and products of weights stay finite.
const MOST_EVIDENCE: f64 = 1e36;

/// A channel's statistics of every pixel.
pub(super) struct Pooled {
    pub(super) variance: Plane,
    pub(super) factor: Plane,
    pub(super) factor_with_own: Plane,
}

/// The rows of [`Pooled`] that are still to be handed out.
struct PooledRows<'a> {
    variance: ChunksMut<'a, f32>,
    factor: ChunksMut<'a, f32>,
    factor_with_own: ChunksMut<'a, f32>,
}

#[derive(Default)]
struct PooledRow<'a> {
    variance: &'a mut [f32],
    factor: &'a mut [f32],
    factor_with_own: &'a mut [f32],
}

impl Pooled {
    fn new(width: usize, height: usize) -> Self {
        let plane = || Plane::filled(width, height, 0.0);
        Self { variance: plane(), factor: plane(), factor_with_own: plane() }
    }

    /// Of a picture that is not empty.
    fn rows(&mut self) -> PooledRows<'_> {
        let width = self.variance.width();
        PooledRows {
            variance: self.variance.values_mut().chunks_mut(width),
            factor: self.factor.values_mut().chunks_mut(width),
            factor_with_own: self.factor_with_own.values_mut().chunks_mut(width),
        }
    }
}

impl<'a> PooledRows<'a> {
    /// The next row, empty after the last.
    fn next(&mut self) -> PooledRow<'a> {
        PooledRow {
            variance: self.variance.next().unwrap_or_default(),
            factor: self.factor.next().unwrap_or_default(),
            factor_with_own: self.factor_with_own.next().unwrap_or_default(),
        }
    }
}

/// Columns that are pooled at once: a vector register of the baseline. Of two, the sums do not fit the registers.
const LANES: usize = 4;

/// Pools the neighbours of every pixel of a picture that is `width` wide, row-major. Each neighbour weighs the same whatever its
/// count, so that a region's variance is not that of its hardest pixels.
pub(super) fn pooled_by_neighbours(
    evidence: &[[PixelEvidence; CHANNELS]],
    guides: &[PixelGuide],
    width: usize,
) -> [Pooled; CHANNELS] {
    let height = evidence.len().checked_div(width).unwrap_or(0);
    let mut pooled: [Pooled; CHANNELS] = std::array::from_fn(|_| Pooled::new(width, height));
    if width == 0 {
        return pooled;
    }
    let facts = Facts::of(evidence, guides, width);
    let mut rows = pooled.each_mut().map(Pooled::rows);
    let rows: Vec<[PooledRow<'_>; CHANNELS]> = (0..height).map(|_| rows.each_mut().map(PooledRows::next)).collect();
    rows.into_par_iter().zip(evidence.par_chunks(width)).enumerate().for_each(|(y, (mut rows, evidence))| {
        for (chunk, evidence) in evidence.chunks(LANES).enumerate() {
            let column = chunk * LANES;
            let sums = Sums::of(&facts, y, column);
            for (lane, own) in evidence.iter().enumerate() {
                sums.write(lane, own, &mut rows, column + lane);
            }
        }
    });
    pooled
}

// Of a pixel's facts.
const NORMAL: usize = 0;
const ALBEDO: usize = 3;
const DEPTH: usize = 6;
/// 1 in the picture, 0 beyond.
const IS_THERE: usize = 7;
/// The first of each channel's three; see [`PixelEvidence`].
const EVIDENCE: usize = 8;
const VARIANCE: usize = 0;
const SQUARED_DIFFERENCE: usize = 1;
const EXPECTED_DIFFERENCE: usize = 2;
const FACTS: usize = EVIDENCE + 3 * CHANNELS;

/// What is known of each pixel: its first surface, and what it says about variance. A row holds one fact of all its pixels, then the
/// next. Around the picture lies a border, so that every pixel has a whole window of neighbours: these say nothing.
struct Facts {
    /// From a fact to the next in a row.
    stride: usize,
    values: Vec<f32>,
}

/// The facts of all neighbours of [`LANES`] pixels in one row.
type Window<'a> = [&'a [f32; LANES + 2 * POOL_RADIUS]; FACTS];

impl Facts {
    fn of(evidence: &[[PixelEvidence; CHANNELS]], guides: &[PixelGuide], width: usize) -> Self {
        let height = evidence.len() / width;
        let stride = width.next_multiple_of(LANES) + 2 * POOL_RADIUS;
        let mut values = vec![0.0; (height + 2 * POOL_RADIUS) * FACTS * stride];
        let rows = values.par_chunks_mut(FACTS * stride).skip(POOL_RADIUS);
        let pictured = guides.par_chunks(width).zip(evidence.par_chunks(width));
        rows.zip(pictured).for_each(|(row, (guides, evidence))| {
            let mut set = |fact: usize, of: &dyn Fn(usize) -> f32| {
                let values = &mut row[fact * stride + POOL_RADIUS..][..width];
                values.iter_mut().enumerate().for_each(|(x, value)| *value = of(x));
            };
            for axis in 0..3 {
                set(NORMAL + axis, &|x| guides[x].normal[axis]);
                set(ALBEDO + axis, &|x| guides[x].albedo[axis]);
            }
            set(DEPTH, &|x| guides[x].depth);
            set(IS_THERE, &|_| 1.0);
            let mut said = |fact: usize, of: fn(&PixelEvidence) -> f64| {
                let bounded = |x: usize, channel: usize| of(&evidence[x][channel]).min(MOST_EVIDENCE) as f32;
                (0..CHANNELS).for_each(|channel| set(EVIDENCE + 3 * channel + fact, &|x| bounded(x, channel)));
            };
            said(VARIANCE, |pixel| pixel.variance);
            said(SQUARED_DIFFERENCE, |pixel| pixel.squared_difference);
            said(EXPECTED_DIFFERENCE, |pixel| pixel.expected_difference);
        });
        Self { stride, values }
    }

    /// Row `row` of the window around the pixels that begin at `column` of row `y`.
    #[inline(always)]
    fn window(&self, y: usize, row: usize, column: usize) -> Window<'_> {
        const NOTHING: [f32; LANES + 2 * POOL_RADIUS] = [0.0; LANES + 2 * POOL_RADIUS];
        let begin = (y + row) * FACTS * self.stride + column;
        // Never out of bounds: the border is as wide as the window.
        std::array::from_fn(|fact| self.values[begin + fact * self.stride..].first_chunk().unwrap_or(&NOTHING))
    }
}

/// One fact of the neighbours that are `shift` columns into a window.
#[inline(always)]
fn fact(window: &Window<'_>, fact: usize, shift: usize) -> Vec4 {
    Vec4::from_slice(&window[fact][shift..])
}

/// The first surfaces of some pixels of a row.
struct Surfaces {
    normal: [Vec4; 3],
    albedo: [Vec4; 3],
    depth: Vec4,
}

impl Surfaces {
    #[inline(always)]
    fn of(window: &Window<'_>, shift: usize) -> Self {
        Self {
            normal: std::array::from_fn(|axis| fact(window, NORMAL + axis, shift)),
            albedo: std::array::from_fn(|band| fact(window, ALBEDO + band, shift)),
            depth: fact(window, DEPTH, shift),
        }
    }

    /// How alike surfaces are, in [0.02, 1]: never 0, so that a lone pixel still learns something.
    #[inline(always)]
    fn likeness(&self, other: &Self) -> Vec4 {
        let squared_distance = |a: &[Vec4; 3], b: &[Vec4; 3]| {
            let [dx, dy, dz] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
            dx * dx + dy * dy + dz * dz
        };
        // Half weight at: normals 25° apart, albedo 0.1 apart, depth 5 % apart.
        let depth = (self.depth - other.depth).abs() / (self.depth.max(other.depth) + f32::MIN_POSITIVE);
        let unlike =
            squared_distance(&self.normal, &other.normal) * 5.3 + squared_distance(&self.albedo, &other.albedo) * 100.0;
        (1.0 / (1.0 + (unlike + depth * depth * 400.0))).max(Vec4::splat(0.02))
    }
}

/// Weighted sums over the neighbours of some pixels of a row.
#[derive(Default)]
struct Sums {
    weight: Vec4,
    channels: [ChannelSums; CHANNELS],
}

#[derive(Default)]
struct ChannelSums {
    variance: Vec4,
    squared: Vec4,
    expected: Vec4,
    /// The largest expectation of a single neighbour, weighted.
    most_expected: Vec4,
}

impl Sums {
    /// Of the pixels that begin at `column` of row `y`.
    fn of(facts: &Facts, y: usize, column: usize) -> Self {
        let own = Surfaces::of(&facts.window(y, POOL_RADIUS, column), POOL_RADIUS);
        let mut sums = Self::default();
        for row in 0..=2 * POOL_RADIUS {
            let window = facts.window(y, row, column);
            for shift in 0..=2 * POOL_RADIUS {
                if (row, shift) != (POOL_RADIUS, POOL_RADIUS) {
                    sums.add(own.likeness(&Surfaces::of(&window, shift)), &window, shift);
                }
            }
        }
        sums
    }

    #[inline(always)]
    fn add(&mut self, weights: Vec4, window: &Window<'_>, shift: usize) {
        self.weight += weights * fact(window, IS_THERE, shift);
        for (channel, sums) in self.channels.iter_mut().enumerate() {
            let weighted = |what: usize| weights * fact(window, EVIDENCE + 3 * channel + what, shift);
            let expected = weighted(EXPECTED_DIFFERENCE);
            sums.variance += weighted(VARIANCE);
            sums.squared += weighted(SQUARED_DIFFERENCE);
            sums.expected += expected;
            sums.most_expected = sums.most_expected.max(expected);
        }
    }

    fn write(&self, lane: usize, own: &[PixelEvidence; CHANNELS], rows: &mut [PooledRow<'_>; CHANNELS], column: usize) {
        let weight = self.weight[lane];
        for ((sums, own), row) in self.channels.iter().zip(own).zip(rows) {
            // A pixel like none of its neighbours has only itself to go by.
            row.variance[column] = if weight > 0.0 { sums.variance[lane] / weight } else { own.variance as f32 };
            row.factor[column] = sums.factor(lane).clamp(FACTOR_RANGE.0, FACTOR_RANGE.1);
            row.factor_with_own[column] = match f64::from(sums.expected[lane]) + own.expected_difference {
                0.0 => 1.0,
                expected => ((f64::from(sums.squared[lane]) + own.squared_difference) / expected) as f32,
            };
        }
    }
}

impl ChannelSums {
    /// Squared differences over their expectation, drawn towards 1 by one observation as heavy as the heaviest: where a
    /// single pixel outweighs the others, its half difference may be small by luck.
    fn factor(&self, lane: usize) -> f32 {
        let most_expected = self.most_expected[lane];
        let expected = self.expected[lane] + most_expected;
        if expected > 0.0 { (self.squared[lane] + most_expected) / expected } else { 1.0 }
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
        for (channel, pooled) in pooled.iter().enumerate() {
            let planes = [&pooled.variance, &pooled.factor, &pooled.factor_with_own];
            assert!(planes.iter().all(|plane| plane.values().len() == evidence.len()));
            for pixel in 0..evidence.len() {
                let found = planes.map(|plane| plane.values()[pixel]);
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
        assert_eq!(pooled[1].variance.values(), [evidence[0][1].variance as f32]);
    }
}
