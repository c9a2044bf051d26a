//! Real 2-D Fourier transforms of pictures mirrored at their borders.

use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};

use crate::display::PixelDensity;
use crate::filter::reflect;
use crate::frame::{Frame, MAX_REDUCTION};
use crate::plane::Plane;

/// Mirror on each side of a picture, degrees. The transform is periodic, so that a border's error reaches the
/// opposite border across twice this. 512×512 pixels at 60 a degree, 2 cd/m² but for an error to 200 in the last
/// degree, of which 0.8 is seen at the opposite border: 125.5 with a mirror of 1°, 13.6 with 2°, 0.74 with 3°. Padded
/// it has 1.4 times the pixels of 1° at 2°, 2.3 times at 3°; at 2° the leak is 0.5 % of what is seen where the error
/// stands.
const MIRROR_DEG: f64 = 2.0;
/// The least, degrees, for pictures that are shorter than twice this.
const MIN_MIRROR_DEG: f64 = 1.0;

/// The transform of one picture size. Making one is cheap: plans are kept for the life of the program.
pub(crate) struct PictureTransform {
    width: usize,
    height: usize,
    pad_x: usize,
    pad_y: usize,
    padded_width: usize,
    padded_height: usize,
    density: PixelDensity,
    rows_forward: Arc<dyn RealToComplex<f32>>,
    columns_forward: Arc<dyn Fft<f32>>,
}

/// A picture's spectrum: one line for each horizontal frequency, the vertical frequencies along it.
pub(crate) struct Spectrum {
    bins: Vec<Complex32>,
}

/// Buffers that transforms of one picture hand on to each other: to have the memory made anew for every band would
/// cost a tenth of a threshold map.
#[derive(Default)]
pub(crate) struct Workspace {
    by_column: Vec<Complex32>,
    by_row: Vec<Complex32>,
}

struct Planners {
    real: RealFftPlanner<f32>,
    complex: FftPlanner<f32>,
}

static PLANNERS: LazyLock<Mutex<Planners>> =
    LazyLock::new(|| Mutex::new(Planners { real: RealFftPlanner::new(), complex: FftPlanner::new() }));

/// A poisoned lock only means that another thread died while planning; the plans made so far are whole.
fn planners() -> MutexGuard<'static, Planners> {
    PLANNERS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Complex transforms of one length, there and back (not scaled).
pub(crate) struct ComplexPlans {
    pub(crate) forward: Arc<dyn Fft<f32>>,
    pub(crate) back: Arc<dyn Fft<f32>>,
}

