//! A budget of samples for a whole shot, spent where most would be seen.
//!
//! Pilots of fixed seed, of frames where the light changes and of others spread over the shot, say how many samples a
//! pixel a frame needs for a visibility. One visibility for all frames fits the budget, none below the one that is
//! asked for; what a frame needs for it is its share, and what is left over goes where pilots may be wrong by most.
//! Frames stay independent of each other: they know their share from the track. Not for shots that only have a
//! visibility to reach: their frames know by themselves when they are done.

use super::pilots::{Neighbours, piloted_frames};
use super::track::Track;
use super::{SceneSource, ShotSettings};
use crate::adaptive::judge::{JudgeError, judge};
use crate::adaptive::plan::{needed_samples, pilot_plan};
use crate::adaptive::settings::Limits;
use crate::film::Film;
use crate::integrator::{PILOT_SAMPLES_PER_PIXEL, PathTracer};
use crate::scene::load::LoadError;
use fechner_perception::tone::ToneOperator;
use std::time::Instant;

/// Visibilities at which needs are asked; between them, and beyond, they go as a power. At higher ones most pixels have
/// what they need from the pilot on, which says little of lower ones.
const ASKED: [f64; 5] = [8.0, 2.0, 0.5, 0.125, 0.03125];
const LAST_ASKED: usize = ASKED.len() - 1;
/// Times the need that a frame may take at first of what is left over: within [`KNOWN_SAMPLES`] frames of two shots
/// took 0.85 to 1.22 times what their pilots said, and twice as many at twice that, where pilots have not met what is
/// rare.
const MARGIN: f64 = 1.3;
/// Needs up to here pilots know; beyond it their error goes as the need.
const KNOWN_SAMPLES: f64 = 2.0 * PILOT_SAMPLES_PER_PIXEL as f64;

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
    /// Most samples that a pixel may have.
    max_samples: u32,
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
        let piloted = piloted_frames(source, shot, operator().as_ref(), track)?;
        let (mut seconds, mut samples) = (0.0, 0);
        let mut needs = Vec::new();
        for &offset in &piloted {
            let frame = &track.frames[offset];
            let scene = source.at(shot.seconds(f64::from(frame.frame)))?;
            let settings = shot.frame_settings(operator(), frame);
            let tracer = PathTracer::new(scene, shot.trace);
            let area = tracer.settings().film_area();
            let mut film = Film::new(area.width, area.height);
            let started = Instant::now();
            tracer.trace(&pilot_plan(&film, PILOT_SAMPLES_PER_PIXEL), &mut film, &|_| {});
            seconds += started.elapsed().as_secs_f64();
            samples += film.total_samples();
            let judgement = judge(&film, &settings, 1.0)?;
            // What frames need is asked to know how the budget is shared, so that it limits none of them.
            let limits = Limits { pilot_samples: PILOT_SAMPLES_PER_PIXEL, mean_samples: None, ..shot.limits };
            let mut ln_samples = [0.0; ASKED.len()];
            for (ln_samples, visibility) in ln_samples.iter_mut().zip(ASKED) {
                let needed = needed_samples(&film, &judgement, visibility, &limits);
                *ln_samples = needed.map_err(JudgeError::Perception)?.ln();
            }
            needs.push(ln_samples);
        }
        let between = |frame: usize| {
            let Neighbours { before, after, share } = Neighbours::of(frame, &piloted);
            let (before, after) = (needs[before], needs[after]);
            std::array::from_fn(|asked| before[asked] + share * (after[asked] - before[asked]))
        };
        Ok(Self {
            ln_samples: (0..track.frames.len()).map(between).collect(),
            max_samples: shot.limits.max_samples,
            seconds_per_sample: seconds / samples.max(1) as f64,
        })
    }

    /// Samples a pixel that each frame needs for a visibility: at least a pilot's, at most what it may have.
    fn samples(&self, visibility: f64) -> Vec<f64> {
        let octaves = |at: usize, other: usize| (ASKED[at] / ASKED[other]).log2();
        let [least, most] = [PILOT_SAMPLES_PER_PIXEL, self.max_samples].map(f64::from);
        self.ln_samples
            .iter()
            .map(|ln_samples| {
                let at = ASKED[1..LAST_ASKED].partition_point(|&asked| visibility < asked);
                let slope = (ln_samples[at + 1] - ln_samples[at]) / octaves(at, at + 1);
                let beyond = visibility < ASKED[LAST_ASKED];
                // Beyond the last one the law of large numbers holds.
                let (from, slope) = if beyond { (LAST_ASKED, 2.0 * std::f64::consts::LN_2) } else { (at, slope) };
                let ln = ln_samples[from] + slope * (ASKED[from] / visibility).log2();
                ln.exp().clamp(least, most.max(least))
            })
            .collect()
    }

    /// The visibility that all frames reach with so many samples a pixel on average.
    fn visibility_for(&self, mean_samples: f64) -> f64 {
        let mean = |visibility: f64| self.samples(visibility).iter().sum::<f64>() / self.ln_samples.len() as f64;
        let (mut low, mut high) = (-16.0f64, 8.0f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if mean(middle.exp2()) > mean_samples { low = middle } else { high = middle }
        }
        high.exp2()
    }

    /// Samples a pixel that each frame needs for the visibility that fits so many on average, or for `asked`,
    /// below which none goes on.
    pub fn for_budget(&self, mean_samples: f64, asked: f64) -> Vec<f64> {
        self.samples(self.visibility_for(mean_samples).max(asked))
    }

    /// Whole samples a pixel for each frame, by what it needs on the way to the visibility `asked`; what is
    /// left over is for what pilots err by. They add up to the budget of `mean_samples` for each, unless that
    /// is more than pixels may have.
    pub fn shares(&self, mean_samples: u32, asked: f64) -> Vec<u32> {
        let count = self.ln_samples.len();
        if mean_samples <= PILOT_SAMPLES_PER_PIXEL {
            return vec![mean_samples; count];
        }
        let budget = f64::from(mean_samples) * count as f64;
        let needs = self.for_budget(f64::from(mean_samples), asked);
        let most = vec![f64::from(self.max_samples); count];
        let with_margin: Vec<f64> = needs.iter().zip(&most).map(|(need, most)| with_margin(*need).min(*most)).collect();
        let shares = if with_margin.iter().sum::<f64>() < budget {
            scaled_to(budget, &with_margin, &most)
        } else {
            scaled_to(budget, &needs, &with_margin)
        };
        rounded(&shares)
    }
}

