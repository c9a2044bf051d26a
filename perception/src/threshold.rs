//! The threshold map: how much error each pixel of a picture may have before it is seen.

use crate::adaptation::local_adaptation;
use crate::bands::OctaveBands;
use crate::csf::ContrastSensitivity;
use crate::display::Viewing;
use crate::error::Error;
use crate::fft::PictureTransform;
use crate::masking::{ElevationTable, MaskSource, band_elevation};
use crate::motion::MotionTable;
use crate::plane::Plane;
use crate::reduced::ReducedPlane;
use crate::sensitivity::{AdaptationLevel, SensitivityTables, adaptation_levels, luminance_coordinate};

/// Standard deviation of the windows over which the eye adapts and error is pooled, degrees: as wide as a disc of 1°.
pub const POOLING_SIGMA_DEG: f64 = 0.25;

/// The picture that thresholds are found for.
#[derive(Clone, Copy, Debug)]
pub struct ThresholdInputs<'a> {
    /// Luminance of the denoised guide as the display shows it, cd/m².
    pub display_luminance_cd_m2: &'a Plane,
    /// Variance of the noise left in that guide, (cd/m²)², taken as white: its energy is taken out of the masks, so that noise
    /// does not hide noise. For a denoised guide, whose noise is no longer white, the variance *before* denoising
    /// bounds the noise in every band. `None` takes the guide as clean.
    pub guide_variance: Option<&'a Plane>,
}

/// What the eye in front of one display can see at each pixel of one picture.
///
/// Made by [`threshold_map`]. Errors are asked about in display cd/m².
#[derive(Clone, Debug)]
pub struct ThresholdMap {
    pub(crate) viewing: Viewing,
    pub(crate) bands: OctaveBands,
    pub(crate) tables: SensitivityTables,
    pub(crate) levels: Vec<AdaptationLevel>,
    pub(crate) adaptation_cd_m2: Plane,
    /// Threshold elevation of each band.
    pub(crate) elevations: Vec<ReducedPlane>,
    pub(crate) noise_gain: Plane,
}

/// Finds adaptation, masking and thresholds of a picture.
///
/// Adaptation is the arithmetic mean over a Gaussian of σ 0.25° (the variance of a disc of 1°), after single pixels
/// brighter than all their neighbours have been brought down to them: a firefly must not raise its own threshold.
/// Masking is each octave band's own, see [`crate::masking`].
///
/// # Errors
/// [`Error::Empty`] and [`Error::BadPixel`] for pictures that are none, [`Error::SizeMismatch`] for a variance of
/// another size, [`Error::OutOfRange`] for an impossible viewing.
///
/// ```
/// use fechner_perception::{CastleCsf, Plane, ThresholdInputs, Viewing, threshold_map};
/// let grey = Plane::filled(64, 64, 100.0);
/// let inputs = ThresholdInputs { display_luminance_cd_m2: &grey, guide_variance: None };
/// let map = threshold_map(&inputs, &Viewing::default(), &CastleCsf::default())?;
/// // At 60 pixels a degree white noise of 1.73 % is at threshold.
/// let allowed = map.allowed_standard_error_cd_m2(1.0).get(32, 32);
/// assert!((allowed - 1.73).abs() < 0.02);
/// # Ok::<(), fechner_perception::Error>(())
/// ```
pub fn threshold_map(
    inputs: &ThresholdInputs<'_>,
    viewing: &Viewing,
    csf: &dyn ContrastSensitivity,
) -> Result<ThresholdMap, Error> {
    viewing.check()?;
    let guide = inputs.display_luminance_cd_m2;
    guide.check_non_negative("display luminance")?;
    if let Some(variance) = inputs.guide_variance {
        variance.check_size("guide variance", guide.width(), guide.height())?;
        variance.check_non_negative("guide variance")?;
    }
    let adaptation_cd_m2 = local_adaptation(guide, viewing.display.pixels_per_degree);
    Ok(assemble(guide, inputs.guide_variance, adaptation_cd_m2, viewing, csf))
}

