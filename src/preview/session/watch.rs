//! What the loop tells while it runs: frames and figures between batches, and the way out when somebody asks for
//! something.

use super::gaze::Follower;
use super::pace::Pace;
use super::telling::{count, publish};
use super::waiting::is_whole;
use crate::adaptive::judge::Judgement;
use crate::adaptive::settings::LoopSettings;
use crate::adaptive::state::RenderState;
use crate::adaptive::{Directive, Monitor, Progress};
use crate::poison::Unpoisoned as _;
use crate::preview::command::Status;
use crate::preview::glimpse::Glimpse;
use crate::preview::screen::{Looked, Scenery, Screen};
use crate::preview::shared::Shared;
use crate::preview::spectator::Stage;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Figures are told so often, also where frames are dear and seldom.
const FIGURES_INTERVAL: Duration = Duration::from_millis(250);

/// A note is told for so long at least: viewers are sent the latest status alone.
const NOTE_TIME: Duration = Duration::from_secs(1);

/// Shows the loop's film between batches, and leaves the loop when somebody asks for something.
pub(super) struct Watch<'a> {
    pub(super) shared: &'a Arc<Shared>,
    pub(super) settings: &'a LoopSettings,
    /// Where the gaze counts.
    pub(super) follower: Option<&'a Follower>,
    /// Whether somebody waits for a film with something of every pixel.
    pub(super) is_awaited: bool,
    pub(super) inner: Mutex<Inner<'a>>,
}

/// What changes meanwhile.
pub(super) struct Inner<'a> {
    pub(super) screen: &'a mut Screen,
    /// The glimpse that is shown until the film shows more.
    pub(super) glimpse: &'a mut Option<Glimpse>,
    pub(super) pace: &'a mut Pace,
    pub(super) progress: &'a mut Option<Progress>,
    pub(super) status: Status,
    /// Samples since the last frame.
    pub(super) samples_since: u64,
    /// When the loop was entered.
    pub(super) begun: Instant,
    /// When figures were told last.
    pub(super) told: Instant,
}

impl Inner<'_> {
    /// A grid coarser than the last glimpse would be a step back.
    fn shows_more_than_glimpsed(&self, state: &RenderState) -> bool {
        let glimpsed = self.glimpse.as_ref().map_or(0, |glimpse| glimpse.film.pixel_count());
        state.plans > 0 || state.traced_blocks >= glimpsed
    }
}

impl Watch<'_> {
    fn tell(&self, inner: &mut Inner<'_>, state: &RenderState) {
        let total_samples = inner.screen.total_samples + inner.samples_since;
        count(&mut inner.status, state, total_samples, inner.progress.as_ref());
        publish(&inner.status, self.shared);
        inner.told = Instant::now();
    }

    fn show(&self, inner: &mut Inner<'_>, state: &RenderState) {
        let tone = state.tone.as_ref();
        *inner.glimpse = None;
        let scenery = Scenery { film: &state.film, tone, settings: self.settings, stage: Stage::UnderWay, step: 1 };
        inner.screen.show(scenery, self.shared);
        inner.status.note = inner.status.note.take().filter(|_| inner.begun.elapsed() < NOTE_TIME);
        inner.samples_since = 0;
        self.tell(inner, state);
    }
}

impl Monitor for Watch<'_> {
    fn looked(&self, progress: &Progress) {
        *self.inner.lock().unpoisoned().progress = Some(*progress);
    }

    fn judged(&self, state: &RenderState, judgement: &Judgement) {
        let mut inner = self.inner.lock().unpoisoned();
        inner.screen.looked = Some(Arc::new(Looked::of(judgement)));
        self.show(&mut inner, state);
        inner.pace.begin();
    }

    fn samples_done(&self, samples: u64) {
        let mut inner = self.inner.lock().unpoisoned();
        inner.pace.count(samples);
        inner.samples_since += samples;
    }

    fn most_samples_a_batch(&self) -> u64 {
        self.inner.lock().unpoisoned().pace.samples()
    }

    fn between_batches(&self, state: &RenderState) -> Directive {
        let mut inner = self.inner.lock().unpoisoned();
        let between_frames = inner.screen.between_frames(self.shared);
        inner.pace.counted(between_frames);
        if inner.shows_more_than_glimpsed(state) && inner.screen.is_due(between_frames) {
            self.show(&mut inner, state);
        } else if inner.told.elapsed() >= FIGURES_INTERVAL {
            self.tell(&mut inner, state);
        }
        inner.pace.begin();
        let is_there = self.is_awaited && is_whole(state);
        if is_there || self.shared.has_news() || self.follower.is_some_and(|follower| follower.is_due(self.shared)) {
            Directive::Leave
        } else {
            Directive::GoOn
        }
    }
}
