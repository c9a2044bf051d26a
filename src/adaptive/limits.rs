//! Limits that do not ask what the picture looks like: time, plans and the budget of samples.

use super::state::RenderState;
use super::until_look::samples_of_a_look;
use super::{Loop, StopReason};
use crate::integrator::SamplePlan;

impl Loop<'_> {
    /// Limits that do not depend on the picture: a render ends at the boundary between plans from which it is done,
    /// with a last look, nearest to its limit of time. The pilot is always traced.
    pub(super) fn limit_reached(&self) -> Option<StopReason> {
        let RenderState { film, pending, plans, .. } = &self.state;
        if *plans == 0 {
            return None;
        }
        let traced = film.total_samples().max(1);
        let elapsed = self.seconds();
        let seconds_per_sample = (elapsed - self.state.seconds.perception).max(0.0) / traced as f64;
        let next = pending.front().map_or(0, SamplePlan::samples) as f64 * seconds_per_sample;
        let look = self.looked.map_or_else(|| self.expected_look(seconds_per_sample), |looked| looked.seconds);
        let done_now = elapsed + if self.is_looked_at() { 0.0 } else { look };
        let done_after_next = elapsed + next + look;
        let limits = &self.settings.limits;
        if limits.time.is_some_and(|limit| 0.5 * (done_now + done_after_next) >= limit.as_secs_f64()) {
            Some(StopReason::Time)
        } else if limits.plans.is_some_and(|limit| *plans >= limit) {
            Some(StopReason::Plans)
        } else {
            None
        }
    }

    /// Seconds of the first look: next to none at a raw picture.
    fn expected_look(&self, seconds_per_sample: f64) -> f64 {
        let pixels = self.state.film.pixel_count() as f64;
        let samples = self.settings.denoiser.as_ref().map_or(0.0, samples_of_a_look);
        samples * pixels * seconds_per_sample
    }

    /// Samples that the budget has left, of all pixels; none where it is too little to look for: a cut that ends within
    /// a block of samples leaves a few.
    pub(super) fn left_of_budget(&self) -> u64 {
        /// One sample for so many pixels.
        const PIXELS_WORTH_A_LOOK: u64 = 16;
        let film = &self.state.film;
        let pixels = film.pixel_count() as u64;
        let budget = self.settings.limits.mean_samples.map(|mean| u64::from(mean) * pixels);
        let left = budget.map_or(u64::MAX, |budget| budget.saturating_sub(film.total_samples()));
        if left < pixels / PIXELS_WORTH_A_LOOK { 0 } else { left }
    }
}