/// Finds thresholds of one chromatic channel of a picture, to be asked about errors in that channel.
///
/// `channel_cd_m2` is the channel's signal in the denoised guide and `display_luminance_cd_m2` the guide's luminance (both
/// from [`crate::opponent::opponent`] of the displayed colours): adaptation comes from luminance, masking from the
/// channel's own contrast. `csf` is the channel's, e.g. [`crate::csf::CastleChromatic`].
///
/// # Errors
/// As [`threshold_map`]; the channel's signal may be negative.
pub fn chromatic_threshold_map(
    channel_cd_m2: &Plane,
    display_luminance_cd_m2: &Plane,
    viewing: &Viewing,
    csf: &dyn ContrastSensitivity,
) -> Result<ThresholdMap, Error> {
    viewing.check()?;
    display_luminance_cd_m2.check_non_negative("display luminance")?;
    channel_cd_m2.check_size("chromatic signal", display_luminance_cd_m2.width(), display_luminance_cd_m2.height())?;
    channel_cd_m2.map(f32::abs).check_non_negative("chromatic signal")?;
    let adaptation_cd_m2 = local_adaptation(display_luminance_cd_m2, viewing.display.pixels_per_degree);
    Ok(assemble(channel_cd_m2, None, adaptation_cd_m2, viewing, csf))
}

/// Masks and noise gain of a signal, cd/m², under an adaptation luminance.
fn assemble(
    signal_cd_m2: &Plane,
    noise_variance: Option<&Plane>,
    adaptation_cd_m2: Plane,
    viewing: &Viewing,
    csf: &dyn ContrastSensitivity,
) -> ThresholdMap {
    let ppd = viewing.display.pixels_per_degree;
    let bands = OctaveBands::for_grid(ppd);
    let tables = SensitivityTables::new(&bands, viewing, csf);
    let coordinates = adaptation_cd_m2.map(luminance_coordinate);

    let transform = picture_transform(signal_cd_m2.width(), signal_cd_m2.height(), ppd);
    // Less its mean, which no band passes: the transform's precision is for the detail.
    let mut contrast = ratio(signal_cd_m2, &adaptation_cd_m2, |value, adaptation| value / adaptation);
    let mean = contrast.mean() as f32;
    contrast.for_each_row_mut(|_, row| row.iter_mut().for_each(|value| *value -= mean));
    let spectrum = transform.forward(&contrast);
    drop(contrast);
    let noise = noise_variance
        .map(|variance| ratio(variance, &adaptation_cd_m2, |value, adaptation| value / adaptation / adaptation));
    let source = MaskSource {
        transform: &transform,
        contrast: &spectrum,
        noise: noise.as_ref(),
        coordinates: &coordinates,
        pixels_per_degree: ppd,
    };
    let elevation = ElevationTable::new();
    let elevations: Vec<ReducedPlane> = tables
        .bands
        .iter()
        .enumerate()
        .map(|(band, band_tables)| band_elevation(&source, &bands, band, band_tables, &elevation))
        .collect();

    let noise_gain = noise_gain(&tables, &adaptation_cd_m2, &coordinates, Some(&elevations));
    let (least, greatest) = range(&adaptation_cd_m2);
    let levels = adaptation_levels(viewing, csf, least, greatest);
    ThresholdMap { viewing: viewing.clone(), bands, tables, levels, adaptation_cd_m2, elevations, noise_gain }
}

impl ThresholdMap {
    /// Adaptation luminance, cd/m², at least 1e-4.
    #[must_use]
    pub fn adaptation_cd_m2(&self) -> &Plane {
        &self.adaptation_cd_m2
    }

    /// N(x) in 1/(cd/m²)²: white pixel noise of locally constant variance σ² has visibility v with v² = 2 N σ².
    ///
    /// N = Σ_b mean(S² `B_b`²) / (`m_b` `L_a`)², the mean taken over the frequencies of the pixel grid.
    #[must_use]
    pub fn noise_gain(&self) -> &Plane {
        &self.noise_gain
    }

    /// Standard error of a pixel's mean, cd/m², that leaves white noise at `visibility`: v / √(2N).
    #[must_use]
    pub fn allowed_standard_error_cd_m2(&self, visibility: f64) -> Plane {
        self.noise_gain.map(|gain| (visibility / (2.0 * f64::from(gain)).sqrt()) as f32)
    }

