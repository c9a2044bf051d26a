//! The guide: a quickly denoised picture from which adaptation and masking are taken. It is never shown.

use std::ops::Range;

use rayon::prelude::*;

use crate::photometry::luminance;
use crate::plane::Plane;
use crate::rows::Rows;

/// A noisy picture and what is known of its surfaces. All slices are row-major with `width * height` entries.
#[derive(Clone, Copy, Debug)]
pub struct GuideInputs<'a> {
    /// Mean of the samples, linear RGB in cd/m² (or any unit; the result has the same).
    pub rgb: &'a [[f32; 3]],
    /// Variance of the mean's luminance, in the square of that unit.
    pub variance: &'a Plane,
    /// Albedo of the first surface, 0..1.
    pub albedo: &'a [[f32; 3]],
    /// Its normal, unit length, or 0 where there is none.
    pub normal: &'a [[f32; 3]],
    /// Its distance, in any unit; not finite where there is none.
    pub depth: &'a [f32],
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Passes of the filter, each with holes twice as wide: together a window of σ 13 pixels.
const PASSES: u32 = 5;
/// A neighbour this many standard errors away in luminance gets 1/e of the weight.
const LUMINANCE_SIGMAS: f32 = 3.0;
/// A neighbour this many times farther off than the surface's slope explains gets 1/e of the weight.
const DEPTH_SLOPES: f32 = 1.5;
/// Power of the cosine between normals.
const NORMAL_SHARPNESS: f32 = 24.0;
/// Albedos below this, by luminance, are not divided out.
const LEAST_ALBEDO: f32 = 0.02;
/// Stands for the depth where there is no surface.
const NO_DEPTH: f32 = 1e15;
/// Surfaces farther away than this are taken to be here.
const FARTHEST: f32 = 1e14;

// Channels of a row of illumination: light that falls on the surface, its luminance and that luminance's variance.
const LIGHT_CHANNELS: usize = 5;
const RED: usize = 0;
const GREEN: usize = 1;
const BLUE: usize = 2;
const LUMINANCE: usize = 3;
const VARIANCE: usize = 4;
// Channels of a row of surfaces.
const SURFACE_CHANNELS: usize = 5;
const NORMAL_X: usize = 0;
const NORMAL_Y: usize = 1;
const NORMAL_Z: usize = 2;
const DEPTH: usize = 3;
const SLOPE: usize = 4;

/// Removes noise from a picture as far as its surfaces and its variance tell noise from detail.
///
/// Illumination (the picture over its albedo, so that textures survive) goes through an edge-avoiding à-trous wavelet
/// filter (Dammertz et al., "Edge-avoiding À-Trous wavelet transform for fast global illumination filtering", 2010)
/// whose luminance weights follow the filtered variance (Schied et al., "Spatiotemporal variance-guided filtering",
/// 2017), over a 3×3 kernel. Before that, pixels far above everything around them are brought down: a firefly is no
/// light. The cost is linear in the number of pixels.
///
/// Slices of the wrong length give the picture back as it came. Values that are not finite count as 0.
#[must_use]
pub fn denoise(inputs: &GuideInputs<'_>) -> Vec<[f32; 3]> {
    let count = inputs.width * inputs.height;
    let whole = inputs.rgb.len() == count
        && inputs.albedo.len() == count
        && inputs.normal.len() == count
        && inputs.depth.len() == count
        && inputs.variance.width() == inputs.width
        && inputs.variance.height() == inputs.height;
    if !whole || count == 0 {
        return inputs.rgb.to_vec();
    }
    let mut light = illumination(inputs);
    tame_fireflies(&mut light);
    let surfaces = surfaces(inputs);
    for pass in 0..PASSES {
        light = filter_pass(&light, &surfaces, 1 << pass);
    }
    let mut denoised = vec![[0.0; 3]; count];
    denoised.par_chunks_mut(inputs.width).zip(inputs.albedo.par_chunks(inputs.width)).enumerate().for_each(
        |(y, (row, albedo))| {
            let [red, green, blue] = [RED, GREEN, BLUE].map(|channel| light.row(y, channel));
            for (x, (pixel, albedo)) in row.iter_mut().zip(albedo).enumerate() {
                let albedo = divisor(*albedo);
                *pixel = [red[x] * albedo[0], green[x] * albedo[1], blue[x] * albedo[2]];
            }
        },
    );
    denoised
}

