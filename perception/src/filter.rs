//! Windows that slide over a picture: Gaussian blur and erosion, reflected at the borders.
//!
//! All cost the same whatever the window's size, but for the Gaussian by its own samples, and none subtracts: a
//! running sum that takes a firefly of 1e20 back out would leave its rounding error all along the row.

use rayon::prelude::*;
use std::f64::consts::TAU;

use crate::plane::Plane;

/// Index of the pixel that stands at `index` when a row of `len` pixels is mirrored at its ends without end
/// (… 1 0 | 0 1 2 … n−1 | n−1 n−2 …).
pub(crate) fn reflect(index: isize, len: usize) -> usize {
    if index >= 0 && (index as usize) < len {
        return index as usize;
    }
    let period = 2 * len as isize;
    let inside = index.rem_euclid(period) as usize;
    if inside < len { inside } else { 2 * len - 1 - inside }
}

/// Columns worked on at once: enough to fill vector registers, few enough that a strip stays in the cache.
const LANES: usize = 16;
type Lanes = [f32; LANES];

/// `plane` convolved with a Gaussian of standard deviation `sigma_px`.
///
/// Three box filters with fractional ends, whose variance is exactly σ² (Gwosdek, Grewenig, Bruhn and Weickert,
/// "Theoretical foundations of Gaussian convolution by extended box filtering", 2011). Positive stays positive and the
/// mean is kept. A wide window slides over a reduced row, see [`Tent`].
pub(crate) fn gaussian_blur(plane: &Plane, sigma_px: f64) -> Plane {
    gaussian_blur_xy(plane, [sigma_px; 2])
}

/// [`gaussian_blur`] with a standard deviation of its own along each axis.
pub(crate) fn gaussian_blur_xy(plane: &Plane, sigma_px: [f64; 2]) -> Plane {
    blurred_by(plane, sigma_px, |sigma_px| {
        let kernel = BoxKernel::third_of_variance(sigma_px);
        move |strip: &mut Strip| (0..3).for_each(|_| kernel.apply(strip))
    })
}

/// Below, a pixel is wider than what would be sampled; above are thousands of taps, and no eye's loss of acuity: the
/// dimmest has 0.6°.
const SAMPLED_SIGMAS_PX: std::ops::RangeInclusive<f64> = 0.5..=500.0;

/// [`gaussian_blur_xy`] by the Gaussian's own samples, for where what is left of a grating matters and not the width
/// alone: of one of which a Gaussian leaves 0.0096 three boxes leave 0.0001. It has boxes outside
/// [`SAMPLED_SIGMAS_PX`].
pub(crate) fn sampled_gaussian_blur_xy(plane: &Plane, sigma_px: [f64; 2]) -> Plane {
    if !sigma_px.iter().all(|sigma_px| SAMPLED_SIGMAS_PX.contains(sigma_px)) {
        return gaussian_blur_xy(plane, sigma_px);
    }
    blurred_by(plane, sigma_px, |sigma_px| {
        let kernel = SampledKernel::of_sigma(sigma_px);
        move |strip: &mut Strip| kernel.apply(strip)
    })
}

/// Blurs along both axes, over reduced rows where the window is wide: `window_for` a standard deviation, of the row
/// as it then is.
fn blurred_by<Window: Fn(&mut Strip) + Sync>(
    plane: &Plane,
    [sigma_x_px, sigma_y_px]: [f64; 2],
    window_for: impl Fn(f64) -> Window,
) -> Plane {
    let blurred = |sigma_px: f64, len: usize| {
        // NaN blurs nothing.
        let is_wide = sigma_px >= 1e-3;
        // Beyond twice the row the mirrored picture is uniform anyway; the cap bounds the cost.
        let sigma_px = sigma_px.min(2.0 * len as f64);
        let tent = Tent::for_sigma(sigma_px, len);
        let window = window_for(tent.sigma_left(sigma_px));
        move |strip: &mut Strip| {
            if is_wide {
                tent.reduce(strip);
                window(strip);
                tent.enlarge(strip);
            }
        }
    };
    along_both_axes(plane, |len| blurred(sigma_y_px, len), |len| blurred(sigma_x_px, len))
}

