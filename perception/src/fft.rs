//! Real 2-D Fourier transforms of pictures mirrored at their borders.

use std::sync::{Arc, LazyLock, Mutex};

use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};

use crate::filter::reflect;
use crate::plane::Plane;

/// The largest factor of [`PictureTransform::filtered_reduced`].
pub(crate) const MOST_REDUCTION: usize = 16;

/// The transform of one picture size. Making one is cheap: plans are kept for the life of the program.
pub(crate) struct PictureTransform {
    width: usize,
    height: usize,
    pad: usize,
    padded_width: usize,
    padded_height: usize,
    rows_forward: Arc<dyn RealToComplex<f32>>,
    columns_forward: Arc<dyn Fft<f32>>,
}

/// A picture's spectrum: one line for each horizontal frequency, the vertical frequencies along it.
pub(crate) struct Spectrum {
    bins: Vec<Complex32>,
}

struct Planners {
    real: RealFftPlanner<f32>,
    complex: FftPlanner<f32>,
}

static PLANNERS: LazyLock<Mutex<Planners>> =
    LazyLock::new(|| Mutex::new(Planners { real: RealFftPlanner::new(), complex: FftPlanner::new() }));

/// The smallest number ≥ `least` without prime factors other than 2, 3 and 5.
pub(crate) fn smooth_size(least: usize) -> usize {
    (least.max(1)..)
        .find(|&size| {
            let mut rest = size;
            for factor in [2, 3, 5] {
                while rest.is_multiple_of(factor) {
                    rest /= factor;
                }
            }
            rest == 1
        })
        .unwrap_or(least)
}

impl PictureTransform {
    /// For pictures of `width` × `height`, mirrored by at least `pad` pixels on every side.
    pub(crate) fn new(width: usize, height: usize, pad: usize) -> Self {
        // Multiples of the largest reduction, so that reduced transforms sample the same pixels.
        let pad = pad.max(1).next_multiple_of(MOST_REDUCTION);
        let padded = |len: usize| MOST_REDUCTION * smooth_size((len + 2 * pad).div_ceil(MOST_REDUCTION));
        let (padded_width, padded_height) = (padded(width), padded(height));
        // A poisoned lock only means that another thread died while planning; the plans made so far are whole.
        let mut planners = PLANNERS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        Self {
            width,
            height,
            pad,
            padded_width,
            padded_height,
            rows_forward: planners.real.plan_fft_forward(padded_width),
            columns_forward: planners.complex.plan_fft_forward(padded_height),
        }
    }

    /// Horizontal frequencies kept: 0 up to Nyquist.
    fn columns(&self) -> usize {
        self.padded_width / 2 + 1
    }

    /// The spectrum of `plane`, which must have this transform's size.
    pub(crate) fn forward(&self, plane: &Plane) -> Spectrum {
        let columns = self.columns();
        let zero = Complex32::default();
        let mut by_row = vec![zero; columns * self.padded_height];
        by_row.par_chunks_mut(columns).enumerate().for_each_init(
            || (self.rows_forward.make_input_vec(), self.rows_forward.make_scratch_vec()),
            |(row, scratch), (y, bins)| {
                let source = plane.row(reflect(y as isize - self.pad as isize, self.height));
                for (x, value) in row.iter_mut().enumerate() {
                    *value = source[reflect(x as isize - self.pad as isize, self.width)];
                }
                // Lengths come from the same plan, the only thing this call can complain of.
                let _ = self.rows_forward.process_with_scratch(row, bins, scratch);
            },
        );
        let mut bins = vec![zero; columns * self.padded_height];
        transpose(&by_row, &mut bins, columns, self.padded_height);
        bins.par_chunks_mut(self.padded_height).for_each_init(
            || vec![zero; self.columns_forward.get_inplace_scratch_len()],
            |scratch, column| self.columns_forward.process_with_scratch(column, scratch),
        );
        Spectrum { bins }
    }

    /// The picture whose spectrum is `spectrum` with every bin multiplied by `gain(freq_cpd)`, at every `factor`-th pixel
    /// only, from pixel −`factor` on until past the picture's end: sample j stands at pixel (j − 1) · `factor`.
    ///
    /// `limit_cpd` is a frequency above which `gain` is zero (infinite if there is none): columns beyond it are not
    /// transformed. `factor` must be one of 1, 2, 4, 8, 16, and leave room for `limit_cpd`.
    pub(crate) fn filtered_reduced(
        &self,
        spectrum: &Spectrum,
        pixels_per_degree: f64,
        limit_cpd: f64,
        factor: usize,
        gain: impl Fn(f32) -> f32 + Sync,
    ) -> Plane {
        let mut planners = PLANNERS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let back = BackTransform {
            columns: planners.complex.plan_fft_inverse(self.padded_height / factor),
            rows: planners.real.plan_fft_inverse(self.padded_width / factor),
            factor,
            first: self.pad / factor - 1,
            width: reduced_size(self.width, factor),
            height: reduced_size(self.height, factor),
        };
        drop(planners);
        self.run_back(&back, spectrum, pixels_per_degree, limit_cpd, gain)
    }

