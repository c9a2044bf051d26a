//! Where samples come from: Owen-scrambled Sobol points that are pure functions of their key.
//!
//! A render asks for points by [`BlockKey`] and index, never by a running state, so that any thread, any machine and any
//! order of work make the same numbers. Each pixel takes its samples in blocks of a power of two; every block is a
//! scrambled (t, m, s)-net of its own, so a pixel that stops early loses nothing of the stratification of what it has.
//!
//! Not for: more than four jointly stratified dimensions. Groups of four are padded against each other (independent
//! shuffles), as Burley 2020 recommends for path tracing.

mod filter;
mod sobol;

pub use filter::PixelFilter;

use serde::{Deserialize, Serialize};

/// Which of the two independent estimates of a pixel a sample belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Half {
    /// The first estimate.
    A,
    /// The second estimate.
    B,
}

impl Half {
    /// Both, in merge order.
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

/// Names one block of samples: what its points depend on, besides index and dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockKey {
    /// Seed of the render.
    pub seed: u64,
    /// Row-major index of the pixel in the full picture.
    pub pixel: u32,
    /// Which half.
    pub half: Half,
    /// Which doubling: 0 is the pilot.
    pub level: u8,
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
    /// Point on a light (x, y) and which light (z) at a bounce.
    Light {
        /// 0 at the first surface.
        bounce: u32,
    },
}

impl Purpose {
    const fn group(self) -> u32 {
        match self {
            Purpose::Camera => 0,
            Purpose::Scatter { bounce } => 1 + 2 * bounce,
            Purpose::Light { bounce } => 2 + 2 * bounce,
        }
    }
}

/// One sample of one pixel: every number it needs, by purpose.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    block_hash: u32,
    index: u32,
}

impl BlockKey {
    /// Hash of the whole key.
    fn hash(self) -> u32 {
        let mut h = sobol::mix64(self.seed ^ 0x9e37_79b9_7f4a_7c15);
        h = sobol::mix64(h ^ u64::from(self.pixel));
        h = sobol::mix64(h ^ (u64::from(self.level) << 1 | self.half.index() as u64));
        (h >> 32) as u32
    }

    /// The sample with this index in the block.
    pub fn sample(self, index: u32) -> Sample {
        Sample { block_hash: self.hash(), index }
    }

    /// All samples with indices below `count`; cheaper than asking one by one.
    pub fn samples(self, count: u32) -> impl Iterator<Item = Sample> {
        let block_hash = self.hash();
        (0..count).map(move |index| Sample { block_hash, index })
    }
}

impl Sample {
    /// Four numbers in [0, 1) for a purpose; the first two are stratified best together.
    pub fn draw(self, purpose: Purpose) -> [f32; 4] {
        let group_hash = sobol::mix32(self.block_hash ^ sobol::mix32(purpose.group().wrapping_add(0x68bc_21eb)));
        sobol::owen_scrambled_4d(self.index, group_hash)
    }
}

/// Mixes a word into a hash; for decisions that need a random number without a sample of their own.
pub(crate) fn hash_words(hash: u64, word: u64) -> u64 {
    sobol::mix64(hash.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ word)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(level: u8, pixel: u32) -> BlockKey {
        BlockKey { seed: 7, pixel, half: Half::A, level }
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
            ("pixel", |k| BlockKey { pixel: k.pixel + 1, ..k }),
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
}
