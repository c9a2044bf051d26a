//! A budget of seconds for all frames that a command renders, and how long those to come will take.
//!
//! Each frame ends between plans, as a still by `--time` does, so what is rendered depends on the machine.

use super::Shot;
use super::shot::FrameOutcome;
use anyhow::Result;
use fechner::adaptive::settings::Sampling;
use fechner::animate::track::Track;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// What is left of the time, and who needs how much of it.
pub(super) struct ShotClock {
    started: Instant,
    budget: Duration,
    needs: Vec<FrameNeed>,
}

/// What a frame that is to be rendered needs, in any unit.
#[derive(Clone, Copy, Debug)]
struct FrameNeed {
    frame: u32,
    need: f64,
}

impl ShotClock {
    /// Takes a budget that began with the track, for the frames that are not there yet; `None` where all are. Pilots
    /// say what they need for the visibility that fits the time; uniform sampling needs the same of each.
    pub(super) fn new(shot: &Shot<'_>, track: &Track, started: Instant, budget: Duration) -> Result<Option<Self>> {
        let missing = shot.missing_frames(track)?;
        if missing.is_empty() {
            return Ok(None);
        }
        let needs: Vec<FrameNeed> = match shot.settings.sampling {
            Sampling::Uniform => missing.into_iter().map(|frame| FrameNeed { frame, need: 1.0 }).collect(),
            _ => {
                let needs = shot.needs(track)?;
                let pixels = f64::from(shot.settings.trace.width) * f64::from(shot.settings.trace.height);
                let left = budget.saturating_sub(started.elapsed()).as_secs_f64();
                let seconds_per_sample = needs.seconds_per_sample * pixels * missing.len() as f64;
                let mean_samples = left / seconds_per_sample.max(f64::MIN_POSITIVE);
                let of_shot = needs.for_budget(mean_samples, shot.settings.limits.last_rung());
                let need_of = |frame: u32| FrameNeed { frame, need: of_shot[(frame - shot.settings.first) as usize] };
                missing.into_iter().map(need_of).collect()
            }
        };
        Ok(Some(Self { started, budget, needs }))
    }

    /// What is left.
    pub(super) fn left(&self) -> Duration {
        self.budget.saturating_sub(self.started.elapsed())
    }

    /// The time for a frame: its part of what is left, if all those before it are done; none for a frame that is there.
    pub(super) fn share(&self, frame: u32) -> Duration {
        self.left().mul_f64(part_of(&self.needs, frame))
    }
}

/// A frame's part of what it and the frames after it need.
fn part_of(needs: &[FrameNeed], frame: u32) -> f64 {
    let to_come = &needs[needs.partition_point(|need| need.frame < frame)..];
    match to_come.first() {
        Some(first) if first.frame == frame => {
            let all: f64 = to_come.iter().map(|need| need.need).sum();
            if all > 0.0 { first.need / all } else { 1.0 / to_come.len() as f64 }
        }
        _ => 0.0,
    }
}

/// How long frames have taken.
#[derive(Debug)]
pub(super) struct FrameTimes {
    /// Whether each of the frames to come has a record.
    to_come: VecDeque<bool>,
    rendered: u32,
    seconds: f64,
    /// Whether frames with a record were out of date.
    any_outdated: bool,
}

impl FrameTimes {
    /// Times of frames of which it is known whether they have a record. Those that have will be kept, unless one before
    /// was out of date: whether they are takes reading their scenes.
    pub(super) fn new(have_record: impl Iterator<Item = bool>) -> Self {
        Self { to_come: have_record.collect(), rendered: 0, seconds: 0.0, any_outdated: false }
    }

    /// The next frame is done.
    pub(super) fn add(&mut self, made: FrameOutcome, took: Duration) {
        self.to_come.pop_front();
        if made != FrameOutcome::Kept {
            self.rendered += 1;
            self.seconds += took.as_secs_f64();
        }
        self.any_outdated |= made == FrameOutcome::Anew;
    }

    /// Seconds that the frames to come are expected to take.
    pub(super) fn seconds_left(&self) -> f64 {
        let is_made = |has_record: &&bool| self.any_outdated || !**has_record;
        let count = self.to_come.iter().filter(is_made).count();
        count as f64 * self.seconds / f64::from(self.rendered.max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_will_be_kept_take_no_time() {
        let mut times = FrameTimes::new([true, false, true, true, false, true].into_iter());
        times.add(FrameOutcome::Kept, Duration::from_secs(100));
        times.add(FrameOutcome::New, Duration::from_secs(2));
        assert_eq!(times.seconds_left(), 2.0);
        times.add(FrameOutcome::Anew, Duration::from_secs(4));
        assert_eq!(times.seconds_left(), 9.0);
    }

    /// Of a shot of which every other frame is there, the others share all of the time.
    #[test]
    fn frames_that_are_there_take_no_time() {
        let needs: Vec<FrameNeed> =
            [(1, 1.0), (3, 1.0), (5, 2.0)].map(|(frame, need)| FrameNeed { frame, need }).to_vec();
        let mut left = 1.0;
        let mut taken = Vec::new();
        for frame in 0..7 {
            let share = left * part_of(&needs, frame);
            left -= share;
            taken.push(share);
        }
        assert_eq!(taken, [0.0, 0.25, 0.0, 0.25, 0.0, 0.5, 0.0]);
    }
}
