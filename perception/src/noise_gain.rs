//! The noise gain of a map: how visible white pixel noise of unit variance is at each pixel.

use crate::frame::{reduced_pixel, reduced_size};
use crate::plane::Plane;
use crate::reduced::ReducedPlane;
use crate::sensitivity::{SensitivityTables, luminance_coordinate};

/// N = Σ_b E_b(`L_a`) / (`m_b` `L_a`)² at every pixel, with E_b the energy that white noise has in band b and `m_b`
/// the band's elevation (1 if `elevations` is empty).
///
/// The sum changes as slowly as the elevations and the adaptation do: it is made on the finest grid of elevations and
/// interpolated; only the division by `L_a`² is every pixel's own.
pub(crate) fn noise_gain(tables: &SensitivityTables, adaptation_cd_m2: &Plane, elevations: &[ReducedPlane]) -> Plane {
    let (width, height) = (adaptation_cd_m2.width(), adaptation_cd_m2.height());
    let factor = elevations.iter().map(ReducedPlane::factor).min().unwrap_or(2);
    let coordinates = reduced_coordinates(adaptation_cd_m2, factor);
    let mut energy = Plane::filled(coordinates.width(), coordinates.height(), 0.0);
    energy.for_each_row_mut(|j, row| {
        let coordinates = coordinates.row(j);
        let (mut buffer, mut elevation) = (Vec::new(), vec![1.0; row.len()]);
        // Band by band: each row of elevations is read in one go.
        for (band, tables) in tables.bands.iter().enumerate() {
            if let Some(reduced) = elevations.get(band) {
                reduced.finer_row_into(factor, j, &mut buffer, &mut elevation);
            }
            for (value, (coordinate, elevation)) in row.iter_mut().zip(coordinates.iter().zip(&elevation)) {
                *value += tables.noise_energy.at(*coordinate) / (elevation * elevation);
            }
        }
    });
    let energy = ReducedPlane::new(energy, factor, width, height);
    let mut gain = Plane::filled(width, height, 0.0);
    gain.for_each_row_mut(|y, row| {
        energy.row_into(y, &mut Vec::new(), row);
        // Divided twice: the square of 1e-4 cd/m² and of 1e20 must both stay within f32. Beyond, thresholds are the
        // largest finite ones.
        for (value, adaptation) in row.iter_mut().zip(adaptation_cd_m2.row(y)) {
            *value = (*value / adaptation / adaptation).max(f32::MIN_POSITIVE);
        }
    });
    gain
}

/// Where the adaptation luminance stands in the tables, at every `factor`-th pixel, framed like a [`ReducedPlane`].
pub(crate) fn reduced_coordinates(adaptation_cd_m2: &Plane, factor: usize) -> Plane {
    let (width, height) = (adaptation_cd_m2.width(), adaptation_cd_m2.height());
    let mut coordinates = Plane::filled(reduced_size(width, factor), reduced_size(height, factor), 0.0);
    coordinates.for_each_row_mut(|j, row| {
        let source = adaptation_cd_m2.row(reduced_pixel(j, factor, height));
        for (i, value) in row.iter_mut().enumerate() {
            *value = luminance_coordinate(source[reduced_pixel(i, factor, width)]);
        }
    });
    coordinates
}
