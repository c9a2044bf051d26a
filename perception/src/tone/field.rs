//! What the eye is adapted to, over a picture.

use serde::{Deserialize, Serialize};

use super::guide::{Pixel, SceneGuide};
use super::statistics::filled;
use crate::adaptation::{Mean, local_adaptation_cd_m2};
use crate::display::Display;
use crate::plane::Plane;

/// Whether the eye is adapted to the view as a whole or to each place by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdaptationScope {
    /// One state for the view.
    #[default]
    World,
    /// The geometric mean over a Gaussian of σ 0.25° (as wide as a disc of 1°) at each pixel: more contrast in all
    /// parts, at the price of contrast reversed along strong edges.
    Local,
}

/// Values of one picture, frozen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FrozenPlane {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl FrozenPlane {
    pub(super) fn of(plane: Plane) -> Self {
        Self { width: plane.width(), height: plane.height(), values: plane.into_values() }
    }

    pub(super) const fn width(&self) -> usize {
        self.width
    }

    pub(super) const fn height(&self) -> usize {
        self.height
    }

    /// The value at a pixel; `None` outside.
    pub(super) fn at(&self, pixel: Pixel) -> Option<f64> {
        if pixel.x >= self.width || pixel.y >= self.height {
            return None;
        }
        self.values.get(pixel.y.checked_mul(self.width)?.checked_add(pixel.x)?).map(|&value| f64::from(value))
    }
}

/// Local adaptation luminances of cones and rods; empty where the eye is adapted to the view as a whole.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct LocalAdaptation {
    cones: Option<FrozenPlane>,
    rods: Option<FrozenPlane>,
}

/// Adaptation luminances, cd/m².
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Adapted {
    pub(super) cones_cd_m2: f64,
    pub(super) rods_cd_m2: f64,
}

impl LocalAdaptation {
    pub(super) fn of(guide: &SceneGuide<'_>, scope: AdaptationScope, display: &Display) -> Self {
        if scope == AdaptationScope::World {
            return Self::default();
        }
        let local =
            |plane: &Plane| local_adaptation_cd_m2(&filled(plane), display, Mean::Geometric).ok().map(FrozenPlane::of);
        let rods = guide.scotopic_cd_m2.is_some().then(|| local(guide.rods())).flatten();
        Self { cones: local(guide.luminance_cd_m2), rods }
    }

    /// What the eye is adapted to at a pixel; `None` where the view as a whole decides.
    pub(super) fn at(&self, pixel: Pixel) -> Option<Adapted> {
        let cones_cd_m2 = self.cones.as_ref()?.at(pixel)?;
        let rods_cd_m2 = self.rods.as_ref().and_then(|rods| rods.at(pixel)).unwrap_or(cones_cd_m2);
        Some(Adapted { cones_cd_m2, rods_cd_m2 })
    }
}
