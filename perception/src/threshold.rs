//! The threshold map: how much error each pixel of a picture may have before it is seen.
//!
//! For a still in display cd/m², and error in it. Not for pictures with noise that nobody knows of, since noise that
//! passes for texture hides noise: denoise them ([`crate::guide`]) or say how strong it is ([`GuideNoise`]). For motion
//! see [`ThresholdMap::with_motion`] and [`ThresholdMap::with_pursuit`], for differences of moving pictures
//! [`crate::sequence`].

use crate::adaptation::adapted;
use crate::bands::OctaveBands;
use crate::csf::{ContrastSensitivity, DRIFT_DEG_S};
use crate::display::{Glare, Viewing};
use crate::error::Error;
use crate::fft::{PictureTransform, Workspace};
use crate::glare::keep_thresholds;
use crate::masking::{ElevationTable, MaskSource, band_elevation, halvings};
use crate::motion::VelocityTable;
use crate::noise_gain::{noise_gain, reduced_coordinates};
use crate::plane::Plane;
use crate::reduced::ReducedPlane;
use crate::sensitivity::{AdaptationLevel, LuminanceSpan, SensitivityTables, adaptation_levels};
use rayon::prelude::*;

/// Standard deviation of the windows over which the eye adapts and error is pooled, degrees: as wide as a disc of 1°.
pub const POOLING_SIGMA_DEG: f64 = 0.25;

/// The picture that thresholds are found for.
#[derive(Clone, Copy, Debug)]
pub struct ThresholdInputs<'a> {
    /// Luminance of the denoised guide as the display shows it, cd/m².
    pub display_luminance_cd_m2: &'a Plane,
    /// What is known of the noise in that guide, variances in (cd/m²)².
    pub guide_noise: GuideNoise<&'a Plane>,
}

impl<'a> ThresholdInputs<'a> {
    /// Inputs for a picture without noise, cd/m² on the display.
    #[must_use]
    pub fn clean(display_luminance_cd_m2: &'a Plane) -> Self {
        Self { display_luminance_cd_m2, guide_noise: GuideNoise::Clean }
    }
}

/// What is known of the noise in a guide, so that noise does not hide noise.
#[derive(Clone, Copy, Debug, Default)]
pub enum GuideNoise<V> {
    /// Nothing: the guide is taken as clean.
    #[default]
    Clean,
    /// A picture that is not denoised, with white noise of this variance: its energy is taken out of masks.
    White(V),
    /// A denoised picture, and the variance of its noise *before* denoising, taken as white. It bounds what is left,
    /// which is not white: thresholds are raised by the geometric mean of what masks less all of it raise them by (at
    /// least) and what whole masks do (at most). Of all estimates that were tried it scatters least over the picture.
    /// What is left of the noise hides some of itself: 5 % of standard error on a flat wall at 16 samples, 15 % at 4
    /// (`cargo bench -p fechner-perception --bench masking_bias`).
    BeforeDenoising(V),
}

impl<V> GuideNoise<V> {
    /// What is known of the same noise, with another form of its variance.
    pub(crate) fn map<W>(self, change: impl FnOnce(V) -> W) -> GuideNoise<W> {
        match self {
            Self::Clean => GuideNoise::Clean,
            Self::White(variance) => GuideNoise::White(change(variance)),
            Self::BeforeDenoising(variance) => GuideNoise::BeforeDenoising(change(variance)),
        }
    }

    /// The variance, if any is known.
    pub(crate) fn variance(self) -> Option<V> {
        match self {
            Self::Clean => None,
            Self::White(variance) | Self::BeforeDenoising(variance) => Some(variance),
        }
    }
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
    /// Where the gaze is known: degrees from it.
    pub(crate) eccentricity_deg: Option<Plane>,
}

/// Finds adaptation, masking and thresholds of a picture.
///
/// Adaptation is the arithmetic mean over a Gaussian of σ 0.25° (the variance of a disc of 1°), after pixels that
/// outshine all their neighbours, or all but one, have been brought down to the second brightest: a firefly must not
/// raise what the eye adapts to. Masking is each octave band's own, see [`crate::masking`]. There lone bright pixels
/// count as what they look like, glitter or stars, which do hide error: a single one of 100 times its grey raises the
/// allowed error beside it up to 1.8 times. Where such pixels may be fireflies, give a guide without them, as
/// [`crate::guide::denoise`] makes it.
///
/// # Errors
/// [`Error::Empty`] and [`Error::BadPixel`] for pictures that are none, [`Error::SizeMismatch`] for a variance of
/// another size, [`Error::OutOfRange`] for an impossible viewing and for luminance above 1e30 cd/m².
///
/// ```
/// use fechner_perception::{CastleCsf, Plane, ThresholdInputs, Viewing, threshold_map};
/// let grey = Plane::filled(64, 64, 100.0);
/// let inputs = ThresholdInputs::clean(&grey);
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
    guide.check_luminance("display luminance")?;
    if let Some(variance) = inputs.guide_noise.variance() {
        variance.check_size("guide variance", guide.width(), guide.height())?;
        variance.check_non_negative("guide variance")?;
    }
    Ok(assemble(guide, guide, 1.0, inputs.guide_noise, viewing, csf))
}

