//! Octave bands in cycles per degree, whose energies add up to the whole.

use crate::display::PixelDensity;
use crate::table::UniformTable;

/// A set of octave bands: cosines over log frequency with Σ_b B_b(f)² = 1 at every frequency.
///
/// Centres are fixed in cycles per degree (0.5, 1, 2, …), since masking belongs to the eye and not to the pixel grid.
/// The lowest band takes everything below its centre and the highest everything above.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OctaveBands {
    centers_cpd: Vec<f64>,
}

const LOWEST_CPD: f64 = 0.5;
/// Above twice this centre contrast sensitivity is below a tenth of its peak at any luminance.
const HIGHEST_CPD: f64 = 16.0;

impl OctaveBands {
    /// The bands that a grid can show along its finer axis.
    pub(crate) fn for_grid(density: PixelDensity) -> Self {
        let nyquist_cpd = density.finest() / 2.0;
        let mut centers_cpd = vec![LOWEST_CPD];
        let mut next = 2.0 * LOWEST_CPD;
        while next <= HIGHEST_CPD && next <= 0.75 * nyquist_cpd {
            centers_cpd.push(next);
            next *= 2.0;
        }
        Self { centers_cpd }
    }

    pub(crate) fn len(&self) -> usize {
        self.centers_cpd.len()
    }

    pub(crate) fn center_cpd(&self, band: usize) -> f64 {
        self.centers_cpd[band]
    }

    /// Amplitude gain of `band` for errors, 0 to 1: with open ends, so that the squares of all bands add to 1.
    pub(crate) fn gain(&self, band: usize, freq_cpd: f64) -> f64 {
        if freq_cpd <= 0.0 {
            return if band == 0 { 1.0 } else { 0.0 };
        }
        let octaves = (freq_cpd / self.centers_cpd[band]).log2();
        if (band == 0 && octaves <= 0.0) || (band + 1 == self.len() && octaves >= 0.0) {
            return 1.0;
        }
        cosine_flank(octaves)
    }

    /// Amplitude gain of `band` for the guide: closed at the bottom, so that a slow gradient is no mask.
    ///
    /// From its centre on the open last band counts contrast by the eye's `sensitivity` (any scale) there and not at
    /// its centre: what cannot be seen is no mask. Measured without it: stripes of 100 cpd at a tenth of their
    /// threshold raise that of 16 cpd threefold, and on 38 pixels a degree a grating of 18 cpd at half its threshold
    /// raises that of 8 cpd by 1.39 (Daly's formula: 1.03).
    pub(crate) fn mask_gain(&self, band: usize, freq_cpd: f64, sensitivity: impl Fn(f64) -> f64) -> f64 {
        if freq_cpd <= 0.0 {
            return 0.0;
        }
        let center_cpd = self.centers_cpd[band];
        let octaves = (freq_cpd / center_cpd).log2();
        if band + 1 < self.len() || octaves < 0.0 {
            return cosine_flank(octaves);
        }
        (sensitivity(freq_cpd) / sensitivity(center_cpd)).min(1.0)
    }

    /// A frequency above which the band passes nothing.
    pub(crate) fn limit_cpd(&self, band: usize) -> f64 {
        if band + 1 == self.len() { f64::INFINITY } else { 2.0 * self.centers_cpd[band] }
    }
}

fn cosine_flank(octaves: f64) -> f64 {
    if octaves.abs() >= 1.0 { 0.0 } else { (octaves * std::f64::consts::FRAC_PI_2).cos() }
}

/// A function of frequency, tabulated at equal steps from 0 to the corner of the Nyquist rectangle.
#[derive(Clone, Debug)]
pub(crate) struct RadialTable {
    values: UniformTable,
    steps_per_cpd: f32,
}

/// Fewest entries of a table.
const RADIAL_STEPS: usize = 2048;
/// Widest step of a table: sensitivity at low frequencies bends within a few of them, however fine the display's
/// pixels.
const WIDEST_STEP_CPD: f64 = 0.04;

impl RadialTable {
    pub(crate) fn new(density: PixelDensity, value_at: impl Fn(f64) -> f64) -> Self {
        let highest_cpd = 0.5 * density.horizontal.hypot(density.vertical);
        let steps = RADIAL_STEPS.max((highest_cpd / WIDEST_STEP_CPD).ceil() as usize + 2);
        let step = highest_cpd / (steps - 2) as f64;
        let values = UniformTable::new((0..steps).map(|index| value_at(index as f64 * step) as f32));
        Self { values, steps_per_cpd: step.recip() as f32 }
    }

    pub(crate) fn at(&self, freq_cpd: f32) -> f32 {
        self.values.at(freq_cpd * self.steps_per_cpd)
    }

