//! The reduced grid on which multipliers are found: square blocks of pixels, those at the right and lower edge smaller.

use crate::filter::gaussian_blur_xy;
use crate::plane::Plane;
use rayon::prelude::*;

/// Blocks of a picture, row-major.
pub(super) struct BlockGrid {
    /// Size of the picture in pixels.
    pub(super) width: usize,
    pub(super) height: usize,
    /// Side of a block in pixels.
    pub(super) side: usize,
}

impl BlockGrid {
    fn columns(&self) -> usize {
        self.width.div_ceil(self.side)
    }

    fn rows(&self) -> usize {
        self.height.div_ceil(self.side)
    }

    pub(super) fn count(&self) -> usize {
        self.columns() * self.rows()
    }

    /// The block that a pixel lies in.
    pub(super) fn block_of(&self, x: usize, y: usize) -> usize {
        (y / self.side) * self.columns() + x / self.side
    }

    pub(super) fn pixels_in(&self, block: usize) -> usize {
        let (bx, by) = (block % self.columns(), block / self.columns());
        (self.width - bx * self.side).min(self.side) * (self.height - by * self.side).min(self.side)
    }

    /// `value_of(block index)` for every block.
    pub(super) fn each<T: Send>(&self, value_of: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        let least = (4096 / (self.side * self.side)).max(1);
        (0..self.count()).into_par_iter().with_min_len(least).map(value_of).collect()
    }

    /// Calls `visit(pixel index)` for every pixel of a block.
    pub(super) fn for_each_in(&self, block: usize, mut visit: impl FnMut(usize)) {
        let (bx, by) = (block % self.columns(), block / self.columns());
        let columns = bx * self.side..((bx + 1) * self.side).min(self.width);
        for y in by * self.side..((by + 1) * self.side).min(self.height) {
            for x in columns.clone() {
                visit(y * self.width + x);
            }
        }
    }

    /// Mean of `value_at(pixel index)` over a block.
    pub(super) fn mean(&self, block: usize, value_at: impl Fn(usize) -> f32) -> f32 {
        let mut sum = 0.0;
        self.for_each_in(block, |index| sum += value_at(index));
        sum / self.pixels_in(block) as f32
    }

    /// Values of blocks, blurred over their neighbours; `sigma_blocks` along x and y.
    pub(super) fn blurred(&self, values: &[f32], sigma_blocks: [f64; 2]) -> Vec<f32> {
        match Plane::from_values(self.columns(), self.rows(), values.to_vec()) {
            Ok(plane) => gaussian_blur_xy(&plane, sigma_blocks).into_values(),
            Err(_) => values.to_vec(),
        }
    }
}
