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
        let plane = |of: fn([f32; 3]) -> f32| {
            Plane::from_fn(width, rgb_cd_m2.len() / width.max(1), |x, y| {
                let light = of(rgb_cd_m2[y * width + x]);
                if light.is_finite() { light.max(0.0) } else { 0.0 }
            })
        };
        let scotopic_cd_m2 = operator.sees_rods().then(|| plane(scotopic_luminance));
        Self { photopic_cd_m2: plane(luminance), scotopic_cd_m2 }
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