    /// The product of two tables of one grid.
    pub(crate) fn times(&self, other: &Self) -> Self {
        Self { values: self.values.times(&other.values), steps_per_cpd: self.steps_per_cpd }
    }
}

/// Rings over which noise's energy is summed.
pub(crate) const RINGS: usize = 160;

/// Calls `visit(freq_cpd, weight)` at the midpoints of rings that tile the Nyquist rectangle; the weights add to 1.
///
/// The mean of H² over the rectangle is the share of white pixel noise's variance that a filter H passes.
pub(crate) fn for_each_ring(density: PixelDensity, rings: usize, mut visit: impl FnMut(f64, f64)) {
    let (nyquist_x, nyquist_y) = (density.horizontal / 2.0, density.vertical / 2.0);
    let highest_cpd = nyquist_x.hypot(nyquist_y);
    // Rings as wide as they are far out: bands are octaves, and the lowest deserve as many rings as the highest.
    let lowest_cpd = highest_cpd * 1e-4;
    let ratio = (highest_cpd / lowest_cpd).powf((rings as f64).recip());
    let area = |radius: f64| rectangle_disc_area(radius, nyquist_x, nyquist_y);
    let mut inner = 0.0;
    for ring in 1..=rings {
        let outer = if ring == rings { highest_cpd } else { lowest_cpd * ratio.powi(ring as i32) };
        let weight = (area(outer) - area(inner)) / (4.0 * nyquist_x * nyquist_y);
        visit((0.5 * (inner * inner + outer * outer)).sqrt(), weight);
        inner = outer;
    }
}

/// Area of the part of a disc of radius `radius`, at most half the diagonal, that lies in the rectangle
/// |x| ≤ `half_width`, |y| ≤ `half_height`.
fn rectangle_disc_area(radius: f64, half_width: f64, half_height: f64) -> f64 {
    // What juts out over one side; up to half the diagonal the four pieces do not overlap.
    let segment = |half_side: f64| {
        let half_angle = (half_side / radius).min(1.0).acos();
        radius * radius * (half_angle - half_angle.sin() * half_angle.cos())
    };
    std::f64::consts::PI * radius * radius - 2.0 * (segment(half_width) + segment(half_height))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curve that bends below 1 cpd is as well tabulated for the finest display as for a coarse one.
    #[test]
    fn tables_of_fine_displays_are_as_fine() {
        for ppd in [60.0, 1000.0] {
            let bent = |freq_cpd: f64| (std::f64::consts::PI * freq_cpd).sin();
            let table = RadialTable::new(PixelDensity::square(ppd), bent);
            for step in 0..100 {
                let freq_cpd = 0.013 * f64::from(step);
                let error = f64::from(table.at(freq_cpd as f32)) - bent(freq_cpd);
                assert!(error.abs() < 3e-3, "{ppd} ppd, {freq_cpd} cpd: {error}");
            }
        }
    }

    #[test]
    fn energies_of_the_bands_add_to_one() {
        for ppd in [2.0, 30.0, 60.0, 110.0] {
            let bands = OctaveBands::for_grid(PixelDensity::square(ppd));
            for step in 0..500 {
                let freq = f64::from(step) * ppd / 700.0;
                let sum: f64 = (0..bands.len()).map(|band| bands.gain(band, freq).powi(2)).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{ppd} ppd, {freq} cpd: {sum}");
            }
        }
    }

    #[test]
    fn bands_reach_as_far_as_the_grid() {
        assert_eq!(OctaveBands::for_grid(PixelDensity::square(60.0)).centers_cpd, [0.5, 1.0, 2.0, 4.0, 8.0, 16.0]);
        assert_eq!(OctaveBands::for_grid(PixelDensity::square(30.0)).centers_cpd, [0.5, 1.0, 2.0, 4.0, 8.0]);
        assert_eq!(OctaveBands::for_grid(PixelDensity::square(1.0)).centers_cpd, [0.5]);
    }

    #[test]
    fn rings_tile_the_rectangle() {
        for (horizontal, vertical) in [(40.0, 40.0), (40.0, 90.0), (100.0, 20.0)] {
            let (mut sum, mut mean_square) = (0.0, 0.0);
            for_each_ring(PixelDensity { horizontal, vertical }, 400, |freq, weight| {
                sum += weight;
                mean_square += weight * freq * freq;
            });
            assert!((sum - 1.0).abs() < 1e-12);
            // The mean of x² + y² over a rectangle of half sides a and b is (a² + b²)/3.
            let expected = (horizontal * horizontal + vertical * vertical) / 12.0;
            assert!((mean_square / expected - 1.0).abs() < 1e-3, "{horizontal}×{vertical}: {mean_square}");
        }
    }
}
