//! The loop: pilot, estimate, threshold map, plan, trace, until nothing more can be seen.
//!
//! [`render`] is the heart of the program. It walks a fixed ladder of visibilities and leaves each rung only when the
//! picture has reached it, so that a preview is a prefix of the final picture. What to do next is decided in [`plan`]
//! and by `next_step`; what the eye sees is asked of the perception crate in [`mod@judge`]; variance is in [`statistics`].

pub mod audit;
pub mod denoised;
pub mod judge;
mod monitor;
pub mod plan;
pub mod rivals;
pub mod settings;
pub mod state;
pub mod statistics;
mod stop;

pub use monitor::{Directive, Monitor, Progress, Quiet};
pub use stop::{StopReason, TOLERATED_SHARE, is_reached, visible_share};

use crate::film::Film;
use crate::integrator::{BlockWork, Crop, PathTracer, SamplePlan};
use audit::{Audit, audit};
use judge::{JudgeError, Judgement, judge};
use plan::{adaptive_plan, cut_to_budget, denoised_plan, doubling_of, slices, uniform_plan, wanted_samples};
use rivals::rival_plan;
use settings::{LoopSettings, Sampling, ladder};
use state::{Exposure, RenderState};
use std::collections::VecDeque;
use std::time::Instant;
use stop::{LEAST_SAVING, predicted_saving};

/// No single pixel's measured amplitude may stay above this many times the target.
const TOLERATED_PEAK: f64 = 4.0;
/// Rungs above this are not audited: their few samples say little.
const HIGHEST_AUDITED_RUNG: f64 = 4.0;
/// The ladder of a picture that is denoised begins here, or at its target.
const HIGHEST_DENOISED_RUNG: f64 = 2.0;
/// What the variance may be multiplied by in all after audits that disagree.
const MOST_INFLATION: f64 = 4.0;

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
    /// Time from the first sample to the end, less what a resumed render lay idle.
    pub seconds_total: f64,
    /// Of which in the perception model, planning and audits.
    pub seconds_perception: f64,
    /// Of which in finding counts.
    pub seconds_allocation: f64,
    /// And in denoising.
    pub seconds_denoising: f64,
}

impl Rendered {
    /// A state's end and the last look at it.
    pub fn new(state: RenderState, judgement: Judgement, stop_reason: StopReason) -> Self {
        Self {
            film: state.film,
            judgement,
            stop_reason,
            plans: state.plans,
            audit: state.audit,
            inflation: state.inflation,
            seconds_total: state.seconds_total,
            seconds_perception: state.seconds_perception,
            seconds_allocation: state.seconds_allocation,
            seconds_denoising: state.seconds_denoising,
        }
    }
}

/// A render as its loop left it.
#[derive(Debug)]
pub struct Ended {
    /// What a render to another limit would go on from.
    pub state: RenderState,
    /// The last look and why the render ended; `None` if it was left without a look.
    pub last_look: Option<LastLook>,
}

/// Why a render ended, and what it was like then.
#[derive(Debug)]
pub struct LastLook {
    /// What was seen.
    pub judgement: Judgement,
    /// Why it ended.
    pub stop_reason: StopReason,
}

/// What to do after a look.
#[derive(Debug)]
enum Step {
    Trace(SamplePlan),
    Stop(StopReason),
}

/// How far the tracing of what is planned came.
#[derive(Debug)]
enum Traced {
    Everything,
    UntilLimit(StopReason),
    UntilLeft,
}

/// A render under way.
struct Loop<'a> {
    tracer: &'a PathTracer,
    settings: &'a LoopSettings,
    rungs: VecDeque<f64>,
    state: RenderState,
    resumed_at: Instant,
    seconds_before: f64,
}

/// Renders until a limit is reached.
///
/// # Errors
/// Only if the perception model refuses the picture, which would be a defect of ours.
pub fn render(tracer: &PathTracer, settings: &LoopSettings, monitor: &dyn Monitor) -> Result<Rendered, JudgeError> {
    let Crop { width, height, .. } = tracer.settings().film_area();
    resume(tracer, settings, RenderState::new(width, height, &settings.limits), monitor)
}

/// Goes on with a render of the same scene, size and seed until a limit is reached. Limits count from the first start.
///
/// # Errors
/// Only if the perception model refuses the picture, which would be a defect of ours.
pub fn resume(
    tracer: &PathTracer,
    settings: &LoopSettings,
    state: RenderState,
    monitor: &dyn Monitor,
) -> Result<Rendered, JudgeError> {
    let Ended { state, last_look } = run(tracer, settings, state, monitor)?;
    let LastLook { judgement, stop_reason } = match last_look {
        Some(last_look) => last_look,
        None => {
            let judgement = judge(&state.film, settings, state.inflation)?;
            LastLook { judgement, stop_reason: StopReason::Interrupted }
        }
    };
    Ok(Rendered::new(state, judgement, stop_reason))
}