pub(crate) fn complex_plans(len: usize) -> ComplexPlans {
    let planner = &mut planners().complex;
    ComplexPlans { forward: planner.plan_fft_forward(len), back: planner.plan_fft_inverse(len) }
}

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
    /// The transform for pictures of `width` × `height` pixels, mirrored by [`MIRROR_DEG`] on every side or by half of
    /// a shorter picture: then nothing is nearer across the seam of the period than it is in the picture itself.
    pub(crate) fn new(width: usize, height: usize, density: PixelDensity) -> Self {
        let padded = |len: usize, pad: usize| MAX_REDUCTION * smooth_size((len + 2 * pad).div_ceil(MAX_REDUCTION));
        let (pad_x, pad_y) = (mirror_px(width, density.horizontal), mirror_px(height, density.vertical));
        let (padded_width, padded_height) = (padded(width, pad_x), padded(height, pad_y));
        let mut planners = planners();
        Self {
            width,
            height,
            pad_x,
            pad_y,
            padded_width,
            padded_height,
            density,
            rows_forward: planners.real.plan_fft_forward(padded_width),
            columns_forward: planners.complex.plan_fft_forward(padded_height),
        }
    }

    /// The frame of samples at every `factor`-th pixel, and at least so many more beside and above the picture as its
    /// mirror image in the transform has room for, with every sample between them and one more of those on each side.
    pub(crate) fn mirrored_frame(&self, factor: usize, beside: f64, above: f64) -> Frame {
        let at_most = |wanted: f64, pad: usize| (wanted.ceil() as usize).min((2 * pad / factor).saturating_sub(3) / 2);
        Frame { factor, beside: at_most(beside, self.pad_x), above: at_most(above, self.pad_y) }
    }

    /// Horizontal frequencies kept: 0 up to Nyquist.
    fn columns(&self) -> usize {
        self.padded_width / 2 + 1
    }

    /// The spectrum of the picture whose row y `fill_row(y, row)` writes, mirrored at its borders.
    pub(crate) fn forward(&self, workspace: &mut Workspace, fill_row: impl Fn(usize, &mut [f32]) + Sync) -> Spectrum {
        self.forward_rows(workspace, |y, row| {
            fill_row(reflect(y, self.height), &mut row[self.pad_x..self.pad_x + self.width]);
            self.mirror_ends(row);
        })
    }

    /// The spectrum of `picture` amid the mirror image of another one, `beyond`.
    pub(crate) fn forward_amid(&self, workspace: &mut Workspace, picture: &Plane, beyond: &Plane) -> Spectrum {
        let inside = self.pad_x..self.pad_x + self.width;
        self.forward_rows(workspace, |y, row| {
            row[inside.clone()].copy_from_slice(beyond.row(reflect(y, self.height)));
            self.mirror_ends(row);
            if (0..self.height as isize).contains(&y) {
                row[inside.clone()].copy_from_slice(picture.row(y as usize));
            }
        })
    }

    /// Sets what lies beside the picture in a padded row to its mirror image.
    fn mirror_ends(&self, row: &mut [f32]) {
        for x in (0..self.pad_x).chain(self.pad_x + self.width..self.padded_width) {
            row[x] = row[self.pad_x + reflect(x as isize - self.pad_x as isize, self.width)];
        }
    }

    /// The spectrum of what `fill_row(y, padded row)` writes, y counted from the picture's first row.
    fn forward_rows(&self, workspace: &mut Workspace, fill_row: impl Fn(isize, &mut [f32]) + Sync) -> Spectrum {
        let columns = self.columns();
        let zero = Complex32::default();
        let by_row = sized(&mut workspace.by_row, columns * self.padded_height);
        by_row.par_chunks_mut(columns).enumerate().for_each_init(
            || (self.rows_forward.make_input_vec(), self.rows_forward.make_scratch_vec()),
            |(row, scratch), (y, bins)| {
                fill_row(y as isize - self.pad_y as isize, row);
                // Lengths come from the same plan, the only thing this call can complain of.
                let _ = self.rows_forward.process_with_scratch(row, bins, scratch);
            },
        );
        let mut bins = vec![zero; columns * self.padded_height];
        transpose(by_row, &mut bins, columns, self.padded_height);
        bins.par_chunks_mut(self.padded_height).for_each_init(
            || vec![zero; self.columns_forward.get_inplace_scratch_len()],
            |scratch, column| self.columns_forward.process_with_scratch(column, scratch),
        );
        Spectrum { bins }
    }

    /// The picture whose spectrum is `spectrum` with every bin multiplied by `gain(freq_cpd)`, at every `factor`-th
    /// pixel only, framed: see [`Frame`].
    ///
    /// `limit_cpd` is a frequency above which `gain` is zero (infinite if there is none): columns beyond it are not
    /// transformed. `factor` must be one of 1, 2, 4, 8, 16, and leave room for `limit_cpd`.
    pub(crate) fn filtered_reduced(
        &self,
        workspace: &mut Workspace,
        spectrum: &Spectrum,
        limit_cpd: f64,
        frame: Frame,
        gain: impl Fn(f32) -> f32 + Sync,
    ) -> Plane {
        let factor = frame.factor;
        let mut planners = planners();
        let back = BackTransform {
            columns: planners.complex.plan_fft_inverse(self.padded_height / factor),
            rows: planners.real.plan_fft_inverse(self.padded_width / factor),
            factor,
            first_x: self.pad_x / factor - 1 - frame.beside,
            first_y: self.pad_y / factor - 1 - frame.above,
            width: frame.samples_across(self.width),
            height: frame.samples_down(self.height),
        };
        drop(planners);
        self.filtered_columns(&back, &mut workspace.by_column, spectrum, limit_cpd, gain);
        let columns = back.columns_kept(self.padded_width);
        let rows = self.padded_height / factor;
        let by_row = sized(&mut workspace.by_row, columns * rows);
        transpose(&workspace.by_column[..columns * rows], by_row, rows, columns);
        self.rows_back(&back, by_row)
    }

    /// The spectrum through the gain and back along its columns.
    fn filtered_columns(
        &self,
        back: &BackTransform,
        buffer: &mut Vec<Complex32>,
        spectrum: &Spectrum,
        limit_cpd: f64,
        gain: impl Fn(f32) -> f32 + Sync,
    ) {
        let all_rows = self.padded_height;
        let rows = all_rows / back.factor;
        let zero = Complex32::default();
        let step_x = (self.density.horizontal / self.padded_width as f64) as f32;
        let step_y = (self.density.vertical / all_rows as f64) as f32;
        let scale = 1.0 / (self.padded_width as f32 * all_rows as f32);
        let bins = sized(buffer, back.columns_kept(self.padded_width) * rows);
        bins.par_chunks_mut(rows).zip(spectrum.bins.par_chunks(all_rows)).enumerate().for_each_init(
            || (vec![zero; back.columns.get_inplace_scratch_len()], vec![0.0_f32; rows / 2 + 1]),
            |(scratch, gains), (kx, (filtered, source))| {
                let freq_x = kx as f32 * step_x;
                if f64::from(freq_x) > limit_cpd {
                    filtered.fill(zero);
                    return;
                }
                for (ky, value) in gains.iter_mut().enumerate() {
                    let freq_y = ky as f32 * step_y;
                    *value = gain((freq_x * freq_x + freq_y * freq_y).sqrt()) * scale;
                }
                // Negative frequencies stand at the end, the lowest last.
                let (positive, negative) = filtered.split_at_mut(rows / 2 + 1);
                for ((bin, source), gain) in positive.iter_mut().zip(source).zip(&*gains) {
                    *bin = source * gain;
                }
                let from_end = source.iter().rev().zip(&gains[1..]);
                for (bin, (source, gain)) in negative.iter_mut().rev().zip(from_end) {
                    *bin = source * gain;
                }
                back.columns.process_with_scratch(filtered, scratch);
            },
        );
    }

    /// Back along the rows that are asked for.
    fn rows_back(&self, back: &BackTransform, by_row: &mut [Complex32]) -> Plane {
        let row_length = self.padded_width / back.factor;
        let columns = back.columns_kept(self.padded_width);
        let kept = back.first_y * columns..(back.first_y + back.height) * columns;
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
                values.copy_from_slice(&row[back.first_x..back.first_x + back.width]);
            },
        );
        picture
    }
}

