//! The page of a preview on a render that is somebody else's: it is watched and can be stopped, not driven.
//!
//! The render keeps its own loop, checkpoints and files; its monitor hands each moment on to an [`Audience`],
//! which shows it to whoever looks, at the preview's rate. Not for renders that answer to viewers:
//! [`super::start`] opens those.

use super::command::{Command, Phase, Status};
use super::orbit::Held;
use super::screen::{Looked, Scenery, Screen};
use super::server::{Door, serve};
use super::session::{Pace, blank_status, count, in_words, publish};
use super::shared::Shared;
use super::spectator::Stage;
use crate::adaptive::judge::Judgement;
use crate::adaptive::settings::LoopSettings;
use crate::adaptive::state::RenderState;
use crate::adaptive::{Directive, Progress, StopReason};
use crate::checkpoint::SettingsRecord;
use crate::poison::Unpoisoned as _;
use crate::scene::Scene;
use std::net::TcpListener;
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time for which viewers are told that the render is not driven.
const REFUSAL: Duration = Duration::from_secs(6);

/// Viewers of a render under way; they are sent away when it has ended or is dropped.
pub struct Audience<'a> {
    shared: Arc<Shared>,
    settings: &'a LoopSettings,
    inner: Mutex<Inner>,
    server: Mutex<Option<JoinHandle<std::io::Result<()>>>>,
}

struct Inner {
    screen: Screen,
    pace: Pace,
    progress: Option<Progress>,
    status: Status,
    /// When somebody asked for what is not to be had, while that is told.
    refused: Option<Instant>,
    /// Whether somebody here asked for the end.
    is_stopped_here: bool,
}

impl Inner {
    /// Says that a wish cannot be met, or after a while nothing of it.
    fn refuse(&mut self, refused: Option<Instant>, shared: &Shared) {
        let told = "this is a running render: it can be stopped; \"fechner view\" opens one to drive";
        self.status.error = refused.map(|_| told.to_owned());
        self.refused = refused;
        publish(&self.status, shared);
    }
}

impl<'a> Audience<'a> {
    /// Lets viewers in at the door, from a thread of its own.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn open(
        listener: TcpListener,
        door: Door,
        scene: &Scene,
        settings: &'a LoopSettings,
        record: &SettingsRecord,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::new());
        let of_server = Arc::clone(&shared);
        let server =
            std::thread::Builder::new().name("viewers".to_owned()).spawn(move || serve(listener, door, of_server))?;
        let blank = blank_status(scene, settings, &record.operator, &Held::at_home(&scene.camera));
        let status = Status { phase: Phase::Rendering, exposure: record.exposure_stops, is_driven: false, ..blank };
        let inner = Inner {
            screen: Screen::new(Arc::default()),
            pace: Pace::new(),
            progress: None,
            status,
            refused: None,
            is_stopped_here: false,
        };
        Ok(Self { shared, settings, inner: Mutex::new(inner), server: Mutex::new(Some(server)) })
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unpoisoned()
    }

    fn show(&self, inner: &mut Inner, state: &RenderState) {
        let stage = if inner.status.phase == Phase::Stopped { Stage::AtRest } else { Stage::UnderWay };
        // The film stands in for itself where it has no samples yet.
        let (film, tone, settings) = (&state.film, state.tone.as_ref(), self.settings);
        inner.screen.show(Scenery { film, tone, settings, stage, step: 1 }, &self.shared);
        (inner.status.width, inner.status.height) = (film.width(), film.height());
        let total_samples = inner.screen.total_samples;
        count(&mut inner.status, state, total_samples, inner.progress.as_ref());
        publish(&inner.status, &self.shared);
    }

    /// Keeps the progress that is told after each look at the picture.
    pub fn looked(&self, progress: &Progress) {
        self.inner().progress = Some(*progress);
    }

    /// Keeps what was seen after each look.
    pub fn judged(&self, state: &RenderState, judgement: &Judgement) {
        let mut inner = self.inner();
        inner.screen.looked = Some(Arc::new(Looked::of(judgement)));
        self.show(&mut inner, state);
        inner.pace.begin();
    }

    /// While a plan is traced.
    pub fn samples_done(&self, samples: u64) {
        self.inner().pace.count(samples);
    }

    /// Most samples between two moments.
    pub fn most_samples_a_batch(&self) -> u64 {
        self.inner().pace.samples()
    }

    /// Shows the film if a frame is due, and says whether somebody wants the render to stop.
    pub fn between_batches(&self, state: &RenderState) -> Directive {
        let mut inner = self.inner();
        let between_frames = inner.screen.between_frames(&self.shared);
        inner.pace.counted(between_frames);
        let mut directive = Directive::GoOn;
        let mut wants_a_frame = inner.screen.is_due(between_frames);
        for command in self.shared.take_commands() {
            match command {
                Command::Stop => {
                    directive = Directive::Stop;
                    inner.is_stopped_here = true;
                }
                Command::Redraw => wants_a_frame = true,
                _ => inner.refuse(Some(Instant::now()), &self.shared),
            }
        }
        if inner.refused.is_some_and(|refused| refused.elapsed() >= REFUSAL) {
            inner.refuse(None, &self.shared);
        }
        if wants_a_frame {
            self.show(&mut inner, state);
        }
        inner.pace.begin();
        directive
    }

    /// The render is at an end: shows its last frame, says why, and sends everybody away, so that no connection takes a
    /// file from what is written next.
    pub fn ended(&self, state: &RenderState, reason: StopReason) {
        let mut inner = self.inner();
        inner.status.phase = Phase::Stopped;
        inner.status.reason = Some(match reason {
            StopReason::Interrupted if inner.is_stopped_here => "stopped from this page",
            StopReason::Interrupted => "stopped by a signal",
            reason => in_words(reason),
        });
        self.show(&mut inner, state);
        self.close();
    }

    /// The render failed: shows what there is, says so, and sends everybody away.
    pub fn failed(&self, state: &RenderState) {
        let mut inner = self.inner();
        inner.status.phase = Phase::Stopped;
        inner.status.error = Some("the render failed: why is said where it was started".to_owned());
        self.show(&mut inner, state);
        self.close();
    }

    fn close(&self) {
        self.shared.close();
        if let Some(server) = self.server.lock().unpoisoned().take() {
            // A thread that panicked has said so.
            let _ = server.join();
        }
    }
}

impl Drop for Audience<'_> {
    fn drop(&mut self) {
        self.close();
    }
}
