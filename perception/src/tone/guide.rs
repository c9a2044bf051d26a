//! What an operator is fitted to.

use crate::plane::Plane;

/// A pixel of a picture: column and row from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixel {
    /// Column, 0 at the left.
    pub x: usize,
    /// Row, 0 at the top.
    pub y: usize,
}

impl Pixel {
    /// A place outside every picture: what is asked there is answered with the state of the whole view.
    pub const NOWHERE: Self = Self { x: usize::MAX, y: usize::MAX };
}

/// What an operator may look at when it is fitted.
#[derive(Clone, Copy, Debug)]
pub struct SceneGuide<'a> {
    /// Scene luminance of the denoised guide, cd/m²; NaN where nothing is, neither light nor darkness.
    pub luminance_cd_m2: &'a Plane,
    /// Scene luminance of the guide as the rods see it, cd/m²
    /// ([`scotopic_luminance`](crate::photometry::scotopic_luminance)); the photopic luminance stands in where it is
    /// not given or has another size.
    pub scotopic_cd_m2: Option<&'a Plane>,
    /// Where the eye looks. Adaptation then comes from there and not from the picture as a whole.
    pub gaze: Option<Pixel>,
}

impl<'a> SceneGuide<'a> {
    /// A grey picture that is looked at all over.
    #[must_use]
    pub fn of(luminance_cd_m2: &'a Plane) -> Self {
        Self { luminance_cd_m2, scotopic_cd_m2: None, gaze: None }
    }

    /// This guide with the eye on one pixel; `None` for an eye that looks all over.
    #[must_use]
    pub fn with_gaze(self, gaze: Option<Pixel>) -> Self {
        Self { gaze, ..self }
    }

    /// What the rods see, as far as it is known.
    pub(super) fn rods(&self) -> &'a Plane {
        self.scotopic_cd_m2.filter(|plane| plane.same_size(self.luminance_cd_m2)).unwrap_or(self.luminance_cd_m2)
    }
}
