//! The guide: a quickly denoised picture from which adaptation and masking are taken. It is never shown.

use rayon::prelude::*;

use crate::photometry::luminance;
use crate::plane::Plane;

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
    tame_fireflies(&mut light, inputs.width, inputs.height);
    let slopes = depth_slopes(inputs);
    for pass in 0..PASSES {
        light = filter_pass(&light, inputs, &slopes, 1 << pass);
    }
    light
        .par_iter()
        .zip(inputs.albedo)
        .map(|(light, &albedo)| {
            let albedo = divisor(albedo);
            [0, 1, 2].map(|channel| light.rgb[channel] * albedo[channel])
        })
        .collect()
}

/// Light that falls on a pixel's surface, with the variance of its luminance.
#[derive(Clone, Copy, Debug, Default)]
struct Light {
    rgb: [f32; 3],
    luminance: f32,
    variance: f32,
}

/// What a pixel is divided by to leave its illumination.
fn divisor(albedo: [f32; 3]) -> [f32; 3] {
    let usable = albedo.iter().all(|channel| channel.is_finite()) && luminance(albedo) > LEAST_ALBEDO;
    if usable { albedo.map(|channel| channel.max(LEAST_ALBEDO)) } else { [1.0; 3] }
}

fn illumination(inputs: &GuideInputs<'_>) -> Vec<Light> {
    let finite = |value: f32| {
        if value.is_finite() { value.clamp(0.0, 1e18) } else { 0.0 }
    };
    (0..inputs.rgb.len())
        .into_par_iter()
        .map(|index| {
            let albedo = divisor(inputs.albedo[index]);
            let rgb = [0, 1, 2].map(|channel| finite(inputs.rgb[index][channel]) / albedo[channel]);
            let scale = luminance(albedo);
            // Capped so that its square stays within f32.
            let variance = (finite(inputs.variance.values()[index]) / (scale * scale)).min(1e18);
            Light { rgb, luminance: luminance(rgb), variance }
        })
        .collect()
}

/// Brings pixels down to four standard deviations above the mean of their 5×5 neighbourhood, themselves left out.
fn tame_fireflies(light: &mut Vec<Light>, width: usize, height: usize) {
    const RADIUS: usize = 2;
    let tamed = (0..light.len())
        .into_par_iter()
        .map(|index| {
            let (x, y) = (index % width, index / width);
            let (mut sum, mut squares, mut count) = (0.0_f32, 0.0_f32, 0.0_f32);
            for v in y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height) {
                for u in x.saturating_sub(RADIUS)..(x + RADIUS + 1).min(width) {
                    if (u, v) != (x, y) {
                        let value = light[v * width + u].luminance.min(1e15);
                        sum += value;
                        squares += value * value;
                        count += 1.0;
                    }
                }
            }
            let own = light[index];
            if count < 3.0 {
                return own;
            }
            let mean = sum / count;
            let limit = mean + 4.0 * (squares / count - mean * mean).max(0.0).sqrt();
            if own.luminance <= limit {
                return own;
            }
            let scale = limit / own.luminance;
            Light {
                rgb: own.rgb.map(|channel| channel * scale),
                luminance: limit,
                variance: own.variance * scale * scale,
            }
        })
        .collect();
    *light = tamed;
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
fn falling(x: f32) -> f32 {
    let base = (1.0 - x / 8.0).max(0.0);
    let fourth = base * base * base * base;
    fourth * fourth
}

fn filter_pass(light: &[Light], inputs: &GuideInputs<'_>, slopes: &[f32], hole: usize) -> Vec<Light> {
    const TENT: [f32; 3] = [0.25, 0.5, 0.25];
    let (width, height) = (inputs.width, inputs.height);
    let mut filtered = vec![Light::default(); light.len()];
    filtered.par_chunks_mut(width).with_min_len((4096 / width).max(1)).enumerate().for_each(|(y, row)| {
        for (x, result) in row.iter_mut().enumerate() {
            let index = y * width + x;
            let center = light[index];
            let depth = inputs.depth[index];
            let normal = inputs.normal[index];
            let luminance_scale = 1.0
                / (LUMINANCE_SIGMAS * smoothed_variance(light, width, height, x, y).sqrt()
                    + 1e-3 * center.luminance
                    + 1e-12);
            let relative_floor = if depth.is_finite() { 1e-3 * depth.abs() } else { 0.0 };
            let depth_scale = 1.0 / (DEPTH_SLOPES * slopes[index] * hole as f32 + relative_floor + 1e-12);
            let (mut rgb, mut variance, mut weight_sum) = ([0.0_f32; 3], 0.0_f32, 0.0_f32);
            for (dy, tent_y) in TENT.into_iter().enumerate() {
                let Some(v) = (y + dy * hole).checked_sub(hole).filter(|v| *v < height) else {
                    continue;
                };
                for (dx, tent_x) in TENT.into_iter().enumerate() {
                    let Some(u) = (x + dx * hole).checked_sub(hole).filter(|u| *u < width) else {
                        continue;
                    };
                    let other_index = v * width + u;
                    let other = light[other_index];
                    let weight = if other_index == index {
                        tent_x * tent_y
                    } else {
                        let other_depth = inputs.depth[other_index];
                        let depth_apart = match (depth.is_finite(), other_depth.is_finite()) {
                            (true, true) => (depth - other_depth).abs() * depth_scale,
                            (false, false) => 0.0,
                            _ => continue,
                        };
                        let normal_apart = NORMAL_SHARPNESS * (1.0 - dot(normal, inputs.normal[other_index])).max(0.0);
                        let apart = (center.luminance - other.luminance).abs() * luminance_scale
                            + depth_apart
                            + if normal == [0.0; 3] { 0.0 } else { normal_apart };
                        tent_x * tent_y * falling(apart)
                    };
                    for (sum, channel) in rgb.iter_mut().zip(other.rgb) {
                        *sum += weight * channel;
                    }
                    variance += weight * weight * other.variance;
                    weight_sum += weight;
                }
            }
            // The pixel's own weight is never 0.
            let rgb = rgb.map(|channel| channel / weight_sum);
            *result = Light { rgb, luminance: luminance(rgb), variance: variance / (weight_sum * weight_sum) };
        }
    });
    filtered
}

/// The variance estimate is itself noisy: a mean over the 3×3 neighbourhood steadies the luminance weights.
fn smoothed_variance(light: &[Light], width: usize, height: usize, x: usize, y: usize) -> f32 {
    let (mut sum, mut count) = (0.0, 0.0);
    for v in y.saturating_sub(1)..(y + 2).min(height) {
        for other in &light[v * width + x.saturating_sub(1)..v * width + (x + 2).min(width)] {
            sum += other.variance;
            count += 1.0;
        }
    }
    sum / count
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    let product = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // A broken normal agrees with nothing.
    if product.is_finite() { product } else { -1.0 }
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
