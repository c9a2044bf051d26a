//! A contrast sensitivity function, tabulated for one grid and band set.

use crate::bands::{OctaveBands, RINGS, RadialTable, for_each_ring};
use crate::csf::ContrastSensitivity;
use crate::display::Viewing;
use crate::plane::Plane;
use crate::table::UniformTable;
use rayon::prelude::*;

/// Luminances below this, cd/m², adapt the eye no further (the floor of vision).
pub(crate) const MIN_ADAPTATION_CD_M2: f32 = 1e-4;

const LOWEST_DECADE: i32 = -4;
const HIGHEST_DECADE: i32 = 6;
/// Entries a decade of the finished tables.
const ENTRIES_PER_DECADE: usize = 64;
/// Luminances a decade at which the CSF is asked; between them tables are straight in logs.
const SAMPLES_PER_DECADE: usize = 4;

/// A quantity against adaptation luminance.
#[derive(Clone, Debug)]
pub(crate) struct LuminanceTable(UniformTable);

impl LuminanceTable {
    /// `value_at(index)` gives the value at sample `index` of the grid; beyond the span the table is flat.
    fn from_samples(span: LuminanceSpan, value_at: impl Fn(usize) -> f64) -> Self {
        let entry_at = |entry: usize| {
            let position = entry as f64 * SAMPLES_PER_DECADE as f64 / ENTRIES_PER_DECADE as f64;
            let below = (position as usize).min(span.last - 1);
            let (low, high) = (value_at(below).max(1e-30), value_at(below + 1).max(1e-30));
            (low.ln() + (position - below as f64) * (high / low).ln()).exp() as f32
        };
        let [first, last] = [span.first, span.last].map(|sample| sample * ENTRIES_PER_DECADE / SAMPLES_PER_DECADE);
        let known: Vec<f32> = (first..=last).map(entry_at).collect();
        let decades = (HIGHEST_DECADE - LOWEST_DECADE) as usize;
        let entries = (0..=decades * ENTRIES_PER_DECADE).map(|entry| known[entry.clamp(first, last) - first]);
        Self(UniformTable::new(entries))
    }

    /// Looks up at a [`luminance_coordinate`].
    pub(crate) fn at(&self, coordinate: f32) -> f32 {
        self.0.at(coordinate)
    }
}

/// Where a luminance stands in every [`LuminanceTable`].
pub(crate) fn luminance_coordinate(luminance_cd_m2: f32) -> f32 {
    const DECADES_AN_OCTAVE: f32 = std::f32::consts::LOG10_2;
    let decades = DECADES_AN_OCTAVE * log2(luminance_cd_m2.max(MIN_ADAPTATION_CD_M2));
    ((decades - LOWEST_DECADE as f32) * ENTRIES_PER_DECADE as f32).max(0.0)
}

/// Binary logarithm of a positive, normal number, off by less than 1e-6 beside rounding, without a call: every pixel
/// of every map asks for it. The mantissa m, brought between √½ and √2, goes through the series of 2 artanh((m −
/// 1)/(m + 1)) / ln 2.
fn log2(value: f32) -> f32 {
    const ROOT_HALF_BITS: u32 = 0x3f35_04f3;
    let bits = value.to_bits();
    let octaves = (bits.wrapping_sub(ROOT_HALF_BITS) as i32) >> 23;
    let mantissa = f32::from_bits(bits.wrapping_sub((octaves << 23) as u32));
    let ratio = (mantissa - 1.0) / (mantissa + 1.0);
    let square = ratio * ratio;
    let series = 1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square / 7.0));
    octaves as f32 + 2.0 * std::f32::consts::LOG2_E * ratio * series
}

/// The luminances that tables are made for, as samples of the whole grid: a picture's own. Measured at 128×128 pixels:
/// a CSF that is asked for all ten decades takes a tenth of a look.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LuminanceSpan {
    first: usize,
    /// At least one more.
    last: usize,
}

