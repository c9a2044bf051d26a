//! Fits as numbers, to be kept with a picture.

use serde::{Deserialize, Serialize};

use super::FittedTone;
use super::absolute::FittedAbsolute;
use super::agx::FittedAgx;
use super::clipped::FittedClip;
use super::duplex::FittedDuplex;
use super::pattanaik00::FittedPattanaik00;
use super::pbr_neutral::FittedPbrNeutral;
use super::reinhard02::FittedReinhard02;
use super::scale::Scale;
use super::tumblin_rushmeier::FittedTumblinRushmeier;
use super::ward_larson97::FittedWardLarson97;
use super::ward94::FittedWard94;

/// A fitted operator as plain numbers.
///
/// ```
/// use fechner_perception::{Plane, Viewing, tone};
/// let guide = Plane::filled(4, 4, 10.0);
/// let fit = tone::operator("ptyg", None).unwrap().fit(&tone::SceneGuide::of(&guide), &Viewing::default(), None);
/// let again = fit.save().restore();
/// assert_eq!(again.relative_luminance(7.0), fit.relative_luminance(7.0));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedTone(pub(super) Fit);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Fit {
    Absolute(FittedAbsolute),
    Agx(FittedAgx),
    Clip(FittedClip),
    Duplex(FittedDuplex),
    Pattanaik00(Box<FittedPattanaik00>),
    PbrNeutral(FittedPbrNeutral),
    Reinhard02(FittedReinhard02),
    Scale(Scale),
    TumblinRushmeier(FittedTumblinRushmeier),
    Ward94(FittedWard94),
    WardLarson97(Box<FittedWardLarson97>),
}

impl SavedTone {
    /// The fitted operator that was saved.
    #[must_use]
    pub fn restore(self) -> Box<dyn FittedTone> {
        match self.0 {
            Fit::Absolute(fit) => Box::new(fit),
            Fit::Agx(fit) => Box::new(fit),
            Fit::Clip(fit) => Box::new(fit),
            Fit::Duplex(fit) => Box::new(fit),
            Fit::Pattanaik00(fit) => fit,
            Fit::PbrNeutral(fit) => Box::new(fit),
            Fit::Reinhard02(fit) => Box::new(fit),
            Fit::Scale(fit) => Box::new(fit),
            Fit::TumblinRushmeier(fit) => Box::new(fit),
            Fit::Ward94(fit) => Box::new(fit),
            Fit::WardLarson97(fit) => fit,
        }
    }
}
