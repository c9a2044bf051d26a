//! Visibility: an error in threshold units.
//!
//! v(x) = √2 · sqrt(g ⊗ E\[V²\])(x), where V is the display error over the adaptation luminance, through the contrast
//! sensitivity function and divided by each band's masking, and g is a Gaussian of σ 0.25°. Bands add by energy. A
//! grating at its threshold has v = 1: the √2 turns its RMS into its amplitude.

use crate::bands::RadialTable;
use crate::fft::{PictureTransform, Spectrum, Workspace};
use crate::filter::gaussian_blur_xy;
use crate::frame::{Frame, enlarged, reduction};
use crate::plane::Plane;
use crate::sensitivity::luminance_coordinate;
use crate::threshold::{POOLING_SIGMA_DEG, ThresholdMap};

/// An error of this many times the adaptation luminance is hopelessly visible; more would only cost the rest of the
/// transform its precision.
const LARGEST_RELATIVE_ERROR: f32 = 1e3;
/// Its square.
const LARGEST_RELATIVE_VARIANCE: f32 = LARGEST_RELATIVE_ERROR * LARGEST_RELATIVE_ERROR;
/// Standard deviation of what counts as slow at a picture's border, degrees. 256×256 pixels at 60 a degree, v of a square of 9 and of 31
/// pixels in a corner, half brighter: 14.40 and 25.1 amid equal pictures; mirrored 21.9 and 23.1; by a σ of 0.25° 13.3 and 20.7, of
/// 0.5° 14.0 and 21.7, of 1° 14.3 and 23.8, of 2° 14.4 and 24.7. From 2° on gradients have edges at borders: waves of 2 % over some 5° are
/// at 0.73, not 0.66.
const SURROUND_SIGMA_DEG: f64 = 1.0;
/// How far the pooling window reaches, in its standard deviations: three boxes of about one on each side.
const POOLING_REACH: f64 = 3.0;

/// What a measured error looks like.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredError {
    /// v(x) in threshold units: pooled, times √2.
    pub visibility: Plane,
    /// The unpooled amplitude sqrt(Σ_b `V_b`²) at each pixel in threshold units: what a lone bright pixel shows,
    /// which pooling would hide.
    pub amplitude: Plane,
}

impl ThresholdMap {
    /// Visibility that independent pixel errors of this variance ((cd/m²)² on the display, of the pixel's mean) will
    /// have, on average over noise.
    ///
    /// v² = 2 g ⊗ Σ_b (mean(S² `B_b`²) / `m_b`²) · (`h_b`² ⊗ σ²/`L_a`²): each band smears the noise's energy by the width of its
    /// own impulse response before masking acts.
    ///
    /// Pixels whose variance is negative or not finite get infinity and count as 0 for the others; a plane of another
    /// size gets infinity everywhere.
    #[must_use]
    pub fn predicted_visibility(&self, variance_of_mean: &Plane) -> Plane {
        if !self.fits(variance_of_mean) {
            return self.infinite();
        }
        let relative = variance_of_mean.combined(&self.adaptation_cd_m2, |variance, adaptation| {
            if variance.is_finite() && variance >= 0.0 {
                (variance / adaptation / adaptation).min(LARGEST_RELATIVE_VARIANCE)
            } else {
                0.0
            }
        });
        let coordinates = self.adaptation_cd_m2.map(luminance_coordinate);
        let mut energy = Plane::filled(self.width(), self.height(), 0.0);
        for (tables, elevation) in self.tables.bands.iter().zip(&self.elevations) {
            // A spread of a fifth of the pooling window widens it by 2 %: nothing to pay a blur for.
            let blurred =
                (tables.spread_deg > 0.2 * POOLING_SIGMA_DEG).then(|| self.blurred(&relative, tables.spread_deg));
            let spread = blurred.as_ref().unwrap_or(&relative);
            energy.for_each_row_mut(|y, row| {
                let mut elevations = vec![0.0; row.len()];
                elevation.row_into(y, &mut Vec::new(), &mut elevations);
                let inputs = spread.row(y).iter().zip(&elevations).zip(coordinates.row(y));
                for (value, ((spread, elevation), coordinate)) in row.iter_mut().zip(inputs) {
                    *value += spread * tables.noise_energy.at(*coordinate) / (elevation * elevation);
                }
            });
        }
        let visibility = self.pooled(&energy).map(|energy| (2.0 * energy).sqrt());
        visibility.combined(variance_of_mean, |visibility, variance| {
            if variance.is_finite() && variance >= 0.0 { visibility } else { f32::INFINITY }
        })
    }

