//! Tone operators: from scene luminance to what a display shows.
//!
//! An operator is first fitted to a denoised guide of the picture and then frozen, so that the same scene light
//! always becomes the same display light while a picture refines, and error can be judged as it will be seen.

use std::fmt::Debug;

use crate::display::Display;
use crate::photometry::luminance;
use crate::plane::Plane;

mod absolute;
mod constant;
mod statistics;
mod tumblin_rushmeier;
mod ward94;

pub use absolute::Absolute;
pub use constant::Constant;
pub use tumblin_rushmeier::TumblinRushmeier;
pub use ward94::Ward94;

/// What an operator may look at when it is fitted.
#[derive(Clone, Copy, Debug)]
pub struct SceneGuide<'a> {
    /// Scene luminance of the denoised guide, cd/m².
    pub luminance_cd_m2: &'a Plane,
}

/// A way to bring scene light onto a display.
pub trait ToneOperator: Send + Sync {
    /// What the command line calls it.
    fn name(&self) -> &'static str;

    /// Freezes the operator for one picture and display.
    fn fit(&self, guide: &SceneGuide<'_>, display: &Display) -> Box<dyn FittedTone>;
}

/// A tone operator with every parameter decided.
pub trait FittedTone: Send + Sync + Debug {
    /// Linear display light for scene luminance `scene_cd_m2`: 0 is the display's black, 1 its white.
    ///
    /// May exceed 1, which the display then clips; never NaN, never falls as its argument rises. NaN counts as black.
    fn relative_luminance(&self, scene_cd_m2: f32) -> f32;

    /// The fit in one line, for reports.
    fn describe(&self) -> String;

    /// Linear display RGB in 0..1 for scene RGB in cd/m².
    ///
    /// The colour is scaled to the operator's luminance; what then does not fit the display is mixed with the grey of
    /// equal luminance until it does, which keeps hue and luminance where clipping each channel would not. Black stays
    /// black.
    fn map_rgb(&self, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        let rgb = rgb_cd_m2.map(|channel| if channel.is_finite() { channel.max(0.0) } else { 0.0 });
        let scene = luminance(rgb);
        if scene <= 0.0 {
            return [0.0; 3];
        }
        let target = self.relative_luminance(scene).clamp(0.0, 1.0);
        desaturate_into_gamut(rgb.map(|channel| channel / scene * target), target)
    }
}

/// Mixes `rgb` with the grey of its own luminance `grey` (0..1) until no channel exceeds 1.
fn desaturate_into_gamut(rgb: [f32; 3], grey: f32) -> [f32; 3] {
    let largest = rgb.into_iter().fold(0.0, f32::max);
    if largest <= 1.0 {
        return rgb;
    }
    let keep = ((1.0 - grey) / (largest - grey)).clamp(0.0, 1.0);
    rgb.map(|channel| (grey + keep * (channel - grey)).clamp(0.0, 1.0))
}

const OPERATOR_NAMES: [&str; 4] = ["constant", "absolute", "ward94", "tumblin-rushmeier"];

/// The operator of that name. `exposure_stops` multiplies what it shows by 2^stops; `None` is 0.
///
/// ```
/// use fechner_perception::tone;
/// assert!(tone::operator("ward94", None).is_some());
/// assert!(tone::operator("darkroom", None).is_none());
/// ```
#[must_use]
pub fn operator(name: &str, exposure_stops: Option<f64>) -> Option<Box<dyn ToneOperator>> {
    let stops = exposure_stops.filter(|stops| stops.is_finite()).unwrap_or(0.0);
    let exposure = stops.clamp(-100.0, 100.0).exp2();
    Some(match name {
        "constant" => Box::new(Constant { exposure }),
        "absolute" => Box::new(Absolute { exposure }),
        "ward94" => Box::new(Ward94 { exposure }),
        "tumblin-rushmeier" => Box::new(TumblinRushmeier { exposure }),
        _ => return None,
    })
}

/// The names that [`operator`] knows.
#[must_use]
pub fn operator_names() -> &'static [&'static str] {
    &OPERATOR_NAMES
}

/// A fit that multiplies scene luminance by one number.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    operator: &'static str,
    relative_per_cd_m2: f64,
}

impl FittedTone for Scale {
    fn relative_luminance(&self, scene_cd_m2: f32) -> f32 {
        // `max` turns NaN into 0.
        (f64::from(scene_cd_m2.max(0.0)) * self.relative_per_cd_m2).min(f64::from(f32::MAX)) as f32
    }

    fn describe(&self) -> String {
        format!("{}: white at {:.4} cd/m² of the scene", self.operator, self.relative_per_cd_m2.recip())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guides() -> Vec<Plane> {
        let mut sparse = Plane::filled(8, 8, 0.0);
        sparse.values_mut()[3] = 1e30;
        let mut broken = Plane::filled(8, 8, 5.0);
        broken.values_mut()[0] = f32::NAN;
        broken.values_mut()[1] = f32::INFINITY;
        vec![
            Plane::filled(0, 0, 0.0),
            Plane::filled(1, 1, 0.0),
            Plane::filled(1, 1, 1e-40),
            Plane::filled(5, 4, 100.0),
            Plane::from_fn(32, 32, |x, y| ((x * y) as f32).exp2().min(1e30)),
            sparse,
            broken,
        ]
    }

    #[test]
    fn every_operator_survives_every_picture_and_never_falls() {
        for name in operator_names() {
            for guide in guides() {
                let operator = operator(name, Some(0.5)).unwrap();
                assert_eq!(&operator.name(), name);
                let fitted = operator.fit(&SceneGuide { luminance_cd_m2: &guide }, &Display::default());
                let mut last = 0.0;
                for scene in [0.0, 1e-40, 1e-4, 0.1, 1.0, 10.0, 1e3, 1e8, 1e30, f32::MAX] {
                    let relative = fitted.relative_luminance(scene);
                    assert!(relative >= last && relative.is_finite(), "{name} at {scene}: {relative} after {last}");
                    last = relative;
                }
                assert!(fitted.relative_luminance(f32::NAN).is_finite());
                for rgb in [[0.0; 3], [1e30, 0.0, 0.0], [f32::NAN, 1.0, f32::INFINITY], [3.0, 100.0, 0.2]] {
                    let shown = fitted.map_rgb(rgb);
                    assert!(shown.iter().all(|channel| (0.0..=1.0).contains(channel)), "{name} {rgb:?} {shown:?}");
                }
                assert_eq!(fitted.map_rgb([0.0; 3]), [0.0; 3]);
            }
        }
    }

    #[test]
    fn colours_too_bright_for_the_display_keep_their_luminance() {
        let fitted = Scale { operator: "test", relative_per_cd_m2: 0.01 };
        let shown = fitted.map_rgb([200.0, 20.0, 20.0]);
        let wanted = luminance([2.0, 0.2, 0.2]);
        assert!((luminance(shown) - wanted).abs() < 1e-4, "{shown:?}");
        assert!((shown[0] - 1.0).abs() < 1e-5 && shown[1] < shown[0] && shown[1] == shown[2]);
        assert_eq!(fitted.map_rgb([500.0, 400.0, 600.0]), [1.0; 3]);
    }
}
