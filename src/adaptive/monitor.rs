//! How a render tells what it does, and is told to stop. Monitors decide nothing but whether it goes on.

use super::StopReason;
use super::judge::Judgement;
use super::state::RenderState;

/// How far a render is, told after each look.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Looks taken, from 1.
    pub look: u32,
    /// Time from the first sample, less what a resumed render lay idle.
    pub seconds: f64,
    /// Visibility that is being worked towards.
    pub rung: f64,
    /// Pixels of the picture.
    pub pixels: f64,
    /// Mean samples a pixel so far.
    pub mean_samples: f64,
    /// Share of pixels whose predicted visibility is above the final target; `None` where the samples are too few to
    /// tell.
    pub visible_share: Option<f64>,
    /// Samples of the plan that comes next.
    pub next_samples: u64,
    /// Rough count of samples that the target will take from here, if the noise behaves as it did.
    pub remaining_samples: f64,
}

/// Whether a render goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Directive {
    /// The render goes on as planned.
    GoOn,
    /// The render ends at once, with the picture so far.
    Stop,
    /// The render ends at once and without another look: somebody goes on from the state, or throws it away.
    Leave,
}

/// A listener that is told how a render goes. Called from the render's own thread, except `samples_done`.
pub trait Monitor: Sync {
    /// Hears how far the render is, after each look at the picture.
    fn looked(&self, progress: &Progress);
    /// Hears what was seen, after each look.
    fn judged(&self, _state: &RenderState, _judgement: &Judgement) {}
    /// Hears of samples while a plan is traced, from any thread.
    fn samples_done(&self, samples: u64);
    /// Most samples of a batch, where somebody waits for the next moment between two. The picture does not depend on
    /// it.
    fn most_samples_a_batch(&self) -> u64 {
        u64::MAX
    }
    /// About once a second, between batches of samples; a render that is resumed from this state makes the same
    /// picture.
    fn between_batches(&self, _state: &RenderState) -> Directive {
        Directive::GoOn
    }
    /// Gets, at the end, what a render to another limit would go on from.
    fn ended(&self, _state: &RenderState, _reason: StopReason) {}
    /// Gets, when a look of [`super::run`] fails, what a render could go on from: who called it does not get the state.
    fn failed(&self, _state: &RenderState) {}
}

/// Tells nobody.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quiet;

impl Monitor for Quiet {
    fn looked(&self, _: &Progress) {}
    fn samples_done(&self, _: u64) {}
}
