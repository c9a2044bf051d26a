//! castleCSF for gratings that flicker or drift: its sustained and its transient channel together (Ashraf et al. 2024).
//!
//! For one temporal frequency. Not for noise that is new in every frame, which holds all of them at once
//! ([`super::FreshNoise`]). Below 0.03 cd/m² the transient channel's best flicker is held at 1 Hz, which is ours and no
//! measurement.

use super::ContrastSensitivity;
use super::castle::{CastleCsf, DOMAIN_DECADES, Summation, in_domain};
use crate::table::Between;

/// castleCSF's achromatic mechanism at a temporal frequency: its sustained channel, which fades with it, and its
/// transient channel, which peaks at w₀ = 2.41 log₁₀ L + 4.70 Hz; they add.
///
/// Ashraf et al. 2024 (see [`CastleCsf`]), fovea. Where the published w₀ crosses zero (0.0113 cd/m²) a static pattern
/// would excite the transient channel by 59 % of the sustained one, and below it the formula has no real value: here w₀
/// is at least 1 Hz, and at 0 Hz there is the sustained channel alone, so that the static case equals [`CastleCsf`].
#[derive(Clone, Debug, PartialEq)]
pub struct CastleTemporal {
    /// The sustained channel at 0 Hz, which is the static function, and whose area the transient channel has too.
    pub sustained: CastleCsf,
    /// Temporal frequency, Hz: spatial frequency times retinal velocity for a drifting grating.
    pub temporal_hz: f64,
}

impl ContrastSensitivity for CastleTemporal {
    fn name(&self) -> &'static str {
        "castle-temporal"
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        let flicker_hz = if self.temporal_hz.is_nan() { 0.0 } else { self.temporal_hz.abs() };
        let sustained = sustained_response(flicker_hz) * self.sustained.sensitivity(freq_cpd, luminance_cd_m2);
        if flicker_hz <= 0.0 || freq_cpd <= 0.0 {
            return sustained;
        }
        sustained
            + transient_response(flicker_hz, luminance_cd_m2)
                * transient(freq_cpd, luminance_cd_m2, self.sustained.area_deg2())
    }
}

/// Share of the sustained channel's sensitivity that is left at a flicker frequency in Hz.
pub(super) fn sustained_response(flicker_hz: f64) -> f64 {
    (-flicker_hz.powf(1.3314) / 10.5795).exp()
}

/// Share of the transient channel's sensitivity that there is at a flicker frequency in Hz.
pub(super) fn transient_response(flicker_hz: f64, luminance_cd_m2: f64) -> f64 {
    let peak_hz = (2.414_82 * in_domain(luminance_cd_m2).log10() + 4.7036).max(1.0);
    let detuning = flicker_hz.powf(0.1898) - peak_hz.powf(0.1898);
    (-detuning * detuning / 0.084_483_6).exp()
}

/// Spatial sensitivity of the transient channel at its best flicker: low-pass, growing slowly with luminance.
pub(super) fn transient(freq_cpd: f64, luminance_cd_m2: f64, area_deg2: f64) -> f64 {
    let peak = 2748.09 * in_domain(luminance_cd_m2).powf(0.193_434);
    let decades_above = (freq_cpd / 0.000_316_696).log10().max(0.0);
    let log_parabola = 10.0_f64.powf(-decades_above * decades_above / 2.6761_f64.exp2());
    let summation = Summation { area_0_deg2: 3.816_11, freq_0_cpd: 3.013_89 };
    peak * log_parabola * summation.extent_deg(freq_cpd, area_deg2) * freq_cpd
}

/// Energies that the eye receives of the product of two channels' responses.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Energies {
    pub(super) sustained: f64,
    pub(super) mixed: f64,
    pub(super) transient: f64,
}

impl Energies {
    /// Energy that both channels together receive, of these spatial sensitivities.
    pub(super) fn seen_by(self, sustained: f64, transient: f64) -> f64 {
        self.sustained * sustained * sustained
            + 2.0 * self.mixed * sustained * transient
            + self.transient * transient * transient
    }
}

/// Levels a decade at which what changes with luminance in time is tabulated.
const LEVELS_PER_DECADE: usize = 4;
/// Levels over castleCSF's domain.
const LEVELS: usize = (DOMAIN_DECADES[1] - DOMAIN_DECADES[0]) as usize * LEVELS_PER_DECADE + 1;

/// Luminances of the levels, cd/m².
pub(super) fn levels_cd_m2() -> impl Iterator<Item = f64> {
    (0..LEVELS).map(|level| 10.0_f64.powf(f64::from(DOMAIN_DECADES[0]) + level as f64 / LEVELS_PER_DECADE as f64))
}

/// Between which levels a luminance stands.
pub(super) fn between_levels(luminance_cd_m2: f64) -> Between {
    let decades = luminance_cd_m2.max(1e-12).log10() - f64::from(DOMAIN_DECADES[0]);
    Between::of(decades * LEVELS_PER_DECADE as f64, LEVELS)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(temporal_hz: f64, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        CastleTemporal { sustained: CastleCsf::default(), temporal_hz }.sensitivity(freq_cpd, luminance_cd_m2)
    }

    #[test]
    fn rest_is_the_static_function() {
        for luminance in [0.001, 0.0113, 0.01, 100.0] {
            let still = CastleCsf::default().sensitivity(2.0, luminance);
            assert!((at(0.0, 2.0, luminance) / still - 1.0).abs() < 1e-12);
            // And nothing jumps where the published formula does.
            assert!((at(1e-3, 2.0, luminance) / still - 1.0).abs() < 0.05, "{luminance}");
        }
    }

    #[test]
    fn flicker_helps_coarse_patterns_and_hides_fine_ones() {
        assert!(at(8.0, 0.5, 100.0) > at(0.0, 0.5, 100.0));
        assert!(at(8.0, 8.0, 100.0) < 0.5 * at(0.0, 8.0, 100.0));
        assert!(at(60.0, 1.0, 100.0) < at(8.0, 1.0, 100.0));
        assert!(at(f64::NAN, 1.0, 100.0).is_finite() && at(1e300, 1.0, 100.0).is_finite());
    }
}
