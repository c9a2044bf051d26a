//! A budget of samples for a whole shot, spent where most would be seen.
//!
//! Pilots of fixed seed, of frames spread over the shot, say how many samples a pixel a frame needs for a visibility. One
//! visibility for all frames fits the budget; what a frame needs for it is its share. Frames stay independent of each
//! other: they know their share from the track. Not for shots that only have a visibility to reach: their frames know by
//! themselves when they are done.

use super::track::Track;
use super::{SceneSource, ShotSettings};
use crate::adaptive::judge::{JudgeError, judge};
use crate::adaptive::plan::{needed_samples, pilot_plan};
use crate::adaptive::settings::Limits;
use crate::film::Film;
use crate::integrator::{PILOT_SAMPLES_A_PIXEL, PathTracer};
use crate::scene::load::LoadError;
use fechner_perception::tone::ToneOperator;
use std::time::Instant;

/// Most frames that are piloted; those between lie between their neighbours.
const PILOTED_FRAMES: u32 = 9;
/// Visibilities at which needs are asked; between them, and beyond, they go as a power.
const ASKED: [f64; 3] = [8.0, 2.0, 0.5];

/// Why a budget could not be spread.
#[derive(Debug, thiserror::Error)]
pub enum BudgetError {
    /// A scene could not be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A pilot could not be judged.
    #[error(transparent)]
    Judge(#[from] JudgeError),
}

/// What the frames of a shot need.
#[derive(Clone, Debug, PartialEq)]
pub struct Needs {
    /// Logarithms of mean samples a pixel at [`ASKED`], by frame.
    ln_samples: Vec<[f64; ASKED.len()]>,
    /// What a sample of the pilots took, seconds. Differs from run to run.
    pub seconds_per_sample: f64,
}

impl Needs {
    /// Pilots a shot; `operator` makes its tone operator, whose fits are the track's.
    ///
    /// # Errors
    /// For scenes that cannot be read, or if a denoiser fails.
    pub fn of(
        source: &dyn SceneSource,
        shot: &ShotSettings,
        operator: &dyn Fn() -> Box<dyn ToneOperator>,
        track: &Track,
    ) -> Result<Self, BudgetError> {
        let count = shot.last - shot.first + 1;
        let steps = count.clamp(2, PILOTED_FRAMES) - 1;
        let mut piloted: Vec<u32> = (0..=steps).map(|step| step * (count - 1) / steps).collect();
        piloted.dedup();
        let (mut seconds, mut samples) = (0.0, 0);
        let mut needs = Vec::new();
        for &offset in &piloted {
            let scene = source.at(shot.seconds(f64::from(shot.first + offset)))?;
            let settings = shot.frame_settings(operator(), &track.frames[offset as usize]);
            let tracer = PathTracer::new(scene, shot.trace);
            let area = tracer.settings().film_area();
            let mut film = Film::new(area.width, area.height);
            let started = Instant::now();
            tracer.trace(&pilot_plan(&film, PILOT_SAMPLES_A_PIXEL), &mut film, &|_| {});
            seconds += started.elapsed().as_secs_f64();
            samples += film.total_samples();
            let judgement = judge(&film, &settings, 1.0)?;
            let limits = Limits { pilot_samples: PILOT_SAMPLES_A_PIXEL, ..shot.limits };
            let mut ln_samples = [0.0; ASKED.len()];
            for (ln_samples, visibility) in ln_samples.iter_mut().zip(ASKED) {
                let needed = needed_samples(&film, &judgement, visibility, &limits);
                *ln_samples = needed.map_err(JudgeError::Perception)?.ln();
            }
            needs.push(ln_samples);
        }
        let between = |frame: u32| {
            let after = piloted.partition_point(|&offset| offset < frame);
            let (low, high) = (piloted[after.saturating_sub(1)], piloted[after]);
            let share = if high > low { f64::from(frame - low) / f64::from(high - low) } else { 0.0 };
            let (low, high) = (needs[after.saturating_sub(1)], needs[after]);
            std::array::from_fn(|asked| low[asked] + share * (high[asked] - low[asked]))
        };
        let seconds_per_sample = seconds / samples.max(1) as f64;
        Ok(Self { ln_samples: (0..count).map(between).collect(), seconds_per_sample })
    }