/// [`resume`] for somebody who may leave the render with [`Directive::Leave`] and go on from its state.
///
/// # Errors
/// Only if the perception model refuses the picture, which would be a defect of ours.
pub fn run(
    tracer: &PathTracer,
    settings: &LoopSettings,
    state: RenderState,
    monitor: &dyn Monitor,
) -> Result<Ended, JudgeError> {
    let mut render = Loop::new(tracer, settings, state);
    let mut last_look: Option<Judgement> = None;
    loop {
        let ended = match render.trace_pending(monitor) {
            Traced::Everything => None,
            Traced::UntilLimit(reason) => Some(reason),
            Traced::UntilLeft => return Ok(Ended { state: render.state, last_look: None }),
        };
        let look = Instant::now();
        let mut judgement = match last_look.take() {
            Some(earlier) if ended.is_none() && render.exposure_holds() => earlier,
            _ => render.look()?,
        };
        let step = match ended {
            Some(reason) => Step::Stop(reason),
            None => render.next_step(&mut judgement)?,
        };
        match render.take(step, &judgement, look, monitor) {
            None => last_look = Some(judgement),
            Some(reason) => return render.finish(judgement, reason, monitor),
        }
    }
}

/// What comes after a state all of whose plans are traced.
#[derive(Debug)]
pub enum Next {
    /// More is planned, and not traced.
    Planned(Box<RenderState>),
    /// Nothing.
    Ended(Box<Ended>),
}

/// One look of [`run`]'s loop at a state all of whose plans are traced, for somebody who traces elsewhere. Limits of time
/// and plans are not looked at.
///
/// # Errors
/// Only if the perception model refuses the picture, which would be a defect of ours.
pub fn decide(
    tracer: &PathTracer,
    settings: &LoopSettings,
    state: RenderState,
    monitor: &dyn Monitor,
) -> Result<Next, JudgeError> {
    let mut render = Loop::new(tracer, settings, state);
    let look = Instant::now();
    let mut judgement = render.look()?;
    let step = render.next_step(&mut judgement)?;
    if let Some(reason) = render.take(step, &judgement, look, monitor) {
        return Ok(Next::Ended(Box::new(render.finish(judgement, reason, monitor)?)));
    }
    render.state.seconds_total = render.seconds();
    Ok(Next::Planned(Box::new(render.state)))
}

impl<'a> Loop<'a> {
    fn new(tracer: &'a PathTracer, settings: &'a LoopSettings, state: RenderState) -> Self {
        let is_below = |rung: f64, bound: Option<f64>| bound.is_none_or(|bound| rung < bound);
        let is_left = |&rung: &f64| is_below(rung, state.finished_rung) && is_below(rung, state.left_rung);
        let target = settings.limits.visibility;
        // Far above threshold a denoised picture's greatest error is in places that no denoiser can help: they may not have
        // all samples before the rest is looked after.
        let is_walked = |&rung: &f64| settings.denoiser.is_none() || rung <= HIGHEST_DENOISED_RUNG.max(target);
        let rungs = ladder(target).into_iter().filter(is_left).filter(is_walked).collect();
        let seconds_before = state.seconds_total;
        Self { tracer, settings, rungs, state, resumed_at: Instant::now(), seconds_before }
    }

    /// Tells what was seen and enters the plan that came of it, or says why there is none.
    fn take(&mut self, step: Step, judgement: &Judgement, look: Instant, monitor: &dyn Monitor) -> Option<StopReason> {
        self.state.seconds_perception += look.elapsed().as_secs_f64();
        self.state.passes += 1;
        monitor.looked(&progress(self, judgement, &step));
        monitor.judged(&self.state, judgement);
        match step {
            Step::Trace(plan) => {
                let film = &self.state.film;
                self.state.pending.extend(slices(plan, film.width(), film.total_samples()));
                self.state.tone = Some(judgement.tone.save());
                None
            }
            Step::Stop(reason) => Some(reason),
        }
    }

    fn seconds(&self) -> f64 {
        self.seconds_before + self.resumed_at.elapsed().as_secs_f64()
    }

    /// Looks at the film.
    fn look(&mut self) -> Result<Judgement, JudgeError> {
        let judgement = judge(&self.state.film, self.settings, self.state.inflation)?;
        self.state.seconds_denoising += judgement.seconds_denoising;
        Ok(judgement)
    }

