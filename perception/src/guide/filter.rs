//! The edge-avoiding passes.

use super::surfaces::{DEPTH, KIND, NORMAL_X, NORMAL_Y, NORMAL_Z, SLOPE, SURFACE_CHANNELS};
use super::{BLUE, GREEN, LIGHT_CHANNELS, LUMINANCE, RED, VARIANCE};
use crate::photometry::luminance;
use crate::rows::{BORDER, Rows, TILE, Window};
use glam::Vec4;

/// A neighbour this many standard errors away in luminance gets 1/e of the weight.
const LUMINANCE_SIGMAS: f32 = 3.0;
/// A neighbour this many times farther off than the surface's slope explains gets 1/e of the weight.
pub const DEPTH_SLOPES: f32 = 1.5;
/// A neighbour that differs by this share of the pixel's own luminance or depth gets 1/e of the weight where there is
/// neither noise nor slope.
const OWN_SHARE: f32 = 1e-3;
/// Keeps what is divided by from being 0 where there is neither light nor depth.
const NOTHING: f32 = 1e-12;
/// Power of the cosine between normals.
const NORMAL_SHARPNESS: f32 = 24.0;

/// Weights of a kernel's taps along an axis.
const TENT: [f32; 3] = [0.25, 0.5, 0.25];
/// Columns that are filtered at once: a vector register of the baseline.
const LANES: usize = 4;

/// Difference, where 1 gives 1/e of the weight, from which on a neighbour has none.
pub const GONE: f32 = 8.0;

/// About exp(−x), 0 from [`GONE`] on, without the cost of an exponential.
#[inline(always)]
fn falling(x: Vec4) -> Vec4 {
    let base = (1.0 - x / GONE).max(Vec4::ZERO);
    let fourth = base * base * base * base;
    fourth * fourth
}

/// One pass over a 3×3 kernel whose taps lie `hole` pixels apart, at most [`BORDER`]. All taps of a few columns at
/// once, so that sums stay in vector registers: tap by tap along whole rows it takes three times the instructions.
pub(super) fn filter_pass(
    light: &Rows<LIGHT_CHANNELS>,
    surfaces: &Rows<SURFACE_CHANNELS>,
    hole: usize,
) -> Rows<LIGHT_CHANNELS> {
    let (width, height) = (light.width, light.height);
    let mut filtered = Rows::new(width, height);
    filtered.for_each_row(|y, [red, green, blue, bright, variance]| {
        let scales = Scales::new(light, surfaces, hole, y);
        // Rows above, here and below; beyond the picture there are none.
        let rows = [y.checked_sub(hole), Some(y), Some(y + hole)].map(|v| v.filter(|v| *v < height));
        let mut views = [const { View::EMPTY }; 3];
        for tile in (0..width).step_by(TILE) {
            for (view, v) in views.iter_mut().zip(rows) {
                if let Some(v) = v {
                    light.show(v, tile, &mut view.light);
                    surfaces.show(v, tile, &mut view.surfaces);
                }
            }
            for column in (tile..width.min(tile + TILE)).step_by(LANES) {
                let at = BORDER + column - tile;
                let centers = Centers::new(&views[1], &scales, column, at);
                let mut sums = Sums::new(&centers);
                for ((view, row), tent) in views.iter().zip(rows).zip(TENT) {
                    if row.is_some() {
                        sums.add(&centers, view, [at - hole, at, at + hole], tent);
                    }
                }
                // The pixel's own weight is never 0.
                let scale = sums.weight.recip();
                write(red, column, sums.rgb[0] * scale);
                write(green, column, sums.rgb[1] * scale);
                write(blue, column, sums.rgb[2] * scale);
                write(variance, column, sums.variance * (scale * scale));
            }
        }
        for (x, bright) in bright.iter_mut().enumerate() {
            *bright = luminance([red[x], green[x], blue[x]]);
        }
    });
    filtered
}

/// Writes values to the columns from `column` on, as far as there are any.
fn write(row: &mut [f32], column: usize, values: Vec4) {
    match row[column..].first_chunk_mut::<LANES>() {
        Some(columns) => *columns = values.to_array(),
        None => row[column..].iter_mut().zip(values.to_array()).for_each(|(column, value)| *column = value),
    }
}

/// What is known of a row's pixels.
struct View {
    light: Window<LIGHT_CHANNELS>,
    surfaces: Window<SURFACE_CHANNELS>,
}

impl View {
    const EMPTY: Self = Self { light: [[0.0; _]; _], surfaces: [[0.0; _]; _] };

    /// A channel of the light from the column `at` of the window on.
    #[inline(always)]
    fn light(&self, channel: usize, at: usize) -> Vec4 {
        Vec4::from_slice(&self.light[channel][at..at + LANES])
    }

    /// A channel of the surfaces from the column `at` of the window on.
    #[inline(always)]
    fn surface(&self, channel: usize, at: usize) -> Vec4 {
        Vec4::from_slice(&self.surfaces[channel][at..at + LANES])
    }
}

/// How strongly the pixels of one row mind differences of luminance and depth.
struct Scales {
    luminance: Vec<f32>,
    depth: Vec<f32>,
}

