//! What a render is asked to do.

use super::pursuit::Pursuit;
use crate::denoise::Denoiser;
use crate::integrator::{PILOT_SAMPLES_PER_PIXEL, TraceSettings};
use crate::sampler::PixelFilter;
use fechner_perception::Plane;
use fechner_perception::csf::FrameTiming;
use fechner_perception::display::Viewing;
use fechner_perception::eccentricity::Gaze;
use fechner_perception::model::ThresholdModel;
use fechner_perception::tone::{SavedTone, SceneLight, ToneOperator};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// How samples are spread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Sampling {
    /// Where the remaining error can be seen.
    Adaptive,
    /// The same everywhere.
    Uniform,
    /// By another renderer's rule, for comparison.
    Rival(RivalRule),
}

impl Sampling {
    /// Whether it looks at the picture as an eye would, if only to know when it is done.
    pub fn is_by_sight(self) -> bool {
        match self {
            Self::Adaptive | Self::Uniform => true,
            Self::Rival(_) => false,
        }
    }
}

/// Stop rules and budgets of today's renderers (see [`super::rivals`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum RivalRule {
    /// Difference of two estimates over the square root of brightness, dilated, as Cycles does it.
    Relative {
        /// Its noise threshold; [`RivalRule::USUAL_THRESHOLD`] is its default.
        threshold: f64,
    },
    /// Standard error of the pixel over its mean.
    Variance {
        /// The ratio at which a pixel stops.
        threshold: f64,
    },
    /// A budget spread by relative variance of 4×4 pixels, as Tungsten does it; it has no stop of its own.
    Budget,
}

impl RivalRule {
    /// Threshold where none is asked for, Cycles' own.
    pub const USUAL_THRESHOLD: f64 = 0.01;
}

/// How the adaptive mode finds a pixel's count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum AllocationRule {
    /// The cheapest counts that keep the pooled visibility everywhere: a convex problem.
    #[default]
    Convex,
    /// Each pixel by its own threshold, as if its surroundings were like it. For comparison.
    Local,
}

/// When to stop; the first that is reached does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Visibility that may remain; 1 is at threshold. `None`: only the other limits count.
    pub visibility: Option<f64>,
    /// Probability, from 0.5 to 1, with which a place of a raw picture is no more visible than told, over all looks
    /// of the default threshold model. `None`: estimates are told and gone by as they are.
    pub confidence: Option<f64>,
    /// Time since the start; checked between plans.
    pub time: Option<Duration>,
    /// Mean samples a pixel.
    pub mean_samples: Option<u32>,
    /// Most samples of one pixel.
    pub max_samples: u32,
    /// Number of plans, to repeat a render that ended by time.
    pub plans: Option<u32>,
    /// Samples of every pixel before the first look where the other limits allow as many: [`Self::pilot`] is what
    /// they come to.
    pub pilot_samples: u32,
}

/// Pilot of a picture that is denoised: the denoiser reads neighbours where raw variance needs samples of the pixel's
/// own.
pub const DENOISED_PILOT_SAMPLES_PER_PIXEL: u32 = 4;

impl Limits {
    /// The visibility that is aimed at; 1, which is at threshold, where only other limits count.
    pub fn visibility_or_threshold(&self) -> f64 {
        self.visibility.unwrap_or(THRESHOLD)
    }

    /// The visibility at which the ladder ends: 0, which no noise gets below, where only other limits count. So films
    /// and the viewer state what is aimed at.
    pub fn last_rung(&self) -> f64 {
        self.visibility.unwrap_or(0.0)
    }

    /// What a visibility as [`Self::last_rung`] states it aims at.
    pub fn visibility_of_last_rung(rung: f64) -> Option<f64> {
        (rung > 0.0 && rung.is_finite()).then_some(rung)
    }

    /// Samples of every pixel before the first look: [`Self::pilot_samples`], or what the other limits leave of them.
    pub fn pilot(&self) -> u32 {
        self.pilot_samples.min(self.max_samples).min(self.mean_samples.unwrap_or(u32::MAX))
    }

    /// To a visibility, whatever it takes.
    pub fn of_visibility(visibility: f64) -> Self {
        Self {
            visibility: Some(visibility),
            confidence: None,
            time: None,
            mean_samples: None,
            max_samples: DEFAULT_MAX_SAMPLES,
            plans: None,
            pilot_samples: PILOT_SAMPLES_PER_PIXEL,
        }
    }
}

/// Everything the loop needs to know besides the scene.
pub struct LoopSettings {
    /// How samples are spread.
    pub sampling: Sampling,
    /// How the adaptive mode finds a pixel's count.
    pub allocation: AllocationRule,
    /// Threshold model that drives the loop; `None` is contrast sensitivity in bands, pooled over the eye's window.
    pub model: Option<Box<dyn ThresholdModel>>,
    /// When to stop.
    pub limits: Limits,
    /// Display and observer.
    pub viewing: Viewing,
    /// Luminance in cd/m² of RGB (1, 1, 1).
    pub nits_per_unit: f64,
    /// How the picture is shown.
    pub operator: Box<dyn ToneOperator>,
    /// A fit of the operator that was made elsewhere, for the frames of one shot or a part of a picture; without it,
    /// each look fits its own.
    pub fitted: Option<SavedTone>,
    /// For a frame of a moving picture, whose noise is gone in the next: how frames follow. `None` for stills and for
    /// frames that may be paused.
    pub frames: Option<FrameTiming>,
    /// What each pixel's thresholds are multiplied by, above 0, of the film's size: somebody's own idea of what
    /// matters.
    pub importance: Option<Plane>,
    /// Where one looks, in pixels of the film: thresholds rise away from all of these. None for a picture that
    /// anybody may look at anywhere. For the default threshold model alone.
    pub gazes: Vec<Gaze>,
    /// Eyes that follow what moves, for [`Self::frames`] and the default threshold model alone; `None`: they rest.
    pub pursuit: Option<Pursuit>,
    /// How pixels take light, which tells where a lamp's edge may have been missed.
    pub filter: PixelFilter,
    /// What makes the output picture out of the mean; `None` leaves it raw.
    pub denoiser: Option<Denoiser>,
    /// Whether the picture has alpha and is laid over other pictures, so that noise of what it covers must be
    /// invisible over black and over white.
    pub is_transparent: bool,
    /// Asked during a look: whether it is of no use any more, as somebody wants another picture. `None` never
    /// interrupts.
    pub is_cancelled: Option<Box<dyn Fn() -> bool + Send + Sync>>,
}

