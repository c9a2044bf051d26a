//! Lets all that watch a render from the command line be one monitor.

use super::Keeper;
use crate::cli::console::Console;
use crate::cli::report::Interrupter;
use crate::cli::tev::Showing;
use fechner::adaptive::judge::Judgement;
use fechner::adaptive::state::RenderState;
use fechner::adaptive::{Directive, Monitor, Progress, StopReason};
use fechner::preview::Audience;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Console, keeper, viewers, tev and signals together.
pub(in crate::cli) struct Watch<'a> {
    console: Console,
    keeper: Option<Keeper>,
    audience: Option<Audience<'a>>,
    tev: Option<Showing>,
    stop: Arc<AtomicBool>,
    started: Instant,
}

impl<'a> Watch<'a> {
    /// A watch over one render. `stop`: what signals set, of [`crate::cli::signals::listen`].
    pub(in crate::cli) fn new(
        stop: Arc<AtomicBool>,
        console: Console,
        keeper: Option<Keeper>,
        audience: Option<Audience<'a>>,
        tev: Option<Showing>,
    ) -> Self {
        Self { console, keeper, audience, tev, stop, started: Instant::now() }
    }

    /// Whether a signal asked for the end.
    fn is_asked_to_end(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Who ended a render that was interrupted.
    pub(in crate::cli) fn interrupter(&self) -> Interrupter {
        if self.is_asked_to_end() { Interrupter::Signal } else { Interrupter::Viewer }
    }

    /// Removes the progress bar.
    pub(in crate::cli) fn finish(&self) {
        self.console.finish();
    }

    /// Says what keeping the film took.
    ///
    /// # Errors
    /// If its last state could not be written.
    pub(in crate::cli) fn report(self) -> anyhow::Result<()> {
        self.keeper.map_or(Ok(()), |keeper| keeper.report(self.started.elapsed()))
    }
}

impl Monitor for Watch<'_> {
    fn looked(&self, progress: &Progress) {
        self.console.looked(progress);
        if let Some(audience) = &self.audience {
            audience.looked(progress);
        }
    }

    fn judged(&self, state: &RenderState, judgement: &Judgement) {
        if let Some(keeper) = &self.keeper {
            keeper.looked();
        }
        if let Some(audience) = &self.audience {
            audience.judged(state, judgement);
        }
        if let Some(tev) = &self.tev {
            tev.judged(judgement);
        }
    }

    fn samples_done(&self, samples: u64) {
        self.console.samples_done(samples);
        if let Some(keeper) = &self.keeper {
            keeper.samples_done(samples);
        }
        if let Some(audience) = &self.audience {
            audience.samples_done(samples);
        }
    }

    fn most_samples_a_batch(&self) -> u64 {
        let of_audience = self.audience.as_ref().map_or(u64::MAX, Audience::most_samples_a_batch);
        self.keeper.as_ref().map_or(u64::MAX, Keeper::most_samples_a_batch).min(of_audience)
    }

    fn between_batches(&self, state: &RenderState) -> Directive {
        if self.is_asked_to_end() {
            return Directive::Stop;
        }
        if let Some(keeper) = &self.keeper {
            keeper.chance(state);
        }
        if let Some(tev) = &self.tev {
            tev.between_batches(state);
        }
        self.audience.as_ref().map_or(Directive::GoOn, |audience| audience.between_batches(state))
    }

    fn ended(&self, state: &RenderState, reason: StopReason) {
        if let Some(audience) = &self.audience {
            audience.ended(state, reason);
        }
        if let Some(tev) = &self.tev {
            tev.ended(state);
        }
        if let Some(keeper) = &self.keeper {
            keeper.ended(state);
        }
    }

    fn failed(&self, state: &RenderState) {
        // First what is left of it.
        if let Some(keeper) = &self.keeper {
            keeper.ended(state);
        }
        if let Some(audience) = &self.audience {
            audience.failed(state);
        }
        if let Some(tev) = &self.tev {
            tev.ended(state);
        }
    }
}
