//! Pixels far above everything around them: a firefly is no light.

use super::{LIGHT_CHANNELS, LUMINANCE};
use crate::rows::Rows;
use std::ops::Range;

/// Brings pixels down to four standard deviations above the mean of their 5×5 neighbourhood, themselves left out.
pub(super) fn tame_fireflies(light: &mut Rows<LIGHT_CHANNELS>) {
    const RADIUS: usize = 2;
    let (width, height) = (light.width, light.height);
    let mut scales = Rows::<1>::new(width, height);
    scales.for_each_row(|y, [scale]| {
        let own = light.row(y, LUMINANCE);
        let (mut sum, mut squares) = (vec![0.0_f32; width], vec![0.0_f32; width]);
        let rows = y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height);
        for v in rows.clone() {
            for dx in 0..=2 * RADIUS {
                if v == y && dx == RADIUS {
                    continue;
                }
                let (columns, others) = shifted(width, dx, RADIUS);
                let values = &light.row(v, LUMINANCE)[others];
                let sums = sum[columns.clone()].iter_mut().zip(&mut squares[columns]);
                for ((sum, squares), value) in sums.zip(values) {
                    let value = value.min(1e15);
                    *sum += value;
                    *squares += value * value;
                }
            }
        }
        for (x, scale) in scale.iter_mut().enumerate() {
            let columns = (x + RADIUS + 1).min(width) - x.saturating_sub(RADIUS);
            let count = (columns * rows.len() - 1) as f32;
            let mean = sum[x] / count.max(1.0);
            let limit = mean + 4.0 * (squares[x] / count.max(1.0) - mean * mean).max(0.0).sqrt();
            *scale = if count < 3.0 || own[x] <= limit { 1.0 } else { limit / own[x] };
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