    /// How many times masking raises the allowed standard error of white noise at each pixel, 1 to 3.
    #[must_use]
    pub fn masking_elevation(&self) -> Plane {
        let coordinates = self.adaptation_cd_m2.map(luminance_coordinate);
        let unmasked = noise_gain(&self.tables, &self.adaptation_cd_m2, &coordinates, None);
        ratio(&unmasked, &self.noise_gain, |unmasked, masked| (unmasked / masked).sqrt())
    }

    /// The same thresholds for error that moves over the retina at `retinal_velocity_deg_s` (see [`crate::motion`]).
    ///
    /// Each band's threshold is raised, or at low frequencies lowered, by the ratio of Daly's 1998 spatiovelocity
    /// sensitivity at rest to that in motion at the band's centre, kept within 0.1 and 20.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`] and [`Error::BadPixel`] for velocities that do not fit.
    pub fn with_motion(&self, retinal_velocity_deg_s: &Plane) -> Result<Self, Error> {
        retinal_velocity_deg_s.check_size("velocity", self.width(), self.height())?;
        retinal_velocity_deg_s.check_non_negative("velocity")?;
        let mut moved = self.clone();
        for (band, elevation) in moved.elevations.iter_mut().enumerate() {
            let table = MotionTable::new(self.bands.center_cpd(band));
            *elevation =
                elevation.change_by(retinal_velocity_deg_s, |elevation, velocity| elevation * table.at(velocity));
        }
        let coordinates = self.adaptation_cd_m2.map(luminance_coordinate);
        moved.noise_gain = noise_gain(&self.tables, &self.adaptation_cd_m2, &coordinates, Some(&moved.elevations));
        Ok(moved)
    }

    /// The viewing that the thresholds hold for.
    #[must_use]
    pub fn viewing(&self) -> &Viewing {
        &self.viewing
    }

    /// Columns, pixels.
    #[must_use]
    pub fn width(&self) -> usize {
        self.adaptation_cd_m2.width()
    }

    /// Rows, pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        self.adaptation_cd_m2.height()
    }
}

/// The transform for pictures of this size at this resolution: one degree of mirror on each side, since contrast
/// sensitivity reaches no further.
pub(crate) fn picture_transform(width: usize, height: usize, pixels_per_degree: f64) -> PictureTransform {
    PictureTransform::new(width, height, pixels_per_degree.ceil() as usize)
}

/// `change(a, b)` at every pixel of two planes of one size.
pub(crate) fn ratio(a: &Plane, b: &Plane, change: impl Fn(f32, f32) -> f32 + Sync) -> Plane {
    let mut result = a.clone();
    result.for_each_row_mut(|y, row| {
        for (value, other) in row.iter_mut().zip(b.row(y)) {
            *value = change(*value, *other);
        }
    });
    result
}

/// N(x) under an adaptation luminance, with each band's masking or without any.
pub(crate) fn noise_gain(
    tables: &SensitivityTables,
    adaptation_cd_m2: &Plane,
    coordinates: &Plane,
    elevations: Option<&[ReducedPlane]>,
) -> Plane {
    let mut gain = Plane::filled(adaptation_cd_m2.width(), adaptation_cd_m2.height(), 0.0);
    gain.for_each_row_mut(|y, row| {
        let coordinates = coordinates.row(y);
        let (mut buffer, mut elevation) = (Vec::new(), vec![0.0; row.len()]);
        // Band by band: each row of elevations is read in one go.
        for (band, tables) in tables.bands.iter().enumerate() {
            let energies = coordinates.iter().map(|&coordinate| tables.noise_energy.at(coordinate));
            match elevations {
                Some(elevations) => {
                    elevations[band].row_into(y, &mut buffer, &mut elevation);
                    for (value, (energy, elevation)) in row.iter_mut().zip(energies.zip(&elevation)) {
                        *value += energy / (elevation * elevation);
                    }
                }
                None => row.iter_mut().zip(energies).for_each(|(value, energy)| *value += energy),
            }
        }
        // Divided twice: the square of 1e-4 cd/m² and of 1e20 must both stay within f32.
        for (value, adaptation) in row.iter_mut().zip(adaptation_cd_m2.row(y)) {
            *value = *value / adaptation / adaptation;
        }
    });
    gain
}

