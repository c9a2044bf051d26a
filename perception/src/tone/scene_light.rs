//! Pictures in colour as guides.

use super::{SceneGuide, ToneOperator};
use crate::photometry::{luminance, scotopic_luminance};
use crate::plane::Plane;

/// What an operator looks at of a picture in colour: the luminance that the cones see, and the rods' where it asks
/// for it.
#[derive(Clone, Debug)]
pub struct SceneLight {
    photopic_cd_m2: Plane,
    scotopic_cd_m2: Option<Plane>,
    /// Light of what covers each pixel, where not all are covered whole.
    covering: Option<Covering>,
}

/// Light of what covers each pixel; NaN where nothing does.
#[derive(Clone, Debug)]
struct Covering {
    photopic_cd_m2: Plane,
    scotopic_cd_m2: Option<Plane>,
}

impl SceneLight {
    /// Light of a picture in linear Rec. 709 RGB, cd/m², row by row, `width` pixels wide, with the rods' where
    /// `operator` asks for it. Negative light and what is not finite counts as black.
    ///
    /// ```
    /// use fechner_perception::tone::{SceneLight, operator};
    /// let blue = [[0.0, 0.0, 0.1]; 4];
    /// let light = SceneLight::of(operator("ferwerda96", None).unwrap().as_ref(), 2, &blue);
    /// let rods = light.guide().scotopic_cd_m2.unwrap();
    /// assert!(rods.get(0, 0) > 4.0 * light.guide().luminance_cd_m2.get(0, 0));
    /// ```
    #[must_use]
    pub fn of(operator: &dyn ToneOperator, width: usize, rgb_cd_m2: &[[f32; 3]]) -> Self {
        let scotopic_cd_m2 = operator.sees_rods().then(|| plane(width, rgb_cd_m2, scotopic_luminance));
        Self { photopic_cd_m2: plane(width, rgb_cd_m2, luminance), scotopic_cd_m2, covering: None }
    }

    /// Light of such a picture for whatever operator may come: the rods' in any case.
    #[must_use]
    pub fn with_rods(width: usize, rgb_cd_m2: &[[f32; 3]]) -> Self {
        let scotopic_cd_m2 = Some(plane(width, rgb_cd_m2, scotopic_luminance));
        Self { photopic_cd_m2: plane(width, rgb_cd_m2, luminance), scotopic_cd_m2, covering: None }
    }

    /// This light as that of a picture that covers the share `alpha` of each pixel, 0 to 1, and whose light is
    /// multiplied by it. What is not there is no darkness to adapt to. An alpha of another size is not looked at.
    ///
    /// ```
    /// use fechner_perception::tone::{SceneLight, operator};
    /// let half_there = SceneLight::with_rods(2, &[[80.0; 3], [0.0; 3]]).where_covered(&[1.0, 0.0]);
    /// let eye = operator("ward94", None).unwrap();
    /// assert!(half_there.guide_for(eye.as_ref()).luminance_cd_m2.get(1, 0).is_nan());
    /// ```
    #[must_use]
    pub fn where_covered(mut self, alpha: &[f32]) -> Self {
        let is_partly = alpha.len() == self.photopic_cd_m2.values().len() && alpha.iter().any(|&alpha| alpha < 1.0);
        self.covering = is_partly.then(|| Covering {
            photopic_cd_m2: light_of_what_covers(&self.photopic_cd_m2, alpha),
            scotopic_cd_m2: self.scotopic_cd_m2.as_ref().map(|plane| light_of_what_covers(plane, alpha)),
        });
        self
    }

    /// The light of the picture as it is.
    fn all(&self) -> (&Plane, Option<&Plane>) {
        (&self.photopic_cd_m2, self.scotopic_cd_m2.as_ref())
    }

    /// What eyes look at.
    fn there(&self) -> (&Plane, Option<&Plane>) {
        match &self.covering {
            Some(covering) => (&covering.photopic_cd_m2, covering.scotopic_cd_m2.as_ref()),
            None => self.all(),
        }
    }

    /// Pictures one below the other, each enlarged to `width` × `height` by repeating its pixels: a guide to all of
    /// them, for operators that count degrees. Without the rods' light unless all have it.
    #[must_use]
    pub fn stacked(pictures: &[&Self], width: usize, height: usize) -> Self {
        let stacked = |planes: Vec<&Plane>| {
            Plane::from_fn(width, height * planes.len(), |x, y| {
                let plane = planes[y / height];
                plane.get(x * plane.width() / width, y % height * plane.height() / height)
            })
        };
        let both = |planes: Vec<(&Plane, Option<&Plane>)>| {
            let scotopic: Option<Vec<&Plane>> = planes.iter().map(|(_, scotopic)| *scotopic).collect();
            (stacked(planes.iter().map(|(photopic, _)| *photopic).collect()), scotopic.map(stacked))
        };
        let (photopic_cd_m2, scotopic_cd_m2) = both(pictures.iter().map(|picture| picture.all()).collect());
        let is_partly = pictures.iter().any(|picture| picture.covering.is_some());
        let covering = is_partly.then(|| {
            let (photopic_cd_m2, scotopic_cd_m2) = both(pictures.iter().map(|picture| picture.there()).collect());
            Covering { photopic_cd_m2, scotopic_cd_m2 }
        });
        Self { photopic_cd_m2, scotopic_cd_m2, covering }
    }

