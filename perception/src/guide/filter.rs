//! The edge-avoiding passes.

use std::ops::Range;

use super::surfaces::{DEPTH, NO_DEPTH, NORMAL_X, NORMAL_Y, NORMAL_Z, SLOPE, SURFACE_CHANNELS};
use super::{BLUE, GREEN, LIGHT_CHANNELS, LUMINANCE, RED, VARIANCE};
use crate::photometry::luminance;
use crate::rows::Rows;

/// A neighbour this many standard errors away in luminance gets 1/e of the weight.
const LUMINANCE_SIGMAS: f32 = 3.0;
/// A neighbour this many times farther off than the surface's slope explains gets 1/e of the weight.
const DEPTH_SLOPES: f32 = 1.5;
/// Power of the cosine between normals.
const NORMAL_SHARPNESS: f32 = 24.0;

/// About exp(−x), 0 from x = 8 on, without the cost of an exponential.
#[inline]
fn falling(x: f32) -> f32 {
    let base = (1.0 - x / 8.0).max(0.0);
    let fourth = base * base * base * base;
    fourth * fourth
}

/// The columns of a row that have a neighbour `step − center` columns on, and those neighbours.
pub(super) fn shifted(width: usize, step: usize, center: usize) -> (Range<usize>, Range<usize>) {
    if step >= center {
        let by = (step - center).min(width);
        (0..width - by, by..width)
    } else {
        let by = (center - step).min(width);
        (by..width, 0..width - by)
    }
}

/// One pass over a 3×3 kernel whose taps lie `hole` pixels apart. Tap by tap along whole rows, without branches, so that
/// the loop runs on vector registers.
pub(super) fn filter_pass(
    light: &Rows<LIGHT_CHANNELS>,
    surfaces: &Rows<SURFACE_CHANNELS>,
    hole: usize,
) -> Rows<LIGHT_CHANNELS> {
    const TENT: [f32; 3] = [0.25, 0.5, 0.25];
    let (width, height) = (light.width, light.height);
    let mut filtered = Rows::new(width, height);
    filtered.for_each_row(|y, [red, green, blue, bright, variance]| {
        let center = Scales::new(light, surfaces, hole, y);
        let mut weight_sum = vec![TENT[1] * TENT[1]; width];
        for (sum, channel) in [(&mut *red, RED), (&mut *green, GREEN), (&mut *blue, BLUE)] {
            for (sum, value) in sum.iter_mut().zip(light.row(y, channel)) {
                *sum = TENT[1] * TENT[1] * value;
            }
        }
        for (sum, value) in variance.iter_mut().zip(light.row(y, VARIANCE)) {
            *sum = TENT[1].powi(4) * value;
        }
        // The brightness row holds weights until the end.
        let weights = &mut *bright;
        for (dy, tent_y) in TENT.into_iter().enumerate() {
            let Some(v) = (y + dy * hole).checked_sub(hole).filter(|v| *v < height) else {
                continue;
            };
            for (dx, tent_x) in TENT.into_iter().enumerate() {
                if (dx, dy) == (1, 1) {
                    continue;
                }
                let (columns, others) = shifted(width, dx * hole, hole);
                let weights = &mut weights[columns.clone()];
                center.weigh(light, surfaces, [y, v], [columns.clone(), others.clone()], weights);
                weights.iter_mut().for_each(|weight| *weight *= tent_x * tent_y);
                let add = |sums: &mut [f32], channel: usize| {
                    let values = &light.row(v, channel)[others.clone()];
                    for ((sum, weight), value) in sums[columns.clone()].iter_mut().zip(&*weights).zip(values) {
                        *sum += weight * value;
                    }
                };
                add(red, RED);
                add(green, GREEN);
                add(blue, BLUE);
                let values = &light.row(v, VARIANCE)[others.clone()];
                for ((sum, weight), value) in variance[columns.clone()].iter_mut().zip(&*weights).zip(values) {
                    *sum += weight * weight * value;
                }
                weight_sum[columns.clone()].iter_mut().zip(&*weights).for_each(|(sum, weight)| *sum += weight);
            }
        }
        for x in 0..width {
            // The pixel's own weight is never 0.
            let scale = weight_sum[x].recip();
            let rgb = [red[x] * scale, green[x] * scale, blue[x] * scale];
            [red[x], green[x], blue[x]] = rgb;
            bright[x] = luminance(rgb);
            variance[x] *= scale * scale;
        }
    });
    filtered
}

