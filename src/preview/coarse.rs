//! From coarse to fine: an order of pixels in which every beginning covers the picture, and what stands in for pixels
//! that have not had their turn.

use crate::film::Film;
use crate::integrator::{BlockWork, SamplePlan};

/// Distance in pixels of the coarsest grid.
const COARSEST: u32 = 16;

/// Finest power of two up to [`COARSEST`] on whose grid a pixel lies.
fn spacing(x: u32, y: u32) -> u32 {
    let both = x | y | COARSEST;
    1 << both.trailing_zeros()
}

/// All pixels of a picture, grid after grid. Rows of a grid that follow one another lie far apart: the finest grid is
/// most of the picture, and swept from above it would leave the lower part behind for seconds.
fn coarse_to_fine(width: u32, height: u32) -> Vec<u32> {
    let mut rows: Vec<u32> = (0..height).collect();
    rows.sort_unstable_by_key(|y| y.reverse_bits());
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for step in (0..=COARSEST.ilog2()).rev().map(|power| 1 << power) {
        for &y in rows.iter().filter(|&y| y % step == 0) {
            let columns = (0..width).step_by(step as usize).filter(|&x| spacing(x, y) == step);
            pixels.extend(columns.map(|x| y * width + x));
        }
    }
    pixels
}

/// Puts the blocks of a pilot's every pass over the picture in an order from coarse to fine. The passes stay: some of a
/// pilot's samples for every pixel look better than all of them for some pixels. Blocks of one pixel's half keep their
/// order, so the film that comes of it has the same bytes.
pub(super) fn order(pilot: &mut SamplePlan, width: u32, height: u32) {
    let order = coarse_to_fine(width, height);
    let mut of_pixel: Vec<Option<BlockWork>> = vec![None; order.len()];
    // Placed, not sorted: there are four blocks a pixel, and nothing is shown of a new picture before.
    for pass in pilot.blocks.chunk_by_mut(|a, b| a.pixel < b.pixel) {
        pass.iter().for_each(|block| of_pixel[block.pixel as usize] = Some(*block));
        let ordered = order.iter().filter_map(|&pixel| of_pixel[pixel as usize].take());
        pass.iter_mut().zip(ordered).for_each(|(place, block)| *place = block);
    }
}

/// The index of the pixel whose samples stand for one: itself, or the nearest above and to the left on a grid that has
/// been sampled. `None` where there is none yet.
pub(super) fn stand_in(film: &Film, pixel: usize) -> Option<usize> {
    let width = film.width();
    let (x, y) = (pixel as u32 % width, pixel as u32 / width);
    let on_grid = |step: u32| (y / step * step * width + x / step * step) as usize;
    let steps = (0..=COARSEST.ilog2()).map(|power| 1 << power);
    steps.map(on_grid).find(|&pixel| film.samples(pixel) > 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::plan::pilot_plan;
    use crate::sampler::Half;

    /// Every beginning of the order covers the picture as evenly as its length allows, and nothing is lost.
    #[test]
    fn coarse_grids_come_first() {
        let mut plan = pilot_plan(&Film::new(40, 24), 16);
        let unordered = plan.samples();
        order(&mut plan, 40, 24);
        let first: Vec<u32> = plan.blocks.iter().take(6).map(|b| b.pixel).collect();
        assert_eq!(first, [0, 16, 32, 16 * 40, 16 * 40 + 16, 16 * 40 + 32]);
        let mut pixels: Vec<u32> = plan.blocks.iter().take(40 * 24).map(|b| b.pixel).collect();
        pixels.sort_unstable();
        assert!(pixels.into_iter().eq(0..40 * 24));
        assert_eq!(plan.samples(), unordered);
    }

    #[test]
    fn one_pass_comes_after_the_other() {
        let mut plan = pilot_plan(&Film::new(40, 24), 16);
        order(&mut plan, 40, 24);
        let passes: Vec<&[BlockWork]> = plan.blocks.chunks(40 * 24).collect();
        let kinds = [(Half::A, 0, 2), (Half::B, 0, 2), (Half::A, 2, 6), (Half::B, 2, 6)];
        assert_eq!(passes.len(), kinds.len());
        for (pass, kind) in passes.iter().zip(kinds) {
            assert!(pass.iter().all(|b| (b.half, b.first, b.samples) == kind));
        }
    }
}
