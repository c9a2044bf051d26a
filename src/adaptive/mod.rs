//! The loop: pilot, estimate, threshold map, plan, trace, until nothing more can be seen.
//!
//! [`render`] is the heart of the program. It walks a fixed ladder of visibilities and leaves each rung only when the
//! picture has reached it, so that a preview is a prefix of the final picture. What to do next is decided in [`plan`]
//! and by `next_step`; what the eye sees is asked of the perception crate in [`mod@judge`]; variance is in [`statistics`].

pub mod audit;
pub mod judge;
pub mod plan;
pub mod rivals;
pub mod settings;
pub mod statistics;

use crate::film::Film;
use crate::integrator::{Crop, PathTracer, SamplePlan};
use audit::{Audit, audit};
use fechner_perception::Plane;
use judge::{JudgeError, Judgement, judge};
use plan::{adaptive_plan, cut_to_budget, doubling_of, pilot_plan, slices, uniform_plan, wanted_samples};
use rivals::rival_plan;
use settings::{LoopSettings, Sampling, ladder};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Share of pixels that may remain above the target when the loop stops.
pub const TOLERATED_SHARE: f64 = 0.001;
/// No 1° patch may stay above this many times the target.
const TOLERATED_PATCH: f64 = 2.0;
/// No single pixel's measured amplitude may stay above this many times the target.
const TOLERATED_PEAK: f64 = 4.0;
/// Rungs above this are not audited: their few samples say little.
const HIGHEST_AUDITED_RUNG: f64 = 4.0;
/// What the variance may be multiplied by in all after audits that disagree.
const MOST_INFLATION: f64 = 4.0;
/// Below this predicted saving the loop samples uniformly: its estimates err by more.
const LEAST_SAVING: f64 = 0.05;

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
    /// Another renderer's rule was satisfied.
    Rule,
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
    /// The last audit, where the picture was large enough for one.
    pub audit: Option<Audit>,
    /// What audits multiplied the variance by.
    pub inflation: f64,
    /// Time from the first sample to the end.
    pub seconds_total: f64,
    /// Of which in the perception model, planning and audits.
    pub seconds_perception: f64,
}

/// What to do after a look.
#[derive(Debug)]
enum Step {
    Trace(SamplePlan),
    Stop(StopReason),
}

/// A render under way: all that decides what comes next.
struct Loop<'a> {
    tracer: &'a PathTracer,
    settings: &'a LoopSettings,
    film: Film,
    rungs: VecDeque<f64>,
    inflation: f64,
    audit: Option<Audit>,
    audits: u32,
}