/// What the squared weights sum to by which [`gaussian_blur`] makes each pixel of a row: one over the number of
/// pixels that count.
///
/// Σ_j k(x, j)² is the mirrored window of σ√2 at the pixel itself, as a sum over the pixel's mirror images.
pub(crate) fn squared_weights(sigma_px: f64, len: usize) -> Vec<f32> {
    let (len_px, sigma_px) = (len as f64, sigma_px.min(2.0 * len as f64));
    // Two such windows, one after the other.
    let variance = 2.0 * sigma_px * sigma_px;
    let height = (TAU * variance).sqrt().recip();
    let images = (6.0 * variance.sqrt() / (2.0 * len_px)).ceil() as i32 + 1;
    let at = |index: usize| {
        let from_images = (-images..=images).flat_map(|image| {
            let away = 2.0 * len_px * f64::from(image);
            [away, away + 2.0 * index as f64 + 1.0]
        });
        let sum: f64 = from_images.map(|distance| (-distance * distance / (2.0 * variance)).exp()).sum();
        // A window narrower than a pixel is the pixel.
        (height * sum).min(1.0) as f32
    };
    (0..len).map(at).collect()
}

/// The smallest value of `plane` within a square of half-width `radius_px` around each pixel.
pub(crate) fn erode(plane: &Plane, radius_px: usize) -> Plane {
    erode_xy(plane, radius_px, radius_px)
}

/// The smallest value of `plane` within a rectangle of these half-widths around each pixel.
pub(crate) fn erode_xy(plane: &Plane, radius_x_px: usize, radius_y_px: usize) -> Plane {
    let eroded = |radius_px: usize, len: usize| {
        let radius = radius_px.min(len);
        move |strip: &mut Strip| {
            strip.extend(radius);
            strip.slide(0, 2 * radius + 1, f32::INFINITY, f32::min, |window, _, _| window);
        }
    };
    along_both_axes(plane, |len| eroded(radius_y_px, len), |len| eroded(radius_x_px, len))
}

/// The largest value of `plane` within a rectangle of these half-widths around each pixel.
pub(crate) fn dilate_xy(plane: &Plane, radius_x_px: usize, radius_y_px: usize) -> Plane {
    erode_xy(&plane.map(|value| -value), radius_x_px, radius_y_px).map(|value| -value)
}

/// A few columns of a picture side by side, and the buffers one thread reuses from strip to strip.
#[derive(Default)]
struct Strip {
    values: Vec<Lanes>,
    extended: Vec<Lanes>,
    suffix: Vec<Lanes>,
}

impl Strip {
    /// Takes up to [`LANES`] columns of `plane` from `first` on; lanes left over repeat the last one.
    fn load(&mut self, plane: &Plane, first: usize) {
        let count = (plane.width() - first).min(LANES);
        self.values.clear();
        self.values.extend((0..plane.height()).map(|y| {
            let source = &plane.row(y)[first..first + count];
            let mut lanes = [source[count - 1]; LANES];
            lanes[..count].copy_from_slice(source);
            lanes
        }));
    }

    /// Copies the values with `pad` reflected ones on each side.
    fn extend(&mut self, pad: usize) {
        let (values, len) = (&self.values, self.values.len());
        self.extended.clear();
        self.extended.extend((0..pad).map(|index| values[reflect(index as isize - pad as isize, len)]));
        self.extended.extend_from_slice(values);
        self.extended.extend((0..pad).map(|index| values[reflect((len + index) as isize, len)]));
    }

    /// Sets every value to `finish(join over the window, element before it, element after it)`, the window of `window`
    /// elements starting `offset` elements after the value's place in the extended column.
    ///
    /// Van Herk's trick: with the column cut into blocks as long as the window, every window is the end of one block
    /// joined to the start of the next. `neutral` is what `join` leaves unchanged.
    fn slide(
        &mut self,
        offset: usize,
        window: usize,
        neutral: f32,
        join: impl Fn(f32, f32) -> f32,
        finish: impl Fn(f32, f32, f32) -> f32,
    ) {
        let extended = &self.extended;
        self.suffix.resize(window, [neutral; LANES]);
        for (block, values) in self.values.chunks_mut(window).enumerate() {
            let start = offset + block * window;
            let mut running = [neutral; LANES];
            for (suffix, lanes) in self.suffix.iter_mut().zip(&extended[start..start + window]).rev() {
                for lane in 0..LANES {
                    running[lane] = join(running[lane], lanes[lane]);
                }
                *suffix = running;
            }
            let mut prefix = [neutral; LANES];
            for (index, (value, suffix)) in values.iter_mut().zip(&self.suffix).enumerate() {
                if index > 0 {
                    let next = &extended[start + window + index - 1];
                    for lane in 0..LANES {
                        prefix[lane] = join(prefix[lane], next[lane]);
                    }
                }
                // Without offset nothing stands before the first window, nor need anything stand after the last.
                let before = &extended[(start + index).saturating_sub(1)];
                let after = &extended[(start + index + window).min(extended.len() - 1)];
                for lane in 0..LANES {
                    value[lane] = finish(join(suffix[lane], prefix[lane]), before[lane], after[lane]);
                }
            }
        }
    }
}

