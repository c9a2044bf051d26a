//! What is known of each pixel's surface.

use rayon::prelude::*;

use super::{GuideInputs, is_divided};
use crate::rows::Rows;

/// Stands for the depth where there is no surface.
pub(super) const NO_DEPTH: f32 = 1e15;
/// Greatest depth, in the unit of [`GuideInputs::depth`](super::GuideInputs::depth): what is farther is taken to be
/// here.
pub const FARTHEST_SURFACE: f32 = 1e14;
/// Depth beside the picture: so far from any other that what lies there never weighs anything.
pub const BEYOND: f32 = 1e30;

// Channels of a row of surfaces.
pub(super) const SURFACE_CHANNELS: usize = 6;
pub(super) const NORMAL_X: usize = 0;
pub(super) const NORMAL_Y: usize = 1;
pub(super) const NORMAL_Z: usize = 2;
pub(super) const DEPTH: usize = 3;
pub(super) const SLOPE: usize = 4;
/// A number for each kind of pixel: a surface whose light is divided by its albedo, one whose light is not, and
/// emptiness, likewise. Those of one kind alone are neighbours.
pub(super) const KIND: usize = 5;

/// What is known of each pixel's surface, with values that need no checks: an infinite depth is [`NO_DEPTH`], a broken
/// normal 0.
pub(super) fn surfaces(inputs: &GuideInputs<'_>) -> Rows<SURFACE_CHANNELS> {
    let width = inputs.width;
    let slopes = depth_slopes(inputs.depth, width);
    let mut surfaces = Rows::new(width, inputs.height);
    surfaces.for_each_row(|y, [normal_x, normal_y, normal_z, depth, slope, kind]| {
        for x in 0..width {
            let index = y * width + x;
            let normal = inputs.normal[index];
            let usable = normal.iter().all(|part| part.abs() <= 2.0);
            [normal_x[x], normal_y[x], normal_z[x]] = if usable { normal } else { [0.0; 3] };
            let own = inputs.depth[index];
            depth[x] = if own.is_finite() { own.clamp(-FARTHEST_SURFACE, FARTHEST_SURFACE) } else { NO_DEPTH };
            slope[x] = slopes[index].min(FARTHEST_SURFACE);
            kind[x] = f32::from(2 * u8::from(!own.is_finite()) + u8::from(!is_divided(inputs.albedo[index])));
        }
    });
    surfaces.fill_border(DEPTH, BEYOND);
    surfaces
}

/// How much depth, row-major in rows of `width`, changes from a pixel to the next, taken on the flatter side so that
/// silhouettes do not count: finite, 0 where nothing tells.
#[must_use]
pub fn depth_slopes(depth: &[f32], width: usize) -> Vec<f32> {
    let width = width.max(1);
    let height = depth.len() / width;
    (0..depth.len())
        .into_par_iter()
        .map(|index| {
            let (x, y) = (index % width, index / width);
            let step = |other: Option<usize>| {
                other.and_then(|other| depth.get(other)).map_or(f32::INFINITY, |other| {
                    let step = (other - depth[index]).abs();
                    if step.is_nan() { f32::INFINITY } else { step }
                })
            };
            let across = step((x > 0).then(|| index - 1)).min(step((x + 1 < width).then(|| index + 1)));
            let along = step((y > 0).then(|| index - width)).min(step((y + 1 < height).then(|| index + width)));
            let slope = across.max(along);
            if slope.is_finite() { slope } else { 0.0 }
        })
        .collect()
}