fn range(plane: &Plane) -> (f32, f32) {
    plane
        .values()
        .iter()
        .fold((f32::INFINITY, 0.0), |(least, greatest), &value| (least.min(value), greatest.max(value)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;
    use crate::display::Display;

    fn viewing(pixels_per_degree: f64) -> Viewing {
        Viewing { display: Display { pixels_per_degree, ..Display::default() }, ..Viewing::default() }
    }

    fn map_of(picture: &Plane, viewing: &Viewing) -> ThresholdMap {
        let inputs = ThresholdInputs { display_luminance_cd_m2: picture, guide_variance: None };
        threshold_map(&inputs, viewing, &CastleCsf::default()).unwrap()
    }

    /// Standard error at v = 1 is σ/L = 1 / (S_peak G √2) with the specification's S_peak and G of white noise.
    #[test]
    fn uniform_pictures_have_the_tabulated_thresholds() {
        for (luminance, ppd, expected) in [
            (1.0, 30.0, 1.0 / (40.160_55 * 0.295_844)),
            (1.0, 60.0, 1.0 / (40.160_55 * 0.149_091)),
            (10.0, 20.0, 1.0 / (86.063_1 * 0.616_258)),
            (10.0, 60.0, 1.0 / (86.063_1 * 0.227_654)),
            (100.0, 20.0, 1.0 / (134.296_3 * 0.748_92)),
            (100.0, 30.0, 1.0 / (134.296_3 * 0.567_412)),
            (100.0, 60.0, 1.0 / (134.296_3 * 0.304_307)),
        ] {
            let map = map_of(&Plane::filled(32, 24, luminance), &viewing(ppd));
            let allowed = f64::from(map.allowed_standard_error_cd_m2(1.0).get(16, 12)) / f64::from(luminance);
            let expected = expected / std::f64::consts::SQRT_2;
            assert!((allowed / expected - 1.0).abs() < 2e-3, "{luminance} cd/m², {ppd} ppd: {allowed}, not {expected}");
        }
    }

    #[test]
    fn an_edge_masks_nothing_beside_it() {
        for ppd in [38.0, 60.0] {
            let step = Plane::from_fn(256, 64, |x, _| if x < 128 { 50.0 } else { 100.0 });
            let elevation = map_of(&step, &viewing(ppd)).masking_elevation();
            let beside = (0.25 * ppd) as usize;
            for x in [128 - beside, 127 + beside] {
                let found = elevation.get(x, 32);
                assert!(found < 1.25, "{ppd} ppd, x {x}: {found}");
            }
        }
    }

    #[test]
    fn texture_masks_and_its_own_noise_does_not() {
        let wave = |amplitude: f32| {
            Plane::from_fn(192, 192, move |x, y| {
                let phase = std::f32::consts::TAU * 4.0 / 60.0;
                100.0 * (1.0 + amplitude * ((x as f32 * phase).cos() * (y as f32 * phase).cos()))
            })
        };
        let textured = map_of(&wave(0.3), &viewing(60.0)).masking_elevation().get(96, 96);
        assert!(textured > 1.15, "{textured}");
        // White noise of 10 % of the mean, known as such, and unknown.
        let mut state = 1_u64;
        let noisy = Plane::from_values(192, 192, (0..192 * 192).map(|_| 100.0 + 10.0 * normal(&mut state)).collect());
        let noisy = noisy.unwrap();
        let variance = Plane::filled(192, 192, 100.0);
        let known = ThresholdInputs { display_luminance_cd_m2: &noisy, guide_variance: Some(&variance) };
        let known = threshold_map(&known, &viewing(60.0), &CastleCsf::default()).unwrap().masking_elevation();
        let unknown = map_of(&noisy, &viewing(60.0)).masking_elevation();
        assert!(known.mean() < 1.01 && unknown.mean() > 1.2, "known {} unknown {}", known.mean(), unknown.mean());
    }

    #[test]
    fn a_firefly_does_not_raise_its_threshold() {
        let mut picture = Plane::filled(64, 64, 20.0);
        picture.values_mut()[32 * 64 + 32] = 200.0;
        let adapted = map_of(&picture, &viewing(60.0)).adaptation_cd_m2().get(32, 32);
        assert!((adapted - 20.0).abs() < 1e-3, "{adapted}");
    }

    #[test]
    fn any_size_and_luminance_gives_finite_thresholds() {
        for (width, height) in [(1, 1), (2, 1), (1, 9), (3, 3), (17, 5)] {
            for luminance in [0.0, 1e-30, 1e-4, 1.0, 1e8] {
                let map = map_of(&Plane::filled(width, height, luminance), &viewing(30.0));
                let allowed = map.allowed_standard_error_cd_m2(1.0);
                assert!(allowed.values().iter().all(|value| value.is_finite() && *value > 0.0), "{luminance}");
            }
        }
    }

    #[test]
    fn error_that_moves_fast_may_be_larger() {
        let map = map_of(&Plane::filled(32, 32, 50.0), &viewing(60.0));
        let at = |velocity| {
            let moved = map.with_motion(&Plane::filled(32, 32, velocity)).unwrap();
            moved.allowed_standard_error_cd_m2(1.0).get(16, 16)
        };
        let still = map.allowed_standard_error_cd_m2(1.0).get(16, 16);
        assert!((at(0.0) / still - 1.0).abs() < 1e-5 && (at(0.15) / still - 1.0).abs() < 1e-5);
        assert!(at(10.0) > 2.0 * still, "{} {still}", at(10.0));
        assert!(at(1e9).is_finite());
        assert!(map.with_motion(&Plane::filled(3, 3, 0.0)).is_err());
    }

    #[test]
    fn isoluminant_noise_is_not_missed() {
        use crate::csf::{CastleChromatic, ChromaticChannel};
        use crate::opponent::opponent;
        let mut state = 9;
        let noise: Vec<_> = (0..128 * 128)
            .map(|_| {
                // Red up and green down by the same luminance.
                let red = 40.0 * normal(&mut state);
                opponent([red, -red * 0.2126 / 0.7152, 0.0])
            })
            .collect();
        let plane = |value: fn(&crate::opponent::Opponent) -> f32| {
            Plane::from_values(128, 128, noise.iter().map(value).collect()).unwrap()
        };
        let grey = Plane::filled(128, 128, 100.0);
        let csf = CastleChromatic::new(ChromaticChannel::RedGreen, 1.0).unwrap();
        let red_green = chromatic_threshold_map(&Plane::filled(128, 128, 0.0), &grey, &viewing(60.0), &csf).unwrap();
        let luminance_v = map_of(&grey, &viewing(60.0)).measured_visibility(&plane(|c| c.achromatic)).get(64, 64);
        let chromatic_v = red_green.measured_visibility(&plane(|c| c.red_green)).get(64, 64);
        assert!(luminance_v < 1e-3 && chromatic_v > 1.0, "luminance {luminance_v}, red–green {chromatic_v}");
    }

    #[test]
    fn bad_inputs_are_errors() {
        let csf = CastleCsf::default();
        let bad = Plane::filled(4, 4, f32::NAN);
        let good = Plane::filled(4, 4, 1.0);
        let small = Plane::filled(2, 2, 1.0);
        let ask = |display_luminance_cd_m2, guide_variance, viewing: &Viewing| {
            threshold_map(&ThresholdInputs { display_luminance_cd_m2, guide_variance }, viewing, &csf).err()
        };
        assert!(matches!(ask(&bad, None, &Viewing::default()), Some(Error::BadPixel { .. })));
        assert!(matches!(ask(&good, Some(&small), &Viewing::default()), Some(Error::SizeMismatch { .. })));
        assert!(matches!(ask(&good, None, &viewing(0.0)), Some(Error::OutOfRange { .. })));
        assert!(matches!(ask(&good, None, &viewing(f64::NAN)), Some(Error::OutOfRange { .. })));
    }

    fn normal(state: &mut u64) -> f32 {
        crate::test_noise::normal(state)
    }
}