/// Rows reduced by whole factors and enlarged again, each way with a tent of a block's half-width: one is the other's
/// transpose, and both keep the mean and the mirror at the row's ends, so a blur between them stays symmetric.
#[derive(Clone, Copy, Debug)]
struct Tent {
    factor: usize,
}

impl Tent {
    /// The largest power of two that divides the row and leaves the window a σ of at least 3.5 samples.
    fn for_sigma(sigma_px: f64, len: usize) -> Self {
        let mut factor = 1;
        while factor < 8 && len.is_multiple_of(2 * factor) && sigma_px >= 3.5 * (2 * factor) as f64 {
            factor *= 2;
        }
        Self { factor }
    }

    /// What is left of a Gaussian's σ, in reduced samples, when both tents have had their share of its variance.
    fn sigma_left(self, sigma_px: f64) -> f64 {
        if self.factor == 1 {
            return sigma_px;
        }
        let factor = self.factor as f64;
        // A pixel a share `a` of the way to the next sample gains factor² a (1 − a); the mean over a block, twice.
        let tents = (2.0 * factor * factor + 1.0) / 6.0;
        (sigma_px * sigma_px - tents).sqrt() / factor
    }

    /// The share of pixel `offset` of a block that belongs to the neighbouring block on its side.
    fn share(self, offset: usize) -> f32 {
        let from_center = offset as f32 - 0.5 * (self.factor - 1) as f32;
        from_center.abs() / self.factor as f32
    }

    /// The block besides its own that pixel `offset` of `block` belongs to, the row mirrored at its ends.
    fn neighbour(self, block: usize, offset: usize, blocks: usize) -> usize {
        if 2 * offset < self.factor { block.saturating_sub(1) } else { (block + 1).min(blocks - 1) }
    }

    fn reduce(self, strip: &mut Strip) {
        if self.factor == 1 {
            return;
        }
        let blocks = strip.values.len() / self.factor;
        let scale = (self.factor as f32).recip();
        strip.extended.clear();
        strip.extended.resize(blocks, [0.0; LANES]);
        for (block, pixels) in strip.values.chunks_exact(self.factor).enumerate() {
            for (offset, pixel) in pixels.iter().enumerate() {
                let share = self.share(offset);
                let neighbour = self.neighbour(block, offset, blocks);
                for (sum, value) in strip.extended[block].iter_mut().zip(pixel) {
                    *sum += (1.0 - share) * scale * value;
                }
                for (sum, value) in strip.extended[neighbour].iter_mut().zip(pixel) {
                    *sum += share * scale * value;
                }
            }
        }
        std::mem::swap(&mut strip.values, &mut strip.extended);
    }

    fn enlarge(self, strip: &mut Strip) {
        if self.factor == 1 {
            return;
        }
        let blocks = strip.values.len();
        strip.extended.clear();
        for block in 0..blocks {
            for offset in 0..self.factor {
                let share = self.share(offset);
                let (own, other) = (&strip.values[block], &strip.values[self.neighbour(block, offset, blocks)]);
                let mut lanes = [0.0; LANES];
                for lane in 0..LANES {
                    lanes[lane] = (1.0 - share) * own[lane] + share * other[lane];
                }
                strip.extended.push(lanes);
            }
        }
        std::mem::swap(&mut strip.values, &mut strip.extended);
    }
}

/// A box of 2r + 1 ones with a fraction at each end.
#[derive(Clone, Copy, Debug)]
struct BoxKernel {
    radius: usize,
    end_weight: f32,
    scale: f32,
}

