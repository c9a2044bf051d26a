//! How many samples make a batch, so that neither a frame that is due nor a viewer's wish waits for longer than one
//! sees.

use std::time::{Duration, Instant};

/// Lengths of a batch: long ones waste less at their ends, and a viewer's wish waits for them.
const LENGTHS: [Duration; 2] = [Duration::from_millis(25), Duration::from_millis(60)];
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

    /// The batch that was counted is done: the next follows its rate, at most four times as large, and is over within
    /// half the time between two frames, if there are any.
    pub(in crate::preview) fn counted(&mut self, between_frames: Option<Duration>) {
        let rate = self.in_batch as f64 / self.begun.elapsed().as_secs_f64().max(1e-6);
        let next = (rate * length(between_frames).as_secs_f64()) as u64;
        self.samples = next.clamp(FEWEST, (4 * self.samples).min(MOST));
    }
}

fn length(between_frames: Option<Duration>) -> Duration {
    let [least, most] = LENGTHS;
    between_frames.map_or(most, |between_frames| (between_frames / 2).clamp(least, most))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As short as the screen can use, and longer where frames are seldom or nobody looks.
    #[test]
    fn batches_are_as_long_as_nobody_minds() {
        let ms = |between_frames: Option<u64>| length(between_frames.map(Duration::from_millis)).as_millis();
        assert_eq!([Some(25), Some(80), Some(500), None].map(ms), [25, 40, 60, 60]);
    }
}
