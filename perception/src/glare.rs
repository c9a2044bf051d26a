//! Glare: the veil that bright things lay over their surroundings, scattered by the eye's own lens and fluids.
//!
//! Off unless the observer asks for it ([`crate::display::Glare`]): left out, thresholds near lamps come out lower,
//! which is safe. The veil is light like any other to the retina: it adds to the adaptation luminance, and since
//! contrast is taken over that, it takes from contrast.
//!
//! Contrast sensitivity was measured on uniform fields, whose own scatter is already in the data. So only what
//! exceeds the veil of a field as bright as the place itself counts: K ⊗ (L − `L_a`) where it is positive. A uniform
//! picture has no veil, and a window never lowers a threshold. Beyond the picture's edge all is taken to be as bright
//! as the place itself.

use rustfft::num_complex::Complex32;

use crate::display::{Glare, PixelDensity, Viewing};
use crate::fft::{complex_plans, smooth_size};
use crate::noise_gain::noise_gain;
use crate::plane::Plane;
use crate::sensitivity::luminance_coordinate;
use crate::table::Between;
use crate::threshold::ThresholdMap;

/// Angles the formula holds for, degrees: closer in, scatter is part of the eye's point spread and of its contrast
/// sensitivity.
const VALID_DEG: std::ops::Range<f64> = 0.1..100.0;
/// Pigment of the eye: 0 for black, 0.5 for brown, 1.2 for light blue eyes.
const PIGMENT: f64 = 0.5;
/// Light is gathered in cells of this fraction of a degree: the veil changes no faster than that.
const CELLS_PER_DEGREE: f64 = 8.0;
/// However large the picture, no more cells than these along a side.
const MAX_CELLS: usize = 1024;

/// Veil in cd/m² that an illuminance of 1 lx from `angle_deg` off the line of sight lays over it.
///
/// CIE general disability glare equation (CIE 135/1-1999; Vos and van den Berg): 10/θ³ + (5/θ² + 0.1 p/θ)(1 +
/// (A/62.5)⁴) + 0.0025 p for 0.1° < θ < 100°, age A in years, pigment p = 0.5 (brown eyes). 0 outside.
#[must_use]
pub fn veil_per_lux(angle_deg: f64, age_years: f64) -> f64 {
    if !VALID_DEG.contains(&angle_deg) {
        return 0.0;
    }
    let age = 1.0 + (age_years / 62.5).powi(4);
    10.0 / angle_deg.powi(3) + (5.0 / angle_deg.powi(2) + 0.1 * PIGMENT / angle_deg) * age + 0.0025 * PIGMENT
}

/// A veil known at the centres of cells.
pub(crate) struct Veil {
    cells: Plane,
    /// Pixels of a cell along x and y.
    cell: [usize; 2],
}

/// The veil over a picture, cd/m², beyond that of a uniform field of the adaptation luminance; `None` if the
/// observer's eye is taken as clear.
pub(crate) fn veil_cd_m2(luminance_cd_m2: &Plane, adaptation_cd_m2: &Plane, viewing: &Viewing) -> Option<Veil> {
    let Glare::Cie { age_years } = viewing.observer.glare else { return None };
    let density = viewing.display.pixel_density();
    let (width, height) = (luminance_cd_m2.width(), luminance_cd_m2.height());
    let cell = [(density.horizontal, width), (density.vertical, height)].map(|(pixels_per_degree, len)| {
        ((pixels_per_degree / CELLS_PER_DEGREE) as usize).max(len.div_ceil(MAX_CELLS)).max(1)
    });
    let cells = (width.div_ceil(cell[0]), height.div_ceil(cell[1]));
    // Real part: light over its mean; imaginary part: area. One complex transform convolves both, and each leaks into
    // the other by rounding: at 1e8 cd/m² light itself would leave twice its own luminance where there is no veil.
    let mean = (luminance_cd_m2.mean() as f32).max(f32::MIN_POSITIVE);
    let sides = [smooth_size(2 * cells.0), smooth_size(2 * cells.1)];
    let mut light_and_area = Grid::new(sides);
    for y in 0..height {
        let row = luminance_cd_m2.row(y);
        for (x, value) in row.iter().enumerate() {
            *light_and_area.at(x / cell[0], y / cell[1]) += Complex32::new(*value / mean, 1.0);
        }
    }
    let mut kernel = Grid::new(sides);
    let cell_deg = [cell[0] as f64 / density.horizontal, cell[1] as f64 / density.vertical];
    for y in 0..sides[1] {
        for x in 0..sides[0] {
            let offset = [x.min(sides[0] - x), y.min(sides[1] - y)];
            *kernel.at(x, y) = Complex32::new(veil_of_cell(offset, cell_deg, density, age_years) as f32, 0.0);
        }
    }
    light_and_area.convolve(&mut kernel);
    let mean_adaptation = cell_means(adaptation_cd_m2, cell, cells);
    let mut veil = Plane::filled(cells.0, cells.1, 0.0);
    for (index, value) in veil.values_mut().iter_mut().enumerate() {
        let scattered = *light_and_area.at(index % cells.0, index / cells.0);
        *value = (mean * (scattered.re - mean_adaptation.values()[index] / mean * scattered.im)).max(0.0);
    }
    Some(Veil { cells: veil, cell })
}

