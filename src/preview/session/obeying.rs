//! Does what viewers ask for.

use super::live::{Changed, Live, settings_of};
use super::problems::Cause;
use super::rest_look::RestLook;
use super::{Session, interruptible};
use crate::adaptive::state::RenderState;
use crate::adaptive::{LastLook, StopReason};
use crate::integrator::{Crop, PathTracer};
use crate::preview::Job;
use crate::preview::command::{Command, Phase};
use crate::preview::orbit::Held;
use std::sync::Arc;

impl Session<'_> {
    pub(super) fn obey(&mut self, command: Command) {
        if self.must_wait(&command) {
            self.let_wait(command);
            return;
        }
        // Not from viewers, who have done nothing that would end it, or a pause that comes back after a file.
        if !matches!(command, Command::Redraw | Command::Pause) {
            self.note = None;
        }
        if self.phase == Phase::Moving && !command.suits_motion() {
            self.restart();
        }
        match command {
            Command::Layer { .. } | Command::Beside { .. } | Command::Inspect { .. } | Command::Gaze { .. } => {}
            Command::Redraw => self.show(),
            Command::Pause if self.phase == Phase::Rendering => self.pause(),
            Command::Resume if matches!(self.phase, Phase::Paused | Phase::Stopped) => self.go_on(),
            Command::Resume => self.forget_rest(),
            Command::Stop if self.phase != Phase::Stopped => {
                if let Some(judgement) = self.rest_look.last.take().map(|look| look.judgement).or_else(|| self.look()) {
                    self.stopped(LastLook { judgement, stop_reason: StopReason::Interrupted });
                }
            }
            Command::Pause | Command::Stop => {}
            Command::Restart => self.restart(),
            Command::Save { format } => self.save(format),
            Command::Exposure { stops } => self.change(|live| live.exposure = stops, Changed::Seen),
            Command::Operator { name } => self.change(|live| live.operator = Some(name), Changed::Seen),
            Command::Display { name } => self.change(|live| live.display = Some(name), Changed::Seen),
            Command::Distance { factor } => self.change(|live| live.distance = Some(factor), Changed::Seen),
            Command::Visibility { target } => self.change(|live| live.visibility = Some(target), Changed::Target),
            Command::Camera { movement } => {
                self.find_pivot();
                let Crop { height, .. } = self.job.trace.film_area();
                self.hand.held.moved(movement.in_part(height as f32 / self.job.trace.height as f32));
                self.hand.moved();
            }
            Command::Focus { x, y } => self.focus_on(x, y),
            Command::CameraHome => {
                self.hand.held = Held::at_home(&self.job.scene.camera);
                self.hand.moved();
            }
            Command::Reload => self.reload(),
        }
    }

    pub(super) fn go_on(&mut self) {
        self.rest_look = RestLook::default();
        self.phase = Phase::Rendering;
    }

    /// Looks where the pointer is, if it is time.
    pub(super) fn follow_gaze(&mut self) {
        let is_waiting = matches!(self.phase, Phase::Moving | Phase::Paused);
        let Some(follower) = self.gaze.as_mut().filter(|follower| !is_waiting && follower.is_due(self.shared)) else {
            return;
        };
        let gaze = follower.follow(self.shared, self.settings.viewing.display.pixel_density());
        let rests_by_itself = matches!(self.rest_look.reason(), Some(StopReason::Visibility | StopReason::MaxSamples));
        self.change(|live| live.gaze = gaze, Changed::Gaze);
        // Whom a viewer or a limit stopped, no pointer wakes.
        if self.phase == Phase::Stopped && rests_by_itself {
            self.go_on();
        }
    }

    /// Other settings for the samples that there are.
    fn change(&mut self, edit: impl FnOnce(&mut Live), changed: Changed) {
        let before = self.live.clone();
        edit(&mut self.live);
        match settings_of(&self.job, &self.live, self.whole()) {
            Err(problem) => {
                self.live = before;
                self.problems.meet(Cause::Setting, problem);
            }
            Ok(settings) => {
                self.settings = interruptible(settings, self.shared);
                self.problems.solve(Cause::Setting);
                self.adopt(changed);
            }
        }
    }

    fn adopt(&mut self, changed: Changed) {
        let has_pilot = self.state.plans > 0;
        match changed {
            Changed::Target if has_pilot => {
                self.state.pending.clear();
                self.state.traced_blocks = 0;
            }
            Changed::Target => {}
            Changed::Gaze => {
                let tone = self.state.tone.take();
                let limits = &self.settings.limits;
                let state = std::mem::replace(&mut self.state, RenderState::new(0, 0, limits));
                self.state = RenderState { tone, ..state.begun_anew(limits) };
                self.order_pilot();
            }
            Changed::Seen => {
                let limits = &self.settings.limits;
                let state = std::mem::replace(&mut self.state, RenderState::new(0, 0, limits));
                self.state = state.begun_anew(limits);
                self.order_pilot();
                self.screen.forget_eyes();
            }
        }
        self.ask_for_a_look(changed);
        // At once, by what the new settings make of the picture itself: the look that they ask for may take seconds.
        if !matches!(changed, Changed::Gaze) {
            self.show();
        }
    }

    fn reload(&mut self) {
        let settings_for = |job: &Job| settings_of(job, &self.live, job.whole.as_ref());
        let loaded = self.host.load().and_then(|job| settings_for(&job).map(|settings| (job, settings)));
        match loaded {
            Err(problem) => self.problems.meet(Cause::Scene, problem),
            Ok((job, settings)) => {
                self.tracer = PathTracer::new(Arc::clone(&job.scene), job.trace);
                // Who edits a lamp wants to see it from where he was; who edits the camera, from there.
                let is_kept = !self.hand.held.is_home && job.scene.camera == self.job.scene.camera;
                if is_kept {
                    self.tracer.set_camera(&self.hand.held.camera);
                } else {
                    self.hand.held = Held::at_home(&job.scene.camera);
                }
                (self.job, self.settings) = (job, interruptible(settings, self.shared));
                self.neighbours = None;
                self.problems.solve(Cause::Scene);
                let seen_from = if is_kept { ", seen from where you are" } else { "" };
                self.note = Some(format!("the scene was loaded again{seen_from}"));
                self.restart();
            }
        }
    }
}
