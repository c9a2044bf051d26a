//! What comes after a look: the ladder's rungs, one after the other, and on each of them more samples until it is
//! reached, no pixel stands out, and an audit agrees.

use super::audit::{Audit, MAX_INFLATION, audit, audit_unproven};
use super::forecast::Forecast;
use super::gain::{cut, most_worthwhile, while_far};
use super::judge::{JudgeError, Judgement, LookFor, check_cancelled, judge_raw};
use super::leftover::of_what_shows;
use super::plan::{
    SAMPLES_OF_A_RAW_LOOK, adaptive_plan, doubling_of, even_plan, plan_up_to, uniform_plan, wanted_samples,
};
use super::rivals::{rival_plan, rival_stop};
use super::settings::{LoopSettings, RivalRule, Sampling, THRESHOLD};
use super::small_things::samples_to_meet;
use super::state::Exposure;
use super::stop::{MIN_SAVING, predicted_saving};
use super::until_look::UntilLook;
use super::{Loop, Step, StopReason, is_reached};
use crate::integrator::SamplePlan;
use std::time::Instant;

/// No single pixel's measured amplitude may stay above this many times the target.
const TOLERATED_PEAK: f64 = 4.0;
/// Rungs above this are not audited, nor searched for pixels that stand out: their few samples say little, and
/// the next rung asks again.
const HIGHEST_AUDITED_RUNG: f64 = 4.0;

/// A rung at threshold or below is far where it needs so many times the samples that are there, which are twice as many
/// at most after the next plan.
const FAR: f64 = 3.0;
/// Share of the picture where it may be nearer.
const ELSEWHERE: f64 = 0.1;

/// What an audit makes of a rung that is reached.
enum AuditOutcome {
    /// It is.
    Holds,
    /// The variance was too low: what is seen by one that is raised from here on.
    Stricter(Box<Judgement>),
}

