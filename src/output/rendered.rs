//! Writes the files a render leaves: what the display shows, or every layer of it.

use super::covered::Covered;
use super::{
    Attribute, DisplayedPicture, NITS_PER_UNIT, OutputError, PartOf, Picture, channel, write_exr, write_png_for,
};
use crate::adaptive::Rendered;
use crate::adaptive::settings::LoopSettings;
use crate::adaptive::statistics::picture_variance;
use crate::film::{Film, PixelFeatures};
use crate::sampler::Half;
use fechner_perception::display::Display;
use fechner_perception::tone::map_picture;
use std::path::Path;

/// What is where no surface covers the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Background {
    /// What surrounds the scene: the files have no alpha.
    Shown,
    /// Nothing: the files have alpha.
    Transparent,
}

/// Writes the picture through its tone operator, coded for the display, and tells whether any pixel's alpha was raised.
/// A transparent background gives straight alpha, the colours being those of what covers the pixel; light that alpha
/// could not hold raises it, as [`Covered`] says.
///
/// # Errors
/// If the file cannot be written.
pub fn write_display_png(
    path: &Path,
    rendered: &Rendered,
    display: &Display,
    background: Background,
) -> Result<bool, OutputError> {
    let judgement = &rendered.judgement;
    let (width, height) = (rendered.film.width(), rendered.film.height());
    // As a file's readers have it: the judgement's own tells luminances as of each pixel's colour, by which nothing red
    // is white.
    let (tone, picture) = (judgement.tone.save().restore(), judgement.picture());
    let tone = tone.as_ref();
    match background {
        Background::Shown => {
            let shown = map_picture(tone, width as usize, picture);
            write_png_for(path, &DisplayedPicture::opaque((width, height), &shown), display)?;
            Ok(false)
        }
        Background::Transparent => {
            let coverage = rendered.film.coverage();
            let covered = Covered::of(tone, map_picture, width as usize, picture, &coverage);
            let (shown, alpha) = covered.straight();
            let opaque = DisplayedPicture::opaque((width, height), &shown);
            write_png_for(path, &DisplayedPicture { alpha: Some(&alpha), ..opaque }, display)?;
            Ok(covered.has_light_in_front())
        }
    }
}

/// Writes the picture in scene units with its layers: alpha (premultiplied) where the background is transparent,
/// albedo, normal, depth, object id, sample count, variance of the picture's luminance (scene cd/m², squared),
/// threshold (standard error in display cd/m² that is at visibility 1) and predicted visibility. A picture that is
/// denoised has the raw mean in `raw` beside it, the visible parts of its noise and of its bias, and 1 in `unproven`
/// where no witness shows that bias stays below one and a half times `target`. A crop is a part of the whole picture.
///
/// # Errors
/// If the file cannot be written.
pub fn write_layers_exr(
    path: &Path,
    rendered: &Rendered,
    settings: &LoopSettings,
    background: Background,
    attributes: &[(String, Attribute)],
    part_of: Option<PartOf>,
) -> Result<(), OutputError> {
    write_exr(path, &Picture { part_of, ..layers(rendered, settings, background, attributes) })
}

/// What [`write_layers_exr`] writes, to which more can be added.
pub fn layers<'a>(
    rendered: &'a Rendered,
    settings: &LoopSettings,
    background: Background,
    attributes: &[(String, Attribute)],
) -> Picture<'a> {
    let (film, judgement) = (&rendered.film, &rendered.judgement);
    let (nits_per_unit, target) = (settings.nits_per_unit, settings.limits.visibility_or_threshold());
    let mut picture = Picture::new(film.width(), film.height());
    let to_units = (1.0 / nits_per_unit) as f32;
    for (c, name) in channel::RGB.into_iter().enumerate() {
        let values: Vec<f32> = judgement.picture().iter().map(|rgb| rgb[c] * to_units).collect();
        picture.push_f32(name, values);
    }
    if let Some(error) = judgement.denoised_error() {
        for (c, name) in channel::RAW.into_iter().enumerate() {
            let values: Vec<f32> = judgement.estimate.rgb_cd_m2.iter().map(|rgb| rgb[c] * to_units).collect();
            picture.push_f32(name, values);
        }
        picture.push_f32(channel::VISIBILITY_OF_VARIANCE, error.variance.values().to_vec());
        picture.push_f32(channel::VISIBILITY_OF_BIAS, error.bias.values().to_vec());
        picture.push_f32(channel::UNPROVEN, error.unproven(target).into_values());
    }
    if background == Background::Transparent {
        picture.push_f32(channel::ALPHA, film.coverage());
    }
    let guide = |value: &dyn Fn(&PixelFeatures) -> f32| film.features().iter().map(value).collect::<Vec<f32>>();
    for (c, name) in channel::ALBEDO.into_iter().enumerate() {
        picture.push_f16(name, guide(&|g| g.albedo[c]));
    }
    for (c, name) in channel::NORMAL.into_iter().enumerate() {
        picture.push_f16(name, guide(&|g| g.normal[c]));
    }
    picture.push_f32(channel::DEPTH, guide(&|g| g.depth));
    picture.push_u32(channel::OBJECT_ID, film.features().iter().map(|g| g.object.id()).collect::<Vec<u32>>());
    picture.push_u32(channel::SAMPLES, sample_counts(film));
    let variance = picture_variance(film, nits_per_unit);
    picture.push_f32(channel::VARIANCE, variance.into_values());
    let threshold = judgement.allowed_standard_error_cd_m2();
    picture.push_f32(channel::THRESHOLD, threshold.into_values());
    picture.push_f32(channel::VISIBILITY, judgement.predicted.values());
    picture.push_attribute(NITS_PER_UNIT, Attribute::Float(nits_per_unit as f32));
    for (name, value) in attributes {
        picture.push_attribute(name, value.clone());
    }
    picture
}

fn sample_counts(film: &Film) -> Vec<u32> {
    film.half(Half::A).iter().zip(film.half(Half::B)).map(|(a, b)| a.samples + b.samples).collect()
}
