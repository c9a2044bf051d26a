//! How plans are made of blocks: what doubles a pixel, in which slices it is traced, and what fits a budget. Which
//! pixels are to have samples is decided elsewhere.

use crate::film::Film;
use crate::integrator::{BlockWork, SamplePlan};
use crate::sampler::{Half, hash_words};
use std::cmp::Reverse;

/// The blocks that take a half of a pixel from so many samples to so many.
pub(in crate::adaptive) fn blocks_between(
    pixel: u32,
    half: Half,
    mut from: u32,
    to: u32,
) -> impl Iterator<Item = BlockWork> {
    std::iter::from_fn(move || {
        let rest = (from < to).then(|| BlockWork::rest(pixel, half, from))?;
        let block = BlockWork { samples: rest.samples.min(to - from), ..rest };
        from += block.samples;
        Some(block)
    })
}

/// A half's part of a pixel's samples: the first has the odd one.
pub(in crate::adaptive) fn share_of_half(samples: u32, half: Half) -> u32 {
    match half {
        Half::A => samples.div_ceil(2),
        Half::B => samples / 2,
    }
}

/// The blocks that double a half of a pixel again and again, the last of them up to its share of `max_samples`.
pub(in crate::adaptive) fn doubled_blocks(
    pixel: u32,
    half: Half,
    mut taken: u32,
    max_samples: u32,
) -> impl Iterator<Item = BlockWork> {
    std::iter::from_fn(move || {
        let rest = BlockWork::rest(pixel, half, taken);
        // A pilot may have been a part of the first block.
        let samples = rest.samples.min(taken.max(1)).min(share_of_half(max_samples, half).saturating_sub(taken));
        taken += samples;
        (samples > 0).then_some(BlockWork { samples, ..rest })
    })
}

/// Cuts a plan into up to 16 that each hold one pixel of every 4×4 block (or of every quad, for 4), so that a limit of
/// time can end between them and still leave an even picture. A slice is at most about an eighth of what was traced
/// before: how much depends on counts alone, never on a clock.
pub fn slices(plan: SamplePlan, width: u32, traced_samples: u64) -> Vec<SamplePlan> {
    /// Order in which the pixels of a 4×4 block are visited: neighbours far apart in time (Bayer 1973).
    const BAYER: [[usize; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];
    let count = slice_count(plan.samples(), traced_samples);
    if count == 1 {
        return vec![plan];
    }
    let mut slices = vec![SamplePlan::default(); count];
    for block in plan.blocks {
        let (x, y) = (block.pixel % width, block.pixel / width);
        let place = BAYER[y as usize % 4][x as usize % 4];
        slices[place * count / 16].blocks.push(block);
    }
    slices.retain(|s| !s.blocks.is_empty());
    slices
}

/// How many [`slices`] a plan of so many samples is cut into, where no slice is empty.
pub(in crate::adaptive) fn slice_count(samples: u64, traced_samples: u64) -> usize {
    let eighths = samples / (traced_samples / 8).max(1);
    match eighths {
        0..=1 => 1,
        2..=4 => 4,
        _ => 16,
    }
}

/// Cuts a plan to a budget: the blocks with the largest `urgency` first.
pub fn cut_to_budget(plan: SamplePlan, urgency: impl Fn(&BlockWork) -> f32, samples: u64) -> SamplePlan {
    if plan.samples() <= samples {
        return plan;
    }
    let mut blocks = plan.blocks;
    // A block of a later level must not come without the one before it. Mostly plans are in order already.
    blocks.sort_by_key(|b| (b.pixel, b.half, b.level));
    let turn = |(place, block): (u32, &BlockWork)| Turn {
        urgency: Reverse(rank(urgency(block))),
        pixel: block.pixel,
        level: block.level,
        place,
    };
    let mut turns: Vec<Turn> = (0..).zip(&blocks).map(turn).collect();
    turns.sort_unstable();
    let mut left = samples;
    let mut fits = vec![false; blocks.len()];
    for place in turns.into_iter().map(|turn| turn.place as usize) {
        let cost = u64::from(blocks[place].samples);
        if cost <= left && (is_first_of_half(&blocks, place) || fits[place - 1]) {
            left -= cost;
            fits[place] = true;
        }
    }
    let kept = blocks.into_iter().zip(fits).filter(|(_, fits)| *fits);
    SamplePlan { blocks: kept.map(|(block, _)| block).collect() }
}

/// An urgency for [`cut_to_budget`] where nothing says who should have the last samples: chance does. By the order of
/// the pixels the top of the picture would have them all.
pub(in crate::adaptive) fn by_chance(film: &Film) -> impl Fn(&BlockWork) -> f32 {
    let taken = film.total_samples();
    move |block| (hash_words(taken, block.pixel.into()) >> 40) as f32
}

/// When a block's turn comes: the most urgent first.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Turn {
    urgency: Reverse<u32>,
    pixel: u32,
    level: u8,
    /// In the plan.
    place: u32,
}

/// A number that orders as `value` does in [`f32::total_cmp`].
fn rank(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

/// Whether no other block of the same pixel and half stands before this one.
fn is_first_of_half(blocks: &[BlockWork], place: usize) -> bool {
    let of_half = |block: &BlockWork| (block.pixel, block.half);
    place == 0 || of_half(&blocks[place - 1]) != of_half(&blocks[place])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_share_any_number_of_samples() {
        for (samples, shares) in [(0, [0, 0]), (1, [1, 0]), (7, [4, 3]), (u32::MAX, [1 << 31, (1 << 31) - 1])] {
            assert_eq!(Half::BOTH.map(|half| share_of_half(samples, half)), shares);
        }
    }
}
