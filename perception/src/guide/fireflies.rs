//! Pixels far above everything around them: a firefly is no light.

use super::surfaces::{KIND, SURFACE_CHANNELS};
use super::{LIGHT_CHANNELS, LUMINANCE};
use crate::rows::Rows;
use std::ops::Range;

/// Fewer neighbours say nothing of a pixel.
const MIN_NEIGHBORS: f32 = 3.0;

/// Brings pixels down to four standard deviations above the mean of those of their kind in the 5×5 pixels around,
/// themselves left out.
pub(super) fn tame_fireflies(light: &mut Rows<LIGHT_CHANNELS>, surfaces: &Rows<SURFACE_CHANNELS>) {
    const RADIUS: usize = 2;
    let (width, height) = (light.width, light.height);
    let mut scales = Rows::<1>::new(width, height);
    scales.for_each_row(|y, [scale]| {
        let (own, own_kind) = (light.row(y, LUMINANCE), surfaces.row(y, KIND));
        let mut neighbors = Neighbors::none(width);
        for v in y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height) {
            for dx in 0..=2 * RADIUS {
                if v == y && dx == RADIUS {
                    continue;
                }
                let (columns, others) = shifted(width, dx, RADIUS);
                let kinds = own_kind[columns.clone()].iter().zip(&surfaces.row(v, KIND)[others.clone()]);
                neighbors.add(columns, kinds, &light.row(v, LUMINANCE)[others]);
            }
        }
        for (x, (scale, own)) in scale.iter_mut().zip(own).enumerate() {
            *scale = neighbors.limit(x).filter(|limit| own > limit).map_or(1.0, |limit| limit / own);
        }
    });
    light.for_each_row(|y, [red, green, blue, bright, variance]| {
        for (x, &scale) in scales.row(y, 0).iter().enumerate() {
            for channel in [&mut red[x], &mut green[x], &mut blue[x], &mut bright[x]] {
                *channel *= scale;
            }
            variance[x] *= scale * scale;
        }
    });
}

/// What is known of the luminances around each pixel of a row: sums that lie apart, so that they are made on vector
/// registers.
struct Neighbors {
    counts: Vec<f32>,
    sums: Vec<f32>,
    squares: Vec<f32>,
}

impl Neighbors {
    fn none(width: usize) -> Self {
        let zeros = || vec![0.0; width];
        Self { counts: zeros(), sums: zeros(), squares: zeros() }
    }

    /// Adds one of these `values` to each of these columns, where both `kinds` are the same.
    fn add<'a>(&mut self, columns: Range<usize>, kinds: impl Iterator<Item = (&'a f32, &'a f32)>, values: &[f32]) {
        let sums = self.sums[columns.clone()].iter_mut().zip(&mut self.squares[columns.clone()]);
        let sums = sums.zip(&mut self.counts[columns]);
        for ((((sum, squares), count), value), (own_kind, kind)) in sums.zip(values).zip(kinds) {
            let weight = if own_kind == kind { 1.0 } else { 0.0 };
            let value = weight * value.min(1e15);
            *count += weight;
            *sum += value;
            *squares += value * value;
        }
    }

    /// What no pixel among them exceeds by itself; `None` where they are too few to tell.
    fn limit(&self, x: usize) -> Option<f32> {
        let (count, mean) = (self.counts[x], self.sums[x] / self.counts[x]);
        let variance = (self.squares[x] / count - mean * mean).max(0.0);
        (count >= MIN_NEIGHBORS).then(|| mean + 4.0 * variance.sqrt())
    }
}

/// The columns of a row that have a neighbour `step − center` columns on, and those neighbours.
fn shifted(width: usize, step: usize, center: usize) -> (Range<usize>, Range<usize>) {
    if step >= center {
        let by = (step - center).min(width);
        (0..width - by, by..width)
    } else {
        let by = (center - step).min(width);
        (by..width, 0..width - by)
    }
}
