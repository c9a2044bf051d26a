//! The hand that moves the camera. Where it goes is left to `orbit`.

use crate::preview::orbit::Held;
use crate::scene::Camera;
use std::time::{Duration, Instant};

/// How long a camera must have rested for the whole picture to be begun: its film takes longer than a frame to make.
const REST: Duration = Duration::from_millis(120);

/// The camera as it is held, and whether the picture is of it.
pub(super) struct Hand {
    pub(super) held: Held,
    /// Whether the camera is another than the tracer's.
    has_moved: bool,
    /// When it was moved last, unless the picture is the first.
    moved_at: Option<Instant>,
}

impl Hand {
    /// The hand before the first picture, which begins as one after a movement does.
    pub(super) fn at_home(camera: &Camera) -> Self {
        Self { held: Held::at_home(camera), has_moved: true, moved_at: None }
    }

    /// Notes that the camera is another from now on.
    pub(super) fn moved(&mut self) {
        self.has_moved = true;
        self.moved_at = Some(Instant::now());
    }

    /// Whether the picture is of another camera.
    pub(super) fn has_moved(&self) -> bool {
        self.has_moved
    }

    /// Whether the picture is of another camera, asked by who makes the picture of this one now: it is not afterwards.
    pub(super) fn take_movement(&mut self) -> bool {
        std::mem::take(&mut self.has_moved)
    }

    /// Whether anybody has moved the camera.
    pub(super) fn was_ever_moved(&self) -> bool {
        self.moved_at.is_some()
    }

    /// Time until the camera has rested long enough for the whole picture; `None` where it has.
    pub(super) fn until_rest(&self) -> Option<Duration> {
        self.moved_at.and_then(|moved_at| REST.checked_sub(moved_at.elapsed()))
    }
}