    /// A guide for [`ToneOperator::fit`] that holds all of the picture.
    #[must_use]
    pub fn guide(&self) -> SceneGuide<'_> {
        guide_of(self.all())
    }

    /// A guide for [`ToneOperator::fit`] of one operator: what the picture does not cover is left out where it would be
    /// taken for darkness.
    #[must_use]
    pub fn guide_for(&self, operator: &dyn ToneOperator) -> SceneGuide<'_> {
        guide_of(if operator.counts_darkness() { self.there() } else { self.all() })
    }

    /// Luminance, cd/m², of the picture as it is, before black.
    #[must_use]
    pub fn luminance_cd_m2(&self) -> &Plane {
        &self.photopic_cd_m2
    }
}

/// Light of each pixel as some receptors see it.
fn plane(width: usize, rgb_cd_m2: &[[f32; 3]], of: fn([f32; 3]) -> f32) -> Plane {
    Plane::from_fn(width, rgb_cd_m2.len() / width.max(1), |x, y| {
        let light = of(rgb_cd_m2[y * width + x]);
        if light.is_finite() { light.max(0.0) } else { 0.0 }
    })
}

fn guide_of<'a>((luminance_cd_m2, scotopic_cd_m2): (&'a Plane, Option<&'a Plane>)) -> SceneGuide<'a> {
    SceneGuide { scotopic_cd_m2, ..SceneGuide::of(luminance_cd_m2) }
}

/// A pixel of which less is covered is an edge of its neighbours, and what few samples of it found is mostly noise.
const HALF_COVERED: f32 = 0.5;

/// Light that is divided by its alpha, no brighter than the brightest that is covered whole; as it stands where it is
/// more than that, as flames and glows are, which cover little and are no lamps. NaN where nothing is, or little.
fn light_of_what_covers(plane: &Plane, alpha: &[f32]) -> Plane {
    let covered = plane.values().iter().zip(alpha);
    let whole = |(light, alpha): (&f32, &f32)| if *alpha >= 1.0 { *light } else { 0.0 };
    let brightest_whole = covered.map(whole).fold(0.0, f32::max);
    let width = plane.width();
    Plane::from_fn(width, plane.height(), |x, y| {
        let (light, alpha) = (plane.get(x, y), alpha[y * width + x]);
        if alpha >= HALF_COVERED {
            light.max((light / alpha).min(brightest_whole))
        } else if light > alpha.max(0.0) * brightest_whole {
            light
        } else {
            f32::NAN
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eyes see what covers each pixel: edges are as bright as what they are edges of, flames as they are.
    #[test]
    fn what_is_not_there_is_no_darkness() {
        let eye = crate::tone::operator("ward94", None).unwrap();
        let camera = crate::tone::operator("constant", None).unwrap();
        let rgb = [60.0, 30.0, 0.0, 40.0, 5.0, 0.0, 10.0, 0.0].map(|light| [light; 3]);
        let light = SceneLight::with_rods(4, &rgb).where_covered(&[1.0, 0.5, 0.0, 0.01, 0.0, 1.0, 0.4, 0.4]);
        let guide = light.guide_for(eye.as_ref());
        let found = guide.luminance_cd_m2.values();
        for (found, meant) in found.iter().zip([60.0, 60.0, f32::NAN, 40.0, 5.0, 0.0, f32::NAN, f32::NAN]) {
            assert!((found - meant).abs() < 1e-4 || found.is_nan() && meant.is_nan(), "{found}, not {meant}");
        }
        assert!(guide.scotopic_cd_m2.is_some_and(|rods| rods.get(2, 0).is_nan()));
        assert_eq!(light.guide_for(camera.as_ref()).luminance_cd_m2, light.luminance_cd_m2());
        let whole = SceneLight::with_rods(4, &rgb).where_covered(&[1.0; 8]);
        assert_eq!(whole.guide_for(eye.as_ref()).luminance_cd_m2, whole.luminance_cd_m2());
        let both = SceneLight::stacked(&[&light, &whole], 4, 2);
        let both = both.guide_for(eye.as_ref()).luminance_cd_m2;
        assert!(both.get(2, 0).is_nan() && both.get(2, 2) == 0.0);
    }

    #[test]
    fn stacked_pictures_lie_below_one_another() {
        let grey = |light: f32| SceneLight::with_rods(2, &[[light; 3]; 4]);
        let (small, large) = (grey(1.0), SceneLight::with_rods(4, &[[3.0; 3]; 16]));
        let both = SceneLight::stacked(&[&small, &large], 4, 4);
        let plane = both.luminance_cd_m2();
        assert_eq!((plane.width(), plane.height()), (4, 8));
        assert!((plane.get(3, 3) - 1.0).abs() < 1e-5 && (plane.get(0, 4) - 3.0).abs() < 1e-5);
        assert!(both.guide().scotopic_cd_m2.is_some_and(|rods| rods.same_size(plane)));
        let cones = SceneLight { scotopic_cd_m2: None, ..grey(1.0) };
        assert!(SceneLight::stacked(&[&small, &cones], 2, 2).guide().scotopic_cd_m2.is_none());
    }
}