/// Finds thresholds of one chromatic channel of a picture, to be asked about errors in that channel.
///
/// `channel_cd_m2` is the channel's signal in the denoised guide and `display_luminance_cd_m2` the guide's luminance
/// (both from [`crate::opponent::opponent`] of the displayed colours): adaptation comes from luminance, masking from
/// the channel's own contrast. `csf` is the channel's, e.g. [`crate::csf::CastleChromatic`].
///
/// # Errors
/// As [`threshold_map`]; the channel's signal may be negative.
pub fn chromatic_threshold_map(
    channel_cd_m2: &Plane,
    display_luminance_cd_m2: &Plane,
    viewing: &Viewing,
    csf: &dyn ContrastSensitivity,
) -> Result<ThresholdMap, Error> {
    noisy_chromatic_threshold_map(channel_cd_m2, display_luminance_cd_m2, GuideNoise::Clean, viewing, csf)
}

/// [`chromatic_threshold_map`] of a guide with noise, whose variance in the channel is finite and not negative.
pub(crate) fn noisy_chromatic_threshold_map(
    channel_cd_m2: &Plane,
    display_luminance_cd_m2: &Plane,
    noise: GuideNoise<&Plane>,
    viewing: &Viewing,
    csf: &dyn ContrastSensitivity,
) -> Result<ThresholdMap, Error> {
    viewing.check()?;
    display_luminance_cd_m2.check_luminance("display luminance")?;
    channel_cd_m2.check_size("chromatic signal", display_luminance_cd_m2.width(), display_luminance_cd_m2.height())?;
    channel_cd_m2.map(f32::abs).check_non_negative("chromatic signal")?;
    Ok(assemble(channel_cd_m2, display_luminance_cd_m2, 0.0, noise, viewing, csf))
}

/// Adaptation to a luminance, cd/m², and the masks and noise gain of a signal under it, with the observer's glare.
fn assemble(
    signal_cd_m2: &Plane,
    luminance_cd_m2: &Plane,
    mean: f32,
    noise: GuideNoise<&Plane>,
    viewing: &Viewing,
    csf: &dyn ContrastSensitivity,
) -> ThresholdMap {
    let bands = OctaveBands::for_grid(viewing.display.pixel_density());
    let mut clear = viewing.clone();
    clear.observer.glare = Glare::None;
    let adaptation_cd_m2 = adapted(luminance_cd_m2, viewing);
    let without_glare = (viewing.observer.glare != Glare::None).then(|| adapted(luminance_cd_m2, &clear));
    let span = LuminanceSpan::of(std::iter::once(&adaptation_cd_m2).chain(&without_glare));
    // Whatever the glare: it changes what the eye adapts to, not how it sees.
    let tables = SensitivityTables::new(&bands, viewing, csf, span);
    let under = |viewing: &Viewing, adaptation_cd_m2: Plane| {
        let eye = Eye { viewing, csf, bands: &bands, tables: &tables };
        masked(signal_cd_m2, mean, noise, adaptation_cd_m2, eye)
    };
    let mut map = under(viewing, adaptation_cd_m2);
    if let Some(without_glare) = without_glare {
        keep_thresholds(&mut map, &under(&clear, without_glare));
    }
    map
}

/// Bands of pictures up to this are worked on side by side: each by itself is too small for two cores (4.1 ms of
/// threshold maps at 128×128 with one thread, 4.0 with two). Larger ones have rows enough, and every band at work has
/// buffers of its own.
const FEW_PIXELS: usize = 1 << 16;

/// Contrast of a mask, in adaptation luminances, beyond which more would mask no more (a few threshold units are the
/// cap) and only cost the rest of the transform its precision. Measured without it, beside a lone lamp of 1e5 ×
/// white: rounding raises thresholds threefold all over the picture. Shown pictures stay below: a night view with
/// lamps of 1000 × its black reaches 25.
const MAX_MASK_CONTRAST: f32 = 30.0;

/// Who looks, and what is tabulated of it.
struct Eye<'a> {
    viewing: &'a Viewing,
    csf: &'a dyn ContrastSensitivity,
    bands: &'a OctaveBands,
    tables: &'a SensitivityTables,
}

