//! Masking: how much a band's own contrast raises its threshold.

use crate::bands::{OctaveBands, RadialTable};
use crate::fft::{PictureTransform, Spectrum, reduced_pixel as pixel, reduced_size, reduction};
use crate::filter::{erode, gaussian_blur};
use crate::plane::Plane;
use crate::reduced::ReducedPlane;
use crate::sensitivity::BandTables;

/// The threshold elevation is never taken to exceed this, whatever the contrast.
pub const ELEVATION_CAP: f64 = 3.0;

/// Threshold elevation T_e = (1 + |m|^2.8)^(1/4) by a mask of contrast `mask` in threshold units.
///
/// Daly, "The visible differences predictor", 1993, with slope s = 0.7; with s = Q = 0.7 his constants k₁ and k₂ cancel.
/// Not capped.
#[must_use]
pub fn threshold_elevation(mask: f64) -> f64 {
    (1.0 + mask.abs().powf(2.8)).powf(0.25)
}

/// [`threshold_elevation`], capped, against the mask's squared contrast.
pub(crate) struct ElevationTable {
    entries: Vec<f32>,
    entries_per_square: f32,
}

const ENTRIES: usize = 1024;

impl ElevationTable {
    pub(crate) fn new() -> Self {
        // Contrast at which the elevation reaches its cap.
        let last = (ELEVATION_CAP.powi(4) - 1.0).powf(2.0 / 2.8);
        let entries = (0..=ENTRIES)
            .map(|entry| threshold_elevation((last * entry as f64 / ENTRIES as f64).sqrt()).min(ELEVATION_CAP) as f32)
            .collect();
        Self { entries, entries_per_square: (ENTRIES as f64 / last) as f32 }
    }

    fn at(&self, mask_squared: f32) -> f32 {
        let position = (mask_squared * self.entries_per_square).min(ENTRIES as f32 - 1e-3);
        let index = position as usize;
        self.entries[index] + (position - index as f32) * (self.entries[index + 1] - self.entries[index])
    }
}

/// What the masks of all bands are made from.
pub(crate) struct MaskSource<'a> {
    pub(crate) transform: &'a PictureTransform,
    /// Spectrum of the guide over its adaptation luminance.
    pub(crate) contrast: &'a Spectrum,
    /// Variance of the guide's noise over the adaptation luminance squared, if any is known.
    pub(crate) noise: Option<&'a Plane>,
    /// Coordinates of the adaptation luminance in the tables.
    pub(crate) coordinates: &'a Plane,
    pub(crate) pixels_per_degree: f64,
}

/// Threshold elevation, 1 to 3, of one band, on a grid as fine as the band needs.
///
/// The band's local contrast amplitude is √2 times its RMS over a Gaussian of a third of a wavelength (the band's
/// signal itself crosses zero twice a wavelength), less the energy that the guide's own noise has there. It is then
/// eroded over one wavelength to each side: an edge, whose contrast lives within a wavelength, masks nothing beside
/// it; texture, which goes on, does.
pub(crate) fn band_elevation(
    source: &MaskSource<'_>,
    bands: &OctaveBands,
    band: usize,
    tables: &BandTables,
    elevation: &ElevationTable,
) -> ReducedPlane {
    let ppd = source.pixels_per_degree;
    let (width, height) = (source.coordinates.width(), source.coordinates.height());
    let gain = RadialTable::new(ppd, |freq| bands.mask_gain(band, freq));
    let limit_cpd = bands.limit_cpd(band);
    // A quarter more densely than the band needs: its energy is blurred next.
    let amplitude_factor = reduction(ppd, 1.25 * limit_cpd);
    let amplitude =
        source.transform.filtered_reduced(source.contrast, ppd, limit_cpd, amplitude_factor, |freq| gain.at(freq));
    let wavelength_px = ppd / bands.center_cpd(band);
    let mut blur_variance_px = (0.35 * wavelength_px).powi(2);
    let (mut energy, factor) = if amplitude_factor == 1 {
        // The variance of the window that halves.
        blur_variance_px -= 0.5;
        (halved_energy(&amplitude, width, height), 2)
    } else {
        let mut energy = amplitude;
        energy.for_each_row_mut(|_, row| row.iter_mut().for_each(|value| *value *= *value));
        (energy, amplitude_factor)
    };
    if let Some(noise) = source.noise {
        let share = tables.mask_noise_share as f32;
        energy.for_each_row_mut(|y, row| {
            for (x, value) in row.iter_mut().enumerate() {
                *value -= share * block_mean(noise, x, y, factor);
            }
        });
    }
    let mut mask = gaussian_blur(&energy, blur_variance_px.max(0.0).sqrt() / factor as f64);
    drop(energy);
    mask.for_each_row_mut(|y, row| {
        let coordinates = source.coordinates.row(pixel(y, factor, height));
        for (x, value) in row.iter_mut().enumerate() {
            let coordinate = coordinates[pixel(x, factor, width)];
            *value = 2.0 * value.max(0.0) * tables.center_sensitivity_squared.at(coordinate);
        }
    });
    let mut elevated = erode(&mask, (wavelength_px / factor as f64).round() as usize);
    elevated.for_each_row_mut(|_, row| row.iter_mut().for_each(|value| *value = elevation.at(*value)));
    ReducedPlane::new(elevated, factor, width, height)
}

