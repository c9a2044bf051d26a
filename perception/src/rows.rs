//! A picture of several channels, row by row: all of a row's channels lie one after the other.

use crate::plane::PIXELS_PER_TASK;
use rayon::prelude::*;

/// Columns to each side of the picture that may be read, so that the widest filter needs no other loop at its edges.
pub(crate) const BORDER: usize = 16;
/// Columns that a window shows.
pub(crate) const TILE: usize = 64;

/// [`TILE`] columns of every channel of a row with [`BORDER`] more on each side. Of a length that the compiler knows:
/// where it does not, two of five instructions of the filter ask whether they may read.
pub(crate) type Window<const CHANNELS: usize> = [[f32; BORDER + TILE + BORDER]; CHANNELS];

/// Row y holds channel 0 of its pixels, then channel 1, and so on: loops along a row run on vector registers, and one
/// thread owns all of it.
pub(crate) struct Rows<const CHANNELS: usize> {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// From a channel to the next: the picture, its borders, and columns that make its last window whole.
    stride: usize,
    values: Vec<f32>,
}

impl<const CHANNELS: usize> Rows<CHANNELS> {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let stride = BORDER + width.next_multiple_of(TILE) + BORDER;
        Self { width, height, stride, values: vec![0.0; CHANNELS * stride * height] }
    }

    pub(crate) fn row(&self, y: usize, channel: usize) -> &[f32] {
        let start = (y * CHANNELS + channel) * self.stride + BORDER;
        &self.values[start..start + self.width]
    }

    /// Shows the columns of a row from `column` on, a multiple of [`TILE`]; those are at [`BORDER`] in the window.
    pub(crate) fn show(&self, y: usize, column: usize, window: &mut Window<CHANNELS>) {
        let row = &self.values[y * CHANNELS * self.stride + column..];
        for (channel, window) in window.iter_mut().enumerate() {
            window.copy_from_slice(&row[channel * self.stride..][..BORDER + TILE + BORDER]);
        }
    }

    /// Sets what a channel says beside the picture, where it is 0 else.
    pub(crate) fn fill_border(&mut self, channel: usize, value: f32) {
        let pictured = BORDER..BORDER + self.width;
        for row in self.values.chunks_exact_mut(self.stride).skip(channel).step_by(CHANNELS) {
            row[..pictured.start].fill(value);
            row[pictured.end..].fill(value);
        }
    }

    /// Runs `work(y, channels of row y)` over all rows in parallel.
    pub(crate) fn for_each_row(&mut self, work: impl Fn(usize, [&mut [f32]; CHANNELS]) + Sync) {
        let (width, stride) = (self.width, self.stride);
        let rows_at_once = (PIXELS_PER_TASK / width.max(1)).max(1);
        self.values.par_chunks_mut(CHANNELS * stride).with_min_len(rows_at_once).enumerate().for_each(|(y, row)| {
            let mut channels = row.chunks_exact_mut(stride).map(|channel| &mut channel[BORDER..BORDER + width]);
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

    #[test]
    fn borders_lie_beside_the_picture() {
        let mut rows = Rows::<2>::new(3, 2);
        rows.for_each_row(|_, [first, second]| {
            first.fill(1.0);
            second.fill(2.0);
        });
        rows.fill_border(1, 9.0);
        let mut window = [[5.0; _]; 2];
        rows.show(1, 0, &mut window);
        assert_eq!(window[0][BORDER - 1..BORDER + 4], [0.0, 1.0, 1.0, 1.0, 0.0]);
        assert_eq!(window[1][BORDER - 1..BORDER + 4], [9.0, 2.0, 2.0, 2.0, 9.0]);
        assert_eq!(window[1].last(), Some(&9.0));
    }
}
