//! The loop: trace, look, plan, until nothing more can be seen.
//!
//! The loop itself is `Loop::run_to_end`; [`render`], [`resume`] and [`run`] lead to it. In turn it
//!
//! 1. traces what is planned (`trace_pending`): at first a pilot of some samples in every pixel;
//! 2. looks at the film as an eye in front of the display would ([`mod@judge`]): thresholds, and how visible the
//!    noise is;
//! 3. decides by that look (`next_step`) whether the rung of the ladder that it is on is reached, audits it by fresh
//!    samples, and goes on to the next;
//! 4. or plans more samples ([`plan`]): the cheapest counts that reach the rung;
//! 5. ends when the last rung is reached, when a limit is, or when no pixel may have more.
//!
//! The ladder of visibilities is fixed, so that a render is the beginning of any that goes on from it on the same
//! ladder: one above threshold, one from there down.
//!
//! | file | answers |
//! | --- | --- |
//! | `settings`, `limits`, `stop` | what is asked for, what ends a render, why it ended |
//! | `state`, `outcome` | what a checkpoint holds, and what comes out |
//! | `judge`, `statistics` | what is seen, by what variance |
//! | `confidence` | how sure that is, over all looks |
//! | `next` | what comes after a look |
//! | `plan`, `forecast` | which pixels get how many samples, and what they will leave to be seen |
//! | `gain` | which of these samples come first, on the way to threshold |
//! | `leftover` | whose noise it is that still shows where every pixel has what it needs |
//! | `audit` | whether the picture is as noisy as it is told to be |
//! | `missed`, `small_things` | what no sample has met: rims of lamps, things smaller than a pixel |
//! | `denoised`, `until_look` | the same of a picture that is denoised, and what it gets between two looks |
//! | `pursuit` | eyes that follow what moves |
//! | `rivals` | other renderers' rules |
//! | `glimpse` | how light a view is before it is rendered |
//! | `monitor`, `progress` | what is told meanwhile |
//! | `awake` | threads that do not fall asleep during a look |
//!
//! Nothing here traces a ray or knows a formula of vision: the first is the [`crate::integrator`]'s, the second the
//! perception crate's.

pub mod audit;
mod awake;
mod confidence;
pub mod denoised;
mod forecast;
mod gain;
pub mod glimpse;
pub mod judge;
mod leftover;
mod limits;
mod missed;
mod monitor;
mod next;
mod outcome;
pub mod plan;
mod progress;
pub mod pursuit;
pub mod rivals;
pub mod settings;
mod small_things;
pub mod state;
pub mod statistics;
mod stop;
#[cfg(test)]
mod test_films;
mod until_look;

pub use monitor::{Directive, Monitor, Progress, Quiet};
pub use outcome::{Ended, LastLook, Next, Rendered};
pub use stop::{StopReason, TOLERATED_SHARE, is_reached, visible_share};

use crate::integrator::{BlockWork, Crop, PathTracer, SamplePlan};
use awake::with_threads_awake;
use confidence::{factor_of_bound, standard_errors};
use judge::{JudgeError, Judgement, LookFor, judge_for};
use plan::slices;
use progress::progress;
use settings::LoopSettings;
use state::{RenderState, Seconds};
use std::cell::OnceCell;
use std::collections::VecDeque;
use std::time::Instant;
use until_look::UntilLook;

/// What a look saw, and what comes of it.
struct Decision {
    judgement: Judgement,
    step: Step,
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
    looked: Option<LookTaken>,
    /// [`small_things::samples_to_meet`] lamps smaller than a pixel, once it was asked for.
    samples_to_meet_lamps: OnceCell<Option<Vec<u32>>>,
}

/// Looks at a render as it is, with what audits and earlier looks make of that.
fn look_at(state: &RenderState, settings: &LoopSettings, look_for: LookFor) -> Result<Judgement, JudgeError> {
    let mut judgement = judge_for(look_for, &state.film, settings, state.inflation)?;
    if let Some(confidence) = settings.limits.confidence {
        let standard_errors = standard_errors(confidence, state.looks);
        if let Some(factor) = factor_of_bound(&judgement, state, settings, standard_errors)? {
            judgement.raise(factor);
        }
    }
    Ok(judgement)
}

/// What is seen of a render that rests, as its next look would see it.
///
/// # Errors
/// As [`judge::judge`].
pub fn look_at_rest(state: &RenderState, settings: &LoopSettings) -> Result<Judgement, JudgeError> {
    look_at(state, settings, LookFor::Report)
}

