//! Eyes that follow what moves in a frame, and see its noise smeared while the display holds the frame.
//!
//! Not for stills, nor for viewers who may look at anything at rest: what they see of the noise is more.

use super::judge::JudgeError;
use fechner_perception::Plane;
use fechner_perception::display::Display;
use fechner_perception::motion::eye_velocity_deg_s;
use fechner_perception::saliency::{SaliencyInputs, saliency};
use fechner_perception::tone::{FittedTone, map_picture};
use std::borrow::Cow;

/// What is known of how eyes move.
#[derive(Clone, Debug, PartialEq)]
pub enum Pursuit {
    /// They follow whatever is looked at: its speed over the picture at each pixel, deg/s.
    All(Plane),
    /// They follow it as far as it stands out in the picture and in its motion.
    Salient(Plane),
    /// They have been watched: their speed, deg/s.
    Watched(f64),
}

impl Pursuit {
    /// How fast eyes move, deg/s, that look at each pixel of a picture of scene cd/m².
    pub(super) fn eye_velocity_deg_s(
        &self,
        rgb_cd_m2: &[[f32; 3]],
        size: (usize, usize),
        tone: &dyn FittedTone,
        display: &Display,
    ) -> Result<Plane, JudgeError> {
        let (width, height) = size;
        let (image_velocity_deg_s, attention) = match self {
            Self::Watched(velocity_deg_s) => return Ok(Plane::filled(width, height, *velocity_deg_s as f32)),
            Self::All(velocity) => (velocity, Plane::filled(width, height, 1.0)),
            Self::Salient(velocity) => (velocity, attention(rgb_cd_m2, size, velocity, tone, display)?),
        };
        let eye = |velocity: f32, attention| eye_velocity_deg_s(f64::from(velocity), f64::from(attention)) as f32;
        Ok(image_velocity_deg_s.combined(&attention, eye))
    }
}

/// How much each place attracts the eye (Itti and others 1998, with motion as Yee and others 2001 add it).
fn attention(
    rgb_cd_m2: &[[f32; 3]],
    (width, height): (usize, usize),
    velocity_deg_s: &Plane,
    tone: &dyn FittedTone,
    display: &Display,
) -> Result<Plane, JudgeError> {
    let finite: Cow<'_, [[f32; 3]]> = if rgb_cd_m2.iter().flatten().all(|channel| channel.is_finite()) {
        rgb_cd_m2.into()
    } else {
        rgb_cd_m2.iter().map(|rgb| rgb.map(|channel| if channel.is_finite() { channel } else { 0.0 })).collect()
    };
    let shown = map_picture(tone, width, &finite);
    let white_cd_m2 = display.luminance_cd_m2(1.0);
    let light = |relative: f32| (display.luminance_cd_m2(f64::from(relative)) / white_cd_m2) as f32;
    let [red, green, blue] =
        [0, 1, 2].map(|channel| Plane::from_fn(width, height, |x, y| light(shown[y * width + x][channel])));
    Ok(saliency(&SaliencyInputs { rgb: [&red, &green, &blue], velocity: Some(velocity_deg_s) })?)
}
