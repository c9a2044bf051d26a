//! Keeps what was seen of a picture at rest, or is to be seen. The look itself is taken elsewhere.

use super::live::Changed;
use crate::adaptive::{LastLook, StopReason};

/// A rest that lacks a look.
#[derive(Clone, Copy)]
pub(super) struct Unlooked {
    /// Why the picture rested before.
    pub(super) before: StopReason,
    /// What has changed since.
    pub(super) changed: Changed,
}

/// The look at the picture that rests; empty while none does.
#[derive(Default)]
pub(super) struct RestLook {
    /// The look at the picture that rests, once there was one.
    pub(super) last: Option<LastLook>,
    /// Why it rested before and what has changed, while it rests and was not looked at as it is.
    pub(super) unlooked: Option<Unlooked>,
}

impl RestLook {
    /// The look at a picture that was looked at as it is.
    pub(super) fn of(last: LastLook) -> Self {
        Self { last: Some(last), unlooked: None }
    }

    /// The picture rests, and nobody has looked at it.
    pub(super) fn wanted(unlooked: Unlooked) -> Self {
        Self { last: None, unlooked: Some(unlooked) }
    }

    /// Why the picture rests, or did before something changed; `None` where nobody has looked.
    pub(super) fn reason(&self) -> Option<StopReason> {
        let before = self.unlooked.map(|unlooked| unlooked.before);
        before.or_else(|| self.last.as_ref().map(|look| look.stop_reason))
    }

    /// What was seen holds no more, since something has changed.
    pub(super) fn ask_again(&mut self, changed: Changed) {
        let before = self.reason().unwrap_or(StopReason::Interrupted);
        let changed = self.unlooked.map_or(changed, |earlier| earlier.changed.and(changed));
        *self = Self::wanted(Unlooked { before, changed });
    }
}
