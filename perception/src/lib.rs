//! What an eye can see in a picture.
//!
//! Given a picture in cd/m², a [`Display`] and an [`Observer`], this crate says how much error each pixel may have
//! before it is seen ([`threshold_map`]), how visible a given error is ([`ThresholdMap::measured_visibility`]) or will be
//! ([`ThresholdMap::predicted_visibility`]), and what the picture looks like on the display ([`tone`]). It knows nothing of
//! rays: the picture may come from any renderer or camera.
//!
//! # Units
//!
//! Nothing unitless enters: luminances are cd/m², frequencies cycles per degree (cpd), resolutions pixels per degree
//! (ppd). Errors come out in threshold units: an error of [`visibility`] 1 is at its threshold.
//!
//! # Example
//!
//! ```
//! use fechner_perception::{CastleCsf, Display, Plane, ThresholdInputs, Viewing, seen, threshold_map, tone};
//!
//! let scene = Plane::from_fn(64, 48, |x, _| 10.0 + x as f32);
//! let viewing = Viewing::of(Display::preset("laptop").unwrap());
//! let operator = tone::operator("ward94", None).unwrap();
//! let fitted = operator.fit(&tone::SceneGuide::of(&scene), &viewing, None);
//! let shown = seen::display_luminance(&*fitted, &viewing.display, &scene);
//!
//! let inputs = ThresholdInputs { display_luminance_cd_m2: &shown, guide_variance: None };
//! let map = threshold_map(&inputs, &viewing, &CastleCsf::default())?;
//!
//! // A path tracer's variance of the mean: how visible will its noise be?
//! let variance = Plane::filled(64, 48, 4.0);
//! let shown_variance = seen::display_variance(&*fitted, &viewing.display, &scene, &variance);
//! let visibility = map.predicted_visibility(&shown_variance);
//! assert!(visibility.get(30, 20) > 0.0);
//! # Ok::<(), fechner_perception::Error>(())
//! ```

pub mod adaptation;
pub mod allocation;
mod bands;
pub mod colour;
pub mod csf;
pub mod difference;
pub mod display;
pub mod eotf;
mod error;
mod fft;
mod filter;
pub mod glare;
pub mod guide;
pub mod masking;
pub mod model;
pub mod motion;
mod noise_gain;
pub mod opponent;
pub mod photometry;
mod plane;
pub mod primaries;
pub mod psychometric;
mod reduced;
mod rows;
pub mod saliency;
pub mod seen;
mod sensitivity;
mod taps;
#[cfg(test)]
mod test_noise;
pub mod threshold;
pub mod tone;
pub mod tvi;
pub mod visibility;

pub use csf::{CastleCsf, ContrastSensitivity};
pub use display::{Display, Eotf, Observer, Viewing};
pub use error::Error;
pub use plane::Plane;
pub use threshold::{ThresholdInputs, ThresholdMap, threshold_map};