    /// Traces what is planned, and says why the render ends if it does. A plan that was begun is finished first, unless
    /// the monitor stops it.
    fn trace_pending(&mut self, monitor: &dyn Monitor) -> Traced {
        loop {
            if self.state.traced_blocks == 0
                && let Some(reason) = self.limit_reached()
            {
                return Traced::UntilLimit(reason);
            }
            let Some(plan) = self.state.pending.front() else { return Traced::Everything };
            while let rest @ [_, ..] = &plan.blocks[self.state.traced_blocks..] {
                let batch = beginning(rest, monitor.most_samples_a_batch());
                let progress = |samples| monitor.samples_done(samples);
                self.state.traced_blocks += self.tracer.trace_batch(batch, &mut self.state.film, &progress);
                self.state.seconds_total = self.seconds();
                match monitor.between_batches(&self.state) {
                    Directive::GoOn => {}
                    Directive::Stop => return Traced::UntilLimit(StopReason::Interrupted),
                    Directive::Leave => return Traced::UntilLeft,
                }
            }
            self.state.pending.pop_front();
            self.state.traced_blocks = 0;
            self.state.plans += 1;
        }
    }

    /// Limits that do not depend on the picture: a render ends at the boundary between plans that is nearest to its limit
    /// of time. The pilot is always traced.
    fn limit_reached(&self) -> Option<StopReason> {
        let RenderState { film, pending, plans, .. } = &self.state;
        if *plans == 0 {
            return None;
        }
        let traced = film.total_samples().max(1);
        let elapsed = self.seconds();
        let next = pending.front().map_or(0, SamplePlan::samples);
        let middle_of_next = elapsed * (1.0 + 0.5 * next as f64 / traced as f64);
        let limits = &self.settings.limits;
        if limits.time.is_some_and(|limit| middle_of_next >= limit.as_secs_f64()) {
            Some(StopReason::Time)
        } else if limits.plans.is_some_and(|limit| *plans >= limit) {
            Some(StopReason::Plans)
        } else {
            None
        }
    }

    /// Tells the last state, and looks once more where the rule did not need to.
    fn finish(mut self, judgement: Judgement, reason: StopReason, monitor: &dyn Monitor) -> Result<Ended, JudgeError> {
        let judgement = match self.settings.sampling {
            Sampling::Rival(_) => self.look()?,
            Sampling::Adaptive | Sampling::Uniform => judgement,
        };
        self.state.seconds_total = self.seconds();
        self.state.tone = Some(judgement.tone.save());
        // With other limits they may be reached.
        self.state.left_rung = None;
        monitor.ended(&self.state);
        Ok(Ended { state: self.state, last_look: Some(LastLook { judgement, stop_reason: reason }) })
    }

