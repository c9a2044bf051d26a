//! What an eye can see in a picture.
//!
//! Given a picture in cd/m², a [`Display`] and an [`Observer`], this crate says how much error each pixel may have
//! before it is seen ([`threshold_map`]), how visible a given error is ([`ThresholdMap::measured_visibility`]) or
//! will be ([`ThresholdMap::predicted_visibility`]), and what the picture looks like on the display ([`tone`]). It
//! knows nothing of rays: the picture may come from any renderer or camera.
//!
//! # Units and shapes
//!
//! Nothing unitless enters: luminances are cd/m², frequencies cycles per degree (cpd), resolutions pixels per degree
//! (ppd), velocities degrees per second, areas square degrees. Errors come out in threshold units: an error of
//! [`visibility`] 1 is at its threshold. Pictures are [`Plane`]s, row-major from the top left, one value a pixel;
//! colour is a slice of linear Rec. 709 `[f32; 3]`. Sizes from 1×1 on, and any finite luminance from 0 to 1e8 cd/m²,
//! give finite answers; whatever cannot be answered is an [`Error`] that says what would be right. Results do not
//! depend on the number of threads.
//!
//! # A picture, and the noise in it
//!
//! Scene luminance goes through a [`tone`] operator onto a [`Display`] ([`seen`]), for all that is judged is what an
//! eye sees:
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
//! let inputs = ThresholdInputs::clean(&shown);
//! let map = threshold_map(&inputs, &viewing, &CastleCsf::default())?;
//!
//! // A path tracer's variance of the mean: how visible will its noise be?
//! let variance = Plane::filled(64, 48, 4.0);
//! let shown_variance = seen::display_variance(&*fitted, &viewing.display, &scene, &variance);
//! let visibility = map.predicted_visibility(&shown_variance);
//! assert!(visibility.get(30, 20) > 0.0);
//! # Ok::<(), fechner_perception::Error>(())
//! ```
//!
//! A picture that is noisy itself is first denoised into a [`guide`], whose variance is given along ([`GuideNoise`]),
//! so that noise does not hide noise. Colour noise is judged by [`colour`], error that moves by [`motion`], and what
//! draws the eye by [`saliency`].
//!
//! # A denoised picture
//!
//! [`denoised`] says what can be seen of the noise that a denoiser left and of what it changed, from the two halves
//! of a path tracer's samples, and where raw noise is too strong to tell.
//!
//! # Where the samples should go
//!
//! [`allocation::allocate`] finds the cheapest sample counts that leave a chosen visibility, and a bound that says
//! how far from the best they are.
//!
//! # Two pictures
//!
//! [`difference::difference`] and [`difference::colour_difference`] say whether two pictures can be told apart, and
//! where:
//!
//! ```
//! use fechner_perception::difference::difference;
//! use fechner_perception::{CastleCsf, Plane, Viewing};
//!
//! let reference = Plane::filled(96, 96, 80.0);
//! let grating = |contrast: f32| Plane::from_fn(96, 96, |x, _| 80.0 * (1.0 + contrast * (0.42 * x as f32).cos()));
//! let viewing = Viewing::default();
//! assert!(difference(&reference, &grating(0.05), &viewing, &CastleCsf::default())?.is_visible());
//! assert!(!difference(&reference, &grating(0.002), &viewing, &CastleCsf::default())?.is_visible());
//! # Ok::<(), fechner_perception::Error>(())
//! ```
//!
//! # Eyes and models
//!
//! The [`display::Observer`] says how keen the eye is and whether it scatters light ([`glare`]). Contrast sensitivity
//! functions stand behind one trait in [`csf`], threshold models from the literature behind another in [`model`];
//! both are found by name:
//!
//! ```
//! use fechner_perception::display::{Glare, Observer};
//! use fechner_perception::model::{self, ModelInputs};
//! use fechner_perception::{GuideNoise, Plane, Viewing, csf};
//!
//! let keen = Observer { glare: Glare::Cie { age_years: 30.0 }, ..Observer::keen() };
//! let viewing = Viewing { observer: keen, ..Viewing::default() };
//! let barten = csf::by_name("barten99", &viewing)?;
//! let picture = Plane::from_fn(48, 48, |x, y| if x > 24 && y > 24 { 180.0 } else { 2.0 });
//! let allowed = model::by_name("csf-bands").unwrap().allowed_standard_error_cd_m2(&ModelInputs {
//!     display_luminance_cd_m2: &picture,
//!     guide_noise: GuideNoise::Clean,
//!     image_velocity_deg_s: None,
//!     attention: None,
//!     viewing: &viewing,
//!     csf: &*barten,
//! })?;
//! assert!(allowed.get(40, 40) > allowed.get(5, 5));
//! # Ok::<(), fechner_perception::Error>(())
//! ```
//!
//! Underneath lie [`photometry`], [`adaptation`], [`tvi`], [`masking`] and [`psychometric`], each usable alone.
//!
//! Every figure is model-predicted: calibrated on gratings, not on renderings.

pub mod adaptation;
pub mod allocation;
mod bands;
pub mod colour;
pub mod csf;
pub mod denoised;
pub mod difference;
pub mod display;
pub mod eccentricity;
pub mod eotf;
mod error;
mod error_filters;
mod fft;
mod filter;
mod frame;
pub mod glare;
pub mod guide;
pub mod masking;
pub mod model;
pub mod motion;
mod names;
mod noise_gain;
pub mod opponent;
pub mod photometry;
mod pixel_density;
mod plane;
pub mod primaries;
pub mod psychometric;
mod reduced;
mod rows;
pub mod saliency;
pub mod seen;
mod sensitivity;
pub mod sequence;
mod table;
mod taps;
#[cfg(test)]
mod test_golden;
#[cfg(test)]
mod test_noise;
pub mod threshold;
pub mod tone;
pub mod tvi;
mod viewing;
pub mod visibility;

pub use csf::{CastleCsf, ContrastSensitivity};
pub use display::{Display, Eotf, Observer, Viewing};
pub use error::Error;
pub use plane::{PIXELS_PER_TASK, Plane};
pub use threshold::{GuideNoise, ThresholdInputs, ThresholdMap, threshold_map};