/// The energy of an amplitude at every pixel (with a frame of one pixel, as [`PictureTransform::filtered_reduced`] gives it), at
/// every other pixel: squares through a binomial window, since sampling them bare would alias.
fn halved_energy(amplitude: &Plane, width: usize, height: usize) -> Plane {
    const BINOMIAL: [f32; 3] = [0.25, 0.5, 0.25];
    let mut energy = Plane::filled(reduced_size(width, 2), reduced_size(height, 2), 0.0);
    energy.for_each_row_mut(|y, row| {
        let mut squares = vec![0.0_f32; amplitude.width()];
        for (offset, weight) in BINOMIAL.into_iter().enumerate() {
            let source = amplitude.row((2 * y + offset).saturating_sub(2).min(amplitude.height() - 1));
            squares.iter_mut().zip(source).for_each(|(sum, value)| *sum += weight * value * value);
        }
        for (x, value) in row.iter_mut().enumerate() {
            let at = |offset: usize| squares[(2 * x + offset).saturating_sub(2).min(squares.len() - 1)];
            *value = BINOMIAL[0] * at(0) + BINOMIAL[1] * at(1) + BINOMIAL[2] * at(2);
        }
    });
    energy
}

/// Mean of the `factor` × `factor` pixels around a reduced sample.
fn block_mean(plane: &Plane, x: usize, y: usize, factor: usize) -> f32 {
    if factor == 1 {
        return plane.get(pixel(x, 1, plane.width()), pixel(y, 1, plane.height()));
    }
    let range = |index: usize, len: usize| {
        let center = pixel(index, factor, len);
        center.saturating_sub(factor / 2)..(center + factor / 2).min(len).max(1)
    };
    let (mut sum, mut count) = (0.0, 0.0);
    for v in range(y, plane.height()) {
        for value in &plane.row(v)[range(x, plane.width())] {
            sum += value;
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_elevations() {
        for (mask, expected) in [
            (0.0, 1.0),
            (0.5, 1.034_111_411),
            (1.0, 1.189_207_115),
            (2.0, 1.679_918_943),
            (5.0, 3.093_647_699),
            (10.0, 5.013_856_978),
            (50.0, 15.462_542_36),
        ] {
            assert!((threshold_elevation(mask) / expected - 1.0).abs() < 1e-8, "{mask}");
        }
    }

    #[test]
    fn the_table_follows_the_formula_up_to_the_cap() {
        let table = ElevationTable::new();
        for step in 0..300 {
            let mask = f64::from(step) * 0.05;
            let expected = threshold_elevation(mask).min(ELEVATION_CAP);
            let found = f64::from(table.at((mask * mask) as f32));
            assert!((found / expected - 1.0).abs() < 2e-3, "{mask}: {found} for {expected}");
        }
    }
}
