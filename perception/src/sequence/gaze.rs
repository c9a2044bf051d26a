//! Where the point of the retina that sees a pixel of one frame is in the frames around it.

use crate::csf::DRIFT_DEG_S;
use crate::display::{Display, PixelDensity};
use crate::motion::eye_velocity_deg_s;
use crate::plane::Plane;

/// How what a frame shows moves over it, in pixels, x to the right and y down. What is not finite counts as rest.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameMotion {
    /// Where each pixel's content will be one frame later, less where it is.
    pub to_next: [Plane; 2],
    /// Where it was one frame earlier, less where it is.
    pub to_previous: [Plane; 2],
}

/// Direction in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Towards {
    Earlier,
    Later,
}

/// A place in a frame, in pixels from its corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    x: f32,
    y: f32,
}

impl Place {
    pub(super) fn center_of(x: usize, y: usize) -> Self {
        Self { x: x as f32 + 0.5, y: y as f32 + 0.5 }
    }

    /// The pixel that it lies in; the nearest one for places outside.
    pub(super) fn pixel(self, width: usize, height: usize) -> usize {
        let index = |at: f32, count: usize| (at.max(0.0) as usize).min(count - 1);
        index(self.y, height) * width + index(self.x, width)
    }

    /// One frame on, with an eye that follows what is here.
    pub(super) fn followed(self, motion: Option<&FrameMotion>, towards: Towards, display: &Display) -> Self {
        let Some(motion) = motion else { return self };
        let [x, y] = match towards {
            Towards::Earlier => &motion.to_previous,
            Towards::Later => &motion.to_next,
        };
        let pixel = self.pixel(x.width(), x.height());
        let (x, y) = (x.values()[pixel], y.values()[pixel]);
        if !(x.is_finite() && y.is_finite()) {
            return self;
        }
        let gain = pursuit_gain((x, y), display);
        Self { x: self.x + gain * x, y: self.y + gain * y }
    }
}

/// Share of a motion, in pixels a frame, that the eye goes along with. Its drift has no direction, and the contrast sensitivity
/// function was measured with it.
fn pursuit_gain((x, y): (f32, f32), display: &Display) -> f32 {
    let PixelDensity { horizontal, vertical, .. } = display.pixel_density();
    let degrees = (f64::from(x) / horizontal).hypot(f64::from(y) / vertical);
    let image_velocity_deg_s = degrees * display.frames_per_second;
    if image_velocity_deg_s < DRIFT_DEG_S {
        return 1.0;
    }
    let followed = eye_velocity_deg_s(image_velocity_deg_s, 1.0) - DRIFT_DEG_S;
    (followed / image_velocity_deg_s) as f32
}
