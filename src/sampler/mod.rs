//! Where samples come from: Owen-scrambled Sobol points that are pure functions of their key.
//!
//! A render asks for points by [`BlockKey`] and index, never by a running state, so that any thread, any machine and
//! any order of work make the same numbers. Each pixel takes its samples in blocks of a power of two; every block is a
//! scrambled (t, m, s)-net of its own, so a pixel that stops early loses nothing of the stratification of what it has.
//!
//! Not for: more than four jointly stratified dimensions. Groups of four are padded against each other (independent
//! shuffles), as Burley 2020 recommends for path tracing.

mod filter;
mod sobol;

pub use filter::{FilterDensity, FilterSample, PixelFilter};

use crate::geometry::{VectorWork, with_vectors};
use serde::{Deserialize, Serialize};
use std::array::from_fn;

/// How the samples of neighbouring pixels relate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sequence {
    /// Owen-scrambled Sobol points, every block of every pixel scrambled by itself: neighbours are independent.
    #[default]
    PerPixel,
    /// Owen-scrambled Sobol points, one sequence for the blocks of a level in 128 × 128 pixels (fewer where a block has
    /// more than 2¹⁸ samples), handed out along a shuffled Z-curve: blocks of neighbours together are well spread too,
    /// which moves the error to high frequencies (Ahmed and Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo
    /// Sampling Error via Hierarchical Ordering of Pixels", 2020).
    ZOrder,
    /// Independent random numbers: for tests that need variances to be what textbooks say.
    Independent,
}

impl Sequence {
    /// Name of the sequence, for people.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::PerPixel => "per pixel",
            Self::ZOrder => "z order",
            Self::Independent => "independent",
        }
    }
}

/// Which of the two independent estimates of a pixel a sample belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Half {
    /// The first estimate.
    A,
    /// The second estimate.
    B,
}

impl Half {
    /// Both halves, in merge order.
    pub const BOTH: [Half; 2] = [Half::A, Half::B];

    /// 0 or 1.
    pub const fn index(self) -> usize {
        match self {
            Half::A => 0,
            Half::B => 1,
        }
    }

    /// The half that decides this half's count.
    pub const fn other(self) -> Half {
        match self {
            Half::A => Half::B,
            Half::B => Half::A,
        }
    }
}

/// A pixel of the full picture; (0, 0) is the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixel {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
}

/// Names one block of samples: what its points depend on, besides index and dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockKey {
    /// Seed of the render.
    pub seed: u64,
    /// The pixel in the full picture.
    pub pixel: Pixel,
    /// Which half.
    pub half: Half,
    /// Which doubling: 0 is the pilot.
    pub level: u8,
    /// log₂ of the samples in the whole block, at most 30.
    pub log2_samples: u8,
    /// How neighbours relate.
    pub sequence: Sequence,
}

/// What a group of four dimensions is used for. Each use draws from its own independently shuffled group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Position in the pixel (x, y) and on the lens (z, w).
    Camera,
    /// Direction (x, y), lobe (z) and survival (w) at a bounce.
    Scatter {
        /// 0 at the first surface.
        bounce: u32,
    },
    /// Point on a light (x, y), which light (z), and whether faint light is asked for (w) at a bounce.
    Light {
        /// 0 at the first surface.
        bounce: u32,
    },
    /// When the shutter is open (x).
    Time,
}

impl Purpose {
    const fn group(self) -> u32 {
        match self {
            Purpose::Camera => 0,
            Purpose::Scatter { bounce } => 1 + 2 * bounce,
            Purpose::Light { bounce } => 2 + 2 * bounce,
            Purpose::Time => u32::MAX,
        }
    }
}

/// One sample of one pixel: every number it needs, by purpose.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    block_hash: u32,
    /// Bits of the index in the sequence, the lowest first.
    reversed_index: u32,
    is_independent: bool,
}

/// log₂ of the side of the squares of pixels that share a sequence in Z-order: 14 bits of an index, 18 for the samples.
const MAX_TILE_BITS: u32 = 7;

impl BlockKey {
    /// Names the samples, at most 16, of what is asked before a render. `stream`: a seed of its own, so that they
    /// are not those of pictures.
    pub fn of_probe(stream: u64, number: Pixel) -> Self {
        Self { seed: stream, pixel: number, half: Half::A, level: 0, log2_samples: 4, sequence: Sequence::PerPixel }
    }