impl Scales {
    /// The scales of row `y`, for whole groups of [`LANES`].
    fn new(light: &Rows<LIGHT_CHANNELS>, surfaces: &Rows<SURFACE_CHANNELS>, hole: usize, y: usize) -> Self {
        let mut luminance = smoothed_variance(light, y);
        for (variance, own) in luminance.iter_mut().zip(light.row(y, LUMINANCE)) {
            *variance = 1.0 / (LUMINANCE_SIGMAS * variance.sqrt() + OWN_SHARE * own + NOTHING);
        }
        let per_depth = |(depth, slope): (&f32, &f32)| {
            1.0 / (DEPTH_SLOPES * slope * hole as f32 + OWN_SHARE * depth.abs() + NOTHING)
        };
        let mut depth: Vec<f32> = surfaces.row(y, DEPTH).iter().zip(surfaces.row(y, SLOPE)).map(per_depth).collect();
        for scales in [&mut luminance, &mut depth] {
            scales.resize(light.width.next_multiple_of(LANES), 0.0);
        }
        Self { luminance, depth }
    }
}

/// Pixels side by side whose neighbours are weighed.
struct Centers {
    light: [Vec4; LIGHT_CHANNELS],
    normal: [Vec4; 3],
    /// [`NORMAL_SHARPNESS`], 0 where there is no normal.
    sharpness: Vec4,
    depth: Vec4,
    kind: Vec4,
    luminance_scale: Vec4,
    depth_scale: Vec4,
}

impl Centers {
    /// The pixels from column `at` of the window on, `column` of the picture.
    #[inline(always)]
    fn new(own: &View, scales: &Scales, column: usize, at: usize) -> Self {
        let normal = [own.surface(NORMAL_X, at), own.surface(NORMAL_Y, at), own.surface(NORMAL_Z, at)];
        let is_known = (normal[0].abs() + normal[1].abs() + normal[2].abs()).cmpgt(Vec4::ZERO);
        Self {
            light: std::array::from_fn(|channel| own.light(channel, at)),
            normal,
            sharpness: Vec4::select(is_known, Vec4::splat(NORMAL_SHARPNESS), Vec4::ZERO),
            depth: own.surface(DEPTH, at),
            kind: own.surface(KIND, at),
            luminance_scale: Vec4::from_slice(&scales.luminance[column..]),
            depth_scale: Vec4::from_slice(&scales.depth[column..]),
        }
    }

    /// Weights, without the kernel's, of the pixels from column `at` of a window on.
    #[inline(always)]
    fn weights(&self, row: &View, at: usize) -> Vec4 {
        let cosine = self.normal[0] * row.surface(NORMAL_X, at)
            + self.normal[1] * row.surface(NORMAL_Y, at)
            + self.normal[2] * row.surface(NORMAL_Z, at);
        let turned = self.sharpness * (1.0 - cosine).max(Vec4::ZERO);
        let other_depth = row.surface(DEPTH, at);
        // What is of another kind is no neighbour on any scale.
        let apart_in_kind = GONE * (self.kind - row.surface(KIND, at)).abs();
        let depth_apart = (self.depth - other_depth).abs() * self.depth_scale;
        let light_apart = (self.light[LUMINANCE] - row.light(LUMINANCE, at)).abs() * self.luminance_scale;
        falling(turned + light_apart + depth_apart + apart_in_kind)
    }
}

/// Weighted sums over the taps of pixels side by side.
struct Sums {
    rgb: [Vec4; 3],
    variance: Vec4,
    weight: Vec4,
}

impl Sums {
    /// Sums of the middle tap alone.
    #[inline(always)]
    fn new(centers: &Centers) -> Self {
        let own = TENT[1] * TENT[1];
        Self {
            rgb: [own * centers.light[RED], own * centers.light[GREEN], own * centers.light[BLUE]],
            variance: own * own * centers.light[VARIANCE],
            weight: Vec4::splat(own),
        }
    }

    /// Adds the taps at three places of a row, but not the centres themselves.
    #[inline(always)]
    fn add(&mut self, centers: &Centers, row: &View, places: [usize; 3], tent_y: f32) {
        for (at, tent_x) in places.into_iter().zip(TENT) {
            // The centres themselves are there already.
            if (tent_x, tent_y) == (TENT[1], TENT[1]) {
                continue;
            }
            let weights = centers.weights(row, at) * (tent_x * tent_y);
            self.rgb[0] += weights * row.light(RED, at);
            self.rgb[1] += weights * row.light(GREEN, at);
            self.rgb[2] += weights * row.light(BLUE, at);
            self.variance += weights * weights * row.light(VARIANCE, at);
            self.weight += weights;
        }
    }
}

/// The variance estimate is itself noisy: its mean over the 3×3 neighbourhood, which steadies the luminance weights.
fn smoothed_variance(light: &Rows<LIGHT_CHANNELS>, y: usize) -> Vec<f32> {
    let rows = y.saturating_sub(1)..(y + 2).min(light.height);
    let count = |columns: usize| (columns * rows.len()) as f32;
    let width = light.width;
    let mut along = vec![0.0_f32; width + 2];
    for v in rows.clone() {
        along[1..].iter_mut().zip(light.row(v, VARIANCE)).for_each(|(sum, value)| *sum += value);
    }
    let inside = count(3);
    let mut smoothed: Vec<f32> = along.windows(3).map(|three| (three[0] + three[1] + three[2]) / inside).collect();
    for x in [0, width - 1] {
        let beyond = usize::from(x == 0) + usize::from(x + 1 == width);
        smoothed[x] = (along[x] + along[x + 1] + along[x + 2]) / count(3 - beyond);
    }
    smoothed
}
