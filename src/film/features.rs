//! What the first surfaces of a pixel are, for the perception model and for denoisers.

use super::BlockSum;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Mean of what the first surfaces of a pixel are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PixelFeatures {
    /// Mean albedo.
    pub albedo: [f32; 3],
    /// Mean shading normal, not unit length at edges.
    pub normal: [f32; 3],
    /// Mean distance from the camera, scene units; samples that met nothing count as 0.
    pub depth: f32,
    /// Which object its first sample met, and whether anything shines there.
    pub object: ObjectFlags,
}

impl PixelFeatures {
    /// Adds a block to what `before` samples have seen.
    pub(super) fn add_block(&mut self, block: &BlockSum, before: u32) {
        if let (0, Some(id)) = (before, block.first_object_id) {
            self.object = self.object.with_object(id);
        }
        if block.shines {
            self.object = self.object.shining();
        }
        if block.samples > 0 {
            let share = block.samples as f32 / (before + block.samples) as f32;
            let scale = 1.0 / block.samples as f32;
            let blend = |old: &mut [f32; 3], sum: Vec3| {
                *old = Vec3::from_array(*old).lerp(sum * scale, share).to_array();
            };
            blend(&mut self.albedo, block.albedo);
            blend(&mut self.normal, block.normal);
            self.depth += (block.depth * scale - self.depth) * share;
        }
    }

    /// Blends in the features of other samples by the samples that both stand for.
    pub(super) fn add(&mut self, other: &PixelFeatures, own_samples: u32, other_samples: u32) {
        if own_samples == 0 {
            *self = *other;
        } else if other_samples > 0 {
            let share = other_samples as f32 / (own_samples as f32 + other_samples as f32);
            let blend = |old: &mut f32, new: f32| *old += (new - *old) * share;
            self.albedo.iter_mut().zip(other.albedo).for_each(|(old, new)| blend(old, new));
            self.normal.iter_mut().zip(other.normal).for_each(|(old, new)| blend(old, new));
            blend(&mut self.depth, other.depth);
            if other.object.shines() {
                self.object = self.object.shining();
            }
        }
    }

    /// What is left without a part that has this share, less than all, of the samples. Where that is no number, the
    /// whole.
    pub(super) fn without(&self, part: &Self, share: f32) -> Self {
        let left = |whole: f32, part: f32| {
            let left = whole + (whole - part) * (share / (1.0 - share));
            if left.is_finite() { left } else { whole }
        };
        let lefts = |whole: [f32; 3], part: [f32; 3]| std::array::from_fn(|c| left(whole[c], part[c]));
        let albedo: [f32; 3] = lefts(self.albedo, part.albedo);
        // Rounding must not make the albedo of black less than that.
        let albedo = albedo.map(|albedo| albedo.max(0.0));
        Self {
            albedo,
            normal: lefts(self.normal, part.normal),
            depth: left(self.depth, part.depth),
            object: self.object,
        }
    }
}

/// The number of an object, and whether anything shines in the same pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ObjectFlags(u32);

impl ObjectFlags {
    const SHINES: u32 = 1 << 31;

    /// Object number + 1 of the first sample; 0 where it met nothing.
    pub fn id(self) -> u32 {
        self.0 & !Self::SHINES
    }

    /// Whether any sample first met what sends light to the camera by itself: a lamp, a screen, the environment.
    pub fn shines(self) -> bool {
        self.0 & Self::SHINES != 0
    }

    fn with_object(self, id: u32) -> Self {
        Self(self.0 & Self::SHINES | id & !Self::SHINES)
    }

    fn shining(self) -> Self {
        Self(self.0 | Self::SHINES)
    }
}
