//! A smooth map kept at a fraction of the picture's resolution.

use crate::fft::enlarged;
use crate::plane::Plane;

/// Values at every `factor`-th pixel, one before the picture and at least one past it included, and straight lines between
/// them: sample j stands at pixel (j − 1) · `factor`.
#[derive(Clone, Debug)]
pub(crate) struct ReducedPlane {
    samples: Plane,
    factor: usize,
    width: usize,
    height: usize,
}

impl ReducedPlane {
    /// Takes samples for a picture of `width` × `height`.
    pub(crate) fn new(samples: Plane, factor: usize, width: usize, height: usize) -> Self {
        Self { samples, factor, width, height }
    }

    /// The map at every pixel.
    pub(crate) fn enlarged(&self) -> Plane {
        enlarged(&self.samples, self.factor, self.width, self.height)
    }

    /// Writes row `y` of [`ReducedPlane::enlarged`]; `buffer` is any vector, to be used again.
    pub(crate) fn row_into(&self, y: usize, buffer: &mut Vec<f32>, row: &mut [f32]) {
        let fraction = (y % self.factor) as f32 / self.factor as f32;
        let (above, below) = (self.samples.row(y / self.factor + 1), self.samples.row(y / self.factor + 2));
        buffer.clear();
        buffer.extend(above.iter().zip(below).map(|(above, below)| above + (below - above) * fraction));
        let step = (self.factor as f32).recip();
        for (block, values) in row.chunks_mut(self.factor).enumerate() {
            let (from, to) = (buffer[block + 1], buffer[block + 2]);
            for (offset, value) in values.iter_mut().enumerate() {
                *value = from + (to - from) * (offset as f32 * step);
            }
        }
    }

    /// `change(own, other)` of every sample of two maps of one picture and factor.
    pub(crate) fn combine(&mut self, other: &Self, change: impl Fn(f32, f32) -> f32 + Sync) {
        self.samples.for_each_row_mut(|y, row| {
            for (value, other) in row.iter_mut().zip(other.samples.row(y)) {
                *value = change(*value, *other);
            }
        });
    }

    /// `change(value, of)` of every sample, `of` taken from `plane` at the sample's pixel.
    pub(crate) fn change_by(&self, plane: &Plane, change: impl Fn(f32, f32) -> f32 + Sync) -> Self {
        let full = self.enlarged();
        // At every pixel, framed like any other.
        let pixel = |index: usize, len: usize| index.saturating_sub(1).min(len - 1);
        let samples = Plane::from_fn(self.width + 2, self.height + 2, |x, y| {
            let (x, y) = (pixel(x, self.width), pixel(y, self.height));
            change(full.get(x, y), plane.get(x, y))
        });
        Self { samples, factor: 1, width: self.width, height: self.height }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fft::reduced_size;

    #[test]
    fn rows_are_those_of_the_enlarged_plane() {
        for factor in [1, 2, 8] {
            let samples =
                Plane::from_fn(reduced_size(21, factor), reduced_size(13, factor), |x, y| (x * x + 3 * y) as f32);
            let reduced = ReducedPlane::new(samples, factor, 21, 13);
            let whole = reduced.enlarged();
            let (mut buffer, mut row) = (Vec::new(), vec![0.0; 21]);
            for y in 0..13 {
                reduced.row_into(y, &mut buffer, &mut row);
                for (found, expected) in row.iter().zip(whole.row(y)) {
                    assert!((found - expected).abs() < 1e-3, "factor {factor}, row {y}: {found}, not {expected}");
                }
            }
            assert_eq!(reduced.change_by(&whole, |own, other| own - other).enlarged().mean(), 0.0);
        }
    }
}