    /// Visibility of the error that two halves of a picture show: `half_difference` is D = (A − B)/2 in display cd/m²,
    /// a realisation of the error of (A + B)/2, with whatever correlation between pixels it has.
    ///
    /// D/`L_a` is filtered by the contrast sensitivity function of half-decade adaptation levels, interpolated linearly in
    /// luminance, band by band; each band is divided by its masking; energies are added and pooled.
    ///
    /// Pixels that are not finite get infinity and count as 0 for the others; a plane of another size gets infinity everywhere.
    #[must_use]
    pub fn measured_visibility(&self, half_difference: &Plane) -> Plane {
        if !self.fits(half_difference) {
            return self.infinite();
        }
        let mut filters = ErrorFilters::new(self);
        let energy = filters.energy(half_difference);
        infinite_where_unknown(filters.visibility_of(&energy), half_difference)
    }

    /// [`ThresholdMap::measured_visibility`] of a difference that ends with the pictures (see [`ErrorFilters::amid_equals`]).
    pub(crate) fn visibility_amid_equals(&self, difference: &Plane) -> Plane {
        if !self.fits(difference) {
            return self.infinite();
        }
        let mut filters = ErrorFilters::amid_equals(self);
        let energy = filters.energy(difference);
        infinite_where_unknown(filters.visibility_of(&energy), difference)
    }

    /// [`ThresholdMap::measured_visibility`], and the unpooled amplitude beside it.
    #[must_use]
    pub fn measured_error(&self, half_difference: &Plane) -> MeasuredError {
        if !self.fits(half_difference) {
            return MeasuredError { visibility: self.infinite(), amplitude: self.infinite() };
        }
        let mut filters = ErrorFilters::new(self);
        let energy = filters.energy(half_difference);
        MeasuredError {
            visibility: infinite_where_unknown(filters.visibility_of(&energy), half_difference),
            amplitude: infinite_where_unknown(energy.map(f32::sqrt), half_difference),
        }
    }

    /// `plane` convolved with the pooling window g, a Gaussian of σ 0.25° (any unit, unchanged).
    #[must_use]
    pub fn pooled(&self, plane: &Plane) -> Plane {
        self.blurred(plane, POOLING_SIGMA_DEG)
    }

    pub(crate) fn blurred(&self, plane: &Plane, sigma_deg: f64) -> Plane {
        gaussian_blur_xy(plane, self.viewing.display.pixel_density().pixels(sigma_deg))
    }

    pub(crate) fn band_count(&self) -> usize {
        self.elevations.len()
    }

    /// Where an adaptation luminance stands between the levels: 1.25 is a quarter of the way, in luminance, from the second level
    /// to the third.
    fn level_position(&self, adaptation_cd_m2: f32) -> f32 {
        let above = self.levels.partition_point(|level| level.luminance_cd_m2 <= adaptation_cd_m2);
        match (above.checked_sub(1), self.levels.get(above)) {
            (Some(below), Some(upper)) => {
                let lower = self.levels[below].luminance_cd_m2;
                below as f32 + (adaptation_cd_m2 - lower) / (upper.luminance_cd_m2 - lower)
            }
            (Some(last), None) => last as f32,
            (None, _) => 0.0,
        }
    }

    fn fits(&self, plane: &Plane) -> bool {
        self.adaptation_cd_m2.same_size(plane)
    }

    fn infinite(&self) -> Plane {
        Plane::filled(self.width(), self.height(), f32::INFINITY)
    }
}

