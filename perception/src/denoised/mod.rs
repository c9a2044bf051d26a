//! What can be seen of the error of a denoised picture: what noise is left in it, and what the denoiser made up or
//! wiped out.
//!
//! A path tracer's samples stand in two independent halves A and B. The picture d is the denoised mean M = (A + B)/2;
//! the halves are also denoised by themselves, to dA and dB. Through the eye's filters and thresholds, band by band:
//!
//! * **Variance**: energy of the half difference (dA − dB)/2, as for raw pictures. Error that both halves share is
//!   not in it.
//! * **Bias**: the raw mean is noisy and without bias, so it bears witness. With r = d − M and the same of the
//!   halves, rA = dA − A and rB = dB − B, the energy of r less that of (rA − rB)/2, which is what noise puts into r,
//!   is the bias's alone on average. For a linear denoiser it is rA · rB: a product of two independent looks, so that
//!   noise averages out. It is pooled, compared with its own standard error, and taken at its word where it stands
//!   out.
//! * **Factor**: elsewhere the witness is too noisy to tell a place's bias, but all places together tell how much bias
//!   comes with how much variance: one factor a band, found by regression and drawn towards what was measured before.
//!
//! Visibility is both together. Where the witness would not have noticed a bias that can be seen, the picture is
//! *unproven*.
//!
//! Not for pictures whose raw halves are not at hand, and not for denoisers that use other frames.

mod blend;
mod chromatic;
mod witness;

use blend::BandError;
pub use blend::step_towards_raw;
pub use chromatic::{ChromaticPicture, chromatic_error};

use crate::error_filters::ErrorFilters;
use crate::plane::Plane;
use crate::threshold::ThresholdMap;
use crate::visibility::infinite_where_unknown;
use witness::{BandEvidence, bias_energy};

/// Errors of one channel of a denoised picture, display cd/m². Planes of the threshold map's size.
#[derive(Clone, Copy, Debug)]
pub struct DenoisedDifferences<'a> {
    /// Half the difference of the denoised halves: (dA − dB)/2.
    pub half_difference: &'a Plane,
    /// The denoised picture less the raw mean: d − M. What turns it into display units must not bend: see
    /// [`display_slope`](crate::seen::display_slope).
    pub residual: &'a Plane,
    /// Half the difference of the halves' residuals, by the slope of `residual`: ((dA − A) − (dB − B))/2.
    pub residual_half_difference: &'a Plane,
}

/// What can be seen of a denoised picture's error once it is moved towards its raw mean by `raw_shares`. Visibilities
/// are pooled and in threshold units, as everywhere.
#[derive(Clone, Debug)]
pub struct DenoisedError {
    /// Visibility v of variance and bias together: √(variance² + bias²).
    pub visibility: Plane,
    /// Visibility v of the noise that is left, that which the raw mean brings among it.
    pub variance: Plane,
    /// Visibility v of the bias: proven where the witness tells, by the factor elsewhere.
    pub bias: Plane,
    /// Standard error of `bias`² from the witness's noise: a bias of less than about two of these would not be noticed
    /// locally. 0 where the local bias is proven.
    pub bias_squared_standard_error: Plane,
    /// Squared bias over squared variance visibility that the whole picture shows, by band, lowest first.
    pub bias_factors: Vec<f64>,
    /// How far each band is worth moving towards the raw mean, 0 to 1, by band: the share of the denoised error in
    /// the sum of its and the raw mean's squared errors, where a bias is proven; 0 elsewhere.
    pub raw_shares: Vec<Plane>,
}

/// Whether a channel of the picture is moved towards its raw mean.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Blending {
    Proven,
    Never,
}

/// A bias that one-sided 95 % of witnesses would have noticed.
const NOTICED: f32 = 1.645;
/// How many times the visibility that was asked for a tile may have before it is visibly wrong.
pub const VISIBLY_WRONG: f32 = 1.5;

impl DenoisedError {
    /// The error of a picture of this size of which nothing tells it, such as one without independent halves: infinite
    /// everywhere, without factors, and with nothing that is worth moving towards the raw mean.
    #[must_use]
    pub fn unknown(width: usize, height: usize) -> Self {
        let infinite = Plane::filled(width, height, f32::INFINITY);
        Self {
            visibility: infinite.clone(),
            variance: infinite.clone(),
            bias: infinite.clone(),
            bias_squared_standard_error: infinite.clone(),
            bias_factors: Vec::new(),
            raw_shares: Vec::new(),
        }
    }

    /// This error with another channel's beside it: the channel that shows most counts at every pixel. Factors and
    /// shares stay this one's; what the other's becomes by a blend for this one is not looked at.
    ///
    /// # Panics
    /// Where the two are of pictures of two sizes.
    #[must_use]
    pub fn with_channel(mut self, other: &Self) -> Self {
        let most = |own: &mut Plane, other: &Plane| *own = own.combined(other, f32::max);
        most(&mut self.visibility, &other.visibility);
        most(&mut self.variance, &other.variance);
        most(&mut self.bias, &other.bias);
        most(&mut self.bias_squared_standard_error, &other.bias_squared_standard_error);
        self
    }

    /// This error's noise with the bias that `other` thresholds say there is: of frames, whose noise is new in each
    /// and whose bias stays. Factors and shares stay this one's: within a band shares hardly depend on how well it is
    /// seen.
    ///
    /// # Panics
    /// Where the two are of pictures of two sizes.
    #[must_use]
    pub fn with_bias_of(mut self, other: &Self) -> Self {
        self.bias.clone_from(&other.bias);
        self.bias_squared_standard_error.clone_from(&other.bias_squared_standard_error);
        self.visibility = self.variance.combined(&self.bias, f32::hypot);
        self
    }