impl LuminanceSpan {
    /// What encloses all pixels of some adaptation luminances, cd/m².
    pub(crate) fn of<'a>(adaptations_cd_m2: impl IntoIterator<Item = &'a Plane>) -> Self {
        let most = (HIGHEST_DECADE - LOWEST_DECADE) as usize * SAMPLES_PER_DECADE;
        let sample = |luminance_cd_m2: f32| {
            luminance_coordinate(luminance_cd_m2) * SAMPLES_PER_DECADE as f32 / ENTRIES_PER_DECADE as f32
        };
        let (mut first, mut last) = (most, 0);
        for adaptation in adaptations_cd_m2 {
            let (least, greatest) = adaptation.range();
            // A sample more on either side, for what rounding makes of means.
            first = first.min((sample(least) as usize).saturating_sub(1));
            last = last.max((sample(greatest) as usize).min(most) + 2);
        }
        let last = last.clamp(1, most);
        Self { first: first.min(last - 1), last }
    }

    /// In cd/m², by sample.
    fn luminances(self) -> impl Iterator<Item = f64> {
        let decade = |sample: usize| f64::from(LOWEST_DECADE) + sample as f64 / SAMPLES_PER_DECADE as f64;
        (self.first..=self.last).map(move |sample| 10.0_f64.powf(decade(sample)))
    }
}

/// What one band does to errors and masks.
#[derive(Clone, Debug)]
pub(crate) struct BandTables {
    /// Mean of S² B² over the Nyquist rectangle: the energy, in squared threshold units, that white pixel noise of unit
    /// relative variance has in the band, against adaptation luminance.
    pub(crate) noise_energy: LuminanceTable,
    /// S² at the band's centre to what has got to the eye, against adaptation luminance.
    pub(crate) center_sensitivity_squared: LuminanceTable,
    /// Standard deviation, in degrees, of the band's squared impulse response: how far it smears noise energy.
    pub(crate) spread_deg: f64,
}

/// Tables for all bands of a grid, for some luminances; the observer's sensitivity is in them.
#[derive(Clone, Debug)]
pub(crate) struct SensitivityTables {
    pub(crate) bands: Vec<BandTables>,
}

impl SensitivityTables {
    pub(crate) fn new(
        bands: &OctaveBands,
        viewing: &Viewing,
        csf: &dyn ContrastSensitivity,
        span: LuminanceSpan,
    ) -> Self {
        let density = viewing.display.pixel_density();
        let gain = viewing.observer.sensitivity;
        let count = bands.len();
        let mut rings = Vec::with_capacity(RINGS);
        for_each_ring(density, RINGS, |freq_cpd, weight| rings.push(Ring { freq_cpd, weight }));
        let shares: Vec<Vec<f64>> = (0..count)
            .map(|band| rings.iter().map(|ring| ring.weight * bands.gain(band, ring.freq_cpd).powi(2)).collect())
            .collect();
        // [sample][band]; noise energy, and the square at the centre to what has got to the eye, which masks are.
        let samples: Vec<Vec<BandSample>> = span
            .luminances()
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|luminance| {
                let squares: Vec<f64> =
                    rings.iter().map(|ring| (gain * csf.sensitivity(ring.freq_cpd, luminance)).powi(2)).collect();
                let center = |band| (gain * csf.sensitivity_behind(bands.center_cpd(band), luminance)).powi(2);
                let noise = |shares: &[f64]| shares.iter().zip(&squares).map(|(share, square)| share * square).sum();
                shares
                    .iter()
                    .enumerate()
                    .map(|(band, shares)| BandSample { noise: noise(shares), center: center(band) })
                    .collect()
            })
            .collect();
        let grey_cd_m2 = viewing.display.grey_cd_m2();
        let tables = (0..count)
            .into_par_iter()
            .map(|band| BandTables {
                noise_energy: LuminanceTable::from_samples(span, |sample| samples[sample - span.first][band].noise),
                center_sensitivity_squared: LuminanceTable::from_samples(span, |sample| {
                    samples[sample - span.first][band].center
                }),
                spread_deg: spread_deg(bands.limit_cpd(band).min(density.mean() / 2.0), |freq| {
                    bands.gain(band, freq) * csf.sensitivity(freq, grey_cd_m2)
                }),
            })
            .collect();
        Self { bands: tables }
    }
}

/// What a band's tables are made from at one luminance.
struct BandSample {
    noise: f64,
    center: f64,
}

struct Ring {
    freq_cpd: f64,
    weight: f64,
}

/// Standard deviation along one axis of |h|², for the isotropic filter of transfer function `transfer` that passes
/// nothing above `limit_cpd`: by Parseval, ∫ x² h² = ∫ |∂H/∂f|² / 4π², of which each axis has half.
fn spread_deg(limit_cpd: f64, transfer: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 256;
    let step = limit_cpd / f64::from(STEPS);
    let (mut energy, mut slope_energy) = (0.0, 0.0);
    let mut last = transfer(0.0);
    for index in 1..=STEPS {
        let next = transfer(f64::from(index) * step);
        let freq = (f64::from(index) - 0.5) * step;
        energy += (0.5 * (last + next)).powi(2) * freq;
        slope_energy += ((next - last) / step).powi(2) * freq;
        last = next;
    }
    if energy <= 0.0 {
        return 0.0;
    }
    (slope_energy / energy / 2.0).sqrt() / std::f64::consts::TAU
}