/// `visibility`, and infinity where the error that it is of is no number.
pub(crate) fn infinite_where_unknown(visibility: Plane, error: &Plane) -> Plane {
    visibility.combined(error, |visibility, error| if error.is_finite() { visibility } else { f32::INFINITY })
}

/// The eye's filters over one threshold map's errors, band by band, with the buffers that they share.
pub(crate) struct ErrorFilters<'a> {
    map: &'a ThresholdMap,
    transform: PictureTransform,
    workspace: Workspace,
    positions: Plane,
    surround: Surround,
}

/// What is taken to lie around an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Surround {
    /// Its mirror image.
    Mirror,
    /// Of its mirror image what changes slowly.
    SmoothMirror,
}

/// `V_b` / `m_b`: an error in one band, in threshold units, at every `factor`-th pixel and a frame of one around them.
pub(crate) struct BandResponse {
    pub(crate) amplitude: Plane,
    factor: usize,
    /// Of the field that [`ErrorFilters`] look at, pixels.
    width: usize,
    height: usize,
}

impl BandResponse {
    /// `of` the amplitude at every pixel; twice the band's frequencies are sampled, so it may be a square.
    pub(crate) fn enlarged(&self, of: impl Fn(f32) -> f32 + Sync) -> Plane {
        enlarged(&self.amplitude.map(of), self.factor, self.width, self.height)
    }

    /// `of` this amplitude and another one's of the same band.
    pub(crate) fn enlarged_with(&self, other: &Self, of: impl Fn(f32, f32) -> f32 + Sync) -> Plane {
        enlarged(&self.amplitude.combined(&other.amplitude, of), self.factor, self.width, self.height)
    }
}

impl<'a> ErrorFilters<'a> {
    /// For errors that go on beyond the picture as they are in it, such as noise: mirrored. The field that responses are given for is
    /// the picture.
    pub(crate) fn new(map: &'a ThresholdMap) -> Self {
        Self::with_surround(map, Surround::Mirror)
    }

    /// For differences of two pictures that have nothing different around them. The field that responses are given for is the picture
    /// and as much around it as the pooling window reaches over: what an error at the border does to the eye, it does on both sides.
    ///
    /// What changes slowly, the difference through a Gaussian of 1°, is mirrored all the same. With nothing at all outside, a picture
    /// that is brighter as a whole would have an edge where it ends, which nobody sees: the display's surround is there, not a picture
    /// that is equal.
    pub(crate) fn amid_equals(map: &'a ThresholdMap) -> Self {
        Self::with_surround(map, Surround::SmoothMirror)
    }

    fn with_surround(map: &'a ThresholdMap, surround: Surround) -> Self {
        let density = map.viewing.display.pixel_density();
        Self {
            map,
            transform: PictureTransform::new(map.width(), map.height(), density),
            workspace: Workspace::default(),
            positions: map.adaptation_cd_m2.map(|adaptation| map.level_position(adaptation)),
            surround,
        }
    }

    /// Spectrum of an error, display cd/m², over the adaptation luminance.
    pub(crate) fn spectrum(&mut self, error: &Plane) -> Spectrum {
        let relative = error.combined(&self.map.adaptation_cd_m2, |difference, adaptation| {
            if difference.is_finite() {
                (difference / adaptation).clamp(-LARGEST_RELATIVE_ERROR, LARGEST_RELATIVE_ERROR)
            } else {
                0.0
            }
        });
        match self.surround {
            Surround::Mirror => self.plain_spectrum(&relative),
            Surround::SmoothMirror => self.transform.forward_amid(
                &mut self.workspace,
                &relative,
                &self.map.blurred(&relative, SURROUND_SIGMA_DEG),
            ),
        }
    }

