//! Commands about a picture that is not there yet: they wait until the camera's movement was acted on and the film has
//! something of every pixel.

use super::Session;
use crate::adaptive::state::RenderState;
use crate::preview::command::{Command, Phase};
use crate::sampler::Half;

impl Session<'_> {
    /// Whether it would be done to a picture before the one that it is meant for, or to one that is not whole. What has
    /// stopped is as whole as its limits let it be.
    pub(super) fn must_wait(&self, command: &Command) -> bool {
        let is_in_motion = self.hand.has_moved() || self.phase == Phase::Moving;
        let is_whole = || self.phase == Phase::Stopped || is_whole(&self.state);
        match command {
            // A pause must not overtake what waits for samples.
            Command::Pause => is_in_motion || !self.waiting.is_empty(),
            Command::Stop | Command::Save { .. } => is_in_motion || !is_whole(),
            _ => false,
        }
    }

    /// Keeps a command until it can be done. A pause in the first pass ends for what needs all of that pass,
    /// and comes back after a file.
    pub(super) fn let_wait(&mut self, command: Command) {
        let is_file = matches!(command, Command::Save { .. });
        let breaks_a_pause = self.phase == Phase::Paused && !self.hand.has_moved();
        self.waiting.push(command);
        if breaks_a_pause {
            self.waiting.extend(is_file.then_some(Command::Pause));
            self.note = Some("the first pass over the picture is traced to its end before".to_owned());
            self.go_on();
        }
    }

    /// Does what has waited, once it can be done.
    pub(super) fn obey_waiting(&mut self) {
        let is_ready = match self.phase {
            Phase::Moving => false,
            Phase::Rendering => is_whole(&self.state),
            // Nothing more comes by itself.
            Phase::Paused | Phase::Stopped => true,
        };
        if is_ready && !self.hand.has_moved() {
            for command in std::mem::take(&mut self.waiting) {
                self.obey(command);
            }
        }
    }

    /// Who says to go on wants neither a pause nor a stop that has not come yet.
    pub(super) fn forget_rest(&mut self) {
        self.waiting.retain(|command| matches!(command, Command::Save { .. }));
    }
}

/// Whether a film can be judged and kept: its pilot is traced, or both halves of every pixel have samples.
pub(super) fn is_whole(state: &RenderState) -> bool {
    let [a, b] = Half::BOTH.map(|half| state.film.half(half));
    state.plans > 0 || !a.is_empty() && a.iter().zip(b).all(|(a, b)| a.samples > 0 && b.samples > 0)
}