/// Raises what a veil lowered. Veiled texture masks less, and where the mask is taken from beside a place (see
/// [`crate::masking`]) the place's own veil may not make up for it: up to 1.3 % of a threshold. No band's threshold
/// falls below `clear`'s.
pub(crate) fn keep_thresholds(veiled: &mut ThresholdMap, clear: &ThresholdMap) {
    for (band, elevation) in veiled.elevations.iter_mut().enumerate() {
        let energy = &veiled.tables.bands[band].noise_energy;
        let visible = |adaptation: f32| energy.at(luminance_coordinate(adaptation)).sqrt() / adaptation;
        elevation.combine(&clear.elevations[band], |own, clear_elevation, x, y| {
            let fall = visible(veiled.adaptation_cd_m2.get(x, y)) / visible(clear.adaptation_cd_m2.get(x, y));
            own.max(clear_elevation * fall)
        });
    }
    let gain = noise_gain(&veiled.tables, &veiled.adaptation_cd_m2, &veiled.elevations);
    // Elevations hold at every second pixel and are interpolated; this holds at every pixel.
    veiled.noise_gain = gain.combined(&clear.noise_gain, f32::min);
}

/// Veil at a cell's centre from 1 cd/m² on one pixel of the cell `offset` cells away, on average over that cell.
fn veil_of_cell(offset: [usize; 2], cell_deg: [f64; 2], density: PixelDensity, age_years: f64) -> f64 {
    const POINTS: usize = 4;
    let solid_angle = (1.0_f64.to_radians() / density.horizontal) * (1.0_f64.to_radians() / density.vertical);
    let mut sum = 0.0;
    for point in 0..POINTS * POINTS {
        let within = [point % POINTS, point / POINTS].map(|at| (at as f64 + 0.5) / POINTS as f64 - 0.5);
        let angle_deg =
            ((offset[0] as f64 + within[0]) * cell_deg[0]).hypot((offset[1] as f64 + within[1]) * cell_deg[1]);
        sum += veil_per_lux(angle_deg, age_years) * angle_deg.to_radians().cos().max(0.0);
    }
    sum / (POINTS * POINTS) as f64 * solid_angle
}

fn cell_means(plane: &Plane, cell: [usize; 2], cells: (usize, usize)) -> Plane {
    Plane::from_fn(cells.0, cells.1, |cx, cy| {
        let columns = cx * cell[0]..((cx + 1) * cell[0]).min(plane.width());
        let rows = cy * cell[1]..((cy + 1) * cell[1]).min(plane.height());
        let count = (columns.len() * rows.len()) as f32;
        rows.map(|y| plane.row(y)[columns.clone()].iter().sum::<f32>()).sum::<f32>() / count
    })
}

impl Veil {
    /// Adds the veil to row `y` of a plane of the picture's size.
    pub(crate) fn add_to_row(&self, y: usize, row: &mut [f32]) {
        let place = |pixel: usize, cell: usize, len: usize| {
            Between::of(f64::from((pixel as f32 + 0.5) / cell as f32 - 0.5), len)
        };
        let rows = place(y, self.cell[1], self.cells.height());
        let (upper, lower) = (self.cells.row(rows.below), self.cells.row(rows.above));
        for (x, value) in row.iter_mut().enumerate() {
            let columns = place(x, self.cell[0], self.cells.width());
            let mixed = |low: f32, high: f32, place: Between| low + (high - low) * place.share as f32;
            let line = |cells: &[f32]| mixed(cells[columns.below], cells[columns.above], columns);
            *value += mixed(line(upper), line(lower), rows);
        }
    }
}

/// A grid for cyclic convolution.
struct Grid {
    sides: [usize; 2],
    values: Vec<Complex32>,
}

impl Grid {
    fn new(sides: [usize; 2]) -> Self {
        Self { sides, values: vec![Complex32::default(); sides[0] * sides[1]] }
    }

    fn at(&mut self, x: usize, y: usize) -> &mut Complex32 {
        &mut self.values[y * self.sides[0] + x]
    }

    fn convolve(&mut self, kernel: &mut Self) {
        let [across, down] = self.sides.map(complex_plans);
        for grid in [&mut *self, &mut *kernel] {
            across.forward.process(&mut grid.values);
            grid.turn();
            down.forward.process(&mut grid.values);
        }
        let scale = (self.values.len() as f32).recip();
        self.values.iter_mut().zip(&kernel.values).for_each(|(value, kernel)| *value *= kernel * scale);
        down.back.process(&mut self.values);
        self.turn();
        across.back.process(&mut self.values);
    }

