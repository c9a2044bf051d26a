//! The render's thread: glimpses, renders, and obeys between two batches.

mod depth;
mod gaze;
mod hand;
mod live;
mod motion;
mod obeying;
mod pace;
mod problems;
mod rest;
mod rest_look;
mod saving;
mod telling;
mod waiting;
mod watch;

use super::coarse::order;
use super::command::{Command, Phase};
use super::glimpse::{Glimpse, Resolution};
use super::screen::{Scenery, Screen, Spectators};
use super::shared::Shared;
use super::spectator::Stage;
use super::{Host, Job, Options};
use crate::adaptive::glimpse::steady_glimpse_from;
use crate::adaptive::judge::JudgeError;
use crate::adaptive::settings::LoopSettings;
use crate::adaptive::state::RenderState;
use crate::adaptive::{Progress, run as run_loop};
use crate::integrator::{Crop, PathTracer, TraceSettings};
use fechner_perception::tone::SceneLight;
use gaze::Follower;
use hand::Hand;
use live::{Live, settings_of};
use motion::Neighbours;
pub(super) use pace::Pace;
use problems::{Cause, Problems};
use rest_look::RestLook;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
pub(super) use telling::{blank_status, count, in_words, publish};
use watch::{Inner, Watch};

/// Renders and obeys until the preview closes. A defect that panics ends the picture, not the preview: a saved
/// scene file starts it again.
pub(super) fn run(job: Job, host: &Arc<dyn Host>, options: Options, shared: &Arc<Shared>) {
    let Options { is_foveated, spectators } = options;
    let spectators: Spectators = Arc::new(Mutex::new(spectators));
    let mut next = Ok(job);
    while !shared.is_closing() {
        let work = |job| Session::new(job, host, is_foveated, &spectators, shared).map(Session::work);
        let problem = match next.map(|job| catch_unwind(AssertUnwindSafe(|| work(job)))) {
            Ok(Ok(Ok(()))) => return,
            Ok(Ok(Err(problem))) | Err(problem) => problem,
            Ok(Err(_)) => "the program has a defect here; its message stands where fechner view was started".to_owned(),
        };
        shared.publish_status(serde_json::json!({ "kind": "status", "phase": "failed", "error": problem }).to_string());
        while !is_asked_to_load(shared) {
            if shared.is_closing() {
                return;
            }
            shared.wait(Duration::from_millis(250));
        }
        next = host.load();
    }
}

/// Whether somebody has saved the scene file, or asks to begin anew.
fn is_asked_to_load(shared: &Shared) -> bool {
    shared.take_commands().iter().any(|command| matches!(command, Command::Reload | Command::Restart))
}

struct Session<'a> {
    host: &'a Arc<dyn Host>,
    shared: &'a Arc<Shared>,
    job: Job,
    live: Live,
    /// Where the pointer stands for the gaze.
    gaze: Option<Follower>,
    hand: Hand,
    resolution: Resolution,
    /// Until the film shows more.
    glimpse: Option<Glimpse>,
    tracer: PathTracer,
    /// How light the whole is of which the picture is a part, seen by a camera that is not the scene's.
    whole_from_elsewhere: Option<SceneLight>,
    settings: LoopSettings,
    phase: Phase,
    state: RenderState,
    rest_look: RestLook,
    screen: Screen,
    /// The scenes a frame before and after, once somebody looks at motion.
    neighbours: Option<Neighbours>,
    pace: Pace,
    progress: Option<Progress>,
    /// Commands for a picture that is not there yet.
    waiting: Vec<Command>,
    problems: Problems,
    note: Option<String>,
}

impl<'a> Session<'a> {
    fn new(
        job: Job,
        host: &'a Arc<dyn Host>,
        is_foveated: bool,
        spectators: &Spectators,
        shared: &'a Arc<Shared>,
    ) -> Result<Self, String> {
        let live = Live::default();
        let settings = interruptible(settings_of(&job, &live, job.whole.as_ref())?, shared);
        let tracer = PathTracer::new(Arc::clone(&job.scene), job.trace);
        Ok(Self {
            host,
            shared,
            gaze: is_foveated.then(|| Follower::new(settings.viewing.display.pixel_density())),
            hand: Hand::at_home(&job.scene.camera),
            resolution: Resolution::new(),
            glimpse: None,
            tracer,
            whole_from_elsewhere: None,
            phase: Phase::Moving,
            state: RenderState::new(0, 0, &settings.limits),
            rest_look: RestLook::default(),
            screen: Screen::new(Arc::clone(spectators)),
            neighbours: None,
            pace: Pace::new(),
            progress: None,
            waiting: Vec::new(),
            problems: Problems::default(),
            note: None,
            settings,
            live,
            job,
        })
    }

    fn work(mut self) {
        while !self.shared.is_closing() {
            for command in self.shared.take_commands() {
                self.obey(command);
            }
            self.obey_waiting();
            // Once for all movements that came: a glimpse for each would fall behind a hand that drags.
            if self.hand.take_movement() {
                self.tracer.set_camera(&self.hand.held.camera);
                self.glimpse();
            }
            self.follow_gaze();
            match self.phase {
                Phase::Moving => match self.hand.until_rest() {
                    Some(left) => self.shared.wait(left),
                    None => self.restart(),
                },
                Phase::Rendering => self.render(),
                Phase::Paused | Phase::Stopped if self.rest_look.unlooked.is_some() => self.look_at_rest(),
                Phase::Paused | Phase::Stopped => {
                    self.tell();
                    self.shared.wait(Duration::from_secs(1));
                }
            }
        }
    }

