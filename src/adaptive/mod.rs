//! The loop: pilot, estimate, threshold map, plan, trace, until nothing more can be seen.
//!
//! [`render`] is the heart of the program. It walks a fixed ladder of visibilities and leaves each rung only when the
//! picture has reached it, so that a preview is a prefix of the final picture. What to do next is decided in [`plan`]
//! and by `next_step`; what the eye sees is asked of the perception crate in [`mod@judge`]; variance is in [`statistics`].

pub mod judge;
pub mod plan;
pub mod settings;
pub mod statistics;

use crate::film::Film;
use crate::integrator::{Crop, PathTracer, SamplePlan};
use judge::{JudgeError, Judgement, judge};
use plan::{adaptive_plan, cut_to_budget, pilot_plan, remainder_plan, slices, uniform_plan};
use settings::{LoopSettings, Sampling, ladder};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Share of pixels that may remain above the target when the loop stops.
pub const TOLERATED_SHARE: f64 = 0.001;

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// Predicted visibility is at most the target on 99.9 % of the picture.
    Visibility,
    /// The time was up.
    Time,
    /// The mean number of samples was reached.
    Samples,
    /// What can still be seen is in pixels that have the most samples allowed.
    MaxSamples,
    /// The number of plans was reached.
    Plans,
}

/// How far a render is, told after each look.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Looks taken, from 1.
    pub pass: u32,
    /// Visibility that is being worked towards.
    pub rung: f64,
    /// Pixels of the picture.
    pub pixels: f64,
    /// Mean samples a pixel so far.
    pub mean_samples: f64,
    /// Share of pixels whose predicted visibility is above the final target.
    pub visible_share: f64,
    /// Samples of the plan that comes next.
    pub next_samples: u64,
    /// Rough count of samples that the target will take from here, if the noise behaves as it did.
    pub remaining_samples: f64,
}

/// Is told how a render goes. Called from the render's own thread, except `samples_done`.
pub trait Monitor: Sync {
    /// After each look at the picture.
    fn looked(&self, progress: &Progress);
    /// While a plan is traced, from any thread.
    fn samples_done(&self, samples: u64);
}

/// Tells nobody.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quiet;

impl Monitor for Quiet {
    fn looked(&self, _: &Progress) {}
    fn samples_done(&self, _: u64) {}
}

/// A finished render.
#[derive(Debug)]
pub struct Rendered {
    /// All samples.
    pub film: Film,
    /// The last look at it.
    pub judgement: Judgement,
    /// Why it ended.
    pub stop_reason: StopReason,
    /// Plans traced.
    pub plans: u32,
    /// Time from the first sample to the end.
    pub seconds_total: f64,
    /// Of which in the perception model and planning.
    pub seconds_perception: f64,
}

/// What to do after a look.
#[derive(Debug)]
enum Step {
    Trace(SamplePlan),
    Stop(StopReason),
}

/// Renders until a limit is reached.
///
/// # Errors
/// Only if the perception model refuses the picture, which would be a defect of ours.
pub fn render(tracer: &PathTracer, settings: &LoopSettings, monitor: &dyn Monitor) -> Result<Rendered, JudgeError> {
    let started = Instant::now();
    let Crop { width, height, .. } = tracer.settings().film_area();
    let mut film = Film::new(width, height);
    let mut rungs = VecDeque::from(ladder(settings.limits.visibility));
    let mut seconds_perception = 0.0;
    let mut plans = 0;
    let mut pass = 0;
    let most = settings.limits.max_samples.min(settings.limits.mean_samples.unwrap_or(u32::MAX));
    let mut pending = VecDeque::from([pilot_plan(width * height, most)]);
    loop {
        let mut out_of_limit = None;
        while let Some(plan) = pending.pop_front() {
            tracer.trace(&plan, &mut film, &|samples| monitor.samples_done(samples));
            plans += 1;
            let next = pending.front().map_or(0, SamplePlan::samples);
            let expected = started.elapsed().mul_f64(next as f64 / film.total_samples().max(1) as f64);
            out_of_limit = limit_reached(settings, started.elapsed() + expected / 2, plans);
            if out_of_limit.is_some() {
                break;
            }
        }
        let look = Instant::now();
        let judgement = judge(&film, settings)?;
        let step = match out_of_limit {
            Some(reason) => Step::Stop(reason),
            None => next_step(&film, &judgement, settings, &mut rungs)?,
        };
        seconds_perception += look.elapsed().as_secs_f64();
        pass += 1;
        monitor.looked(&progress(pass, &film, &judgement, settings, &rungs, &step));
        match step {
            Step::Trace(plan) => pending.extend(slices(plan, width, film.total_samples())),
            Step::Stop(stop_reason) => {
                let seconds_total = started.elapsed().as_secs_f64();
                return Ok(Rendered { film, judgement, stop_reason, plans, seconds_total, seconds_perception });
            }
        }
    }
}

