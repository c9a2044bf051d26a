//! A smooth map kept at a fraction of the picture's resolution.

use crate::frame::{enlarged, reduced_pixel};
use crate::plane::Plane;

/// Values at every `factor`-th pixel, one before the picture and at least one past it included, and straight lines
/// between them: sample j stands at pixel (j − 1) · `factor`.
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

    /// Makes every sample 1.
    pub(crate) fn flatten(&mut self) {
        self.samples.values_mut().fill(1.0);
    }

    /// Every how many-th pixel has a sample.
    pub(crate) fn factor(&self) -> usize {
        self.factor
    }

    /// Writes row `j` of the same map with a sample at every `factor`-th pixel, its frame of one included; `factor`
    /// divides this map's own. `buffer` is any vector, to be used again.
    pub(crate) fn finer_row_into(&self, factor: usize, j: usize, buffer: &mut Vec<f32>, row: &mut [f32]) {
        let ratio = self.factor / factor;
        // Fine sample j stands (j − 1) / ratio of a step past coarse sample 1.
        let last = self.samples.height() - 1;
        let (upper, fraction) = (j.div_ceil(ratio), ((j + ratio - 1) % ratio) as f32 / ratio as f32);
        let (above, below) = (self.samples.row(upper.min(last)), self.samples.row((upper + 1).min(last)));
        buffer.clear();
        buffer.extend(above.iter().zip(below).map(|(above, below)| above + (below - above) * fraction));
        let step = (ratio as f32).recip();
        row[0] = buffer[1] + (buffer[0] - buffer[1]) * step;
        let last = buffer.len() - 1;
        for (block, values) in row[1..].chunks_mut(ratio).enumerate() {
            let (from, to) = (buffer[(block + 1).min(last)], buffer[(block + 2).min(last)]);
            for (offset, value) in values.iter_mut().enumerate() {
                *value = from + (to - from) * (offset as f32 * step);
            }
        }
    }

    /// `change(own, other, x, y)` of every sample of two maps of one picture and factor, (x, y) the pixel it stands at.
    pub(crate) fn combine(&mut self, other: &Self, change: impl Fn(f32, f32, usize, usize) -> f32 + Sync) {
        let (factor, width, height) = (self.factor, self.width, self.height);
        self.samples.for_each_row_mut(|j, row| {
            let y = reduced_pixel(j, factor, height);
            for (i, (value, other)) in row.iter_mut().zip(other.samples.row(j)).enumerate() {
                *value = change(*value, *other, reduced_pixel(i, factor, width), y);
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
    use crate::frame::reduced_size;

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
            if factor > 1 {
                let finer = factor / 2;
                let (wide, high) = (reduced_size(21, finer), reduced_size(13, finer));
                let mut row = vec![0.0; wide];
                for j in 1..high - 1 {
                    reduced.finer_row_into(finer, j, &mut buffer, &mut row);
                    for (i, found) in row.iter().enumerate().take(wide - 1).skip(1) {
                        let (x, y) = ((i - 1) * finer, (j - 1) * finer);
                        if x < 21 && y < 13 {
                            assert!((found - whole.get(x, y)).abs() < 1e-3, "factor {factor} at ({x}, {y})");
                        }
                    }
                }
            }
            assert_eq!(reduced.change_by(&whole, |own, other| own - other).enlarged().mean(), 0.0);
        }
    }
}
