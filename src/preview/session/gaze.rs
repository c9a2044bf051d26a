//! The pointer as gaze: thresholds are those of an eye that looks where it points.
//!
//! A new place means new thresholds, which cost a look. So a gaze is followed when it has gone farther than the eye's own margin,
//! and not so often that looks would be most of the work.

use crate::preview::shared::Shared;
use fechner_perception::eccentricity::{GAZE_MARGIN_DEG, Gaze};
use std::time::{Duration, Instant};

/// Between two places that are followed.
const LEAST_INTERVAL: Duration = Duration::from_millis(700);

/// Where thresholds are of, and how far one may look from there.
pub(super) struct Follower {
    followed: Option<Gaze>,
    since: Option<Instant>,
    least_move_px: f64,
}

impl Follower {
    pub(super) fn new(pixels_per_degree: f64) -> Self {
        Self { followed: None, since: None, least_move_px: GAZE_MARGIN_DEG * pixels_per_degree }
    }

    /// Whether the gaze is elsewhere, and it is time to follow.
    pub(super) fn is_due(&self, shared: &Shared) -> bool {
        let is_elsewhere = match (self.followed, shared.gaze()) {
            (None, None) => false,
            (Some(a), Some(b)) => (a.x_px - b.x_px).hypot(a.y_px - b.y_px) >= self.least_move_px,
            _ => true,
        };
        is_elsewhere && self.since.is_none_or(|since| since.elapsed() >= LEAST_INTERVAL)
    }

    /// The gaze from here on.
    pub(super) fn follow(&mut self, shared: &Shared, pixels_per_degree: f64) -> Option<Gaze> {
        self.followed = shared.gaze();
        self.since = Some(Instant::now());
        self.least_move_px = GAZE_MARGIN_DEG * pixels_per_degree;
        self.followed
    }
}