    /// Hash of what the block's scrambling depends on.
    fn hash(self) -> u32 {
        let pixel = match self.sequence {
            Sequence::PerPixel | Sequence::Independent => self.pixel,
            Sequence::ZOrder => Pixel { x: self.pixel.x >> self.tile_bits(), y: self.pixel.y >> self.tile_bits() },
        };
        let mut h = sobol::mix64(self.seed ^ 0x9e37_79b9_7f4a_7c15);
        h = sobol::mix64(h ^ (u64::from(pixel.y) << 32 | u64::from(pixel.x)));
        h = sobol::mix64(h ^ (u64::from(self.level) << 1 | self.half.index() as u64));
        (h >> 32) as u32
    }

    /// Index of the block's first sample in its sequence. The shuffle of indices that follows is nested, so it also
    /// shuffles the Z-curve.
    fn first_index(self) -> u32 {
        match self.sequence {
            Sequence::PerPixel | Sequence::Independent => 0,
            Sequence::ZOrder => z_curve(self.pixel, self.tile_bits()) << self.log2_samples,
        }
    }

    /// log₂ of the side of the squares of pixels that share this block's sequence: smaller where its samples leave less
    /// room in an index, or pixels 64 apart would share the samples of a block of 2¹⁹.
    fn tile_bits(self) -> u32 {
        MAX_TILE_BITS.min((u32::BITS - u32::from(self.log2_samples)) / 2)
    }

    /// The sample with this index in the block.
    pub fn sample(self, index: u32) -> Sample {
        Sample {
            block_hash: self.hash(),
            reversed_index: (self.first_index() + index).reverse_bits(),
            is_independent: self.sequence == Sequence::Independent,
        }
    }

    /// All samples with indices below `count`; cheaper than asking one by one.
    pub fn samples(self, count: u32) -> impl Iterator<Item = Sample> {
        let (first, first_index) = (self.sample(0), self.first_index());
        (0..count).map(move |index| Sample { reversed_index: (first_index + index).reverse_bits(), ..first })
    }
}

/// Place of a pixel on the Z-curve through its tile.
fn z_curve(pixel: Pixel, tile_bits: u32) -> u32 {
    (0..tile_bits).fold(0, |z, bit| z | (pixel.x >> bit & 1) << (2 * bit) | (pixel.y >> bit & 1) << (2 * bit + 1))
}

impl Sample {
    /// Four numbers in [0, 1) for a purpose; the first two are stratified best together.
    #[inline]
    pub fn draw(self, purpose: Purpose) -> [f32; 4] {
        let group_hash = group_hash(self.block_hash, purpose);
        if self.is_independent {
            let key = u64::from(group_hash) << 32 | u64::from(self.reversed_index.reverse_bits());
            from_fn(|dimension| unit_of_hash(hash_words(key, dimension as u64)))
        } else {
            sobol::scrambled_points([self.reversed_index], [group_hash]).map(|[number]| number)
        }
    }

    /// [`Self::draw`] for several samples, eight at a time, into the first of at least as many `numbers`: of few or of
    /// many, a sample's numbers are the same.
    pub fn draw_each(samples: &[Self], purpose: Purpose, numbers: &mut [[f32; 4]]) {
        with_vectors(DrawEach { samples, purpose, numbers });
    }
}

/// Hash of what the scrambling of four dimensions of a block depends on.
#[inline(always)]
fn group_hash(block_hash: u32, purpose: Purpose) -> u32 {
    sobol::mix32(block_hash ^ sobol::mix32(purpose.group().wrapping_add(0x68bc_21eb)))
}

/// Samples that draw at once.
const LANES: usize = 8;

/// What [`Sample::draw_each`] does.
struct DrawEach<'a> {
    samples: &'a [Sample],
    purpose: Purpose,
    numbers: &'a mut [[f32; 4]],
}

