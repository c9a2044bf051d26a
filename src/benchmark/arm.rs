//! The arms of the benchmark: rules by which samples are spread, each with its knob. They are run by `runner`.

use super::Subject;
use crate::adaptive::settings::{AllocationRule, LoopSettings, RivalRule, Sampling, THRESHOLD};
use anyhow::{Context, Result};
use fechner_perception::model;
use serde::Serialize;

/// A way to spend samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(into = "&'static str")]
pub enum Arm {
    /// Uniform: the same count everywhere, the power of two nearest to what converged variances ask for.
    Uniform,
    /// Uniform: the same count everywhere, in the time that the loop took as asked.
    UniformEqualTime,
    /// Cycles' rule, its threshold searched.
    Relative,
    /// Relative standard error, its threshold searched.
    Variance,
    /// Tungsten's budget, its size searched.
    Budget,
    /// Threshold versus intensity alone drives the loop, its target searched.
    Tvi,
    /// Ramasubramanian 1999 drives the loop, its target searched.
    Ramasubramanian,
    /// Yee 2001 drives the loop, its target searched.
    Yee,
    /// Bolin and Meyer 1998 drives the loop, its target searched.
    BolinMeyer,
    /// Ablation: contrast sensitivity in bands, but each pixel by itself; its target searched.
    NoPooling,
    /// Ablation: as [`Arm::NoPooling`], and texture hides nothing; its target searched.
    NoMasking,
    /// Ablation: as [`Arm::NoPooling`], with masking on threshold versus intensity in place of contrast
    /// sensitivity; its target searched.
    NoCsf,
    /// Ablation: each pixel's count by its own threshold, not the convex optimum.
    LocalRule,
    /// The loop, its target searched like every other arm's knob.
    Default,
    /// The loop asked for v\* and not tuned: what it promises (99.9 % of the picture) against what it delivers.
    AsAsked,
    /// The same, whose stop is an upper bound of 95 % confidence over all looks.
    Confident,
    /// The loop on its way to threshold, ended at the samples that it took as asked: what `--spp` and `--time` leave.
    ToThreshold,
    /// Converged variance, thresholds of the reference, convex optimum for 99 % of the picture; its target searched.
    Oracle,
}

impl Arm {
    /// Every arm.
    pub const ALL: [Arm; 18] = [
        Arm::Uniform,
        Arm::Relative,
        Arm::Variance,
        Arm::Budget,
        Arm::Tvi,
        Arm::Ramasubramanian,
        Arm::Yee,
        Arm::BolinMeyer,
        Arm::NoPooling,
        Arm::NoMasking,
        Arm::NoCsf,
        Arm::LocalRule,
        Arm::Default,
        Arm::AsAsked,
        Arm::Confident,
        Arm::UniformEqualTime,
        Arm::ToThreshold,
        Arm::Oracle,
    ];
    /// The arms of the quick suite.
    pub const QUICK: [Arm; 7] =
        [Arm::Uniform, Arm::Relative, Arm::Tvi, Arm::Default, Arm::AsAsked, Arm::UniformEqualTime, Arm::Oracle];

