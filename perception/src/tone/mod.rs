//! Tone operators: from scene luminance to what a display shows.
//!
//! An operator is first fitted to a denoised guide of the picture, to who looks at which display, and, over time, to
//! what the eye is adapted to. The fit is frozen, so that the same scene light always becomes the same display light
//! while a picture refines, and error can be judged as it will be seen; and it is made of numbers, so that it can be
//! saved with the picture ([`SavedTone`]).
//!
//! Scene light is cd/m², display light linear, 0 for the display's black and 1 for its white. The display's transfer
//! function is not the operator's business: see [`Eotf`](crate::Eotf).
//!
//! Do not use an operator on a picture that is display-referred already; only `absolute` leaves it as it is.

use std::fmt::Debug;

use crate::display::{PixelDensity, Viewing};
use crate::photometry::luminance;

mod absolute;
pub mod acuity;
mod agx;
mod clipped;
mod coloured;
mod constant;
mod duplex;
mod durand_dorsey00;
mod fast_power;
mod ferwerda96;
mod field;
pub mod gamut;
mod guide;
mod names;
mod pattanaik00;
mod pbr_neutral;
mod picture;
mod reinhard02;
mod saved;
mod scale;
mod scene_light;
mod scheel00;
mod screen;
#[cfg(test)]
mod seed_tests;
mod statistics;
#[cfg(test)]
mod tests;
pub mod time;
mod tint;
mod tumblin_rushmeier;
mod veil;
mod ward94;
mod ward_larson97;
mod words;

pub use absolute::Absolute;
pub use agx::Agx;
pub use clipped::{Linear, Srgb};
pub use coloured::coloured;
pub use constant::{Constant, Exposure};
pub use durand_dorsey00::DurandDorsey00;
pub use ferwerda96::Ferwerda96;
pub use field::AdaptationScope;
pub use guide::{Pixel, SceneGuide};
pub use names::{
    DEFAULT_OPERATOR, Effects, ToneSettings, operator, operator_initials, operator_named, operator_names, operator_with,
};
pub use pattanaik00::Pattanaik00;
pub use pbr_neutral::PbrNeutral;
pub use picture::{map_picture, map_pixels};
pub use reinhard02::Reinhard02;
pub use saved::SavedTone;
pub use scene_light::SceneLight;
pub use scheel00::Scheel00;
pub use time::{AdaptationState, Goal, Kinetics};
pub use tumblin_rushmeier::TumblinRushmeier;
pub use ward_larson97::{Ceiling, WardLarson97};
pub use ward94::Ward94;

use acuity::AcuityFilter;

/// A way to bring scene light onto a display. Its `Debug` form tells operators of different settings apart.
///
/// One of your own can choose among this crate's fits, by what it sees of the guide; fits of another kind cannot be
/// made ([`FittedTone`]).
pub trait ToneOperator: Send + Sync + Debug {
    /// The operator's name on the command line.
    fn name(&self) -> &'static str;

    /// Freezes the operator for one picture, its observer, and, where time passes, what the observer's eyes are
    /// adapted to; without a state they are adapted to the picture.
    fn fit(&self, guide: &SceneGuide<'_>, viewing: &Viewing, state: Option<&AdaptationState>) -> Box<dyn FittedTone>;

    /// What eyes would adapt to if the view stayed as the guide shows it: the goal of [`AdaptationState::after`].
    fn goal(&self, guide: &SceneGuide<'_>, density: PixelDensity) -> Goal {
        Goal::of(guide, density)
    }

    /// How fast the eyes that it simulates adapt.
    fn kinetics(&self) -> Kinetics {
        Kinetics::PATTANAIK_2000
    }

    /// Whether a state of the eyes changes what it shows.
    fn sees_adaptation(&self) -> bool {
        false
    }

    /// Whether darkness in the guide changes what it shows, as it does to eyes. Cameras leave it out.
    fn counts_darkness(&self) -> bool {
        self.sees_adaptation()
    }

    /// Whether it loses colour in dim light whatever it is asked for.
    fn always_loses_colour(&self) -> bool {
        false
    }

    /// Whether [`ToneSettings::scope`] changes what it shows.
    fn knows_places(&self) -> bool {
        false
    }

    /// Which of [`ToneSettings::effects`] it can show and leave out.
    fn optional_effects(&self) -> Effects {
        Effects::default()
    }

    /// Whether it looks at what the rods see of the guide ([`SceneGuide::scotopic_cd_m2`]).
    fn sees_rods(&self) -> bool {
        false
    }
}

/// Darkest grey whose colours are asked for: below it ratios of channels are rounding.
const MIN_GREY_CD_M2: f32 = 1e-6;

/// A tone operator with every parameter decided.
///
/// There are those of this crate and no others: each can be kept with a picture, as one of the kinds that a
/// [`SavedTone`] holds.
pub trait FittedTone: Send + Sync + Debug {
    /// Linear display light for a grey of scene luminance `scene_cd_m2` at `pixel`, or for the pixel's own colour
    /// ([`coloured()`]): 0 is the display's black, 1 its white.
    ///
    /// May exceed 1, which the display then clips; never NaN, never falls as its argument rises. NaN counts as black.
    fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32;