impl LoopSettings {
    /// The default loop, to visibility 1, over samples that are traced so.
    pub fn new(trace: &TraceSettings, viewing: Viewing, nits_per_unit: f64, operator: Box<dyn ToneOperator>) -> Self {
        Self {
            sampling: Sampling::Adaptive,
            allocation: AllocationRule::Convex,
            model: None,
            limits: Limits::of_visibility(1.0),
            viewing,
            nits_per_unit,
            operator,
            fitted: None,
            frames: None,
            importance: None,
            gazes: Vec::new(),
            pursuit: None,
            filter: trace.filter,
            denoiser: None,
            is_transparent: trace.transparent,
            is_cancelled: None,
        }
    }

    /// Shows pictures as the whole is shown of which they are a part.
    pub fn fit_to(&mut self, whole: &SceneLight) {
        self.fitted = Some(self.operator.fit(&whole.guide_for(self.operator.as_ref()), &self.viewing, None).save());
    }

    /// Whether a render that stopped at a visibility is the beginning of this one, so that going on from it gives the
    /// same bytes.
    pub fn ladder_passes_through(&self, visibility: f64) -> bool {
        self.sampling != Sampling::Adaptive || self.rungs().contains(&visibility)
    }

    /// The visibilities that are passed on the way to the one that is asked for, largest first. They are fixed, so
    /// that a render continued to a lower rung equals one that went there in one go, both above threshold or both at
    /// it or below.
    pub(super) fn rungs(&self) -> Vec<f64> {
        let target = self.limits.last_rung();
        let highest = match self.denoiser {
            Some(_) => HIGHEST_DENOISED_RUNG,
            None if target > THRESHOLD => HIGHEST_RUNG,
            None => THRESHOLD,
        };
        ladder(highest, target)
    }
}

/// Samples that a pixel gets at most when nobody says otherwise: beyond it, it is reported as visible instead.
pub const DEFAULT_MAX_SAMPLES: u32 = 1 << 18;

/// The ladder of a picture that is denoised begins here, or at its target: far above threshold its greatest error is
/// in places that no denoiser can help, and they may not have all samples before the rest is looked after.
const HIGHEST_DENOISED_RUNG: f64 = 2.0;
/// Where the ladder of any other picture begins whose target is above threshold.
const HIGHEST_RUNG: f64 = 16.0;
/// Visibility at threshold, as [`fechner_perception`] counts.
///
/// On the way to it or below there is no rung above it: each leaves a picture that is equally visible everywhere,
/// which is the cheapest when it is the last, but not the best when it is not (`benches/results/equal-time.md`).
pub const THRESHOLD: f64 = 1.0;

/// Below it nothing is in between.
const LOWEST_RUNG: f64 = 1.0 / 512.0;

/// The visibilities that are passed from `highest` on the way to `target`, in octaves, `target` last.
fn ladder(highest: f64, target: f64) -> Vec<f64> {
    let octaves = (0..).map(|octave| highest * 0.5f64.powi(octave));
    octaves.take_while(|&rung| rung > target.max(LOWEST_RUNG)).chain(std::iter::once(target)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::test_films::settings;
    use super::*;
    use crate::denoise::DenoiserKind;

    #[test]
    fn ladders_share_their_beginnings() {
        let mut settings = settings();
        let mut rungs = |denoiser: Option<Denoiser>, target: Option<f64>| {
            settings.limits.visibility = target;
            settings.denoiser = denoiser;
            settings.rungs()
        };
        assert_eq!(rungs(None, Some(100.0)), [100.0]);
        assert_eq!(rungs(None, Some(3.0)), [16.0, 8.0, 4.0, 3.0]);
        assert_eq!(rungs(None, Some(2.0)), [16.0, 8.0, 4.0, 2.0]);
        assert_eq!(rungs(None, Some(1.0)), [1.0]);
        assert_eq!(rungs(None, Some(0.5)), [1.0, 0.5]);
        assert_eq!(rungs(None, Some(0.2)), [1.0, 0.5, 0.25, 0.2]);
        assert_eq!(rungs(None, None).len(), 10, "1 to 1/256, and 0");
        let builtin = || Denoiser::open(DenoiserKind::Builtin).ok();
        assert_eq!(rungs(builtin(), Some(4.0)), [4.0]);
        assert_eq!(rungs(builtin(), Some(0.5)), [2.0, 1.0, 0.5]);
        settings.limits.visibility = Some(0.5);
        let passed = [2.0, 0.5, 4.0, 0.7].map(|visibility| settings.ladder_passes_through(visibility));
        assert_eq!(passed, [true, true, false, false]);
    }
}
