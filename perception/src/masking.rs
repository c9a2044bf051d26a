//! Masking: how much a band's own contrast raises its threshold.
//!
//! Each octave band is masked by its own contrast (Daly 1993), up to three times. Orientation is ignored: a mask hides
//! error across it as well as along it. Not for masking between bands or channels, of which there is none here, and not
//! of lone edges, which mask nothing beside them.

use crate::bands::{OctaveBands, RINGS, RadialTable, for_each_ring};
use crate::csf::ContrastSensitivity;
use crate::display::PixelDensity;
use crate::fft::{PictureTransform, Spectrum, Workspace};
use crate::frame::{Frame, MAX_REDUCTION, reduced_size, reduction};
use crate::plane::Plane;
use crate::reduced::ReducedPlane;
use crate::sensitivity::BandTables;
use crate::table::UniformTable;
use crate::taps::{eroded, smoothed};
use crate::threshold::GuideNoise;

/// The threshold elevation is never taken to exceed this, whatever the contrast.
pub const ELEVATION_CAP: f64 = 3.0;

/// Threshold elevation T_e = (1 + |m|^2.8)^(1/4) by a mask of contrast `mask` in threshold units.
///
/// Daly, "The visible differences predictor", 1993, with slope s = 0.7; with s = Q = 0.7 his constants k₁ and k₂
/// cancel. Not capped.
#[must_use]
pub fn threshold_elevation(mask: f64) -> f64 {
    (1.0 + mask.abs().powf(2.8)).powf(0.25)
}

/// [`threshold_elevation`], capped, against the mask's squared contrast.
pub(crate) struct ElevationTable {
    entries: UniformTable,
    entries_per_square: f32,
}

const ENTRIES: usize = 1024;

impl ElevationTable {
    pub(crate) fn new() -> Self {
        // Contrast at which the elevation reaches its cap.
        let last = (ELEVATION_CAP.powi(4) - 1.0).powf(2.0 / 2.8);
        let entry_at =
            |entry| threshold_elevation((last * entry as f64 / ENTRIES as f64).sqrt()).min(ELEVATION_CAP) as f32;
        Self {
            entries: UniformTable::new((0..=ENTRIES).map(entry_at)),
            entries_per_square: (ENTRIES as f64 / last) as f32,
        }
    }

    fn at(&self, mask_squared: f32) -> f32 {
        self.entries.at((mask_squared * self.entries_per_square).min(ENTRIES as f32 - 1e-3))
    }
}

/// What the masks of all bands are made from.
pub(crate) struct MaskSource<'a> {
    pub(crate) transform: &'a PictureTransform,
    /// Spectrum of the guide over its adaptation luminance.
    pub(crate) contrast: &'a Spectrum,
    /// The eye's sensitivity under the middle one of the picture's adaptation levels.
    pub(crate) sensitivity: Option<&'a RadialTable>,
    /// [`ContrastSensitivity::transfer`]: what takes detail away before the eye takes it from masks, and from the
    /// guide's noise in them.
    pub(crate) csf: &'a dyn ContrastSensitivity,
    /// Variance of the guide's noise over the adaptation luminance squared, as far as it is known: at every second
    /// pixel, every fourth and so on, framed like any [`ReducedPlane`].
    pub(crate) noise: GuideNoise<Vec<Plane>>,
    /// Coordinates of the adaptation luminance in the tables, at every second pixel.
    pub(crate) coordinates: &'a Plane,
    pub(crate) density: PixelDensity,
    /// Columns and rows of the picture.
    pub(crate) width: usize,
    pub(crate) height: usize,
}

/// Radius of the disc that erodes, in wavelengths: around the square of one wavelength to each side, whose corners
/// clear what is beside corners of things. A disc of one wavelength lets the edges of a lamp mask themselves. Measured:
/// thresholds there 4 to 12 % higher by it; and of the squared error that even sampling leaves of the Cornell box at 64
/// samples a pixel, in units of thresholds, 0.93 is left by the square, 1.05 by the disc in it, 0.96 by the disc around
/// it.
const REACH_WAVELENGTHS: f64 = std::f64::consts::SQRT_2;

/// Standard deviation of the window that softens the eroded elevation, in wavelengths: less than half of what the
/// erosion takes off, so that nothing reaches what it has cleared.
const EDGE_WAVELENGTHS: f64 = 0.25;

/// How far around the picture its mirror image is worked on, in wavelengths, where the transform has as much of it:
/// what the windows and the erosion reach over. Each of them mirrors what it is given, too, but at a sample and not
/// where the picture ends. Measured with that alone on 96×96 pixels of noise: thresholds in the first and the last
/// rows 5 % off those of the mirrored picture.
const SURROUND_WAVELENGTHS: f64 = 2.0;