/// The last look of this run.
#[derive(Clone, Copy, Debug)]
struct LookTaken {
    at_samples: u64,
    seconds: f64,
}

/// Renders until a limit is reached.
///
/// # Errors
/// If the denoiser fails, or the perception model refuses the picture, which would be a defect of ours; and
/// [`JudgeError::Cancelled`] where [`LoopSettings::is_cancelled`] ends the last look.
pub fn render(tracer: &PathTracer, settings: &LoopSettings, monitor: &dyn Monitor) -> Result<Rendered, JudgeError> {
    let Crop { width, height, .. } = tracer.settings().film_area();
    resume(tracer, settings, RenderState::new(width, height, &settings.limits), monitor)
}

/// Goes on with a render of the same scene, size and seed until a limit is reached. Limits count from the first start.
///
/// # Errors
/// As of [`render`].
pub fn resume(
    tracer: &PathTracer,
    settings: &LoopSettings,
    state: RenderState,
    monitor: &dyn Monitor,
) -> Result<Rendered, JudgeError> {
    let Ended { mut state, last_look } = run(tracer, settings, state, monitor)?;
    let LastLook { judgement, stop_reason } = match last_look {
        Some(last_look) => last_look,
        None => {
            let judgement = look_at(&state, settings, LookFor::Report).inspect_err(|_| monitor.failed(&state))?;
            let Judgement { seconds, seconds_denoising: denoising, .. } = judgement;
            state.seconds += Seconds { total: seconds, perception: seconds, allocation: 0.0, denoising };
            LastLook { judgement, stop_reason: StopReason::Interrupted }
        }
    };
    Ok(Rendered::new(state, judgement, stop_reason))
}

/// [`resume`] for somebody who may leave the render with [`Directive::Leave`], or in the middle of a look by
/// [`LoopSettings::is_cancelled`], and go on from its state.
///
/// # Errors
/// If the denoiser fails, or the perception model refuses the picture, which would be a defect of ours.
pub fn run(
    tracer: &PathTracer,
    settings: &LoopSettings,
    state: RenderState,
    monitor: &dyn Monitor,
) -> Result<Ended, JudgeError> {
    let mut render = Loop::new(tracer, settings, state);
    match render.run_to_end(monitor) {
        Ok(Some(LastLook { judgement, stop_reason })) => Ok(render.end(judgement, stop_reason, monitor)),
        Ok(None) | Err(JudgeError::Cancelled) => Ok(Ended { state: render.state, last_look: None }),
        Err(error) => {
            monitor.failed(&render.state);
            Err(error)
        }
    }
}

/// One look of [`run`]'s loop at a state all of whose plans are traced, for somebody who traces elsewhere and has the
/// state's file. Limits of time and plans are not looked at.
///
/// # Errors
/// As of [`render`].
pub fn decide(
    tracer: &PathTracer,
    settings: &LoopSettings,
    state: RenderState,
    monitor: &dyn Monitor,
) -> Result<Next, JudgeError> {
    let mut render = Loop::new(tracer, settings, state);
    if !render.plans_without_a_look()? {
        let look = Instant::now();
        let mut judgement = render.look(LookFor::Plan)?;
        let step = render.next_step(&mut judgement)?;
        if let Some(reason) = render.apply(step, &judgement, look, monitor) {
            let judgement = render.last_judgement(judgement)?;
            return Ok(Next::Ended(Box::new(render.end(judgement, reason, monitor))));
        }
    }
    render.state.seconds.total = render.seconds();
    Ok(Next::Planned(Box::new(render.state)))
}

impl<'a> Loop<'a> {
    fn new(tracer: &'a PathTracer, settings: &'a LoopSettings, state: RenderState) -> Self {
        let resumed_at = Instant::now();
        let is_below = |rung: f64, bound: Option<f64>| bound.is_none_or(|bound| rung < bound);
        let is_left = |&rung: &f64| is_below(rung, state.finished_rung) && is_below(rung, state.left_rung);
        let rungs = settings.rungs().into_iter().filter(is_left).collect();
        let seconds_before = state.seconds.total;
        let mut state = state.kept_to(&settings.limits);
        if state.film.known_things.is_none() {
            state.film.known_things = tracer.known_things();
        }
        Self {
            tracer,
            settings,
            rungs,
            state,
            resumed_at,
            seconds_before,
            looked: None,
            samples_to_meet_lamps: OnceCell::new(),
        }
    }

