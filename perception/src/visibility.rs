//! Visibility: an error in threshold units.
//!
//! v(x) = √2 · sqrt(g ⊗ E\[V²\])(x), where V is the display error over the adaptation luminance, through the contrast
//! sensitivity function and divided by each band's masking, and g is a Gaussian of σ 0.25°. Bands add by energy. A
//! grating at its threshold has v = 1: the √2 turns its RMS into its amplitude.
//!
//! For whether an error is seen, and how far it is above threshold or below. Not for how much it disturbs: twice the
//! visibility is twice the amplitude, and no judgement of quality.

use crate::error_filters::{ErrorFilters, MAX_RELATIVE_ERROR};
use crate::filter::{gaussian_blur_xy, squared_weights};
use crate::plane::Plane;
use crate::sensitivity::luminance_coordinate;
use crate::threshold::{POOLING_SIGMA_DEG, ThresholdMap};

/// The square of [`MAX_RELATIVE_ERROR`].
const MAX_RELATIVE_VARIANCE: f32 = MAX_RELATIVE_ERROR * MAX_RELATIVE_ERROR;

/// Visibility of a measured error, pooled and not.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredError {
    /// Visibility v(x) in threshold units: pooled, times √2.
    pub visibility: Plane,
    /// The unpooled amplitude sqrt(Σ_b `V_b`²) at each pixel in threshold units: what a lone bright pixel shows,
    /// which pooling would hide.
    pub amplitude: Plane,
}

/// How a pooled mean scatters, see [`ThresholdMap::pooled_scatter`].
#[derive(Clone, Debug, PartialEq)]
pub struct PooledScatter {
    /// Its variance, the square of the pixels' unit.
    pub variance: Plane,
    /// Its third central moment, the cube of that unit: above 0 where few pixels bring much.
    pub third_moment: Plane,
}

/// An error as filters show it.
struct PooledError {
    /// At every pixel of the picture; infinite where the error is no number.
    visibility: Plane,
    /// Σ_b `V_b`² at every pixel of the filters' field, from which that is pooled.
    energy: Plane,
}

impl ThresholdMap {
    /// Visibility that independent pixel errors of this variance ((cd/m²)² on the display, of the pixel's mean) will
    /// have, on average over noise.
    ///
    /// v² = 2 g ⊗ Σ_b (mean(S² `B_b`²) / `m_b`²) · (`h_b`² ⊗ σ²/`L_a`²): each band smears the noise's energy by the
    /// width of its own impulse response before masking acts.
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
                (variance / adaptation / adaptation).min(MAX_RELATIVE_VARIANCE)
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
    /// D/`L_a` is filtered by the contrast sensitivity function of half-decade adaptation levels, interpolated
    /// linearly in luminance, band by band; each band is divided by its masking; energies are added and pooled.
    ///
    /// Pixels that are not finite get infinity and count as 0 for the others; a plane of another size gets infinity
    /// everywhere.
    #[must_use]
    pub fn measured_visibility(&self, half_difference: &Plane) -> Plane {
        self.pooled_error(ErrorFilters::new(self), half_difference)
            .map_or_else(|| self.infinite(), |error| error.visibility)
    }

    /// [`ThresholdMap::measured_visibility`] of a difference that ends with the pictures (see
    /// [`ErrorFilters::amid_equals`]).
    pub(crate) fn visibility_amid_equals(&self, difference: &Plane) -> Plane {
        self.pooled_error(ErrorFilters::amid_equals(self), difference)
            .map_or_else(|| self.infinite(), |error| error.visibility)
    }

    /// [`ThresholdMap::measured_visibility`], and the unpooled amplitude beside it.
    #[must_use]
    pub fn measured_error(&self, half_difference: &Plane) -> MeasuredError {
        match self.pooled_error(ErrorFilters::new(self), half_difference) {
            None => MeasuredError { visibility: self.infinite(), amplitude: self.infinite() },
            Some(PooledError { visibility, energy }) => {
                MeasuredError { visibility, amplitude: infinite_where_unknown(energy.map(f32::sqrt), half_difference) }
            }
        }
    }