    /// Samples a pixel that each frame needs for a visibility: at least a pilot's.
    pub fn samples(&self, visibility: f64) -> Vec<f64> {
        let octaves = |at: usize, other: usize| (ASKED[at] / ASKED[other]).log2();
        self.ln_samples
            .iter()
            .map(|ln_samples| {
                let at = usize::from(visibility < ASKED[1]);
                let slope = (ln_samples[at + 1] - ln_samples[at]) / octaves(at, at + 1);
                let beyond = visibility < ASKED[2];
                // Beyond the last one the law of large numbers holds.
                let (from, slope) = if beyond { (2, 2.0 * std::f64::consts::LN_2) } else { (at, slope) };
                let ln = ln_samples[from] + slope * (ASKED[from] / visibility).log2();
                ln.exp().max(f64::from(PILOT_SAMPLES_A_PIXEL))
            })
            .collect()
    }

    /// The visibility that all frames reach with so many samples a pixel on average.
    pub fn visibility_for(&self, mean_samples: f64) -> f64 {
        let mean = |visibility: f64| self.samples(visibility).iter().sum::<f64>() / self.ln_samples.len() as f64;
        let (mut low, mut high) = (-16.0f64, 8.0f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if mean(middle.exp2()) > mean_samples { low = middle } else { high = middle }
        }
        high.exp2()
    }

    /// Whole samples a pixel for each frame, which add up to the budget of `mean_samples` for each.
    pub fn shares(&self, mean_samples: u32) -> Vec<u32> {
        let count = self.ln_samples.len();
        if mean_samples <= PILOT_SAMPLES_A_PIXEL {
            return vec![mean_samples; count];
        }
        let needs = self.samples(self.visibility_for(f64::from(mean_samples)));
        let scale = f64::from(mean_samples) * count as f64 / needs.iter().sum::<f64>();
        let mut given = 0.0;
        let mut spent = 0;
        needs
            .iter()
            .map(|need| {
                // What rounding left goes on to the next frame.
                given += need * scale;
                let share = (given.round() as u64).saturating_sub(spent).max(1);
                spent += share;
                share as u32
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames that need 1, 4 and 16 times a sample count that goes as 1/v².
    fn needs() -> Needs {
        let frame = |at_2: f64| ASKED.map(|visibility| (at_2 * 4.0 / visibility / visibility).ln());
        Needs { ln_samples: [100.0, 400.0, 1600.0].map(frame).to_vec(), seconds_per_sample: 1e-6 }
    }

    #[test]
    fn one_visibility_fits_the_budget() {
        let needs = needs();
        assert!((needs.visibility_for(700.0) - 2.0).abs() < 1e-6);
        assert!((needs.visibility_for(4.0 * 700.0) - 1.0).abs() < 1e-6);
        assert!((needs.visibility_for(6400.0 * 700.0) - 2.0 / 80.0).abs() < 1e-6);
        // Nobody gets less than a pilot.
        assert_eq!(needs.samples(100.0), [16.0; 3]);
    }

    #[test]
    fn shares_add_up_and_go_by_need() {
        let needs = needs();
        for mean in [17, 50, 700, 12_345] {
            let shares = needs.shares(mean);
            assert_eq!(shares.iter().sum::<u32>(), 3 * mean, "{shares:?}");
            assert!(shares[0] <= shares[1] && shares[1] < shares[2], "{shares:?}");
        }
        assert_eq!(needs.shares(700), [100, 400, 1600]);
        assert_eq!(needs.shares(8), [8, 8, 8]);
    }
}