    /// Rows become columns.
    fn turn(&mut self) {
        let [width, height] = self.sides;
        self.values = (0..width)
            .flat_map(|x| (0..height).map(move |y| (x, y)))
            .map(|(x, y)| self.values[y * width + x])
            .collect();
        self.sides = [height, width];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;
    use crate::display::Display;
    use crate::threshold::{ThresholdInputs, threshold_map};

    fn viewing(glare: Glare) -> Viewing {
        let mut viewing = Viewing::of(Display { pixels_per_degree: 30.0, white_cd_m2: 4000.0, ..Display::default() });
        viewing.observer.glare = glare;
        viewing
    }

    fn thresholds(picture: &Plane, glare: Glare) -> Plane {
        let inputs = ThresholdInputs::clean(picture);
        threshold_map(&inputs, &viewing(glare), &CastleCsf::default()).unwrap().allowed_standard_error_cd_m2(1.0)
    }

    /// A dark room with a bright window, and texture on the walls.
    fn room(window_cd_m2: f32) -> Plane {
        Plane::from_fn(240, 160, |x, y| {
            let texture = 1.0 + 0.4 * (x as f32 * 0.5).cos() * (y as f32 * 0.4).cos();
            if (100..140).contains(&x) && (50..100).contains(&y) { window_cd_m2 } else { 2.0 * texture }
        })
    }

    #[test]
    fn published_values() {
        // CIE 135/1: at 10° and 25 years of age 10/1000 + (5/100 + 0.1 p/10)(1 + 0.0256) + 0.0025 p.
        assert!((veil_per_lux(10.0, 25.0) - (0.01 + 0.055 * 1.0256 + 0.00125)).abs() < 1e-9);
        assert!(veil_per_lux(1.0, 80.0) > veil_per_lux(1.0, 25.0));
        assert_eq!((veil_per_lux(0.05, 25.0), veil_per_lux(120.0, 25.0)), (0.0, 0.0));
    }

    #[test]
    fn a_bright_window_raises_thresholds_nearby_and_never_lowers_any() {
        let cie = Glare::Cie { age_years: 25.0 };
        let (clear, veiled) = (thresholds(&room(3000.0), Glare::None), thresholds(&room(3000.0), cie));
        for (index, (clear, veiled)) in clear.values().iter().zip(veiled.values()).enumerate() {
            assert!(*veiled >= clear * 0.9999, "({}, {}): {clear} → {veiled}", index % 240, index / 240);
        }
        // 0.8° and 3° beside it: 2.35 and 1.21 times.
        let raised = |x: usize| veiled.get(x, 75) / clear.get(x, 75);
        assert!(raised(165) > 2.0 && raised(230) > 1.1, "{} {}", raised(165), raised(230));
        // The older eye scatters more.
        let old = thresholds(&room(3000.0), Glare::Cie { age_years: 75.0 });
        assert!(old.get(230, 75) > veiled.get(230, 75));
    }

    #[test]
    fn uniform_pictures_have_no_veil() {
        for (width, height, light) in [(1, 1, 100.0), (3, 50, 100.0), (64, 48, 100.0), (320, 320, 1e8)] {
            let grey = Plane::filled(width, height, light);
            let (clear, veiled) = (thresholds(&grey, Glare::None), thresholds(&grey, Glare::Cie { age_years: 40.0 }));
            for (clear, veiled) in clear.values().iter().zip(veiled.values()) {
                assert!((veiled / clear - 1.0).abs() < 1e-4);
            }
        }
    }

    /// A small lamp far away is a point: the veil is the formula times its illuminance.
    #[test]
    fn a_lamp_veils_as_the_formula_says() {
        let mut picture = Plane::filled(300, 60, 0.0);
        for y in 28..32 {
            picture.values_mut()[y * 300 + 28..y * 300 + 32].fill(4000.0);
        }
        let clear = Plane::filled(300, 60, 1e-4);
        let veil = veil_cd_m2(&picture, &clear, &viewing(Glare::Cie { age_years: 25.0 })).unwrap();
        let mut row = vec![0.0; 300];
        veil.add_to_row(29, &mut row);
        for x in [90, 150, 240] {
            let angle_deg = (x as f64 - 29.5) / 30.0;
            let illuminance_lux = 4000.0 * 16.0 * (1.0_f64.to_radians() / 30.0).powi(2) * angle_deg.to_radians().cos();
            let expected = veil_per_lux(angle_deg, 25.0) * illuminance_lux;
            assert!((f64::from(row[x]) / expected - 1.0).abs() < 0.02, "{angle_deg}°: {}, not {expected}", row[x]);
        }
    }
}
