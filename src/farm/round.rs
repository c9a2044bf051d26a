//! Rounds: a frame's plan cut into units, written down, found again and cleared away.

use super::folder::{Farm, UnitPlace};
use super::unit::{NamedOrder, Order};
use crate::adaptive::state::RenderState;
use crate::integrator::BlockWork;
use crate::json_file;
use crate::output::{OutputError, write_beside};
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::ops::Range;

/// A round's units, for people, status and schedulers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoundRecord {
    /// Number of the frame.
    pub frame: u32,
    /// Number of the round: how many plans of the frame were traced before it. It rises from round to round, by more
    /// than 1 where others were traced by the merge.
    pub round: u32,
    /// Samples of all units.
    pub samples: u64,
    /// Units in the order in which they are merged.
    pub units: Vec<UnitRecord>,
}

/// A unit in a round.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitRecord {
    /// Number of the unit.
    pub unit: u64,
    /// Seed of its samples.
    pub seed: u64,
    /// First of its blocks in the round's plan.
    pub first_block: usize,
    /// How many.
    pub blocks: usize,
    /// Samples of these.
    pub samples: u64,
}

/// Cuts blocks into as many ranges of about equal samples as give each at least `unit_samples`, at most `passes`; fewer
/// where single blocks are larger than that, none at all if there are fewer samples.
pub fn cut(blocks: &[BlockWork], passes: u32, unit_samples: u64) -> Vec<Range<usize>> {
    let total: u64 = blocks.iter().map(|block| u64::from(block.samples)).sum();
    if total < unit_samples.max(1) {
        return Vec::new();
    }
    let parts = (total / unit_samples.max(1)).min(u64::from(passes)).min(blocks.len() as u64).max(1);
    let mut ranges = Vec::new();
    let (mut start, mut traced) = (0, 0u64);
    for (i, block) in blocks.iter().enumerate() {
        traced += u64::from(block.samples);
        let ended = u128::from(traced) * u128::from(parts) / u128::from(total);
        if ended as usize > ranges.len() {
            ranges.push(start..i + 1);
            start = i + 1;
        }
    }
    ranges
}

/// The orders of the round that a state has planned, with their files' bytes.
pub fn orders(farm: &Farm, frame_index: usize, state: &RenderState) -> impl Iterator<Item = (NamedOrder, Vec<u8>)> {
    let blocks: Vec<BlockWork> = state.untraced_blocks().copied().collect();
    let manifest = farm.manifest();
    let round = state.plans;
    let ranges = cut(&blocks, manifest.passes, manifest.unit_samples);
    let entry = farm.frame(frame_index);
    ranges.into_iter().enumerate().map(move |(part, range)| {
        let unit = farm.number(UnitPlace { round, frame_index, part: part as u32 });
        let blocks = blocks[range].to_vec();
        NamedOrder::new(Order { farm: farm.id(), unit, frame: entry.frame, seed: entry.seed, blocks })
    })
}

/// Writes the orders of the round that a state has planned, those that are not there already, then its record.
///
/// # Errors
/// If something cannot be written.
pub fn hand_out(farm: &Farm, frame_index: usize, state: &RenderState) -> Result<RoundRecord, OutputError> {
    let folder = farm.round_folder(frame_index, state.plans);
    std::fs::create_dir_all(&folder).map_err(|error| OutputError::Io { path: folder.clone(), error })?;
    let mut units = Vec::new();
    let mut first_block = 0;
    for (NamedOrder { order, .. }, file) in orders(farm, frame_index, state) {
        let path = farm.unit_file(order.unit, "order");
        if std::fs::read(&path).ok().as_ref() != Some(&file) {
            write_beside(&path, |to| to.write_all(&file))?;
        }
        units.push(UnitRecord {
            unit: order.unit,
            seed: order.seed,
            first_block,
            blocks: order.blocks.len(),
            samples: order.samples(),
        });
        first_block += order.blocks.len();
    }
    let record = RoundRecord {
        frame: farm.frame(frame_index).frame,
        round: state.plans,
        samples: units.iter().map(|unit| unit.samples).sum(),
        units,
    };
    json_file::write(&folder.join(RECORD), &record)?;
    Ok(record)
}

const RECORD: &str = "round.json";

