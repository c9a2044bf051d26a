//! Pictures of one channel with a border that may be read. Not for values farther out than [`BORDER`].

use super::likeness::WIDEST;
use super::taps::FARTHEST;
use rayon::prelude::*;

/// Pixels to a tile's side: work is done by tiles, whose sums stay in the first cache.
pub(super) const TILE: usize = 16;
/// Pixels beyond the picture that may be read: the farthest neighbour's neighbourhood, in whole vectors.
pub(super) const BORDER: usize = FARTHEST + 8;

const _: () = assert!(FARTHEST + WIDEST - TILE <= BORDER, "rows of neighbourhoods would end in the next row");

/// What is read beyond the picture.
#[derive(Clone, Copy)]
pub(super) enum Beyond {
    /// What its nearest pixel has.
    Edge,
    /// This value everywhere.
    Value(f32),
}

/// A picture with [`BORDER`] more on each side, of whole tiles.
#[derive(Clone, Debug)]
pub(super) struct PaddedPlane {
    stride: usize,
    values: Vec<f32>,
}

impl PaddedPlane {
    /// A plane of the values `of` pixels in row-major order. The picture is not empty.
    pub(super) fn new(width: usize, height: usize, beyond: Beyond, of: impl Fn(usize) -> f32 + Sync) -> Self {
        let stride = width.next_multiple_of(TILE) + 2 * BORDER;
        let rows = height.next_multiple_of(TILE) + 2 * BORDER;
        let mut values = vec![0.0; stride * rows];
        values.par_chunks_exact_mut(stride).with_min_len(16).enumerate().for_each(|(v, row)| {
            let y = v.saturating_sub(BORDER).min(height - 1);
            if let Beyond::Value(value) = beyond
                && y + BORDER != v
            {
                return row.fill(value);
            }
            let pictured = &mut row[BORDER..BORDER + width];
            pictured.iter_mut().enumerate().for_each(|(x, value)| *value = of(y * width + x));
            let [left, right] = match beyond {
                Beyond::Edge => [row[BORDER], row[BORDER + width - 1]],
                Beyond::Value(value) => [value; 2],
            };
            row[..BORDER].fill(left);
            row[BORDER + width..].fill(right);
        });
        Self { stride, values }
    }

    /// Reads `N` values from a column of a row on; both may be up to [`BORDER`] beyond the picture.
    #[inline(always)]
    pub(super) fn row<const N: usize>(&self, y: isize, x: isize) -> &[f32; N] {
        let start = (y + BORDER as isize) as usize * self.stride + (x + BORDER as isize) as usize;
        let found = self.values.get(start..).and_then(|values| values.first_chunk());
        found.expect("tiles and neighbours are within the border")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_goes_on_or_says_what_it_is_told() {
        let of = |i: usize| i as f32;
        let edge = PaddedPlane::new(3, 2, Beyond::Edge, of);
        assert_eq!(edge.row::<5>(0, -1), &[0.0, 0.0, 1.0, 2.0, 2.0]);
        assert_eq!(edge.row::<2>(-20, 15), &[2.0, 2.0]);
        assert_eq!(edge.row::<1>(35, -20), &[3.0]);
        let told = PaddedPlane::new(3, 2, Beyond::Value(9.0), of);
        assert_eq!(told.row::<5>(1, -1), &[9.0, 3.0, 4.0, 5.0, 9.0]);
        assert_eq!(told.row::<1>(2, 0), &[9.0]);
    }
}
