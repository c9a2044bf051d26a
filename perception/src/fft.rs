//! Real 2-D Fourier transforms of pictures mirrored at their borders.

use std::sync::{Arc, LazyLock, Mutex};

use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};

use crate::filter::reflect;
use crate::plane::Plane;

/// The transform of one picture size. Making one is cheap: plans are kept for the life of the program.
pub(crate) struct PictureTransform {
    width: usize,
    height: usize,
    pad: usize,
    padded_width: usize,
    padded_height: usize,
    rows_forward: Arc<dyn RealToComplex<f32>>,
    rows_back: Arc<dyn ComplexToReal<f32>>,
    columns_forward: Arc<dyn Fft<f32>>,
    columns_back: Arc<dyn Fft<f32>>,
}

/// A picture's spectrum: one line for each horizontal frequency, the vertical frequencies along it.
pub(crate) struct Spectrum {
    bins: Vec<Complex32>,
}

struct Planners {
    real: RealFftPlanner<f32>,
    complex: FftPlanner<f32>,
}

static PLANNERS: LazyLock<Mutex<Planners>> = LazyLock::new(|| {
    Mutex::new(Planners {
        real: RealFftPlanner::new(),
        complex: FftPlanner::new(),
    })
});

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
        let padded_width = smooth_size(width + 2 * pad);
        let padded_height = smooth_size(height + 2 * pad);
        // A poisoned lock only means that another thread died while planning; the plans made so far are whole.
        let mut planners = PLANNERS
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        Self {
            width,
            height,
            pad,
            padded_width,
            padded_height,
            rows_forward: planners.real.plan_fft_forward(padded_width),
            rows_back: planners.real.plan_fft_inverse(padded_width),
            columns_forward: planners.complex.plan_fft_forward(padded_height),
            columns_back: planners.complex.plan_fft_inverse(padded_height),
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
            || {
                (
                    self.rows_forward.make_input_vec(),
                    self.rows_forward.make_scratch_vec(),
                )
            },
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

    /// The picture whose spectrum is `spectrum` with every bin multiplied by `gain(freq_cpd)`.
    ///
    /// `limit_cpd` is a frequency above which `gain` is zero (infinite if there is none): columns beyond it are not
    /// transformed.
    pub(crate) fn filtered(
        &self,
        spectrum: &Spectrum,
        pixels_per_degree: f64,
        limit_cpd: f64,
        gain: impl Fn(f32) -> f32 + Sync,
    ) -> Plane {
        let (columns, rows) = (self.columns(), self.padded_height);
        let zero = Complex32::default();
        let step_x = (pixels_per_degree / self.padded_width as f64) as f32;
        let step_y = (pixels_per_degree / rows as f64) as f32;
        let scale = 1.0 / (self.padded_width as f32 * rows as f32);
        let mut bins = vec![zero; columns * rows];
        bins.par_chunks_mut(rows)
            .zip(spectrum.bins.par_chunks(rows))
            .enumerate()
            .for_each_init(
                || vec![zero; self.columns_back.get_inplace_scratch_len()],
                |scratch, (kx, (filtered, source))| {
                    let freq_x = kx as f32 * step_x;
                    if f64::from(freq_x) > limit_cpd {
                        return;
                    }
                    for (ky, (bin, value)) in filtered.iter_mut().zip(source).enumerate() {
                        let freq_y = ky.min(rows - ky) as f32 * step_y;
                        *bin = value * (gain((freq_x * freq_x + freq_y * freq_y).sqrt()) * scale);
                    }
                    self.columns_back.process_with_scratch(filtered, scratch);
                },
            );
        // Only the rows that the picture keeps come back.
        let first = self.pad * columns;
        let mut by_row = vec![zero; columns * rows];
        transpose(&bins, &mut by_row, rows, columns);
        let mut picture = Plane::filled(self.width, self.height, 0.0);
        let (width, pad) = (self.width, self.pad);
        picture
            .values_mut()
            .par_chunks_mut(width)
            .zip(by_row[first..first + self.height * columns].par_chunks_mut(columns))
            .for_each_init(
                || {
                    (
                        self.rows_back.make_output_vec(),
                        self.rows_back.make_scratch_vec(),
                    )
                },
                |(row, scratch), (values, bins)| {
                    // The transform of a real row has real ends; rounding leaves a trace that the plan would refuse.
                    bins[0].im = 0.0;
                    if self.padded_width.is_multiple_of(2) {
                        bins[columns - 1].im = 0.0;
                    }
                    let _ = self.rows_back.process_with_scratch(bins, row, scratch);
                    values.copy_from_slice(&row[pad..pad + width]);
                },
            );
        picture
    }
}

/// `source` has rows of `width` bins; `target` gets them as columns.
fn transpose(source: &[Complex32], target: &mut [Complex32], width: usize, height: usize) {
    const STRIP: usize = 8;
    target
        .par_chunks_mut(STRIP * height)
        .enumerate()
        .for_each(|(strip, rows)| {
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

    #[test]
    fn smooth_sizes() {
        assert_eq!(
            [1, 7, 11, 632, 1021].map(smooth_size),
            [1, 8, 12, 640, 1024]
        );
    }

    #[test]
    fn a_gain_of_one_gives_the_picture_back() {
        for (width, height) in [(1, 1), (1, 5), (7, 3), (48, 31)] {
            let plane = Plane::from_fn(width, height, |x, y| ((x * 7 + y * 13) % 11) as f32);
            let transform = PictureTransform::new(width, height, 9);
            let back = transform.filtered(&transform.forward(&plane), 30.0, f64::INFINITY, |_| 1.0);
            for (found, expected) in back.values().iter().zip(plane.values()) {
                assert!(
                    (found - expected).abs() < 1e-4,
                    "{width}×{height}: {found} for {expected}"
                );
            }
        }
    }

    #[test]
    fn frequencies_are_cycles_per_degree() {
        // 3 cycles in 64 pixels at 32 pixels a degree: 1.5 cpd along y.
        let plane = Plane::from_fn(16, 64, |_, y| {
            (std::f32::consts::TAU * 3.0 * (y as f32 + 0.5) / 64.0).cos()
        });
        let transform = PictureTransform::new(16, 64, 0);
        let spectrum = transform.forward(&plane);
        let kept = transform.filtered(&spectrum, 32.0, f64::INFINITY, |freq| {
            f32::from((freq - 1.5).abs() < 0.01)
        });
        let lost = transform.filtered(&spectrum, 32.0, 1.6, |freq| {
            f32::from((freq - 1.5).abs() > 0.01)
        });
        for ((kept, lost), expected) in kept.values().iter().zip(lost.values()).zip(plane.values())
        {
            assert!((kept - expected).abs() < 1e-5 && lost.abs() < 1e-5);
        }
    }
}
