//! One exposure for the whole picture, as a camera has it.
//!
//! For pictures that a camera might have taken, in which ratios of light are kept. Not for scenes of more range than
//! the display's, whose lights or shadows are lost, and not for what an eye would see: adaptation is ignored.

use super::scale::Scale;
use super::statistics::SceneStatistics;
use super::time::AdaptationState;
use super::{FittedTone, SceneGuide, ToneOperator};
use crate::display::Viewing;
use crate::plane::Plane;

/// How long a camera would expose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Exposure {
    /// The geometric mean of the middle 94 % of the pixels becomes middle grey (0.18), unless that would clip more
    /// than one pixel in twenty, when the 95 % point becomes white. Neither fireflies nor a small lamp in view move
    /// it, and a night scene is not lifted until its windows burn out.
    #[default]
    Automatic,
    /// The darkest tenth ends at middle grey: detail in the shadows, whatever becomes of the rest.
    Long,
    /// One pixel in a thousand is white: detail in the lights, whatever becomes of the rest.
    Short,
}

/// Multiplies by one number, as a camera's exposure does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// Multiplies the result: 2^stops.
    pub exposure: f64,
    /// Which pixels are exposed for.
    pub time: Exposure,
}

/// Linear light of middle grey.
pub(super) const KEY: f64 = 0.18;
/// Share of the pixels left out at each end before averaging.
const TRIM: f64 = 0.03;
/// Share of the pixels that must not clip.
const UNCLIPPED: f64 = 0.95;
const DARK: f64 = 0.1;
const LIGHT: f64 = 0.999;

/// Display light for one cd/m² of the scene; 1 for a black picture.
pub(super) fn exposure_of(luminance_cd_m2: &Plane, time: Exposure) -> f64 {
    let statistics = SceneStatistics::of(luminance_cd_m2);
    let found = match time {
        Exposure::Automatic => {
            let key = statistics.log_average(TRIM, 1.0 - TRIM).map(|average| KEY / average);
            let clip = statistics.quantile(UNCLIPPED).map(f64::recip);
            key.zip(clip).map(|(key, clip)| key.min(clip))
        }
        Exposure::Long => statistics.quantile(DARK).map(|dark| KEY / dark),
        Exposure::Short => statistics.quantile(LIGHT).map(f64::recip),
    };
    found.unwrap_or(1.0)
}

impl ToneOperator for Constant {
    fn name(&self) -> &'static str {
        match self.time {
            Exposure::Automatic => "constant",
            Exposure::Long => "constant-long",
            Exposure::Short => "constant-short",
        }
    }

    fn fit(&self, guide: &SceneGuide<'_>, _viewing: &Viewing, _state: Option<&AdaptationState>) -> Box<dyn FittedTone> {
        let relative_per_cd_m2 = self.exposure * exposure_of(guide.luminance_cd_m2, self.time);
        Box::new(Scale { operator: self.name().to_owned(), relative_per_cd_m2 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(guide: &Plane, time: Exposure) -> Box<dyn FittedTone> {
        Constant { exposure: 1.0, time }.fit(&SceneGuide::of(guide), &Viewing::default(), None)
    }

    fn relative_of_ten(guide: &Plane) -> f32 {
        fitted(guide, Exposure::Automatic).relative_luminance(10.0)
    }

    #[test]
    fn an_even_picture_becomes_middle_grey() {
        assert!((relative_of_ten(&Plane::filled(16, 16, 10.0)) - 0.18).abs() < 1e-6);
    }

    /// A camera knows no unit of light.
    #[test]
    fn darkness_is_exposed_as_well() {
        for light in [1e-30, 9.9e-5, 1.01e-4, 1e6] {
            for (time, expected) in [(Exposure::Automatic, 0.18), (Exposure::Long, 0.18), (Exposure::Short, 1.0)] {
                let found = fitted(&Plane::filled(16, 16, light), time).relative_luminance(light);
                assert!((found - expected).abs() < 1e-6, "{light}, {time:?}: {found}");
            }
        }
    }

    /// Of 100×100 pixels the first `lit` ones have from 20 to 100 cd/m², all others `background`.
    fn lit_before(background: f32, lit: usize) -> Plane {
        let value = |index: usize| if index < lit { 20.0 + 80.0 * index as f32 / lit as f32 } else { background };
        Plane::from_fn(100, 100, |x, y| value(y * 100 + x))
    }

    /// A background that holds next to no light is empty, however much of the picture it is.
    #[test]
    fn an_empty_background_is_no_reason_to_expose_longer() {
        for time in [Exposure::Automatic, Exposure::Long, Exposure::Short] {
            for lit in [20, 100, 400, 484, 529, 2000] {
                let of = |background| exposure_of(&lit_before(background, lit), time);
                for background in [1e-12, 1e-6, 2e-5] {
                    let ratio = of(background) / of(0.0);
                    assert!((ratio - 1.0).abs() < 1e-6, "{time:?}, {lit} pixels lit before {background}: {ratio}");
                }
            }
        }
    }

    /// Nor does a single pixel make a picture empty, in a small picture either.
    #[test]
    fn a_firefly_empties_no_small_picture() {
        let mut small = Plane::filled(20, 20, 10.0);
        small.values_mut()[150] = 1e9;
        assert!((relative_of_ten(&small) - 0.18).abs() < 1e-6);
    }

    #[test]
    fn a_lamp_and_fireflies_do_not_darken_the_picture() {
        let mut lamp = Plane::filled(100, 100, 10.0);
        lamp.values_mut()[..200].fill(20_000.0);
        lamp.values_mut()[5000] = 1e9;
        assert!((relative_of_ten(&lamp) - 0.18).abs() < 1e-6);
    }

    #[test]
    fn a_night_scene_keeps_its_windows() {
        let mut night = Plane::filled(100, 100, 0.01);
        night.values_mut()[..1000].fill(100.0);
        assert!((fitted(&night, Exposure::Automatic).relative_luminance(100.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn what_is_said_of_darkness_is_not_nothing() {
        let said = fitted(&Plane::filled(8, 8, 2e-7), Exposure::Short).describe();
        assert_eq!(said, "constant-short: white at 2.000e-7 cd/m² of the scene");
    }

    #[test]
    fn long_shows_the_shadows_and_short_the_lights() {
        let steps = Plane::from_fn(1000, 1, |x, _| 1.0 + x as f32);
        assert!((fitted(&steps, Exposure::Long).relative_luminance(101.0) - 0.18).abs() < 1e-3);
        assert!((fitted(&steps, Exposure::Short).relative_luminance(999.0) - 1.0).abs() < 1e-6);
        let stop = Constant { exposure: 2.0, time: Exposure::Short };
        let brighter = stop.fit(&SceneGuide::of(&steps), &Viewing::default(), None);
        assert!((brighter.relative_luminance(999.0) - 2.0).abs() < 1e-6);
    }
}