/// Masks and noise gain of a signal, cd/m², under an adaptation luminance. `mean` is about the mean of signal over
/// adaptation: no band passes it, and without it the transform's precision is for the detail.
fn masked(
    signal_cd_m2: &Plane,
    mean: f32,
    noise: GuideNoise<&Plane>,
    adaptation_cd_m2: Plane,
    eye: Eye<'_>,
) -> ThresholdMap {
    let Eye { viewing, csf, bands, tables } = eye;
    let density = viewing.display.pixel_density();
    let (width, height) = (signal_cd_m2.width(), signal_cd_m2.height());
    let transform = PictureTransform::new(width, height, density);
    let mut workspace = Workspace::default();
    let contrast = transform.forward(&mut workspace, |y, row| {
        for (value, (signal, adaptation)) in row.iter_mut().zip(signal_cd_m2.row(y).iter().zip(adaptation_cd_m2.row(y)))
        {
            *value = (signal / adaptation - mean).clamp(-MAX_MASK_CONTRAST, MAX_MASK_CONTRAST);
        }
    });
    let (least, greatest) = adaptation_cd_m2.range();
    let levels = adaptation_levels(viewing, csf, least, greatest);
    let source = MaskSource {
        transform: &transform,
        contrast: &contrast,
        sensitivity: levels.get(levels.len() / 2).map(|level| &level.sensitivity),
        csf,
        noise: noise.map(|variance| {
            halvings(&variance.combined(&adaptation_cd_m2, |value, adaptation| value / adaptation / adaptation))
        }),
        coordinates: &reduced_coordinates(&adaptation_cd_m2, 2),
        density,
        width,
        height,
    };
    let elevation = ElevationTable::new();
    let of_band = |workspace: &mut Workspace, (band, band_tables)| {
        band_elevation(&source, workspace, bands, band, band_tables, &elevation)
    };
    let elevations: Vec<ReducedPlane> = if width * height <= FEW_PIXELS {
        tables.bands.par_iter().enumerate().map_init(Workspace::default, of_band).collect()
    } else {
        tables.bands.iter().enumerate().map(|band| of_band(&mut workspace, band)).collect()
    };
    let noise_gain = noise_gain(tables, &adaptation_cd_m2, &elevations);
    ThresholdMap {
        viewing: viewing.clone(),
        bands: bands.clone(),
        tables: tables.clone(),
        levels,
        adaptation_cd_m2,
        elevations,
        noise_gain,
        eccentricity_deg: None,
    }
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

    /// How many times masking raises the allowed standard error of white noise at each pixel, 1 to 3. On a map
    /// [`with_motion`](Self::with_motion) what motion raises or lowers is in it, too. So is, with [`Glare`], what
    /// keeps thresholds from falling under a veil that is brighter than the picture: beside very bright lamps
    /// hundreds of times.
    #[must_use]
    pub fn masking_elevation(&self) -> Plane {
        self.unmasked_noise_gain().combined(&self.noise_gain, |unmasked, masked| (unmasked / masked).sqrt())
    }

    fn unmasked_noise_gain(&self) -> Plane {
        noise_gain(&self.tables, &self.adaptation_cd_m2, &[])
    }

    /// This map with [`masking_elevation`](Self::masking_elevation) 1 everywhere: nothing hides error.
    #[must_use]
    pub fn without_masking(mut self) -> Self {
        self.noise_gain = self.unmasked_noise_gain();
        self.elevations.iter_mut().for_each(ReducedPlane::flatten);
        self
    }

    /// Thresholds of this picture for error that moves over the retina at `retinal_velocity_deg_s` (see
    /// [`crate::motion`]).
    ///
    /// Each band's threshold is raised, or at low frequencies lowered, by the ratio of Daly's 1998 spatiovelocity
    /// sensitivity at rest to that in motion at the band's centre, kept within 0.1 and 20. What moves no faster than
    /// the eye drifts keeps its thresholds.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`] and [`Error::BadPixel`] for velocities that do not fit.
    pub fn with_motion(&self, retinal_velocity_deg_s: &Plane) -> Result<Self, Error> {
        retinal_velocity_deg_s.check_size("velocity", self.width(), self.height())?;
        retinal_velocity_deg_s.check_non_negative("velocity")?;
        let mut moved = self.clone();
        for (band, elevation) in moved.elevations.iter_mut().enumerate() {
            let table = VelocityTable::of_motion(self.bands.center_cpd(band));
            *elevation =
                elevation.change_by(retinal_velocity_deg_s, |elevation, velocity| elevation * table.at(velocity));
        }
        // The elevations that motion changes have every pixel's own value, the others' sum is interpolated (see
        // `noise_gain`): up to 18 % between the two at the borders of masks, which is no motion.
        let in_motion = noise_gain(&self.tables, &self.adaptation_cd_m2, &moved.elevations);
        moved.noise_gain = Plane::from_fn(self.width(), self.height(), |x, y| {
            let gain =
                if retinal_velocity_deg_s.get(x, y) <= DRIFT_DEG_S as f32 { &self.noise_gain } else { &in_motion };
            gain.get(x, y)
        });
        Ok(moved)
    }

    /// The viewing that the thresholds hold for.
    #[must_use]
    pub fn viewing(&self) -> &Viewing {
        &self.viewing
    }

    /// Columns of the map, pixels.
    #[must_use]
    pub fn width(&self) -> usize {
        self.adaptation_cd_m2.width()
    }

    /// Rows of the map, pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        self.adaptation_cd_m2.height()
    }
}

#[cfg(test)]
mod tests;