/// What a pixel is divided by to leave its illumination.
fn divisor(albedo: [f32; 3]) -> [f32; 3] {
    let usable = albedo.iter().all(|channel| channel.is_finite()) && luminance(albedo) > LEAST_ALBEDO;
    if usable { albedo.map(|channel| channel.max(LEAST_ALBEDO)) } else { [1.0; 3] }
}

/// Light that falls on each pixel's surface.
fn illumination(inputs: &GuideInputs<'_>) -> Rows<LIGHT_CHANNELS> {
    let finite = |value: f32| {
        if value.is_finite() { value.clamp(0.0, 1e18) } else { 0.0 }
    };
    let width = inputs.width;
    let mut light = Rows::new(width, inputs.height);
    light.for_each_row(|y, [red, green, blue, bright, variance]| {
        for x in 0..width {
            let index = y * width + x;
            let albedo = divisor(inputs.albedo[index]);
            let rgb = [0, 1, 2].map(|channel| finite(inputs.rgb[index][channel]) / albedo[channel]);
            let scale = luminance(albedo);
            [red[x], green[x], blue[x]] = rgb;
            bright[x] = luminance(rgb);
            // Capped so that its square stays within f32.
            variance[x] = (finite(inputs.variance.values()[index]) / (scale * scale)).min(1e18);
        }
    });
    light
}