    /// The fit in one line, for reports.
    fn describe(&self) -> String;

    /// The fit as numbers.
    fn save(&self) -> SavedTone;

    /// Linear display light for a grey of scene luminance `scene_cd_m2`, cd/m², of an eye that is adapted to the view
    /// as a whole: [`relative_luminance_at`](Self::relative_luminance_at) [`Pixel::NOWHERE`].
    fn relative_luminance(&self, scene_cd_m2: f32) -> f32 {
        self.relative_luminance_at(Pixel::NOWHERE, scene_cd_m2)
    }

    /// Linear display RGB in 0..1 for scene RGB in cd/m² at `pixel`.
    ///
    /// Unless the operator says otherwise the colour is scaled to the operator's luminance; what then does not fit
    /// the display is mixed with the grey of equal luminance until it does, which keeps hue and luminance where
    /// clipping each channel would not.
    fn map_rgb_at(&self, pixel: Pixel, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        let rgb = gamut::light(rgb_cd_m2);
        let scene = luminance(rgb);
        gamut::with_luminance(rgb, scene, self.relative_luminance_at(pixel, scene))
    }

    /// Linear display RGB in 0..1 for scene RGB in cd/m², of an eye that is adapted to the view as a whole:
    /// [`map_rgb_at`](Self::map_rgb_at) [`Pixel::NOWHERE`].
    fn map_rgb(&self, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        self.map_rgb_at(Pixel::NOWHERE, rgb_cd_m2)
    }

    /// Display light, 0 to 1, for each cd/m² of a chromatic signal of the scene: what is left of a faint tint on a
    /// grey of luminance `scene_cd_m2` at `pixel`. What a clip of the display hides of it is not taken off, since
    /// noise may reach below.
    ///
    /// Unless the operator says otherwise it keeps the ratios of a colour's channels.
    fn chromatic_slope_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let luminance = scene_cd_m2.max(MIN_GREY_CD_M2);
        self.relative_luminance_at(pixel, luminance).min(1.0) / luminance
    }

    /// Display light, 0 to 1 and on, for each cd/m² of the scene, where that is one number for all greys of the
    /// picture; `None` where greys are bent.
    fn relative_per_cd_m2(&self) -> Option<f64> {
        None
    }

    /// Whether every colour is shown as bright as a grey of its luminance, and so as white where that is. Not where
    /// each channel is bent or clipped by itself: a blue of any luminance stays blue ([`coloured()`]).
    fn keeps_luminance(&self) -> bool {
        true
    }

    /// The operator itself, where this one knows the colours of a picture ([`coloured()`]): for light of other colours.
    fn without_colours(&self) -> Option<&dyn FittedTone> {
        None
    }

    /// The loss of fine detail that the operator simulates. It mixes pixels: scene light goes through it before
    /// [`map_rgb_at`](FittedTone::map_rgb_at), and so does noise ([`AcuityFilter::transfer`]).
    fn acuity(&self) -> Option<AcuityFilter> {
        None
    }
}
