//! A single-channel picture.

use rayon::prelude::*;

use crate::error::Error;

/// A row-major image of `f32`, row 0 at the top.
///
/// What its values mean (cd/m², (cd/m²)², threshold units) is said by whoever hands it out; the plane itself only
/// knows its shape. Both sides may be 0, though every model rejects a plane without pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// Luminance above which nothing is answered: sums over windows must stay within `f32`.
const MAX_LUMINANCE_CD_M2: f32 = 1e30;

/// Pixels that are worth handing to another thread. Measured at 128×128 pixels: 16,384 leave a second core idle.
pub const PIXELS_PER_TASK: usize = 1 << 12;

impl Plane {
    /// A plane whose every pixel is `value`.
    ///
    /// # Panics
    /// Where there are more pixels than a `Vec` can hold.
    ///
    /// ```
    /// use fechner_perception::Plane;
    /// assert_eq!(Plane::filled(3, 2, 50.0).values(), [50.0; 6]);
    /// ```
    #[must_use]
    pub fn filled(width: usize, height: usize, value: f32) -> Self {
        Self { width, height, values: vec![value; width.saturating_mul(height)] }
    }

    /// Takes row-major values.
    ///
    /// # Errors
    /// [`Error::ValueCount`] unless there are exactly `width * height` of them.
    pub fn from_values(width: usize, height: usize, values: Vec<f32>) -> Result<Self, Error> {
        if width.checked_mul(height) == Some(values.len()) {
            Ok(Self { width, height, values })
        } else {
            Err(Error::ValueCount { width, height, found: values.len() })
        }
    }

    /// Asks `value_at(x, y)` for every pixel, rows in parallel.
    #[must_use]
    pub fn from_fn(width: usize, height: usize, value_at: impl Fn(usize, usize) -> f32 + Sync) -> Self {
        let mut plane = Self::filled(width, height, 0.0);
        plane.for_each_row_mut(|y, row| {
            for (x, value) in row.iter_mut().enumerate() {
                *value = value_at(x, y);
            }
        });
        plane
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// All values, row by row.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// All values, row by row, to be written.
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }

    /// The value at column `x`, row `y`.
    ///
    /// # Panics
    /// Outside the plane, as indexing a slice does.
    #[must_use]
    pub fn get(&self, x: usize, y: usize) -> f32 {
        assert!(x < self.width, "column {x} of a plane {} wide", self.width);
        self.values[y * self.width + x]
    }

    /// The values given up, row by row.
    #[must_use]
    pub fn into_values(self) -> Vec<f32> {
        self.values
    }

    /// A plane of the same shape with `change` applied to every value.
    #[must_use]
    pub fn map(&self, change: impl Fn(f32) -> f32 + Sync) -> Self {
        let mut mapped = self.clone();
        mapped.for_each_row_mut(|_, row| row.iter_mut().for_each(|value| *value = change(*value)));
        mapped
    }

    /// A plane of `with(a, b)` for the values of this plane and of another of the same shape.
    ///
    /// # Panics
    /// Unless the other plane has as many columns and rows.
    #[must_use]
    pub fn combined(&self, other: &Self, with: impl Fn(f32, f32) -> f32 + Sync) -> Self {
        assert_eq!((self.width, self.height), (other.width, other.height), "planes of two shapes");
        let mut result = self.clone();
        result.for_each_row_mut(|y, row| {
            for (value, other) in row.iter_mut().zip(other.row(y)) {
                *value = with(*value, *other);
            }
        });
        result
    }

    /// Half of the difference from another plane of the same shape, (own − other) / 2: of two halves of a picture, as
    /// strong as the noise of their mean.
    ///
    /// # Panics
    /// Unless the other plane has as many columns and rows.
    #[must_use]
    pub fn half_difference(&self, other: &Self) -> Self {
        self.combined(other, |own, others| 0.5 * (own - others))
    }

    /// Arithmetic mean, summed in `f64`; 0 for a plane without pixels.
    #[must_use]
    pub fn mean(&self) -> f64 {
        if self.values.is_empty() {
            return 0.0;
        }
        // Chunk by chunk, then the chunks in their order: the same sum on any number of threads.
        let chunks: Vec<f64> =
            self.values.par_chunks(1 << 14).map(|chunk| chunk.iter().map(|&value| f64::from(value)).sum()).collect();
        chunks.iter().sum::<f64>() / self.values.len() as f64
    }

    /// Largest value, 0 at least; 0 for a plane without pixels. NaN does not count.
    ///
    /// ```
    /// use fechner_perception::Plane;
    /// assert_eq!(Plane::from_fn(5, 2, |x, y| (x * y) as f32).max(), 4.0);
    /// assert_eq!(Plane::filled(2, 2, -1.0).max(), 0.0);
    /// ```
    #[must_use]
    pub fn max(&self) -> f32 {
        self.values.iter().copied().fold(0.0, f32::max)
    }

    /// Share of the pixels, in [0, 1], whose value is above `value`; 0 for a plane without pixels. NaN is above
    /// nothing.
    ///
    /// ```
    /// use fechner_perception::Plane;
    /// assert_eq!(Plane::from_fn(4, 1, |x, _| x as f32).share_above(1.0), 0.5);
    /// ```
    #[must_use]
    pub fn share_above(&self, value: f64) -> f64 {
        let above = self.values.iter().filter(|own| f64::from(**own) > value).count();
        above as f64 / self.values.len().max(1) as f64
    }

