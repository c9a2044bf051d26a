//! Finds how what a picture shows moves, by the channels of a file.

use crate::cli::channels;
use crate::cli::picture::InputPicture;
use anyhow::{Result, bail};
use fechner::exr_read::ExrImage;
use fechner_perception::model::{self, ThresholdModel};
use fechner_perception::motion::image_velocity_deg_s;
use fechner_perception::saliency::saliency_of_displayed;
use fechner_perception::sequence::FrameMotion;
use fechner_perception::tone::FittedTone;
use fechner_perception::{Plane, Viewing};
use std::path::Path;

/// How what a picture shows moves.
pub(super) struct Motion {
    /// Speed over the picture, of the motions to the next frame and to the previous one the slower.
    pub(super) image_velocity_deg_s: Plane,
    /// How much each pixel attracts the gaze, 0 to 1; `None`: everything is followed.
    pub(super) attention: Option<Plane>,
}

impl Motion {
    pub(super) fn of(
        motion: &FrameMotion,
        by_saliency: bool,
        guide: &InputPicture,
        fitted: Option<&dyn FittedTone>,
        viewing: &Viewing,
    ) -> Result<Self> {
        let speed = |[x, y]: &[Plane; 2]| image_velocity_deg_s(x, y, &viewing.display);
        let image_velocity_deg_s = speed(&motion.to_next)?.combined(&speed(&motion.to_previous)?, f32::min);
        let attention = if by_saliency {
            let rgb = guide.displayed_rgb(fitted, viewing);
            Some(saliency_of_displayed(guide.size().0, &rgb, &image_velocity_deg_s, &viewing.display)?)
        } else {
            None
        };
        Ok(Self { image_velocity_deg_s, attention })
    }
}

/// Motion in pixels to the next frame and to the previous one, under the names that renderers give it.
pub(super) fn velocity_in(path: &Path, exr: &ExrImage, frames_per_second: f64) -> Result<FrameMotion> {
    let motion = channels::motion_planes(path, exr)?;
    if let Some(layer) = channels::motion_layer(exr) {
        answer!("motion from the channels of {layer} at {frames_per_second} frames a second");
    }
    Ok(motion)
}

pub(super) fn check_knows_motion(model: &dyn ThresholdModel) -> Result<()> {
    if model.knows_motion() {
        return Ok(());
    }
    let knows = |name: &&&str| model::by_name(name).is_some_and(|model| model.knows_motion());
    let known: Vec<&str> = model::names().iter().filter(knows).copied().collect();
    bail!("--velocity: the model {} knows no motion; {} do", model.name(), known.join(", "))
}