    fn run_back(
        &self,
        back: &BackTransform,
        spectrum: &Spectrum,
        pixels_per_degree: f64,
        limit_cpd: f64,
        gain: impl Fn(f32) -> f32 + Sync,
    ) -> Plane {
        let all_rows = self.padded_height;
        let rows = all_rows / back.factor;
        let row_length = self.padded_width / back.factor;
        let columns = row_length / 2 + 1;
        let zero = Complex32::default();
        let step_x = (pixels_per_degree / self.padded_width as f64) as f32;
        let step_y = (pixels_per_degree / all_rows as f64) as f32;
        let scale = 1.0 / (self.padded_width as f32 * all_rows as f32);
        let mut bins = vec![zero; columns * rows];
        bins.par_chunks_mut(rows).zip(spectrum.bins.par_chunks(all_rows)).enumerate().for_each_init(
            || vec![zero; back.columns.get_inplace_scratch_len()],
            |scratch, (kx, (filtered, source))| {
                let freq_x = kx as f32 * step_x;
                if f64::from(freq_x) > limit_cpd {
                    return;
                }
                for (ky, bin) in filtered.iter_mut().enumerate() {
                    // Negative frequencies stand at the end.
                    let source_ky = if 2 * ky <= rows { ky } else { all_rows - (rows - ky) };
                    let freq_y = ky.min(rows - ky) as f32 * step_y;
                    *bin = source[source_ky] * (gain((freq_x * freq_x + freq_y * freq_y).sqrt()) * scale);
                }
                back.columns.process_with_scratch(filtered, scratch);
            },
        );
        let mut by_row = vec![zero; columns * rows];
        transpose(&bins, &mut by_row, rows, columns);
        // Only the rows that are asked for come back.
        let kept = back.first * columns..(back.first + back.height) * columns;
        let mut picture = Plane::filled(back.width, back.height, 0.0);
        picture.values_mut().par_chunks_mut(back.width).zip(by_row[kept].par_chunks_mut(columns)).for_each_init(
            || (back.rows.make_output_vec(), back.rows.make_scratch_vec()),
            |(row, scratch), (values, bins)| {
                // The transform of a real row has real ends; rounding leaves a trace that the plan would refuse.
                bins[0].im = 0.0;
                if row_length.is_multiple_of(2) {
                    bins[columns - 1].im = 0.0;
                }
                let _ = back.rows.process_with_scratch(bins, row, scratch);
                values.copy_from_slice(&row[back.first..back.first + back.width]);
            },
        );
        picture
    }
}

/// Plans and frame of a way back from the spectrum.
struct BackTransform {
    columns: Arc<dyn Fft<f32>>,
    rows: Arc<dyn ComplexToReal<f32>>,
    /// Every how many-th pixel comes back.
    factor: usize,
    /// The first row and column kept, in samples.
    first: usize,
    width: usize,
    height: usize,
}

/// Samples of a row of `len` pixels at every `factor`-th pixel, one before the first and one past the last included.
pub(crate) fn reduced_size(len: usize, factor: usize) -> usize {
    (len - 1) / factor + 3
}

/// The pixel at which reduced sample `index` stands, or the nearest one of a picture `len` pixels long.
pub(crate) fn reduced_pixel(index: usize, factor: usize, len: usize) -> usize {
    (index * factor).saturating_sub(factor).min(len - 1)
}

/// The largest reduction that still samples frequencies up to `limit_cpd`.
pub(crate) fn reduction(pixels_per_degree: f64, limit_cpd: f64) -> usize {
    let mut factor = 1;
    while factor < MOST_REDUCTION && pixels_per_degree / (4 * factor) as f64 >= limit_cpd {
        factor *= 2;
    }
    factor
}