    /// The value that this share of the pixels, in [0, 1], stays at or below; 0 for a plane without pixels.
    ///
    /// ```
    /// use fechner_perception::Plane;
    /// let plane = Plane::from_fn(101, 1, |x, _| x as f32);
    /// assert_eq!(plane.quantile(0.99), 99.0);
    /// ```
    #[must_use]
    pub fn quantile(&self, share: f64) -> f64 {
        let mut values = self.values.clone();
        let rank = (share.clamp(0.0, 1.0) * values.len().saturating_sub(1) as f64).round() as usize;
        if values.is_empty() {
            return 0.0;
        }
        let (_, &mut value, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
        f64::from(value)
    }

    /// Least and greatest value; (∞, 0) for a plane without pixels. Values must not be negative.
    pub(crate) fn range(&self) -> (f32, f32) {
        let join = |a: (f32, f32), b: (f32, f32)| (a.0.min(b.0), a.1.max(b.1));
        self.values
            .par_chunks(1 << 14)
            .map(|chunk| {
                let least = chunk.iter().copied().fold(f32::INFINITY, f32::min);
                (least, chunk.iter().copied().fold(0.0, f32::max))
            })
            .reduce(|| (f32::INFINITY, 0.0), join)
    }

    /// Runs `work(y, row)` over all rows in parallel; each row is one thread's own, so the order cannot matter.
    pub(crate) fn for_each_row_mut(&mut self, work: impl Fn(usize, &mut [f32]) + Sync) {
        if self.width == 0 {
            return;
        }
        // A few rows at a time: one row of a small picture is less work than handing it over.
        let rows_at_once = (PIXELS_PER_TASK / self.width).max(1);
        let width = self.width;
        self.values.par_chunks_mut(width * rows_at_once).enumerate().for_each(|(chunk, rows)| {
            for (offset, row) in rows.chunks_exact_mut(width).enumerate() {
                work(chunk * rows_at_once + offset, row);
            }
        });
    }

    pub(crate) fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..(y + 1) * self.width]
    }

    pub(crate) fn same_size(&self, other: &Self) -> bool {
        self.width == other.width && self.height == other.height
    }

    /// Rejects a plane of another size than `width` × `height`.
    pub(crate) fn check_size(&self, what: &'static str, width: usize, height: usize) -> Result<(), Error> {
        if self.width == width && self.height == height {
            Ok(())
        } else {
            Err(Error::SizeMismatch { what, width, height, found_width: self.width, found_height: self.height })
        }
    }

    /// Rejects an empty plane and any value that is not finite or is negative.
    pub(crate) fn check_non_negative(&self, what: &'static str) -> Result<(), Error> {
        self.check_at_most(f32::MAX, what)
    }

    /// Rejects the same, and luminance in cd/m² whose means would not be finite.
    pub(crate) fn check_luminance(&self, what: &'static str) -> Result<(), Error> {
        self.check_at_most(MAX_LUMINANCE_CD_M2, what)
    }

    fn check_at_most(&self, largest: f32, what: &'static str) -> Result<(), Error> {
        if self.values.is_empty() {
            return Err(Error::Empty { what });
        }
        let is_bad = |value: &f32| !(*value >= 0.0 && *value <= largest);
        // Whole chunks without an early exit run on vector registers.
        let has_bad = |chunk: &[f32]| chunk.iter().fold(false, |bad, value| bad | is_bad(value));
        if !self.values.par_chunks(1 << 14).any(has_bad) {
            return Ok(());
        }
        match self.values.iter().position(is_bad) {
            None => Ok(()),
            Some(index) => {
                let (x, y, value) = (index % self.width, index / self.width, self.values[index]);
                if value > largest && value.is_finite() {
                    return Err(Error::OutOfRange { what, value: f64::from(value), expected: "at most 1e30 cd/m²" });
                }
                Err(Error::BadPixel { what, value, x, y })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_keep_their_places() {
        let plane = Plane::from_fn(3, 2, |x, y| (10 * y + x) as f32);
        assert_eq!(plane.values(), [0.0, 1.0, 2.0, 10.0, 11.0, 12.0]);
        assert_eq!(plane.get(2, 1), 12.0);
    }

    /// Regression: the number of pixels wrapped around, and this plane had two values.
    #[test]
    #[should_panic(expected = "capacity overflow")]
    fn more_pixels_than_can_be_counted_are_refused() {
        let _ = Plane::filled(usize::MAX / 2 + 2, 2, 0.0);
    }

    #[test]
    fn a_wrong_count_is_an_error() {
        assert_eq!(Plane::from_values(3, 2, vec![0.0; 5]), Err(Error::ValueCount { width: 3, height: 2, found: 5 }));
        assert!(Plane::from_values(usize::MAX, 3, vec![]).is_err());
    }

    #[test]
    fn bad_pixels_are_named() {
        let plane = Plane::from_fn(4, 4, |x, y| if (x, y) == (2, 3) { f32::NAN } else { 1.0 });
        assert!(matches!(plane.check_non_negative("guide"), Err(Error::BadPixel { x: 2, y: 3, .. })));
        assert!(Plane::filled(4, 4, -1.0).check_non_negative("guide").is_err());
        assert!(Plane::filled(0, 4, 1.0).check_non_negative("guide").is_err());
    }
}