impl VectorWork for DrawEach<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { samples, purpose, numbers } = self;
        for (samples, numbers) in samples.chunks(LANES).zip(numbers.chunks_mut(LANES)) {
            if samples.len() == 1 || samples.iter().any(|sample| sample.is_independent) {
                samples.iter().zip(numbers).for_each(|(sample, numbers)| *numbers = sample.draw(purpose));
                continue;
            }
            let (mut indices, mut hashes) = ([0; LANES], [0; LANES]);
            for ((index, hash), sample) in indices.iter_mut().zip(&mut hashes).zip(samples) {
                (*index, *hash) = (sample.reversed_index, sample.block_hash);
            }
            let points = sobol::scrambled_points(indices, hashes.map(|hash| group_hash(hash, purpose)));
            for (lane, numbers) in numbers.iter_mut().enumerate() {
                *numbers = points.map(|of_all| of_all[lane]);
            }
        }
    }
}

/// Mixes a word into a hash; for decisions that need a random number without a sample of their own.
pub(crate) fn hash_words(hash: u64, word: u64) -> u64 {
    sobol::mix64(hash.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ word)
}

/// Between two neighbours of the 2^24 numbers in [0, 1) that f32 has evenly spread.
const STEP_OF_24_BITS: f32 = 1.0 / 16_777_216.0;

/// Maps a hash to [0, 1) with the 24 bits that f32 holds.
#[inline(always)]
pub(crate) fn unit_of_hash(hash: u64) -> f32 {
    (hash >> 40) as f32 * STEP_OF_24_BITS
}