/// What a frame may take at most of which pilots say that it needs so much.
fn with_margin(need: f64) -> f64 {
    MARGIN * need * (need / KNOWN_SAMPLES).max(1.0)
}

/// The shares times a factor that makes them add up to a sum, none above its most.
fn scaled_to(sum: f64, shares: &[f64], most: &[f64]) -> Vec<f64> {
    let scaled = |factor: f64| shares.iter().zip(most).map(move |(share, most)| (factor * share).min(*most));
    let (mut low, mut high) = (0.0, most.iter().fold(1.0, |a: f64, &most| a.max(most)));
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if scaled(middle).sum::<f64>() < sum { low = middle } else { high = middle }
    }
    scaled(high).collect()
}

/// Whole samples; what rounding left goes on to the next frame.
fn rounded(shares: &[f64]) -> Vec<u32> {
    let mut given = 0.0;
    let mut spent = 0;
    let whole = |share: &f64| {
        given += share;
        let share = (given.round() as u64).saturating_sub(spent).max(1);
        spent += share;
        share as u32
    };
    shares.iter().map(whole).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames that need 1, 4 and 16 times a sample count that goes as 1/v².
    fn needs() -> Needs {
        needs_at_2(&[100.0, 400.0, 1600.0])
    }

    fn needs_at_2(samples: &[f64]) -> Needs {
        let frame = |at_2: &f64| ASKED.map(|visibility| (at_2 * 4.0 / visibility / visibility).ln());
        Needs { ln_samples: samples.iter().map(frame).collect(), max_samples: u32::MAX, seconds_per_sample: 1e-6 }
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
            let shares = needs.shares(mean, 0.0);
            assert_eq!(shares.iter().sum::<u32>(), 3 * mean, "{shares:?}");
            assert!(shares[0] <= shares[1] && shares[1] < shares[2], "{shares:?}");
        }
        assert_eq!(needs.shares(700, 0.0), [100, 400, 1600]);
        assert_eq!(needs.shares(8, 0.0), [8, 8, 8]);
    }

    /// What pixels may not have goes to frames whose pixels may.
    #[test]
    fn shares_stay_within_what_pixels_may_have() {
        let needs = Needs { max_samples: 1000, ..needs() };
        assert_eq!(needs.shares(700, 0.0), [220, 880, 1000]);
        assert_eq!(needs.shares(1000, 0.0), [1000; 3]);
        assert_eq!(needs.shares(5000, 0.0), [1000; 3]);
    }

    /// Of a budget beyond the needs for what is asked, frames whose needs pilots know take little, and the others the
    /// rest.
    #[test]
    fn what_is_left_over_goes_where_pilots_know_least() {
        let needs = needs_at_2(&[20.0, 20.0, 320.0]);
        assert_eq!(needs.shares(200, 2.0), [26, 26, 548]);
        // Beyond what they may be wrong by, all have the same share more.
        assert_eq!(needs.shares(2 * (26 + 26 + 4160) / 3, 2.0), [52, 52, 8320]);
        // Less than they need is spent for one visibility.
        assert_eq!(needs.shares(60, 2.0).iter().sum::<u32>(), 180);
    }
}