    /// Traces, looks and plans in turn; `None` if the monitor leaves the render.
    fn run_to_end(&mut self, monitor: &dyn Monitor) -> Result<Option<LastLook>, JudgeError> {
        let mut last_look: Option<Judgement> = None;
        loop {
            let ended = match self.trace_pending(monitor) {
                Traced::Everything => None,
                Traced::UntilLimit(reason) => Some(reason),
                Traced::UntilLeft => return Ok(None),
            };
            if ended.is_none() && self.plans_without_a_look()? {
                continue;
            }
            let look = Instant::now();
            let earlier = last_look.take();
            let Decision { judgement, step } = with_threads_awake(|| self.look_and_decide(earlier, ended))?;
            match self.apply(step, &judgement, look, monitor) {
                None => last_look = Some(judgement),
                Some(stop_reason) => {
                    return Ok(Some(LastLook { judgement: self.last_judgement(judgement)?, stop_reason }));
                }
            }
        }
    }

    /// Tells what was seen and enters the plan that came of it, or says why there is none.
    fn apply(&mut self, step: Step, judgement: &Judgement, look: Instant, monitor: &dyn Monitor) -> Option<StopReason> {
        self.state.seconds.perception += look.elapsed().as_secs_f64();
        monitor.looked(&progress(self, judgement, &step));
        monitor.judged(&self.state, judgement);
        match step {
            Step::Trace(plan) => {
                self.queue(plan);
                self.state.looks += 1;
                self.state.tone = Some(judgement.tone.save());
                None
            }
            Step::Stop(reason) => Some(reason),
        }
    }

    fn queue(&mut self, plan: SamplePlan) {
        let film = &self.state.film;
        self.state.pending.extend(slices(plan, film.width(), film.total_samples()));
    }

    fn seconds(&self) -> f64 {
        self.seconds_before + self.resumed_at.elapsed().as_secs_f64()
    }

    /// Looks at the film, to plan more of it or at the end.
    fn look(&mut self, look_for: LookFor) -> Result<Judgement, JudgeError> {
        let started = Instant::now();
        let judgement = look_at(&self.state, self.settings, look_for)?;
        self.state.seconds.denoising += judgement.seconds_denoising;
        let at_samples = self.state.film.total_samples();
        self.looked = Some(LookTaken { at_samples, seconds: started.elapsed().as_secs_f64() });
        Ok(judgement)
    }

    /// What is seen, or was at an earlier look that still holds, and what comes of it.
    fn look_and_decide(
        &mut self,
        earlier: Option<Judgement>,
        ended: Option<StopReason>,
    ) -> Result<Decision, JudgeError> {
        let mut judgement = match earlier {
            Some(earlier) if self.is_looked_at() || ended.is_none() && self.exposure_holds() => earlier,
            _ if ended.is_some() => self.look(LookFor::Report)?,
            _ => self.look(LookFor::Plan)?,
        };
        let step = match ended {
            Some(reason) => Step::Stop(reason),
            None => self.next_step(&mut judgement)?,
        };
        Ok(Decision { judgement, step })
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
                self.state.seconds.total = self.seconds();
                match monitor.between_batches(&self.state) {
                    Directive::GoOn => {}
                    Directive::Stop => return Traced::UntilLimit(StopReason::Interrupted),
                    Directive::Leave => return Traced::UntilLeft,
                }
            }
            self.state.close_plan();
        }
    }

    /// Whether nothing was traced since the last look.
    fn is_looked_at(&self) -> bool {
        self.looked.is_some_and(|looked| looked.at_samples == self.state.film.total_samples())
    }

    /// Looks once more where the rule did not need to.
    fn last_judgement(&mut self, judgement: Judgement) -> Result<Judgement, JudgeError> {
        if self.settings.sampling.is_by_sight() || self.is_looked_at() {
            return Ok(judgement);
        }
        let last = self.look(LookFor::Report)?;
        self.state.seconds.perception += last.seconds;
        Ok(last)
    }

    /// Tells the last state.
    fn end(mut self, judgement: Judgement, reason: StopReason, monitor: &dyn Monitor) -> Ended {
        self.state.seconds.total = self.seconds();
        self.state.tone = Some(judgement.tone.save());
        // With other limits they may be reached.
        self.state.left_rung = None;
        let is_by_a_look = matches!(reason, StopReason::Visibility | StopReason::MaxSamples);
        if is_by_a_look && self.state.until_look.is_some() {
            self.state.until_look = Some(UntilLook::at_once(&self.state.film));
        }
        monitor.ended(&self.state, reason);
        Ended { state: self.state, last_look: Some(LastLook { judgement, stop_reason: reason }) }
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