    /// Decides what comes next, leaving rungs of the ladder that are reached. An audit may make `judgement` stricter.
    fn next_step(&mut self, judgement: &mut Judgement) -> Result<Step, JudgeError> {
        let limits = &self.settings.limits;
        let pixels = u64::from(self.state.film.width()) * u64::from(self.state.film.height());
        let budget = limits.mean_samples.map(|mean| u64::from(mean) * pixels);
        let left = budget.map_or(u64::MAX, |b| b.saturating_sub(self.state.film.total_samples()));
        if left == 0 {
            return Ok(Step::Stop(StopReason::Samples));
        }
        if let Sampling::Rival(rule) = self.settings.sampling {
            let exposure = self.exposure(judgement);
            let plan = rival_plan(rule, &self.state.film, exposure, limits.mean_samples, limits.max_samples);
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
            self.state.left_rung = Some(rung);
            if is_reached(judgement, rung) {
                self.state.finished_rung = Some(rung);
            }
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
    fn plan_towards(&mut self, rung: f64, judgement: &mut Judgement) -> Result<Option<SamplePlan>, JudgeError> {
        let max_samples = self.settings.limits.max_samples;
        let doubled = {
            let most = self.settings.limits.mean_samples.unwrap_or(max_samples).min(max_samples);
            let pixels = u64::from(self.state.film.width()) * u64::from(self.state.film.height());
            (2 * (self.state.film.total_samples() / pixels).max(u64::from(self.settings.limits.pilot_samples) / 2)
                as u32)
                .min(most)
        };
        let some = |plan: SamplePlan| if plan.blocks.is_empty() { None } else { Some(plan) };
        if self.settings.sampling == Sampling::Uniform {
            return Ok(if is_reached(judgement, rung) { None } else { some(uniform_plan(&self.state.film, doubled)) });
        }
        if !is_reached(judgement, rung) && judgement.denoised.is_some() {
            return Ok(some(denoised_plan(&self.state.film, &judgement.predicted, rung, max_samples)));
        }
        if !is_reached(judgement, rung) {
            let started = Instant::now();
            let wanted = wanted_samples(judgement, self.settings.allocation, rung, &self.settings.limits)?;
            self.state.seconds_allocation += started.elapsed().as_secs_f64();
            if predicted_saving(&self.state.film, judgement, &wanted, rung) < LEAST_SAVING {
                return Ok(some(uniform_plan(&self.state.film, doubled)));
            }
            let plan = adaptive_plan(&self.state.film, judgement, &wanted, max_samples);
            if !plan.blocks.is_empty() {
                return Ok(Some(plan));
            }
            // Each pixel by itself has what it needs, yet its surroundings show.
            let predicted = judgement.predicted.values();
            return Ok(some(doubling_of(&self.state.film, max_samples, |i| f64::from(predicted[i]) > rung)));
        }
        if let Some(plan) = some(self.peaks(rung, judgement)) {
            return Ok(Some(plan));
        }
        Ok(self.audited(rung, judgement)?.and_then(some))
    }

    /// More samples for single pixels that stand out of what the halves show, which pooling hides.
    fn peaks(&self, rung: f64, judgement: &Judgement) -> SamplePlan {
        let amplitude = &judgement.measured_error().amplitude;
        let limit = TOLERATED_PEAK * rung;
        doubling_of(&self.state.film, self.settings.limits.max_samples, |i| f64::from(amplitude.values()[i]) > limit)
    }

    /// Audits a rung that is reached. Where the variance proves too low it is raised from here on, and the plan for it is
    /// returned.
    fn audited(&mut self, rung: f64, judgement: &mut Judgement) -> Result<Option<SamplePlan>, JudgeError> {
        let is_raw = judgement.denoised.is_none();
        let may_audit = rung <= HIGHEST_AUDITED_RUNG && judgement.pixel_thresholds.is_none() && is_raw;
        if !may_audit || self.state.inflation >= MOST_INFLATION {
            return Ok(None);
        }
        let found = audit(self.tracer, &self.state.film, judgement, self.settings, self.state.audits);
        self.state.audits += 1;
        self.state.audit = found.or(self.state.audit);
        let Some(found) = found.filter(Audit::disagrees) else { return Ok(None) };
        self.state.inflation = (self.state.inflation * found.ratio).min(MOST_INFLATION);
        *judgement = self.look()?;
        self.plan_towards(rung, judgement)
    }

    /// The exposure that rules without sight are told: measured anew at each doubling of the samples.
    fn exposure(&mut self, judgement: &Judgement) -> f64 {
        if !self.exposure_holds() {
            let samples = self.state.film.total_samples();
            let scene_unit_over_white = scene_unit_over_white(judgement, self.settings);
            self.state.exposure = Some(Exposure { samples, scene_unit_over_white });
        }
        self.state.exposure.map_or(1.0, |exposure| exposure.scene_unit_over_white)
    }

    /// Whether a rule that does not see needs no look now, as after most of its many small steps.
    fn exposure_holds(&self) -> bool {
        let samples = self.state.film.total_samples();
        self.state.exposure.is_some_and(|exposure| samples < 2 * exposure.samples)
    }
}

/// The first blocks of at most so many samples in all, at least one.
pub(crate) fn beginning(blocks: &[BlockWork], most_samples: u64) -> &[BlockWork] {
    let mut samples = 0;
    let within = |block: &&BlockWork| {
        samples += u64::from(block.samples);
        samples <= most_samples
    };
    let count = if most_samples == u64::MAX { blocks.len() } else { blocks.iter().take_while(within).count() };
    &blocks[..count.max(1).min(blocks.len())]
}

/// Share of display white that one scene unit makes near black: the exposure that other renderers are told.
fn scene_unit_over_white(judgement: &Judgement, settings: &LoopSettings) -> f64 {
    const DIM_CD_M2: f32 = 0.1;
    f64::from(judgement.tone.relative_luminance(DIM_CD_M2) / DIM_CD_M2) * settings.nits_per_unit
}

fn progress(render: &Loop<'_>, judgement: &Judgement, step: &Step) -> Progress {
    let Loop { state: RenderState { film, passes, .. }, settings, rungs, .. } = render;
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
        pass: *passes,
        seconds: render.seconds(),
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
