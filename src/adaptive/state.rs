//! All of a render that decides what comes next: what a checkpoint holds, and what a resumed render goes on from.

use super::audit::Audit;
use super::plan::pilot_plan;
use super::settings::Limits;
pub use super::until_look::UntilLook;
use crate::film::Film;
use crate::integrator::{BlockWork, PILOT_SAMPLES_PER_PIXEL, SamplePlan};
use crate::sampler::Half;
use fechner_perception::tone::SavedTone;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::ops::AddAssign;

/// A render between two batches of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderState {
    /// All samples.
    pub film: Film,
    /// What is decided and not yet traced.
    pub pending: VecDeque<SamplePlan>,
    /// Blocks of the first of these plans that are in the film.
    pub traced_blocks: usize,
    /// The lowest visibility of the ladder that was reached.
    pub finished_rung: Option<f64>,
    /// The lowest rung that was left, reached or not, in a render that has not ended: those above are not tried again.
    pub left_rung: Option<f64>,
    /// What audits multiplied the variance by, at least 1.
    pub inflation: f64,
    /// The last audit.
    pub audit: Option<Audit>,
    /// Audits so far.
    pub audits: u32,
    /// What a rule without sight was told.
    pub exposure: Option<Exposure>,
    /// Of a picture that is denoised: what comes before the next look at it.
    pub until_look: Option<UntilLook>,
    /// Plans traced.
    pub plans: u32,
    /// Looks of which a plan came.
    pub looks: u32,
    /// What it took so far.
    pub seconds: Seconds,
    /// The tone operator as fitted at the last look.
    pub tone: Option<SavedTone>,
}

/// Time that a render took, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// From the first sample, less the time between an end and its resumption.
    pub total: f64,
    /// Of which in the perception model, planning and audits.
    pub perception: f64,
    /// Of which in finding counts.
    pub allocation: f64,
    /// And in denoising.
    pub denoising: f64,
}

/// Whether anything can have taken so many seconds: 30,000 years are damage.
pub(crate) fn can_be_seconds(seconds: f64) -> bool {
    (0.0..1e12).contains(&seconds)
}

impl AddAssign for Seconds {
    fn add_assign(&mut self, other: Self) {
        self.total += other.total;
        self.perception += other.perception;
        self.allocation += other.allocation;
        self.denoising += other.denoising;
    }
}

/// Exposure of the display as measured at a number of samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Samples of all pixels at the time.
    pub samples: u64,
    /// Share of display white that one scene unit makes near black.
    pub scene_unit_over_white: f64,
}

impl RenderState {
    /// The start of a render: nothing traced, the pilot planned.
    pub fn new(width: u32, height: u32, limits: &Limits) -> Self {
        Self::of_film(Film::new(width, height), limits.pilot())
    }

    /// To go on under other settings.
    #[must_use]
    pub fn begun_anew(self, limits: &Limits) -> Self {
        self.undecided(limits.pilot())
    }

    /// Its samples, what they took and what audits found, less what was decided. Planned is as in [`Self::of_film`].
    #[must_use]
    pub fn undecided(self, most_samples: u32) -> Self {
        let Self { film, inflation, plans, looks, seconds, .. } = self;
        Self { inflation, plans, looks, seconds, ..Self::of_film(film, most_samples) }
    }

    /// A film about which nothing has been decided: empty, merged from others, or made for other eyes. Planned is
    /// what it lacks of a pilot of 8 + 8 samples a pixel, or of `most_samples` in all.
    pub fn of_film(film: Film, most_samples: u32) -> Self {
        Self {
            pending: pilot_plan(&film, most_samples).non_empty().into_iter().collect(),
            film,
            traced_blocks: 0,
            finished_rung: None,
            left_rung: None,
            inflation: 1.0,
            audit: None,
            audits: 0,
            exposure: None,
            until_look: None,
            plans: 0,
            looks: 0,
            seconds: Seconds::default(),
            tone: None,
        }
    }

    /// What is planned is dropped where it would go beyond these limits, as it may when a render goes on to tighter
    /// ones than it was planned for; of a pilot stays what they allow. What was planned within the same limits stays
    /// as it is.
    #[must_use]
    pub(super) fn kept_to(self, limits: &Limits) -> Self {
        if self.is_planned_within(limits) {
            return self;
        }
        let pilot = if self.plans == 0 { pilot_plan(&self.film, limits.pilot()).non_empty() } else { None };
        let pending = pilot.into_iter().collect();
        Self { pending, traced_blocks: 0, ..self }
    }

    /// Whether neither the picture nor any pixel has more than it may when all plans are traced.
    fn is_planned_within(&self, limits: &Limits) -> bool {
        let is_pilot = self.plans == 0;
        if self.pending.is_empty()
            || is_pilot && limits.mean_samples.is_none() && limits.max_samples >= PILOT_SAMPLES_PER_PIXEL
        {
            return true;
        }
        let film = &self.film;
        let [a, b] = Half::BOTH.map(|half| film.half(half));
        let mut taken: Vec<u64> = a.iter().zip(b).map(|(a, b)| u64::from(a.taken) + u64::from(b.taken)).collect();
        let mut planned = 0;
        for block in self.untraced_blocks() {
            taken[block.pixel as usize] += u64::from(block.samples);
            planned += u64::from(block.samples);
        }
        let is_affordable = |mean: u32| film.total_samples() + planned <= u64::from(mean) * taken.len() as u64;
        let may_have_it = |block: &BlockWork| taken[block.pixel as usize] <= u64::from(limits.max_samples);
        limits.mean_samples.is_none_or(is_affordable) && self.untraced_blocks().all(may_have_it)
    }

    /// The first of the plans is in the film.
    pub(crate) fn close_plan(&mut self) {
        self.pending.pop_front();
        self.traced_blocks = 0;
        self.plans += 1;
    }

    /// Blocks that are planned and not yet traced, in order.
    pub fn untraced_blocks(&self) -> impl Iterator<Item = &BlockWork> {
        self.pending.iter().flat_map(|plan| &plan.blocks).skip(self.traced_blocks)
    }

    /// Samples of these.
    pub fn untraced_samples(&self) -> u64 {
        self.untraced_blocks().map(|block| u64::from(block.samples)).sum()
    }
}
