//! Units: what is to be sampled, and its sums. Executed here, never decided.

use super::folder::Farm;
use crate::adaptive::beginning;
use crate::adaptive::state::can_be_seconds;
use crate::film::BlockSum;
use crate::integrator::{BlockWork, PathTracer};
use crate::output::OutputError;
use crate::scene::hash::ContentHash;
use crate::sealed::{Kind, SealedError};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

static ORDER: Kind = Kind {
    magic: *b"fechorder\r\n\x1a",
    version: 1,
    what: "a unit's order, such as fechner farm plan and merge write",
    remedy: "fechner farm merge writes it again",
};
static SUMS: Kind = Kind {
    magic: *b"fech sums\r\n\x1a",
    version: 2,
    what: "a unit's sums, such as fechner farm unit writes",
    remedy: "the unit is rendered again",
};

/// What a unit is to sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// Hash of the farm's manifest.
    pub farm: ContentHash,
    /// The unit's number.
    pub unit: u64,
    /// Number of its frame.
    pub frame: u32,
    /// Seed of its samples.
    pub seed: u64,
    /// What to sample, in order.
    pub blocks: Vec<BlockWork>,
}

impl Order {
    /// Samples of all its blocks.
    pub fn samples(&self) -> u64 {
        self.blocks.iter().map(|block| u64::from(block.samples)).sum()
    }
}

/// An order with the hash of its file, by which its sums are known.
#[derive(Clone, Debug)]
pub struct NamedOrder {
    /// What to sample.
    pub order: Order,
    /// Hash of the file.
    pub name: ContentHash,
}

/// What a unit sampled: all blocks of its order, or the first of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitSums {
    /// Hash of the order that these sums are of.
    pub order: ContentHash,
    /// Time that it took.
    pub seconds: f64,
    /// One for each block.
    pub sums: Vec<BlockSum>,
}

/// Why a unit's file could not be used.
#[derive(Debug, thiserror::Error)]
pub enum UnitError {
    /// The file is not whole.
    #[error(transparent)]
    Sealed(#[from] SealedError),
    /// Sound, but of another unit.
    #[error("{} does not fit: {problem}", .path.display())]
    Different {
        /// The file.
        path: PathBuf,
        /// What differs.
        problem: &'static str,
    },
}

impl UnitError {
    /// Whether it is only that there is no such file.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Sealed(SealedError::Io { error, .. }) if error.kind() == std::io::ErrorKind::NotFound)
    }
}

/// What to do between two batches of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// The next one.
    GoOn,
    /// Write what is there, then the next one.
    Keep,
    /// Write what is there, and end.
    Leave,
}

/// How a unit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Its sums are there.
    Finished,
    /// Its checkpoint is there.
    Left,
}

impl NamedOrder {
    /// Gives an order the name that its file has.
    pub fn new(order: Order) -> (Self, Vec<u8>) {
        let payload = postcard::to_stdvec(&order).expect("numbers alone, in memory");
        let file = ORDER.seal(&payload);
        (Self { order, name: ContentHash::of_bytes(&file) }, file)
    }

    /// Reads the order of a unit of this farm.
    ///
    /// # Errors
    /// If it is not whole or not this unit's.
    pub fn read(farm: &Farm, unit: u64) -> Result<Self, UnitError> {
        let path = farm.unit_file(unit, "order");
        let file = ORDER.read(&path)?;
        let order: Order = ORDER.decode(&path, &file)?;
        let entry = farm.frame(farm.place(unit).frame_index);
        if (order.farm, order.unit, order.frame, order.seed) != (farm.id(), unit, entry.frame, entry.seed) {
            return Err(UnitError::Different { path, problem: "it is the order of another unit or farm" });
        }
        let pixels = entry.origin.pixels();
        let is_sound = |block: &BlockWork| pixels.is_some_and(|pixels| block.is_sound(pixels));
        if !order.blocks.iter().all(is_sound) {
            return Err(ORDER.damaged(&path, "its blocks make no sense").into());
        }
        Ok(Self { order, name: ContentHash::of_bytes(&file) })
    }
}