/// How strongly the pixels of one row mind differences of luminance and depth.
struct Scales {
    luminance: Vec<f32>,
    depth: Vec<f32>,
}

impl Scales {
    fn new(light: &Rows<LIGHT_CHANNELS>, surfaces: &Rows<SURFACE_CHANNELS>, hole: usize, y: usize) -> Self {
        let luminance = smoothed_variance(light, y)
            .into_iter()
            .zip(light.row(y, LUMINANCE))
            .map(|(variance, own)| 1.0 / (LUMINANCE_SIGMAS * variance.sqrt() + 1e-3 * own + 1e-12))
            .collect();
        let depth = surfaces
            .row(y, DEPTH)
            .iter()
            .zip(surfaces.row(y, SLOPE))
            .map(|(depth, slope)| 1.0 / (DEPTH_SLOPES * slope * hole as f32 + 1e-3 * depth.abs() + 1e-12))
            .collect();
        Self { luminance, depth }
    }

    /// Weights, without the kernel's, of the pixels `columns[1]` of row `rows[1]` for the pixels `columns[0]` of row `rows[0]`.
    fn weigh(
        &self,
        light: &Rows<LIGHT_CHANNELS>,
        surfaces: &Rows<SURFACE_CHANNELS>,
        rows: [usize; 2],
        columns: [Range<usize>; 2],
        weights: &mut [f32],
    ) {
        let [own, other] = columns;
        let of =
            |plane: usize| (&surfaces.row(rows[0], plane)[own.clone()], &surfaces.row(rows[1], plane)[other.clone()]);
        let (x, other_x) = of(NORMAL_X);
        let (y, other_y) = of(NORMAL_Y);
        let (z, other_z) = of(NORMAL_Z);
        for (index, weight) in weights.iter_mut().enumerate() {
            let cosine = x[index] * other_x[index] + y[index] * other_y[index] + z[index] * other_z[index];
            let is_known = x[index].abs() + y[index].abs() + z[index].abs() > 0.0;
            *weight = if is_known { NORMAL_SHARPNESS * (1.0 - cosine).max(0.0) } else { 0.0 };
        }
        let (depth, other_depth) = of(DEPTH);
        let own_light = &light.row(rows[0], LUMINANCE)[own.clone()];
        let other_light = &light.row(rows[1], LUMINANCE)[other.clone()];
        let (luminance_scale, depth_scale) = (&self.luminance[own.clone()], &self.depth[own.clone()]);
        for (index, weight) in weights.iter_mut().enumerate() {
            // A surface and the emptiness beside it are far apart on any scale.
            let is_void = depth[index] >= NO_DEPTH;
            let apart_in_kind = if is_void == (other_depth[index] >= NO_DEPTH) { 0.0 } else { 8.0 };
            let depth_apart = (depth[index] - other_depth[index]).abs() * depth_scale[index];
            let light_apart = (own_light[index] - other_light[index]).abs() * luminance_scale[index];
            *weight = falling(*weight + light_apart + depth_apart + apart_in_kind);
        }
    }
}

/// The variance estimate is itself noisy: its mean over the 3×3 neighbourhood, which steadies the luminance weights.
fn smoothed_variance(light: &Rows<LIGHT_CHANNELS>, y: usize) -> Vec<f32> {
    let rows = y.saturating_sub(1)..(y + 2).min(light.height);
    let mut along = vec![0.0_f32; light.width];
    for v in rows.clone() {
        along.iter_mut().zip(light.row(v, VARIANCE)).for_each(|(sum, value)| *sum += value);
    }
    (0..light.width)
        .map(|x| {
            let columns = x.saturating_sub(1)..(x + 2).min(light.width);
            let count = (columns.len() * rows.len()) as f32;
            along[columns].iter().sum::<f32>() / count
        })
        .collect()
}
