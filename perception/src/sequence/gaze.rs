//! Where the point of the retina that sees a pixel of one frame is in the frames around it.

use crate::csf::DRIFT_DEG_S;
use crate::display::{Display, PixelDensity};
use crate::motion::eye_velocity_deg_s;
use crate::plane::Plane;
use rayon::prelude::*;

/// How what a frame shows moves over it, in pixels, x to the right and y down. What is not finite counts as rest.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameMotion {
    /// Where each pixel's content will be one frame later, less where it is.
    pub to_next: [Plane; 2],
    /// Where each pixel's content was one frame earlier, less where it is.
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
        let pixel = self.pixel(motion.to_next[0].width(), motion.to_next[0].height());
        let (x, y) = eye_step(motion, pixel, towards, display);
        self.moved(x, y)
    }

    fn moved(self, x: f32, y: f32) -> Self {
        Self { x: self.x + x, y: self.y + y }
    }
}

/// How far an eye that follows a pixel's content goes until the next or the previous frame, pixels.
fn eye_step(motion: &FrameMotion, pixel: usize, towards: Towards, display: &Display) -> (f32, f32) {
    let [x, y] = match towards {
        Towards::Earlier => &motion.to_previous,
        Towards::Later => &motion.to_next,
    };
    let (x, y) = (x.values()[pixel], y.values()[pixel]);
    if !(x.is_finite() && y.is_finite()) {
        return (0.0, 0.0);
    }
    let gain = pursuit_gain((x, y), display);
    (gain * x, gain * y)
}

/// The longest time over which a frame is smeared, seconds: of one that is held for longer the eye sees parts one
/// after the other.
const LONGEST_SMEAR_S: f64 = 1.0 / 24.0;
/// Places that half a smear is summed over: for each pixel of its length, beside as many as tell which part of a
/// short one lies within the pixel itself.
const TAPS_PER_PIXEL: f32 = 2.0;
const MIN_TAPS: f32 = 6.0;
const MAX_TAPS: f32 = 64.0;
/// Pixels from a pixel's centre to its border.
const WITHIN_PIXEL: f32 = 0.5;

/// Places that half a smear of `length` pixels is summed over.
fn taps(length: f32) -> f32 {
    if length <= WITHIN_PIXEL { 1.0 } else { (MIN_TAPS + TAPS_PER_PIXEL * length).min(MAX_TAPS).ceil() }
}

/// The way of each pixel's retinal place over a frame, from where it is when the frame is half through its time,
/// pixels.
#[derive(Clone, Copy, Debug)]
struct Smear {
    backward: (f32, f32),
    forward: (f32, f32),
}

/// How an eye that follows smears a frame while it is held. Place and time are taken apart: a frame is smeared first,
/// and weighed by its time then. Fresh noise keeps 0.81, 0.61, 0.46 and 0.36 of its visibility at rest under 2, 5, 10
/// and 20 pixels a frame so, where its moved spectrum says 0.89, 0.68, 0.51 and 0.37 (24 frames a second, 30 pixels a
/// degree).
pub(super) struct Smears(Vec<Smear>);

impl Smears {
    pub(super) fn of(motion: &FrameMotion, display: &Display) -> Self {
        let lit_s = display.persistence / display.frames_per_second;
        let half = (0.5 * lit_s.min(LONGEST_SMEAR_S) * display.frames_per_second) as f32;
        let of_pixel = |pixel: usize| {
            let step = |towards| {
                let (x, y) = eye_step(motion, pixel, towards, display);
                (half * x, half * y)
            };
            Smear { backward: step(Towards::Earlier), forward: step(Towards::Later) }
        };
        Self((0..motion.to_next[0].values().len()).into_par_iter().map(of_pixel).collect())
    }

    /// The mean of what passes each place.
    pub(super) fn over(&self, plane: &Plane) -> Plane {
        let (width, height) = (plane.width(), plane.height());
        Plane::from_fn(width, height, |x, y| {
            let place = Place::center_of(x, y);
            let Smear { backward, forward } = self.0[y * width + x];
            let sum_of = |(x, y): (f32, f32)| {
                let taps = taps(x.hypot(y));
                let tap = |index: u32| {
                    let share = (index as f32 + 0.5) / taps;
                    plane.values()[place.moved(share * x, share * y).pixel(width, height)]
                };
                (0..taps as u32).map(tap).sum::<f32>() / taps
            };
            0.5 * (sum_of(backward) + sum_of(forward))
        })
    }
}

/// Share of a motion, in pixels a frame, that the eye goes along with. Its drift has no direction, and the contrast
/// sensitivity function was measured with it.
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
