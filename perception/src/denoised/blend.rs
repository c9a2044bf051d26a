//! Back towards the raw mean, band by band, where the denoised picture is proven worse.

use super::DenoisedError;
use super::witness::{BandBias, BandEvidence};
use crate::error_filters::ErrorFilters;
use crate::plane::Plane;
use crate::threshold::ThresholdMap;

/// The least share that is worth the transforms.
const MIN_SHARE: f32 = 0.01;

/// The share of the raw mean that leaves the least squared error, if the two errors are independent: that of the
/// denoised picture over both, as far as its bias is proven and greater than the raw noise.
pub(super) fn raw_share(evidence: &BandEvidence, found: &BandBias) -> Plane {
    let denoised = evidence.variance.combined(&found.energy, |variance, bias| variance + bias);
    let share = denoised.combined(
        &evidence.raw_noise,
        |denoised, raw| {
            if denoised > raw { denoised / (denoised + raw) } else { 0.0 }
        },
    );
    share.combined(&found.proof, |share, proof| share * proof)
}

/// What is left of one band's error, pooled energies in squared threshold units.
pub(super) struct BandError {
    pub(super) variance: Plane,
    pub(super) bias: Plane,
    /// Variance of `bias` where it is not proven.
    pub(super) uncertainty: Plane,
}

impl BandError {
    /// The error of the denoised picture as it is.
    pub(super) fn of(evidence: &BandEvidence, found: &BandBias) -> Self {
        Self { variance: evidence.variance.clone(), bias: found.energy.clone(), uncertainty: found.uncertainty.clone() }
    }

    /// This error once the share `share` of the raw mean, with its noise, has taken the denoised picture's place.
    pub(super) fn blended(self, share: &Plane, raw_noise: &Plane) -> Self {
        let kept = share.map(|share| (1.0 - share) * (1.0 - share));
        let of_raw = raw_noise.combined(share, |energy, share| energy * share * share);
        let times = |energy: &Plane, factor: &Plane| energy.combined(factor, |energy, factor| energy * factor);
        Self {
            variance: times(&self.variance, &kept).combined(&of_raw, |left, raw| left + raw),
            bias: times(&self.bias, &kept),
            uncertainty: times(&self.uncertainty, &kept.map(|kept| kept * kept)),
        }
    }
}

/// How far a denoised picture is to be moved towards its raw mean, by [`DenoisedError::raw_shares`], display cd/m².
/// `residual`: of one channel, denoised less raw mean as displayed, as in
/// [`DenoisedDifferences::residual`](super::DenoisedDifferences::residual). `None` where nothing is worth moving, or
/// the planes do not fit.
///
/// Scene light must not be given: bands of a lamp's edge that is a thousand times as bright as the display's white
/// ring far into what is seen beside it. What is shown ends at the display's range, to which the residual is held.
#[must_use]
pub fn step_towards_raw(map: &ThresholdMap, error: &DenoisedError, residual: &Plane) -> Option<Plane> {
    let is_worth_it = |share: &Plane| share.values().iter().any(|&share| share > MIN_SHARE);
    if !residual.same_size(&map.adaptation_cd_m2) || !error.raw_shares.iter().any(is_worth_it) {
        return None;
    }
    let range = (map.viewing.display.white_cd_m2 - map.viewing.display.black_cd_m2) as f32;
    let towards_raw = residual.map(|residual| if residual.is_nan() { 0.0 } else { (-residual).clamp(-range, range) });
    let mut filters = ErrorFilters::new(map);
    let spectrum = filters.plain_spectrum(&towards_raw);
    let mut step = Plane::filled(map.width(), map.height(), 0.0);
    for (band, share) in error.raw_shares.iter().enumerate().filter(|(_, share)| is_worth_it(share)) {
        let whole = filters.share_of_band(&spectrum, band);
        step.for_each_row_mut(|y, row| {
            for (value, (whole, share)) in row.iter_mut().zip(whole.row(y).iter().zip(share.row(y))) {
                *value += whole * share;
            }
        });
    }
    Some(step)
}
