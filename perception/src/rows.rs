//! A picture of several channels, row by row: all of a row's channels lie one after the other.

use crate::plane::PIXELS_A_TASK;
use rayon::prelude::*;

/// Row y holds channel 0 of its pixels, then channel 1, and so on: loops along a row run on vector registers, and one
/// thread owns all of it.
pub(crate) struct Rows<const CHANNELS: usize> {
    pub(crate) width: usize,
    pub(crate) height: usize,
    values: Vec<f32>,
}

impl<const CHANNELS: usize> Rows<CHANNELS> {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        Self { width, height, values: vec![0.0; CHANNELS * width * height] }
    }

    pub(crate) fn row(&self, y: usize, channel: usize) -> &[f32] {
        let start = (y * CHANNELS + channel) * self.width;
        &self.values[start..start + self.width]
    }

    /// Runs `work(y, channels of row y)` over all rows in parallel.
    pub(crate) fn for_each_row(&mut self, work: impl Fn(usize, [&mut [f32]; CHANNELS]) + Sync) {
        let width = self.width;
        if width == 0 {
            return;
        }
        let rows_at_once = (PIXELS_A_TASK / width).max(1);
        self.values.par_chunks_mut(CHANNELS * width).with_min_len(rows_at_once).enumerate().for_each(|(y, row)| {
            let mut channels = row.chunks_exact_mut(width);
            // There are exactly as many as channels; an empty slice never comes up.
            work(y, std::array::from_fn(|_| channels.next().unwrap_or_default()));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_keep_apart() {
        let mut rows = Rows::<2>::new(3, 2);
        rows.for_each_row(|y, [first, second]| {
            first.fill(y as f32);
            second.fill(10.0 + y as f32);
        });
        assert_eq!((rows.row(1, 0), rows.row(0, 1)), ([1.0; 3].as_slice(), [10.0; 3].as_slice()));
    }
}
