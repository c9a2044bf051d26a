//! Threshold versus intensity: how much brighter a large spot must be than its background to be seen.
//!
//! After Ferwerda, Pattanaik, Shirley and Greenberg 1996 and Ward Larson, Rushmeier and Piatko 1997. For ratios of
//! thresholds, as tone operators take them. Not for noise as the curves stand: in daylight they are 7 to 9 times too
//! lenient for it ([`ThresholdBase::CsfPeak`]).

use crate::csf::{ContrastSensitivity, peak_sensitivity};

/// Which threshold of a uniform background a model starts from.
#[derive(Clone, Copy)]
pub enum ThresholdBase<'a> {
    /// [`combined`] as published: right for the ratios of tone operators, 7 to 9 times too lenient for noise.
    TviRaw,
    /// [`combined`] lowered by 0.95 log units, which brings it within 20 % of what CSFs say from 10 to 1000 cd/m².
    TviShifted,
    /// L / `S_peak`(L) of a contrast sensitivity function.
    CsfPeak(&'a dyn ContrastSensitivity),
}

/// Factor of [`ThresholdBase::TviShifted`]: −0.95 log units.
const SHIFT: f64 = 0.112_201_845_430_196_34;

/// Threshold in cd/m² on a background of `adaptation_cd_m2`.
#[must_use]
pub fn base_threshold_cd_m2(adaptation_cd_m2: f64, base: ThresholdBase<'_>) -> f64 {
    match base {
        ThresholdBase::TviRaw => combined(adaptation_cd_m2),
        ThresholdBase::TviShifted => SHIFT * combined(adaptation_cd_m2),
        ThresholdBase::CsfPeak(csf) => {
            let adaptation = adaptation_cd_m2.max(1e-4);
            adaptation / peak_sensitivity(csf, adaptation).max(f64::MIN_POSITIVE)
        }
    }
}

/// Threshold of the cones, cd/m² (Ferwerda, Pattanaik, Shirley and Greenberg 1996).
#[must_use]
pub fn photopic(adaptation_cd_m2: f64) -> f64 {
    let log = log10(adaptation_cd_m2);
    exp10(if log <= -2.6 {
        -0.72
    } else if log >= CONES_IN_BRIGHT_LIGHT {
        log - 1.255
    } else {
        log_of_cones_between(log)
    })
}

/// log₁₀ of the luminance from which on the threshold of the cones is in proportion to it.
const CONES_IN_BRIGHT_LIGHT: f64 = 1.9;

/// log₁₀ of the threshold of the cones below that.
fn log_of_cones_between(log: f64) -> f64 {
    (0.249 * log + 0.65).powf(2.7) - 0.72
}

/// Threshold of the rods, cd/m² (Ferwerda et al. 1996).
#[must_use]
pub fn scotopic(adaptation_cd_m2: f64) -> f64 {
    let log = log10(adaptation_cd_m2);
    exp10(if log <= -3.94 {
        -2.86
    } else if log >= RODS_IN_BRIGHT_LIGHT {
        log - 0.395
    } else {
        log_of_rods_between(log)
    })
}

/// log₁₀ of the luminance from which on the threshold of the rods is in proportion to it.
const RODS_IN_BRIGHT_LIGHT: f64 = -1.44;

/// log₁₀ of the threshold of the rods below that.
fn log_of_rods_between(log: f64) -> f64 {
    (0.405 * log + 1.6).powf(2.18) - 2.86
}

/// Threshold of the whole eye, cd/m² (Ward Larson, Rushmeier and Piatko 1997): the lower of the two.
///
/// Falls by 2.7 % at 0.0363 and by 0.7 % at 79.4 cd/m², where the published branches do not meet; see
/// [`combined_monotone`].
#[must_use]
pub fn combined(adaptation_cd_m2: f64) -> f64 {
    // The curves cross at 0.9585 cd/m².
    if log10(adaptation_cd_m2) < -0.0184 { scotopic(adaptation_cd_m2) } else { photopic(adaptation_cd_m2) }
}

