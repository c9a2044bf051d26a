//! Pictures at every so many-th pixel: where their samples stand, and how they become whole again.

use crate::display::PixelDensity;
use crate::filter::reflect;
use crate::plane::Plane;

/// The largest factor.
pub(crate) const MAX_REDUCTION: usize = 16;

/// Where the samples of a reduced picture stand: at every `factor`-th pixel, from one sample before the picture on
/// until at least one past it, and so many more on each side as `beside` and `above` say.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) factor: usize,
    pub(crate) beside: usize,
    pub(crate) above: usize,
}

impl Frame {
    /// Sample j stands at pixel (j − 1) · `factor`.
    pub(crate) fn narrow(factor: usize) -> Self {
        Self { factor, beside: 0, above: 0 }
    }

    /// Samples of a row of `width` pixels.
    pub(crate) fn samples_across(self, width: usize) -> usize {
        reduced_size(width, self.factor) + 2 * self.beside
    }

    /// Samples of a column of `height` pixels.
    pub(crate) fn samples_down(self, height: usize) -> usize {
        reduced_size(height, self.factor) + 2 * self.above
    }

    /// The pixel of a row of `width` whose mirror image, or itself, each sample stands at.
    pub(crate) fn columns(self, width: usize) -> Vec<usize> {
        (0..self.samples_across(width)).map(|index| self.pixel(index, self.beside, width)).collect()
    }

    /// The row of a picture of `height` rows that row `index` of the samples stands at, or whose mirror image.
    pub(crate) fn row(self, index: usize, height: usize) -> usize {
        self.pixel(index, self.above, height)
    }

    fn pixel(self, index: usize, more: usize, len: usize) -> usize {
        reflect((index as isize - 1 - more as isize) * self.factor as isize, len)
    }
}

/// Samples of a row of `len` pixels at every `factor`-th pixel, one before the first and one past the last included.
pub(crate) fn reduced_size(len: usize, factor: usize) -> usize {
    (len - 1) / factor + 3
}

/// The pixel at which reduced sample `index` stands, or the nearest one of a picture `len` pixels long.
pub(crate) fn reduced_pixel(index: usize, factor: usize, len: usize) -> usize {
    (index * factor).saturating_sub(factor).min(len - 1)
}

/// The largest reduction that still samples frequencies up to `limit_cpd` along both axes.
pub(crate) fn reduction(density: PixelDensity, limit_cpd: f64) -> usize {
    let mut factor = 1;
    while factor < MAX_REDUCTION && density.coarsest() / (4 * factor) as f64 >= limit_cpd {
        factor *= 2;
    }
    factor
}

/// A plane of `width` × `height` pixels, interpolated linearly from one at every `factor`-th pixel (see
/// [`Frame::narrow`]).
pub(crate) fn enlarged(reduced: &Plane, factor: usize, width: usize, height: usize) -> Plane {
    let step = (factor as f32).recip();
    let mut plane = Plane::filled(width, height, 0.0);
    let mut across = Plane::filled(width, reduced.height(), 0.0);
    across.for_each_row_mut(|y, row| {
        let source = reduced.row(y);
        for (block, values) in row.chunks_mut(factor).enumerate() {
            let (from, to) = (source[block + 1], source[block + 2]);
            for (offset, value) in values.iter_mut().enumerate() {
                *value = from + (to - from) * (offset as f32 * step);
            }
        }
    });
    plane.for_each_row_mut(|y, row| {
        let (above, below) = (across.row(y / factor + 1), across.row(y / factor + 2));
        let fraction = (y % factor) as f32 * step;
        for (value, (above, below)) in row.iter_mut().zip(above.iter().zip(below)) {
            *value = above + (below - above) * fraction;
        }
    });
    plane
}
