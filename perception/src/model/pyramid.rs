//! Burt and Adelson's pyramid, undecimated, and what the models built on it share.
//!
//! For models as they were published. Not for new ones: weighted by contrast, what masks at an edge raises thresholds
//! in the flat beside it.

use super::{ModelInputs, PerLuminance, Z_95};
use crate::adaptation::adapted;
use crate::filter::reflect;
use crate::plane::Plane;
use crate::tvi::{ThresholdBase, base_threshold_cd_m2};

/// Contrast bands of the published models.
pub(crate) const BANDS: usize = 6;
/// Contrast of all bands together below which there is none: what the kernel's rounding leaves of a uniform picture
/// is 20 times less, the least that eyes see 100 times more.
const MIN_CONTRAST: f32 = 1e-5;
/// Below this luminance, cd/m², a band's contrast is taken over it instead.
const MIN_LUMINANCE_CD_M2: f32 = 1e-4;

/// Local band contrasts `C_i` = |`G_i` − `G_i+1`| / `G_i+2` (Lubin, Peli) of Gaussian levels `G_0` = picture, `G_i+1`
/// = `G_i` through the kernel (0.05, 0.25, 0.4, 0.25, 0.05) with holes of 2^i pixels.
///
/// The holes matter: the same small kernel applied again and again, as public implementations do, gives no octaves.
pub(crate) fn band_contrasts(picture: &Plane) -> Vec<Plane> {
    let mut levels = vec![picture.clone()];
    for level in 0..=BANDS {
        levels.push(smoothed(&levels[level], 1 << level));
    }
    levels
        .windows(3)
        .map(|levels| {
            let mut contrast = levels[0].clone();
            contrast.for_each_row_mut(|y, row| {
                for (value, (next, base)) in row.iter_mut().zip(levels[1].row(y).iter().zip(levels[2].row(y))) {
                    *value = (*value - next).abs() / base.max(MIN_LUMINANCE_CD_M2);
                }
            });
            contrast
        })
        .collect()
}

/// Frequency, cpd, that band `band` passes best: measured, not the nominal octave label, which is 1.8 times too high.
pub(crate) fn band_frequency_cpd(band: usize, pixels_per_degree: f64) -> f64 {
    pixels_per_degree
        * match band {
            0 => 0.35,
            1 => 0.1485,
            _ => 0.278 * 0.5_f64.powi(band as i32),
        }
}

/// Threshold map of the models that weigh each band's elevation by its share of the local contrast: the `base`
/// threshold at each pixel's adaptation luminance times `factor(Σ C_i f_i / Σ C_i)`, where `elevation_at(x, y,
/// adaptation, band, C_i)` is f_i. A picture without contrast has no weights: nothing is elevated.
pub(crate) fn contrast_weighted(
    inputs: &ModelInputs<'_>,
    base: ThresholdBase<'_>,
    factor: impl Fn(f32) -> f32 + Sync,
    elevation_at: impl Fn(usize, usize, f32, usize, f32) -> f32 + Sync,
) -> Plane {
    let gain = inputs.viewing.observer.sensitivity;
    let thresholds = PerLuminance::new(|luminance| base_threshold_cd_m2(luminance, base) / (Z_95 * gain));
    let contrasts = band_contrasts(inputs.display_luminance_cd_m2);
    let mut allowed = adapted(inputs.display_luminance_cd_m2, inputs.viewing);
    allowed.for_each_row_mut(|y, row| {
        for (x, value) in row.iter_mut().enumerate() {
            let adaptation = *value;
            let (mut elevation, mut total) = (0.0, 0.0);
            for (band, contrast) in contrasts.iter().enumerate() {
                let contrast = contrast.row(y)[x];
                elevation += contrast * elevation_at(x, y, adaptation, band, contrast);
                total += contrast;
            }
            *value = thresholds.at(adaptation) * if total > MIN_CONTRAST { factor(elevation / total) } else { 1.0 };
        }
    });
    allowed
}

fn smoothed(plane: &Plane, hole: usize) -> Plane {
    const KERNEL: [f32; 5] = [0.05, 0.25, 0.4, 0.25, 0.05];
    let (width, height) = (plane.width(), plane.height());
    let tap = |index: usize, tap: usize, len: usize| reflect(index as isize + (tap as isize - 2) * hole as isize, len);
    let mut across = plane.clone();
    across.for_each_row_mut(|y, row| {
        let source = plane.row(y);
        for (x, value) in row.iter_mut().enumerate() {
            *value = KERNEL.iter().enumerate().map(|(index, weight)| weight * source[tap(x, index, width)]).sum();
        }
    });
    let mut both = across.clone();
    both.for_each_row_mut(|y, row| {
        let rows = [0, 1, 2, 3, 4].map(|index| across.row(tap(y, index, height)));
        for (x, value) in row.iter_mut().enumerate() {
            *value = KERNEL.iter().zip(rows).map(|(weight, row)| weight * row[x]).sum();
        }
    });
    both
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grating at a band's measured frequency excites that band more than its neighbours.
    #[test]
    fn bands_peak_where_they_say() {
        for band in 1..4 {
            let freq = band_frequency_cpd(band, 1.0) as f32;
            let wave =
                Plane::from_fn(256, 64, |x, _| 10.0 * (1.0 + 0.5 * (std::f32::consts::TAU * freq * x as f32).cos()));
            let strength: Vec<f64> = band_contrasts(&wave).iter().map(Plane::mean).collect();
            let best = (0..BANDS).max_by(|a, b| strength[*a].total_cmp(&strength[*b])).unwrap();
            assert_eq!(best, band, "{strength:?}");
        }
    }
}
