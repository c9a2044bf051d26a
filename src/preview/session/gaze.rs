//! The pointer as gaze: thresholds are those of an eye that looks where it points.
//!
//! A new place means new thresholds, which cost a look. So a gaze is followed when it has gone farther than the eye's
//! own margin, and not so often that looks would be most of the work.

use crate::preview::shared::Shared;
use fechner_perception::display::PixelDensity;
use fechner_perception::eccentricity::{GAZE_MARGIN_DEG, Gaze};
use std::time::{Duration, Instant};

/// Between two places that are followed.
const MIN_INTERVAL: Duration = Duration::from_millis(700);

/// Where thresholds are of, and how far one may look from there.
pub(super) struct Follower {
    followed: Option<Gaze>,
    since: Option<Instant>,
    density: PixelDensity,
}

impl Follower {
    pub(super) fn new(density: PixelDensity) -> Self {
        Self { followed: None, since: None, density }
    }

    /// Whether the gaze is elsewhere, and it is time to follow.
    pub(super) fn is_due(&self, shared: &Shared) -> bool {
        let is_elsewhere = match (self.followed, shared.gaze()) {
            (None, None) => false,
            (Some(a), Some(b)) => degrees_apart(a, b, self.density) >= GAZE_MARGIN_DEG,
            _ => true,
        };
        is_elsewhere && self.since.is_none_or(|since| since.elapsed() >= MIN_INTERVAL)
    }

    /// The gaze from here on.
    pub(super) fn follow(&mut self, shared: &Shared, density: PixelDensity) -> Option<Gaze> {
        self.followed = shared.gaze();
        self.since = Some(Instant::now());
        self.density = density;
        self.followed
    }
}

/// How far two places are apart, in degrees as the middle of the picture has them.
fn degrees_apart(a: Gaze, b: Gaze, density: PixelDensity) -> f64 {
    ((a.x_px - b.x_px) / density.horizontal).hypot((a.y_px - b.y_px) / density.vertical)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oblong_pixels_are_as_far_apart_as_they_look() {
        let density = PixelDensity { horizontal: 30.0, vertical: 60.0 };
        let at = |x_px, y_px| Gaze { x_px, y_px };
        assert_eq!(degrees_apart(at(10.0, 10.0), at(40.0, 10.0), density), 1.0);
        assert_eq!(degrees_apart(at(10.0, 10.0), at(10.0, 70.0), density), 1.0);
    }
}
