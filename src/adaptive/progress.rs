//! How far a render is, and about how much of it is left.

use super::judge::Judgement;
use super::plan::slice_count;
use super::settings::{DEFAULT_MAX_SAMPLES, Limits};
use super::state::RenderState;
use super::{Loop, Progress, Step, visible_share};
use crate::film::Film;
use crate::integrator::SamplePlan;

/// What is told after a look of which `step` came.
pub(super) fn progress(render: &Loop<'_>, judgement: &Judgement, step: &Step) -> Progress {
    let Loop { state, settings, rungs, .. } = render;
    let (film, limits) = (&state.film, &settings.limits);
    let pixels = film.pixel_count() as f64;
    let (next_samples, remaining_samples) = match step {
        Step::Trace(plan) => (plan.samples(), remaining_samples(state, limits, judgement, plan)),
        Step::Stop(_) => (0, 0.0),
    };
    Progress {
        look: state.looks.saturating_add(1),
        seconds: render.seconds(),
        rung: rungs.front().copied().unwrap_or(limits.last_rung()),
        pixels,
        mean_samples: film.total_samples() as f64 / pixels,
        visible_share: judgement.is_known.then(|| visible_share(judgement, limits.visibility_or_threshold())),
        next_samples,
        remaining_samples,
    }
}

/// Samples until the first limit, that of time apart: plans are taken to be as large as those of the one that comes
/// next.
fn remaining_samples(state: &RenderState, limits: &Limits, judgement: &Judgement, next: &SamplePlan) -> f64 {
    let (film, traced) = (&state.film, state.film.total_samples());
    let until_budget = limits.mean_samples.map(|mean| f64::from(mean) * film.pixel_count() as f64 - traced as f64);
    let of_a_plan = next.samples() as f64 / slice_count(next.samples(), traced) as f64;
    let until_plans = limits.plans.map(|most| f64::from(most.saturating_sub(state.plans)) * of_a_plan);
    let limited = [until_budget, until_plans].into_iter().flatten().fold(f64::INFINITY, f64::min);
    limited.min(samples_to_target(film, limits, judgement))
}

/// Samples until nothing is more visible than it may be, where the noise behaves as it did and no pixel takes more
/// than it may have. Infinite where no visibility is asked for and pixels may have as many as by default, which no
/// render comes to.
fn samples_to_target(film: &Film, limits: &Limits, judgement: &Judgement) -> f64 {
    let target = limits.last_rung();
    if target <= 0.0 && limits.max_samples == DEFAULT_MAX_SAMPLES {
        return f64::INFINITY;
    }
    let of_pixel = |(pixel, &predicted): (usize, &f32)| {
        let (samples, excess) = (film.samples(pixel), f64::from(predicted) / target);
        let allowed = f64::from(limits.max_samples.saturating_sub(samples));
        (f64::from(samples) * (excess * excess - 1.0).max(0.0)).min(allowed)
    };
    judgement.predicted.values().iter().enumerate().map(of_pixel).sum()
}
