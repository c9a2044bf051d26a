//! The law for denoised pictures in one of the two chromatic channels.

use super::{Blending, DenoisedDifferences, DenoisedError};
use crate::csf::{CastleChromatic, ChromaticChannel, FrameTiming};
use crate::display::Viewing;
use crate::error::Error;
use crate::plane::Plane;
use crate::threshold::chromatic_threshold_map;

/// A denoised picture in one chromatic channel, on the display. Planes of one size.
#[derive(Clone, Copy, Debug)]
pub struct ChromaticPicture<'a> {
    /// Opponent signal of the channel, cd/m².
    pub signal: &'a Plane,
    /// Luminance to which the eye adapts, cd/m².
    pub luminance_cd_m2: &'a Plane,
    /// What the halves tell of the channel's error, cd/m².
    pub differences: DenoisedDifferences<'a>,
}

/// Visibility of a denoised picture's error in one chromatic channel, in which nothing moves it towards its raw mean.
/// `frames`: timing of a moving picture, whose noise is new in every frame and whose bias stays; `None` for stills.
///
/// # Errors
/// As [`CastleChromatic::new`] and [`chromatic_threshold_map`], and for an impossible timing.
pub fn chromatic_error(
    channel: ChromaticChannel,
    picture: &ChromaticPicture<'_>,
    viewing: &Viewing,
    frames: Option<FrameTiming>,
) -> Result<DenoisedError, Error> {
    let csf = CastleChromatic::new(channel, viewing.observer.csf_area_deg2)?;
    let thresholds = chromatic_threshold_map(picture.signal, picture.luminance_cd_m2, viewing, &csf)?;
    let error = thresholds.denoised_error_after(Blending::Never, &picture.differences);
    Ok(match frames {
        None => error,
        Some(timing) => {
            let factor = timing.chromatic_energy(channel)?.sqrt() as f32;
            error.clone().scaled(|plane| plane.map(|value| factor * value)).with_bias_of(&error)
        }
    })
}
