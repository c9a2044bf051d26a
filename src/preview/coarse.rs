//! From coarse to fine: an order of pixels in which every beginning covers the picture, and what stands in for pixels that
//! have not had their turn.

use crate::film::Film;
use crate::integrator::{BlockWork, SamplePlan};

/// Distance in pixels of the coarsest grid.
const COARSEST: u32 = 16;

/// Finest power of two up to [`COARSEST`] on whose grid a pixel lies.
fn spacing(x: u32, y: u32) -> u32 {
    let both = x | y | COARSEST;
    1 << both.trailing_zeros()
}

/// Sorts a pilot's blocks from coarse to fine, one pass over the picture after the other: some of a pilot's samples for every pixel
/// look better than all of them for some pixels. Blocks of one pixel's half keep their order, so the film that comes of it
/// has the same bytes.
pub(super) fn order(pilot: &mut SamplePlan, width: u32) {
    let place = |block: &BlockWork| {
        let (x, y) = (block.pixel % width, block.pixel / width);
        // Rows far apart after one another: the finest grid is most of the plan, and swept from above it would leave the lower
        // part behind for seconds.
        (block.first, block.half.index(), std::cmp::Reverse(spacing(x, y)), y.reverse_bits(), x)
    };
    pilot.blocks.sort_unstable_by_key(place);
}

/// The index of the pixel whose samples stand for one: itself, or the nearest above and to the left on a grid that has been
/// sampled. `None` where there is none yet.
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
        order(&mut plan, 40);
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
        order(&mut plan, 40);
        let passes: Vec<&[BlockWork]> = plan.blocks.chunks(40 * 24).collect();
        let kinds = [(Half::A, 0, 2), (Half::B, 0, 2), (Half::A, 2, 6), (Half::B, 2, 6)];
        assert_eq!(passes.len(), kinds.len());
        for (pass, kind) in passes.iter().zip(kinds) {
            assert!(pass.iter().all(|b| (b.half, b.first, b.samples) == kind));
        }
    }
}