    /// Pixels beside and above the picture that belong to the field: a multiple of every band's reduction.
    fn margin(&self) -> (usize, usize) {
        if self.surround == Surround::Mirror {
            return (0, 0);
        }
        let density = self.map.viewing.display.pixel_density();
        // The lowest band's, at most 1/4°: it leaves room in the transform's own margin of at least 1°.
        let step = self.reduction_of(0);
        let pixels =
            |density: f64| ((POOLING_REACH * POOLING_SIGMA_DEG * density).ceil() as usize).next_multiple_of(step);
        (pixels(density.horizontal), pixels(density.vertical))
    }

    fn reduction_of(&self, band: usize) -> usize {
        // The energy reaches twice as far in frequency as the amplitude.
        reduction(self.map.viewing.display.pixel_density(), 2.0 * self.map.bands.limit_cpd(band))
    }

    /// 0 at every pixel of the field.
    pub(crate) fn nothing(&self) -> Plane {
        let (beside, above) = self.margin();
        Plane::filled(self.map.width() + 2 * beside, self.map.height() + 2 * above, 0.0)
    }

    /// Σ_b (`V_b` / `m_b`)² of an error at every pixel of the field.
    pub(crate) fn energy(&mut self, error: &Plane) -> Plane {
        let spectrum = self.spectrum(error);
        let mut energy = self.nothing();
        for band in 0..self.map.band_count() {
            let whole = self.response(&spectrum, band).enlarged(|amplitude| amplitude * amplitude);
            energy.for_each_row_mut(|y, row| {
                row.iter_mut().zip(whole.row(y)).for_each(|(value, more)| *value += more);
            });
        }
        energy
    }

    /// v of an error at every pixel of the picture; for errors that are finite.
    pub(crate) fn visibility(&mut self, error: &Plane) -> Plane {
        let energy = self.energy(error);
        self.visibility_of(&energy)
    }

    /// Bands of the map.
    pub(crate) fn band_count(&self) -> usize {
        self.map.band_count()
    }

    /// v at every pixel of the picture, from an energy over the field.
    pub(crate) fn visibility_of(&self, energy: &Plane) -> Plane {
        let pooled = self.map.pooled(energy);
        let (beside, above) = self.margin();
        Plane::from_fn(self.map.width(), self.map.height(), |x, y| (2.0 * pooled.get(x + beside, y + above)).sqrt())
    }

    /// Amplitude gain of a band's filter at one of the map's adaptation levels.
    pub(crate) fn gain(&self, band: usize, level: usize) -> RadialTable {
        let density = self.map.viewing.display.pixel_density();
        RadialTable::new(density, |freq| self.map.bands.gain(band, freq)).times(&self.map.levels[level].sensitivity)
    }

    /// What of an error stands in a band.
    pub(crate) fn response(&mut self, spectrum: &Spectrum, band: usize) -> BandResponse {
        let (width, height) = (self.map.width(), self.map.height());
        let limit_cpd = self.map.bands.limit_cpd(band);
        let factor = self.reduction_of(band);
        let (beside, above) = self.margin();
        let frame = Frame { factor, beside: beside / factor, above: above / factor };
        let columns = frame.columns(width);
        let mut amplitude = Plane::filled(columns.len(), frame.samples_down(height), 0.0);
        for index in 0..self.map.levels.len() {
            let gain = self.gain(band, index);
            let filtered =
                self.transform.filtered_reduced(&mut self.workspace, spectrum, limit_cpd, frame, |freq| gain.at(freq));
            let positions = &self.positions;
            amplitude.for_each_row_mut(|y, row| {
                let positions = positions.row(frame.row(y, height));
                for ((value, filtered), x) in row.iter_mut().zip(filtered.row(y)).zip(&columns) {
                    *value += filtered * (1.0 - (positions[*x] - index as f32).abs()).max(0.0);
                }
            });
        }
        let elevation = &self.map.elevations[band];
        amplitude.for_each_row_mut(|y, row| {
            let mut elevations = vec![0.0; width];
            elevation.row_into(frame.row(y, height), &mut Vec::new(), &mut elevations);
            row.iter_mut().zip(&columns).for_each(|(value, x)| *value /= elevations[*x]);
        });
        BandResponse { amplitude, factor, width: width + 2 * beside, height: height + 2 * above }
    }