impl UnitSums {
    /// Reads the result of a unit.
    ///
    /// # Errors
    /// If it is not whole or not of this order.
    pub fn read(path: &Path, order: &NamedOrder) -> Result<Self, UnitError> {
        let sums = Self::read_beginning(path, order)?;
        if sums.sums.len() < order.order.blocks.len() {
            return Err(UnitError::Different { path: path.to_owned(), problem: "it holds a part of the unit" });
        }
        Ok(sums)
    }

    /// Reads what a unit that was left had sampled so far.
    ///
    /// # Errors
    /// If it is not whole or not of this order.
    pub fn read_beginning(path: &Path, order: &NamedOrder) -> Result<Self, UnitError> {
        let sums: Self = SUMS.decode(path, &SUMS.read(path)?)?;
        if sums.order != order.name {
            return Err(UnitError::Different { path: path.to_owned(), problem: "it is of another unit or farm" });
        }
        let blocks = &order.order.blocks;
        let are_sound = sums.sums.iter().zip(blocks).all(|(sum, block)| sum.is_of(block.samples));
        if sums.sums.len() > blocks.len() || !are_sound || !can_be_seconds(sums.seconds) {
            return Err(SUMS.damaged(path, "its figures make no sense").into());
        }
        Ok(sums)
    }
}

/// How work is kept safe.
#[derive(Clone, Copy)]
pub struct Keeping<'a> {
    /// Time between two checkpoints.
    pub every: Duration,
    /// Asked between two batches.
    pub wish: &'a dyn Fn() -> Wish,
}

impl Keeping<'_> {
    /// Decides between two batches: writes what is there where that is wished, or where it is time to. A checkpoint
    /// that cannot be written is no reason to lose the work, unless it ends with it.
    ///
    /// # Errors
    /// If the checkpoint that was asked for at the end cannot be written.
    pub(super) fn after_batch<T>(
        &self,
        last_kept: &mut Instant,
        write: impl FnOnce() -> Result<T, OutputError>,
    ) -> Result<ControlFlow<Outcome>, OutputError> {
        match (self.wish)() {
            Wish::Leave => {
                write()?;
                return Ok(ControlFlow::Break(Outcome::Left));
            }
            Wish::GoOn if last_kept.elapsed() < self.every => {}
            Wish::GoOn | Wish::Keep => {
                if let Err(error) = write() {
                    crate::say!("note: {error}; rendering goes on");
                }
                *last_kept = Instant::now();
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}

/// Samples between two wishes: half a second in a simple scene. Schedulers kill 30 seconds after they asked.
pub(super) fn most_samples_a_batch() -> u64 {
    const MAX_SAMPLES_PER_THREAD: u64 = 1 << 17;
    MAX_SAMPLES_PER_THREAD * rayon::current_num_threads() as u64
}

/// Samples what an order asks for after `begun`, and writes the sums: a checkpoint every so often and where it is
/// wished, the result at the end.
///
/// # Errors
/// If the result, or the checkpoint that was asked for at the end, cannot be written.
pub fn render_unit(
    farm: &Farm,
    order: &NamedOrder,
    begun: Option<UnitSums>,
    tracer: &PathTracer,
    keeping: &Keeping<'_>,
) -> Result<Outcome, OutputError> {
    let started = Instant::now();
    let partial = farm.unit_file(order.order.unit, "partial");
    let mut sums = begun.unwrap_or_else(|| UnitSums { order: order.name, seconds: 0.0, sums: Vec::new() });
    let seconds_before = sums.seconds;
    let mut last_kept = started;
    while let rest @ [_, ..] = &order.order.blocks[sums.sums.len()..] {
        let batch = beginning(rest, most_samples_a_batch());
        tracer.sum_batch(batch, &mut sums.sums, &|_| {});
        sums.seconds = seconds_before + started.elapsed().as_secs_f64();
        if sums.sums.len() == order.order.blocks.len() {
            break;
        }
        if let ControlFlow::Break(outcome) = keeping.after_batch(&mut last_kept, || SUMS.write(&partial, &sums))? {
            return Ok(outcome);
        }
    }
    SUMS.write(&farm.unit_file(order.order.unit, "sums"), &sums)?;
    // Nobody needs it any more; left behind it does no harm.
    std::fs::remove_file(&partial).ok();
    Ok(Outcome::Finished)
}