/// The record of a frame's open round: the last that was handed out. `None` if there is none that can be read.
pub fn open_round(farm: &Farm, frame_index: usize) -> Option<RoundRecord> {
    last_record(|| rounds(farm, frame_index), |round| record(farm, frame_index, round))
}

/// The last record of those that are listed. A merge may clear a round away between list and record: then the list is
/// another.
fn last_record<T>(mut list: impl FnMut() -> Vec<u32>, read: impl Fn(u32) -> Option<T>) -> Option<T> {
    let mut listed = list();
    loop {
        if let Some(record) = listed.iter().rev().find_map(|&round| read(round)) {
            return Some(record);
        }
        let now = list();
        if now == listed {
            return None;
        }
        listed = now;
    }
}

fn record(farm: &Farm, frame_index: usize, round: u32) -> Option<RoundRecord> {
    let record: RoundRecord = json_file::read(&farm.round_folder(frame_index, round).join(RECORD))?;
    let is_own = |unit: &UnitRecord| {
        let place = farm.place(unit.unit);
        (place.round, place.frame_index) == (round, frame_index)
    };
    record.units.iter().all(is_own).then_some(record)
}

/// Rounds that have a folder, ascending.
fn rounds(farm: &Farm, frame_index: usize) -> Vec<u32> {
    let Ok(entries) = farm.frame_folder(frame_index).read_dir() else { return Vec::new() };
    let round = |name: &str| name.strip_prefix("round-").and_then(|number| number.parse().ok());
    let mut rounds: Vec<u32> =
        entries.filter_map(|entry| round(entry.ok()?.file_name().to_str().unwrap_or_default())).collect();
    rounds.sort_unstable();
    rounds
}

/// Removes the folders of rounds before `round`; what cannot be removed stays and does no harm.
pub(super) fn clear_before(farm: &Farm, frame_index: usize, round: u32) {
    clear(farm, frame_index, |found| found < round);
}

/// Removes the folders of rounds after `round`: those of a film that was lost.
pub(super) fn clear_after(farm: &Farm, frame_index: usize, round: u32) {
    clear(farm, frame_index, |found| found > round);
}

fn clear(farm: &Farm, frame_index: usize, is_over: impl Fn(u32) -> bool) {
    for round in rounds(farm, frame_index).into_iter().filter(|&round| is_over(round)) {
        std::fs::remove_dir_all(farm.round_folder(frame_index, round)).ok();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::plan::pilot_plan;
    use crate::film::Film;

    /// Every block is in one unit, in order, and units are about equal.
    #[test]
    fn cuts_hold_everything_and_are_even() {
        let mut blocks = pilot_plan(&Film::new(10, 10), 16).blocks;
        for (i, block) in blocks.iter_mut().enumerate() {
            block.samples = 1 + (i as u32 * 37) % 64;
        }
        let samples = |range: &Range<usize>| blocks[range.clone()].iter().map(|b| u64::from(b.samples)).sum::<u64>();
        let total = samples(&(0..blocks.len()));
        for (passes, unit_samples, expected) in
            [(7, 0, 7), (7, total / 3, 3), (7, total, 1), (7, total + 1, 0), (1, 1, 1)]
        {
            let ranges = cut(&blocks, passes, unit_samples);
            assert_eq!(ranges.len(), expected);
            if expected == 0 {
                continue;
            }
            assert_eq!((ranges[0].start, ranges[expected - 1].end), (0, blocks.len()));
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            let mean = total / expected as u64;
            assert!(ranges.iter().all(|range| samples(range).abs_diff(mean) <= 64));
        }
        // 1, 38 and 11 samples: a large block may take the place of two parts.
        assert_eq!(cut(&blocks[..3], 100, 0), [0..2, 2..3]);
        assert!(cut(&[], 4, 0).is_empty());
    }

    /// Cleared away after it was listed, a round is over, and the one after it is found.
    #[test]
    fn a_round_that_vanishes_is_not_the_last() {
        let lists = std::cell::RefCell::new(vec![vec![4], vec![1]]);
        let list = || {
            let mut lists = lists.borrow_mut();
            if lists.len() > 1 { lists.pop().expect("a list") } else { lists[0].clone() }
        };
        assert_eq!(last_record(list, |round| (round == 4).then_some(round)), Some(4));
        assert_eq!(last_record(|| vec![1, 2], |_| None::<u32>), None);
    }
}
