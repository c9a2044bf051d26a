//! Pictures in colour as guides.

use super::{SceneGuide, ToneOperator};
use crate::photometry::{luminance, scotopic_luminance};
use crate::plane::Plane;

/// What an operator looks at of a picture in colour: the luminance that the cones see, and the rods' where it asks for it.
#[derive(Clone, Debug)]
pub struct SceneLight {
    photopic_cd_m2: Plane,
    scotopic_cd_m2: Option<Plane>,
}

impl SceneLight {
    /// Of linear RGB in cd/m², row by row, `width` pixels wide. Negative light and what is not finite counts as black.
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
        Self { photopic_cd_m2: plane(width, rgb_cd_m2, luminance), scotopic_cd_m2 }
    }

    /// The same for whatever operator may come.
    #[must_use]
    pub fn with_rods(width: usize, rgb_cd_m2: &[[f32; 3]]) -> Self {
        let scotopic_cd_m2 = Some(plane(width, rgb_cd_m2, scotopic_luminance));
        Self { photopic_cd_m2: plane(width, rgb_cd_m2, luminance), scotopic_cd_m2 }
    }

    /// Pictures one below the other, each enlarged to `width` × `height` by repeating its pixels: a guide to all of them, for operators
    /// that count degrees. Without the rods' light unless all have it.
    #[must_use]
    pub fn stacked(pictures: &[&Self], width: usize, height: usize) -> Self {
        let stacked = |planes: Vec<&Plane>| {
            Plane::from_fn(width, height * planes.len(), |x, y| {
                let plane = planes[y / height];
                plane.get(x * plane.width() / width, y % height * plane.height() / height)
            })
        };
        let scotopic: Option<Vec<&Plane>> = pictures.iter().map(|picture| picture.scotopic_cd_m2.as_ref()).collect();
        Self {
            photopic_cd_m2: stacked(pictures.iter().map(|picture| &picture.photopic_cd_m2).collect()),
            scotopic_cd_m2: scotopic.map(stacked),
        }
    }

    /// For [`ToneOperator::fit`].
    #[must_use]
    pub fn guide(&self) -> SceneGuide<'_> {
        SceneGuide { scotopic_cd_m2: self.scotopic_cd_m2.as_ref(), ..SceneGuide::of(&self.photopic_cd_m2) }
    }

    /// Luminance, cd/m².
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

#[cfg(test)]
mod tests {
    use super::*;

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