impl BoxKernel {
    /// The box that, applied three times, has standard deviation `sigma_px`.
    fn third_of_variance(sigma_px: f64) -> Self {
        let variance = sigma_px * sigma_px / 3.0;
        let radius = (((12.0 * variance + 1.0).sqrt() - 1.0) / 2.0).floor();
        let length = 2.0 * radius + 1.0;
        let end = length * (variance - radius * (radius + 1.0) / 3.0) / (2.0 * ((radius + 1.0).powi(2) - variance));
        Self { radius: radius as usize, end_weight: end as f32, scale: (length + 2.0 * end).recip() as f32 }
    }

    fn apply(self, strip: &mut Strip) {
        strip.extend(self.radius + 1);
        let Self { radius, end_weight, scale } = self;
        strip.slide(
            1,
            2 * radius + 1,
            0.0,
            |a, b| a + b,
            |sum, before, after| (sum + end_weight * (before + after)) * scale,
        );
    }
}

/// A Gaussian's samples: one half of it, from its middle on, whose sum with the mirrored other half is 1.
struct SampledKernel {
    half: Vec<f32>,
}

impl SampledKernel {
    /// Standard deviations that it reaches over: what is cut off would leave 1e-5 of a grating.
    const REACH: f64 = 4.5;

    fn of_sigma(sigma_px: f64) -> Self {
        let radius = (Self::REACH * sigma_px).ceil() as usize;
        let sample = |index: usize| (-0.5 * (index as f64 / sigma_px).powi(2)).exp();
        let sum = 1.0 + 2.0 * (1..=radius).map(sample).sum::<f64>();
        Self { half: (0..=radius).map(|index| (sample(index) / sum) as f32).collect() }
    }

    fn apply(&self, strip: &mut Strip) {
        let radius = self.half.len() - 1;
        strip.extend(radius);
        let extended = &strip.extended;
        for (index, value) in strip.values.iter_mut().enumerate() {
            let middle = index + radius;
            *value = extended[middle].map(|lane| self.half[0] * lane);
            for (offset, weight) in self.half.iter().enumerate().skip(1) {
                let (before, after) = (&extended[middle - offset], &extended[middle + offset]);
                for lane in 0..LANES {
                    value[lane] += weight * (before[lane] + after[lane]);
                }
            }
        }
    }
}

/// Runs an operation along y, then one along x. Each `for` gets the length of the columns or rows it will see.
fn along_both_axes<Down, Across>(
    plane: &Plane,
    down_for: impl Fn(usize) -> Down,
    across_for: impl Fn(usize) -> Across,
) -> Plane
where
    Down: Fn(&mut Strip) + Sync,
    Across: Fn(&mut Strip) + Sync,
{
    if plane.values().is_empty() {
        return plane.clone();
    }
    let turned = run_columns(plane, &down_for(plane.height()));
    run_columns(&turned, &across_for(plane.width()))
}

