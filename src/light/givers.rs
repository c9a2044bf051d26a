//! What groups of emitters can give to a point, four groups at a time. Whether anything is in between is not asked.

use super::lanes::FourVectors;
use super::tree::{LightBounds, LightReceiver};
use glam::{Vec3, Vec4};
use std::f32::consts::PI;

/// [`LightBounds`] of up to four groups as the walk of the tree needs them, one a lane: no angle is computed on the
/// way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Givers {
    center: FourVectors,
    /// Squared, of the ball around the box.
    radius_squared: Vec4,
    /// 0 in lanes without a group.
    intensity: Vec4,
    axis: FourVectors,
    normals: Angles,
    cos_emission: Vec4,
}

impl Givers {
    /// Groups side by side.
    pub(super) const LANES: usize = 4;

    /// The givers among at most [`Self::LANES`] groups.
    pub(super) fn new(groups: &[LightBounds]) -> Self {
        let lanes = |value_of: &dyn Fn(&LightBounds) -> f32| {
            Vec4::from_array(std::array::from_fn(|lane| groups.get(lane).map_or(0.0, value_of)))
        };
        let vectors = |vector_of: &dyn Fn(&LightBounds) -> Vec3| {
            FourVectors::new(std::array::from_fn(|lane| groups.get(lane).map_or(Vec3::ZERO, vector_of)))
        };
        Self {
            center: vectors(&|bounds| bounds.center()),
            radius_squared: lanes(&|bounds| 0.25 * (bounds.max - bounds.min).length_squared()),
            intensity: lanes(&|bounds| bounds.intensity),
            axis: vectors(&|bounds| bounds.axis),
            normals: Angles {
                cos: lanes(&|bounds| if bounds.normal_angle >= PI { -1.0 } else { bounds.normal_angle.cos() }),
                sin: lanes(&|bounds| bounds.normal_angle.sin().max(0.0)),
            },
            cos_emission: lanes(&|bounds| bounds.emission_angle.cos()),
        }
    }

    /// Irradiance that each group gives to a receiver, roughly; 0 only where it can give none.
    #[inline]
    pub(super) fn importances(&self, receiver: &LightReceiver) -> Vec4 {
        let to_center = self.center.seen_from(receiver.position);
        let center_distance_squared = to_center.dot_each(&to_center);
        // Inside or near the box the distance to its centre says nothing.
        let distance_squared = center_distance_squared.max(self.radius_squared).max(Vec4::splat(f32::MIN_POSITIVE));
        let is_near = center_distance_squared.cmple(self.radius_squared);
        let way = to_center.over(center_distance_squared.sqrt());
        let sin_squared = self.radius_squared / center_distance_squared;
        let ball = Angles { cos: (1.0 - sin_squared).max(Vec4::ZERO).sqrt(), sin: sin_squared.sqrt() };
        // Rounding must not make anything 0 that is not.
        const SLACK: f32 = 1e-4;
        let leaving = Angles::of_cos(-self.axis.dot_each(&way)).less(&self.normals).less(&ball).cos + SLACK;
        let arriving = if receiver.normal == Vec3::ZERO {
            Vec4::ONE
        } else {
            (Angles::of_cos(way.dot(receiver.normal)).less(&ball).cos + SLACK).max(Vec4::ZERO)
        };
        let shines = leaving.cmpge(self.cos_emission);
        let far = self.intensity * leaving.max(Vec4::splat(1e-3)) * arriving / distance_squared;
        Vec4::select(is_near, self.intensity / distance_squared, Vec4::select(shines, far, Vec4::ZERO))
    }
}

/// An angle in [0, π] a lane.
#[derive(Clone, Copy, Debug)]
struct Angles {
    cos: Vec4,
    sin: Vec4,
}

impl Angles {
    #[inline(always)]
    fn of_cos(cos: Vec4) -> Self {
        Self { cos, sin: (1.0 - cos * cos).max(Vec4::ZERO).sqrt() }
    }

    /// The angles less others, at least 0.
    #[inline(always)]
    fn less(&self, other: &Self) -> Self {
        let is_none = self.cos.cmpge(other.cos);
        Self {
            cos: Vec4::select(is_none, Vec4::ONE, self.cos * other.cos + self.sin * other.sin),
            sin: Vec4::select(is_none, Vec4::ZERO, self.sin * other.cos - self.cos * other.sin),
        }
    }
}