/// Brings pixels down to four standard deviations above the mean of their 5×5 neighbourhood, themselves left out.
fn tame_fireflies(light: &mut Rows<LIGHT_CHANNELS>) {
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

/// What is known of each pixel's surface, with values that need no checks: an infinite depth is [`NO_DEPTH`], a broken
/// normal 0.
fn surfaces(inputs: &GuideInputs<'_>) -> Rows<SURFACE_CHANNELS> {
    let width = inputs.width;
    let slopes = depth_slopes(inputs);
    let mut surfaces = Rows::new(width, inputs.height);
    surfaces.for_each_row(|y, [normal_x, normal_y, normal_z, depth, slope]| {
        for x in 0..width {
            let index = y * width + x;
            let normal = inputs.normal[index];
            let usable = normal.iter().all(|part| part.abs() <= 2.0);
            [normal_x[x], normal_y[x], normal_z[x]] = if usable { normal } else { [0.0; 3] };
            let own = inputs.depth[index];
            depth[x] = if own.is_finite() { own.clamp(-FARTHEST, FARTHEST) } else { NO_DEPTH };
            slope[x] = slopes[index].min(FARTHEST);
        }
    });
    surfaces
}

/// How much depth changes from a pixel to the next, taken on the flatter side so that silhouettes do not count.
fn depth_slopes(inputs: &GuideInputs<'_>) -> Vec<f32> {
    let (width, height, depth) = (inputs.width, inputs.height, inputs.depth);
    (0..depth.len())
        .into_par_iter()
        .map(|index| {
            let (x, y) = (index % width, index / width);
            let step = |other: Option<usize>| {
                other.map_or(f32::INFINITY, |other| {
                    let step = (depth[other] - depth[index]).abs();
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

/// About exp(−x), 0 from x = 8 on, without the cost of an exponential.
#[inline]
fn falling(x: f32) -> f32 {
    let base = (1.0 - x / 8.0).max(0.0);
    let fourth = base * base * base * base;
    fourth * fourth
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

/// One pass over a 3×3 kernel whose taps lie `hole` pixels apart. Tap by tap along whole rows, without branches, so that
/// the loop runs on vector registers.
fn filter_pass(light: &Rows<LIGHT_CHANNELS>, surfaces: &Rows<SURFACE_CHANNELS>, hole: usize) -> Rows<LIGHT_CHANNELS> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_noise::normal;

    const WIDTH: usize = 96;
    const HEIGHT: usize = 64;

    struct Picture {
        truth: Vec<[f32; 3]>,
        noisy: Vec<[f32; 3]>,
        variance: Plane,
        albedo: Vec<[f32; 3]>,
        normal: Vec<[f32; 3]>,
        depth: Vec<f32>,
    }

    /// A wall and a floor, striped by their albedo, under a shadow edge; noise of 30 %.
    fn picture(seed: u64) -> Picture {
        let mut state = seed;
        let pixels = || (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
        let albedo: Vec<[f32; 3]> =
            pixels().map(|(x, _)| if x % 8 < 4 { [0.8, 0.2, 0.3] } else { [0.3, 0.7, 0.4] }).collect();
        let normal_of = |y: usize| {
            if y < 32 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] }
        };
        let light = |x: usize, y: usize| {
            if y < 32 {
                50.0
            } else if x < 40 {
                100.0
            } else {
                10.0
            }
        };
        let truth: Vec<[f32; 3]> =
            pixels().zip(&albedo).map(|((x, y), albedo)| albedo.map(|channel| channel * light(x, y))).collect();
        let noisy: Vec<[f32; 3]> = truth
            .iter()
            .map(|rgb| {
                let factor = 1.0 + 0.3 * normal(&mut state);
                rgb.map(|channel| channel * factor.max(0.0))
            })
            .collect();
        let variance =
            Plane::from_values(WIDTH, HEIGHT, truth.iter().map(|rgb| (0.3 * luminance(*rgb)).powi(2)).collect());
        Picture {
            truth,
            noisy,
            variance: variance.unwrap(),
            albedo,
            normal: pixels().map(|(_, y)| normal_of(y)).collect(),
            depth: pixels().map(|(_, y)| if y < 32 { 5.0 } else { 5.0 - 0.05 * (y - 32) as f32 }).collect(),
        }
    }

    fn run(picture: &Picture) -> Vec<[f32; 3]> {
        denoise(&GuideInputs {
            rgb: &picture.noisy,
            variance: &picture.variance,
            albedo: &picture.albedo,
            normal: &picture.normal,
            depth: &picture.depth,
            width: WIDTH,
            height: HEIGHT,
        })
    }

    fn relative_error(found: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
        let squares: f64 = found
            .iter()
            .zip(truth)
            .map(|(found, truth)| f64::from(luminance(*found) / luminance(*truth) - 1.0).powi(2))
            .sum();
        (squares / found.len() as f64).sqrt()
    }

    #[test]
    fn most_of_the_noise_goes_and_the_edges_stay() {
        let picture = picture(1);
        let before = relative_error(&picture.noisy, &picture.truth);
        let after = relative_error(&run(&picture), &picture.truth);
        assert!(after < 0.25 * before, "relative error {before} → {after}");
    }

    #[test]
    fn a_firefly_does_not_spread() {
        let mut picture = picture(2);
        picture.noisy[20 * WIDTH + 30] = [1e6; 3];
        picture.variance.values_mut()[20 * WIDTH + 30] = 1e12;
        picture.noisy[50 * WIDTH + 70] = [f32::NAN, f32::INFINITY, 1.0];
        let result = run(&picture);
        let after = relative_error(&result, &picture.truth);
        assert!(after < 0.12, "{after}");
        assert!(result.iter().flatten().all(|value| value.is_finite()));
    }

    #[test]
    fn a_clean_picture_stays_as_it_is() {
        let mut picture = picture(3);
        picture.noisy.clone_from(&picture.truth);
        picture.variance = Plane::filled(WIDTH, HEIGHT, 0.0);
        assert!(relative_error(&run(&picture), &picture.truth) < 1e-3);
    }

    #[test]
    fn wrong_lengths_and_tiny_pictures_do_no_harm() {
        let rgb = [[1.0; 3]];
        let variance = Plane::filled(1, 1, 1.0);
        let mut inputs = GuideInputs {
            rgb: &rgb,
            variance: &variance,
            albedo: &rgb,
            normal: &rgb,
            depth: &[f32::INFINITY],
            width: 1,
            height: 1,
        };
        assert_eq!(denoise(&inputs), rgb);
        inputs.width = 7;
        assert_eq!(denoise(&inputs), rgb);
    }
}
