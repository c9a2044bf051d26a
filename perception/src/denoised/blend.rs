//! Back towards the raw mean, band by band, where the denoised picture is proven worse.

use super::DenoisedError;
use super::witness::{BandBias, BandEvidence};
use crate::plane::Plane;
use crate::threshold::ThresholdMap;
use crate::visibility::ErrorFilters;

/// The least share that is worth the transforms.
const LEAST_SHARE: f32 = 0.01;

/// The share of the raw mean that leaves the least squared error, if the two errors are independent: that of the denoised
/// picture over both, as far as its bias is proven and greater than the raw noise.
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

/// Squared error that is left by these shares of the raw mean.
pub(super) fn energy_after(evidence: &BandEvidence, found: &BandBias, share: &Plane) -> Plane {
    let denoised = evidence.variance.combined(&found.energy, |variance, bias| variance + bias);
    let left = denoised.combined(share, |energy, share| energy * (1.0 - share) * (1.0 - share));
    let raw = evidence.raw_noise.combined(share, |energy, share| energy * share * share);
    left.combined(&raw, |left, raw| left + raw)
}

/// A channel of the denoised picture, moved towards the raw mean by [`DenoisedError::raw_shares`]. Both planes in any linear
/// unit. `None` where nothing is worth moving, or planes do not fit.
#[must_use]
pub fn blended(map: &ThresholdMap, error: &DenoisedError, denoised: &Plane, raw: &Plane) -> Option<Plane> {
    let is_worth_it = |share: &Plane| share.values().iter().any(|&share| share > LEAST_SHARE);
    let fits = denoised.same_size(&map.adaptation_cd_m2) && raw.same_size(&map.adaptation_cd_m2);
    if !fits || !error.raw_shares.iter().any(is_worth_it) {
        return None;
    }
    let mut filters = ErrorFilters::new(map);
    let spectrum = filters.plain_spectrum(&raw.combined(denoised, |raw, denoised| raw - denoised));
    let mut blended = denoised.clone();
    for (band, share) in error.raw_shares.iter().enumerate().filter(|(_, share)| is_worth_it(share)) {
        let step = filters.share_of_band(&spectrum, band);
        blended.for_each_row_mut(|y, row| {
            for (value, (step, share)) in row.iter_mut().zip(step.row(y).iter().zip(share.row(y))) {
                *value += step * share;
            }
        });
    }
    Some(blended)
}