/// Renders until a limit is reached.
///
/// # Errors
/// Only if the perception model refuses the picture, which would be a defect of ours.
pub fn render(tracer: &PathTracer, settings: &LoopSettings, monitor: &dyn Monitor) -> Result<Rendered, JudgeError> {
    let started = Instant::now();
    let Crop { width, height, .. } = tracer.settings().film_area();
    let mut state = Loop {
        tracer,
        settings,
        film: Film::new(width, height),
        rungs: VecDeque::from(ladder(settings.limits.visibility)),
        inflation: 1.0,
        audit: None,
        audits: 0,
    };
    let mut seconds_perception = 0.0;
    let (mut plans, mut pass) = (0, 0);
    let most = settings.limits.max_samples.min(settings.limits.mean_samples.unwrap_or(u32::MAX));
    let mut pending = VecDeque::from([pilot_plan(width * height, most)]);
    let mut last_look: Option<Judgement> = None;
    let mut judged_samples = 0;
    loop {
        let mut out_of_limit = None;
        while let Some(plan) = pending.pop_front() {
            tracer.trace(&plan, &mut state.film, &|samples| monitor.samples_done(samples));
            plans += 1;
            let next = pending.front().map_or(0, SamplePlan::samples);
            let expected = started.elapsed().mul_f64(next as f64 / state.film.total_samples().max(1) as f64);
            out_of_limit = limit_reached(settings, started.elapsed() + expected / 2, plans);
            if out_of_limit.is_some() {
                break;
            }
        }
        let look = Instant::now();
        // Rules that do not see need no look at each of their many small steps.
        let is_blind = matches!(settings.sampling, Sampling::Rival(_)) && out_of_limit.is_none();
        let judgement = match last_look.take() {
            Some(earlier) if is_blind && state.film.total_samples() < 2 * judged_samples => earlier,
            _ => {
                judged_samples = state.film.total_samples();
                judge(&state.film, settings, state.inflation)?
            }
        };
        let step = match out_of_limit {
            Some(reason) => Step::Stop(reason),
            None => state.next_step(&judgement)?,
        };
        seconds_perception += look.elapsed().as_secs_f64();
        pass += 1;
        monitor.looked(&progress(pass, &state, &judgement, &step));
        match step {
            Step::Trace(plan) => {
                pending.extend(slices(plan, width, state.film.total_samples()));
                last_look = Some(judgement);
            }
            Step::Stop(stop_reason) => {
                let fresh = judged_samples == state.film.total_samples();
                return Ok(Rendered {
                    judgement: if fresh { judgement } else { judge(&state.film, settings, state.inflation)? },
                    film: state.film,
                    stop_reason,
                    plans,
                    audit: state.audit,
                    inflation: state.inflation,
                    seconds_total: started.elapsed().as_secs_f64(),
                    seconds_perception,
                });
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

impl Loop<'_> {
    /// Decides what comes next, leaving rungs of the ladder that are reached.
    fn next_step(&mut self, judgement: &Judgement) -> Result<Step, JudgeError> {
        let limits = &self.settings.limits;
        let pixels = u64::from(self.film.width()) * u64::from(self.film.height());
        let budget = limits.mean_samples.map(|mean| u64::from(mean) * pixels);
        let left = budget.map_or(u64::MAX, |b| b.saturating_sub(self.film.total_samples()));
        if left == 0 {
            return Ok(Step::Stop(StopReason::Samples));
        }
        if let Sampling::Rival(rule) = self.settings.sampling {
            let exposure = scene_unit_over_white(judgement, self.settings);
            let plan = rival_plan(rule, &self.film, exposure, limits.mean_samples, limits.max_samples);
            return Ok(if plan.blocks.is_empty() { Step::Stop(StopReason::Rule) } else { Step::Trace(plan) });
        }
        while let Some(&rung) = self.rungs.front() {
            if let Some(plan) = self.plan_towards(rung, judgement)? {
                let plan = if plan.samples() > left { cut_to_budget(plan, &judgement.predicted, left) } else { plan };
                if !plan.blocks.is_empty() {
                    return Ok(Step::Trace(plan));
                }
            }
            self.rungs.pop_front();
        }
        Ok(Step::Stop(if is_reached(judgement, limits.visibility) {
            StopReason::Visibility
        } else if limits.mean_samples.is_some() {
            StopReason::Samples
        } else {
            StopReason::MaxSamples
        }))
    }

    /// More samples for a rung; `None` when it is reached or no pixel may have more.
    fn plan_towards(&mut self, rung: f64, judgement: &Judgement) -> Result<Option<SamplePlan>, JudgeError> {
        let max_samples = self.settings.limits.max_samples;
        let doubled = {
            let most = self.settings.limits.mean_samples.unwrap_or(max_samples).min(max_samples);
            let pixels = u64::from(self.film.width()) * u64::from(self.film.height());
            (2 * (self.film.total_samples() / pixels).max(8) as u32).min(most)
        };
        let some = |plan: SamplePlan| if plan.blocks.is_empty() { None } else { Some(plan) };
        if self.settings.sampling == Sampling::Uniform {
            return Ok(if is_reached(judgement, rung) { None } else { some(uniform_plan(&self.film, doubled)) });
        }
        if !is_reached(judgement, rung) {
            let wanted = wanted_samples(judgement, self.settings.allocation, rung, max_samples)?;
            if predicted_saving(&self.film, judgement, &wanted, rung) < LEAST_SAVING {
                return Ok(some(uniform_plan(&self.film, doubled)));
            }
            let plan = adaptive_plan(&self.film, judgement, &wanted, max_samples);
            if !plan.blocks.is_empty() {
                return Ok(Some(plan));
            }
            // Each pixel by itself has what it needs, yet its surroundings show.
            let predicted = judgement.predicted.values();
            return Ok(some(doubling_of(&self.film, max_samples, |i| f64::from(predicted[i]) > rung)));
        }
        if let Some(plan) = some(self.peaks(rung, judgement)) {
            return Ok(Some(plan));
        }
        Ok(self.audited(rung, judgement)?.and_then(some))
    }

    /// More samples for single pixels that stand out of what the halves show, which pooling hides.
    fn peaks(&self, rung: f64, judgement: &Judgement) -> SamplePlan {
        let amplitude = judgement.measured_error(self.settings).amplitude;
        let limit = TOLERATED_PEAK * rung;
        doubling_of(&self.film, self.settings.limits.max_samples, |i| f64::from(amplitude.values()[i]) > limit)
    }

    /// Audits a rung that is reached. Where the variance proves too low it is raised from here on, and the plan for it is
    /// returned.
    fn audited(&mut self, rung: f64, judgement: &Judgement) -> Result<Option<SamplePlan>, JudgeError> {
        let may_audit = rung <= HIGHEST_AUDITED_RUNG && judgement.pixel_thresholds.is_none();
        if !may_audit || self.inflation >= MOST_INFLATION {
            return Ok(None);
        }
        let found = audit(self.tracer, &self.film, judgement, self.settings, self.audits);
        self.audits += 1;
        self.audit = found.or(self.audit);
        let Some(found) = found.filter(Audit::disagrees) else { return Ok(None) };
        self.inflation = (self.inflation * found.ratio).min(MOST_INFLATION);
        let stricter = judge(&self.film, self.settings, self.inflation)?;
        self.plan_towards(rung, &stricter)
    }
}

/// Share of display white that one scene unit makes near black: the exposure that other renderers are told.
fn scene_unit_over_white(judgement: &Judgement, settings: &LoopSettings) -> f64 {
    const DIM_CD_M2: f32 = 0.1;
    f64::from(judgement.tone.relative_luminance(DIM_CD_M2) / DIM_CD_M2) * settings.nits_per_unit
}

/// Whether a rung's stop is met: the tolerated share of pixels is below it, and no patch is far above.
fn is_reached(judgement: &Judgement, rung: f64) -> bool {
    let worst = judgement.predicted.values().iter().fold(0.0, |a: f32, &v| a.max(v));
    visible_share(judgement, rung) <= TOLERATED_SHARE && f64::from(worst) <= TOLERATED_PATCH * rung
}

/// Share of samples that the wanted counts save against as many everywhere as the hardest tolerated pixel needs.
fn predicted_saving(film: &Film, judgement: &Judgement, wanted: &Plane, rung: f64) -> f64 {
    let variance = &judgement.pooled_variance_per_sample;
    let mut for_one_sample = judgement.visibility_of(variance).values().to_vec();
    let rank = ((1.0 - TOLERATED_SHARE) * (for_one_sample.len() - 1) as f64) as usize;
    let (_, &mut hardest, _) = for_one_sample.select_nth_unstable_by(rank, f32::total_cmp);
    let uniform = (f64::from(hardest) / rung).powi(2);
    let counts = wanted.values().iter().enumerate().map(|(i, &wanted)| f64::from(wanted).max(film.samples(i).into()));
    1.0 - counts.sum::<f64>() / (uniform * wanted.values().len() as f64)
}

/// Share of pixels whose predicted visibility is above `visibility`.
pub fn visible_share(judgement: &Judgement, visibility: f64) -> f64 {
    let values = judgement.predicted.values();
    values.iter().filter(|&&v| f64::from(v) > visibility).count() as f64 / values.len() as f64
}

fn progress(pass: u32, state: &Loop<'_>, judgement: &Judgement, step: &Step) -> Progress {
    let Loop { film, settings, rungs, .. } = state;
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
