//! How many samples make a batch, so that neither a frame that is due nor a viewer's wish waits for longer than one sees.

use std::time::{Duration, Instant};

const BATCH: Duration = Duration::from_millis(25);
const FEWEST: u64 = 1 << 12;
const MOST: u64 = 1 << 20;

pub(in crate::preview) struct Pace {
    samples: u64,
    in_batch: u64,
    begun: Instant,
}

impl Pace {
    pub(in crate::preview) fn new() -> Self {
        Self { samples: FEWEST, in_batch: 0, begun: Instant::now() }
    }

    /// Samples of the next batch.
    pub(in crate::preview) fn samples(&self) -> u64 {
        self.samples
    }

    /// A batch begins.
    pub(in crate::preview) fn begin(&mut self) {
        self.in_batch = 0;
        self.begun = Instant::now();
    }

    /// Samples of the batch, as they are done.
    pub(in crate::preview) fn count(&mut self, samples: u64) {
        self.in_batch += samples;
    }

    /// The batch that was counted is done.
    pub(in crate::preview) fn counted(&mut self) {
        self.done(self.in_batch);
    }

    /// A batch of so many samples is done: the next follows the rate, at most four times as large.
    pub(in crate::preview) fn done(&mut self, samples: u64) {
        let rate = samples as f64 / self.begun.elapsed().as_secs_f64().max(1e-6);
        let next = (rate * BATCH.as_secs_f64()) as u64;
        self.samples = next.clamp(FEWEST, (4 * self.samples).min(MOST));
    }
}
