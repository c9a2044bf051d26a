//! A budget of seconds for all frames that a command renders.
//!
//! Each frame ends between plans, as a still by `--time` does, so what is rendered depends on the machine.

use super::Shot;
use anyhow::Result;
use fechner::animate::track::Track;
use std::time::{Duration, Instant};

/// What is left of the time, and who needs how much of it.
pub(super) struct ShotClock {
    started: Instant,
    budget: Duration,
    /// Number of the first frame that is rendered.
    first: u32,
    /// What each of the frames needs, in any unit.
    needs: Vec<f64>,
}

impl ShotClock {
    /// Starts with the pilots, which say what the frames need for the visibility that fits the time.
    pub(super) fn start(shot: &Shot<'_>, track: &Track, budget: Duration) -> Result<Self> {
        let started = Instant::now();
        let needs = shot.needs(track)?;
        let pixels = f64::from(shot.settings.trace.width) * f64::from(shot.settings.trace.height);
        let (first, last) = shot.rendered_frames();
        let frames = f64::from(last - first + 1);
        let mean_samples = budget.as_secs_f64() / (needs.seconds_per_sample * pixels * frames).max(f64::MIN_POSITIVE);
        let of_shot = needs.samples(needs.visibility_for(mean_samples));
        let offset = (first - shot.settings.first) as usize;
        let needs = of_shot[offset..=offset + (last - first) as usize].to_vec();
        Ok(Self { started, budget, first, needs })
    }

    /// The time for a frame: its part of what is left, if all those before it are done.
    pub(super) fn share(&mut self, frame: u32) -> Duration {
        let left = self.budget.saturating_sub(self.started.elapsed());
        let to_come = &self.needs[(frame - self.first) as usize..];
        left.mul_f64(to_come[0] / to_come.iter().sum::<f64>())
    }
}