    /// What files and tables call it.
    pub fn name(self) -> &'static str {
        match self {
            Arm::Uniform => "uniform",
            Arm::UniformEqualTime => "uniform-equal-time",
            Arm::Relative => "relative",
            Arm::Variance => "variance",
            Arm::Budget => "budget",
            Arm::Tvi => "tvi",
            Arm::Ramasubramanian => "ramasubramanian",
            Arm::Yee => "yee",
            Arm::BolinMeyer => "bolin-meyer",
            Arm::NoPooling => "no-pooling",
            Arm::NoMasking => "no-masking",
            Arm::NoCsf => "no-csf",
            Arm::LocalRule => "local-rule",
            Arm::Default => "default",
            Arm::AsAsked => "as-asked",
            Arm::Confident => "confident",
            Arm::ToThreshold => "to-threshold",
            Arm::Oracle => "oracle",
        }
    }

    /// Where the search of the arm's knob begins; `None` for arms without one. Every knob is like an error: what is
    /// left goes as the knob does.
    ///
    /// Uniform sampling takes the power of two that is nearest, as the loop's pixels do: between them the
    /// sequence's points lie less evenly, and 14 samples of `complementary-lamps` have 1.19 times the squared error
    /// of 16, times the samples.
    pub(super) fn first_knob(self, subject: &Subject, uniform_spp: f64) -> Option<f64> {
        match self {
            Arm::Relative => Some(0.01 * subject.visibility),
            Arm::Variance => Some(0.02 * subject.visibility),
            // A mean count n, as 1/√n.
            Arm::Uniform => Some(uniform_spp.max(4.0).log2().round().exp2().sqrt().recip()),
            Arm::Budget => Some((0.5 * uniform_spp).sqrt().recip()),
            Arm::AsAsked | Arm::Confident | Arm::UniformEqualTime | Arm::ToThreshold => None,
            _ => Some(subject.visibility),
        }
    }

    /// Whether the knob is turned until the picture is at v\*. What uniform sampling is off by is scaled away: its
    /// error is that of its count.
    pub(super) fn is_searched(self) -> bool {
        self != Arm::Uniform
    }

    pub(super) fn settings(self, subject: &Subject, knob: f64, uniform_spp: f64) -> Result<LoopSettings> {
        let mut settings = subject.loop_settings()?;
        let most = most_samples(uniform_spp, settings.limits.pilot_samples);
        let by_model = |settings: &mut LoopSettings, name: &str| -> Result<()> {
            settings.model = Some(model::by_name(name).context("a model")?);
            settings.limits.visibility = Some(knob);
            settings.limits.mean_samples = Some(most);
            Ok(())
        };
        match self {
            Arm::Relative => settings.sampling = Sampling::Rival(RivalRule::Relative { threshold: knob }),
            Arm::Variance => settings.sampling = Sampling::Rival(RivalRule::Variance { threshold: knob }),
            Arm::Budget => {
                settings.sampling = Sampling::Rival(RivalRule::Budget);
                settings.limits.mean_samples = Some(samples_of(knob).min(most));
            }
            Arm::Tvi | Arm::Ramasubramanian | Arm::Yee | Arm::BolinMeyer => by_model(&mut settings, self.name())?,
            Arm::NoPooling => by_model(&mut settings, model::DEFAULT)?,
            Arm::NoMasking => by_model(&mut settings, "csf-unmasked")?,
            Arm::NoCsf => by_model(&mut settings, "tvi-masked")?,
            Arm::LocalRule => {
                settings.allocation = AllocationRule::Local;
                settings.limits.visibility = Some(knob);
            }
            Arm::Default => settings.limits.visibility = Some(knob),
            Arm::Uniform | Arm::UniformEqualTime => {
                settings.sampling = Sampling::Uniform;
                settings.limits.visibility = None;
                settings.limits.mean_samples = Some(samples_of(knob));
            }
            Arm::ToThreshold => {
                settings.limits.visibility = Some(THRESHOLD);
                settings.limits.mean_samples = Some(samples_of(knob));
            }
            Arm::Confident => settings.limits.confidence = Some(0.95),
            Arm::AsAsked | Arm::Oracle => {}
        }
        if matches!(settings.sampling, Sampling::Rival(RivalRule::Relative { .. } | RivalRule::Variance { .. })) {
            settings.limits.mean_samples = Some(most);
            settings.limits.max_samples = most.saturating_mul(64);
        }
        Ok(settings)
    }
}

impl From<Arm> for &'static str {
    fn from(arm: Arm) -> Self {
        arm.name()
    }
}

/// Most mean samples of an arm: one that needs more than this has lost anyway. Never fewer than the pilot, before
/// which no rule can choose.
fn most_samples(uniform_spp: f64, pilot_samples: u32) -> u32 {
    ((4.0 * uniform_spp).ceil() as u32).max(pilot_samples)
}

/// Samples a pixel of a knob that stands for a mean count.
fn samples_of(knob: f64) -> u32 {
    // Nearly whole: the knob of a count comes back from a root.
    (1.0 / (knob * knob) - 1e-6).ceil().clamp(4.0, 1e9) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_comes_back_from_its_knob() {
        for exponent in 2..20 {
            let count = f64::from(1 << exponent);
            assert_eq!(f64::from(samples_of(count.sqrt().recip())), count);
        }
    }

    #[test]
    fn an_arm_may_take_its_pilot_however_little_uniform_sampling_needs() {
        assert_eq!(most_samples(1.5, 16), 16);
        assert_eq!(most_samples(44.1, 16), 177);
    }
}
