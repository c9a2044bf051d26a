//! Eyes that follow what moves in a frame, and see its noise smeared while the display holds the frame.
//!
//! Not for stills, nor for viewers who may look at anything at rest: what they see of the noise is more.

use super::judge::JudgeError;
use fechner_perception::Plane;
use fechner_perception::display::Display;
use fechner_perception::motion::eye_velocity_deg_s;
use fechner_perception::saliency::saliency_of_displayed;
use fechner_perception::tone::{FittedTone, map_picture};

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
    /// How fast eyes move, deg/s, that look at each pixel of a picture of scene cd/m², which should have no
    /// noise: it would stand out, too.
    pub(super) fn eye_velocity_deg_s(
        &self,
        rgb_cd_m2: &[[f32; 3]],
        size: (usize, usize),
        tone: &dyn FittedTone,
        display: &Display,
    ) -> Result<Plane, JudgeError> {
        let (width, height) = size;
        let eye = |velocity: f32, attention: f32| eye_velocity_deg_s(velocity.into(), attention.into()) as f32;
        Ok(match self {
            Self::Watched(velocity_deg_s) => Plane::filled(width, height, *velocity_deg_s as f32),
            Self::All(velocity) => velocity.map(|velocity| eye(velocity, 1.0)),
            Self::Salient(velocity) => {
                let light = |relative: f32| display.luminance_cd_m2(f64::from(relative)) as f32;
                let shown: Vec<[f32; 3]> =
                    map_picture(tone, width, rgb_cd_m2).into_iter().map(|rgb| rgb.map(light)).collect();
                velocity.combined(&saliency_of_displayed(width, &shown, velocity, display)?, eye)
            }
        })
    }
}
