//! Writes a mapped picture as a file. How it is mapped is left to [`super`].

use super::SceneFrame;
use crate::cli::kept_tone::{LIGHT, OF_DISPLAY};
use crate::cli::picture::{LIGHT_RAISES_ALPHA, note};
use anyhow::{Context, Result};
use fechner::output::{self, Attribute, DisplayedPicture, Picture, PictureFormat, attribute, channel};
use fechner_perception::tone::{AdaptationState, FittedTone};
use std::path::Path;

pub(super) fn write(
    target: &Path,
    format: PictureFormat,
    frame: &SceneFrame,
    fitted: &dyn FittedTone,
    state: Option<&AdaptationState>,
) -> Result<()> {
    match format {
        PictureFormat::Png => write_png(target, frame, fitted),
        PictureFormat::Exr => write_exr(target, frame, fitted, state),
    }
}

/// With straight alpha where it does not cover all, as a render of a transparent background; light that
/// covers nothing raises it.
fn write_png(target: &Path, frame: &SceneFrame, fitted: &dyn FittedTone) -> Result<()> {
    let (rgb, alpha) = match frame.covered(fitted) {
        Some(covered) => {
            if covered.has_light_in_front() {
                note(target, LIGHT_RAISES_ALPHA);
            }
            let (shown, alpha) = covered.straight();
            (shown, Some(alpha))
        }
        None => (frame.shown(fitted), None),
    };
    let picture = DisplayedPicture {
        size: (frame.width as u32, frame.height() as u32),
        rgb_linear_display: &rgb,
        alpha: alpha.as_deref(),
        pixel_aspect_ratio: frame.pixel_aspect_ratio,
    };
    output::write_png_for(target, &picture, &frame.viewing.display)?;
    Ok(())
}

/// In units of white what the display emits, its black with it and the room's light without: value × unit is cd/m².
fn write_exr(
    target: &Path,
    frame: &SceneFrame,
    fitted: &dyn FittedTone,
    state: Option<&AdaptationState>,
) -> Result<()> {
    let display = &frame.viewing.display;
    let mut picture = Picture::new(frame.width as u32, frame.height() as u32);
    picture.part_of = frame.part_of;
    let shown = frame.shown(fitted);
    // Multiplied by alpha, as the format has it, the display's black too: what lies behind brings its own.
    let alpha = |pixel: usize| frame.alpha.as_ref().map_or(1.0, |alpha| f64::from(alpha[pixel]));
    let emitted = |(pixel, relative): (usize, f32)| {
        let behind_cd_m2 = (1.0 - alpha(pixel)) * display.black_cd_m2;
        ((display.emitted_cd_m2(f64::from(relative)) - behind_cd_m2) / display.white_cd_m2) as f32
    };
    for (c, name) in channel::RGB.into_iter().enumerate() {
        let relative = shown.iter().map(|rgb| rgb[c]).enumerate();
        picture.push_f32(name, relative.map(emitted).collect::<Vec<_>>());
    }
    if let Some(alpha) = &frame.alpha {
        picture.push_f32(channel::ALPHA, alpha.clone());
    }
    picture.push_attribute(output::NITS_PER_UNIT, Attribute::Float(display.white_cd_m2 as f32));
    // Readers take text for UTF-8, the writer has Latin-1: only what both have in common is safe.
    let operator = fitted.describe().replace('²', "2").replace('×', "x");
    picture.push_attribute(attribute::OPERATOR, Attribute::Text(operator));
    picture.push_attribute(LIGHT, Attribute::Text(OF_DISPLAY.to_owned()));
    picture.push_attribute(attribute::OBSERVER_DISPLAY, Attribute::Text(display.name.clone()));
    picture.push_attribute(output::PIXEL_ASPECT_RATIO, Attribute::Float(frame.pixel_aspect_ratio as f32));
    picture.attributes.extend(output::display_attribute(&frame.display));
    picture.attributes.extend(output::tone_attribute(fitted));
    if let Some(state) = state {
        let text = serde_json::to_string(state).context("the eye's state could not be put into words")?;
        picture.push_attribute("fechner.adaptation", Attribute::Text(text));
    }
    output::write_exr(target, &picture)?;
    Ok(())
}
