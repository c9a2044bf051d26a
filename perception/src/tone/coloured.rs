//! An operator's luminance of a picture's colours, where that is not its luminance of greys.

use super::acuity::AcuityFilter;
use super::gamut::hue;
use super::{FittedTone, Pixel, SavedTone};
use crate::photometry::luminance;
use crate::plane::PIXELS_PER_TASK;
use rayon::prelude::*;
use std::sync::Arc;

/// `fitted` for a picture of these colours, linear Rec. 709 RGB of any strength, row-major: asked for the luminance
/// of a scene luminance at a pixel, it takes that to have the pixel's colour. Anywhere else, at pixels without light,
/// and of what is asked in colours it says what `fitted` does, which is given back as it is where it keeps luminance
/// ([`FittedTone::keeps_luminance`]).
///
/// For what works on planes of luminance ([`crate::seen`]). A blue wall at three times the display's white has
/// `srgb`'s red and green far below their clip, and noise in them shows; predicted as a grey's, none of it does.
#[must_use]
pub fn coloured(fitted: Box<dyn FittedTone>, width: usize, rgb: &[[f32; 3]]) -> Box<dyn FittedTone> {
    if fitted.keeps_luminance() {
        return fitted;
    }
    let hues = rgb.par_iter().with_min_len(PIXELS_PER_TASK).map(|&rgb| hue(rgb).unwrap_or_default()).collect();
    Box::new(Coloured { fitted: fitted.into(), width, hues })
}

#[derive(Clone, Debug)]
struct Coloured {
    fitted: Arc<dyn FittedTone>,
    width: usize,
    /// Each pixel's colour at a luminance of 1 cd/m²; black where it has none.
    hues: Arc<[[f32; 3]]>,
}

impl FittedTone for Coloured {
    fn relative_luminance_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        let is_inside = pixel.x < self.width;
        let index = is_inside.then(|| pixel.y.saturating_mul(self.width).saturating_add(pixel.x));
        match index.and_then(|index| self.hues.get(index)) {
            Some(hue) if *hue != [0.0; 3] => {
                luminance(self.map_rgb_at(pixel, hue.map(|channel| channel * scene_cd_m2)))
            }
            _ => self.fitted.relative_luminance_at(pixel, scene_cd_m2),
        }
    }

    fn describe(&self) -> String {
        self.fitted.describe()
    }

    fn save(&self) -> SavedTone {
        self.fitted.save()
    }

    fn map_rgb_at(&self, pixel: Pixel, rgb_cd_m2: [f32; 3]) -> [f32; 3] {
        self.fitted.map_rgb_at(pixel, rgb_cd_m2)
    }

    fn chromatic_slope_at(&self, pixel: Pixel, scene_cd_m2: f32) -> f32 {
        self.fitted.chromatic_slope_at(pixel, scene_cd_m2)
    }

    fn keeps_luminance(&self) -> bool {
        false
    }

    fn without_colours(&self) -> Option<&dyn FittedTone> {
        Some(&*self.fitted)
    }

    fn acuity(&self) -> Option<AcuityFilter> {
        self.fitted.acuity()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::Viewing;
    use crate::plane::Plane;
    use crate::tone::{SceneGuide, operator};

    fn fit(name: &str) -> Box<dyn FittedTone> {
        let guide = Plane::filled(2, 1, 30.0);
        operator(name, None).unwrap().fit(&SceneGuide::of(&guide), &Viewing::default(), None)
    }

    #[test]
    fn luminance_is_that_of_the_picture_shown() {
        let colours = [[0.02, 0.05, 3.0], [0.7, 0.1, 0.2], [-0.588, 1.133, -0.101]];
        for name in ["srgb", "linear", "agx", "pbr-neutral", "absolute", "reinhard02"] {
            let shown = coloured(fit(name), 3, &colours);
            for (x, colour) in colours.into_iter().enumerate() {
                for scene in [0.01_f32, 1.0, 30.0, 200.0, 3000.0] {
                    let pixel = Pixel { x, y: 0 };
                    let picture = luminance(fit(name).map_rgb_at(pixel, colour.map(|c| c / luminance(colour) * scene)));
                    let found = shown.relative_luminance_at(pixel, scene).min(1.0);
                    assert!((found - picture).abs() < 1e-4, "{name} {colour:?} {scene}: {found} for {picture}");
                }
            }
        }
    }

    #[test]
    fn elsewhere_and_without_light_colours_are_grey() {
        let dark = [[0.0; 3], [f32::NAN; 3]];
        let shown = coloured(fit("agx"), 2, &dark);
        for pixel in [Pixel { x: 0, y: 0 }, Pixel { x: 1, y: 0 }, Pixel { x: 0, y: 7 }, Pixel::NOWHERE] {
            assert_eq!(shown.relative_luminance_at(pixel, 30.0), fit("agx").relative_luminance(30.0));
        }
        assert_eq!(shown.save(), fit("agx").save());
    }
}