/// Pixels of mirror at both ends of a line of `len`: a multiple of the largest reduction, so that reduced transforms
/// sample the same pixels.
fn mirror_px(len: usize, pixels_per_degree: f64) -> usize {
    let pixels = |degrees: f64| ((degrees * pixels_per_degree).ceil() as usize).max(1);
    len.div_ceil(2).clamp(pixels(MIN_MIRROR_DEG), pixels(MIRROR_DEG)).next_multiple_of(MAX_REDUCTION)
}

/// The first `len` bins of a buffer that grows to them.
fn sized(buffer: &mut Vec<Complex32>, len: usize) -> &mut [Complex32] {
    if buffer.len() < len {
        buffer.resize(len, Complex32::default());
    }
    &mut buffer[..len]
}

/// Plans and frame of a way back from the spectrum.
struct BackTransform {
    columns: Arc<dyn Fft<f32>>,
    rows: Arc<dyn ComplexToReal<f32>>,
    /// Every how many-th pixel comes back.
    factor: usize,
    /// The first column and row kept, in samples.
    first_x: usize,
    first_y: usize,
    width: usize,
    height: usize,
}

impl BackTransform {
    /// Horizontal frequencies of the reduced picture.
    fn columns_kept(&self, padded_width: usize) -> usize {
        padded_width / self.factor / 2 + 1
    }
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
    use crate::frame::enlarged;