/// Maps a hash to [0, 1) with the 53 bits that f64 holds.
pub(crate) fn unit_f64_of_hash(hash: u64) -> f64 {
    (hash >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(level: u8, pixel: u32) -> BlockKey {
        let pixel = Pixel { x: pixel % 100, y: pixel / 100 };
        BlockKey { seed: 7, pixel, half: Half::A, level, log2_samples: level, sequence: Sequence::PerPixel }
    }

    /// A block of 2^m points puts exactly one point in each of the 2^m elementary intervals of every shape, for the
    /// first two dimensions, which form a (0, m, 2)-net in every group.
    #[test]
    fn the_first_two_dimensions_of_a_block_are_a_zero_net() {
        for purpose in [Purpose::Camera, Purpose::Scatter { bounce: 3 }, Purpose::Light { bounce: 0 }] {
            for m in [3u32, 6, 10] {
                let points: Vec<_> = block(m as u8, 99).samples(1 << m).map(|s| s.draw(purpose)).collect();
                for split in 0..=m {
                    let (columns, rows) = (1usize << split, 1usize << (m - split));
                    let mut counts = vec![0u32; columns * rows];
                    for p in &points {
                        let cell = (p[1] * rows as f32) as usize * columns + (p[0] * columns as f32) as usize;
                        counts[cell] += 1;
                    }
                    assert!(counts.iter().all(|&c| c == 1), "{purpose:?}, 2^{m} points, {columns} columns");
                }
            }
        }
    }

    #[test]
    fn every_dimension_is_stratified_alone() {
        let m = 8u32;
        for d in 0..4 {
            let mut seen = vec![false; 1 << m];
            for s in block(4, 3).samples(1 << m) {
                let cell = (s.draw(Purpose::Scatter { bounce: 1 })[d] * (1 << m) as f32) as usize;
                assert!(!seen[cell], "dimension {d}: two points in stratum {cell}");
                seen[cell] = true;
            }
        }
    }

    /// Different pixels, halves, levels and seeds must not share points: correlation of the first coordinate over 4096
    /// keys is below 5 standard deviations of independent numbers.
    #[test]
    fn keys_are_independent() {
        let first = |key: BlockKey| f64::from(key.sample(0).draw(Purpose::Camera)[0]) - 0.5;
        let n = 4096u32;
        type Change = fn(BlockKey) -> BlockKey;
        let changes: [(&str, Change); 4] = [
            ("pixel", |k| BlockKey { pixel: Pixel { x: k.pixel.x + 1, ..k.pixel }, ..k }),
            ("half", |k| BlockKey { half: k.half.other(), ..k }),
            ("level", |k| BlockKey { level: k.level + 1, ..k }),
            ("seed", |k| BlockKey { seed: k.seed + 1, ..k }),
        ];
        for (name, change) in changes {
            let correlation: f64 =
                (0..n).map(|i| first(block(0, i)) * first(change(block(0, i)))).sum::<f64>() * 12.0 / f64::from(n);
            assert!(correlation.abs() < 5.0 / f64::from(n).sqrt(), "{name}: correlation {correlation}");
        }
    }

    #[test]
    fn numbers_stay_below_one() {
        for s in block(0, 12345).samples(1 << 14) {
            for x in s.draw(Purpose::Light { bounce: 7 }) {
                assert!((0.0..1.0).contains(&x), "{x}");
            }
        }
    }

    /// Of few and of many samples, of one block and of several.
    #[test]
    fn many_samples_draw_what_each_draws() {
        for sequence in [Sequence::PerPixel, Sequence::ZOrder, Sequence::Independent] {
            let key = |pixel| BlockKey { sequence, ..block(3, pixel) };
            let samples: Vec<Sample> = (0..5).flat_map(|pixel| key(pixel).samples(5)).collect();
            for purpose in [Purpose::Camera, Purpose::Light { bounce: 2 }, Purpose::Time] {
                for count in 0..=samples.len() {
                    let mut numbers = vec![[f32::NAN; 4]; count + 3];
                    Sample::draw_each(&samples[..count], purpose, &mut numbers);
                    let alone: Vec<_> = samples[..count].iter().map(|sample| sample.draw(purpose)).collect();
                    assert_eq!(numbers[..count], alone, "{sequence:?}, {purpose:?}");
                }
            }
        }
    }

    /// In Z-order the blocks of 2×2 and of 8×8 pixels are together one net, in every group.
    #[test]
    fn neighbours_in_z_order_form_one_net() {
        for (side, m) in [(2u32, 4u32), (8, 2)] {
            let key = |i: u32| BlockKey {
                pixel: Pixel { x: 128 + 8 + i % side, y: 16 + i / side },
                log2_samples: m as u8,
                sequence: Sequence::ZOrder,
                ..block(0, 0)
            };
            let points: Vec<[f32; 4]> = (0..side * side)
                .flat_map(|i| key(i).samples(1 << m).map(|s| s.draw(Purpose::Scatter { bounce: 2 })))
                .collect();
            let bits = points.len().ilog2();
            for split in 0..=bits {
                let (columns, rows) = (1usize << split, 1usize << (bits - split));
                let mut counts = vec![0u32; columns * rows];
                for p in &points {
                    counts[(p[1] * rows as f32) as usize * columns + (p[0] * columns as f32) as usize] += 1;
                }
                assert!(counts.iter().all(|&c| c == 1), "{side}² pixels, {columns} columns");
            }
        }
    }

    /// In blocks so large that fewer pixels' samples have room in one sequence, no two pixels share any.
    #[test]
    fn large_blocks_in_z_order_share_no_samples() {
        for log2_samples in [18, 19, 23, 30] {
            let key = |x: u32, y: u32| BlockKey {
                pixel: Pixel { x, y },
                log2_samples,
                sequence: Sequence::ZOrder,
                ..block(20, 0)
            };
            let last = (1 << log2_samples) - 1;
            let mut seen = std::collections::BTreeSet::new();
            for (x, y) in (0..128).flat_map(|y| (0..128).map(move |x| (x, y))) {
                let [first, last] = [0, last].map(|index| key(x, y).sample(index));
                assert_eq!(first.block_hash, last.block_hash);
                let new = seen.insert((first.block_hash, first.reversed_index))
                    & seen.insert((last.block_hash, last.reversed_index));
                assert!(new, "2^{log2_samples} samples of ({x}, {y}) are another pixel's");
            }
        }
    }

    /// Independent numbers are uniform (χ² over 16 cells of each dimension, 60 degrees of freedom in all, below the
    /// 99.9 % quantile 99.6) and not stratified.
    #[test]
    fn independent_numbers_are_independent() {
        let key = BlockKey { sequence: Sequence::Independent, ..block(12, 5) };
        let mut counts = [[0u32; 16]; 4];
        for sample in key.samples(4096) {
            for (d, x) in sample.draw(Purpose::Camera).into_iter().enumerate() {
                counts[d][(x * 16.0) as usize] += 1;
            }
        }
        let statistic: f64 = counts.iter().flatten().map(|&c| (f64::from(c) - 256.0).powi(2) / 256.0).sum();
        assert!((20.0..99.6).contains(&statistic), "{statistic}");
    }
}