impl Loop<'_> {
    /// Decides what comes next, leaving rungs of the ladder that are reached. An audit may make `judgement` stricter.
    pub(super) fn next_step(&mut self, judgement: &mut Judgement) -> Result<Step, JudgeError> {
        let left = self.left_of_budget();
        match self.settings.sampling {
            _ if left == 0 => Ok(Step::Stop(self.reason_of_a_spent_budget(judgement))),
            Sampling::Rival(rule) => Ok(self.rival_step(rule, judgement, left)),
            Sampling::Adaptive | Sampling::Uniform => self.ladder_step(judgement, left),
        }
    }

    /// The last sample may have reached what was asked for.
    fn reason_of_a_spent_budget(&self, judgement: &Judgement) -> StopReason {
        let LoopSettings { sampling, limits, .. } = self.settings;
        let is_there = sampling.is_by_sight() && is_reached(judgement, limits.last_rung());
        if is_there { StopReason::Visibility } else { StopReason::Samples }
    }

    /// What another renderer's rule does next, with so many samples left of the budget.
    fn rival_step(&mut self, rule: RivalRule, judgement: &Judgement, left: u64) -> Step {
        let exposure = self.exposure(judgement);
        let plan = rival_plan(rule, &self.state.film, exposure, left, self.settings.limits.max_samples);
        if plan.blocks.is_empty() {
            Step::Stop(rival_stop(rule, &self.state.film, exposure, left))
        } else {
            Step::Trace(plan)
        }
    }

    /// More samples for the first rung that is not reached, within the budget; without any, why the render ends.
    fn ladder_step(&mut self, judgement: &mut Judgement, left: u64) -> Result<Step, JudgeError> {
        // Less than a sample a pixel is as good as spent.
        let pixels = self.state.film.pixel_count() as u64;
        let mut is_spent = left < pixels;
        let target = self.settings.limits.last_rung();
        if self.rungs.is_empty() && !is_reached(judgement, target) {
            // A film that came to the end of its ladder, and does not look like it.
            self.rungs.push_back(target);
        }
        while let Some(&rung) = self.rungs.front() {
            if let Some(plan) = self.plan_towards(rung, judgement, left)? {
                if let Some(plan) = cut(plan, &self.state.film, judgement, left).non_empty() {
                    return Ok(Step::Trace(plan));
                }
                is_spent = true;
            }
            self.rungs.pop_front();
            self.state.left_rung = Some(rung);
            if is_reached(judgement, rung) {
                self.state.finished_rung = Some(rung);
            }
        }
        Ok(Step::Stop(if is_reached(judgement, target) {
            StopReason::Visibility
        } else if is_spent {
            StopReason::Samples
        } else {
            StopReason::MaxSamples
        }))
    }

    /// Queues a plan that takes no look, where there is one; false when it is time for a look.
    pub(super) fn plans_without_a_look(&mut self) -> Result<bool, JudgeError> {
        let left = self.left_of_budget();
        let plan = match self.plan_before_a_look(left) {
            Some(plan) => Some(plan),
            None => self.plan_between_looks(left)?,
        };
        Ok(plan.map(|plan| self.queue(plan)).is_some())
    }

    /// Samples for lamps that are known to be there, and what is left of a budget where that is hardly more than a look
    /// costs.
    fn plan_before_a_look(&self, left: u64) -> Option<SamplePlan> {
        self.plan_to_meet_lamps(left).or_else(|| {
            let even = || even_plan(&self.state.film, left, self.settings.limits.max_samples);
            self.has_little_left_after_its_first_samples(left).then(even)
        })
    }

    /// Samples by raw noise alone, between two looks at a picture that is denoised.
    fn plan_between_looks(&mut self, left: u64) -> Result<Option<SamplePlan>, JudgeError> {
        if self.settings.denoiser.is_none() || !self.settings.sampling.is_by_sight() || left == 0 {
            return Ok(None);
        }
        let started = Instant::now();
        let (film, doubled) = (&self.state.film, self.doubled());
        let rung = self.rungs.front().copied().unwrap_or(self.settings.limits.last_rung());
        let until_look = self.state.until_look.get_or_insert_with(|| UntilLook::first(film));
        let may_look = until_look.may_look(film);
        let plan = if self.settings.sampling == Sampling::Uniform {
            if may_look { SamplePlan::default() } else { uniform_plan(film, doubled) }
        } else {
            let raw = judge_raw(film, self.settings)?;
            if may_look && until_look.must_look(film, &raw, rung) {
                SamplePlan::default()
            } else {
                cut(until_look.plan(film, &raw, self.settings.limits.max_samples, left), film, &raw, left)
            }
        };
        self.state.seconds.perception += started.elapsed().as_secs_f64();
        Ok(plan.non_empty())
    }

    /// Samples that pixels should have to meet lamps smaller than they, for adaptive sampling.
    fn samples_to_meet_lamps(&self) -> Option<&[u32]> {
        if self.settings.sampling != Sampling::Adaptive {
            return None;
        }
        let of_lamps = || {
            let shares: Vec<f32> = self.state.film.known_things.as_ref()?.urgent_shares().collect();
            samples_to_meet(&shares, &self.settings.limits)
        };
        self.samples_to_meet_lamps.get_or_init(of_lamps).as_deref()
    }

    fn plan_to_meet_lamps(&self, left: u64) -> Option<SamplePlan> {
        let wanted = self.samples_to_meet_lamps()?;
        plan_up_to(&self.state.film, |pixel| wanted[pixel]).non_empty().filter(|plan| plan.samples() <= left)
    }

    /// Samples before the first look: the pilot's, and those for lamps smaller than a pixel.
    fn first_samples(&self) -> u64 {
        let pilot = u64::from(self.settings.limits.pilot());
        match self.samples_to_meet_lamps() {
            Some(wanted) => wanted.iter().map(|&wanted| u64::from(wanted).max(pilot)).sum(),
            None => pilot * self.state.film.pixel_count() as u64,
        }
    }

    /// Whether a raw picture on the way to threshold has its first samples and no more, and the budget so little left
    /// that a look would cost more than knowing where it goes is worth: that is a few per cent of it. Nor would it be
    /// right: what a look gives to pixels that have met no light of a lamp beside them makes stars too bright, by
    /// 13 % at 24 samples a pixel.
    fn has_little_left_after_its_first_samples(&self, left: u64) -> bool {
        const WORTH_A_LOOK: f64 = 4.0 * SAMPLES_OF_A_RAW_LOOK;
        let (film, limits) = (&self.state.film, &self.settings.limits);
        let pixels = film.pixel_count() as u64;
        self.settings.denoiser.is_none()
            && self.settings.sampling.is_by_sight()
            && left > 0
            && left as f64 <= WORTH_A_LOOK * pixels as f64
            && film.total_samples() == self.first_samples()
            && film.total_samples() + left <= u64::from(limits.max_samples) * pixels
            && self.rungs.front().is_some_and(|&rung| rung <= THRESHOLD)
    }

    /// Samples of each pixel after the next plan of uniform sampling.
    fn doubled(&self) -> u32 {
        let (film, limits) = (&self.state.film, &self.settings.limits);
        let most = limits.mean_samples.unwrap_or(limits.max_samples).min(limits.max_samples);
        let pixels = film.pixel_count() as u64;
        (2 * (film.total_samples() / pixels) as u32).max(limits.pilot()).min(most)
    }

    /// More samples for a rung; `None` when it is reached or no pixel may have more. `left`: of the budget. An audit
    /// may make `judgement` stricter.
    fn plan_towards(
        &mut self,
        rung: f64,
        judgement: &mut Judgement,
        left: u64,
    ) -> Result<Option<SamplePlan>, JudgeError> {
        loop {
            if !is_reached(judgement, rung) {
                check_cancelled(self.settings)?;
                return Ok(self.unreached(rung, judgement, left)?.non_empty());
            }
            if self.settings.sampling == Sampling::Uniform || rung > HIGHEST_AUDITED_RUNG {
                return Ok(None);
            }
            check_cancelled(self.settings)?;
            if let Some(plan) = self.peaks(rung, judgement).non_empty() {
                return Ok(Some(plan));
            }
            match self.audited(rung, judgement)? {
                AuditOutcome::Holds => return Ok(None),
                AuditOutcome::Stricter(stricter) => *judgement = *stricter,
            }
        }
    }

    /// More samples for a rung that is not reached.
    fn unreached(&mut self, rung: f64, judgement: &Judgement, left: u64) -> Result<SamplePlan, JudgeError> {
        let (film, max_samples) = (&self.state.film, self.settings.limits.max_samples);
        let until_look = judgement.denoised.is_some().then(|| UntilLook::after(film, judgement, rung));
        let plan = match (&until_look, self.settings.sampling) {
            (_, Sampling::Uniform) => uniform_plan(film, self.doubled()),
            (Some(until_look), _) => until_look.plan(film, judgement, max_samples, left),
            (None, _) => {
                self.cheapest(rung, judgement)?.unwrap_or_else(|| uniform_plan(&self.state.film, self.doubled()))
            }
        };
        self.state.until_look = until_look;
        Ok(plan)
    }

    /// What the cheapest counts that reach a rung add to those that are there; `None` where even counts cost hardly
    /// more.
    fn cheapest(&mut self, rung: f64, judgement: &Judgement) -> Result<Option<SamplePlan>, JudgeError> {
        let limits = &self.settings.limits;
        let film = &self.state.film;
        if rung <= THRESHOLD && is_far(judgement, rung) {
            return Ok(while_far(film, judgement, rung, limits.max_samples));
        }
        let started = Instant::now();
        let forecast = Forecast::of(film, judgement);
        let wanted = wanted_samples(judgement, &forecast, self.settings.allocation, rung, limits)?;
        self.state.seconds.allocation += started.elapsed().as_secs_f64();
        if predicted_saving(film, judgement, &wanted.samples, rung) < MIN_SAVING {
            return Ok(None);
        }
        let plan = adaptive_plan(film, judgement, &forecast, &wanted, limits.max_samples);
        if !plan.blocks.is_empty() {
            return Ok(Some(if rung > THRESHOLD { plan } else { most_worthwhile(plan, film, judgement) }));
        }
        // Each pixel by itself has what it needs, yet its surroundings show.
        let predicted = judgement.predicted.values();
        Ok(Some(match judgement.thresholds.per_pixel {
            None => of_what_shows(film, judgement, &forecast, rung, limits.max_samples),
            // Such a model pools nothing: what shows is the pixel's own.
            Some(_) => doubling_of(film, limits.max_samples, |i| f64::from(predicted[i]) / rung),
        }))
    }

    /// More samples for single pixels that stand out of what the halves show, which pooling hides.
    fn peaks(&self, rung: f64, judgement: &Judgement) -> SamplePlan {
        let amplitude = &judgement.measured_error().amplitude;
        let limit = TOLERATED_PEAK * rung;
        doubling_of(&self.state.film, self.settings.limits.max_samples, |i| f64::from(amplitude.values()[i]) / limit)
    }

    /// Audits a rung that is reached, as long as the variance may still be raised.
    fn audited(&mut self, rung: f64, judgement: &Judgement) -> Result<AuditOutcome, JudgeError> {
        if judgement.thresholds.per_pixel.is_some() || self.state.inflation >= MAX_INFLATION {
            return Ok(AuditOutcome::Holds);
        }
        let (film, round) = (&self.state.film, self.state.audits);
        let found = match judgement.denoised {
            None => audit(self.tracer, film, judgement, self.settings, round)?,
            Some(_) => audit_unproven(self.tracer, film, judgement, self.settings, rung, round)?,
        };
        self.state.audits += 1;
        self.state.audit = found.or(self.state.audit);
        let Some(found) = found.filter(Audit::disagrees) else { return Ok(AuditOutcome::Holds) };
        self.state.inflation = (self.state.inflation * found.ratio).min(MAX_INFLATION);
        Ok(AuditOutcome::Stricter(Box::new(self.look(LookFor::Plan)?)))
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
    pub(super) fn exposure_holds(&self) -> bool {
        let samples = self.state.film.total_samples();
        self.state.exposure.is_some_and(|exposure| samples < 2 * exposure.samples)
    }
}

/// Whether a rung needs, nearly everywhere, so much more than is there that the next plan does not depend on where the
/// way ends.
fn is_far(judgement: &Judgement, rung: f64) -> bool {
    judgement.predicted.quantile(ELSEWHERE).powi(2) > FAR * rung * rung
}

/// Share of display white that one scene unit makes near black: the exposure that other renderers are told.
fn scene_unit_over_white(judgement: &Judgement, settings: &LoopSettings) -> f64 {
    const DIM_CD_M2: f32 = 0.1;
    f64::from(judgement.tone.relative_luminance(DIM_CD_M2) / DIM_CD_M2) * settings.nits_per_unit
}