    /// Shows what the camera sees from where it is now, in few pixels.
    fn glimpse(&mut self) {
        let begun = Instant::now();
        let Crop { width, height, .. } = self.job.trace.film_area();
        self.phase = Phase::Moving;
        self.rest_look = RestLook::default();
        self.progress = None;
        self.screen.forget_look();
        // Films of another place are of no use, and counting their samples would take longer than the glimpse.
        self.state = RenderState::new(0, 0, &self.settings.limits);
        let glimpse = Glimpse::of(&self.tracer, self.resolution.step(width, height));
        let pixels = glimpse.film.width() * glimpse.film.height();
        self.glimpse = Some(glimpse);
        self.show();
        self.resolution.took(pixels, begun.elapsed());
        self.tell();
    }

    /// Throws all samples away and begins anew.
    fn restart(&mut self) {
        let Crop { width, height, .. } = self.job.trace.film_area();
        self.fit_to_whole();
        self.state = RenderState::new(width, height, &self.settings.limits);
        self.order_pilot();
        self.phase = Phase::Rendering;
        self.rest_look = RestLook::default();
        self.progress = None;
        self.screen.begin();
        self.forget_motion();
    }

    /// Fits tone to the whole as it is seen from here, as `render` would. From home the job knows it; if it does not,
    /// there is no whole, or it is too large to be looked at.
    fn fit_to_whole(&mut self) {
        self.whole_from_elsewhere = self.job.whole.as_ref().filter(|_| !self.hand.held.is_home).map(|_| {
            // Films of other seeds are shown alike.
            let trace = TraceSettings { seed: 0, ..self.job.trace };
            let nits_per_unit = self.settings.nits_per_unit;
            let light = steady_glimpse_from(&self.hand.held.camera, &mut self.tracer, &trace, nits_per_unit);
            SceneLight::stacked(&[&light], trace.width as usize, trace.height as usize)
        });
        // Not by the function below, which borrows the settings too.
        if let Some(whole) = self.whole_from_elsewhere.as_ref().or(self.job.whole.as_ref()) {
            self.settings.fit_to(whole);
        }
    }

    fn whole(&self) -> Option<&SceneLight> {
        self.whole_from_elsewhere.as_ref().or(self.job.whole.as_ref())
    }

    fn order_pilot(&mut self) {
        let (width, height) = (self.state.film.width(), self.state.film.height());
        if let Some(pilot) = self.state.pending.front_mut().filter(|_| self.state.plans == 0) {
            order(pilot, width, height);
        }
    }

    /// The loop, until it ends or somebody asks for something.
    fn render(&mut self) {
        let Crop { width, height, .. } = self.job.trace.film_area();
        let state = std::mem::replace(&mut self.state, RenderState::new(0, 0, &self.settings.limits));
        self.tell_of(&state);
        // The watch shows motion and cannot find it.
        self.find_motion();
        self.pace.begin();
        let ended = {
            let status = self.status(&state);
            let watch = Watch {
                shared: self.shared,
                settings: &self.settings,
                follower: self.gaze.as_ref(),
                is_awaited: !self.waiting.is_empty(),
                inner: Mutex::new(Inner {
                    screen: &mut self.screen,
                    glimpse: &mut self.glimpse,
                    pace: &mut self.pace,
                    progress: &mut self.progress,
                    status,
                    samples_since: 0,
                    begun: Instant::now(),
                    told: Instant::now(),
                }),
            };
            run_loop(&self.tracer, &self.settings, state, &watch)
        };
        match ended {
            Ok(ended) => {
                self.state = ended.state;
                if let Some(last_look) = ended.last_look {
                    self.stopped(last_look);
                }
            }
            // Who says so throws the picture away.
            Err(JudgeError::Cancelled) => self.state = RenderState::new(width, height, &self.settings.limits),
            Err(error) => {
                self.problems.meet(Cause::Look, error.to_string());
                self.state = RenderState::new(width, height, &self.settings.limits);
                // What waits for this picture would wait for ever.
                self.waiting.clear();
                self.rest_look = RestLook::default();
                self.phase = Phase::Paused;
            }
        }
    }

    fn show(&mut self) {
        if let Some(Glimpse { film, step }) = &self.glimpse {
            let settings = &self.settings;
            let scenery = Scenery { film, tone: None, settings, stage: Stage::UnderWay, step: *step };
            return self.screen.publish(scenery, self.shared);
        }
        self.find_motion();
        let scenery = Scenery {
            film: &self.state.film,
            tone: self.state.tone.as_ref(),
            settings: &self.settings,
            stage: if matches!(self.phase, Phase::Paused | Phase::Stopped) { Stage::AtRest } else { Stage::UnderWay },
            step: 1,
        };
        self.screen.show(scenery, self.shared);
    }
}

/// These settings, with looks that end when somebody wants another picture.
fn interruptible(settings: LoopSettings, shared: &Arc<Shared>) -> LoopSettings {
    let shared = Arc::clone(shared);
    LoopSettings { is_cancelled: Some(Box::new(move || shared.is_cancelled())), ..settings }
}