/// Threshold elevation, 1 to 3, of one band, on a grid as fine as the band needs.
///
/// The band's local contrast amplitude is √2 times its RMS over a Gaussian of a third of a wavelength (the band's
/// signal itself crosses zero twice a wavelength), less the energy that the guide's own noise has there, as far as
/// [`GuideNoise`] tells. It is then eroded over more than one wavelength around: an edge, whose contrast lives within
/// a wavelength, masks nothing beside it; texture, which goes on, does. Where it does ends softly, well within what
/// the erosion has left.
pub(crate) fn band_elevation(
    source: &MaskSource<'_>,
    workspace: &mut Workspace,
    bands: &OctaveBands,
    band: usize,
    tables: &BandTables,
    elevation: &ElevationTable,
) -> ReducedPlane {
    let grid = BandGrid::of(source, bands, band);
    let masks = BandMasks { source, grid, gain: mask_gain(source, bands, band), tables, elevation };
    let mut energy = masks.energy(workspace, bands.limit_cpd(band));
    let elevated = match &source.noise {
        GuideNoise::Clean => masks.elevated_by(&energy),
        GuideNoise::White(noise) => {
            masks.take_out(noise, &mut energy);
            masks.elevated_by(&energy)
        }
        GuideNoise::BeforeDenoising(noise) => {
            let at_most = masks.elevated_by(&energy);
            masks.take_out(noise, &mut energy);
            masks.elevated_by(&energy).combined(&at_most, |at_least, at_most| (at_least * at_most).sqrt())
        }
    };
    drop(energy);
    masks.where_it_goes_on(&elevated)
}

/// Amplitude gain of a band for masks, behind what takes detail away before the eye.
fn mask_gain(source: &MaskSource<'_>, bands: &OctaveBands, band: usize) -> RadialTable {
    let transfer = |freq: f64| source.csf.transfer(freq);
    let sensitivity_behind = |freq: f64| {
        source.sensitivity.map_or(1.0, |table| f64::from(table.at(freq as f32)) / transfer(freq).max(1e-100))
    };
    RadialTable::new(source.density, |freq| transfer(freq) * bands.mask_gain(band, freq, sensitivity_behind))
}

/// Where a band's masks are known.
struct BandGrid {
    /// Where samples of the energy and of what comes of it stand.
    frame: Frame,
    /// Where samples of the amplitude stand, twice as densely.
    amplitude_frame: Frame,
    /// The wavelength of the band's centre along x and y, in samples of `frame`.
    wavelengths: [f64; 2],
}

impl BandGrid {
    fn of(source: &MaskSource<'_>, bands: &OctaveBands, band: usize) -> Self {
        let density = source.density;
        // A quarter more densely than the band needs: its energy is blurred next.
        let amplitude_factor = reduction(density, 1.25 * bands.limit_cpd(band));
        let factor = 2 * amplitude_factor;
        let wavelengths = [density.horizontal, density.vertical]
            .map(|pixels_per_degree| pixels_per_degree / bands.center_cpd(band) / factor as f64);
        let [beside, above] = wavelengths.map(|wavelength| SURROUND_WAVELENGTHS * wavelength);
        let frame = source.transform.mirrored_frame(factor, beside, above);
        let amplitude_frame =
            Frame { factor: amplitude_factor, beside: 2 * frame.beside + 2, above: 2 * frame.above + 2 };
        Self { frame, amplitude_frame, wavelengths }
    }
}

/// What the masks of one band are made with.
struct BandMasks<'a> {
    source: &'a MaskSource<'a>,
    grid: BandGrid,
    gain: RadialTable,
    tables: &'a BandTables,
    elevation: &'a ElevationTable,
}