/// A plane of `width` × `height` pixels, interpolated linearly from one at every `factor`-th pixel (see
/// [`PictureTransform::filtered_reduced`]).
pub(crate) fn enlarged(reduced: &Plane, factor: usize, width: usize, height: usize) -> Plane {
    let step = (factor as f32).recip();
    let mut plane = Plane::filled(width, height, 0.0);
    let mut across = Plane::filled(width, reduced.height(), 0.0);
    across.for_each_row_mut(|y, row| {
        let source = reduced.row(y);
        for (block, values) in row.chunks_mut(factor).enumerate() {
            let (from, to) = (source[block + 1], source[block + 2]);
            for (offset, value) in values.iter_mut().enumerate() {
                *value = from + (to - from) * (offset as f32 * step);
            }
        }
    });
    plane.for_each_row_mut(|y, row| {
        let (above, below) = (across.row(y / factor + 1), across.row(y / factor + 2));
        let fraction = (y % factor) as f32 * step;
        for (value, (above, below)) in row.iter_mut().zip(above.iter().zip(below)) {
            *value = above + (below - above) * fraction;
        }
    });
    plane
}

/// `source` has rows of `width` bins; `target` gets them as columns.
fn transpose(source: &[Complex32], target: &mut [Complex32], width: usize, height: usize) {
    const STRIP: usize = 8;
    target.par_chunks_mut(STRIP * height).enumerate().for_each(|(strip, rows)| {
        for y in 0..height {
            let line = &source[y * width + strip * STRIP..];
            for (row, value) in rows.chunks_exact_mut(height).zip(line) {
                row[y] = *value;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At every pixel.
    fn filtered(
        transform: &PictureTransform,
        spectrum: &Spectrum,
        pixels_per_degree: f64,
        limit_cpd: f64,
        gain: impl Fn(f32) -> f32 + Sync,
    ) -> Plane {
        let whole = transform.filtered_reduced(spectrum, pixels_per_degree, limit_cpd, 1, gain);
        enlarged(&whole, 1, transform.width, transform.height)
    }

    #[test]
    fn smooth_sizes() {
        assert_eq!([1, 7, 11, 632, 1021].map(smooth_size), [1, 8, 12, 640, 1024]);
    }

    #[test]
    fn a_gain_of_one_gives_the_picture_back() {
        for (width, height) in [(1, 1), (1, 5), (7, 3), (48, 31)] {
            let plane = Plane::from_fn(width, height, |x, y| ((x * 7 + y * 13) % 11) as f32);
            let transform = PictureTransform::new(width, height, 9);
            let back = filtered(&transform, &transform.forward(&plane), 30.0, f64::INFINITY, |_| 1.0);
            for (found, expected) in back.values().iter().zip(plane.values()) {
                assert!((found - expected).abs() < 1e-4, "{width}×{height}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn frequencies_are_cycles_per_degree() {
        // 3 cycles in 64 pixels at 32 pixels a degree: 1.5 cpd along y; with 16 pixels of mirror on each side, a third of
        // the padded 96 rows is still whole half waves.
        let plane = Plane::from_fn(16, 64, |_, y| (std::f32::consts::TAU * 3.0 * (y as f32 + 0.5) / 64.0).cos());
        let transform = PictureTransform::new(16, 64, 32);
        let spectrum = transform.forward(&plane);
        let kept = filtered(&transform, &spectrum, 32.0, f64::INFINITY, |freq| f32::from((freq - 1.5).abs() < 0.01));
        let lost = filtered(&transform, &spectrum, 32.0, 1.6, |freq| f32::from((freq - 1.5).abs() > 0.01));
        for ((kept, lost), expected) in kept.values().iter().zip(lost.values()).zip(plane.values()) {
            assert!((kept - expected).abs() < 1e-5 && lost.abs() < 1e-5);
        }
    }

    #[test]
    fn a_reduced_transform_samples_the_whole_one() {
        let plane = Plane::from_fn(75, 42, |x, y| (x as f32 * 0.13).sin() + (y as f32 * 0.1 + x as f32 * 0.02).cos());
        let transform = PictureTransform::new(75, 42, 30);
        let spectrum = transform.forward(&plane);
        // A smooth low-pass that ends at 2 cpd; 60 pixels a degree.
        let gain = |freq: f32| (1.0 - freq / 2.0).max(0.0).powi(2);
        let whole = filtered(&transform, &spectrum, 60.0, 2.0, gain);
        for factor in [2, 4, 8] {
            let reduced = transform.filtered_reduced(&spectrum, 60.0, 2.0, factor, gain);
            let back = enlarged(&reduced, factor, 75, 42);
            for y in 0..42 {
                for x in 0..75 {
                    let error = (back.get(x, y) - whole.get(x, y)).abs();
                    let limit = if x % factor == 0 && y % factor == 0 { 1e-5 } else { 0.05 };
                    assert!(error < limit, "factor {factor} at ({x}, {y}): {error}");
                }
            }
        }
    }
}
