//! Ideal specular reflection: a mirror that is the same at every angle.
//!
//! Parameter: `reflectance` per linear RGB channel in [0, 1].
//!
//! Source: the law of reflection; T. Whitted, *An improved illumination model for shaded display* (1980). Not for real
//! metals, whose reflectance rises towards grazing angles: see the conductor.

use super::{BsdfSample, Lobe};
use glam::Vec3;

/// Ideal specular reflection.
#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    reflectance: Vec3,
}

impl Mirror {
    /// Reflectance per channel in [0, 1].
    pub fn new(reflectance: Vec3) -> Self {
        Self { reflectance }
    }

    pub(super) fn sample(&self, wo: Vec3) -> Option<BsdfSample> {
        (wo.z != 0.0).then(|| BsdfSample {
            wi: reflect_about_normal(wo),
            weight: self.reflectance,
            pdf: 1.0,
            lobe: Lobe::Delta,
            crossed_index: None,
        })
    }

    pub(super) fn albedo(&self) -> Vec3 {
        self.reflectance
    }
}

/// The mirror direction; on the same side as `wo`.
pub(super) fn reflect_about_normal(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}