    /// The error itself in a band, without the eye's sensitivity: the bands add up to it.
    pub(crate) fn share_of_band(&mut self, spectrum: &Spectrum, band: usize) -> Plane {
        let (width, height) = (self.map.width(), self.map.height());
        let limit_cpd = self.map.bands.limit_cpd(band);
        let frame = Frame::narrow(self.reduction_of(band));
        let bands = &self.map.bands;
        let gain = RadialTable::new(self.map.viewing.display.pixel_density(), |freq| bands.gain(band, freq).powi(2));
        let filtered =
            self.transform.filtered_reduced(&mut self.workspace, spectrum, limit_cpd, frame, |freq| gain.at(freq));
        enlarged(&filtered, frame.factor, width, height)
    }

    /// Spectrum of any plane, as it stands.
    pub(crate) fn plain_spectrum(&mut self, plane: &Plane) -> Spectrum {
        self.transform.forward(&mut self.workspace, |y, row| row.copy_from_slice(plane.row(y)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;
    use crate::display::{Display, Viewing};
    use crate::test_golden::check;
    use crate::test_noise::normal;
    use crate::threshold::{ThresholdInputs, threshold_map};

    fn map_of(picture: &Plane, pixels_per_degree: f64) -> ThresholdMap {
        let viewing = Viewing { display: Display { pixels_per_degree, ..Display::default() }, ..Viewing::default() };
        let inputs = ThresholdInputs::clean(picture);
        threshold_map(&inputs, &viewing, &CastleCsf::default()).unwrap()
    }

    fn noise(width: usize, height: usize, sigma: impl Fn(usize, usize) -> f32, seed: u64) -> Plane {
        let mut state = seed;
        let mut plane = Plane::filled(width, height, 0.0);
        for y in 0..height {
            for x in 0..width {
                plane.values_mut()[y * width + x] = sigma(x, y) * normal(&mut state);
            }
        }
        plane
    }

    /// Amplitudes S(ρ, L)/L of a unit grating; v of a grating is its amplitude in threshold units.
    #[test]
    fn gratings_have_their_contrast_over_threshold() {
        check("fft_grating_castle_N256_ppd32", 2e-3, |row| {
            let (freq, luminance) = (row[0], row[1] as f32);
            let map = map_of(&Plane::filled(256, 256, luminance), 32.0);
            // Phase such that the mirrored picture goes on as the same grating.
            let grating =
                Plane::from_fn(256, 256, |x, _| (std::f64::consts::TAU * freq * (x as f64 + 0.5) / 32.0).cos() as f32);
            f64::from(map.measured_visibility(&grating).get(128, 128))
        });
    }

    /// The transform is periodic: what stands at one border must not be seen at the other, 7° away.
    #[test]
    fn an_error_at_a_border_stays_there() {
        let last_degree =
            |width: usize| Plane::from_fn(width, 64, move |x, _| if x + 32 >= width { 198.0 } else { 0.0 });
        let at_opposite_border = |width: usize, column: usize| {
            map_of(&Plane::filled(width, 64, 2.0), 32.0).measured_visibility(&last_degree(width)).get(column, 32)
        };
        // The same column where four more degrees of grey lie beside it.
        let (found, expected) = (at_opposite_border(256, 0), at_opposite_border(256 + 128, 128));
        assert!(found < 3.0 * expected, "{found}, not {expected}");
    }

    #[test]
    fn a_lone_pixel_reaches_the_tabulated_peak() {
        let map = map_of(&Plane::filled(256, 256, 100.0), 30.0);
        let mut pixel = Plane::filled(256, 256, 0.0);
        pixel.values_mut()[128 * 256 + 128] = 1.0;
        let found = map.measured_error(&pixel).amplitude.get(128, 128);
        // mean(S)/100 = 0.695 for all bands in phase; by energy the same peak is lower by the bands' overlap.
        assert!((0.35..0.75).contains(&found), "{found}");
    }

    #[test]
    fn white_noise_is_as_visible_as_predicted() {
        for (luminance, ppd) in [(1.0, 20.0), (10.0, 60.0), (30.0, 38.0), (57.0, 60.0), (100.0, 30.0), (190.0, 110.0)] {
            let map = map_of(&Plane::filled(256, 256, luminance), ppd);
            let sigma = 0.02 * luminance;
            let predicted = map.predicted_visibility(&Plane::filled(256, 256, sigma * sigma));
            let squares: f64 = (0..4)
                .map(|seed| map.measured_visibility(&noise(256, 256, |_, _| sigma, seed)).map(|v| v * v).mean())
                .sum::<f64>()
                / 4.0;
            let found = squares.sqrt() / predicted.map(|v| v * v).mean().sqrt();
            assert!((found - 1.0).abs() < 0.05, "{luminance} cd/m², {ppd} ppd: measured/predicted {found}");
            // And what the gain says of it.
            let from_gain = (2.0 * map.noise_gain().get(9, 9)).sqrt() * sigma;
            assert!((predicted.get(9, 9) / from_gain - 1.0).abs() < 1e-3);
        }
    }

    /// Patchy noise on a textured picture: prediction and measurement agree place by place.
    #[test]
    fn patchy_noise_under_masking_is_as_visible_as_predicted() {
        let picture = Plane::from_fn(256, 256, |x, y| {
            let wave = ((x as f32 * 0.4).cos() * (y as f32 * 0.45).cos()) * if x > 128 { 0.6 } else { 0.0 };
            (60.0 + 0.4 * y as f32) * (1.0 + wave)
        });
        let map = map_of(&picture, 60.0);
        let sigma = |x: usize, y: usize| {
            if (x / 64 + y / 64).is_multiple_of(2) { 6.0 } else { 1.0 }
        };
        let predicted = map.predicted_visibility(&Plane::from_fn(256, 256, |x, y| sigma(x, y) * sigma(x, y)));
        let mut measured = Plane::filled(256, 256, 0.0);
        for seed in 0..16 {
            let one = map.measured_visibility(&noise(256, 256, sigma, 100 + seed));
            measured = measured.combined(&one, |sum, v| sum + v * v / 16.0);
        }
        for (x, y) in [(32, 32), (96, 32), (160, 32), (224, 32), (32, 96), (96, 96), (224, 160), (160, 160), (128, 128)]
        {
            let found = measured.get(x, y).sqrt() / predicted.get(x, y);
            assert!((found - 1.0).abs() < 0.15, "({x}, {y}): measured/predicted {found}");
        }
    }

    #[test]
    fn broken_input_never_gives_nan() {
        let map = map_of(&Plane::filled(16, 16, 50.0), 30.0);
        let mut broken = Plane::filled(16, 16, 1.0);
        broken.values_mut()[17] = f32::NAN;
        broken.values_mut()[40] = f32::INFINITY;
        broken.values_mut()[41] = f32::MAX;
        for visibility in [map.predicted_visibility(&broken), map.measured_visibility(&broken)] {
            assert!(visibility.values().iter().all(|v| !v.is_nan()));
        }
        for visibility in
            [map.predicted_visibility(&broken), map.measured_visibility(&broken), map.measured_error(&broken).amplitude]
        {
            assert!(
                visibility.get(1, 1).is_infinite()
                    && visibility.get(8, 2).is_infinite()
                    && visibility.get(8, 8).is_finite()
            );
        }
        assert!(map.predicted_visibility(&broken).get(8, 8).is_finite());
        assert!(map.measured_visibility(&Plane::filled(3, 3, 1.0)).get(0, 0).is_infinite());
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let picture = Plane::from_fn(97, 61, |x, y| 10.0 + ((x * y) % 17) as f32);
        let error = noise(97, 61, |_, _| 1.0, 5);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let map = map_of(&picture, 40.0);
                (map.noise_gain().clone(), map.measured_visibility(&error), map.predicted_visibility(&picture))
            })
        };
        assert_eq!(run(1), run(3));
    }
}