    /// At every pixel.
    fn filtered(
        transform: &PictureTransform,
        spectrum: &Spectrum,
        limit_cpd: f64,
        gain: impl Fn(f32) -> f32 + Sync,
    ) -> Plane {
        let whole = transform.filtered_reduced(&mut Workspace::default(), spectrum, limit_cpd, Frame::narrow(1), gain);
        enlarged(&whole, 1, transform.width, transform.height)
    }

    fn spectrum_of(transform: &PictureTransform, plane: &Plane) -> Spectrum {
        transform.forward(&mut Workspace::default(), |y, row| row.copy_from_slice(plane.row(y)))
    }

    fn transform_at(width: usize, height: usize, pixels_per_degree: f64) -> PictureTransform {
        PictureTransform::new(width, height, PixelDensity::square(pixels_per_degree))
    }

    #[test]
    fn smooth_sizes() {
        assert_eq!([1, 7, 11, 632, 1021].map(smooth_size), [1, 8, 12, 640, 1024]);
    }

    /// A picture of 2° is mirrored whole, without a seam, and costs no more than that.
    #[test]
    fn short_pictures_are_mirrored_by_half() {
        for (len, pixels_per_degree, mirror, padded) in [
            (1, 60.0, 64, 144),
            (128, 60.0, 64, 256),
            (200, 60.0, 112, 432),
            (512, 60.0, 128, 768),
            (64, 32.0, 32, 128),
        ] {
            let transform = transform_at(len, len, pixels_per_degree);
            assert_eq!((transform.pad_x, transform.padded_height), (mirror, padded), "{len} at {pixels_per_degree}");
        }
    }

    #[test]
    fn a_gain_of_one_gives_the_picture_back() {
        for (width, height) in [(1, 1), (1, 5), (7, 3), (48, 31)] {
            let plane = Plane::from_fn(width, height, |x, y| ((x * 7 + y * 13) % 11) as f32);
            let transform = transform_at(width, height, 30.0);
            let back = filtered(&transform, &spectrum_of(&transform, &plane), f64::INFINITY, |_| 1.0);
            for (found, expected) in back.values().iter().zip(plane.values()) {
                assert!((found - expected).abs() < 1e-4, "{width}×{height}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn frequencies_are_cycles_per_degree() {
        // 3 cycles in 64 pixels at 32 pixels a degree: 1.5 cpd along y; with 16 pixels of mirror on each side, a
        // third of the padded 96 rows is still whole half waves.
        let plane = Plane::from_fn(16, 64, |_, y| (std::f32::consts::TAU * 3.0 * (y as f32 + 0.5) / 64.0).cos());
        let transform = transform_at(16, 64, 32.0);
        let spectrum = spectrum_of(&transform, &plane);
        let kept = filtered(&transform, &spectrum, f64::INFINITY, |freq| f32::from((freq - 1.5).abs() < 0.01));
        let lost = filtered(&transform, &spectrum, 1.6, |freq| f32::from((freq - 1.5).abs() > 0.01));
        for ((kept, lost), expected) in kept.values().iter().zip(lost.values()).zip(plane.values()) {
            assert!((kept - expected).abs() < 1e-5 && lost.abs() < 1e-5);
        }
    }

    #[test]
    fn a_reduced_transform_samples_the_whole_one() {
        let plane = Plane::from_fn(75, 42, |x, y| (x as f32 * 0.13).sin() + (y as f32 * 0.1 + x as f32 * 0.02).cos());
        let transform = transform_at(75, 42, 60.0);
        let spectrum = spectrum_of(&transform, &plane);
        // A smooth low-pass that ends at 2 cpd; 60 pixels a degree.
        let gain = |freq: f32| (1.0 - freq / 2.0).max(0.0).powi(2);
        let whole = filtered(&transform, &spectrum, 2.0, gain);
        for factor in [2, 4, 8] {
            let reduced =
                transform.filtered_reduced(&mut Workspace::default(), &spectrum, 2.0, Frame::narrow(factor), gain);
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