/// [`combined`], never falling as luminance rises: the greatest value at or below `adaptation_cd_m2`. For root finding.
#[must_use]
pub fn combined_monotone(adaptation_cd_m2: f64) -> f64 {
    // The values just below the two steps down, where the curve is at a local maximum.
    let steps = [
        (RODS_IN_BRIGHT_LIGHT, log_of_rods_between(RODS_IN_BRIGHT_LIGHT)),
        (CONES_IN_BRIGHT_LIGHT, log_of_cones_between(CONES_IN_BRIGHT_LIGHT)),
    ];
    let reached = steps.into_iter().filter(|&(log, _)| adaptation_cd_m2 >= exp10(log));
    reached.fold(combined(adaptation_cd_m2), |value, (_, before)| value.max(exp10(before)))
}

/// NaN and everything below the floor of vision count as 1e-6 cd/m².
fn log10(luminance_cd_m2: f64) -> f64 {
    if luminance_cd_m2.is_nan() { -6.0 } else { luminance_cd_m2.clamp(1e-6, 1e300).log10() }
}

fn exp10(log: f64) -> f64 {
    10.0_f64.powf(log)
}

/// Highest frequency an eye adapted to `adaptation_cd_m2` resolves, cpd: Ward Larson et al.'s 1997 fit to Shlaer's
/// data, 17.25 atan(1.4 log₁₀ L + 0.35) + 25.72.
#[must_use]
pub fn acuity_cpd(adaptation_cd_m2: f64) -> f64 {
    17.25 * (1.4 * log10(adaptation_cd_m2) + 0.35).atan() + 25.72
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;

    #[test]
    fn no_branch_gives_nan() {
        for log in [-2.605, -2.611, -3.945, -3.951, 1.9, -0.0184] {
            for curve in [photopic, scotopic, combined, combined_monotone] {
                assert!(curve(10.0_f64.powf(log)) > 0.0);
            }
        }
        for luminance in [0.0, f64::MIN_POSITIVE, f64::INFINITY, f64::NAN, -1.0] {
            assert!(combined(luminance).is_finite() && combined(luminance) > 0.0);
        }
    }

    #[test]
    fn combined_is_the_lower_curve() {
        for step in -600..500 {
            let luminance = 10.0_f64.powf(f64::from(step) / 100.0);
            let lower = photopic(luminance).min(scotopic(luminance));
            assert!((combined(luminance) / lower - 1.0).abs() < 1e-5, "{luminance}");
        }
    }

    #[test]
    fn the_monotone_curve_never_falls() {
        let mut last = 0.0;
        for step in -6000..5000 {
            let luminance = 10.0_f64.powf(f64::from(step) / 1000.0);
            let value = combined_monotone(luminance);
            assert!(value >= last && value / combined(luminance) < 1.028, "{luminance}");
            last = value;
        }
    }

    #[test]
    fn the_three_bases_differ_as_tabulated() {
        let castle = CastleCsf::default();
        for (luminance, raw, shifted, peak) in [
            (0.01, 0.005_472_34, 0.000_614_007, 0.001_521_87),
            (1.0, 0.391_302, 0.043_904_8, 0.024_900_1),
            (50.0, 3.087_95, 0.346_473, 0.409_201),
            (1000.0, 55.5904, 6.237_35, 6.584_09),
        ] {
            let at = |base| base_threshold_cd_m2(luminance, base);
            assert!((at(ThresholdBase::TviRaw) / raw - 1.0_f64).abs() < 1e-5);
            assert!((at(ThresholdBase::TviShifted) / shifted - 1.0_f64).abs() < 1e-5);
            assert!((at(ThresholdBase::CsfPeak(&castle)) / peak - 1.0_f64).abs() < 1e-4, "{luminance}");
        }
    }
}