/// Limits that do not depend on the picture. `elapsed` is the time at the middle of the plan that would come next: a
/// render ends at the boundary between plans that is nearest to its limit.
fn limit_reached(settings: &LoopSettings, elapsed: Duration, plans: u32) -> Option<StopReason> {
    if settings.limits.time.is_some_and(|limit| elapsed >= limit) {
        Some(StopReason::Time)
    } else if settings.limits.plans.is_some_and(|limit| plans >= limit) {
        Some(StopReason::Plans)
    } else {
        None
    }
}

/// Decides what comes next, leaving rungs of the ladder that are reached.
fn next_step(
    film: &Film,
    judgement: &Judgement,
    settings: &LoopSettings,
    rungs: &mut VecDeque<f64>,
) -> Result<Step, JudgeError> {
    let pixels = u64::from(film.width()) * u64::from(film.height());
    let budget = settings.limits.mean_samples.map(|mean| u64::from(mean) * pixels);
    let left = budget.map_or(u64::MAX, |b| b.saturating_sub(film.total_samples()));
    if left == 0 {
        return Ok(Step::Stop(StopReason::Samples));
    }
    while let Some(&rung) = rungs.front() {
        let reached = visible_share(judgement, rung) <= TOLERATED_SHARE;
        if !reached {
            let plan = plan_towards(rung, film, judgement, settings)?;
            if plan.blocks.is_empty() && rungs.len() == 1 {
                return Ok(Step::Stop(StopReason::MaxSamples));
            }
            let plan = if plan.samples() > left { cut_to_budget(plan, judgement, left) } else { plan };
            if !plan.blocks.is_empty() {
                return Ok(Step::Trace(plan));
            }
        }
        rungs.pop_front();
    }
    Ok(Step::Stop(if visible_share(judgement, settings.limits.visibility) <= TOLERATED_SHARE {
        StopReason::Visibility
    } else {
        StopReason::Samples
    }))
}

/// More samples for a rung that is not reached; none where no pixel may have more.
fn plan_towards(
    rung: f64,
    film: &Film,
    judgement: &Judgement,
    settings: &LoopSettings,
) -> Result<SamplePlan, JudgeError> {
    let max_samples = settings.limits.max_samples;
    Ok(match settings.sampling {
        Sampling::Uniform => {
            let most = settings.limits.mean_samples.unwrap_or(max_samples).min(max_samples);
            let pixels = u64::from(film.width()) * u64::from(film.height());
            let doubled = 2 * (film.total_samples() / pixels).max(8) as u32;
            uniform_plan(film, doubled.min(most))
        }
        Sampling::Adaptive => {
            let plan = adaptive_plan(film, judgement, rung, max_samples)?;
            if plan.blocks.is_empty() { remainder_plan(film, judgement, rung, max_samples) } else { plan }
        }
    })
}

/// Share of pixels whose predicted visibility is above `visibility`.
pub fn visible_share(judgement: &Judgement, visibility: f64) -> f64 {
    let values = judgement.predicted.values();
    values.iter().filter(|&&v| f64::from(v) > visibility).count() as f64 / values.len() as f64
}

fn progress(
    pass: u32,
    film: &Film,
    judgement: &Judgement,
    settings: &LoopSettings,
    rungs: &VecDeque<f64>,
    step: &Step,
) -> Progress {
    let pixels = f64::from(film.width()) * f64::from(film.height());
    let target = settings.limits.visibility;
    let by_budget = settings
        .limits
        .mean_samples
        .map_or(f64::INFINITY, |mean| f64::from(mean) * pixels - film.total_samples() as f64);
    let by_visibility: f64 = (0..judgement.predicted.values().len())
        .map(|i| {
            let excess = f64::from(judgement.predicted.values()[i]) / target;
            f64::from(film.samples(i)) * (excess * excess - 1.0).max(0.0)
        })
        .sum();
    let remaining = by_budget.min(by_visibility);
    Progress {
        pass,
        rung: rungs.front().copied().unwrap_or(target),
        pixels,
        mean_samples: film.total_samples() as f64 / pixels,
        visible_share: visible_share(judgement, target),
        next_samples: match step {
            Step::Trace(plan) => plan.samples(),
            Step::Stop(_) => 0,
        },
        remaining_samples: remaining,
    }
}