/// The CSF at one adaptation luminance, against frequency.
#[derive(Clone, Debug)]
pub(crate) struct AdaptationLevel {
    pub(crate) luminance_cd_m2: f32,
    pub(crate) sensitivity: RadialTable,
}

/// Half-decade adaptation levels that enclose `least..=greatest` cd/m².
///
/// Between levels amplitudes are interpolated linearly in luminance: of castleCSF up to 30 cpd that is from 7 % too
/// little to 10 % too much, against 24 % for decades and 124 % for decades interpolated in log luminance.
pub(crate) fn adaptation_levels(
    viewing: &Viewing,
    csf: &dyn ContrastSensitivity,
    least_cd_m2: f32,
    greatest_cd_m2: f32,
) -> Vec<AdaptationLevel> {
    let half_decade = |luminance: f32| 2.0 * f64::from(luminance.max(MIN_ADAPTATION_CD_M2)).log10();
    // A luminance within a millionth of a level is that level: no second transform for rounding.
    let highest = 2 * HIGHEST_DECADE + 20;
    let first = ((half_decade(least_cd_m2) + 1e-6).floor() as i32).min(highest);
    let last = ((half_decade(greatest_cd_m2) - 1e-6).ceil() as i32).clamp(first, highest);
    (first..=last)
        .into_par_iter()
        .map(|level| {
            let luminance = 10.0_f64.powf(f64::from(level) / 2.0);
            let gain = viewing.observer.sensitivity;
            let sensitivity =
                RadialTable::new(viewing.display.pixel_density(), |freq| gain * csf.sensitivity(freq, luminance));
            AdaptationLevel { luminance_cd_m2: luminance as f32, sensitivity }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;

    /// Light that no display has is judged as the brightest that levels are made for.
    #[test]
    fn levels_end_somewhere() {
        let levels = |least, greatest| adaptation_levels(&Viewing::default(), &CastleCsf::default(), least, greatest);
        for (least, greatest) in [(1e17, 1e17), (100.0, f32::INFINITY), (0.0, f32::MAX)] {
            assert!(levels(least, greatest).last().is_some_and(|level| level.luminance_cd_m2.is_finite()));
        }
    }

    /// A picture's own luminances have what a table of all luminances has for them, and beyond them nothing is asked.
    #[test]
    fn a_narrow_table_is_a_part_of_the_whole() {
        let viewing = Viewing::default();
        let bands = OctaveBands::for_grid(viewing.display.pixel_density());
        let (dim, bright) = (Plane::filled(2, 2, 3.0), Plane::filled(2, 2, 140.0));
        let whole = [1e-5, 1e7].map(|luminance| Plane::filled(1, 1, luminance));
        let table = |planes: &[&Plane]| {
            let span = LuminanceSpan::of(planes.iter().copied());
            SensitivityTables::new(&bands, &viewing, &CastleCsf::default(), span)
        };
        let (narrow, whole) = (table(&[&bright, &dim]), table(&[&whole[0], &whole[1]]));
        for (narrow, whole) in narrow.bands.iter().zip(&whole.bands) {
            for luminance in [3.0, 3.7, 10.0, 99.0, 140.0] {
                let at = |table: &LuminanceTable| table.at(luminance_coordinate(luminance));
                assert_eq!(at(&narrow.noise_energy), at(&whole.noise_energy), "{luminance}");
                assert_eq!(at(&narrow.center_sensitivity_squared), at(&whole.center_sensitivity_squared));
            }
            for luminance in [0.0, 1e-3, 1e5, f32::INFINITY] {
                assert!(narrow.noise_energy.at(luminance_coordinate(luminance)).is_finite());
            }
        }
    }

    #[test]
    fn the_quick_logarithm_is_one() {
        for step in -1200..1200 {
            let value = 10.0_f64.powf(f64::from(step) * 0.013_7) as f32;
            let expected = f64::from(value).log2();
            assert!((f64::from(log2(value)) - expected).abs() < 4e-6 + 1e-7 * expected.abs(), "{value}");
        }
    }
}
