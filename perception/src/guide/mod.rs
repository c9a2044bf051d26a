//! The guide: a quickly denoised picture from which adaptation and masking are taken. It is never shown.
//!
//! Not for a picture that is to be kept: what is far above all around it is brought down, and that light is lost.

mod filter;
mod fireflies;
mod surfaces;

use rayon::prelude::*;

use crate::photometry::luminance;
use crate::plane::Plane;
use crate::rows::{BORDER, Rows};
use filter::filter_pass;
use fireflies::tame_fireflies;
use surfaces::surfaces;

pub use filter::{DEPTH_SLOPES, GONE};
pub use surfaces::{BEYOND, FARTHEST_SURFACE, depth_slopes};

/// A noisy picture and what is known of its surfaces. All slices are row-major with `width * height` entries.
#[derive(Clone, Copy, Debug)]
pub struct GuideInputs<'a> {
    /// Mean of the samples, linear RGB in cd/m², or another unit in which light lies between 1e-5 and 1e9; the result
    /// has the same.
    pub rgb: &'a [[f32; 3]],
    /// Variance of the mean's luminance, in the square of that unit.
    pub variance: &'a Plane,
    /// Albedo of the first surface, 0..1.
    pub albedo: &'a [[f32; 3]],
    /// Normal of the first surface, of unit length, or 0 where there is none.
    pub normal: &'a [[f32; 3]],
    /// Distance of the first surface, in any unit. Not finite where there is none, which is a neighbour of nothing
    /// else. A mean over samples of which some met nothing, counted as 0, is fine as well: such pixels are told apart
    /// as surfaces that are nearer.
    pub depth: &'a [f32],
    /// Columns of the picture, pixels.
    pub width: usize,
    /// Rows of the picture, pixels.
    pub height: usize,
}

/// Passes of the filter, each with holes twice as wide: together a window of σ 13 pixels.
const PASSES: u32 = 5;
const _: () = assert!(1 << (PASSES - 1) <= BORDER, "the widest hole reads beyond the border of a row");
/// Albedos below this, by luminance, are not divided out.
const MIN_ALBEDO: f32 = 0.02;
// Channels of a row of illumination: light that falls on the surface, its luminance and that luminance's variance.
const LIGHT_CHANNELS: usize = 5;
const RED: usize = 0;
const GREEN: usize = 1;
const BLUE: usize = 2;
const LUMINANCE: usize = 3;
const VARIANCE: usize = 4;
/// Removes noise from a picture as far as its surfaces and its variance tell noise from detail.
///
/// Illumination (the picture over its albedo, so that textures survive) goes through an edge-avoiding à-trous wavelet
/// filter (Dammertz et al., "Edge-avoiding À-Trous wavelet transform for fast global illumination filtering", 2010)
/// whose luminance weights follow the filtered variance (Schied et al., "Spatiotemporal variance-guided filtering",
/// 2017), over a 3×3 kernel. Before that, pixels far above everything around them are brought down: a firefly is no
/// light. What is too dark to be divided by its albedo is in another unit than what is not, and the two are no
/// neighbours. The cost is linear in the number of pixels.
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
    let surfaces = surfaces(inputs);
    tame_fireflies(&mut light, &surfaces);
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

/// What a pixel is divided by to leave its illumination: its albedo, 0.02 at the least in each channel; 1 where that
/// is darker by luminance, or not finite.
#[must_use]
pub fn divisor(albedo: [f32; 3]) -> [f32; 3] {
    if is_divided(albedo) { albedo.map(|channel| channel.max(MIN_ALBEDO)) } else { [1.0; 3] }
}

/// Whether a pixel's light is divided by its albedo: what is not is in another unit, and no neighbour of what is.
fn is_divided(albedo: [f32; 3]) -> bool {
    albedo.iter().all(|channel| channel.is_finite()) && luminance(albedo) > MIN_ALBEDO
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

#[cfg(test)]
mod tests;
