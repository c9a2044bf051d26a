//! The picture at rest: what is shown of it is what was seen in a look at it as it is, and what would be saved.
//!
//! A look may take seconds, and a viewer who drags a slider asks for ten a second. So a change is shown at once
//! without one, and the look follows when nothing more is asked for.

use super::Session;
use super::live::Changed;
use super::problems::Cause;
use super::rest_look::{RestLook, Unlooked};
use super::waiting::is_whole;
use crate::adaptive::judge::{JudgeError, Judgement};
use crate::adaptive::{LastLook, StopReason, is_reached, look_at_rest};
use crate::preview::command::Phase;
use crate::preview::screen::Looked;
use std::sync::Arc;

impl Session<'_> {
    pub(super) fn pause(&mut self) {
        self.phase = Phase::Paused;
        self.rest_look = RestLook::default();
        if is_whole(&self.state) {
            self.glimpse = None;
            self.rest_look = RestLook::wanted(Unlooked { before: StopReason::Interrupted, changed: Changed::Seen });
        }
        self.show();
        self.tell();
    }

    /// The render is at an end, until somebody asks for more.
    pub(super) fn stopped(&mut self, last_look: LastLook) {
        self.phase = Phase::Stopped;
        self.rest(last_look);
    }

    /// Shows what a look saw of the picture at rest.
    fn rest(&mut self, last_look: LastLook) {
        // At rest the film is shown, however little it has: it is what will be saved.
        if self.state.film.total_samples() > 0 {
            self.glimpse = None;
        }
        self.problems.solve(Cause::Look);
        self.screen.looked = Some(Arc::new(Looked::of(&last_look.judgement)));
        self.state.tone = Some(last_look.judgement.tone.save());
        self.rest_look = RestLook::of(last_look);
        self.show();
        self.tell();
    }

    /// What was seen of the picture at rest holds no more. A pause has no target.
    pub(super) fn ask_for_a_look(&mut self, changed: Changed) {
        let is_concerned = match self.phase {
            Phase::Stopped => true,
            Phase::Paused => is_whole(&self.state) && !matches!(changed, Changed::Target),
            Phase::Moving | Phase::Rendering => false,
        };
        if is_concerned {
            self.rest_look.ask_again(changed);
        }
    }

    /// Looks at the picture at rest, until somebody asks for something.
    pub(super) fn look_at_rest(&mut self) {
        let shared = Arc::clone(self.shared);
        let is_cancelled = self.settings.is_cancelled.replace(Box::new(move || shared.has_news()));
        let found = look_at_rest(&self.state, &self.settings);
        self.settings.is_cancelled = is_cancelled;
        match found {
            Ok(judgement) => self.looked_at_rest(judgement),
            Err(JudgeError::Cancelled) => {}
            Err(error) => {
                self.problems.meet(Cause::Look, error.to_string());
                self.rest_look.unlooked = None;
            }
        }
    }

    /// The picture at rest was looked at as it is.
    pub(super) fn looked_at_rest(&mut self, judgement: Judgement) {
        match self.reason_to_rest(&judgement) {
            Some(stop_reason) => self.rest(LastLook { judgement, stop_reason }),
            None => {
                self.go_on();
                self.show();
            }
        }
    }

    /// Why the picture rests from this look on; `None` where it does not. One that rested because nothing more could
    /// be seen, or done about it, goes on where another target asks for more. For other eyes it stays as it is, and
    /// says no longer why it rests.
    pub(super) fn reason_to_rest(&self, judgement: &Judgement) -> Option<StopReason> {
        use StopReason::{Interrupted, MaxSamples, Visibility};
        let Some(Unlooked { before, changed }) = self.rest_look.unlooked else { return Some(Interrupted) };
        let is_reached = is_reached(judgement, self.settings.limits.last_rung());
        match (before, changed) {
            // Somebody stopped it, or a pause is no end.
            (_, Changed::Gaze) => Some(before),
            _ if self.phase == Phase::Paused => Some(Interrupted),
            (Visibility | MaxSamples | Interrupted, _) if is_reached => Some(Visibility),
            (Visibility | MaxSamples, Changed::Target) => None,
            (Visibility | MaxSamples, Changed::Seen) => Some(Interrupted),
            (other, _) => Some(other),
        }
    }

    /// Looks at the film as it is.
    pub(super) fn look(&mut self) -> Option<Judgement> {
        match look_at_rest(&self.state, &self.settings) {
            Ok(judgement) => {
                self.problems.solve(Cause::Look);
                Some(judgement)
            }
            Err(JudgeError::Cancelled) => None,
            Err(error) => {
                self.problems.meet(Cause::Look, error.to_string());
                None
            }
        }
    }
}