/// Runs an operation along every column; the result is transposed, so that a second run works on the rows.
fn run_columns(plane: &Plane, operation: &(impl Fn(&mut Strip) + Sync)) -> Plane {
    let height = plane.height();
    let mut result = Plane::filled(height, plane.width(), 0.0);
    result.values_mut().par_chunks_mut(LANES * height).enumerate().for_each_init(
        Strip::default,
        |strip, (index, rows)| {
            strip.load(plane, index * LANES);
            operation(strip);
            // Sixteen values at a time: what is read sixteen times stays at hand.
            for (block, values) in strip.values.chunks(LANES).enumerate() {
                for (lane, row) in rows.chunks_exact_mut(height).enumerate() {
                    for (value, lanes) in row[block * LANES..].iter_mut().zip(values) {
                        *value = lanes[lane];
                    }
                }
            }
        },
    );
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflection_mirrors_without_end() {
        let indices: Vec<usize> = (-4..7).map(|index| reflect(index, 3)).collect();
        assert_eq!(indices, [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0]);
        assert_eq!(reflect(-1000, 1), 0);
    }

    /// At borders, where the mirrored window covers a pixel twice, and where it is wider than the row.
    #[test]
    fn squared_weights_are_those_of_the_blur() {
        for (sigma_px, len) in [(3.0, 40), (9.0, 40), (30.0, 40), (2.0, 1)] {
            let window = |from: usize| {
                let spike = Plane::from_fn(len, 1, |x, _| if x == from { 1.0 } else { 0.0 });
                gaussian_blur_xy(&spike, [sigma_px, 0.0])
            };
            let windows: Vec<Plane> = (0..len).map(window).collect();
            for (x, sum) in squared_weights(sigma_px, len).into_iter().enumerate() {
                let of_windows: f32 = windows.iter().map(|window| window.get(x, 0).powi(2)).sum();
                // Three boxes are no Gaussian: ∫k² is 11/40 σ⁻¹ for 1/(2√π) σ⁻¹, 2.6 % less, and rows are reduced.
                assert!((sum / of_windows - 1.0).abs() < 0.04, "σ {sigma_px}, {x} of {len}: {sum} for {of_windows}");
            }
        }
    }

    #[test]
    fn blur_has_the_variance_it_is_asked_for() {
        for sigma in [0.3, 1.0, 2.7, 9.5] {
            let mut spike = Plane::filled(129, 129, 0.0);
            spike.values_mut()[64 * 129 + 64] = 1.0;
            let blurred = gaussian_blur(&spike, sigma);
            let mut variance = 0.0;
            for y in 0..129 {
                for x in 0..129 {
                    variance += f64::from(blurred.get(x, y)) * (x as f64 - 64.0).powi(2);
                }
            }
            assert!((variance / (sigma * sigma) - 1.0).abs() < 1e-4, "σ {sigma}: variance {variance}");
            assert!((blurred.mean() * 129.0 * 129.0 - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn blur_keeps_the_mean_of_any_picture_of_any_size() {
        for (width, height) in [(1, 1), (1, 7), (5, 3), (64, 33), (96, 200)] {
            let plane = Plane::from_fn(width, height, |x, y| ((x * 7 + y * 13) % 11) as f32);
            let blurred = gaussian_blur(&plane, 12.0);
            assert!((blurred.mean() - plane.mean()).abs() < 1e-4 * (1.0 + plane.mean()));
        }
    }

    /// On average over where a spike stands in its block the variance is as asked for, and anywhere within 1 %.
    #[test]
    fn a_wide_blur_over_reduced_rows_is_as_wide() {
        for sigma in [7.5, 15.0, 31.0] {
            let mut mean = 0.0;
            for spike in 256..264 {
                let mut plane = Plane::filled(512, 1, 0.0);
                plane.values_mut()[spike] = 1.0;
                let blurred = gaussian_blur(&plane, sigma);
                let moment = |power: i32| -> f64 {
                    (0..512).map(|x| f64::from(blurred.get(x, 0)) * (x as f64 - spike as f64).powi(power)).sum()
                };
                let (center, variance) = (moment(1), moment(2) / (sigma * sigma));
                assert!(center.abs() < 1e-3 && (variance - 1.0).abs() < 0.02, "σ {sigma}: {center}, {variance}");
                mean += variance / 8.0;
            }
            assert!((mean - 1.0).abs() < 1e-3, "σ {sigma}: {mean}");
        }
    }

    #[test]
    fn a_firefly_leaves_nothing_far_away() {
        let mut plane = Plane::filled(200, 3, 1e-3);
        plane.values_mut()[200 + 20] = 1e20;
        let blurred = gaussian_blur(&plane, 3.0);
        assert!((blurred.get(150, 1) / 1e-3 - 1.0).abs() < 1e-4);
    }

    #[test]
    fn erosion_is_the_minimum_of_the_square() {
        let plane = Plane::from_fn(37, 23, |x, y| ((x * 31 + y * 17) % 101) as f32);
        for radius in [1, 3, 30] {
            let eroded = erode(&plane, radius);
            for y in 0..23_usize {
                for x in 0..37_usize {
                    let mut least = f32::INFINITY;
                    for v in y.saturating_sub(radius)..(y + radius + 1).min(23) {
                        for u in x.saturating_sub(radius)..(x + radius + 1).min(37) {
                            least = least.min(plane.get(u, v));
                        }
                    }
                    assert_eq!(eroded.get(x, y), least, "({x}, {y}) radius {radius}");
                }
            }
        }
    }
}