impl BandMasks<'_> {
    /// Squared contrast of the guide in the band.
    fn energy(&self, workspace: &mut Workspace, limit_cpd: f64) -> Plane {
        let (source, frame) = (self.source, self.grid.frame);
        let amplitude = source.transform.filtered_reduced(
            workspace,
            source.contrast,
            limit_cpd,
            self.grid.amplitude_frame,
            |freq| self.gain.at(freq),
        );
        let size = (frame.samples_across(source.width), frame.samples_down(source.height));
        halved(&amplitude, size, |value| value * value)
    }

    /// Takes the energy of the guide's noise out of the band's.
    fn take_out(&self, noise: &[Plane], energy: &mut Plane) {
        let (source, frame, amplitude_factor) = (self.source, self.grid.frame, self.grid.amplitude_frame.factor);
        let Some(noise) = noise.get(amplitude_factor.ilog2() as usize) else { return };
        // Of white pixel noise's variance, what stands in the guide's band.
        let mut share = 0.0;
        for_each_ring(source.density, RINGS, |freq, weight| share += weight as f32 * self.gain.at(freq as f32).powi(2));
        let columns = frame.columns(source.width);
        let sample_at = |pixel: usize| (pixel + amplitude_factor) / frame.factor + 1;
        energy.for_each_row_mut(|y, row| {
            let noise = noise.row(sample_at(frame.row(y, source.height)));
            row.iter_mut().zip(&columns).for_each(|(value, x)| *value -= share * noise[sample_at(*x)]);
        });
    }

    /// The elevation by masks of this energy, each at its own place.
    fn elevated_by(&self, energy: &Plane) -> Plane {
        let (source, frame) = (self.source, self.grid.frame);
        // Less the variance of the window that halved.
        let [variance_x, variance_y] =
            self.grid.wavelengths.map(|wavelength| ((0.35 * wavelength).powi(2) - HALVING_VARIANCE / 4.0).max(0.0));
        let mut mask = smoothed(energy, variance_x, variance_y);
        let columns = frame.columns(source.width);
        mask.for_each_row_mut(|y, row| {
            let coordinates = source.coordinates.row(frame.row(y, source.height) / 2 + 1);
            for (value, x) in row.iter_mut().zip(&columns) {
                let sensitivity_squared = self.tables.center_sensitivity_squared.at(coordinates[x / 2 + 1]);
                *value = self.elevation.at(2.0 * value.max(0.0) * sensitivity_squared);
            }
        });
        mask
    }

    /// What of an elevation goes on for a wavelength around, over the picture.
    fn where_it_goes_on(&self, elevated: &Plane) -> ReducedPlane {
        let (source, frame) = (self.source, self.grid.frame);
        let [reach_x, reach_y] = self.grid.wavelengths.map(|wavelength| REACH_WAVELENGTHS * wavelength);
        let elevated = eroded(elevated, reach_x, reach_y);
        let [variance_x, variance_y] = self.grid.wavelengths.map(|wavelength| (EDGE_WAVELENGTHS * wavelength).powi(2));
        let elevated = smoothed(&elevated, variance_x, variance_y);
        let (across, down) = (reduced_size(source.width, frame.factor), reduced_size(source.height, frame.factor));
        let elevated = Plane::from_fn(across, down, |x, y| elevated.get(x + frame.beside, y + frame.above));
        ReducedPlane::new(elevated, frame.factor, source.width, source.height)
    }
}

/// `plane` at every second pixel, every fourth and so on, up to what [`MaskSource`] can be asked for.
pub(crate) fn halvings(plane: &Plane) -> Vec<Plane> {
    let (width, height) = (plane.width(), plane.height());
    let mut planes: Vec<Plane> = Vec::new();
    let mut factor = 1;
    while factor <= MAX_REDUCTION {
        // The window wants one sample more on each side of the frame.
        let frame = Frame { factor, beside: 2, above: 2 };
        let (columns, finer) = (frame.columns(width), planes.last().unwrap_or(plane));
        let nearest = |pixel: usize| if factor == 1 { pixel } else { (pixel + factor / 2) / factor + 1 };
        let mut framed = Plane::filled(columns.len(), frame.samples_down(height), 0.0);
        framed.for_each_row_mut(|y, row| {
            let source = finer.row(nearest(frame.row(y, height)));
            row.iter_mut().zip(&columns).for_each(|(value, x)| *value = source[nearest(*x)]);
        });
        factor *= 2;
        planes.push(halved(&framed, (reduced_size(width, factor), reduced_size(height, factor)), |value| value));
    }
    planes
}

/// Variance of the window of [`halved`], in samples of its input.
const HALVING_VARIANCE: f64 = 0.5;

/// `change` of every second sample of a plane, from its second one on, to a plane of `size`: through a binomial
/// window, since sampled bare it would alias.
fn halved(plane: &Plane, size: (usize, usize), change: impl Fn(f32) -> f32 + Sync) -> Plane {
    const BINOMIAL: [f32; 3] = [0.25, 0.5, 0.25];
    let mut result = Plane::filled(size.0, size.1, 0.0);
    result.for_each_row_mut(|y, row| {
        let mut sums = vec![0.0_f32; plane.width()];
        for (offset, weight) in BINOMIAL.into_iter().enumerate() {
            let source = plane.row(2 * y + offset);
            sums.iter_mut().zip(source).for_each(|(sum, value)| *sum += weight * change(*value));
        }
        for (value, at) in row.iter_mut().zip(sums.windows(3).step_by(2)) {
            *value = BINOMIAL[0] * at[0] + BINOMIAL[1] * at[1] + BINOMIAL[2] * at[2];
        }
    });
    result
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