    /// This error with light beside it that no sample has found, of which so much is seen: it is missing in the raw
    /// mean too, so no blend brings it back.
    ///
    /// # Panics
    /// Where `missed` has another size.
    #[must_use]
    pub fn with_missed_light(mut self, missed: &Plane) -> Self {
        for plane in [&mut self.visibility, &mut self.bias] {
            *plane = plane.combined(missed, |own, missed| own.hypot(missed));
        }
        self
    }

    /// This error with no less noise than that of such a visibility: where a picture is so small that its halves'
    /// difference has hardly a frequency by which it could be seen.
    ///
    /// # Panics
    /// Where `noise` has another size.
    #[must_use]
    pub fn with_noise_of_at_least(mut self, noise: &Plane) -> Self {
        for plane in [&mut self.visibility, &mut self.variance] {
            *plane = plane.combined(noise, f32::max);
        }
        self
    }

    /// This error for eyes whose thresholds are multiplied by a map of the same size, as where some places matter
    /// more than others.
    ///
    /// # Panics
    /// Where `factors` has another size.
    #[must_use]
    pub fn with_thresholds_times(&self, factors: &Plane) -> Self {
        self.clone().scaled(|plane| plane.combined(factors, |value, factor| value / factor))
    }

    /// This error seen as many times as well as `scale` makes of a visibility.
    fn scaled(mut self, scale: impl Fn(&Plane) -> Plane) -> Self {
        for plane in [&mut self.visibility, &mut self.variance, &mut self.bias] {
            *plane = scale(plane);
        }
        self.bias_squared_standard_error = scale(&scale(&self.bias_squared_standard_error));
        self
    }

    /// Multiplies visibility by `factor` where it is inferred: where even an error [`VISIBLY_WRONG`] times as visible
    /// would not be noticed by the place's own witness. For what is learned elsewhere of errors that nothing at hand
    /// shows.
    pub fn raise_inferred(&mut self, factor: f64) {
        let standard_error = &self.bias_squared_standard_error;
        self.visibility = self.visibility.combined(standard_error, |visibility, standard_error| {
            let unnoticed = visibility * visibility * (VISIBLY_WRONG * VISIBLY_WRONG - 1.0);
            if NOTICED * standard_error > unnoticed { factor as f32 * visibility } else { visibility }
        });
    }

    /// 1 where `visibility` is at most `target` and yet nothing proves that bias keeps the picture below
    /// [`VISIBLY_WRONG`] × `target`: raw noise is too strong to testify. 0 elsewhere.
    #[must_use]
    pub fn unproven(&self, target: f64) -> Plane {
        let target = target as f32;
        let limit = (VISIBLY_WRONG * target) * (VISIBLY_WRONG * target);
        self.visibility.combined(&self.bias_squared_standard_error, |visibility, standard_error| {
            let could_be = visibility * visibility + NOTICED * standard_error;
            f32::from(visibility <= target && could_be > limit)
        })
    }
}

impl ThresholdMap {
    /// Judges a denoised picture that [`step_towards_raw`] moves. Planes of another size give infinity everywhere,
    /// and no factors; pixels of which one is not finite are infinitely visible and count as 0 for the others.
    #[must_use]
    pub fn denoised_error(&self, differences: &DenoisedDifferences<'_>) -> DenoisedError {
        self.denoised_error_after(Blending::Proven, differences)
    }

    fn denoised_error_after(&self, blending: Blending, differences: &DenoisedDifferences<'_>) -> DenoisedError {
        let (width, height) = (self.width(), self.height());
        let DenoisedDifferences { half_difference, residual, residual_half_difference } = *differences;
        let planes = [half_difference, residual, residual_half_difference];
        if planes.iter().any(|plane| !plane.same_size(&self.adaptation_cd_m2)) {
            return DenoisedError::unknown(width, height);
        }
        let mut filters = ErrorFilters::new(self);
        let spectra = planes.map(|plane| filters.spectrum(plane));
        let zero = Plane::filled(width, height, 0.0);
        let (mut variance, mut bias, mut uncertainty) = (zero.clone(), zero.clone(), zero);
        let (mut bias_factors, mut raw_shares) = (Vec::new(), Vec::new());
        for band in 0..self.band_count() {
            let evidence = BandEvidence::gather(self, &mut filters, &spectra, band);
            let found = bias_energy(&evidence);
            bias_factors.push(found.factor);
            let left = match blending {
                Blending::Proven => {
                    let share = blend::raw_share(&evidence, &found);
                    let left = BandError::of(&evidence, &found).blended(&share, &evidence.raw_noise);
                    raw_shares.push(share);
                    left
                }
                Blending::Never => BandError::of(&evidence, &found),
            };
            add(&mut variance, &left.variance);
            add(&mut bias, &left.bias);
            add(&mut uncertainty, &left.uncertainty);
        }
        // Finite where all three are.
        let sum =
            planes[1..].iter().fold(planes[0].clone(), |sum, plane| sum.combined(plane, |sum, value| sum + value));
        let seen = |energy: &Plane| infinite_where_unknown(energy.map(|energy| (2.0 * energy.max(0.0)).sqrt()), &sum);
        let both = variance.combined(&bias, |variance, bias| variance + bias);
        DenoisedError {
            visibility: seen(&both),
            variance: seen(&variance),
            bias: seen(&bias),
            bias_squared_standard_error: uncertainty.map(|squared| 2.0 * squared.sqrt()),
            bias_factors,
            raw_shares,
        }
    }
}

fn add(sum: &mut Plane, more: &Plane) {
    sum.for_each_row_mut(|y, row| row.iter_mut().zip(more.row(y)).for_each(|(sum, more)| *sum += more));
}

#[cfg(test)]
mod tests;