    /// What filters make of an error; `None` for one of another size.
    fn pooled_error(&self, mut filters: ErrorFilters<'_>, error: &Plane) -> Option<PooledError> {
        if !self.fits(error) {
            return None;
        }
        let energy = filters.energy(error);
        Some(PooledError { visibility: infinite_where_unknown(filters.visibility_of(&energy), error), energy })
    }

    /// `plane` convolved with the pooling window g, a Gaussian of σ 0.25° (any unit, unchanged).
    #[must_use]
    pub fn pooled(&self, plane: &Plane) -> Plane {
        self.blurred(plane, POOLING_SIGMA_DEG)
    }

    /// How [`Self::pooled`] scatters of a plane whose pixels are independent and deviate from what they should be as
    /// `deviations` do, where those change little over the window. The window's powers are windows themselves, 1/√2
    /// and 1/√3 as wide.
    #[must_use]
    pub fn pooled_scatter(&self, deviations: &Plane) -> PooledScatter {
        let sigma_px = self.viewing.display.pixel_density().pixels(POOLING_SIGMA_DEG);
        let [columns, rows] = [(sigma_px[0], self.width()), (sigma_px[1], self.height())]
            .map(|(sigma_px, len)| squared_weights(sigma_px, len));
        let pooled_power = |power: i32, weight: fn(f32) -> f32| {
            let narrower = sigma_px.map(|sigma_px| sigma_px / f64::from(power).sqrt());
            let pooled = gaussian_blur_xy(&deviations.map(|deviation| deviation.powi(power)), narrower);
            Plane::from_fn(self.width(), self.height(), |x, y| weight(columns[x] * rows[y]) * pooled.get(x, y))
        };
        PooledScatter {
            variance: pooled_power(2, |squares| squares),
            // Of a Gaussian along each axis Σ k³ = (Σ k²)² · 2/√3.
            third_moment: pooled_power(3, |squares| squares * squares * (4.0 / 3.0)),
        }
    }

    pub(crate) fn blurred(&self, plane: &Plane, sigma_deg: f64) -> Plane {
        gaussian_blur_xy(plane, self.viewing.display.pixel_density().pixels(sigma_deg))
    }

    pub(crate) fn band_count(&self) -> usize {
        self.elevations.len()
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

    /// By the window's own weights, in the middle, at a border and in a corner. Three boxes are no Gaussian: along an
    /// axis ∫k² is 2.6 % less, ∫k³ 6.7 %, so that rather too much is told.
    #[test]
    fn pooled_noise_scatters_as_the_window_weighs() {
        let (width, height) = (24, 16);
        let map = map_of(&Plane::filled(width, height, 100.0), 10.0);
        let told = map.pooled_scatter(&Plane::filled(width, height, 2.0));
        let windows: Vec<Plane> = (0..width * height)
            .map(|from| {
                map.pooled(&Plane::from_fn(width, height, |x, y| if y * width + x == from { 1.0 } else { 0.0 }))
            })
            .collect();
        for (x, y) in [(12, 8), (12, 0), (0, 8), (23, 15)] {
            let of_weights =
                |power: i32| windows.iter().map(|window| (2.0 * window.get(x, y)).powi(power)).sum::<f32>();
            for (told, found) in [(&told.variance, of_weights(2)), (&told.third_moment, of_weights(3))] {
                assert!((0.98..1.18).contains(&(told.get(x, y) / found)), "({x}, {y}): {} for {found}", told.get(x, y));
            }
        }
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

    /// On black: however strong it is, a texture stays one.
    #[test]
    fn a_stronger_error_is_not_less_visible() {
        let map = map_of(&Plane::filled(64, 64, 0.005), 60.0);
        let texture = |scale: f32| Plane::from_fn(64, 64, |x, y| scale * (0.5 + ((x * 7 + y * 13) % 11) as f32 * 0.05));
        let seen = [0.5, 5.0, 50.0, 200.0, 1e4, 1e8, 1e37].map(|scale| map.measured_visibility(&texture(scale)).mean());
        let falls = |pair: &[f64]| pair[1] < 0.99 * pair[0];
        assert!(!seen.windows(2).any(falls) && seen[2] > seen[1], "{seen:?}");
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
